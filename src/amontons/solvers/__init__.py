"""Solvers of the discrete problem, one file per family; a new one is a file and a line here."""

from .active_set.conditions import FrictionFunction, Modification
from .active_set.multigrid import CycleShape, MultigridCycle
from .active_set.sets import ActiveSet, ActiveSetIterate, ChangeNorm, FrictionBound
from .augmentation import RhoStrategy
from .auto.compressed import CompressedDelassus
from .auto.hybrid import Auto, Hybrid
from .contract import Breakdown, Iterate, Solver, Target
from .gradient.accelerated import AcceleratedGradient, GradientIterate, Metric, Restart
from .gradient.uzawa import InnerStart, Uzawa
from .multigrid.cycles import ContactMultigrid
from .newton.fischer_burmeister import FischerBurmeister
from .newton.frictionless import FrictionlessInteriorPoint
from .newton.functions import AlartCurnier, ComplementarityFunction, JeanMoreau, NaturalMap
from .newton.inexact import InexactNewton
from .newton.interior_point import InteriorPoint
from .newton.line_search import Armijo, FullStep, GoldsteinPrice, LineSearch, NonMonotone
from .newton.semismooth import SemismoothNewton
from .newton.smoothing import ProximalPoint, SmoothingNewton
from .sweeps.gauss_seidel import Batch, GaussSeidel
from .sweeps.jacobi import Jacobi
from .sweeps.kernels import SweepOrder
from .sweeps.local_contact import LocalSolver
from .sweeps.rolling import RollingSweeps

METHODS: dict[str, type] = {
    "accelerated-gradient": AcceleratedGradient,
    "active-set": ActiveSet,
    "auto": Auto,
    "compressed-delassus": CompressedDelassus,
    "contact-multigrid": ContactMultigrid,
    "frictionless-interior-point": FrictionlessInteriorPoint,
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
    "FrictionlessInteriorPoint",
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
    "RollingSweeps",
    "SemismoothNewton",
    "SmoothingNewton",
    "Solver",
    "SweepOrder",
    "Target",
    "Uzawa",
]
