"""`amontons convert`: a problem as an FCLib file or a deck; results as .frd."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import click

from ...core.errors import InvalidInput, UnsupportedForm
from ...io.fclib import write_fclib
from ...problem.friction import Form
from .sources import open_source
from .terminal import check_writable

SUFFIXES = (".hdf5", ".h5", ".inp", ".frd", ".dat")  # the last three are dealt with before


def run(
    source: str, target: str, form: str | None, overrides: Sequence[str],
    dialect: str | None, penalty: float | None,
) -> None:  # fmt: skip
    """Read, condense if asked to, write."""
    if target.lower().endswith(".inp"):
        if form is not None:
            raise InvalidInput(f"--form: {target} is a deck; forms are those of FCLib files")
        _deck(source, target, overrides, dialect or "calculix", penalty)
        return
    if dialect is not None or penalty is not None:
        raise InvalidInput(f"--dialect, --penalty: of decks; {target} does not end in .inp")
    if target.lower().endswith((".frd", ".dat")):
        _viewed(source, target, overrides)
        return
    check_writable(target, "target", SUFFIXES)
    opened = open_source(source, overrides)
    _check_other(target, opened.path)
    problem = opened.discrete()
    wanted = Form(form) if form is not None else problem.form
    if wanted is Form.GLOBAL and problem.form is Form.DELASSUS:
        raise UnsupportedForm(
            f"{source}: holds W and q only, M and H can not be found from them; "
            "convert the original global file or the case"
        )
    texts = getattr(problem, "texts", {})
    if wanted is Form.DELASSUS:
        problem = problem.condensed()
    title = texts.get("title", opened.title.encode()).decode("utf-8", "surrogateescape")
    about = texts.get("description", b"").decode("utf-8", "surrogateescape")
    write_fclib(problem, target, title=title, description=about)
    click.echo(f"{target}: {wanted.value} form, {problem.contacts} contacts")


def _check_other(target: str, source: Path | None) -> None:
    if os.path.exists(target) and source is not None and os.path.samefile(target, source):
        raise InvalidInput(f"{target}: this is the source; expected the name of another file")


def _deck(
    source: str, target: str, overrides: Sequence[str], dialect: str, penalty: float | None
) -> None:
    """A model as a deck, and what is another there."""
    from ...io.decks.written import write_deck

    check_writable(target, "target")
    opened = open_source(source, overrides)
    _check_other(target, opened.path)
    with opened.naming_keys():
        notes = write_deck(opened.model, target, dialect, penalty=penalty)
    for note in notes:
        click.echo(note, err=True)
    model = opened.model
    count = sum(len(body.mesh.points) for body in model.bodies)
    click.echo(f"{target}: {count} nodes, {len(model.contacts)} contacts, for {dialect}")


def _viewed(source: str, target: str, overrides: Sequence[str]) -> None:
    """Results as files of CalculiX: of a results folder, a .vtu of ours, or solved now."""
    from ...core.files import replacing
    from ...io.answers.write import Shown, write_answer

    check_writable(target, "target")
    path = Path(source)
    path = path / "solution.vtu" if os.path.isdir(path) else path
    if path.suffix.lower() != ".vtu" or not path.is_file():
        raise InvalidInput(
            f"{source}: expected results with a solution.vtu, of `amontons solve {source} -o "
            f"{path.stem}-results`"
        )
    if overrides:
        raise InvalidInput("--set: results have no keys to replace")
    shown = Shown.of_vtu(path)
    with replacing(target) as temporary:
        write_answer(temporary, shown)
    click.echo(f"{target}: displacements of {len(shown.points)} nodes")
