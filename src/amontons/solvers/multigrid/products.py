"""P^T D P for a D of which a few entries are not zero: only these are visited.

Where the terms go is found out once; `Sum` is what one solve adds them to.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.block_products import add_block_inplace
from ...linear.node_blocks import NodeBlocks
from ...linear.transfer import Transfer
from ..contract import Breakdown

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Places = NDArray[np.int32]


@dataclass(eq=False)
class Sum:
    """Blocks (m, 3, 3), zero but at the entries that were found last."""

    blocks: Array
    marks: NDArray[np.bool_] = field(init=False)
    found: Places = field(init=False)

    def __post_init__(self) -> None:
        self.marks = np.zeros(len(self.blocks), dtype=bool)
        self.found = np.empty(0, dtype=np.int32)

    @classmethod
    def of(cls, size: int) -> Sum:
        """All zero."""
        return cls(np.zeros((size, 3, 3)))

    def clear(self) -> None:
        """Zero again."""
        _clear(self.found, self.blocks)
        self.found = self.found[:0]


@dataclass(eq=False)
class Product:
    """Where the terms of P^T D P go: first half = D P, then P^T half.

    column (m,), row (h,): nodes of the entries of D and of half on the side that is multiplied;
    first_half, first (of each): where their places begin in half and target, which hold for
    every entry and every parent of that node the entry of half, and that of the coarse matrix.
    """

    P: Transfer
    column: Places
    first_half: Places
    half: Places
    row: Places
    first: Places
    target: Places

    @classmethod
    def of(cls, P: Transfer, row: Index, column: Index, coarse: NodeBlocks) -> Product:
        """Of entries at (row, column); targets are places in the data of the coarse matrix."""
        counts = np.diff(P.indptr).astype(np.int64)
        half, half_row, half_column = _first_half(
            P.indptr, P.indices, row, column, int(counts[column].sum()), P.coarse
        )
        places = _second_half(P.indptr, P.indices, half_row, half_column, coarse.indptr,
                              coarse.indices, int(counts[half_row].sum()))  # fmt: skip
        if places.min(initial=0) < 0:
            raise Breakdown("contact multigrid: a coarse matrix lacks couplings near contacts")
        first_half, first = _starts(counts[column]), _starts(counts[half_row])
        return cls(P, column.astype(np.int32), first_half, half, half_row, first, places)

    def into(self, slots: Index) -> None:
        """Let targets be numbers among these places, ascending."""
        self.target = np.searchsorted(slots, self.target).astype(np.int32)

    def add(self, change: Sum, half: Sum, coarse: Sum) -> None:
        """coarse += P^T change P; half is zero before and after."""
        P = self.P
        values: Any = P.blocks if len(P.blocks) else P.weights
        one, other = (_half_blocks, _rest_blocks) if len(P.blocks) else (_spread, _spread)
        _collect(one, half, (P.indptr, values, self.column, self.first_half, self.half), change)
        _collect(other, coarse, (P.indptr, values, self.row, self.first, self.target), half)
        half.clear()


def _collect(kernel: Any, out: Sum, where: tuple[Any, ...], given: Sum) -> None:
    """Add what a kernel makes of the entries of `given`, and note where that is."""
    found = np.empty(len(out.blocks), dtype=np.int32)
    count = kernel(*where, given.found, given.blocks, out.blocks, out.marks, found)
    out.found = found[:count].copy()
    out.marks[out.found] = False


def _starts(counts: Index) -> Places:
    """Where each of some rows begins, (k,)."""
    return (np.cumsum(counts) - counts).astype(np.int32)


@njit(cache=True)
def _clear(chosen, blocks):
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        for a in range(3):
            for b in range(3):
                blocks[e, a, b] = 0.0


@njit(cache=True)
def _first_half(p_ptr, p_idx, row, column, total, coarse):  # noqa: PLR0913
    half = np.empty(total, np.int32)
    rows, columns = np.empty(total, np.int32), np.empty(total, np.int32)
    mark = np.full(coarse, -1, np.int64)
    at, count, first = 0, 0, 0
    for e in range(len(row)):
        if e > 0 and row[e] != row[e - 1]:
            first = count
        j = column[e]
        for b in range(p_ptr[j], p_ptr[j + 1]):
            parent = p_idx[b]
            if mark[parent] < first:
                mark[parent] = count
                rows[count], columns[count] = row[e], parent
                count += 1
            half[at] = mark[parent]
            at += 1
    return half, rows[:count].copy(), columns[:count].copy()


@njit(cache=True)
def _second_half(p_ptr, p_idx, row, column, indptr, indices, total):  # noqa: PLR0913
    out = np.empty(total, np.int64)
    at = 0
    for h in range(len(row)):
        for a in range(p_ptr[row[h]], p_ptr[row[h] + 1]):
            first, last = indptr[p_idx[a]], indptr[p_idx[a] + 1]
            place = first + np.searchsorted(indices[first:last], column[h])
            out[at] = place if place < last and indices[place] == column[h] else -1
            at += 1
    return out


@njit(cache=True, error_model="numpy")
def _noted(t, marks, found, count):
    """How many entries are found with t, which is put behind them if it is new."""
    if not marks[t]:
        marks[t] = True
        found[count] = t
        count += 1
    return count


@njit(cache=True, error_model="numpy")
def _spread(p_ptr, weights, node, first, place, chosen, blocks, out, marks, found):  # noqa: PLR0913
    """Add the chosen blocks, each times the weights of its node, at their places in out."""
    count = 0
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        i, at = uint64(node[e]), uint64(first[e])
        for b in range(uint64(p_ptr[i]), uint64(p_ptr[i + uint64(1)])):
            t = uint64(place[at])
            at += uint64(1)
            count = _noted(t, marks, found, count)
            add_block_inplace(out, t, weights[b], blocks, e)
    return count


@njit(cache=True, error_model="numpy", inline="always")
def _nine(B):
    """Row after row."""
    return B[0, 0], B[0, 1], B[0, 2], B[1, 0], B[1, 1], B[1, 2], B[2, 0], B[2, 1], B[2, 2]


@njit(cache=True, error_model="numpy", inline="always")
def _transposed(B):
    """Column after column."""
    return B[0, 0], B[1, 0], B[2, 0], B[0, 1], B[1, 1], B[2, 1], B[0, 2], B[1, 2], B[2, 2]


@njit(cache=True, error_model="numpy", inline="always")
def _add_product(a, b, out, t):
    """out[t] += a b, each nine numbers: an array would be read anew after every write."""
    a0, a1, a2, a3, a4, a5, a6, a7, a8 = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8 = b
    out[t, 0, 0] += a0 * b0 + a1 * b3 + a2 * b6
    out[t, 0, 1] += a0 * b1 + a1 * b4 + a2 * b7
    out[t, 0, 2] += a0 * b2 + a1 * b5 + a2 * b8
    out[t, 1, 0] += a3 * b0 + a4 * b3 + a5 * b6
    out[t, 1, 1] += a3 * b1 + a4 * b4 + a5 * b7
    out[t, 1, 2] += a3 * b2 + a4 * b5 + a5 * b8
    out[t, 2, 0] += a6 * b0 + a7 * b3 + a8 * b6
    out[t, 2, 1] += a6 * b1 + a7 * b4 + a8 * b7
    out[t, 2, 2] += a6 * b2 + a7 * b5 + a8 * b8


@njit(cache=True, error_model="numpy")
def _half_blocks(p_ptr, blocks, node, first, place, chosen, change, out, marks, found):  # noqa: PLR0913
    """The same with blocks of P from the right."""
    count = 0
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        i, at, B = uint64(node[e]), uint64(first[e]), _nine(change[e])
        for b in range(uint64(p_ptr[i]), uint64(p_ptr[i + uint64(1)])):
            t = uint64(place[at])
            at += uint64(1)
            count = _noted(t, marks, found, count)
            _add_product(B, _nine(blocks[b]), out, t)
    return count


@njit(cache=True, error_model="numpy")
def _rest_blocks(p_ptr, blocks, node, first, place, chosen, half, out, marks, found):  # noqa: PLR0913
    """The same with their transposes from the left."""
    count = 0
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        i, at, B = uint64(node[e]), uint64(first[e]), _nine(half[e])
        for b in range(uint64(p_ptr[i]), uint64(p_ptr[i + uint64(1)])):
            t = uint64(place[at])
            at += uint64(1)
            count = _noted(t, marks, found, count)
            _add_product(_transposed(blocks[b]), B, out, t)
    return count
