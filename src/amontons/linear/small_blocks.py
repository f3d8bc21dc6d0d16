"""Inverses by small blocks: of a matrix that falls apart into them, of blocks of the diagonal.

Rigid bodies have 3 to 6 unknowns, the nodes of a mesh 2 or 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator

LARGEST_BLOCK = 48  # unknowns coupled with each other, above which a sparse factor is cheaper


def block_diagonal_inverse(matrix: sparse.csc_array) -> sparse.csc_array | None:
    """M^-1 as a sparse matrix when at most LARGEST_BLOCK unknowns hang together, else None.

    Raises SingularOperator naming the unknowns of a block that can not be inverted.
    """
    from scipy.sparse.csgraph import connected_components

    n = matrix.shape[0]
    if n == 0:
        return sparse.csc_array((0, 0))
    _, label = connected_components(matrix, directed=False)
    order = np.argsort(label, kind="stable")
    sizes = np.bincount(label)
    if sizes.max() > LARGEST_BLOCK:
        return None
    start = np.concatenate([[0], np.cumsum(sizes)])
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n) - start[label[order]]
    coo = matrix.tocoo()
    parts = []
    for size in np.unique(sizes):
        members = np.flatnonzero(sizes == size)
        parts.append(_invert(coo, members, label, position, order, start, int(size)))
    rows, columns, data = (np.concatenate(p) for p in zip(*parts, strict=True))
    return sparse.csc_array((data, (rows, columns)), shape=(n, n))


def diagonal_blocks_inverse(
    matrix: sparse.csc_array | sparse.csr_array, size: int
) -> sparse.bsr_array:
    """Inverse of the size x size diagonal blocks, pseudo-inverse where one is singular."""
    n = matrix.shape[0]
    count = n // size
    coo = matrix.tocoo()
    own = coo.row // size == coo.col // size
    row, column = coo.row[own], coo.col[own]
    blocks = np.zeros((count, size, size))
    np.add.at(blocks, (row // size, row % size, column % size), coo.data[own])
    inverse = np.linalg.pinv(blocks)
    return sparse.bsr_array((inverse, np.arange(count), np.arange(count + 1)), shape=(n, n))


def _invert(coo, members, label, position, order, start, size):
    """Row, column and value arrays of the inverses of all blocks of one size."""
    slot = np.full(label.max() + 1, -1)
    slot[members] = np.arange(len(members))
    own = slot[label[coo.row]] >= 0
    blocks = np.zeros((len(members), size, size))
    row, column = coo.row[own], coo.col[own]
    np.add.at(blocks, (slot[label[row]], position[row], position[column]), coo.data[own])
    unknowns: NDArray = order[start[members][:, None] + np.arange(size)]
    scale = np.abs(blocks).max(axis=(1, 2))
    usable = scale > 0
    with np.errstate(all="ignore"):
        scaled = blocks / np.where(usable, scale, 1)[:, None, None]
        condition = np.where(usable, np.linalg.cond(scaled), np.inf)
    bad = np.flatnonzero(~(condition < 1e15))
    if bad.size:
        raise SingularOperator(
            f"M: the block of unknowns {unknowns[bad[0]][:6].tolist()} is singular: "
            "that body has no mass or is not held"
        )
    inverse = np.linalg.inv(blocks)
    shape = (len(members), size, size)
    rows = np.broadcast_to(unknowns[:, :, None], shape).ravel()
    columns = np.broadcast_to(unknowns[:, None, :], shape).ravel()
    return rows, columns, inverse.ravel()
