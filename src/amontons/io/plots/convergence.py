"""How a solver got to its solution: the error against iterations and time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...problem.solution import TELLING, ContactStatus, Convergence
from .style import COLOURS, INK, stamp


def convergence_figure(record: Convergence, title: str = "") -> Figure:
    """Error against iterations and against time, with the tolerance.

    Time runs from the first iterate that was judged: what comes before is set-up.
    """
    figure = Figure(figsize=(10, 4), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    error = np.array([step.error for step in record.history])
    positive = error[(error > 0) & np.isfinite(error)]
    floor = min(positive.min(initial=np.inf), record.tolerance) / 10
    ceiling = 3 * max(positive.max(initial=0.0), 10 * record.tolerance)
    error = np.where(np.isfinite(error), np.maximum(error, floor), np.nan)
    marker = "o" if len(error) <= 60 else ""
    seconds = np.array([step.seconds for step in record.history])
    setup = float(seconds.min(initial=np.inf)) if len(seconds) else 0.0
    iterations = np.array([step.iteration for step in record.history])
    before = f"set-up before: {setup:.2g} s"
    if record.compiling >= TELLING:
        before += f"; {record.compiling:.2g} s of compiling not counted"
    time = f"seconds after the first iterate ({before})"
    for axes, x, label in ((left, iterations, "iterations"), (right, seconds - setup, time)):
        last = x.max(initial=0.0) or 1.0  # a solve that ends where it starts
        axes.set(xlim=(-0.02 * last, 1.17 * last), ylim=(floor, ceiling), yscale="log")
        axes.plot(x, error, color=COLOURS[ContactStatus.STICK], marker=marker, markersize=4,
                      linewidth=1.2)  # fmt: skip
        axes.axhline(record.tolerance, color="#D55E00", linestyle="--", linewidth=1)
        axes.text(0.995, record.tolerance * 1.15, "tolerance", ha="right", va="bottom",
                  transform=axes.get_yaxis_transform(), color="#D55E00",
                  fontsize=9)  # fmt: skip
        axes.set_xlabel(label)
        axes.grid(which="major", alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    left.xaxis.set_major_locator(MaxNLocator(integer=True))
    left.set_ylabel(f"error ({record.measure.value} measure)")
    outcome = f"{record.outcome.name.lower().replace('_', ' ')} with {record.solver}"
    figure.suptitle(f"{title}: {outcome}" if title else outcome, color=INK)
    stamp(figure, record.stamp)
    return figure
