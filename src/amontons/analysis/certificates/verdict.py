"""What is known about other solutions: the verdict, its words and its plain data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from ...core.clock import now
from ...core.faces import Told
from ...core.words import shortened
from ...problem.friction import FrictionProblem
from ...problem.law.law import MU
from ...problem.solution import FrictionSolution
from ..hyperstatic.freedom import Freedom
from ..hyperstatic.indeterminacy import Indeterminacy
from ..solutions.enumerate import PieceSolution
from .critical_friction import CriticalFriction, Witness
from .one_load.answer import LoadCertificate


class Verdict(Enum):
    """What is known; the value is the name in JSON files."""

    UNIQUE_EVERY_LOAD = "unique_every_load"
    UNIQUE_THIS_LOAD = "unique_this_load"
    NOT_UNIQUE = "not_unique"
    UNDECIDED = "undecided"

    @property
    def meaning(self) -> str:
        """One sentence for the user."""
        return _MEANING[self]


_MEANING = {
    Verdict.UNIQUE_EVERY_LOAD: "There is exactly one solution, whatever the load.",
    Verdict.UNIQUE_THIS_LOAD: "For this load there is exactly one solution.",
    Verdict.NOT_UNIQUE: "There is another solution for the same load.",
    Verdict.UNDECIDED: "No other solution was found, and no proof that there is none.",
}


class Cause(Enum):
    """Why a quick verdict is not settled: its name in JSON files, in words, what decides."""

    LARGE = ("large", "The problem is large",
             "amontons uniqueness bounds the friction and examines this load")  # fmt: skip
    NO_W = ("no_w", "Contact alone holds a body, so there is no W",
            "amontons uniqueness tells motion and reactions apart")  # fmt: skip
    NOT_FORMED = ("w_not_formed", "W was not needed, and takes longer to form",
                  "amontons uniqueness forms it")  # fmt: skip
    SINGULAR = ("singular", "W is singular or hardly definite",
                "amontons uniqueness tells motion and reactions apart")  # fmt: skip
    FRICTION = ("friction", "Friction is above the cheapest bound",
                "amontons uniqueness looks for a better one, then at this load")  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Uniqueness(Told):
    """The verdict, and all that supports it.

    friction: largest coefficient of the problem, of which lower and upper are bounds: below
    lower every load has one solution (criterion: what proves it), from upper on some load has
    several (witness).  solution, other: the one found, and a second one or None.  certificate:
    of UNIQUE_THIS_LOAD at larger sizes.  critical: the bounds with all details.
    resolution: of UNIQUE_THIS_LOAD, any other solution would differ by less; of NOT_UNIQUE, to
    which both are known; relative to the largest reaction or, if that is larger, to what the
    load can make.  0 for every load, None where nothing is known.
    indeterminacy: where W is singular or missing, what is known of motion and reactions apart;
    lower and upper are then about motions.
    cause: of a quick verdict that is not settled, what stood in its way; freedom: what it
    knows of the reactions then, where W is singular or missing.
    """

    verdict: Verdict
    friction: float
    lower: float
    upper: float
    criterion: str
    reason: str
    witness: Witness | None = None
    solution: FrictionSolution | None = None
    other: PieceSolution | None = None
    certificate: LoadCertificate | None = None
    critical: CriticalFriction | None = None
    seconds: float = 0.0
    resolution: float | None = None
    indeterminacy: Indeterminacy | None = None
    cause: Cause | None = None
    freedom: Freedom | None = None

    def __str__(self) -> str:
        upper = "unknown" if np.isinf(self.upper) else f"{self.upper:.4g}"
        bounds = f"critical friction between {self.lower:.4g} and {upper}"
        if np.isinf(self.lower):
            bounds = "any friction is safe"
        return (
            f"{self.verdict.value.replace('_', ' ')}: {self.verdict.meaning} {self.reason} "
            f"(friction {self.friction:g}; {bounds})"
        )

    @property
    def in_full(self) -> str:
        """The verdict in a few lines, as the command line shows it."""
        lines = [
            f"{self.verdict.value.replace('_', ' ')}: {self.verdict.meaning}",
            self.reason,
            f"friction {self.friction:g}",
        ]
        if self.criterion == "given friction" or self.indeterminacy is not None:
            return "\n".join(lines[:2])
        if math.isinf(self.lower):
            lines.append("every load has one solution at any friction")
        else:
            safe = f"below {self.lower:.5g} (proved by {self.criterion})"
            lines.append(
                f"every load has one solution {safe}" if self.lower > 0
                else "no friction is proved to be safe for every load"
            )
        if self.witness is not None:
            lines.append(
                f"some loads have several from {self.upper:.5g} on: the linear piece of "
                f"pattern {shortened(self.witness.pattern)} is singular there"
            )
        lines += _comparison(self.critical)
        if self.other is not None:
            lines.append(f"another solution: {shortened(self.other.pattern)}, error "
                         f"{self.other.error:.1e}")  # fmt: skip
        return "\n".join(lines)

    @property
    def brief(self) -> str:
        """One line with the cheap part of it."""
        if self.verdict is Verdict.UNIQUE_EVERY_LOAD:
            return f"uniqueness: one solution for every load. {self.reason}"
        decides = "" if self.cause is None else f" {self.cause.value[2]}."
        return f"uniqueness: not settled. {self.reason}{decides} Ask with --uniqueness"

    @property
    def record(self) -> dict[str, Any]:
        """Plain data, as JSON files have it."""
        w, s, both = self.witness, self.other, self.critical
        witness = None if w is None else {
            "friction": w.friction, "pattern": w.pattern,
            "coefficients": w.coefficients.tolist(), "null_vector": w.null_vector.tolist(),
            "residual": w.residual,
            "directions": None if w.directions is None else w.directions.tolist(),
        }  # fmt: skip
        other = None if s is None else {
            "pattern": s.pattern, "r": s.r.tolist(), "u": s.u.tolist(), "error": s.error,
            "distance": s.distance,
        }  # fmt: skip
        comparison = None if both is None else {
            "p_matrix": both.p_matrix, "full_contact": both.full_contact,
        }  # fmt: skip
        return {"verdict": self.verdict.value, "reason": self.reason,
                "friction": self.friction, "lower": self.lower, "upper": self.upper,
                "criterion": self.criterion, "witness": witness, "other": other,
                "comparison": comparison, "resolution": self.resolution,
                "seconds": self.seconds,
                "cause": None if self.cause is None else self.cause.value[0],
                "decided_by": None if self.cause is None else self.cause.value[2],
                **({} if self.freedom is None else {"reactions": self.freedom.record}),
                **({} if self.indeterminacy is None else self.indeterminacy.record),
                }  # fmt: skip


def without_verdict(problem: FrictionProblem, reason: str, began: float) -> Uniqueness:
    """UNDECIDED, with the reason; began: when the question was asked."""
    friction = problem.law.parameters[:, MU].max(initial=0.0)
    return Uniqueness(Verdict.UNDECIDED, float(friction), 0.0, np.inf, "none", reason,
                      seconds=now() - began)  # fmt: skip


def with_indeterminacy(verdict: Uniqueness, found: Indeterminacy) -> Uniqueness:
    """The verdict with what is known of motion and reactions apart, in its reason too."""
    if found.motion == "not_unique" or found.has_other_reactions:
        known = Verdict.NOT_UNIQUE
    elif found.motion_is_unique and found.reactions_are_unique:
        known = Verdict.UNIQUE_THIS_LOAD
    else:
        known = Verdict.UNDECIDED
    resolution = verdict.resolution
    if known is Verdict.UNIQUE_THIS_LOAD:
        resolution = resolution if found.bound is None else found.bound.distance
    return replace(verdict, verdict=known, reason=f"{verdict.reason} {found}",
                   resolution=resolution, indeterminacy=found)  # fmt: skip


def _comparison(bounds: CriticalFriction | None) -> list[str]:
    if bounds is None:
        return []
    lines = []
    if bounds.p_matrix is not None and math.isfinite(bounds.p_matrix):
        lines.append(f"for comparison, the P-matrix criterion: {bounds.p_matrix:.5g}")
    if bounds.full_contact is not None and math.isfinite(bounds.full_contact):
        lines.append(
            f"for comparison, full contact only: {bounds.full_contact:.5g}, which is not safe"
        )
    return lines
