"""Factors of small systems that are not symmetric, where a package's own work is most of it.

By evidence (tangents of two bodies in contact, one thread, milliseconds for a checked factor):

    unknowns    entries    rslab    SuperLU    LAPACK
         312     29 217      6.2        2.4       0.9
         760     12 750      5.5        1.6      12
       1 392     72 612     14          8        45

Both pivot by rows, so that they are as trustworthy as a factor can be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lapack

from ..core.errors import SingularOperator
from .direct import checked

Array = NDArray[np.float64]
Solve = Callable[[Array], Array]
DENSE = 400  # unknowns up to which a dense factor is the cheapest
FEW = 100_000  # entries up to which SuperLU is cheaper than packages for large systems


@dataclass(frozen=True)
class SmallFactor:
    """A checked factor."""

    apply: Solve
    exact: bool = True
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b, shape of b."""
        return self.apply(b)


def factor_of_small(matrix: sparse.csc_array) -> SmallFactor | None:
    """A trusted factor of a small matrix (n, n), None of a large or empty one.

    Raises SingularOperator where there is none.
    """
    n = matrix.shape[0]
    if n == 0 or (n > DENSE and matrix.nnz > FEW):
        return None
    if not np.isfinite(matrix.data).all():
        raise SingularOperator("matrix: not all of its entries are finite")
    solve = _dense(matrix) if n <= DENSE else _sparse(matrix)
    return SmallFactor(checked(matrix, solve))


def _dense(matrix: sparse.csc_array) -> Solve:
    factor, pivots, info = lapack.dgetrf(matrix.toarray(order="F"), overwrite_a=True)
    if info > 0:
        raise SingularOperator(f"matrix: pivot {info} is zero, the operator is singular")
    return lambda b: np.asarray(lapack.dgetrs(factor, pivots, b)[0])


def _sparse(matrix: sparse.csc_array) -> Solve:
    from scipy.sparse import csgraph
    from scipy.sparse import linalg as sparse_linalg

    stored = sparse.csc_matrix(matrix)
    pivots = csgraph.structural_rank(stored)
    if pivots < matrix.shape[0]:  # SuperLU would print complaints about its arguments
        raise SingularOperator(f"at most {pivots} of {matrix.shape[0]} pivots are not zero")
    try:
        factor = sparse_linalg.splu(stored, permc_spec="MMD_AT_PLUS_A")
    except RuntimeError as reason:
        raise SingularOperator(f"matrix: {reason}") from reason
    return lambda b: factor.solve(np.asarray(b, dtype=float))
