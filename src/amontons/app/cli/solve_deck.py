"""`amontons solve` of a deck whose state depends on the way: its steps, as `amontons run`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from ...core.clock import Deadline
from ...core.errors import InvalidInput
from ...core.files import put
from ...io.readers import Case
from .run import Wanted, make_steps
from .terminal import check_folder, check_writable

STEPS = "state depends on the way: its steps are made one after the other, as by amontons run"


def solve_in_steps(
    opened: Case, folder: str | None, json_copy: str | None, wanted: Wanted,
    of_one_state: Mapping[str, object],
) -> int:  # fmt: skip
    """Make the steps and write what `amontons run` writes; returns the exit code.

    of_one_state: what flags say that are made for one state, by name.  Raises InvalidInput
    where one of them says anything, or the time limit of all steps is no time.
    """
    for flag, value in of_one_state.items():
        if value:
            raise InvalidInput(f"--{flag}: for one state alone, the {STEPS}")
    if not wanted.quiet:
        click.echo(f"deck: the {STEPS}")
    check_writable(json_copy, "--json")
    place = check_folder(f"{opened.name}-results" if folder is None else folder)
    code = make_steps(opened, str(place), wanted, Deadline.after(wanted.time_limit))
    written = Path(place) / "solution.json"
    if json_copy == "-":
        click.echo(written.read_text(encoding="utf-8"), nl=False)
    elif json_copy is not None and Path(json_copy).resolve() != written.resolve():
        put(Path(json_copy), written.read_bytes())
    return code
