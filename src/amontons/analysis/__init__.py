"""Questions about problems and solvers; sees discrete problems only."""

from .basins.methods import BasinMethod, Ended, RunLimits
from .basins.solutions import KnownSolution
from .basins.study import BasinRun, Basins
from .certificates.critical_friction import CriticalFriction, Witness
from .certificates.older_criteria import CriterionFriction
from .certificates.opening import Existence, Opening
from .certificates.verdict import Uniqueness, Verdict
from .grading import graded
from .paths.cones import TangentCone
from .paths.contact_rates import ContactRates
from .paths.continuation import Continuation, Switch
from .paths.diagram import Diagram
from .paths.index_sets import IndexSets
from .paths.path import Branch, Event, EventKind, PathProblem, Stop
from .paths.rate_claims import Claim
from .paths.rate_equation import MidpointRule, RateEquation, StepPath, ThetaMethod
from .paths.tangents import FirstOrder, Tangent
from .profiles import performance_profile
from .solutions.enumerate import PieceSolution, Solutions

__all__ = [
    "BasinMethod",
    "BasinRun",
    "Basins",
    "Branch",
    "Claim",
    "ContactRates",
    "Continuation",
    "CriterionFriction",
    "CriticalFriction",
    "Diagram",
    "Ended",
    "Event",
    "EventKind",
    "Existence",
    "FirstOrder",
    "IndexSets",
    "KnownSolution",
    "MidpointRule",
    "Opening",
    "PathProblem",
    "PieceSolution",
    "RateEquation",
    "RunLimits",
    "Solutions",
    "StepPath",
    "Stop",
    "Switch",
    "Tangent",
    "TangentCone",
    "ThetaMethod",
    "Uniqueness",
    "Verdict",
    "Witness",
    "graded",
    "performance_profile",
]
