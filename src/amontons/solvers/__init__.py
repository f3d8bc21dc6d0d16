"""Solvers of the discrete problem, one file per family; a new one is a file and a line here."""

from .active_conditions import FrictionFunction, Modification
from .active_multigrid import CycleShape, MultigridCycle
from .active_set import ActiveSet, ActiveSetIterate, ChangeNorm, FrictionBound
from .augmentation import RhoStrategy
from .base import Breakdown, Iterate, Solver, Target
from .compressed import CompressedDelassus
from .contact_multigrid import ContactMultigrid
from .fischer_burmeister import FischerBurmeister
from .functions import AlartCurnier, ComplementarityFunction, JeanMoreau, NaturalMap
from .gauss_seidel import Batch, GaussSeidel
from .gradient import AcceleratedGradient, GradientIterate, Metric, Restart
from .hybrid import Auto, Hybrid
from .inexact import InexactNewton
from .interior_point import InteriorPoint
from .jacobi import Jacobi
from .line_search import Armijo, FullStep, GoldsteinPrice, LineSearch, NonMonotone
from .local_contact import LocalSolver
from .newton import SemismoothNewton
from .smoothing import ProximalPoint, SmoothingNewton
from .sweeps import SweepOrder
from .uzawa import InnerStart, Uzawa

METHODS: dict[str, type] = {
    "accelerated-gradient": AcceleratedGradient,
    "active-set": ActiveSet,
    "auto": Auto,
    "compressed-delassus": CompressedDelassus,
    "contact-multigrid": ContactMultigrid,
    "gauss-seidel": GaussSeidel,
    "hybrid": Hybrid,
    "jacobi": Jacobi,
    "interior-point": InteriorPoint,
    "inexact-newton": InexactNewton,
    "proximal-point": ProximalPoint,
    "semismooth-newton": SemismoothNewton,
    "smoothing-newton": SmoothingNewton,
    "uzawa": Uzawa,
}

__all__ = [
    "METHODS",
    "AcceleratedGradient",
    "ActiveSet",
    "ActiveSetIterate",
    "AlartCurnier",
    "Armijo",
    "Auto",
    "Batch",
    "Breakdown",
    "ChangeNorm",
    "ComplementarityFunction",
    "CompressedDelassus",
    "ContactMultigrid",
    "CycleShape",
    "FischerBurmeister",
    "FrictionBound",
    "FrictionFunction",
    "FullStep",
    "GaussSeidel",
    "GoldsteinPrice",
    "GradientIterate",
    "Hybrid",
    "InteriorPoint",
    "InexactNewton",
    "InnerStart",
    "Iterate",
    "Jacobi",
    "JeanMoreau",
    "LineSearch",
    "LocalSolver",
    "Metric",
    "Modification",
    "MultigridCycle",
    "NaturalMap",
    "NonMonotone",
    "ProximalPoint",
    "Restart",
    "RhoStrategy",
    "SemismoothNewton",
    "SmoothingNewton",
    "Solver",
    "SweepOrder",
    "Target",
    "Uzawa",
]
