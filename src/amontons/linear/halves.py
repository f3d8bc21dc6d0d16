"""A matrix of node blocks whose first rows are stored in two halves, swept back and forth.

A Gauss-Seidel sweep over a row reads new values of the nodes that it has visited and old ones
of the others.  Forwards and backwards these two halves change their roles: what a backward
sweep makes of the nodes behind a row is what the next forward sweep would make of them again,
and what that makes of the nodes before a row is half of its residual [CW].  So a backward
sweep, a forward one and the residual read the matrix twice, not three times.  Halves are stored
one after the other: half rows of whole ones break the stream of memory.

Rows behind the first ones belong to somebody else, who visits them between these.

[CW] V. Conrad, Y. Wallach, "Alternating methods for sets of linear equations", Numer. Math. 32
(1979).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.copies import copy_rows_inplace
from ..core.threads import Range, over_rows, over_stages
from .node_blocks import NodeBlocks, residual, row_product, row_product_back
from .some_rows import SomeRows, relax

Array = NDArray[np.float64]
Rows = tuple[NDArray[np.int32], NDArray[np.int32], Array]


@dataclass(eq=False)
class Halves:
    """The first rows in two halves, and the rest of them.

    before, after: indptr, indices and blocks of what a forward sweep of a row has visited, and
    of all else, the diagonal block first; inverse (m, 3, 3): of these; chunks: of the first
    rows; rest: the rows behind them.
    """

    is_stored: ClassVar[bool] = True
    before: Rows
    after: Rows
    inverse: Array
    chunks: list[Range]
    rest: SomeRows

    @classmethod
    def of(cls, A: NodeBlocks, first: NodeBlocks) -> Halves:
        """A with its first rows, which are given, in halves."""
        count, odd = first.nodes, np.zeros(first.nodes, dtype=bool)
        for begin, end in first.chunks[1::2]:
            odd[begin:end] = True
        before, after = _split(first.indptr, first.indices, first.data, odd)
        rest = SomeRows.of(A, np.arange(count, A.nodes))
        return cls(before, after, first.inverse.copy(), first.chunks, rest)

    @property
    def count(self) -> int:
        """Number of the first rows."""
        return len(self.inverse)

    @property
    def nodes(self) -> int:
        """Number of all rows."""
        return self.count + len(self.rest.node)

    def _work(self, *halves: Rows) -> float:
        """Numbers that are touched."""
        return sum(10.0 * len(half[1]) for half in halves)

    def backward(self, b: Array, x: Array, left: Array) -> None:
        """A backward sweep over the first rows; left (m, 3): b without what is after."""
        arguments = *self.before, *self.after, self.inverse, b, x, left
        over_stages(_backward, self.chunks, self._work(self.before, self.after), *arguments,
                    backward=True)  # fmt: skip

    def forward(self, b: Array, x: Array, left: Array) -> None:
        """A forward sweep, left being of x; then b without what is before."""
        arguments = *self.before, self.inverse, b, x, left
        over_stages(_forward, self.chunks, self._work(self.before), *arguments)

    def subtract_after(self, x: Array, b: Array, out: Array) -> None:
        """out = b minus what is after, in the first rows."""
        over_rows(residual, self.count, self._work(self.after), *self.after, x, b, out)

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """A sweep over all rows, backwards the rest before; held: none of the first."""
        left = np.empty((self.count, 3))
        if backward:
            self.rest.smooth(b, x, held, True)
            self.backward(b, x, left)
        else:
            self.subtract_after(x, b, left)
            self.forward(b, x, left)
            self.rest.smooth(b, x, held, False)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        first = out[: self.count]
        self.subtract_after(x, b, first)
        over_rows(residual, self.count, self._work(self.before), *self.before, x, first, first)
        self.rest.residual(x, b, out)

    def times(self, x: Array, out: Array) -> None:
        """out = A x, both (nodes, 3)."""
        self.residual(x, np.zeros_like(x), out)
        np.negative(out, out=out)


@njit(cache=True)
def _split(indptr, indices, data, odd):
    """Halves of the rows of which every one is of an odd chunk or not."""
    n = len(indptr) - 1
    before, after = np.zeros(n + 1, np.int32), np.zeros(n + 1, np.int32)
    earlier = np.empty(len(indices), np.bool_)
    for i in range(n):
        count = 0
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            earlier[k] = j < n and (j < i if odd[j] == odd[i] else odd[i])
            count += earlier[k]
        before[i + 1] = before[i] + count
        after[i + 1] = after[i] + indptr[i + 1] - indptr[i] - count
    columns, others = np.empty(before[n], np.int32), np.empty(after[n], np.int32)
    blocks, other_blocks = np.empty((before[n], 3, 3)), np.empty((after[n], 3, 3))
    for i in range(n):
        to, other = before[i], after[i] + 1
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if earlier[k]:
                columns[to] = j
                copy_rows_inplace(data[k], blocks[to])
                to += 1
            else:
                at = after[i] if j == i else other
                others[at] = j
                copy_rows_inplace(data[k], other_blocks[at])
                other += j != i
    return (before, columns, blocks), (after, others, other_blocks)


@njit(cache=True, error_model="numpy", nogil=True)
def _backward(begin, end, ptr, idx, data, after_ptr, after_idx, after_data, inverse, b, x,
              left):  # noqa: PLR0913 # fmt: skip
    for step in range(end - begin):
        i = uint64(end - 1 - step)
        own, last = uint64(after_ptr[i]), uint64(after_ptr[i + uint64(1)])
        s0, s1, s2 = row_product_back(after_idx, after_data, x, own + uint64(1), last)
        s = row_product_back(idx, data, x, uint64(ptr[i]), uint64(ptr[i + uint64(1)]))
        d0, d1, d2 = row_product(after_idx, after_data, x, own, own + uint64(1))
        left[i, 0] = b[i, 0] - s0 - d0
        left[i, 1] = b[i, 1] - s1 - d1
        left[i, 2] = b[i, 2] - s2 - d2
        relax(inverse[i], left, s, x, i)
        d0, d1, d2 = row_product(after_idx, after_data, x, own, own + uint64(1))
        left[i, 0] = b[i, 0] - s0 - d0
        left[i, 1] = b[i, 1] - s1 - d1
        left[i, 2] = b[i, 2] - s2 - d2


@njit(cache=True, error_model="numpy", nogil=True)
def _forward(begin, end, ptr, idx, data, inverse, b, x, left):  # noqa: PLR0913
    for k in range(begin, end):
        i = uint64(k)
        s = row_product(idx, data, x, uint64(ptr[i]), uint64(ptr[i + uint64(1)]))
        relax(inverse[i], left, s, x, i)
        left[i, 0], left[i, 1], left[i, 2] = b[i, 0] - s[0], b[i, 1] - s[1], b[i, 2] - s[2]
