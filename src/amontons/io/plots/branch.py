"""Bifurcation diagrams: one quantity of the solutions over the parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .style import INK, stamp

if TYPE_CHECKING:
    from ...analysis.paths.path import Branch

LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKS = {"FOLD": ("o", "fold"), "BRANCH": ("D", "branch point")}  # of kinds of events
# names of `Stop` at which a branch is cut off, and may go on
UNFINISHED = ("SINGULAR", "STEP_TOO_SMALL", "LOST", "MAX_POINTS", "TIME_LIMIT", "STOPPED")
Quantity = Callable[[Any], float]  # of one solution


def branch_figure(
    branches: Branch | Iterable[Branch], *, quantity: Quantity | None = None,
    label: str = "", title: str = "",
) -> Figure:  # fmt: skip
    """A quantity of the solutions over the parameter, folds and branch points marked.

    quantity: a function of one solution (one entry of `Branch.solutions`), by default the size
    of the reactions, or of the unknowns.  label: its name and unit.
    """
    given: Any = branches
    several: list[Branch] = [given] if hasattr(given, "points") else list(given)
    figure = Figure(figsize=(6.4, 4.4), dpi=150, layout="constrained")
    axes = figure.subplots()
    for k, branch in enumerate(several):
        draw_branch(axes, branch, quantity, LINES[k % len(LINES)])
    axes.set_xlabel(several[0].name if several else "parameter")
    axes.set_ylabel(label or ("size of the reactions" if quantity is None else "quantity"))
    if title:
        axes.set_title(title, loc="left", fontsize="medium")
    handles = axes.get_legend_handles_labels()[0] + _marks(several)
    if handles:
        axes.legend(handles=handles, frameon=False)
    stamp(figure, _unfinished(several))
    return figure


def _unfinished(branches: list[Branch]) -> str:
    """How many ends of branches are no ends of theirs, and why; "" where there are none."""
    stops = [s.name for branch in branches for s in branch.stops if s.name in UNFINISHED]
    if not stops:
        return ""
    reasons = ", ".join(dict.fromkeys(stops)).lower().replace("_", " ")
    count = f"{len(stops)} end" + ("s" if len(stops) > 1 else "")
    return f"NOT FINISHED ({count} of a branch: {reasons})"


def _marks(branches: list[Branch]) -> list[Line2D]:
    """What the marks mean that there are."""
    kinds = {event.kind.name for branch in branches for event in branch.events}
    return [
        Line2D([], [], linestyle="", marker=marker, markersize=5, color="white",
               markeredgecolor=INK, label=name)
        for kind, (marker, name) in MARKS.items() if kind in kinds
    ]  # fmt: skip


def draw_branch(
    axes: Axes, branch: Branch, quantity: Quantity | None = None, colour: str = LINES[0],
    label: str | None = None,
) -> None:  # fmt: skip
    """One branch on given axes: a line, its folds as dots, branch points as diamonds."""
    values = _values(branch, quantity)
    alone = "s" if len(values) == 1 else None  # a line of one point can not be seen
    axes.plot(branch.parameter, values, color=colour, linewidth=1.4, label=label, marker=alone)
    length = branch.arclength
    for kind, (marker, _) in MARKS.items():
        at = [event for event in branch.events if event.kind.name == kind]
        if at:
            height = np.interp([event.arclength for event in at], length, values)
            axes.plot([e.parameter for e in at], height, marker, color=colour, markersize=5,
                      markeredgecolor=INK, markeredgewidth=0.6)  # fmt: skip


def _values(branch: Branch, quantity: Quantity | None) -> list[float]:
    if quantity is not None:
        return [float(quantity(solution)) for solution in branch.solutions]
    rows = branch.table()
    if rows and "norm" in rows[0]:
        return [row["norm"] for row in rows]
    return [float(np.linalg.norm(point.state)) for point in branch.points]
