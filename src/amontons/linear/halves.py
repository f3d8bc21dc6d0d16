"""A symmetric matrix of node blocks, its first rows stored in one half, swept back and forth.

A Gauss-Seidel sweep over a row reads new values of the nodes that it has visited and old ones
of the others.  Forwards and backwards these two halves change their roles: what a backward
sweep makes of the nodes behind a row is what the next forward sweep would make of them again,
and what that makes of the nodes before a row is half of its residual [CW].  And of a symmetric
matrix one half is the transpose of the other: when the value of a row is known, its blocks,
which have just been read, add what it makes in the rows before.  So every sweep reads half of
the matrix once, and a backward sweep, a forward one and the residual the whole of it once, not
three times; only that half is kept.

Rows behind the first ones belong to somebody else, who visits them between these.

[CW] V. Conrad, Y. Wallach, "Alternating methods for sets of linear equations", Numer. Math. 32
(1979).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.copies import copy_rows_inplace
from ..core.threads import Range, over_rows, over_stages
from .block_products import product_of_blocks, product_of_blocks_back, spread_blocks_inplace
from .node_blocks import NodeBlocks
from .some_rows import SomeRows

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Rows = tuple[NDArray[np.int32], NDArray[np.int32], Array]
LANES = 4  # numbers of a node in sums: three and an empty one, read and written at once
ROUNDING = 1e-11  # of a diagonal block times its inverse, and of a symmetric matrix


@dataclass(eq=False)
class Sums:
    """What nodes behind the first rows make in these, for one x: own + above, (rows, LANES).

    above: from the chunk of nodes behind a chunk, which another thread may visit at the same
    time as the chunk before it.
    """

    rows: int
    own: Array = field(init=False)
    above: Array = field(init=False)

    def __post_init__(self) -> None:
        self.own, self.above = (np.zeros((self.rows, LANES)) for _ in range(2))

    def clear(self) -> None:
        """Nothing."""
        self.own[:] = self.above[:] = 0.0


@dataclass(eq=False)
class Halves:
    """The first rows in one half, and the rest of them.

    before: indptr, indices and blocks of what a forward sweep of a row has visited; diagonal,
    inverse (m, 3, 3); beside: of the first rows that touch others the blocks of these; chunks:
    of the first rows; rest: the rows behind them.
    """

    is_stored: ClassVar[bool] = True
    before: Rows
    diagonal: Array
    inverse: Array
    beside: SomeRows
    chunks: list[Range]
    rest: SomeRows

    @classmethod
    def of(cls, A: NodeBlocks, first: NodeBlocks) -> Halves | None:
        """A with its first rows, which are given, in one half.

        None where that is not all of them: A is not symmetric there, or a node has a direction
        without stiffness.
        """
        count, odd = first.nodes, np.zeros(first.nodes, dtype=bool)
        for begin, end in first.chunks[1::2]:
            odd[begin:end] = True
        diagonal = first.diagonal_blocks
        one = np.einsum("kab,kbc->kac", diagonal, first.inverse) - np.eye(3)
        if np.abs(one).max(initial=0.0) > ROUNDING:
            return None
        pointers = np.zeros((2, count + 1), dtype=np.int32)
        _count(first.indptr, first.indices, odd, *pointers)
        halves = [(np.empty(p[-1], np.int32), np.empty((p[-1], 3, 3))) for p in pointers]
        _split(first.indptr, first.indices, first.data, odd, *pointers, *halves[0], *halves[1])
        node = np.flatnonzero(np.diff(pointers[1]))
        ends = np.concatenate([[0], pointers[1][node + 1]]).astype(np.int32)
        beside = SomeRows(node, ends, *halves[1], first.inverse[node])
        rest = SomeRows.of(A, np.arange(count, A.nodes))
        out = cls((pointers[0], *halves[0]), diagonal, first.inverse.copy(), beside,
                  first.chunks, rest)  # fmt: skip
        return out if out._is_whole(A) else None

    def _is_whole(self, A: NodeBlocks) -> bool:
        """True where a product is that of A."""
        x = np.sin(np.arange(3.0 * A.nodes)).reshape(-1, 3)  # like nothing that A is made of
        known, found = np.empty_like(x), np.empty_like(x)
        A.times(x, known)
        self.times(x, found)
        return bool(np.abs(found - known).max() <= ROUNDING * np.abs(known).max())

    @property
    def count(self) -> int:
        """Number of the first rows."""
        return len(self.inverse)

    @property
    def nodes(self) -> int:
        """Number of all rows."""
        return self.count + len(self.rest.node)

    @property
    def _work(self) -> float:
        """Numbers that a sweep touches."""
        return 10.0 * len(self.before[1])

    def sums(self) -> Sums:
        """Room for what a sweep leaves to the next one."""
        return Sums(self.count)

    def backward(self, b: Array, x: Array, sums: Sums) -> None:
        """A backward sweep over the first rows; sums: of x then."""
        sums.clear()
        self._add_beside(x, sums)
        over_stages(_backward, self.chunks, self._work, *self.before, self.inverse, b, x,
                    sums.own, sums.above, backward=True)  # fmt: skip

    def forward(self, b: Array, x: Array, sums: Sums, left: Array) -> None:
        """A forward sweep, sums being of x; left (m, 3) becomes these, and they of the new x.

        But for what the rest makes, which may change before `leave`.
        """
        over_stages(_forward, self.chunks, self._work, *self.before, self.inverse, b, x,
                    sums.own, sums.above, left)  # fmt: skip

    def sum(self, x: Array, sums: Sums) -> None:
        """The sums of x."""
        sums.clear()
        self._add_beside(x, sums)
        over_stages(_spread, self.chunks, self._work, *self.before, x, sums.own, sums.above)

    def leave(self, x: Array, left: Array, sums: Sums, out: Array) -> None:
        """out = the residual in the first rows after `forward`, whose sums become those of x.

        A sweep leaves nothing in its rows but what has changed behind them since.
        """
        self._add_beside(x, sums)
        over_rows(_leave, self.count, 14.0 * self.count, left, sums.own, sums.above, out)

    def _add_beside(self, x: Array, sums: Sums) -> None:
        """What the rest makes."""
        rows = self.beside
        over_rows(_add_rows, len(rows.node), 10.0 * len(rows.data), rows.node, rows.indptr,
                  rows.indices, rows.data, x, sums.own)  # fmt: skip

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """A sweep over all rows, backwards the rest before; held: none of the first."""
        sums = self.sums()
        if backward:
            self.rest.smooth(b, x, held, True)
            self.backward(b, x, sums)
        else:
            self.sum(x, sums)
            self.forward(b, x, sums, np.empty((self.count, 3)))
            self.rest.smooth(b, x, held, False)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        sums = self.sums()
        self.sum(x, sums)
        over_rows(_residual, self.count, self._work, *self.before, self.diagonal, x, b,
                  sums.own, sums.above, out)  # fmt: skip
        self.rest.residual(x, b, out)

    def times(self, x: Array, out: Array) -> None:
        """out = A x, both (nodes, 3)."""
        self.residual(x, np.zeros_like(x), out)
        np.negative(out, out=out)


@njit(cache=True, error_model="numpy")
def _is_before(i, j, odd):
    """True where a forward sweep over all even chunks, then all odd ones, visits j before i."""
    return j < len(odd) and (j < i if odd[j] == odd[i] else odd[i])


@njit(cache=True, error_model="numpy")
def _count(indptr, indices, odd, before, beside):
    """Where rows end in the half before them, and in what is beside."""
    for i in range(len(odd)):
        before[i + 1], beside[i + 1] = before[i], beside[i]
        for k in range(indptr[i], indptr[i + 1]):
            before[i + 1] += _is_before(i, indices[k], odd)
            beside[i + 1] += indices[k] >= len(odd)


@njit(cache=True, error_model="numpy")
def _split(indptr, indices, data, odd, before, beside, before_indices, before_data,
           beside_indices, beside_data):  # noqa: PLR0913 # fmt: skip
    """The entries of both."""
    for i in range(len(odd)):
        to, other = before[i], beside[i]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if _is_before(i, j, odd):
                before_indices[to] = j
                copy_rows_inplace(data[k], before_data[to])
                to += 1
            elif j >= len(odd):
                beside_indices[other] = j
                copy_rows_inplace(data[k], beside_data[other])
                other += 1


@njit(cache=True, error_model="numpy", inline="always")
def _solve_row(D, b, s, own, above, x, i):
    """x_i that makes its row hold, s being of the nodes before it."""
    r0 = b[i, 0] - s[0] - own[i, 0] - above[i, 0]
    r1 = b[i, 1] - s[1] - own[i, 1] - above[i, 1]
    r2 = b[i, 2] - s[2] - own[i, 2] - above[i, 2]
    x[i, 0] = D[0, 0] * r0 + D[0, 1] * r1 + D[0, 2] * r2
    x[i, 1] = D[1, 0] * r0 + D[1, 1] * r1 + D[1, 2] * r2
    x[i, 2] = D[2, 0] * r0 + D[2, 1] * r1 + D[2, 2] * r2


@njit(cache=True, error_model="numpy", inline="always")
def _spread_row(begin, indices, data, first, last, x, i, own, above):  # noqa: PLR0913
    """What x_i makes in the rows before it; those of the chunk before its own come first."""
    cut = first
    while cut < last and indices[cut] < begin:
        cut += uint64(1)
    if cut > first:
        spread_blocks_inplace(data, indices, above, first, cut, x[i, 0], x[i, 1], x[i, 2])
    spread_blocks_inplace(data, indices, own, cut, last, x[i, 0], x[i, 1], x[i, 2])


@njit(cache=True, error_model="numpy", nogil=True)
def _backward(begin, end, ptr, idx, data, inverse, b, x, own, above):  # noqa: PLR0913
    for step in range(end - begin):
        i = uint64(end - 1 - step)
        first, last = uint64(ptr[i]), uint64(ptr[i + uint64(1)])
        s = product_of_blocks_back(data, idx, x, first, last)
        _solve_row(inverse[i], b, s, own, above, x, i)
        _spread_row(begin, idx, data, first, last, x, i, own, above)


@njit(cache=True, error_model="numpy", nogil=True)
def _forward(begin, end, ptr, idx, data, inverse, b, x, own, above, left):  # noqa: PLR0913
    for k in range(begin, end):
        i = uint64(k)
        first, last = uint64(ptr[i]), uint64(ptr[i + uint64(1)])
        s = product_of_blocks(data, idx, x, first, last, last)
        _solve_row(inverse[i], b, s, own, above, x, i)
        for a in range(3):
            left[i, a] = own[i, a] + above[i, a]
            own[i, a] = above[i, a] = 0.0
        _spread_row(begin, idx, data, first, last, x, i, own, above)


@njit(cache=True, error_model="numpy", nogil=True)
def _spread(begin, end, ptr, idx, data, x, own, above):  # noqa: PLR0913
    for k in range(begin, end):
        i = uint64(k)
        first, last = uint64(ptr[i]), uint64(ptr[i + uint64(1)])
        _spread_row(begin, idx, data, first, last, x, i, own, above)


@njit(cache=True, error_model="numpy", nogil=True)
def _leave(begin, end, left, own, above, out):  # noqa: PLR0913
    for i in range(begin, end):
        for a in range(3):
            out[i, a] = left[i, a] - own[i, a] - above[i, a]


@njit(cache=True, error_model="numpy", nogil=True)
def _residual(begin, end, ptr, idx, data, diagonal, x, b, own, above, out):  # noqa: PLR0913
    for k in range(begin, end):
        i = uint64(k)
        first, last = uint64(ptr[i]), uint64(ptr[i + uint64(1)])
        s = product_of_blocks(data, idx, x, first, last, last)
        for a in range(3):
            out[i, a] = b[i, a] - s[a] - own[i, a] - above[i, a]
            for c in range(3):
                out[i, a] -= diagonal[i, a, c] * x[i, c]


@njit(cache=True, error_model="numpy", nogil=True)
def _add_rows(begin, end, node, indptr, indices, data, x, out):  # noqa: PLR0913
    """out_i += what others make in row i."""
    for k in range(begin, end):
        i = uint64(node[k])
        first, last = uint64(indptr[k]), uint64(indptr[k + 1])
        s = product_of_blocks(data, indices, x, first, last, last)
        for a in range(3):
            out[i, a] += s[a]
