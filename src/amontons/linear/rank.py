"""The rank of a sparse matrix, by parts that do not share rows or columns.

Columns that have an entry alone in its row are independent of all others: they are counted
and taken away with their rows, and so on until none is left.  In H of elastic bodies that are
slaves node by node nothing remains.  What remains is dealt with component by component: by
singular values where a side is small, else by the inertia of G - s^2 I, G the Gram matrix of
the smaller side with unit diagonal, whose positive pivots are the singular values above s
(Sylvester).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.clock import NEVER, Deadline
from .dense import dense

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DENSE = 1500  # rows or columns up to which singular values are computed
SMALL = (1e-5, 1e-6)  # s: singular values between both make the rank doubtful


@dataclass(frozen=True)
class Rank:
    """The rank of a matrix of `rows` and `columns`.

    least: with singular values that may be rounding taken for zero; the same as value unless
    the rank is in doubt.
    """

    value: int
    rows: int
    columns: int
    least: int

    @property
    def is_full(self) -> bool:
        """Whether the columns are independent."""
        return self.least == self.columns

    def __str__(self) -> str:
        doubt = f" (or {self.least})" if self.least < self.value else ""
        return f"{self.value}{doubt} of {self.columns}"


def matrix_rank(matrix: sparse.sparray, deadline: Deadline = NEVER) -> Rank:
    """The rank of a sparse matrix (n, m); raises TimeUp before what takes too long.

    Rows and columns are scaled to unit length before: the rank does not depend on units.
    """
    A = _scaled(sparse.csr_array(matrix))
    found, A = _peeled(A)
    value = least = found
    for rows, columns in components(A):
        part = sparse.csr_array(A[rows][:, columns])
        high, low = _rank_of_part(part, deadline)
        value, least = value + high, least + low
    return Rank(value, *matrix.shape, least)


def semidefinite_rank(matrix: sparse.sparray | Array, deadline: Deadline = NEVER) -> Rank:
    """The rank of a positive semidefinite matrix (m, m), by Cholesky with pivots.

    Stored in full, so InvalidInput where it does not fit into memory.
    """
    from scipy.linalg.lapack import dpstrf

    full = dense(matrix, 2)
    m = len(full)
    deadline.pay(float(m) ** 3 / 3)
    size = np.sqrt(np.maximum(full.diagonal(), 0.0))
    size = 1 / np.where(size > 0, size, 1.0)
    full = 0.5 * (full + full.T) * np.outer(size, size)
    rank = int(dpstrf(full, tol=m * np.finfo(float).eps)[2]) if m else 0
    return Rank(rank, m, m, rank)


def _scaled(A: sparse.csr_array) -> sparse.csr_array:
    """Rows, then columns, of unit length where they are not zero."""
    A = A.copy()
    A.eliminate_zeros()
    for axis in (1, 0):
        size = np.sqrt(np.asarray(A.multiply(A).sum(axis=axis)).ravel())
        factor = sparse.diags_array(1 / np.where(size > 0, size, 1.0))
        A = sparse.csr_array(factor @ A if axis == 1 else A @ factor)
    return A


def _peeled(A: sparse.csr_array) -> tuple[int, sparse.csr_array]:
    """(columns with an entry alone in its row, taken away round by round; what remains)."""
    found = 0
    while A.nnz:
        alone = np.flatnonzero(np.diff(A.indptr) == 1)
        columns, first = np.unique(A.indices[A.indptr[alone]], return_index=True)
        if not len(columns):
            break
        found += len(columns)
        rows = np.setdiff1d(np.arange(A.shape[0]), alone[first])
        keep = np.setdiff1d(np.arange(A.shape[1]), columns)
        A = sparse.csr_array(A[rows][:, keep])
    return found, A


def components(A: sparse.csr_array) -> list[tuple[Index, Index]]:
    """Rows and columns of the parts of A that do not touch, those without entries left out."""
    from scipy.sparse import csgraph

    n = A.shape[0]
    graph = sparse.block_array([[None, A], [A.T, None]], format="csr") if A.nnz else None
    if graph is None:
        return []
    label = csgraph.connected_components(graph, directed=False)[1]
    out = []
    order = np.argsort(label, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        rows, columns = part[part < n], part[part >= n] - n
        if len(rows) and len(columns):
            out.append((rows, columns))
    return out


def _rank_of_part(A: sparse.csr_array, deadline: Deadline) -> tuple[int, int]:
    """(rank, least rank) of one part."""
    from scipy.sparse.linalg import splu

    n, m = A.shape[0], A.shape[1]
    small, large = min(n, m), max(n, m)
    if small <= DENSE:
        deadline.pay(2.0 * small * small * large + 10.0 * small**3)
        full = dense(A if n >= m else sparse.csr_array(A.T))
        values = np.linalg.svd(np.linalg.qr(full, mode="r"), compute_uv=False)
        rank = int((values > large * np.finfo(float).eps * values[0]).sum())
        return rank, rank
    deadline.check()
    G = sparse.csc_array(A.T @ A if m <= n else A @ A.T)
    size = 1 / np.sqrt(G.diagonal())
    G = sparse.csc_array(sparse.diags_array(size) @ G @ sparse.diags_array(size))
    counts = []
    for s in SMALL:
        deadline.pay(_factor_cost(G))
        shifted = sparse.csc_array(G - s**2 * sparse.eye_array(small))
        lu = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                  options={"SymmetricMode": True})  # fmt: skip
        counts.append(int((lu.U.diagonal() > 0).sum()))
    return max(counts), min(counts)


def _factor_cost(G: sparse.csc_array) -> float:
    """Operations of a factor, guessed as in three dimensions: n^2 times its entries per row."""
    n = G.shape[0]
    return min(float(n) ** 3 / 3, 3.0 * float(n) ** 2 * G.nnz / n)
