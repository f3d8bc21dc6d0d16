"""Prolongations between node-block levels, and Galerkin products with them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import uint64
from numpy.typing import NDArray
from scipy import sparse

from ..core.compiled import njit
from ..core.copies import copy_rows_inplace
from ..core.threads import over_rows
from .box_transfer import add_in_box, restrict_in_box
from .node_blocks import NodeBlocks, row_product, slots_of_rows, with_diagonal
from .products import product

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ROUNDING = 1e-13  # of weights, which are of size 1


@dataclass(frozen=True, eq=False)
class Transfer:
    """Rows of fine nodes, entries of coarse ones: weights (k,), or blocks (k, 3, 3).

    With weights a component goes to the same component: x_i = sum_j w_ij x_j.  idle, (m,): flat
    places of fine padding, which receives nothing.  box: fine nodes along z, y and x, where the
    coarse ones are every second of them and values are interpolated in between.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    weights: Array
    blocks: Array
    idle: Index
    coarse_idle: Index
    coarse: int
    box: tuple[int, int, int] | None = None

    @classmethod
    def of(cls, tiles: sparse.bsr_array, idle: Index, coarse_idle: Index) -> Transfer:
        """From 3x3 blocks; to weights where every block is one on the components in use."""
        tiles.sort_indices()
        used, used_coarse = np.ones(tiles.shape[0], bool), np.ones(tiles.shape[1], bool)
        used[idle], used_coarse[coarse_idle] = False, False
        rows = np.repeat(np.arange(tiles.shape[0] // 3), np.diff(tiles.indptr))
        both = used.reshape(-1, 3)[rows] & used_coarse.reshape(-1, 3)[tiles.indices]
        diagonal = np.einsum("kii->ki", tiles.data)
        largest = np.abs(diagonal).argmax(axis=1)
        weights = diagonal[np.arange(len(diagonal)), largest]
        plain = np.eye(3) * (weights[:, None] * both)[:, None, :]
        empty = np.empty((0, 3, 3))
        scalar = np.abs(plain - tiles.data).max(initial=0.0) <= ROUNDING
        return cls(
            tiles.indptr.astype(np.int32),
            tiles.indices.astype(np.int32),
            weights if scalar else np.empty(0),
            empty if scalar else np.ascontiguousarray(tiles.data, dtype=float),
            np.asarray(idle, dtype=np.int64),
            np.asarray(coarse_idle, dtype=np.int64),
            tiles.shape[1] // 3,
        )

    @classmethod
    def nodal(
        cls,
        level: sparse.csr_array,
        idle: Index,
        coarse_idle: Index,
        box: tuple[int, int, int] | None = None,
    ) -> Transfer:
        """From a prolongation of nodal values, whose arrays it shares."""
        return cls(
            level.indptr.astype(np.int32, copy=False),
            level.indices.astype(np.int32, copy=False),
            np.asarray(level.data, dtype=float),
            np.empty((0, 3, 3)),
            idle,
            coarse_idle,
            level.shape[1],
            box,
        )

    @property
    def coarse_used(self) -> NDArray[np.uint8]:
        """1 for coarse unknowns, 0 for padding, (coarse, 3)."""
        return (~_mask(self.coarse_idle, self.coarse)).astype(np.uint8)

    @property
    def fine(self) -> int:
        """Number of fine nodes."""
        return len(self.indptr) - 1

    def scalar(self) -> sparse.csr_array:
        """The weights as a matrix (fine, coarse), or the size of the blocks."""
        values = (
            self.weights
            if len(self.weights)
            else np.abs(self.blocks).max(axis=(1, 2), initial=0)
        )
        shape = (self.fine, self.coarse)
        return sparse.csr_array((values, self.indices, self.indptr), shape=shape)

    def matrix(self) -> sparse.csr_array:
        """As a matrix of scalars, (3 fine, 3 coarse)."""
        if not len(self.blocks):
            return sparse.csr_array(sparse.kron(self.scalar(), sparse.eye_array(3)))
        shape = (3 * self.fine, 3 * self.coarse)
        return sparse.bsr_array((self.blocks, self.indices, self.indptr), shape=shape).tocsr()

    def masked(self) -> sparse.csr_array:
        """The same with nothing at padding."""
        used = [np.ones(3 * n) for n in (self.fine, self.coarse)]
        used[0][self.idle], used[1][self.coarse_idle] = 0.0, 0.0
        left, right = (sparse.diags_array(x) for x in used)
        out = sparse.csr_array(left @ self.matrix() @ right)
        out.eliminate_zeros()
        return out

    def renumbered(self, fine: Index | None, coarse: Index | None) -> Transfer:
        """The same between nodes of other numbers: new numbers of both, None: the old ones."""
        if fine is None and coarse is None:
            return self
        fine = np.arange(self.fine) if fine is None else fine
        coarse = np.arange(self.coarse) if coarse is None else coarse
        order, counts = np.argsort(fine), np.diff(self.indptr)
        row = np.repeat(fine, counts)
        column = coarse[self.indices]
        entry = np.lexsort((column, row))
        return Transfer(
            np.concatenate([[0], np.cumsum(counts[order])]).astype(np.int32),
            column[entry].astype(np.int32),
            self.weights[entry] if len(self.weights) else self.weights,
            self.blocks[entry] if len(self.blocks) else self.blocks,
            np.sort(3 * fine[self.idle // 3] + self.idle % 3),
            np.sort(3 * coarse[self.coarse_idle // 3] + self.coarse_idle % 3),
            self.coarse,
        )

    @cached_property
    def _columns(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
        """P^T by rows: pointers (coarse + 1,), fine nodes and values (k,)."""
        start, row, place = _by_columns(self.indptr, self.indices, self.coarse)
        if not len(self.blocks):
            return start, row, self.weights[place]
        return start, row, np.ascontiguousarray(self.blocks[place].swapaxes(1, 2))

    def add(self, coarse: Array, fine: Array) -> None:
        """fine += P coarse, (nodes, 3)."""
        if self.box is not None:
            lines = self.box[0] * self.box[1]
            over_rows(add_in_box, lines, 6.0 * self.fine, self.box, coarse, fine)
        else:
            values, kernel = self.weights, _add
            if len(self.blocks):
                values, kernel = self.blocks, _add_blocks
            work = 6.0 * self.fine + 2.0 * values.size
            over_rows(kernel, self.fine, work, self.indptr, self.indices, values, coarse, fine)
        if self.idle.size:
            fine.reshape(-1)[self.idle] = 0.0

    def restrict(self, fine: Array, coarse: Array) -> None:
        """coarse = P^T fine; padding of both is left out."""
        if self.idle.size:
            fine.reshape(-1)[self.idle] = 0.0
        if self.box is not None:
            nz, ny, nx = self.box
            lines, box = (nz // 2 + 1) * (ny // 2 + 1), self.box
            over_rows(restrict_in_box, lines, 9.0 * self.fine, box, fine, coarse)
        else:
            start, row, values = self._columns
            kernel = _restrict_blocks if len(self.blocks) else _restrict
            work = 6.0 * self.fine + 2.0 * values.size
            over_rows(kernel, self.coarse, work, start, row, values, fine, coarse)
        if self.coarse_idle.size:
            coarse.reshape(-1)[self.coarse_idle] = 0.0

    def restrict_few(self, fine: Array) -> Array:
        """P^T fine by the weights of `scalar`, (coarse,); fine (fine,) is mostly zero."""
        node = np.flatnonzero(fine)
        slots, ends = slots_of_rows(self.indptr, node)
        values = self.weights[slots]
        if len(self.blocks):
            values = np.abs(self.blocks[slots]).max(axis=(1, 2), initial=0)
        terms = values * np.repeat(fine[node], np.diff(ends))
        return np.bincount(self.indices[slots], terms, self.coarse).astype(float, copy=False)

    def galerkin(self, A: NodeBlocks) -> NodeBlocks:
        """P^T A P with ones on the diagonal of coarse padding."""
        return _galerkin_blocks(self, A) if len(self.blocks) else _galerkin(self, A)


def _galerkin_blocks(P: Transfer, A: NodeBlocks) -> NodeBlocks:
    tiles = sparse.bsr_array((P.blocks, P.indices, P.indptr), shape=(3 * P.fine, 3 * P.coarse))
    matrix = sparse.bsr_array((A.data, A.indices, A.indptr), shape=(3 * A.nodes, 3 * A.nodes))
    coarse = with_diagonal(product(tiles.T.tobsr((3, 3)), product(matrix, tiles)))
    data = np.asarray(coarse.data, dtype=float)
    _set_idle(coarse.indptr, coarse.indices, data, _mask(P.coarse_idle, P.coarse))
    return NodeBlocks.of(coarse.indptr, coarse.indices, data)


def _mask(idle: Index, nodes: int) -> NDArray[np.bool_]:
    mask = np.zeros(3 * nodes, dtype=bool)
    mask[idle] = True
    return mask.reshape(nodes, 3)


def _galerkin(P: Transfer, A: NodeBlocks) -> NodeBlocks:
    fine_idle = _mask(P.idle, P.fine)
    ptr, idx, data = _times_weights(
        A.indptr, A.indices, A.data, P.indptr, P.indices, P.weights, P.coarse,
        fine_idle, bool(P.idle.size),
    )  # fmt: skip
    T = P.scalar().T.tocsr()
    ptr, idx, data = _weights_times(
        T.indptr, T.indices, T.data, ptr, idx, data, P.coarse, fine_idle, bool(P.idle.size)
    )
    _sort_rows(ptr, idx, data)
    _set_idle(ptr, idx, data, _mask(P.coarse_idle, P.coarse))
    return NodeBlocks.of(ptr, idx, data)


@njit(cache=True)
def _set_idle(indptr, indices, data, idle):
    """Rows and columns of padding become those of the identity."""
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for a in range(3):
                for b in range(3):
                    if idle[i, a] or idle[j, b]:
                        data[k, a, b] = 1.0 if i == j and a == b else 0.0


@njit(cache=True, error_model="numpy")
def _count(left_ptr, left_idx, right_ptr, right_idx, columns):
    """Row pointers of the product of two patterns."""
    n = len(left_ptr) - 1
    mark = np.full(columns, -1, np.int64)
    out = np.zeros(n + 1, np.int64)
    for i in range(n):
        count = 0
        for k in range(left_ptr[i], left_ptr[i + 1]):
            m = left_idx[k]
            for t in range(right_ptr[m], right_ptr[m + 1]):
                j = right_idx[t]
                if mark[j] != i:
                    mark[j] = i
                    count += 1
        out[i + 1] = out[i] + count
    return out


@njit(cache=True, error_model="numpy")
def _times_weights(ptr, idx, data, p_ptr, p_idx, p_weight, columns, idle, any_idle):  # noqa: PLR0913
    """A P for blocks A and weights P; columns of A at idle places count as zero."""
    out_ptr = _count(ptr, idx, p_ptr, p_idx, columns)
    out_idx = np.empty(out_ptr[-1], np.int32)
    out = np.zeros((out_ptr[-1], 3, 3))
    slot = np.full(columns, -1, np.int64)
    for i in range(len(ptr) - 1):
        used = out_ptr[i]
        for k in range(ptr[i], ptr[i + 1]):
            m = idx[k]
            for t in range(p_ptr[m], p_ptr[m + 1]):
                j, w = p_idx[t], p_weight[t]
                s = slot[j]
                if s < out_ptr[i]:
                    s = used
                    slot[j] = used
                    out_idx[used] = j
                    used += 1
                for b in range(3):
                    if any_idle and idle[m, b]:
                        continue
                    for a in range(3):
                        out[s, a, b] += w * data[k, a, b]
    return out_ptr, out_idx, out


@njit(cache=True, error_model="numpy")
def _weights_times(t_ptr, t_idx, t_weight, ptr, idx, data, columns, idle, any_idle):  # noqa: PLR0913
    """T B for weights T and blocks B; rows of B at idle places count as zero."""
    out_ptr = _count(t_ptr, t_idx, ptr, idx, columns)
    out_idx = np.empty(out_ptr[-1], np.int32)
    out = np.zeros((out_ptr[-1], 3, 3))
    slot = np.full(columns, -1, np.int64)
    for i in range(len(t_ptr) - 1):
        used = out_ptr[i]
        for t in range(t_ptr[i], t_ptr[i + 1]):
            m, w = t_idx[t], t_weight[t]
            for k in range(ptr[m], ptr[m + 1]):
                j = idx[k]
                s = slot[j]
                if s < out_ptr[i]:
                    s = used
                    slot[j] = used
                    out_idx[used] = j
                    used += 1
                for a in range(3):
                    if any_idle and idle[m, a]:
                        continue
                    for b in range(3):
                        out[s, a, b] += w * data[k, a, b]
    return out_ptr, out_idx, out


@njit(cache=True)
def _sort_rows(ptr, idx, data):
    """Columns of every row in ascending order, in place."""
    for i in range(len(ptr) - 1):
        first, last = ptr[i], ptr[i + 1]
        columns, blocks = idx[first:last].copy(), data[first:last].copy()
        order = np.argsort(columns)
        for k in range(last - first):
            idx[first + k] = columns[order[k]]
            copy_rows_inplace(blocks[order[k]], data[first + k])


@njit(cache=True)
def _by_columns(indptr, indices, columns):
    """Pointers, rows and places of the entries of compressed rows, column after column."""
    start = np.zeros(columns + 1, np.int32)
    for k in range(len(indices)):
        start[indices[k] + 1] += 1
    for j in range(columns):
        start[j + 1] += start[j]
    to = start[:-1].copy()
    row, place = np.empty(len(indices), np.int32), np.empty(len(indices), np.int32)
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            at = to[indices[k]]
            to[indices[k]] += 1
            row[at], place[at] = i, k
    return start, row, place


@njit(cache=True, error_model="numpy", nogil=True)
def _add(begin, end, indptr, indices, weights, coarse, fine):  # noqa: PLR0913
    for i in range(begin, end):
        s0, s1, s2 = 0.0, 0.0, 0.0
        for k in range(uint64(indptr[i]), uint64(indptr[i + 1])):
            j, w = uint64(indices[k]), weights[k]
            s0 += w * coarse[j, 0]
            s1 += w * coarse[j, 1]
            s2 += w * coarse[j, 2]
        fine[i, 0] += s0
        fine[i, 1] += s1
        fine[i, 2] += s2


@njit(cache=True, error_model="numpy", nogil=True)
def _restrict(begin, end, start, row, weights, fine, coarse):  # noqa: PLR0913
    for j in range(begin, end):
        s0, s1, s2 = 0.0, 0.0, 0.0
        for k in range(uint64(start[j]), uint64(start[j + 1])):
            i, w = uint64(row[k]), weights[k]
            s0 += w * fine[i, 0]
            s1 += w * fine[i, 1]
            s2 += w * fine[i, 2]
        coarse[j, 0], coarse[j, 1], coarse[j, 2] = s0, s1, s2


@njit(cache=True, error_model="numpy", nogil=True)
def _add_blocks(begin, end, indptr, indices, blocks, coarse, fine):  # noqa: PLR0913
    for i in range(begin, end):
        s0, s1, s2 = row_product(
            indices, blocks, coarse, uint64(indptr[i]), uint64(indptr[i + 1])
        )
        fine[i, 0] += s0
        fine[i, 1] += s1
        fine[i, 2] += s2


@njit(cache=True, error_model="numpy", nogil=True)
def _restrict_blocks(begin, end, start, row, blocks, fine, coarse):  # noqa: PLR0913
    for j in range(begin, end):
        coarse[j, 0], coarse[j, 1], coarse[j, 2] = row_product(
            row, blocks, fine, uint64(start[j]), uint64(start[j + 1])
        )
