"""The protocol of all linear solvers, so that a contact solver never knows which one runs."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]


class Factor(Protocol):
    """A prepared operator: solves A x = b, b of shape (n,) or (n, k), as often as one likes."""

    @property
    def exact(self) -> bool:
        """A direct solve, to rounding; else an approximation with its own tolerance."""
        ...

    @property
    def iterations(self) -> int:
        """Inner iterations so far; stays 0 for a direct solve."""
        ...

    def solve(self, b: Array) -> Array:
        """The solution x, shape of b."""
        ...


class LinearSolver(Protocol):
    """Prepares matrices; its fields are its options."""

    def factor(self, matrix: sparse.csc_array, near_nullspace: Array | None = None) -> Factor:
        """Prepare `matrix`, (n, n); near_nullspace, (n, k), helps multigrid (rigid modes).

        Raises SingularOperator when the matrix can not be inverted.
        """
        ...
