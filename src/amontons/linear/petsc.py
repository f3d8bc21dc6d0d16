"""PETSc behind the protocol of the linear solvers: CG with algebraic multigrid.

Of a stored matrix on one process here; of a matrix spread over the processes of MPI in
`distributed`.  Further options of PETSc are read from the environment, with the prefix
`amontons_`: PETSC_OPTIONS="-amontons_ksp_monitor" shows every residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import InvalidInput, MissingDependency, SingularOperator
from ..core.options import check_options
from .base import by_columns, check_stopping

Array = NDArray[np.float64]
PREFIX = "amontons_"


@dataclass(frozen=True)
class Petsc:
    """CG with GAMG (smoothed aggregation) for symmetric positive definite matrices."""

    tolerance: float = 1e-11  # relative residual
    max_iterations: int = 500

    def __post_init__(self) -> None:
        check_options(self)
        check_stopping(self.tolerance, self.max_iterations)

    def factor(
        self, matrix: sparse.csc_array, near_nullspace: Array | None = None
    ) -> PetscFactor:
        """Set up GAMG of `matrix`, (n, n), on this process alone."""
        PETSc = petsc()
        rows = sparse.csr_array(matrix)
        if rows.shape[0] != rows.shape[1]:
            raise InvalidInput(f"matrix: expected a square one, got shape {rows.shape}")
        index = PETSc.IntType
        parts = (rows.indptr.astype(index), rows.indices.astype(index), rows.data.astype(float))
        A = PETSc.Mat().createAIJ(rows.shape, csr=parts, comm=PETSc.COMM_SELF)
        if near_nullspace is not None:
            modes = np.linalg.qr(near_nullspace)[0]  # PETSc asks for orthonormal ones
            vectors = [
                PETSc.Vec().createWithArray(np.array(m), comm=PETSc.COMM_SELF) for m in modes.T
            ]
            A.setNearNullSpace(PETSc.NullSpace().create(vectors=vectors, comm=PETSc.COMM_SELF))
        return PetscFactor(krylov(A, self), self)


@dataclass
class PetscFactor:
    """A matrix on one process with its multigrid levels."""

    ksp: Any
    options: Petsc
    exact: bool = False
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b to the options' tolerance, shape of b."""
        x, right = self.ksp.getOperators()[0].createVecs()

        def solve_one(column: Array) -> Array:
            right.array = column
            self.ksp.solve(right, x)
            self.iterations += self.ksp.getIterationNumber()
            check_converged(self.ksp, self.options)
            return x.array_r

        return by_columns(solve_one, b)


def krylov(A: Any, options: Petsc) -> Any:
    """PETSc's solver for a matrix, set up; all processes of its communicator call it."""
    ksp = petsc().KSP().create(A.getComm())
    ksp.setOperators(A)
    ksp.setType("cg")
    ksp.getPC().setType("gamg")
    ksp.setNormType(ksp.NormType.UNPRECONDITIONED)
    ksp.setTolerances(rtol=options.tolerance, atol=0.0, max_it=options.max_iterations)
    ksp.setOptionsPrefix(PREFIX)
    ksp.setFromOptions()
    ksp.setUp()
    return ksp


def check_converged(ksp: Any, options: Petsc) -> None:
    """Raise SingularOperator when the last solve failed."""
    if ksp.getConvergedReason() <= 0:
        raise SingularOperator(
            f"PETSc: no convergence in {options.max_iterations} iterations (reason "
            f"{ksp.getConvergedReason()}); is the matrix symmetric positive definite, and "
            "every body held by supports?"
        )


def mpi() -> Any:
    """The module mpi4py.MPI."""
    try:
        from mpi4py import MPI  # pyright: ignore[reportMissingImports]
    except (ImportError, RuntimeError) as error:  # RuntimeError: no MPI library
        raise _missing(error) from error
    return MPI


def petsc() -> Any:
    """The module petsc4py.PETSc, after a check that it lives in the same MPI as mpi4py."""
    MPI = mpi()
    try:
        import petsc4py  # pyright: ignore[reportMissingImports]

        petsc4py.init([])
        from petsc4py import PETSc  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise _missing(error) from error
    if PETSc.COMM_WORLD.getSize() != MPI.COMM_WORLD.Get_size():
        raise MissingDependency(
            f"PETSc sees {PETSc.COMM_WORLD.getSize()} processes, mpi4py "
            f"{MPI.COMM_WORLD.Get_size()}: they were built with different MPI libraries; "
            "see docs/distributed.md"
        )
    return PETSc


def _missing(error: Exception) -> MissingDependency:
    return MissingDependency(
        "PETSc needs the packages petsc4py and mpi4py, built against one MPI library: "
        f'python -m pip install "amontons[distributed]", see docs/distributed.md ({error})'
    )
