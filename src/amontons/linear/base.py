"""The protocol of all linear solvers, so that a contact solver never knows which one runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import InvalidInput

Array = NDArray[np.float64]


def check_stopping(tolerance: float, max_iterations: int) -> None:
    """Raise InvalidInput for options of an iterative solver that can not be meant."""
    if not 0 < tolerance < 1:
        raise InvalidInput(f"expected between 0 and 1, got {tolerance}", ("tolerance",))
    if max_iterations < 1:
        raise InvalidInput(f"expected at least 1, got {max_iterations}", ("max_iterations",))


def by_columns(solve: Callable[[Array], Array], b: Array) -> Array:
    """`solve` of every column of b, (n,) or (n, k), in the shape of b."""
    columns = b.reshape(len(b), -1)
    out = np.empty(columns.shape)
    for k in range(columns.shape[1]):
        out[:, k] = solve(columns[:, k])
    return out.reshape(b.shape)


def stored(matrix: Any) -> sparse.csc_array:
    """A matrix by columns; an operator such as `GridMatrix` is assembled."""
    if not sparse.issparse(matrix) and hasattr(matrix, "tocsc"):
        matrix = matrix.tocsc()
    return sparse.csc_array(matrix)


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
