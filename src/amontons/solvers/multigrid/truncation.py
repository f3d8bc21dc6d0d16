"""Coarse levels that see the states of the contacts: a Galerkin tangent changed near them only.

The tangent on the finest level is A' = W^T A V + L (`nodes`).  With D_0 = A' - A, which
has entries only in rows and columns of contact nodes, the coarse matrices are

    A_k' = A_k + D_k,    D_k = P^T D_(k-1) P,

so that an update touches the entries near the surface and nothing else: every solve has a copy
of these rows (`tangent`), the others are those of the linear problem.  Directions that the
contacts hold altogether have neither row nor column left; they rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.hierarchy import Hierarchy
from ...linear.level_matrix import LevelMatrix
from ...linear.node_blocks import NodeBlocks
from ...linear.patched import Rows
from ...linear.transfer import Transfer
from .products import Product

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

    @cached_property
    def is_padded(self) -> bool:
        """True where any entry has padding."""
        return bool(self.row_idle.any() or self.column_idle.any())

    @cached_property
    def own_of(self) -> NDArray[np.int32]:
        """Number among the diagonal blocks of every entry, (m,), -1 for others."""
        out = np.full(len(self.row), -1, dtype=np.int32)
        out[self.own] = np.arange(len(self.own))
        return out


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
                self.products.append(Product.of(level.P, near.row, near.column, coarse))
                slots = np.unique(self.products[-1].target)
        for k, product in enumerate(self.products):
            product.into(self.near[k + 1].slots)

    def patched(self) -> Hierarchy:
        """Levels of one solve, without contacts so far."""
        return self.hierarchy.patched([near.rows for near in self.near[1:]])  # type: ignore[misc]


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
