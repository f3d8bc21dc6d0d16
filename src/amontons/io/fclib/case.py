"""An FCLib file as what the commands work on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .. import fclib
from ..case.overrides import override_settings
from ..case.settings import Settings
from ..readers import Case


def read(path: Path, overrides: Sequence[str] = (), method: str | None = None) -> Case:
    """The problem in a file; overrides can only speak of the solver."""
    problem = fclib.read_fclib(path)
    settings = override_settings(Settings(method or "auto"), overrides)
    return Case(problem, settings, path.stem, path, notes=_notes(problem))


def _notes(problem: fclib.FclibProblem) -> tuple[str, ...]:
    """How many equality constraints there are."""
    if problem.equalities is None:
        return ()
    count = problem.equalities.count
    return (f"{count} equality constraint{'s' if count > 1 else ''}, eliminated; their "
            "multipliers are l of the group solution",)  # fmt: skip
