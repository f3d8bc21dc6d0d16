"""Figures: Dolan-Moré profiles of the runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from amontons.analysis import performance_profile
from amontons.core.files import replacing
from amontons.io.plots import profile_figure

from .race import CLOCK, TOLERANCES, Cost, Runs, costs_to


def draw(
    runs: Runs, names: Sequence[str], path: Path, cost: Cost = CLOCK,
    tolerances: Sequence[float] = TOLERANCES,
) -> bool:  # fmt: skip
    """Profiles of the named methods, one panel for each tolerance; whether there is a figure.

    A method that does not count operations is not in a figure of them.
    """
    present = [n for n in names if all(_counted(entry, n, cost) for entry in runs.values())]
    if len(present) < 2:
        path.unlink(missing_ok=True)
        return False
    profiles = {t: performance_profile(costs_to(runs, present, t, cost)) for t in tolerances}
    what = "time" if cost.by == "seconds" else "operations"
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        profile_figure(profiles, present, what).savefig(temporary)
    return True


def _counted(entry: dict, name: str, cost: Cost) -> bool:
    """True where a method was run, and tells this cost."""
    run = entry["methods"].get(name)
    return run is not None and not math.isnan(cost.spent(run))
