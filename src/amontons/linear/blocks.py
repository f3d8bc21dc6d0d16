"""Delassus matrix as rows of 3x3 blocks: the storage that all compiled kernels work on.

A 2D contact becomes a 3D one whose second tangent is decoupled (W = its own stiffness, q = 0):
a 3D solution of that contact has r_T2 = 0 and is exactly the 2D one, so one set of kernels
serves both dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.locks import KeepsLocks
from ..core.threads import over_rows
from .block_kernels import (
    blocks_of_dense,
    blocks_of_rows,
    contact_data,
    full_rows,
    is_full,
    velocity_of_rows_inplace,
)

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

    @cached_property
    def rows(self) -> Array:
        """What products with W read: of a nearly full one its rows, (nc, 3, 3 nc), else data.

        A contiguous row takes half the time of its blocks, of few contacts a quarter.
        """
        if not is_full(len(self.indices), len(self.diagonal)):
            return self.data
        return _locked(full_rows(self.indptr, self.indices, self.data))

    @property
    def density(self) -> float:
        """Stored blocks / contacts squared."""
        return len(self.indices) / max(len(self.diagonal), 1) ** 2


def block_rows(W: sparse.csr_array | Array, d: int) -> BlockRows:
    """Block rows of a Delassus matrix W, (nc d, nc d), dense or sparse; d = 2 or 3."""
    if not isinstance(W, np.ndarray):
        size, values = W.shape[0], np.asarray(W.data, dtype=float)
        if len(values) != size * size or not W.has_canonical_format:
            return BlockRows(*map(_locked, blocks_of_rows(W.indptr, W.indices, values, d)))
        W = values.reshape(size, size)  # every entry is stored
    W = np.ascontiguousarray(W, dtype=float)
    found = BlockRows(*map(_locked, blocks_of_dense(W, d)))
    nc = len(found.diagonal)
    if d == 3 and not W.flags.writeable and is_full(len(found.indices), nc):
        found.__dict__["rows"] = W.reshape(nc, 3, 3 * nc)  # no copy of what nobody changes
    return found


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
    indptr: NDArray[np.int32], indices: NDArray[np.int32], rows: Array, q: Array, r: Array,
    u: Array,
) -> None:  # fmt: skip
    """u = W r + q by rows of contacts, `BlockRows.rows` or its data; q, r, u (nc, 3)."""
    work = 10.0 * len(indices)
    over_rows(velocity_of_rows_inplace, len(q), work, indptr, indices, rows, q, r, u)


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
