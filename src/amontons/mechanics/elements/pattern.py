"""Which nodes share a cell: the pattern of every matrix on a mesh, compiled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ..meshes.facets import Cells

Index = NDArray[np.int32]


def node_pattern(cells: Sequence[Cells], count: int) -> tuple[Index, Index]:
    """(row pointers (count + 1,), columns): the nodes that share a cell with each, sorted."""
    sizes = np.concatenate([np.full(len(b.nodes), b.nodes.shape[1]) for b in cells])
    starts = np.concatenate([[0], np.cumsum(sizes)])
    nodes = np.concatenate([b.nodes.ravel() for b in cells]).astype(np.int32)
    return _pattern(starts, nodes, count)


@njit(cache=True)
def _pattern(starts, nodes, count):
    """starts (k + 1,): where the nodes of every cell begin in `nodes`."""
    first = np.zeros(count + 1, np.int64)  # of the cells around a node, in `around`
    for node in nodes:
        first[node + 1] += 1
    first = np.cumsum(first)
    around, place = np.empty(len(nodes), np.int32), first[:-1].copy()
    for cell in range(len(starts) - 1):
        for node in nodes[starts[cell] : starts[cell + 1]]:
            around[place[node]] = cell
            place[node] += 1
    pointers, seen = np.zeros(count + 1, np.int32), np.full(count, -1, np.int32)
    for row in range(count):
        found = 0
        for cell in around[first[row] : first[row + 1]]:
            for node in nodes[starts[cell] : starts[cell + 1]]:
                if seen[node] != row:
                    seen[node] = row
                    found += 1
        pointers[row + 1] = pointers[row] + found
    columns = np.empty(pointers[count], np.int32)
    seen[:] = -1
    for row in range(count):
        end = pointers[row]
        for cell in around[first[row] : first[row + 1]]:
            for node in nodes[starts[cell] : starts[cell + 1]]:
                if seen[node] != row:
                    seen[node] = row
                    columns[end] = node
                    end += 1
        columns[pointers[row] : end].sort()
    return pointers, columns


@njit(cache=True)
def place_of(pointers, columns, row, column):
    """Where the block (row, column) of the pattern stands."""
    low, high = pointers[row], pointers[row + 1]
    while low < high:
        middle = (low + high) >> 1
        if columns[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low
