"""What supports prescribe of combinations of unknowns: which are free, and which driven.

rows @ z = values, z (k,) being independent displacements and rigid motions: z = basis @ y,
where the free y change none of these combinations, and the driven ones follow from the values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.errors import InvalidInput
from .rigid import RANK

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
POSSIBLE = 1e-9  # departure of prescribed values from what is possible, relative to the largest
DENSE = 64  # of z up to which the basis is orthonormal, else it is sparse


@dataclass(frozen=True, eq=False)
class Bound:
    """Some z of a model, by their numbers `columns` (k,), bound by its prescribed dofs `at`.

    rows (at, k), basis (k, k) sparse or not, driven (k,), inverse (k, at): values to y.
    impossible: what to say of values that contradict each other.
    """

    impossible: str
    columns: Index
    at: Index
    rows: Array
    basis: Any
    driven: Mask
    inverse: Array

    @classmethod
    def of(cls, impossible: str, columns: Index, at: Index, rows: Array) -> Bound:
        """The basis, free ones before driven ones."""
        split = _orthonormal if len(columns) <= DENSE else _pivoted
        return cls(impossible, columns, at, rows, *split(rows))

    def motion(self, values: Array) -> Array:
        """y (k,) that values (dofs,) on the prescribed dofs demand; raises InvalidInput."""
        given = values[self.at]
        found = self.inverse @ given
        missed = self.rows @ (self.basis @ found) - given
        if np.abs(missed).max(initial=0.0) > POSSIBLE * np.abs(given).max(initial=0.0):
            raise InvalidInput(self.impossible, ("supports",))
        return found

    def held_by(self, force: Array) -> Array:
        """Forces (at,) of supports, the smallest that do what force (k,) on z does."""
        return self.inverse.T @ (self.basis.T @ force)


def _orthonormal(rows: Array) -> tuple[Array, Mask, Array]:
    """Basis, driven, inverse by singular values."""
    k = rows.shape[1]
    _, s, vt = np.linalg.svd(np.linalg.qr(rows, mode="r"))
    rank = int((s > RANK * max(float(s.max(initial=0.0)), RANK)).sum())
    driven = np.arange(k) >= k - rank
    basis = np.vstack([vt[rank:], vt[:rank]]).T if 0 < rank < k else np.eye(k)
    inverse = np.zeros((k, len(rows)))
    inverse[driven] = np.linalg.pinv(rows @ basis[:, driven], rcond=RANK)
    return basis, driven, inverse


def _pivoted(rows: Array) -> tuple[sparse.csc_array, Mask, Array]:
    """The same with few entries: as many z as there are independent rows follow the others."""
    size = np.linalg.norm(rows, axis=1)
    found: Any = linalg.qr(rows / size[:, None], mode="economic", pivoting=True)
    q, r, order = found
    s = np.abs(np.diag(r))
    rank, k = int((s > RANK * s.max(initial=RANK)).sum()), rows.shape[1]
    first, rest = order[:rank], order[rank:]
    follow = -linalg.solve_triangular(r[:rank, :rank], r[:rank, rank:])
    # columns: the free ones, then the driven ones, which are the first `rank` of the order
    free = sparse.coo_array((np.ones(k - rank), (rest, np.arange(k - rank))), shape=(k, k))
    i, j = np.meshgrid(first, np.arange(k - rank), indexing="ij")
    dense = sparse.coo_array((follow.ravel(), (i.ravel(), j.ravel())), shape=(k, k))
    last = sparse.coo_array(
        (np.ones(rank), (first, np.arange(k - rank, k))), shape=(k, k)
    )
    driven = np.arange(k) >= k - rank
    inverse = np.zeros((k, len(rows)))
    inverse[driven] = linalg.solve_triangular(r[:rank, :rank], q[:, :rank].T) / size
    return sparse.csc_array(free + dense + last), driven, inverse
