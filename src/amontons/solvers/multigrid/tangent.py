"""The tangent of one solve: coarse levels with what the contacts change, renewed in parts.

A contact that still sticks or is open, and one that still slides about as it did, changes
nothing: only entries near the others are computed anew, and the difference is multiplied.
"""

from __future__ import annotations

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.coarsest import Factored, factored_at_rest
from ...linear.node_blocks import block_inverse
from .nodes import ContactNodes
from .products import Sum
from .truncation import Near, Truncation

Array = NDArray[np.float64]
TURNED = 0.3  # change of V and W, and of L by its size, up to which contacts slide as before


class Tangent:
    """Levels below k with the contacts of level k, for one solve or one thread.

    hierarchy: the levels, from k + 1 on to be cycled on; change (m, 3, 3): D on level k.
    """

    def __init__(self, truncation: Truncation) -> None:
        self.truncation, self.hierarchy = truncation, truncation.patched()
        self.sums: dict[int, Sum] = {}  # what changes on a level
        self.halves: dict[int, Sum] = {}  # of the products
        self.below: dict[int, Array] = {}  # what has changed in all, of the levels below k
        self.inverse: Array | Factored | None = None  # on level k, where that is the coarsest

    def begin(self, k: int, contacts: ContactNodes) -> None:
        """Take contacts on level k, whose tangent is that of open ones so far."""
        truncation = self.truncation
        for j, total in self.below.items():
            total[:] = 0.0
            self._put(j, np.arange(len(total), dtype=np.int32))
        self.hierarchy.coarse_inverse = truncation.hierarchy.coarse_inverse
        self.k, near, count = k, truncation.near[k], len(contacts.node)
        number = np.full(truncation.hierarchy.levels[k].A.nodes, -1, dtype=np.int32)
        number[contacts.node] = np.arange(count)
        self.row, self.column = number[near.row], number[near.column]
        self.change, self.inverse = np.zeros(near.base.shape), None
        one = np.tile(np.eye(3), (count, 1, 1))
        self.parts = one, one.copy(), np.zeros_like(one)

    def renew(self, V: Array, W: Array, L: Array, turned: float = TURNED) -> None:
        """The tangent W^T A V + L, for contacts whose V, W or L have changed more than that."""
        moved = np.empty(len(V), dtype=bool)
        _take_over(V, W, L, *self.parts, turned, moved)
        near, sums = self.truncation.near[self.k], self._sum(self.k)
        found = np.empty(len(near.row), dtype=np.int32)
        count = _change(self.row, self.column, near.base, *self.parts, moved, self.change,
                        sums.blocks, found)  # fmt: skip
        sums.found = found[:count].copy()
        if count:
            self._mask(near, sums)
            _add(sums.found, sums.blocks, self.change)
            self.inverse = None
            self._multiply()
        sums.clear()

    def solve(self, b: Array) -> Array:
        """The solution of the tangent on level k, the coarsest one; b (nodes, 3)."""
        if self.inverse is None:
            A, near = self.truncation.hierarchy.levels[self.k].A.stored(), self.truncation.near
            matrix = A.dense().reshape(A.nodes, 3, A.nodes, 3)
            matrix[near[self.k].row, :, near[self.k].column, :] += self.change
            size, k = np.abs(A.diagonal_blocks).max(axis=(1, 2)), np.arange(A.nodes)
            whole = matrix.reshape(3 * A.nodes, 3 * A.nodes)
            self.inverse = factored_at_rest(whole, matrix[k, :, k, :], size)
        return (self.inverse @ b.reshape(-1)).reshape(b.shape)

    # ---------------------------------------------------------------- levels below
    def _sum(self, k: int) -> Sum:
        if k not in self.sums:
            self.sums[k] = Sum.of(len(self.truncation.near[k].row))
        return self.sums[k]

    def _multiply(self) -> None:
        """Add what has changed on level k to the levels below."""
        truncation, last = self.truncation, len(self.hierarchy.levels) - 1
        for j in range(self.k, last):
            product, near = truncation.products[j], truncation.near[j + 1]
            sums = self._sum(j + 1)
            if j not in self.halves:
                self.halves[j] = Sum.of(len(product.row))
            product.add(self._sum(j), self.halves[j], sums)
            self._mask(near, sums)
            if j + 1 not in self.below:
                self.below[j + 1] = np.zeros(near.base.shape)
            _add(sums.found, sums.blocks, self.below[j + 1])
            self._put(j + 1, sums.found)
        if self.k < last:
            self.hierarchy.factor_coarsest()
        for j in range(self.k + 1, last + 1):
            self.sums[j].clear()

    def _mask(self, near: Near, sums: Sum) -> None:
        """Leave out padding."""
        if near.is_padded:
            _mask(sums.found, near.row_idle, near.column_idle, sums.blocks)

    def _put(self, k: int, found: NDArray[np.int32]) -> None:
        """Entries of the matrix of level k with their changes, and inverses of its blocks."""
        near, A = self.truncation.near[k], self.hierarchy.levels[k].A
        assert near.places is not None
        _put(found, near.places, near.base, self.below[k], A.data)
        own = near.own_of[found]
        own = own[own >= 0]
        entry = near.own[own]
        blocks = near.base[entry] + self.below[k][entry]
        A.inverse[A.rows.number[near.row[entry]]] = block_inverse(blocks, near.size[own])


