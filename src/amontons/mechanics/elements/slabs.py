"""Cells in slabs across the longest direction of a mesh, so that threads can add them up.

Cells of two slabs that are not beside each other share no node.  So all even slabs can be added
at once, then all odd ones, and every entry is summed in the same order whoever does it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.threads import Range

Array = NDArray[np.float64]
Index = NDArray[np.int64]
COUNTS = (64, 32, 16, 8, 4)  # slabs that are tried
LEAST = 20_000  # cells of a mesh that is not cut


def in_slabs(points: Array, nodes: Index) -> tuple[Index, list[Range]]:
    """(nodes (k, a) of the cells slab by slab, ranges of the slabs); one slab if need be.

    How many there are depends on the mesh alone; within a slab the order of cells is kept.
    """
    whole = [(0, len(nodes))]
    if len(nodes) < LEAST:
        return nodes, whole
    axis = int(np.argmax(np.ptp(points, axis=0)))
    place = points[nodes[:, 0], axis].copy()
    for corner in nodes.T[1:]:
        place += points[corner, axis]
    rank = np.argsort(place, kind="stable")
    for count in COUNTS:
        ends = len(nodes) * np.arange(count + 1) // count
        slab = np.empty(len(nodes), dtype=np.int64)
        slab[rank] = np.repeat(np.arange(count), np.diff(ends))
        low = np.full(len(points), count)
        high = np.full(len(points), -1)
        for corner in nodes.T:
            np.minimum.at(low, corner, slab)
            np.maximum.at(high, corner, slab)
        if (high - low <= 1).all():
            order = np.argsort(slab, kind="stable")
            ranges = [(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True)]
            return np.ascontiguousarray(nodes[order]), ranges
    return nodes, whole
