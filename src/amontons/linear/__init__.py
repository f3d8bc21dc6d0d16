"""Linear solvers behind one protocol: `factor(A)` returns an object that solves A x = b."""

from .base import Factor, LinearSolver
from .direct import Direct
from .geometric import GeometricMultigrid
from .petsc import Petsc

__all__ = [
    "Direct",
    "Factor",
    "GeometricMultigrid",
    "LinearSolver",
    "Petsc",
]
