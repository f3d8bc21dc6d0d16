"""Conjugate gradients with a preconditioner, behind the protocol of the direct solvers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from ..core.errors import SingularOperator
from ..core.options import check_options
from .base import Factor, LinearSolver, by_columns, check_stopping, stored
from .multigrid import AlgebraicMultigrid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ConjugateGradient:
    """CG for symmetric positive definite matrices; memory grows linearly with the unknowns."""

    preconditioner: LinearSolver = field(default_factory=AlgebraicMultigrid)
    tolerance: float = 1e-11  # relative residual
    max_iterations: int = 500

    def __post_init__(self) -> None:
        check_options(self)
        check_stopping(self.tolerance, self.max_iterations)

    def factor(
        self, matrix: sparse.csc_array, near_nullspace: Array | None = None
    ) -> KrylovFactor:
        """Set up the preconditioner of `matrix`, (n, n)."""
        matrix = stored(matrix)
        inner = self.preconditioner.factor(matrix, near_nullspace)
        return KrylovFactor(sparse.csr_array(matrix), inner, self)


@dataclass
class KrylovFactor:
    """A matrix with its preconditioner."""

    matrix: sparse.csr_array
    inner: Factor
    options: ConjugateGradient
    exact: bool = False
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b to the options' tolerance, shape of b."""
        return by_columns(self._solve_one, b)

    def _solve_one(self, b: Array) -> Array:
        def count(_: Array) -> None:
            self.iterations += 1

        apply = sparse_linalg.LinearOperator(self.matrix.shape, self.inner.solve, dtype=float)
        x, info = sparse_linalg.cg(
            self.matrix,
            b,
            rtol=self.options.tolerance,
            atol=0.0,
            maxiter=self.options.max_iterations,
            M=apply,
            callback=count,
        )
        if info != 0 or not np.isfinite(x).all():
            raise SingularOperator(
                f"conjugate gradients: no convergence in {self.options.max_iterations} "
                "iterations; is the matrix symmetric positive definite?"
            )
        return x
