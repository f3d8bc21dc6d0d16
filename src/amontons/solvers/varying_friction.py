"""Friction that follows pressure or slip speed: an outer loop over fixed coefficients.

Coefficients mu, a solution with them, those that belong to that solution, and so on:

    mu <- mu + w (mu(p, s) - mu)

with Aitken's w of the last two changes, between LEAST and MOST: below 1 where friction falls
by what it causes, and the loop goes to and fro, above 1 where the changes shrink slowly.
After each solve the judge of the problem, which freezes mu at the state that it judges, says
whether that is the end; the solves before are only as exact as that error asks for.

When the loop ends without, the record says so: the coefficients still change, which may mean
several states, between which it goes to and fro, or none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import UnsupportedLaw
from ..problem.judge.measures import Criterion
from ..problem.law.varying import VaryingFriction
from ..problem.solution import FrictionSolution, Outcome, Step
from .asked import Asked

Array = NDArray[np.float64]
Solve = Callable[[Any, Any, Any], FrictionSolution]  # problem, options, start
ROUNDS = 100  # solves at most
LEAST, MOST = 0.05, 2.0  # w
ENOUGH = 0.1  # of the tolerance: for the solves, so that their error leaves room
LOOSE = 1e-2  # of the last error of the whole: for the solves on the way
STILL = 1e-14  # relative change of mu that is none


def varying_friction(problem: Any, given: Asked, start: Any, solve: Solve) -> FrictionSolution:
    """The solution of a problem with `VaryingFriction`; given: options of the driver.

    Its problem has the coefficients of the solution.
    """
    law: VaryingFriction = problem.law
    if given.criterion is not Criterion.JUDGE:
        raise UnsupportedLaw(f"criterion: published errors do not know {law.name}")
    mu = law.inner.parameters[:, 0] if start is None else _first(problem, start)
    weight, last, error = 1.0, None, np.inf
    rounds: list[FrictionSolution] = []
    while True:
        goal = min(max(LOOSE * error, ENOUGH * given.tolerance), LOOSE)
        left = None
        if given.max_iterations is not None:
            done = sum(found.convergence.iterations for found in rounds)
            left = max(given.max_iterations - done, 1)
        options = replace(given, tolerance=goal, max_iterations=left)
        found = solve(replace(problem, law=law.inner.with_mu(mu)), options, start)
        rounds.append(found)
        wanted = law.coefficients(found.r, found.u)
        error, weakest = _judged(problem, found)
        change = wanted - mu
        largest = float(np.abs(change).max(initial=0.0))
        ended = _ended(given, found, error, weakest, goal, largest, rounds)
        if ended is not None:
            return _whole(problem, given, rounds, wanted, error, weakest, *ended)
        if last is not None:
            weight = _relaxation(weight, change, last)
        mu, start, last = np.maximum(mu + weight * change, 0.0), found, change


def _relaxation(weight: float, change: Array, last: Array) -> float:
    """Aitken's factor for the next step from two changes mu(p, s) - mu, (nc,)."""
    turn = change - last
    size = float(turn @ turn)
    if size == 0.0:
        return MOST
    found = -weight * float(last @ turn) / size
    return float(np.clip(found if found > 0 else MOST, LEAST, MOST))


def _first(problem: Any, start: Any) -> Array:
    """Coefficients that belong to a start."""
    r, v = problem.start(start)
    return problem.law.coefficients(r, problem.motion(r, v)[0])


def _judged(problem: Any, found: FrictionSolution) -> tuple[float, Any]:
    """The error of the whole, and its weakest contact where it may decide."""
    v = found.v if problem.has_v else None
    return problem.error(found.r, v), problem.weakest(found.r, v)


def _ended(
    given: Asked, found: FrictionSolution, error: float, weakest: Any, goal: float,
    change: float, rounds: list[FrictionSolution],
) -> tuple[Outcome, str] | None:  # fmt: skip
    """Why the loop ends here, None where it goes on."""
    record = found.convergence
    fine = weakest is None or weakest.error <= given.of_contacts
    if error <= given.tolerance and fine and record.outcome is not Outcome.STOPPED:
        return Outcome.CONVERGED, record.detail
    last = goal <= ENOUGH * given.tolerance
    iterations = sum(found.convergence.iterations for found in rounds)
    if given.max_iterations is not None and iterations >= given.max_iterations:
        return Outcome.MAX_ITERATIONS, record.detail
    if not found.converged and (last or record.outcome in (
        Outcome.STOPPED, Outcome.TIME_LIMIT, Outcome.NON_FINITE, Outcome.MAX_ITERATIONS
    )):  # fmt: skip
        return record.outcome, record.detail
    size = float(found.problem.law.parameters[:, 0].max(initial=0.0))
    if last and change <= STILL * size:
        return Outcome.STAGNATED, record.detail
    if len(rounds) >= ROUNDS:
        return Outcome.STAGNATED, (
            f"the friction coefficients still change by {change:.1e} after {len(rounds)} "
            "solves with fixed ones: they depend on what they cause, and there may be several "
            "states, or none; take smaller steps, or a curve that falls less steeply"
        )
    return None


def _whole(
    problem: Any, given: Asked, rounds: list[FrictionSolution], mu: Array, error: float,
    weakest: Any, outcome: Outcome, detail: str,
) -> FrictionSolution:  # fmt: skip
    """The last solution with the record of all rounds."""
    found, records = rounds[-1], [each.convergence for each in rounds]
    history: list[Step] = []
    for record in records:
        before = history[-1] if history else None
        history += [_after(before, step) for step in record.history]
    if history:
        history[-1] = history[-1]._replace(error=error)
    several = f"{len(rounds)} solves with fixed friction"
    record = replace(
        records[-1], outcome=outcome, error=error, tolerance=given.tolerance,
        iterations=sum(record.iterations for record in records), history=tuple(history),
        linear_iterations=sum(record.linear_iterations for record in records),
        seconds=sum(record.seconds for record in records),
        compiling=sum(record.compiling for record in records),
        detail="; ".join(text for text in (detail, several) if text),
        contact_error=None if weakest is None else weakest.error,
        weakest=None if weakest is None else weakest.contact,
        contact_tolerance=given.of_contacts,
    )  # fmt: skip
    own: Any = found.problem
    frozen = replace(own, law=problem.law.inner.with_mu(mu))
    return replace(found, problem=frozen, convergence=record)


def _after(before: Step | None, step: Step) -> Step:
    """A line of the history of a later solve, counted on."""
    if before is None:
        return step
    flops = None if step.flops is None or before.flops is None else step.flops + before.flops
    return step._replace(
        iteration=before.iteration + step.iteration, flops=flops,
        linear_iterations=before.linear_iterations + step.linear_iterations,
        seconds=before.seconds + step.seconds,
    )

