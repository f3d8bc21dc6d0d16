"""Contact of a 2D model: gap, slip, pressure and shear along its surfaces."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ...problem.solution import ContactStatus
from .contact_pairs import ContactPair
from .style import COLOURS, INK, MARKERS, marker_size

Array = NDArray[np.float64]
MAX_NAMES = 6  # pairs side by side under their names


def draw_curves(left: Axes, right: Axes, pairs: list[ContactPair]) -> None:
    """Gap and slip (left), pressure and shear with its bound (right) along the surfaces.

    Several pairs stand side by side, each with curves of its own.
    """
    start = 0.0
    size = marker_size(sum(len(pair.gap) for pair in pairs))
    lengths = [float(np.ptp(_arc(pair.points))) for pair in pairs]
    space = 0.08 * max(lengths)
    for pair, length in zip(pairs, lengths, strict=True):
        _draw_pair(left, right, pair, start, size)
        if start > 0:
            for axes in (left, right):
                axes.axvline(start - space / 2, color=INK, linewidth=0.6, alpha=0.4)
        if 1 < len(pairs) <= MAX_NAMES:
            for axes in (left, right):
                axes.text(start + length / 2, 0.99, pair.name, ha="center", va="top", color=INK,
                          transform=axes.get_xaxis_transform(), fontsize=9)  # fmt: skip
        start += length + space
    where = "position along the surface" if len(pairs) == 1 else "position along the surfaces"
    left.set(xlabel=where, ylabel="length", title="Gap (marks) and slip (dashed)")
    right.set(xlabel=where, ylabel="traction",
              title="Pressure, shear (dashed), its bound (grey)")  # fmt: skip
    if 1 < len(pairs) <= MAX_NAMES:  # room for the names
        for axes in (left, right):
            axes.margins(y=0.12)


def _draw_pair(left: Axes, right: Axes, pair: ContactPair, start: float, size: float) -> None:
    """The curves of one pair, its first contact at `start`."""
    s = _arc(pair.points)
    order = np.argsort(s, kind="stable")
    s = start + s[order]
    left.plot(s, pair.gap[order], color=INK, linewidth=1)
    left.plot(s, pair.slip[order, 0], color=INK, linewidth=1, linestyle="--")
    for status in ContactStatus:
        chosen = pair.status[order] == status
        left.scatter(s[chosen], pair.gap[order][chosen], s=size, zorder=3,
                     marker=MARKERS[status], color=COLOURS[status], edgecolors=INK,
                     linewidths=0.3)  # fmt: skip
    bound = pair.bound[order]
    right.plot(s, pair.pressure[order], color=INK, linewidth=1.2)
    right.fill_between(s, -bound, bound, color=INK, alpha=0.08, linewidth=0)
    right.plot(s, pair.shear[order, 0], color="#D55E00", linewidth=1.2, linestyle="--")


def _arc(points: Array) -> Array:
    """Coordinate along the main direction of points (n, 2); growing with x, else with y."""
    centred = points - points.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    lead = axis[np.argmax(np.abs(axis))]
    s = centred @ (axis if lead > 0 else -axis)
    return s - s.min(initial=0.0)
