"""Bifurcation diagrams: one quantity of the solutions over the parameter."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ...analysis.paths.quantities import Quantity, values_of
from .layout import SMALL, Sheet
from .style import INK

if TYPE_CHECKING:
    from ...analysis.paths.path import Branch
    from ...mechanics.model import Model

Array = NDArray[np.float64]

LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
OF_ANY = "#999999"  # marks in the legend of branches of several colours
MARKS = {"FOLD": ("o", "fold"), "BRANCH": ("D", "branch point")}  # of kinds of events
# names of `Stop` at which a branch is cut off, and may go on
UNFINISHED = ("SINGULAR", "STEP_TOO_SMALL", "LOST", "MAX_POINTS", "TIME_LIMIT", "STOPPED")
DASHED = (0, (4, 2))
TOLD = {"sum r_N": "sum of the normal reactions", "unknowns": "size of the unknowns"}


def branch_figure(
    branches: Branch | Iterable[Branch], *, y: Quantity | None = None,
    x: Quantity | None = None, model: Model | None = None, label: str = "", title: str = "",
) -> Figure:  # fmt: skip
    """A quantity of the solutions over the parameter, folds and branch points marked.

    y, x: names of quantities as `Branch.values` takes them, "sum r_N", "displacement x top", or
    functions of one solution; by default the sum of the normal reactions, or the size of the
    unknowns, over the parameter.  model: where a name needs it.  label: instead of the name on
    the y axis.  Solutions of orientation -1 are dashed.
    """
    given: Any = branches
    several: list[Branch] = [given] if hasattr(given, "points") else list(given)
    sheet = Sheet(6.6, 4.3, title=title, note=_unfinished(several))
    axes = sheet.panel(0.95, 0.6, 5.45, 3.6)
    for k, branch in enumerate(several):
        draw_branch(axes, branch, y, LINES[k % len(LINES)], x=x, model=model)
    usual = _usual(several[0]) if several else "quantity"
    axes.set_xlabel(_label(x, several[0].name if several else "parameter"))
    axes.set_ylabel(label or _label(y, TOLD.get(usual, usual)))
    named = range(len(several)) if 1 < len(several) <= len(LINES) else ()
    handles = [Line2D([], [], color=LINES[k], linewidth=1.4, label=f"branch {k}")
               for k in named] + _marks(several)  # fmt: skip
    if handles:
        axes.legend(handles=handles, frameon=False, fontsize=SMALL)
    return sheet.done()


def _label(quantity: Quantity | None, usual: str) -> str:
    if quantity is None:
        return usual
    return quantity if isinstance(quantity, str) else getattr(quantity, "__name__", "quantity")


def _unfinished(branches: list[Branch]) -> str:
    """How many ends of branches are no ends of theirs, and why; "" where there are none."""
    stops = [s.name for branch in branches for s in branch.stops if s.name in UNFINISHED]
    if not stops:
        return ""
    reasons = ", ".join(dict.fromkeys(stops)).lower().replace("_", " ")
    count = f"{len(stops)} end" + ("s" if len(stops) > 1 else "")
    return f"NOT FINISHED ({count} of a branch: {reasons})"


def _marks(branches: list[Branch]) -> list[Line2D]:
    """What the marks and dashes mean that there are."""
    kinds = {event.kind.name for branch in branches for event in branch.events}
    fill = LINES[0] if len(branches) == 1 else OF_ANY
    marks = [
        Line2D([], [], linestyle="", marker=marker, markersize=5, color=fill,
               markeredgecolor=INK, markeredgewidth=0.6, label=name)
        for kind, (marker, name) in MARKS.items() if kind in kinds
    ]  # fmt: skip
    if any((branch.orientation < 0).any() for branch in branches):
        marks.append(Line2D([], [], color=INK, linewidth=1.2, linestyle=DASHED,
                            label="orientation −1"))  # fmt: skip
    return marks


def draw_branch(
    axes: Axes, branch: Branch, y: Quantity | None = None, colour: str = LINES[0],
    label: str | None = None, *, x: Quantity | None = None, model: Model | None = None,
) -> None:  # fmt: skip
    """One branch on given axes: a line, its folds as dots, branch points as diamonds.

    It is dashed where the orientation is -1.
    """
    across = branch.parameter if x is None else values_of(branch, x, model)
    values = _values(branch, y, model)
    runs = _runs(branch.orientation)
    for k, (first, last, dashed) in enumerate(runs):
        part = slice(first, last + 1)
        axes.plot(across[part], values[part], color=colour, linewidth=1.4,
                  linestyle=DASHED if dashed else "-",
                  label=label if k == 0 else None)  # fmt: skip
    if not runs:  # a line of one point can not be seen
        axes.plot(across, values, color=colour, marker="s", label=label)
    length = branch.arclength
    for kind, (marker, _) in MARKS.items():
        at = [event.arclength for event in branch.events if event.kind.name == kind]
        if at:
            axes.plot(np.interp(at, length, across), np.interp(at, length, values), marker,
                      color=colour, markersize=5, markeredgecolor=INK,
                      markeredgewidth=0.6)  # fmt: skip


def _runs(orientation: NDArray[np.int8]) -> list[tuple[int, int, bool]]:
    """First and last point of each part of one orientation, and whether that is -1."""
    negative = orientation < 0
    ends = [0, *(np.flatnonzero(np.diff(negative)) + 1).tolist(), len(negative)]
    return [
        (a, b, bool(negative[a])) for a, b in zip(ends, ends[1:], strict=False) if b > a
    ]


def _usual(branch: Branch) -> str:
    """The quantity that is shown unless another is asked for."""
    return "sum r_N" if hasattr(branch.problem, "solution") else "unknowns"


def _values(branch: Branch, y: Quantity | None, model: Model | None) -> Array:
    usual = _usual(branch)
    if y is None and usual == "unknowns":
        states = branch.states
        return states[:, 0] if states.shape[1] == 1 else np.linalg.norm(states, axis=1)
    return values_of(branch, usual if y is None else y, model)
