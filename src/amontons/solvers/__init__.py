"""Solvers of the discrete problem, one file per family; a new one is a file and a line here."""

from .base import Breakdown, Iterate, Solver, Target
from .gauss_seidel import GaussSeidel

Auto = GaussSeidel

METHODS: dict[str, type] = {
    "gauss-seidel": GaussSeidel,
}
FITTING_GLOBAL = ("SemismoothNewton", "Auto")

__all__ = ["METHODS", "Auto", "Breakdown", "GaussSeidel", "Iterate", "Solver", "Target"]
