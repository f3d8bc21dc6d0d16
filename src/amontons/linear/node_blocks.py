"""A matrix in rows of 3x3 blocks, one row per node, and the compiled loops of multigrid on it.

Unknowns without a node of their own kind are padding: a 2D node has an idle third component, a
node that a support holds in one direction has that component idle, each with a one on the
diagonal.  So every compiled loop is written for blocks of 3x3 only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numba import uint64
from numpy.typing import NDArray
from scipy import sparse

from ..core.compiled import njit
from ..core.threads import Range, over_rows, over_stages
from .chunks import chunks_of_sorted

if TYPE_CHECKING:
    from .transfer import Transfer

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Integers = NDArray[np.integer]
DEAD = 1e-10  # directions of a diagonal block weaker than this, relative to their size, rest


@dataclass(eq=False)
class NodeBlocks:
    """indptr (n + 1,), indices (k,) ascending in a row, data (k, 3, 3), inverse (n, 3, 3).

    inverse: of the diagonal blocks; zero in directions without stiffness.
    """

    is_stored: ClassVar[bool] = True
    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    data: Array
    inverse: Array

    @classmethod
    def of(cls, indptr: Integers, indices: Integers, data: Array) -> NodeBlocks:
        """With the diagonal blocks inverted."""
        matrix = cls(
            indptr.astype(np.int32), indices.astype(np.int32), data, np.empty((0, 3, 3))
        )
        diagonal = data[matrix.diagonal()]
        matrix.inverse = block_inverse(diagonal, np.abs(diagonal).max(axis=(1, 2), initial=0))
        return matrix

    @classmethod
    def from_sparse(cls, matrix: sparse.sparray, place: Index | None, nodes: int) -> NodeBlocks:
        """The blocks of a scalar matrix (n, n) whose unknown i sits at place[i] of 3 nodes.

        place ascending; None: unknown i at i.  Padding gets ones on the diagonal.
        """
        rows = sparse.csr_array(matrix)
        if place is not None:
            rows = _spread(rows, place, 3 * nodes)
        tiles = rows.tobsr((3, 3))
        tiles = with_diagonal(tiles)
        return cls.of(tiles.indptr, tiles.indices, np.asarray(tiles.data, dtype=float))

    @property
    def nodes(self) -> int:
        """Number of block rows."""
        return len(self.indptr) - 1

    @property
    def diagonal_blocks(self) -> Array:
        """Diagonal blocks, (nodes, 3, 3)."""
        return self.data[self.diagonal()]

    def diagonal(self) -> Index:
        """Places of the diagonal blocks in data, (nodes,)."""
        rows = np.repeat(np.arange(self.nodes), np.diff(self.indptr))
        return np.flatnonzero(rows == self.indices)

    @property
    def is_positive(self) -> bool:
        """True where all unknowns have a stiffness of their own."""
        own = np.einsum("kii->ki", self.diagonal_blocks)
        return bool(np.isfinite(self.inverse).all() and (own > 0).all())

    def slots(self, node: Integers) -> tuple[Index, Index]:
        """Places of the entries of rows (k,), row after row, and the ends of these (k + 1,)."""
        return slots_of_rows(self.indptr, node)

    def rows(self, node: Index) -> NodeBlocks:
        """The block rows of some nodes, (k,), as the rows of a matrix."""
        slots, ends = self.slots(node)
        return NodeBlocks(
            ends.astype(np.int32), self.indices[slots], self.data[slots], self.inverse[node]
        )

    def leading(self, count: int) -> NodeBlocks:
        """The first rows, which share their arrays with this matrix."""
        end = self.indptr[count]
        return NodeBlocks(
            self.indptr[: count + 1], self.indices[:end], self.data[:end], self.inverse[:count]
        )

    def coarse(self, P: Transfer) -> NodeBlocks:
        """P^T A P, with ones at coarse padding."""
        return P.galerkin(self)

    def stored(self) -> NodeBlocks:
        """Itself."""
        return self

    @cached_property
    def chunks(self) -> list[Range]:
        """Ranges of rows, every second of which is swept at once; see `chunks`."""
        return chunks_of_sorted(self.indptr, self.indices)

    @property
    def work(self) -> float:
        """Numbers that a product touches."""
        return 10.0 * len(self.indices)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        arguments = self.indptr, self.indices, self.data, x, b, out
        over_rows(residual, self.nodes, self.work, *arguments)

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """A block Gauss-Seidel sweep on A x = b over the nodes that are not held."""
        arguments = (self.indptr, self.indices, self.data, self.inverse, b, x, held, backward)
        over_stages(sweep, self.chunks, self.work, *arguments, backward=backward)

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """A forward sweep from x = 0, and r = b - A x.

        Whole rows are read twice, as half ones would break the stream of memory.
        """
        x[:] = 0.0
        self.smooth(b, x, np.zeros(self.nodes, dtype=bool), False)
        self.residual(x, b, r)

    def dense(self) -> Array:
        """The whole matrix, (3 n, 3 n)."""
        n = self.nodes
        out = np.zeros((n, 3, n, 3))
        out[np.repeat(np.arange(n), np.diff(self.indptr)), :, self.indices] = self.data
        return out.reshape(3 * n, 3 * n)

    def times(self, x: Array, out: Array) -> None:
        """out = A x, both (nodes, 3)."""
        arguments = self.indptr, self.indices, self.data, x, out
        over_rows(product, self.nodes, self.work, *arguments)

    def renumbered(self, number: Index) -> NodeBlocks:
        """The same with nodes of other numbers, (nodes,)."""
        order = np.argsort(number)
        counts = np.diff(self.indptr)[order]
        indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        indices, data = np.empty_like(self.indices), np.empty_like(self.data)
        arguments = self.indptr, self.indices, self.data, order, number, indptr, indices, data
        over_rows(_renumber, self.nodes, 2.0 * self.work, *arguments)
        return NodeBlocks(indptr, indices, data, self.inverse[order])


def slots_of_rows(pointers: Integers, rows: Integers) -> tuple[Index, Index]:
    """Places of the entries of rows (k,), row after row, and the ends of these (k + 1,)."""
    counts = np.diff(pointers)[rows]
    ends = np.concatenate([[0], np.cumsum(counts)])
    return np.arange(ends[-1]) + np.repeat(pointers[rows] - ends[:-1], counts), ends


def _spread(rows: sparse.csr_array, place: Index, size: int) -> sparse.csr_array:
    """A matrix with its unknowns at ascending places, and ones on the diagonal elsewhere."""
    counts = np.ones(size, dtype=np.int64)
    counts[place] = np.diff(rows.indptr)
    pointers = np.concatenate([[0], np.cumsum(counts)])
    idle = np.ones(size, dtype=bool)
    idle[place] = False
    own = pointers[:-1][idle]
    taken = np.ones(pointers[-1], dtype=bool)
    taken[own] = False
    columns, values = np.empty(pointers[-1], dtype=np.int64), np.empty(pointers[-1])
    columns[taken], values[taken] = place[rows.indices], rows.data
    columns[own], values[own] = np.flatnonzero(idle), 1.0
    return sparse.csr_array((values, columns, pointers), shape=(size, size))


def with_diagonal(tiles: sparse.bsr_array) -> sparse.bsr_array:
    """The same blocks, sorted, with every diagonal block stored even if zero."""
    tiles.sort_indices()
    rows = np.repeat(np.arange(len(tiles.indptr) - 1), np.diff(tiles.indptr))
    missing = np.setdiff1d(np.arange(len(tiles.indptr) - 1), rows[rows == tiles.indices])
    if not missing.size:
        return tiles
    rows = np.concatenate([rows, missing])
    columns = np.concatenate([tiles.indices, missing])
    data = np.concatenate([tiles.data, np.zeros((len(missing), 3, 3))])
    order = np.lexsort((columns, rows))
    counts = np.bincount(rows, minlength=len(tiles.indptr) - 1)
    indptr = np.concatenate([[0], np.cumsum(counts)])
    return sparse.bsr_array((data[order], columns[order], indptr), shape=tiles.shape)


def block_inverse(blocks: Array, size: Array) -> Array:
    """Inverses of blocks (k, 3, 3); directions weaker than DEAD * size (k,) rest."""
    out = np.empty_like(blocks)
    _invert_blocks(blocks, size, out)
    doubtful = np.flatnonzero(np.isnan(out[:, 0, 0]))
    if doubtful.size:
        left, s, right = np.linalg.svd(blocks[doubtful])
        alive = s > DEAD * size[doubtful, None]
        with np.errstate(divide="ignore"):
            weights = np.where(alive, 1 / np.where(alive, s, 1.0), 0.0)
        out[doubtful] = np.einsum("kji,kj,klj->kil", right, weights, left)
    return out


@njit(cache=True, error_model="numpy")
def _invert_blocks(blocks, size, out):
    """Inverses by cofactors; nan marks blocks that are singular or nearly so."""
    for k in range(len(blocks)):
        a = blocks[k]
        for i in range(3):
            i1, i2 = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                j1, j2 = (j + 1) % 3, (j + 2) % 3
                out[k, j, i] = a[i1, j1] * a[i2, j2] - a[i1, j2] * a[i2, j1]
        det = a[0, 0] * out[k, 0, 0] + a[0, 1] * out[k, 1, 0] + a[0, 2] * out[k, 2, 0]
        if abs(det) > 1e-7 * size[k] ** 3:
            for i in range(3):
                for j in range(3):
                    out[k, i, j] /= det
        else:
            out[k, 0, 0] = np.nan


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, inline="always")
def row_product(indices, data, x, first, last):
    """Sum of data[k] x[indices[k]] for first <= k < last; three numbers."""
    s0, s1, s2 = 0.0, 0.0, 0.0
    for k in range(first, last):
        j = uint64(indices[k])
        x0, x1, x2 = x[j, 0], x[j, 1], x[j, 2]
        s0 += data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
        s1 += data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
        s2 += data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
    return s0, s1, s2


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, inline="always")
def row_product_back(indices, data, x, first, last):
    """The same from the last k to the first.

    Backward sweeps use it, so that they read memory in one direction: five times as fast.
    """
    s0, s1, s2 = 0.0, 0.0, 0.0
    for step in range(last - first):
        k = last - uint64(1) - step
        j = uint64(indices[k])
        x0, x1, x2 = x[j, 0], x[j, 1], x[j, 2]
        s0 += data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
        s1 += data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
        s2 += data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
    return s0, s1, s2


@njit(cache=True, error_model="numpy", nogil=True)
def _renumber(begin, end, indptr, indices, data, order, number, new_ptr, new_indices, new_data):  # noqa: PLR0913
    """Rows begin to end of the renumbered matrix, columns in ascending order."""
    for i in range(begin, end):
        first, to = indptr[order[i]], new_ptr[i]
        count = new_ptr[i + 1] - to
        columns = np.empty(count, np.int64)
        for k in range(count):
            columns[k] = number[indices[first + k]]
        places = np.argsort(columns)
        for k in range(count):
            new_indices[to + k] = columns[places[k]]
            for a in range(3):
                for b in range(3):
                    new_data[to + k, a, b] = data[first + places[k], a, b]


@njit(cache=True, error_model="numpy", nogil=True)
def product(begin, end, indptr, indices, data, x, out):  # noqa: PLR0913
    """out = A x."""
    for i in range(begin, end):
        out[i, 0], out[i, 1], out[i, 2] = row_product(
            indices, data, x, uint64(indptr[i]), uint64(indptr[i + 1])
        )


@njit(cache=True, error_model="numpy", nogil=True)
def residual(begin, end, indptr, indices, data, x, b, out):  # noqa: PLR0913
    """out = b - A x."""
    for i in range(begin, end):
        s0, s1, s2 = row_product(indices, data, x, uint64(indptr[i]), uint64(indptr[i + 1]))
        out[i, 0], out[i, 1], out[i, 2] = b[i, 0] - s0, b[i, 1] - s1, b[i, 2] - s2


@njit(cache=True, error_model="numpy", nogil=True)
def sweep(begin, end, indptr, indices, data, inverse, b, x, held, backward):  # noqa: PLR0913
    """A block Gauss-Seidel sweep on A x = b over the nodes of a chunk that are not held."""
    for step in range(end - begin):
        i = uint64(end - 1 - step if backward else begin + step)
        first, last = uint64(indptr[i]), uint64(indptr[i + 1])
        if backward:
            s0, s1, s2 = row_product_back(indices, data, x, first, last)
        else:
            s0, s1, s2 = row_product(indices, data, x, first, last)
        if held[i]:  # its row is read all the same: gaps break the stream of memory
            continue
        r0, r1, r2 = b[i, 0] - s0, b[i, 1] - s1, b[i, 2] - s2
        x[i, 0] += inverse[i, 0, 0] * r0 + inverse[i, 0, 1] * r1 + inverse[i, 0, 2] * r2
        x[i, 1] += inverse[i, 1, 0] * r0 + inverse[i, 1, 1] * r1 + inverse[i, 1, 2] * r2
        x[i, 2] += inverse[i, 2, 0] * r0 + inverse[i, 2, 1] * r1 + inverse[i, 2, 2] * r2
