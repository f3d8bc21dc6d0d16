"""Questions about problems and solvers; sees discrete problems only."""

from .continuation import Continuation
from .diagram import Diagram
from .enumerate import PieceSolution, Solutions
from .path import Branch, Event, EventKind, PathProblem, Stop
from .profiles import performance_profile

__all__ = [
    "Branch",
    "Continuation",
    "Diagram",
    "Event",
    "EventKind",
    "PathProblem",
    "PieceSolution",
    "Solutions",
    "Stop",
    "performance_profile",
]