@njit(cache=True)
def _take_over(V, W, L, V_old, W_old, L_old, turned, moved):  # noqa: PLR0913
    """Which contacts have moved; the old tangent of these becomes the new one."""
    for c in range(len(V)):
        far, bent, size = 0.0, 0.0, 0.0
        for a in range(3):
            for b in range(3):
                far = max(far, abs(V[c, a, b] - V_old[c, a, b]))
                far = max(far, abs(W[c, a, b] - W_old[c, a, b]))
                bent = max(bent, abs(L[c, a, b] - L_old[c, a, b]))
                size = max(size, abs(L[c, a, b]), abs(L_old[c, a, b]))
        moved[c] = far > turned or bent > turned * size
        if moved[c]:
            V_old[c], W_old[c], L_old[c] = V[c], W[c], L[c]


@njit(cache=True, error_model="numpy")
def _change(row, column, base, V, W, L, moved, known, more, found):  # noqa: PLR0913
    """W_i^T A V_j (+ L_i) - A - known for entries of contacts that have moved; their number.

    i, j: contacts of an entry, -1 where there is none.
    """
    half = np.empty((3, 3))
    count = 0
    for e in range(len(row)):
        i, j = row[e], column[e]
        if not ((i >= 0 and moved[i]) or (j >= 0 and moved[j])):
            continue
        found[count] = e
        count += 1
        A, D = base[e], more[e]
        for a in range(3):
            for b in range(3):
                if j >= 0:
                    half[a, b] = (
                        A[a, 0] * V[j, 0, b] + A[a, 1] * V[j, 1, b] + A[a, 2] * V[j, 2, b]
                    )
                else:
                    half[a, b] = A[a, b]
        for a in range(3):
            for b in range(3):
                D[a, b] = half[a, b]
                if i >= 0:
                    D[a, b] = (
                        W[i, 0, a] * half[0, b] + W[i, 1, a] * half[1, b]
                        + W[i, 2, a] * half[2, b]
                    )  # fmt: skip
                D[a, b] -= A[a, b] + known[e, a, b]
                if i == j:
                    D[a, b] += L[i, a, b]
    return count


@njit(cache=True)
def _mask(chosen, row_idle, column_idle, blocks):
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        for a in range(3):
            for b in range(3):
                if row_idle[e, a] or column_idle[e, b]:
                    blocks[e, a, b] = 0.0


@njit(cache=True)
def _add(chosen, blocks, out):
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        for a in range(3):
            for b in range(3):
                out[e, a, b] += blocks[e, a, b]


@njit(cache=True)
def _put(chosen, places, base, change, data):
    for c in range(len(chosen)):
        e = uint64(chosen[c])
        t = uint64(places[e])
        for a in range(3):
            for b in range(3):
                data[t, a, b] = base[e, a, b] + change[e, a, b]
