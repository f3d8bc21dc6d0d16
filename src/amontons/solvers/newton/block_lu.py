"""Sparse LU of 3x3 blocks without pivoting across blocks, for W plus a block diagonal.

Newton matrices of contact problems keep the pattern of W, so ordering (minimum degree on the
block graph) and symbolic factorisation are done once.  Rows are eliminated one after another
against the finished rows of U, in a dense work row: no search for positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.copies import copy_inplace
from ...linear.block_products import product_of_blocks, subtract_products_inplace
from ...problem.friction import FrictionProblem

Index = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Symbolic:
    """Elimination order and the fill it causes; indices are positions in that order.

    order (nc,): contact at each position; upper_*: columns of each row of U right of the
    diagonal; lower_*: columns of each row of L left of it, ascending.
    """

    order: Index
    upper_start: Index
    upper: Index
    lower_start: Index
    lower: Index

    @classmethod
    def of(cls, problem: FrictionProblem) -> Symbolic:
        """Order and fill of W, analysed once for all variants with its pattern."""
        return problem.kept_of_pattern(_analyse)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return self.order, self.upper_start, self.upper, self.lower_start, self.lower

    @cached_property
    def products(self) -> int:
        """Products of 3x3 blocks in one factorisation: what it costs."""
        return int(np.diff(self.upper_start)[self.lower].sum())

    @property
    def fill(self) -> int:
        """Blocks stored in L and U together, without the diagonal."""
        return 2 * len(self.upper)


def _analyse(problem: FrictionProblem) -> Symbolic:
    return analyse_pattern(problem.blocks.indptr, problem.blocks.indices)


def analyse_pattern(indptr: Index, indices: Index) -> Symbolic:
    """Minimum-degree order of a block graph and its fill; about nc deg nc / 64 operations."""
    order, start, later = _minimum_degree(indptr, indices)
    return Symbolic(order, *_structure(order, start, later))


@njit(cache=True, error_model="numpy")
def found(indptr, indices, row, column):
    """Where a block is stored, columns ascending; -1 where it is not."""
    low, high = indptr[row], indptr[row + 1]
    end = high
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low if low < end and indices[low] == column else -1


def analyse_doubled(indptr: Index, indices: Index) -> Symbolic:
    """The same of a pattern, indptr (n + 1,), whose rows and columns stand for two each."""
    order, start, later = _doubled(*_minimum_degree(indptr, indices))
    return Symbolic(order, *_structure(order, start, later))


@njit(cache=True, error_model="numpy")
def _doubled(order, start, later):
    """An order and what is still connected at each position, of both halves of every row."""
    n = len(order)
    halves, starts = np.empty(2 * n, np.int32), np.zeros(2 * n + 1, np.int32)
    left = np.empty(4 * len(later) + n, np.int32)
    at = 0
    for p in range(n):
        for half in range(2):
            halves[2 * p + half] = 2 * order[p] + half
            if half == 0:
                left[at] = 2 * order[p] + 1
                at += 1
            for k in range(start[p], start[p + 1]):
                left[at], left[at + 1] = 2 * later[k], 2 * later[k] + 1
                at += 2
            starts[2 * p + half + 1] = at
    return halves, starts, left[:at].copy()


@njit(cache=True, error_model="numpy")
def _count_bits(word):
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + (
        (word >> np.uint64(2)) & np.uint64(0x3333333333333333)
    )
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@njit(cache=True, error_model="numpy")
def _minimum_degree(indptr, indices):
    """Order, and for each position the contacts (not positions) still connected to it."""
    n = len(indptr) - 1
    words = (n + 63) // 64
    one = np.uint64(1)
    graph = np.zeros((n, words), dtype=np.uint64)
    for i in range(n):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if i != j:
                graph[i, j >> 6] |= one << np.uint64(j & 63)
                graph[j, i >> 6] |= one << np.uint64(i & 63)
    degree = np.zeros(n, dtype=np.int32)
    for i in range(n):
        for w in range(words):
            degree[i] += np.int32(_count_bits(graph[i, w]))
    alive = np.ones(n, dtype=np.bool_)
    order = np.empty(n, dtype=np.int32)
    start = np.zeros(n + 1, dtype=np.int32)
    later = np.empty(max(4 * len(indices), 16), dtype=np.int32)
    filled = 0
    neighbours = np.empty(n, dtype=np.int32)
    for position in range(n):
        best, pivot = n + 1, -1
        for i in range(n):
            if alive[i] and degree[i] < best:
                best, pivot = degree[i], i
        order[position] = pivot
        alive[pivot] = False
        count = 0
        for w in range(words):
            word = graph[pivot, w]
            base = w * 64
            while word != np.uint64(0):
                low = word & (~word + one)
                neighbours[count] = base + np.int64(_count_bits(low - one))
                count += 1
                word ^= low
        while filled + count > len(later):
            bigger = np.empty(2 * len(later), dtype=np.int32)
            copy_inplace(later, bigger[:filled])
            later = bigger
        pivot_word, pivot_bit = pivot >> 6, one << np.uint64(pivot & 63)
        for a in range(count):
            i = neighbours[a]
            later[filled + a] = i
            total = np.uint64(0)
            for w in range(words):
                merged = graph[i, w] | graph[pivot, w]
                graph[i, w] = merged
                total += _count_bits(merged)
            graph[i, i >> 6] &= ~(one << np.uint64(i & 63))
            graph[i, pivot_word] &= ~pivot_bit
            degree[i] = np.int32(total) - 2
        filled += count
        start[position + 1] = filled
    return order, start, later[:filled].copy()


@njit(cache=True, error_model="numpy")
def _structure(order, start, later):
    """Columns of U by row and of L by row, as positions, both ascending."""
    n = len(order)
    place = np.empty(n, dtype=np.int32)
    for p in range(n):
        place[order[p]] = p
    upper = np.empty(len(later), dtype=np.int32)
    for p in range(n):
        row = place[later[start[p] : start[p + 1]]]
        row.sort()
        upper[start[p] : start[p + 1]] = row
    lower_start = np.zeros(n + 1, dtype=np.int32)
    for k in upper:
        lower_start[k + 1] += 1
    for p in range(n):
        lower_start[p + 1] += lower_start[p]
    fill = lower_start[:n].copy()
    lower = np.empty(len(upper), dtype=np.int32)
    for p in range(n):
        for k in range(start[p], start[p + 1]):
            i = upper[k]
            lower[fill[i]] = p
            fill[i] += 1
    return start, upper, lower_start, lower


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _invert3(a, out):
    """3x3 inverse by cofactors; False when the block is singular."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c01 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c02 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    if det == 0.0 or not np.isfinite(det):
        return False
    inv = 1.0 / det
    out[0, 0] = c00 * inv
    out[1, 0] = c01 * inv
    out[2, 0] = c02 * inv
    out[0, 1] = (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]) * inv
    out[1, 1] = (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]) * inv
    out[2, 1] = (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]) * inv
    out[0, 2] = (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]) * inv
    out[1, 2] = (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]) * inv
    out[2, 2] = (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]) * inv
    return True


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def factorise_inplace(  # noqa: PLR0913
    indptr,
    indices,
    data,
    extra,
    order,
    upper_start,
    upper,
    lower_start,
    lower,
    U,
    L,
    inverse,
    work,
):
    """LU of W + blockdiag(extra) into U, L (fill/2, 3, 3) and inverse pivots (nc, 3, 3).

    work (nc, 3, 3) must be zero on entry and is zero on exit; False at a singular pivot.
    """
    n = len(order)
    place = np.empty(n, dtype=np.int32)
    for p in range(n):
        place[order[p]] = p
    for p in range(n):  # no views of blocks: their references would be counted in the loops
        i = order[p]
        for k in range(indptr[i], indptr[i + 1]):
            t = place[indices[k]]
            for a in range(3):
                for b in range(3):
                    work[t, a, b] = data[k, a, b]
        for a in range(3):
            for b in range(3):
                work[p, a, b] += extra[i, a, b]
        for k in range(lower_start[p], lower_start[p + 1]):
            c = lower[k]
            for a in range(3):
                w0, w1, w2 = work[c, a, 0], work[c, a, 1], work[c, a, 2]
                for b in range(3):
                    L[k, a, b] = (
                        w0 * inverse[c, 0, b] + w1 * inverse[c, 1, b] + w2 * inverse[c, 2, b]
                    )
                    work[c, a, b] = 0.0
            first, last = uint64(upper_start[c]), uint64(upper_start[c + 1])
            subtract_products_inplace(work, upper, U, L, uint64(k), first, last)
        regular = _invert3(work[p], inverse[p])
        for a in range(3):
            for b in range(3):
                work[p, a, b] = 0.0
        for j in range(upper_start[p], upper_start[p + 1]):
            t = upper[j]
            for a in range(3):
                for b in range(3):
                    U[j, a, b] = work[t, a, b]
                    work[t, a, b] = 0.0
        if not regular:
            return False
    return True


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def solve_inplace(order, upper_start, upper, lower_start, lower, U, L, inverse, b, x):  # noqa: PLR0913
    """x = (L U)^-1 b; b and x (nc, 3) in contact order."""
    n = len(order)
    y = np.empty((n, 3))
    for p in range(n):
        i, first, last = order[p], uint64(lower_start[p]), uint64(lower_start[p + 1])
        y0, y1, y2 = product_of_blocks(L, lower, y, first, last, last)
        y[p, 0], y[p, 1], y[p, 2] = b[i, 0] - y0, b[i, 1] - y1, b[i, 2] - y2
    for p in range(n - 1, -1, -1):
        first, last = uint64(upper_start[p]), uint64(upper_start[p + 1])
        y0, y1, y2 = product_of_blocks(U, upper, y, first, last, last)
        y0, y1, y2 = y[p, 0] - y0, y[p, 1] - y1, y[p, 2] - y2
        for a in range(3):
            y[p, a] = inverse[p, a, 0] * y0 + inverse[p, a, 1] * y1 + inverse[p, a, 2] * y2
    for p in range(n):
        i = order[p]
        x[i, 0], x[i, 1], x[i, 2] = y[p, 0], y[p, 1], y[p, 2]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def newton_step_inplace(  # noqa: PLR0913
    indptr, indices, data, A, B, F, order, upper_start, upper, lower_start, lower, dr
):  # fmt: skip
    """Solve (A + B W) dr = -F by block LU; all (nc, 3, 3) and (nc, 3).

    Returns the largest residual relative to the largest entry of F; infinite when a pivot is
    singular.
    """
    nc = len(F)
    rows = np.empty_like(data)
    for i in range(nc):
        b = B[i]
        for k in range(indptr[i], indptr[i + 1]):
            w, out = data[k], rows[k]
            for a in range(3):
                for c in range(3):
                    out[a, c] = b[a, 0] * w[0, c] + b[a, 1] * w[1, c] + b[a, 2] * w[2, c]
    U, L = np.empty((len(upper), 3, 3)), np.empty((len(upper), 3, 3))
    inverse, work = np.empty((nc, 3, 3)), np.zeros((nc, 3, 3))
    if not factorise_inplace(
        indptr, indices, rows, A, order, upper_start, upper, lower_start, lower,
        U, L, inverse, work,
    ):  # fmt: skip
        return np.inf
    solve_inplace(order, upper_start, upper, lower_start, lower, U, L, inverse, -F, dr)
    worst = size = 0.0
    for i in range(nc):
        for a in range(3):
            t = F[i, a] + A[i, a, 0] * dr[i, 0] + A[i, a, 1] * dr[i, 1] + A[i, a, 2] * dr[i, 2]
            for k in range(indptr[i], indptr[i + 1]):
                j, w = indices[k], rows[k]
                t += w[a, 0] * dr[j, 0] + w[a, 1] * dr[j, 1] + w[a, 2] * dr[j, 2]
            if not abs(t) <= worst:
                worst = abs(t)
            size = max(size, abs(F[i, a]))
    return worst / size if size > 0.0 else 0.0
