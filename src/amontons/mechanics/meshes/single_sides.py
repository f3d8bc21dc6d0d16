"""Sides of cells that no other cell has: compiled, with little more memory than the sides take.

Sides are gathered by their least node, so each is compared with a few others only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit

FEW = 32  # sides that are compared each with each


def single_sides(sides: NDArray[np.int32], points: int) -> NDArray[np.bool_]:
    """Which sides (k, nodes per side) have nodes that no other side has, in any order: (k,)."""
    return _single(sides, points)


@njit(cache=True, error_model="numpy")
def _single(sides, points):
    count, size = sides.shape
    start = np.zeros(points + 1, np.int64)
    least = np.empty(count, np.int32)
    for k in range(count):
        low = sides[k, 0]
        for a in range(1, size):
            low = min(low, sides[k, a])
        least[k] = low
        start[low + 1] += 1
    for i in range(points):
        start[i + 1] += start[i]
    order = np.empty(count, np.int32)
    for k in range(count):
        order[start[least[k]]] = k
        start[least[k]] += 1  # becomes where the next node starts
    out = np.ones(count, np.bool_)
    first = 0
    for i in range(points):
        last = start[i]
        if last - first <= FEW:
            _compare(sides, order[first:last], out)
        else:  # a node with very many cells
            group = order[first:last].copy()
            marks = np.empty(last - first, np.uint64)
            for s in range(last - first):
                marks[s] = _mark(sides[group[s]])
            by_mark = np.argsort(marks)
            begin = 0
            for s in range(1, last - first + 1):
                if s == last - first or marks[by_mark[s]] != marks[by_mark[begin]]:
                    _compare(sides, group[by_mark[begin:s]], out)
                    begin = s
        first = last
    return out


@njit(cache=True, error_model="numpy")
def _compare(sides, group, out):
    """Mark those of some sides that another one of them is too."""
    for s in range(len(group)):
        for t in range(s + 1, len(group)):
            if _same(sides[group[s]], sides[group[t]]):
                out[group[s]] = out[group[t]] = False


@njit(cache=True, error_model="numpy")
def _mark(nodes):
    """A number that sides with the same nodes share, and hardly any others."""
    total = np.uint64(0)
    for node in nodes:
        mixed = np.uint64(node) * np.uint64(0x9E3779B97F4A7C15)
        mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
        total += mixed ^ (mixed >> np.uint64(32))
    return total


@njit(cache=True, error_model="numpy")
def _same(one, other):
    """Whether two sides have the same nodes, which are different ones in each."""
    for a in one:
        found = False
        for b in other:
            found = found or a == b
        if not found:
            return False
    return True
