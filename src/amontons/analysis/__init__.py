"""Questions about problems and solvers; sees discrete problems only.

Names load on first use: who asks one question does not wait for the others.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    from .solutions.large_multistart import LargeSolutions

_HOME = {
    "basins.methods": ("BasinMethod", "Ended", "RunLimits",),
    "basins.solutions": ("KnownSolution",),
    "basins.study": ("BasinRun", "Basins",),
    "certificates.critical_friction": ("CriticalFriction", "Witness",),
    "certificates.older_criteria": ("CriterionFriction",),
    "certificates.opening": ("Existence", "Opening",),
    "certificates.verdict": ("Uniqueness", "Verdict",),
    "grading": ("graded",),
    "paths.cones": ("TangentCone",),
    "paths.contact_rates": ("ContactRates",),
    "paths.continuation": ("Continuation", "Switch",),
    "paths.diagram": ("Diagram",),
    "paths.index_sets": ("IndexSets",),
    "paths.path": ("Branch", "Event", "EventKind", "PathProblem", "Stop",),
    "paths.rate_claims": ("Claim",),
    "paths.rate_equation": ("MidpointRule", "RateEquation", "StepPath", "ThetaMethod",),
    "paths.tangents": ("FirstOrder", "Tangent",),
    "profiles": ("performance_profile",),
    "solutions.enumerate": ("PieceSolution", "Solutions",),
    "solutions.large_multistart": ("LargeSolutions",),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}

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
    "LargeSolutions",
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


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        return getattr(importlib.import_module(f".{_MODULE[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
