"""Solvers of the discrete problem, one file per family; a new one is a file and a line here."""

from .base import Breakdown, Iterate, Solver, Target
from .compressed import CompressedDelassus
from .functions import AlartCurnier, ComplementarityFunction, JeanMoreau, NaturalMap
from .gauss_seidel import GaussSeidel
from .hybrid import Auto, Hybrid
from .local_contact import LocalSolver
from .newton import SemismoothNewton
from .smoothing import ProximalPoint, SmoothingNewton

METHODS: dict[str, type] = {
    "auto": Auto,
    "compressed-delassus": CompressedDelassus,
    "gauss-seidel": GaussSeidel,
    "hybrid": Hybrid,
    "proximal-point": ProximalPoint,
    "semismooth-newton": SemismoothNewton,
    "smoothing-newton": SmoothingNewton,
}

__all__ = [
    "METHODS",
    "AlartCurnier",
    "Auto",
    "Breakdown",
    "ComplementarityFunction",
    "CompressedDelassus",
    "GaussSeidel",
    "Hybrid",
    "Iterate",
    "JeanMoreau",
    "LocalSolver",
    "NaturalMap",
    "ProximalPoint",
    "SemismoothNewton",
    "SmoothingNewton",
    "Solver",
    "Target",
]
