"""Performance profiles: many methods on many problems."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

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
    figure = Figure(figsize=(4.6 * count + 0.4, 3.8), dpi=150, layout="constrained")
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
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
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("share of problems solved")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center",
                  ncols=min(len(names), 4), frameon=False)  # fmt: skip
    return figure


def _plain_ticks(axes: Axes, last: float) -> None:
    """Ticks 1, 2, 5, 10, … on a logarithmic axis of ratios; only powers of ten when long."""
    steps = (1.0, 1.2, 1.5, 2.0) if last < 2.5 else (1.0, 2.0, 5.0) if last < 1e3 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps, numticks=20))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
