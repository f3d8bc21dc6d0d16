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
    return Case(problem, settings, path.stem, path)
