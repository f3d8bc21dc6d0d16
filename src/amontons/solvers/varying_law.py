"""Laws whose numbers follow the state: an outer loop over laws with fixed ones.

A solution with some numbers, those that belong to that solution, and so on.  After each solve
the judge of the problem, which freezes the law at the state that it judges, says whether that
is the end; the solves before are only as exact as that error asks for.

Friction over pressure or slip speed (`problem.law.varying`): mu <- mu + w (mu(p, s) - mu), with
Aitken's w of the last two changes, between LEAST and MOST: below 1 where friction falls by what
it causes, and the loop goes to and fro, above 1 where the changes shrink slowly.

Pressure over overclosure (`problem.law.overclosure`): Newton's method, the curve being its
tangent at a point of each contact.  A solution lies on the tangents; the next point has its
pressure or its overclosure, whichever is less of a change, as of diodes in circuits: the other
one overshoots where the curve bends.  Where curves bend both ways and the error does not fall,
points go a part of the way only.

When the loop ends without, the record says so: friction that still changes may mean several
states, between which it goes to and fro, or none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import UnsupportedLaw
from ..problem.judge.measures import Criterion
from ..problem.law import Law, VaryingCompliance, VaryingFriction
from ..problem.solution import FrictionSolution, Outcome, Step
from .asked import Asked

Array = NDArray[np.float64]
Solve = Callable[[Any, Any, Any], FrictionSolution]  # problem, options, start
ROUNDS = 100  # solves at most
LEAST, MOST = 0.05, 2.0  # w
PATIENT = 4  # rounds without a smaller error before points go less far
ENOUGH = 0.1  # of the tolerance: for the solves, so that their error leaves room
LOOSE = 1e-2  # of the last error of the whole: for the solves on the way
STILL = 1e-14  # relative change of mu that is none


class _Friction:
    """Coefficients of friction on their way."""

    what = "fixed friction"

    def __init__(self, law: VaryingFriction, state: tuple[Array, Array] | None) -> None:
        self.law, self.weight = law, 1.0
        self.last: Array | None = None
        own = law.inner.parameters[:, 0]
        self.mu = own if state is None else law.coefficients(*state)

    @property
    def fixed(self) -> Law:
        """The law with the numbers of now."""
        return self.law.inner.with_mu(self.mu)

    def changes(self, r: Array, u: Array) -> Array:
        """What is between them and those that belong to a state, (nc,)."""
        return self.law.coefficients(r, u) - self.mu

    def go(self, change: Array, error: float) -> None:
        """Take the next ones."""
        if self.last is not None:
            self.weight = _relaxation(self.weight, change, self.last)
        self.mu, self.last = np.maximum(self.mu + self.weight * change, 0.0), change

    @property
    def size(self) -> float:
        """Of the numbers, as a scale."""
        return float(self.mu.max(initial=0.0))

    def unsettled(self, change: float, rounds: int) -> str:
        """The words for a loop that does not end."""
        return (
            f"the friction coefficients still change by {change:.1e} after {rounds} "
            "solves with fixed ones: they depend on what they cause, and there may be several "
            "states, or none; take smaller steps, or a curve that falls less steeply"
        )


class _Tangents:
    """Points of the curves of pressure over overclosure, at which they are straight."""

    what = "straight pressure over overclosure"

    def __init__(self, law: VaryingCompliance, state: tuple[Array, Array] | None) -> None:
        self.law, self.weight = law, 1.0
        self.curved, self.best = law.curved, np.inf
        self.worse = 0
        first = law.typical()
        if state is not None:
            first = np.where(state[0][:, 0] > 0, law.pressures(state[0]), first)
        self.point = np.where(self.curved, first, 0.0)

    @property
    def fixed(self) -> Law:
        """The law with the tangents of now."""
        return self.law.tangent(self.point)

    def changes(self, r: Array, u: Array) -> Array:
        """From the points to the next ones, pressures (nc,)."""
        both = self.point, self.law.pressures(r), self.law.at_overclosure(u)
        return np.where(self.curved, np.median(both, axis=0) - self.point, 0.0)

    def go(self, change: Array, error: float) -> None:
        """Take the next ones."""
        self.worse = 0 if error < self.best else self.worse + 1
        self.best = min(error, self.best)
        if self.worse >= PATIENT:
            self.weight, self.worse = max(0.5 * self.weight, LEAST), 0
        self.point = self.point + self.weight * change

    @property
    def size(self) -> float:
        """Of the pressures, as a scale."""
        return float(self.point.max(initial=0.0))

    def unsettled(self, change: float, rounds: int) -> str:
        """The words for a loop that does not end."""
        return (
            f"pressures still change by {change:.1e} after {rounds} solves with tangents of "
            "the curves of pressure over overclosure; take smaller steps, or a smoother curve"
        )


def varying_law(problem: Any, given: Asked, start: Any, solve: Solve) -> FrictionSolution:
    """The solution of a problem whose law varies; given: options of the driver.

    Its problem has the fixed law that belongs to the solution.
    """
    law: VaryingFriction | VaryingCompliance = problem.law
    if given.criterion is not Criterion.JUDGE:
        raise UnsupportedLaw(f"criterion: published errors do not know {law.name}")
    state = None if start is None else _state(problem, start)
    way = (_Friction if isinstance(law, VaryingFriction) else _Tangents)(law, state)  # type: ignore[arg-type]
    error = np.inf
    rounds: list[FrictionSolution] = []
    while True:
        goal = min(max(LOOSE * error, ENOUGH * given.tolerance), LOOSE)
        left = None
        if given.max_iterations is not None:
            done = sum(found.convergence.iterations for found in rounds)
            left = max(given.max_iterations - done, 1)
        options = replace(given, tolerance=goal, max_iterations=left)
        found = solve(problem.with_law(way.fixed), options, start)
        rounds.append(found)
        change = way.changes(_undeformed(problem, found), found.u)
        error, weakest = _judged(problem, found)
        ended = _ended(given, found, error, weakest, goal, change, way, rounds)
        if ended is not None:
            return _whole(problem, given, rounds, way, error, weakest, *ended)
        way.go(change, error)
        start = found


def _relaxation(weight: float, change: Array, last: Array) -> float:
    """Aitken's factor for the next step from two changes mu(p, s) - mu, (nc,)."""
    turn = change - last
    size = float(turn @ turn)
    if size == 0.0:
        return MOST
    found = -weight * float(last @ turn) / size
    return float(np.clip(found if found > 0 else MOST, LEAST, MOST))


