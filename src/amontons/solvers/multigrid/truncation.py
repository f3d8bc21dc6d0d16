"""Coarse levels that see the states of the contacts: a Galerkin tangent changed near them only.

The tangent on the finest level is A' = W^T A V + L (`nodes`).  With D_0 = A' - A, which
has entries only in rows and columns of contact nodes, the coarse matrices are

    A_k' = A_k + D_k,    D_k = P^T D_(k-1) P,

so that an update touches the entries near the surface and nothing else: every solve has a copy
of these rows, the others are those of the linear problem.  Directions that the contacts hold
altogether have neither row nor column left; they rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.hierarchy import Hierarchy, inverse_at_rest
from ...linear.level_matrix import LevelMatrix
from ...linear.node_blocks import NodeBlocks, block_inverse
from ...linear.patched import PatchedBlocks, Rows
from ...linear.transfer import Transfer
from ..contract import Breakdown
from .nodes import ContactNodes

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(eq=False)
class Near:
    """Entries of one level that the contacts change, m of them.

    slots (m,): their places in the data of A; row, column (m,); base (m, 3, 3): without
    contacts; own (k,): which entries are diagonal blocks, size (k,): of these; row_idle,
    column_idle (m, 3): padding; rows: those of A, places (m,): of the entries among theirs.
    """

    slots: Index
    row: Index
    column: Index
    base: Array
    own: Index
    size: Array
    row_idle: NDArray[np.bool_]
    column_idle: NDArray[np.bool_]
    rows: Rows | None = None
    places: Index | None = None

    @classmethod
    def of(cls, A: NodeBlocks, slots: Index, idle: NDArray[np.bool_]) -> Near:
        """The entries at slots (m,), ascending."""
        row = np.searchsorted(A.indptr, slots, side="right") - 1
        column = A.indices[slots].astype(np.int64)
        own = np.flatnonzero(row == column)
        base = A.data[slots]
        size = np.abs(base[own]).max(axis=(1, 2), initial=0.0)
        rows = Rows.of(A, np.unique(row))
        places = np.searchsorted(rows.slots, slots)
        return cls(slots, row, column, base, own, size, idle[row], idle[column], rows, places)

    @classmethod
    def of_operator(cls, A: LevelMatrix, nodes: Index, idle: NDArray[np.bool_]) -> Near:
        """Rows and columns of contact nodes of a matrix that is not stored, nor changed."""
        rows = A.rows(np.sort(nodes))
        row = np.repeat(np.sort(nodes), np.diff(rows.indptr))
        column = rows.indices.astype(np.int64)
        other = ~np.isin(column, nodes)
        whole = np.concatenate([rows.data, rows.data[other].swapaxes(1, 2)])
        row, column = (
            np.concatenate([row, column[other]]),
            np.concatenate([column, row[other]]),
        )
        order = np.lexsort((column, row))
        row, column, none = row[order], column[order], np.empty(0, dtype=np.int64)
        return cls(none, row, column, whole[order], none, np.empty(0), idle[row], idle[column])

    def put(self, A: PatchedBlocks, change: Array) -> None:
        """The matrix with a change (m, 3, 3) of these entries."""
        changed = self.base + change
        A.data[self.places] = changed
        own = A.rows.number[self.row[self.own]]
        A.inverse[own] = block_inverse(changed[self.own], self.size)

    def mask(self, change: Array) -> None:
        """Leave out padding."""
        if self.row_idle.any() or self.column_idle.any():
            change[self.row_idle] = 0.0
            change.swapaxes(1, 2)[self.column_idle] = 0.0


class Truncation:
    """All Near of a hierarchy whose contact nodes on the geometric levels are given."""

    def __init__(self, hierarchy: Hierarchy, contacts: list[Index]) -> None:
        self.hierarchy = hierarchy
        self.near: list[Near] = []
        self.products: list[Product] = []
        none: Index = np.empty(0, dtype=np.int64)
        slots: NDArray[Any] = none
        coarse: NodeBlocks | None = None
        for k, level in enumerate(hierarchy.levels):
            A = level.A
            idle = np.zeros(3 * A.nodes, dtype=bool)
            if level.P is not None:
                idle[level.P.idle] = True
            elif k:
                idle[hierarchy.levels[k - 1].P.coarse_idle] = True
            idle = idle.reshape(-1, 3)
            if k or A.is_stored:
                known = A.stored() if coarse is None else coarse
                if k < len(contacts):
                    slots = np.union1d(slots, _touching(known, contacts[k]))
                near = Near.of(known, slots, idle)
            else:
                near = Near.of_operator(A, contacts[k], idle)
            self.near.append(near)
            if level.P is not None:
                touched = contacts[k + 1] if k + 1 < len(contacts) else none
                coarse = _near_surface(hierarchy.levels[k + 1].A, level.P, near.row, touched)
                self.products.append(Product.of(level.P, near, coarse))
                slots = np.unique(self.products[-1].target)
        for k, product in enumerate(self.products):
            places = np.searchsorted(self.near[k + 1].slots, product.target)
            product.target = places.astype(np.int32)

    def change(self, k: int, contacts: ContactNodes, V: Array, W: Array, L: Array) -> Array:
        """D on level k, (m, 3, 3), for contacts at nodes of that level."""
        near = self.near[k]
        number = np.full(self.hierarchy.levels[k].A.nodes, -1, dtype=np.int64)
        number[contacts.node] = np.arange(len(contacts.node))
        out = np.zeros_like(near.base)
        _change(number[near.row], number[near.column], near.base, V, W, L, out)
        near.mask(out)
        return out

    def tangent(self) -> Hierarchy:
        """Levels of one solve, without contacts so far."""
        return self.hierarchy.patched([near.rows for near in self.near[1:]])  # type: ignore[misc]

    def install(
        self, tangent: Hierarchy, k: int, change: Array, whole: dict[int, Array] | None = None
    ) -> None:
        """Coarse levels below k for one more change on level k, which itself stays as it is.

        whole: of the levels, by their number, the sum of all changes before, none without it;
        this one is added.
        """
        whole = {} if whole is None else whole
        levels = tangent.levels
        for j in range(k, len(levels) - 1):
            near, coarse = self.near[j + 1], np.zeros_like(self.near[j + 1].base)
            P, product = levels[j].P, self.products[j]
            assert P is not None
            product.apply(P, self.near[j], change, coarse)
            near.mask(coarse)
            whole[j + 1] = whole[j + 1] + coarse if j + 1 in whole else coarse
            near.put(levels[j + 1].A, whole[j + 1])  # type: ignore[arg-type]
            change = coarse
        if k < len(levels) - 1:
            tangent.invert_coarsest()

    def solve(self, k: int, change: Array, b: Array) -> Array:
        """The solution of the tangent on level k, the coarsest one; b (nodes, 3)."""
        A, near = self.hierarchy.levels[k].A.stored(), self.near[k]
        matrix = A.dense().reshape(A.nodes, 3, A.nodes, 3)
        place: Any = near.row, slice(None), near.column
        np.add.at(matrix, place, change)
        whole = matrix.reshape(3 * A.nodes, 3 * A.nodes)
        size = np.abs(A.diagonal_blocks).max(axis=(1, 2))
        index = np.arange(A.nodes)
        inverse = inverse_at_rest(whole, matrix[index, :, index, :], size)
        return (inverse @ b.reshape(-1)).reshape(b.shape)


def _near_surface(A: LevelMatrix, P: Transfer, row: Index, contact: Index) -> NodeBlocks:
    """A stored matrix, or of another one the rows that contacts may change, others empty.

    row: fine rows that they change; contact: contact nodes of A.
    """
    if A.is_stored:
        return A.stored()
    own = np.zeros(P.fine, dtype=bool)
    own[row] = True
    changed = np.zeros(A.nodes, dtype=bool)
    changed[P.indices[np.repeat(own, np.diff(P.indptr))]] = True
    if contact.size:
        changed[A.rows(np.sort(contact)).indices] = True
    node = np.flatnonzero(changed)
    found = A.rows(node)
    indptr = np.zeros(A.nodes + 1, dtype=np.int32)
    indptr[node + 1] = np.diff(found.indptr)
    inverse = np.empty((0, 3, 3))
    return NodeBlocks(np.cumsum(indptr, dtype=np.int32), found.indices, found.data, inverse)


def _touching(A: NodeBlocks, nodes: Index) -> Index:
    """Places of all entries in rows or columns of these nodes, ascending."""
    inside = np.zeros(A.nodes, dtype=bool)
    inside[nodes] = True
    return _places(A.indptr, A.indices, inside)


@njit(cache=True)
def _places(indptr, indices, inside):
    count = 0
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            if inside[i] or inside[indices[k]]:
                count += 1
    out = np.empty(count, np.int64)
    count = 0
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            if inside[i] or inside[indices[k]]:
                out[count] = k
                count += 1
    return out


@dataclass(eq=False)
class Product:
    """Where the terms of P^T D P go: first half = D P, then P^T half.

    half (t,): for every entry and every parent of its column, the entry of D P; row (h,): the
    fine rows of these; target: for every entry of D P and every parent of its row, the entry of
    the coarse Near.
    """

    half: NDArray[np.int32]
    row: NDArray[np.int32]
    target: NDArray[np.int32]

    @classmethod
    def of(cls, P: Transfer, near: Near, coarse: NodeBlocks) -> Product:
        """With targets as places in the data of the coarse matrix for now."""
        counts = np.diff(P.indptr).astype(np.int64)
        half, row, column = _first_half(
            P.indptr, P.indices, near.row, near.column, int(counts[near.column].sum()), P.coarse
        )
        places = _second_half(P.indptr, P.indices, row, column, coarse.indptr, coarse.indices,
                              int(counts[row].sum()))  # fmt: skip
        if places.min(initial=0) < 0:
            raise Breakdown("contact multigrid: a coarse matrix lacks couplings near contacts")
        return cls(half, row, places)

    def apply(self, P: Transfer, near: Near, change: Array, coarse: Array) -> None:
        """coarse += P^T change P; entries that do not change cost nothing."""
        half = np.zeros((len(self.row), 3, 3))
        if len(P.blocks):
            _half_blocks(P.indptr, P.blocks, near.column, self.half, change, half)
            _rest_blocks(P.indptr, P.blocks, self.row, self.target, half, coarse)
        else:
            _spread(P.indptr, P.weights, near.column, self.half, change, half)
            _spread(P.indptr, P.weights, self.row, self.target, half, coarse)


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
def _change(row, column, base, V, W, L, out):  # noqa: PLR0913
    """W_i^T A V_j (+ L_i) - A for entries between contacts i and j, -1 where there is none."""
    half = np.empty((3, 3))
    for e in range(len(row)):
        i, j = row[e], column[e]
        if i < 0 and j < 0:
            continue
        A, D = base[e], out[e]
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
                if i >= 0:
                    D[a, b] = (
                        W[i, 0, a] * half[0, b] + W[i, 1, a] * half[1, b]
                        + W[i, 2, a] * half[2, b] - A[a, b]
                    )  # fmt: skip
                else:
                    D[a, b] = half[a, b] - A[a, b]
                if i == j:
                    D[a, b] += L[i, a, b]


@njit(cache=True)
def _rests(block):
    """Whether a block is zero."""
    for a in range(3):
        for b in range(3):
            if block[a, b] != 0.0:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _spread(p_ptr, weights, node, place, blocks, out):  # noqa: PLR0913
    """Add the blocks, each times the weights of its node, at their places in out."""
    at = 0
    for e in range(len(node)):
        i = node[e]
        if _rests(blocks[e]):
            at += p_ptr[i + 1] - p_ptr[i]
            continue
        for b in range(p_ptr[i], p_ptr[i + 1]):
            w, t = weights[b], uint64(place[at])
            at += 1
            for m in range(3):
                for n in range(3):
                    out[t, m, n] += w * blocks[e, m, n]


@njit(cache=True, error_model="numpy")
def _half_blocks(p_ptr, blocks, column, place, change, half):  # noqa: PLR0913
    at = 0
    for e in range(len(column)):
        j = column[e]
        if _rests(change[e]):
            at += p_ptr[j + 1] - p_ptr[j]
            continue
        for b in range(p_ptr[j], p_ptr[j + 1]):
            R, t = blocks[b], uint64(place[at])
            at += 1
            for m in range(3):
                for n in range(3):
                    half[t, m, n] += (
                        change[e, m, 0] * R[0, n] + change[e, m, 1] * R[1, n]
                        + change[e, m, 2] * R[2, n]
                    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _rest_blocks(p_ptr, blocks, row, place, half, coarse):  # noqa: PLR0913
    at = 0
    for h in range(len(row)):
        i = row[h]
        if _rests(half[h]):
            at += p_ptr[i + 1] - p_ptr[i]
            continue
        for a in range(p_ptr[i], p_ptr[i + 1]):
            Q, t = blocks[a], uint64(place[at])
            at += 1
            for m in range(3):
                for n in range(3):
                    coarse[t, m, n] += (
                        Q[0, m] * half[h, 0, n] + Q[1, m] * half[h, 1, n]
                        + Q[2, m] * half[h, 2, n]
                    )  # fmt: skip
