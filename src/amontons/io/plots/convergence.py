"""How a solver got to its solution: the error against iterations and time, stage by stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ...core.clock import duration
from ...problem.solution import TELLING, ContactStatus, Convergence, Step
from ...solvers import METHODS
from .layout import SMALL, Sheet, decades
from .style import COLOURS, INK

Array = NDArray[np.float64]
LINE, LIMIT = COLOURS[ContactStatus.STICK], "#D55E00"
TINTS = ("#E3EEF6", "#FCEFD5", "#DDF1EA", "#F6E4EE", "#E4F3FB", "#FBFAD9", "#ECE4F2", "#EEEEEE")
MARKED = 60  # judged points up to which each has a mark
COLUMNS = 4  # of the legend
WORDS = {kind.__name__: name for name, kind in METHODS.items()}  # of solvers by their class


def convergence_figure(record: Convergence, title: str = "") -> Figure:
    """Error against iterations and against time, with the tolerance.

    Bands have the colours of the stages, where a combination of methods ran.  Small dots are
    what a method measured itself between two judgements.  Time runs from the first iterate that
    was judged: what comes before is set-up.
    """
    history = record.history
    marks = [*_stage_marks(history), *_line_marks(history)]
    columns = min(COLUMNS, max(len(marks), 1))
    outcome = f"{record.outcome.name.lower().replace('_', ' ')} with {record.solver}"
    sheet = Sheet(9.6, 3.4, title=f"{title}: {outcome}" if title else outcome,
                  note=record.stamp, rows=-(-len(marks) // columns))  # fmt: skip
    left, right = (sheet.panel(x, 0.65, 4.1, 2.65) for x in (0.8, 5.2))
    seconds = np.array([step.seconds for step in history], dtype=float)
    setup = float(seconds.min(initial=np.inf)) if len(seconds) else 0.0
    iterations = np.array([step.iteration for step in history], dtype=float)
    low, high = _limits(record)
    before = f"set-up before: {duration(setup)}"
    if record.compiling >= TELLING:
        before += f"; {duration(record.compiling)} of compiling not counted"
    time = f"seconds after the first iterate\n({before})"
    for axes, x, label in ((left, iterations, "iterations"), (right, seconds - setup, time)):
        last = x.max(initial=0.0) or 1.0  # a solve that ends where it starts
        axes.set(xlim=(-0.02 * last, 1.04 * last), yscale="log", ylim=(low, high))
        decades(axes.yaxis, low, high)
        axes.set_xlabel(label, fontsize=SMALL)
        axes.grid(axis="y", alpha=0.25)
        _draw(axes, x, history, low)
        axes.axhline(record.tolerance, color=LIMIT, linestyle="--", linewidth=1)
    left.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    right.xaxis.set_major_locator(MaxNLocator(6))
    right.tick_params(labelleft=False)
    left.set_ylabel(f"error ({record.measure.value} measure)", fontsize=SMALL)
    sheet.legend(marks, columns)
    return sheet.done()


def _limits(record: Convergence) -> tuple[float, float]:
    """Ends of the axis of errors."""
    every = [e for step in record.history for e in (step.error, *step.own)]
    error = np.array(every, dtype=float)
    positive = error[(error > 0) & np.isfinite(error)]
    low = min(float(positive.min(initial=np.inf)), record.tolerance) / 10
    return low, 3 * max(float(positive.max(initial=0.0)), 10 * record.tolerance)


def _draw(axes: Axes, x: Array, history: Sequence[Step], low: float) -> None:
    """Bands of stages, the errors by the judge, and those by the method itself."""
    tints = _tints(history)
    for first, last in _stages(history):
        stage = history[first].stage
        if stage:
            axes.axvspan(x[max(first - 1, 0)], x[last], color=tints[stage], linewidth=0)
    error = _shown([step.error for step in history], low)
    own_x, own = [], []
    for k, step in enumerate(history):
        count = len(step.own)
        if count:
            start = x[k - 1] if k else x[k]
            own_x += [*np.linspace(start, x[k], count + 1)[1:], np.nan]
            own += [*step.own, np.nan]
    if own:
        axes.plot(own_x, _shown(own, low), color=INK, linewidth=0.8, marker=".", markersize=4)
    axes.plot(x, error, color=LINE, marker="o" if len(error) <= MARKED else "", markersize=4.5,
              linewidth=0.0 if own else 1.2)  # fmt: skip  # no line across known errors


def _shown(error: Sequence[float], low: float) -> Array:
    """Errors on a logarithmic axis: 0 at its end, gaps where there is no number."""
    values = np.array(error, dtype=float)
    return np.where(np.isfinite(values), np.maximum(values, low), np.nan)


def _stages(history: Sequence[Step]) -> list[tuple[int, int]]:
    """First and last point of each run of points of one stage."""
    if not history:
        return []
    ends = [k for k in range(1, len(history)) if history[k].stage != history[k - 1].stage]
    return list(zip([0, *ends], [*(k - 1 for k in ends), len(history) - 1], strict=True))


def _tints(history: Sequence[Step]) -> dict[str, str]:
    """A light colour for each stage, in order of appearance."""
    names = dict.fromkeys(step.stage for step in history if step.stage)
    return {name: TINTS[k % len(TINTS)] for k, name in enumerate(names)}


def _stage_marks(history: Sequence[Step]) -> list[Any]:
    """What the bands mean."""
    return [
        Patch(facecolor=tint, edgecolor=INK, linewidth=0.4, label=WORDS.get(stage, stage))
        for stage, tint in _tints(history).items()
    ]


def _line_marks(history: Sequence[Step]) -> list[Any]:
    """What the lines mean."""
    own = any(step.own for step in history)
    marks = [Line2D([], [], color=LINE, marker="o", markersize=4.5, label="judged",
                    linewidth=0.0 if own else 1.2)]  # fmt: skip
    if own:
        marks.append(Line2D([], [], color=INK, linewidth=0.8, marker=".", markersize=4,
                            label="by the method's own measure"))  # fmt: skip
    return [*marks, Line2D([], [], color=LIMIT, linestyle="--", linewidth=1, label="tolerance")]
