"""Performance profiles: many methods on many problems."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from .layout import Sheet

Array = NDArray[np.float64]
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES = ("-", "--", "-.", ":")


def profile_figure(
    profiles: dict[float, tuple[Array, Array]], names: list[str], what: str = "time"
) -> Figure:
    """Performance profiles, one panel per tolerance: (tau, rho) by tolerance.

    what: the cost that is compared, for the label of the axis.
    """
    count = len(profiles)
    columns = min(len(names), 4) or 1
    sheet = Sheet(4.6 * count + 0.5, 3.6, rows=-(-len(names) // columns))
    panels = [sheet.panel(0.75 + 4.6 * k, 0.6, 4.1, 2.6) for k in range(count)]
    for axes, (tolerance, (tau, rho)) in zip(panels, profiles.items(), strict=True):
        last = 1.5 * max(float(tau[-1]), 1.1)
        for k, name in enumerate(names):
            axes.step(np.append(tau, last), np.append(rho[k], rho[k, -1]), where="post",
                      color=LINES[k % len(LINES)], linestyle=DASHES[k % len(DASHES)],
                      label=name, marker="o", markevery=[0], markersize=4,
                      clip_on=False)  # fmt: skip
        axes.set(xscale="log", xlim=(last**-0.04, last), ylim=(0, 1.03),
                 xlabel=f"{what} / best {what}", title=f"tolerance {tolerance:g}")  # fmt: skip
        _plain_ticks(axes, last)
        axes.grid(alpha=0.25)
        axes.tick_params(labelleft=axes is panels[0])
    if panels:
        panels[0].set_ylabel("share of problems solved")
        sheet.legend(panels[0].get_legend_handles_labels()[0], columns)
    return sheet.done()


def _plain_ticks(axes: Axes, last: float) -> None:
    """Ticks 1, 2, 5, 10, … on a logarithmic axis of ratios; only powers of ten when long."""
    steps = (1.0, 1.2, 1.5, 2.0) if last < 2.5 else (1.0, 2.0, 5.0) if last < 1e3 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps, numticks=20))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
