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
from ..core.locks import KeepsLocks
from ..core.threads import over_rows
from .block_kernels import blocks_of_dense, blocks_of_rows, contact_data

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BlockRows(KeepsLocks):
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
    def _contact_data(self) -> tuple[Array, Array]:
        eliminated, inverse_norms = contact_data(self.data, self.diagonal)
        eliminated.flags.writeable = inverse_norms.flags.writeable = False
        return eliminated, inverse_norms

    @property
    def eliminated(self) -> Array:
        """What the exact solution of one contact needs of W_ii = A, (nc, 17).

        Columns: 0: 1 where A is well enough conditioned for its inverse to be used; 1-9: A^-1
        by rows; 10-11: k = A_TN / A_NN; 12-15: A_TT - k A_NT by rows; 16: (trace |A|)^2.
        """
        return self._contact_data[0]

    @property
    def inverse_norms(self) -> Array:
        """1 / |W_ii|_2, (nc,); 0 where W_ii is 0."""
        return self._contact_data[1]

    @property
    def density(self) -> float:
        """Stored blocks / contacts squared."""
        return len(self.indices) / max(len(self.diagonal), 1) ** 2


def block_rows(W: sparse.csr_array | Array, d: int) -> BlockRows:
    """Block rows of a Delassus matrix W, (nc d, nc d), dense or sparse; d = 2 or 3."""
    if isinstance(W, np.ndarray):
        W = np.ascontiguousarray(W, dtype=float)
        return BlockRows(*map(_locked, blocks_of_dense(W, d)))
    values = np.asarray(W.data, dtype=float)
    return BlockRows(*map(_locked, blocks_of_rows(W.indptr, W.indices, values, d)))


def _locked(array: NDArray) -> NDArray:
    array.flags.writeable = False
    return array


def embedded(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    tiles: Array,
    diagonal: NDArray[np.int32],
) -> BlockRows:
    """Block rows of sorted tiles (k, d, d), the diagonal among them; locks the arrays."""
    data = _embed(tiles, diagonal) if tiles.shape[1] == 2 else tiles
    return BlockRows(*map(_locked, (indptr, indices, data, diagonal)))


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


def velocity_inplace(  # noqa: PLR0913
    indptr: NDArray[np.int32], indices: NDArray[np.int32], data: Array, q: Array, r: Array,
    u: Array,
) -> None:  # fmt: skip
    """u = W r + q by rows of blocks; q, r, u (nc, 3)."""
    work = 10.0 * len(indices)
    over_rows(velocity_of_rows_inplace, len(q), work, indptr, indices, data, q, r, u)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def velocity_of_rows_inplace(begin, end, indptr, indices, data, q, r, u):  # noqa: PLR0913
    """u = W r + q in rows of contacts begin to end - 1, for kernels."""
    for i in range(begin, end):
        u0, u1, u2 = q[i, 0], q[i, 1], q[i, 2]
        for k in range(uint64(indptr[i]), uint64(indptr[i + 1])):
            j = uint64(indices[k])  # unsigned: no test for negative indices in the loop
            r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
            u0 += data[k, 0, 0] * r0 + data[k, 0, 1] * r1 + data[k, 0, 2] * r2
            u1 += data[k, 1, 0] * r0 + data[k, 1, 1] * r1 + data[k, 1, 2] * r2
            u2 += data[k, 2, 0] * r0 + data[k, 2, 1] * r1 + data[k, 2, 2] * r2
        u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2


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
