"""Delassus matrix as rows of 3x3 blocks: the storage that all compiled kernels work on.

A 2D contact becomes a 3D one whose second tangent is decoupled (W = its own stiffness, q = 0):
a 3D solution of that contact has r_T2 = 0 and is exactly the 2D one, so one set of kernels
serves both dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import uint64
from numpy.typing import NDArray
from scipy import sparse

from ..core.compiled import njit

Array = NDArray[np.float64]
WELL_CONDITIONED = 1e-6  # |det A| / max|A|^3 from which A^-1 loses no digits that matter


@dataclass(frozen=True, eq=False)
class BlockRows:
    """Compressed rows of 3x3 blocks, column indices sorted, every diagonal block present.

    indptr (nc+1,), indices (nnzb,), data (nnzb, 3, 3), diagonal (nc,): where W_ii is in data.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    data: Array
    diagonal: NDArray[np.int32]

    @property
    def diagonal_blocks(self) -> Array:
        """W_ii, shape (nc, 3, 3)."""
        return self.data[self.diagonal]

    @cached_property
    def eliminated(self) -> Array:
        """What the exact solution of one contact needs of W_ii = A, (nc, 17).

        Columns: 0: 1 where A is well enough conditioned for its inverse to be used; 1-9: A^-1
        by rows; 10-11: k = A_TN / A_NN; 12-15: A_TT - k A_NT by rows; 16: (trace |A|)^2.
        """
        A = self.diagonal_blocks
        size = np.abs(A).max(axis=(1, 2), initial=0.0)
        a = np.where(A[:, 0, 0] > 0, A[:, 0, 0], 1.0)
        out = np.zeros((len(A), 17))
        regular = (np.abs(np.linalg.det(A)) > WELL_CONDITIONED * size**3) & (A[:, 0, 0] > 0)
        out[:, 0] = regular
        out[regular, 1:10] = np.linalg.inv(A[regular]).reshape(-1, 9)
        k = A[:, 1:, 0] / a[:, None]
        out[:, 10:12] = k
        out[:, 12:16] = (A[:, 1:, 1:] - k[:, :, None] * A[:, :1, 1:]).reshape(-1, 4)
        out[:, 16] = np.abs(np.diagonal(A, axis1=1, axis2=2)).sum(axis=1) ** 2
        out.flags.writeable = False
        return out

    @property
    def density(self) -> float:
        """Stored blocks / contacts squared."""
        return len(self.indices) / max(len(self.diagonal), 1) ** 2


def block_rows(W: sparse.csr_array | Array, d: int) -> BlockRows:
    """Block rows of a Delassus matrix W, (nc d, nc d), dense or sparse; d = 2 or 3."""
    nc = W.shape[0] // d
    dense = isinstance(W, np.ndarray)
    rows, columns, tiles = _dense_tiles(W, nc, d) if dense else _sparse_tiles(W, d)
    absent = np.setdiff1d(np.arange(nc), rows[rows == columns])
    rows = np.concatenate([rows, absent])
    columns = np.concatenate([columns, absent])
    tiles = np.concatenate([tiles, np.zeros((len(absent), d, d))])
    order = np.lexsort((columns, rows))
    rows, columns = rows[order].astype(np.int32), columns[order].astype(np.int32)
    indptr = np.searchsorted(rows, np.arange(nc + 1)).astype(np.int32)
    diagonal = np.flatnonzero(rows == columns).astype(np.int32)
    return embedded(indptr, columns, np.ascontiguousarray(tiles[order]), diagonal)


def embedded(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    tiles: Array,
    diagonal: NDArray[np.int32],
) -> BlockRows:
    """Block rows of sorted tiles (k, d, d), the diagonal among them; locks the arrays."""
    data = _embed(tiles, diagonal) if tiles.shape[1] == 2 else tiles
    for array in (indptr, indices, data, diagonal):
        array.flags.writeable = False
    return BlockRows(indptr, indices, data, diagonal)


def block_part(blocks: BlockRows, contacts: NDArray[np.int64]) -> BlockRows:
    """The block rows of some contacts, given in ascending order."""
    nc = len(blocks.diagonal)
    number = np.full(nc, -1, dtype=np.int32)
    number[contacts] = np.arange(len(contacts), dtype=np.int32)
    rows = number[np.repeat(np.arange(nc), np.diff(blocks.indptr))]
    columns = number[blocks.indices]
    kept = (rows >= 0) & (columns >= 0)
    rows, columns = rows[kept], columns[kept]
    indptr = np.searchsorted(rows, np.arange(len(contacts) + 1)).astype(np.int32)
    diagonal = np.flatnonzero(rows == columns).astype(np.int32)
    return embedded(indptr, columns, blocks.data[kept], diagonal)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def velocity_inplace(indptr, indices, data, q, r, u):  # noqa: PLR0913
    """u = W r + q by rows of blocks; q, r, u (nc, 3)."""
    for i in range(len(q)):
        u0, u1, u2 = q[i, 0], q[i, 1], q[i, 2]
        for k in range(uint64(indptr[i]), uint64(indptr[i + 1])):
            j = uint64(indices[k])  # unsigned: no test for negative indices in the loop
            r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
            u0 += data[k, 0, 0] * r0 + data[k, 0, 1] * r1 + data[k, 0, 2] * r2
            u1 += data[k, 1, 0] * r0 + data[k, 1, 1] * r1 + data[k, 1, 2] * r2
            u2 += data[k, 2, 0] * r0 + data[k, 2, 1] * r1 + data[k, 2, 2] * r2
        u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2


def _sparse_tiles(W: sparse.csr_array, d: int) -> tuple[NDArray, NDArray, Array]:
    """Block row, block column and values (k, d, d) of the stored blocks."""
    blocks = sparse.csr_array(W).tobsr((d, d))
    rows = np.repeat(np.arange(len(blocks.indptr) - 1), np.diff(blocks.indptr))
    return rows, blocks.indices.astype(np.int64), np.asarray(blocks.data, dtype=float)


def _dense_tiles(W: Array, nc: int, d: int) -> tuple[NDArray, NDArray, Array]:
    """Block row, block column and values (k, d, d) of the blocks that are not all zero."""
    tiles = np.asarray(W).reshape(nc, d, nc, d).swapaxes(1, 2)
    rows, columns = np.nonzero(tiles.reshape(nc, nc, d * d).any(axis=2))
    return rows, columns, tiles[rows, columns]


def _embed(planar: Array, diagonal: NDArray[np.int32]) -> Array:
    """3x3 blocks of 2x2 ones; the second tangent gets the stiffness of the first."""
    data = np.zeros((len(planar), 3, 3))
    data[:, :2, :2] = planar
    normal, own = data[diagonal, 0, 0], data[diagonal, 1, 1]
    data[diagonal, 2, 2] = np.where(own > 0, own, normal)  # a held tangent; 0: no reaction
    return data


def spatial(x: Array) -> Array:
    """A writable copy of contact rows (nc, d) as (nc, 3); in 2D the second tangent is zero."""
    if x.shape[1] == 3:
        return np.array(x, dtype=float, order="C")
    out = np.zeros((len(x), 3))
    out[:, : x.shape[1]] = x
    return out


def kernel_rows(r: Array) -> Array:
    """r as kernels take it, (nc, 3); the same array where it is so already."""
    return r if r.shape[1] == 3 and r.flags.c_contiguous else spatial(r)


def inverse_norms(blocks: Array) -> Array:
    """1 / |A|_2 of blocks A, (nc, d, d); 0 where A is 0."""
    size = np.linalg.norm(blocks, 2, axis=(1, 2))
    return np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