def _state(problem: Any, start: Any) -> tuple[Array, Array]:
    """(r, u) of a start."""
    r, v = problem.start(start)
    return _over(r, problem.growth(v)), problem.motion(r, v)[0]


def _undeformed(problem: Any, found: FrictionSolution) -> Array:
    """r of a solution whose pressures are those on areas that have not grown, (nc, d)."""
    return _over(found.r, problem.growth(found.v if problem.has_v else None))


def _over(r: Array, growth: Array | float) -> Array:
    """r (nc, d) over the growth of areas, (nc,) or 1."""
    return np.asarray(r / np.reshape(growth, (-1, 1)))


def _judged(problem: Any, found: FrictionSolution) -> tuple[float, Any]:
    """The error of the whole, and its weakest contact where it may decide."""
    v = found.v if problem.has_v else None
    known = problem.with_law(problem.law.frozen(_undeformed(problem, found), found.u))
    return known.error(found.r, v), known.weakest(found.r, v)


def _ended(
    given: Asked, found: FrictionSolution, error: float, weakest: Any, goal: float,
    change: Array, way: _Friction | _Tangents, rounds: list[FrictionSolution],
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
    largest = float(np.abs(change).max(initial=0.0))
    if last and largest <= STILL * way.size:
        return Outcome.STAGNATED, record.detail
    if len(rounds) >= ROUNDS:
        return Outcome.STAGNATED, way.unsettled(largest, len(rounds))
    return None


def _whole(
    problem: Any, given: Asked, rounds: list[FrictionSolution], way: _Friction | _Tangents,
    error: float, weakest: Any, outcome: Outcome, detail: str,
) -> FrictionSolution:  # fmt: skip
    """The last solution with the record of all rounds."""
    found, records = rounds[-1], [each.convergence for each in rounds]
    history: list[Step] = []
    for record in records:
        before = history[-1] if history else None
        history += [_after(before, step) for step in record.history]
    if history:
        history[-1] = history[-1]._replace(error=error)
    several = f"{len(rounds)} solves with {way.what}"
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
    grown = problem.growth(found.v if problem.has_v else None)
    frozen = problem.law.frozen(_over(found.r, grown), found.u).scaled(grown)
    frozen = replace(own, law=frozen)
    return replace(found, problem=frozen, convergence=record, follows=problem.law)


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

