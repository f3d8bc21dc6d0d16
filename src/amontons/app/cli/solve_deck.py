"""`amontons solve` of a deck whose state depends on the way: its steps, as `amontons run`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ...core.errors import InvalidInput
from ...core.files import put
from .run import run
from .terminal import check_folder, check_writable

STEPS = "state depends on the way: its steps are made one after the other, as by amontons run"


def solve_in_steps(
    source: str, name: str, overrides: Sequence[str], flags: dict[str, object],
    folder: str | None, json_copy: str | None, *, quiet: bool, report: bool,
) -> int:  # fmt: skip
    """Make the steps and write what `amontons run` writes; returns the exit code.

    flags: values of flags of `amontons solve` by name, None, False or "" where not given.
    Raises InvalidInput for those that are made for one state.
    """
    for flag in ("start", "uniqueness", "frd", "fclib-error"):
        if flags[flag]:
            raise InvalidInput(f"--{flag}: for one state alone, the {STEPS}")
    silent = quiet or json_copy == "-"
    if not silent:
        click.echo(f"deck: the {STEPS}")
    check_writable(json_copy, "--json")
    for key in ("method", "max_iterations", "contact_tolerance"):
        if flags[key]:
            overrides = [*overrides, f"solver.{key}={flags[key]}"]
    tolerance, time_limit = flags["tolerance"], flags["time_limit"]
    place = check_folder(f"{name}-results" if folder is None else folder)
    code = run(
        source, overrides, tolerance, time_limit, str(place), None, 10, False, False, silent,  # type: ignore[arg-type]
        report=report,
    )  # fmt: skip
    written = Path(place) / "solution.json"
    if json_copy == "-":
        click.echo(written.read_text(encoding="utf-8"), nl=False)
    elif json_copy is not None and Path(json_copy).resolve() != written.resolve():
        put(Path(json_copy), written.read_bytes())
    return code
