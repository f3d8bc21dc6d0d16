"""Linear solvers behind one protocol: `factor(A)` returns an object that solves A x = b."""

from .base import Factor, LinearSolver
from .direct import Direct
from .geometric import GeometricMultigrid
from .krylov import ConjugateGradient
from .multigrid import AlgebraicMultigrid
from .petsc import Petsc

__all__ = [
    "AlgebraicMultigrid",
    "ConjugateGradient",
    "Direct",
    "Factor",
    "GeometricMultigrid",
    "LinearSolver",
    "Petsc",
]
