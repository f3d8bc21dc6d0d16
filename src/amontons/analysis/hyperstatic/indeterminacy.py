"""What is known of a problem whose W is singular or missing: its motion, and its reactions.

The two are told apart: a motion may be the only one while reactions hold each other in many
ways.  `held_tangents` and the ball of `motion` prove the motion where they can; `ranges` says
what is open of the reactions of the motion that was found.  Both need a symmetric W or M: the
ball takes v . M v_p for v_p . M v, and W dr = 0 for no energy of dr.  Without that, solutions
from other starts are all that is compared, and the words say so.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.faces import Told
from ...core.onlookers import say
from ...linear.rank import matrix_rank, semidefinite_rank
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.driver import drive
from .ball import Ball, MotionBound, ball_of
from .bounded_reactions import Confined, confined
from .face import face_of
from .motion import NO_MORE, OtherMotion, Rest, other_motion, rest
from .ranges import SPREAD, ReactionRanges, reaction_ranges

RANGES, BALL, PROOF, REST, MOTIONS = 0.4, 0.15, 0.3, 0.3, 0.6  # parts of the time left
LOOSE = 0.2  # of the time, for other motions, where contact alone holds bodies
ACCURATE, POLISH = 1e-12, 0.15  # error of a solution that is asked for, part of the time
SYMMETRIC = 1e-8  # asymmetry of W or M, of its largest entry: less no judge of solutions sees
NAMED = 3  # contacts whose ranges are told in words
_PROVED = {
    "unique_every_load": "The motion is unique, whatever the load.",
    "unique_this_load": "The motion is unique.",
    "not_unique": "There is another motion.",
}


@dataclass(frozen=True, eq=False, repr=False)
class Indeterminacy(Told):
    """Motion and reactions apart, of one solution.

    proved: "unique_every_load" or "unique_this_load" where the motion is proved to be the only
    one, by what `why` says; "not_unique" where another is; "" without a proof.  bound: how far
    any other motion of this load can be; confined: how large reactions of any other solution
    are at least, by multipliers; rest_excluded: rest is no solution; other: another motion;
    starts: solutions from other starts that were compared.  reactions: what the motion leaves
    open of them; None where there was no time, see reason.
    """

    proved: str = ""
    why: str = ""
    bound: MotionBound | None = None
    confined: Confined | None = None
    rest_excluded: bool = False
    other: OtherMotion | None = None
    starts: int = 0
    reactions: ReactionRanges | None = None
    reason: str = ""

    @property
    def motion(self) -> str:
        """"unique_every_load", "unique_this_load", "not_unique" or "undecided"."""
        if self.proved:
            return self.proved
        if self.other is not None:
            return "not_unique"
        return "unique_this_load" if self._is_within_ball or self._is_alone else "undecided"

    @property
    def _is_within_ball(self) -> bool:
        bound = self.bound
        return bound is not None and not bound.strains and bound.distance <= NO_MORE

    @property
    def _is_alone(self) -> bool:
        return self.confined is not None and self.confined.everywhere

    @property
    def motion_is_unique(self) -> bool:
        """True where that is proved, for every load or for this one."""
        return self.motion.startswith("unique")

    @property
    def has_other_reactions(self) -> bool:
        """True where another state of reactions with the same motion was attained."""
        return self.reactions is not None and self.reactions.largest > SPREAD

    @property
    def reactions_are_unique(self) -> bool:
        """True where the motion leaves nothing open, by rank and without doubt."""
        found = self.reactions
        return found is not None and found.sure and found.dimension == 0

    def __str__(self) -> str:
        return f"{self.of_motion} {self.of_reactions}".strip()

    @property
    def of_motion(self) -> str:
        """What is known of the motion, in a sentence or two."""
        if self.proved:
            return f"{_PROVED[self.proved]} {self.why}".strip()
        if self._is_alone and self.confined is not None and self.other is None:
            by = self.confined
            return (f"The motion is unique, to {by.distance:.0e}: multipliers exclude all "
                    f"others, as no reaction can be above {by.bound:.3g}.")  # fmt: skip
        if self.motion == "unique_this_load":
            assert self.bound is not None
            return (f"The motion is unique, to {self.bound.distance:.0e} of the free one: "
                    "without friction it is the same.")  # fmt: skip
        if self.other is not None:
            a, b = self.other.errors
            return (f"There is another motion, {self.other.distance:.1%} away; the errors of "
                    f"both by the judge are {a:.0e} and {b:.0e}, and no proof is possible, as "
                    "any rounding of a singular W makes another problem.")  # fmt: skip
        return self._without_a_decision

    @property
    def _without_a_decision(self) -> str:
        """What is known where neither a proof nor another motion was found."""
        starts = f" from {self.starts} other starts" if self.starts else ""
        text = f"No other motion was found{starts}, and no proof that there is none"
        if self.rest_excluded:
            text += "; rest is not one"
        if self.confined is not None:
            text += (f"; any other has a normal reaction above {self.confined.within:.3g} "
                     "somewhere")  # fmt: skip
        if self.bound is not None:
            of = "strains of the found one" if self.bound.strains else "free motion"
            text += (f"; any other differs by at most {self.bound.distance:.2g} of the {of} "
                     "in the norm of energy")  # fmt: skip
        return text + "."

    @property
    def of_reactions(self) -> str:
        """What is known of the reactions, in a sentence or two."""
        found = self.reactions
        if found is None:
            return self.reason
        one = "With this motion" if self.motion == "undecided" else "With it"
        if self.reactions_are_unique:
            return f"{one} all reactions are unique."
        if not self.has_other_reactions:
            return f"{one} no other reactions were found."
        least = "" if found.sure else "at least "
        count, of = int(found.open.sum()), len(found.open)
        text = (f"{one} the reactions of {count} of {of} contacts are not, in {least}"
                f"{found.dimension} free numbers, by up to {found.largest:.2g} of the "
                "largest: ")  # fmt: skip
        widest = np.argsort(-found.spread, kind="stable")[:NAMED]
        parts = []
        for k in widest:
            low, high = found.low[k, 0], found.high[k, 0]
            exact = "" if found.exact[k] else " at least"
            parts.append(f"contact {k}{exact} {low:.3g} to {high:.3g}")
        return text + ", ".join(parts) + (", …." if count > NAMED else ".")

    @property
    def record(self) -> dict[str, Any]:
        """Plain data, as JSON files have it."""
        bound, other, found = self.bound, self.other, self.reactions
        confined = self.confined
        return {
            "motion": {
                "verdict": self.motion,
                "bound": None if bound is None else {
                    "distance": bound.distance, "energy": bound.energy,
                    "of": "strains" if bound.strains else "motion",
                },
                "reactions_above": None if confined is None or confined.everywhere
                else confined.within,
                "rest_excluded": self.rest_excluded,
                "other": None if other is None else {
                    "distance": other.distance, "errors": list(other.errors),
                    "r": other.solution.r.tolist(), "u": other.solution.u.tolist(),
                },
                "starts": self.starts, "reason": self.of_motion,
            },
            "reactions": None if found is None else {
                "unique": self.reactions_are_unique, "dimension": found.dimension,
                "sure": found.sure, "contacts": np.flatnonzero(found.open).tolist(),
                "low": found.low.tolist(), "high": found.high.tolist(),
                "exact": found.exact.tolist(),
                "most": [float(x) if np.isfinite(x) else None for x in found.most],
                "largest_range": found.largest, "reason": self.of_reactions,
            },
        }  # fmt: skip


def is_singular(problem: FrictionProblem, deadline: Deadline) -> bool:
    """Whether reactions may hold each other: W is singular, or contact alone holds bodies.

    By the rank of H where there is one, else of W.  Raises TimeUp, InvalidInput.
    """
    if problem.W is not None:
        return not semidefinite_rank(problem.W, deadline).is_full
    if problem.loose_modes.shape[1]:
        return True
    assert problem.H is not None
    return not matrix_rank(problem.H, deadline).is_full


def indeterminacy(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline, *,
    proved: str = "", why: str = "",
) -> Indeterminacy:  # fmt: skip
    """What is known in time of a Coulomb problem with a solution; proved, why: its motion."""
    solution = _polished(problem, solution, deadline)
    far = _asymmetry(problem)
    if far > SYMMETRIC:
        name = "M" if problem.W is None else "W"
        reason = (f"{name} is not symmetric, by {far:.1e} of its largest entry, and bounds of "
                  "motions and ranges of reactions need that.")  # fmt: skip
        known = Indeterminacy(proved, why, reason=reason)
        return known if proved else _searched(problem, solution, known, None, deadline)
    ranges, reason = None, ""
    try:
        say("reactions of this motion")
        share = deadline.share(RANGES)
        face = face_of(problem, solution, share)
        ranges = reaction_ranges(face, solution.r, share)
    except (TimeUp, InvalidInput) as error:
        reason = f"What the motion leaves open of the reactions is not known: {error}."
    if proved:
        return Indeterminacy(proved, why, reactions=ranges, reason=reason)
    say("other motions")
    ball: Ball | None = None
    with suppress(TimeUp):
        ball = ball_of(problem, deadline.share(BALL))
    bound = None if ball is None else ball.bound(solution)
    known = Indeterminacy("", "", bound, reactions=ranges, reason=reason)
    if known.motion_is_unique:
        return known
    if ranges is not None and ranges.sure and ranges.dimension == 0:
        with suppress(TimeUp, InvalidInput, SingularOperator):
            share = deadline.share(PROOF)
            known = replace(known, confined=confined(problem, solution, ball, share))
    if known.motion_is_unique:
        return known
    return _searched(problem, solution, known, ball, deadline)


def _asymmetry(problem: FrictionProblem) -> float:
    """The largest entry of A - A^T relative to that of A, which is W, or M where there is none.

    0 for operators, which are stiffnesses of meshes.
    """
    A: Any = problem.M if problem.W is None else problem.W
    if not (sparse.issparse(A) or isinstance(A, np.ndarray)):
        return 0.0
    size = float(abs(A).max())
    return float(abs(A - A.T).max()) / size if size > 0 else 0.0


def _polished(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> FrictionSolution:
    """The solution to ACCURATE if that is quick: what rests is told from what moves by it."""
    if solution.convergence.error <= ACCURATE:
        return solution
    share = deadline.share(POLISH)
    found = drive(problem, start=solution, tolerance=ACCURATE, time_limit=share)
    better = found.convergence.error < solution.convergence.error
    return found if better and np.isfinite(found.r).all() else solution


def _searched(
    problem: FrictionProblem, solution: FrictionSolution, known: Indeterminacy,
    ball: Ball | None, deadline: Deadline,
) -> Indeterminacy:  # fmt: skip
    """With another motion, where one is found."""
    resting = Rest(None, False)
    with suppress(TimeUp, InvalidInput):
        resting = rest(problem, deadline.share(REST))
    starts = [r for r in (resting.r, None if ball is None else ball.p) if r is not None]
    other, compared = None, 0
    with suppress(TimeUp):
        share = deadline.share(LOOSE if problem.loose_modes.shape[1] else MOTIONS)
        other, compared = other_motion(problem, solution, share, starts)
    return replace(known, rest_excluded=resting.excluded, other=other, starts=compared)
