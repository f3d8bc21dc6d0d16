"""Reactions of a solution without geometry: in the friction cone, and ranked by size."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ...problem.solution import ContactStatus, FrictionSolution
from .layout import decades
from .style import COLOURS, INK, MARKERS, marker_size

WIDE = 1e2  # ratio of largest to smallest reaction above which axes are logarithmic


def cone_plane(axes: Axes, solution: FrictionSolution) -> None:
    """|r_T| against its bound: slipping contacts on the diagonal, sticking ones below."""
    bound = solution.problem.law.bound(solution.r)
    shear = np.linalg.norm(solution.r[:, 1:], axis=1)
    closed = (solution.status != ContactStatus.OPEN) & (bound > 0)
    axes.set(xlabel="friction bound  μ r_N", ylabel="tangential reaction  |r_T|",
             title="Reactions and the friction cone")  # fmt: skip
    if not closed.any():
        axes.text(0.5, 0.5, "no contact transmits friction", ha="center", va="center",
                  transform=axes.transAxes, color=INK)  # fmt: skip
        return
    low, high = bound[closed].min(), bound[closed].max()
    logarithmic = high > WIDE * low
    if logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        low = max(low, 1e-6 * high)  # what lies lower is rounding
        axes.set_xlim(low / 2, 2 * high)
        axes.set_ylim(low / 20, 2 * high)
        decades(axes.xaxis, low / 2, 2 * high)
        decades(axes.yaxis, low / 20, 2 * high)
        line = np.geomspace(low / 2, 2 * high, 50)
    else:
        axes.set_xlim(0, 1.1 * high)
        axes.set_ylim(0, 1.1 * high)
        line = np.linspace(0, 1.1 * high, 2)
    axes.plot(line, line, color=INK, linewidth=1)
    axes.fill_between(line, line, color=INK, alpha=0.05, linewidth=0)
    size = marker_size(int(closed.sum()))
    # slipping contacts, few and at the edge of the cone, are drawn larger and last
    for status, factor in ((ContactStatus.STICK, 1), (ContactStatus.SLIP, 2)):
        chosen = closed & (solution.status == status)
        axes.scatter(bound[chosen], shear[chosen], s=factor * size,
                     marker=MARKERS[status], color=COLOURS[status], alpha=0.8,
                     edgecolors="white", linewidths=0.3)  # fmt: skip


def ranked_reactions(axes: Axes, solution: FrictionSolution) -> None:
    """Normal reactions, largest first: how evenly the contacts carry the load."""
    normal = solution.r[:, 0]
    order = np.argsort(-normal, kind="stable")
    rank = np.arange(1, len(order) + 1)
    positive = normal[(normal > 0) & (solution.status != ContactStatus.OPEN)]
    axes.set(xlabel="contacts, largest reaction first", ylabel="normal reaction  r_N",
             title="How the contacts share the load")  # fmt: skip
    if positive.size and positive.max() > WIDE * positive.min():
        axes.set_yscale("log")
        low, high = max(positive.min(), 1e-9 * positive.max()) / 2, 2 * positive.max()
        axes.set_ylim(low, high)
        decades(axes.yaxis, low, high)
    elif positive.size:
        axes.set_ylim(0, 1.1 * positive.max())
    for status in ContactStatus:
        chosen = solution.status[order] == status
        axes.scatter(rank[chosen], normal[order][chosen], s=marker_size(len(order)),
                     marker=MARKERS[status], color=COLOURS[status], edgecolors=INK,
                     linewidths=0.3)  # fmt: skip
    axes.set_xlim(0, len(order) + 1)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
