"""Figures: Dolan-Moré profiles of the runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from amontons.analysis import performance_profile
from amontons.files import replacing
from amontons.plots import profile_figure

from .race import Runs, seconds
from .tables import PROFILED


def draw(runs: Runs, names: Sequence[str], path: Path) -> None:
    """Profiles of the named methods, one panel for each tolerance."""
    present = [n for n in names if all(n in entry["methods"] for entry in runs.values())]
    profiles = {t: performance_profile(seconds(runs, present, t)) for t in PROFILED}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        profile_figure(profiles, present).savefig(temporary)
