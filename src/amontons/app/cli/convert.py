"""`amontons convert`: a problem as an FCLib file, in the form one wants."""

from __future__ import annotations

import os
from collections.abc import Sequence

import click

from ...core.errors import InvalidInput, UnsupportedForm
from ...io.fclib import write_fclib
from ...problem.friction import Form
from .sources import open_source
from .terminal import check_writable

SUFFIXES = (".hdf5", ".h5")


def run(source: str, target: str, form: str | None, overrides: Sequence[str]) -> None:
    """Read, condense if asked to, write."""
    check_writable(target, "target", SUFFIXES)
    opened = open_source(source, overrides)
    if os.path.exists(target) and opened.path is not None and os.path.samefile(
        target, opened.path
    ):
        raise InvalidInput(f"{target}: this is the source; expected the name of another file")
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
