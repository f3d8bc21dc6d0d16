"""Questions about problems and solvers; sees discrete problems only."""

from .certificates.critical_friction import CriticalFriction, Witness
from .certificates.uniqueness import Uniqueness, Verdict
from .paths.continuation import Continuation
from .paths.diagram import Diagram
from .paths.path import Branch, Event, EventKind, PathProblem, Stop
from .profiles import performance_profile
from .solutions.enumerate import PieceSolution, Solutions

__all__ = [
    "Branch",
    "Continuation",
    "CriticalFriction",
    "Diagram",
    "Event",
    "EventKind",
    "PathProblem",
    "PieceSolution",
    "Solutions",
    "Stop",
    "Uniqueness",
    "Verdict",
    "Witness",
    "performance_profile",
]
