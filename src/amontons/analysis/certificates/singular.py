"""Verdicts where W is singular or missing: motion and reactions apart (`hyperstatic`)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...core.clock import Deadline, now
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ...solvers.driver import drive
from ..hyperstatic.held_tangents import relaxed
from ..hyperstatic.indeterminacy import indeterminacy, is_singular
from ..scaled import Scaled
from .verdict import Uniqueness, Verdict, with_indeterminacy, without_verdict

SMALL = 60  # rows of a singular W up to which all solutions are looked for first
SOLVING = 0.7  # part of the time for a solution
RELAXED = 0.7  # part of the time for the motion where supports hold tangents
PENETRATES = 1e-6  # gap of a contact that can not react, relative to the load


def if_held(
    problem: FrictionProblem, solution: FrictionSolution | None, deadline: Deadline,
    assess: Callable[..., Uniqueness],
) -> Uniqueness | None:
    """The verdict where supports hold tangents of contacts, by the relaxed problem."""
    try:
        found = relaxed(problem, deadline)
    except (TimeUp, InvalidInput, SingularOperator):
        return None
    if found is None or blocked(problem):
        return None
    other, held = found
    if solution is None or not solution.converged:
        say("a solution for this load")
        solution = drive(problem, time_limit=deadline.share(SOLVING))
    if not solution.converged:
        return None
    known = None
    with suppress(InvalidInput):
        r = np.where(held, 0.0, solution.r)
        known = drive(other, start=Iterate(r), tolerance=1e-10, time_limit=deadline.share(0.1))
    verdict = assess(other, known, time_limit=deadline.share(RELAXED))
    apart = indeterminacy(problem, solution, deadline, why=verdict.reason,
                          proved=_of_motion(other, known, verdict))  # fmt: skip
    count = int(held.any(axis=1).sum())
    told = f"Supports hold tangents of {count} contacts."
    return with_indeterminacy(replace(verdict, solution=solution, reason=told), apart)


def _of_motion(
    other: FrictionProblem, known: FrictionSolution | None, verdict: Uniqueness
) -> str:
    """What a verdict on the relaxed problem says of motions, "" for nothing."""
    if verdict.indeterminacy is not None:  # it is singular besides
        found = verdict.indeterminacy
        return found.motion if found.motion_is_unique else ""
    if verdict.verdict is not Verdict.NOT_UNIQUE:
        return "" if verdict.verdict is Verdict.UNDECIDED else verdict.verdict.value
    first = known if verdict.solution is None else verdict.solution
    if verdict.other is None or first is None:
        return ""
    differs = not Scaled.of(other).rests(verdict.other.r - first.r)
    return verdict.verdict.value if differs else ""


def if_singular(
    problem: FrictionProblem, solution: FrictionSolution | None, deadline: Deadline, held: str
) -> Uniqueness | None:
    """The verdict where W is singular or missing; None where it is not, or all is small.

    Then the lists of `_this_load` say more, and where they do not it is asked for again.
    """
    try:
        if problem.contacts * problem.dimension <= SMALL or not is_singular(problem, deadline):
            return None
        loose = problem.loose_modes.shape[1] > 0
        if not loose and blocked(problem):
            return None
    except (TimeUp, InvalidInput, SingularOperator):
        return None
    if solution is None or not solution.converged:
        say("a solution for this load")
        solution = drive(problem, time_limit=deadline.share(SOLVING))
    cause = "W is singular"
    if loose:
        cause = f"Contact alone holds {held}, so there is no W"
    nothing = without_verdict(problem, f"{cause}.", now())
    if not solution.converged:
        why = f"No solution was found: {solution.convergence}."
        return replace(nothing, reason=f"{cause}. {why}")
    return with_indeterminacy(replace(nothing, solution=solution),
                              indeterminacy(problem, solution, deadline))  # fmt: skip


def blocked(local: FrictionProblem) -> bool:
    """True where a contact penetrates that can not react; rounding of a gap does not count."""
    q, reacts = local.free_velocity, local.rho > 0
    return bool((q[~reacts, 0] < -PENETRATES * np.linalg.norm(q)).any())
