"""Questions about problems and solvers; sees discrete problems only."""

from .continuation import Continuation
from .critical_friction import CriticalFriction, Witness
from .diagram import Diagram
from .enumerate import PieceSolution, Solutions
from .path import Branch, Event, EventKind, PathProblem, Stop
from .profiles import performance_profile
from .uniqueness import Uniqueness, Verdict

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
