"""A matrix of node blocks in which one solve has some rows of its own.

Contact multigrid changes coarse matrices near the surface only.  All other rows are those of a
matrix that several solves read at the same time and nobody writes to.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import over_rows, over_stages
from .grid import GridBlocks
from .halves import Halves, Sums
from .level_matrix import LevelMatrix
from .node_blocks import NodeBlocks, row_product, row_product_back
from .some_rows import Pattern, relax

Array = NDArray[np.float64]
Index = NDArray[np.int64]
WORTH = 10_000  # blocks of the rows of others from which they are swept in halves


@dataclass(frozen=True, eq=False)
class Rows(Pattern):
    """Some rows of a matrix, nodes ascending, and slots (e,): their entries in its data.

    number (nodes,): place of a node among them, -1 for others; halves: the others, where these
    are the first and many.
    """

    number: NDArray[np.int32]
    slots: Index
    halves: Halves | None = None
    _known: list[NodeBlocks] = field(default_factory=list)

    @classmethod
    def of(cls, A: NodeBlocks, node: Index) -> Rows:
        """The rows of nodes (k,) in ascending order."""
        number = np.full(A.nodes, -1, dtype=np.int32)
        number[node] = np.arange(len(node))
        slots, ends = A.slots(node)
        first = A.nodes - len(node)
        first = first if len(node) and node[0] == first else 0
        many = A.indptr[first] >= WORTH
        halves = Halves.of(A, A.leading(first)) if many else None
        return cls(node, ends.astype(np.int32), A.indices[slots], number, slots, halves)

    def of_operator(self, A: LevelMatrix) -> NodeBlocks:
        """These rows of the matrix A that they are of, not stored; made once."""
        if not self._known:
            self._known.append(A.rows(self.node))
        return self._known[0]


@dataclass(eq=False)
class PatchedBlocks:
    """base with rows of its own: data (e, 3, 3) and inverse (k, 3, 3), to begin with its."""

    base: NodeBlocks
    rows: Rows
    data: Array = field(init=False)
    inverse: Array = field(init=False)

    def __post_init__(self) -> None:
        self.data = self.base.data[self.rows.slots]
        self.inverse = self.base.inverse[self.rows.node]

    @property
    def nodes(self) -> int:
        """Number of block rows."""
        return self.base.nodes

    @cached_property
    def _first(self) -> NodeBlocks | None:
        """The rows of base before its own, where these are the last ones."""
        first = self.nodes - len(self.rows.node)
        ends = not len(self.rows.node) or self.rows.node[0] == first
        return self.base.leading(first) if ends else None

    @property
    def _arrays(self) -> tuple[Array | NDArray[np.int32], ...]:
        A, own = self.base, self.rows
        return (own.number, A.indptr, A.indices, A.data, A.inverse,
                own.indptr, own.indices, self.data, self.inverse)  # fmt: skip

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """A block Gauss-Seidel sweep on A x = b over the nodes that are not held."""
        if self._first is not None:
            own, halves = (self.data, self.inverse, b, x, held, backward), self.rows.halves
            if backward:
                self.rows.sweep(*own)
            if halves is not None and backward and not held.any():
                halves.backward(b, x, self._sums)
            else:
                self._first.smooth(b, x, held, backward)
            if not backward:
                self.rows.sweep(*own)
            return
        over_stages(_sweep, self.base.chunks, self.base.work, *self._arrays, b, x, held,
                    backward, backward=backward)  # fmt: skip

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """A forward sweep from x = 0, and r = b - A x."""
        x[:] = 0.0
        free, halves = np.zeros(self.nodes, dtype=bool), self.rows.halves
        if halves is None:
            self.smooth(b, x, free, False)
            self.residual(x, b, r)
            return
        self._sums.clear()
        first = r[: halves.count]
        halves.forward(b, x, self._sums, first)
        self.rows.sweep(self.data, self.inverse, b, x, free, False)
        halves.leave(x, first, self._sums, first)
        self.rows.evaluate(self.data, x, b, r)

    @cached_property
    def _sums(self) -> Sums:
        assert self.rows.halves is not None
        return self.rows.halves.sums()

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        A = self.base
        if self._first is not None:
            self._first.residual(x, b, out)
            self.rows.evaluate(self.data, x, b, out)
            return
        over_rows(_residual, A.nodes, A.work, *self._arrays, x, b, out)

    def stored(self) -> NodeBlocks:
        """The whole matrix, copied."""
        data, inverse = self.base.data.copy(), self.base.inverse.copy()
        data[self.rows.slots], inverse[self.rows.node] = self.data, self.inverse
        return replace(self.base, data=data, inverse=inverse)


@dataclass(eq=False)
class PatchedOperator:
    """base, a matrix that is not stored, with rows of its own, to begin with its.

    It is smoothed as the finest level is: as base without the nodes of these rows, which a
    Gauss-Seidel sweep visits next.
    """

    base: LevelMatrix
    rows: Rows
    data: Array = field(init=False)
    inverse: Array = field(init=False)
    own: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        known = self.rows.of_operator(self.base)
        self.data, self.inverse = known.data.copy(), known.inverse.copy()
        self.own = self.rows.number >= 0

    @property
    def nodes(self) -> int:
        """Number of block rows."""
        return self.base.nodes

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """One sweep on A x = b over the nodes that are not held; backward: own rows first."""
        own = self.data, self.inverse, b, x, held, backward
        if backward:
            self.rows.sweep(*own)
        self.base.smooth(b, x, self.own | held, backward)
        if not backward:
            self.rows.sweep(*own)

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """The same forwards from x = 0, and r = b - A x."""
        if isinstance(self.base, GridBlocks):
            self.base.smooth_from_zero(b, x, self.own)
        else:
            x[:] = 0.0
            self.base.smooth(b, x, self.own, False)
        self.rows.sweep(self.data, self.inverse, b, x, self._free, False)
        self.residual(x, b, r)

    @cached_property
    def _free(self) -> NDArray[np.bool_]:
        return np.zeros(self.nodes, dtype=bool)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        self.base.residual(x, b, out)
        self.rows.evaluate(self.data, x, b, out)

    def stored(self) -> NodeBlocks:
        """The whole matrix."""
        A = self.base.stored()
        slots, _ = A.slots(self.rows.node)
        A.data[slots], A.inverse[self.rows.node] = self.data, self.inverse
        return A


def patched(A: LevelMatrix, rows: Rows) -> PatchedBlocks | PatchedOperator:
    """A with rows of its own, stored or not as it is."""
    return PatchedBlocks(A.stored(), rows) if A.is_stored else PatchedOperator(A, rows)


@njit(cache=True, error_model="numpy", nogil=True)
def _sweep(begin, end, number, indptr, indices, data, inverse, own_ptr, own_indices, own_data,
           own_inverse, b, x, held, backward):  # noqa: PLR0913 # fmt: skip
    for step in range(end - begin):
        i = uint64(end - 1 - step if backward else begin + step)
        if held[i]:
            continue
        k = number[i]
        if k < 0:
            first, last = uint64(indptr[i]), uint64(indptr[i + 1])
            if backward:
                s = row_product_back(indices, data, x, first, last)
            else:
                s = row_product(indices, data, x, first, last)
            relax(inverse[i], b, s, x, i)
        else:
            first, last = uint64(own_ptr[k]), uint64(own_ptr[k + 1])
            if backward:
                s = row_product_back(own_indices, own_data, x, first, last)
            else:
                s = row_product(own_indices, own_data, x, first, last)
            relax(own_inverse[k], b, s, x, i)


@njit(cache=True, error_model="numpy", nogil=True)
def _residual(begin, end, number, indptr, indices, data, inverse, own_ptr, own_indices,
              own_data, own_inverse, x, b, r):  # noqa: PLR0913 # fmt: skip
    """b - A x; the inverses are not read."""
    for i in range(begin, end):
        k = number[i]
        if k < 0:
            s = row_product(indices, data, x, uint64(indptr[i]), uint64(indptr[i + 1]))
        else:
            first, last = uint64(own_ptr[k]), uint64(own_ptr[k + 1])
            s = row_product(own_indices, own_data, x, first, last)
        r[i, 0], r[i, 1], r[i, 2] = b[i, 0] - s[0], b[i, 1] - s[1], b[i, 2] - s[2]
