"""Semismooth Newton with line search and load steps, for problems without one stiffness.

The problem is F(v) = 0, piecewise smooth, with a linearisation at every admissible state; see
`model.large_deformation`.  It is tried at full load at once; where that fails the load grows in
steps from a state that is known, each begun by a tangent predictor,

    dF/dv dv = -(F(v) + dF/dload dload),

which also moves the prescribed displacements: cells would be inverted by moving these alone.
Another predictor is the solution of the tangent problem with contact: contacts that change
find their statuses together, where Newton's steps change them ring by ring, the more steps the
more contacts.  It comes first between bodies that slide, of LARGE ones by some cycles of
contact multigrid, and where cells can be inverted, as nothing else keeps such bodies from
passing through obstacles.  Where Newton's method fails from one predictor the next is tried.

Line search: halving until |F| falls below the largest of the last few values; states with
inverted cells are never accepted.  Where problems say so by `shortest`, it halves until the
step that the same matrix asks for at the new state is shorter: the natural monotonicity test of
[D], which does not change with the units of rows, while |F| hears most of the stiffest nodes.

[D] P. Deuflhard, "Newton methods for nonlinear problems", Springer (2004), section 3.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells, SingularOperator, UnsupportedForm
from ...core.options import check_options
from ...linear import LinearSolver
from ...linear.base import Factor
from ...problem.friction import FrictionProblem
from ...problem.protocol import Problem
from ..contract import (
    Breakdown,
    Iterate,
    Judgement,
    Patience,
    Target,
    check_at_least,
    check_positive,
)
from ..judging import EARLY, first_of, sent
from .linear_steps import LARGE, LOOSEST, LinearSteps, forcing
from .states import Linear, PlainStates, States

Array = NDArray[np.float64]
MEMORY = 5  # values of |F| of which the largest counts in the line search
ENOUGH = 1e-4  # least relative decrease of |F| over a full step
NATURAL = 0.25  # least relative decrease of the next step over a full step, natural test
LOOSE = 1e-5  # error, unit-free, at which a load step is good enough to go on
REPEATED = 1e-12  # relative difference of |F| below which steps go round in circles
JUMP = "; if the body jumps there, crossing=PathCrossing() of this solver follows it"
STATUSES = 1e-8  # error of a tangent problem with contact
CONTACT_STEPS = 300  # iterates in which it has to be reached
ROUGH = 1e-4  # the same where cycles solve it: what the tangent leaves out is more
CYCLES = 30  # most of them
EASY = 8  # Newton steps up to which the next load step may be longer


class NonlinearProblem(Problem):
    """What the method asks for besides `Problem`; states v (n,), residuals (n,)."""

    unfit = (
        "large deformations are no linear problem with contact: NonlinearNewton solves them, "
        "which auto takes"
    )

    shortest: float = 0.0  # least part of a Newton step to take, if > 0 by the natural test

    def residual(self, v: Array) -> Array:
        """F(v); raises InvertedCells where it is not defined."""
        ...

    def linearisation(self, v: Array, pieces: Any = None) -> Linear:
        """F and its derivatives, of the active pieces or of given ones."""
        ...

    def reactions(self, v: Array) -> Array:
        """Contact forces (nc, d)."""
        ...

    def states(self, v: Array, known: Any = None) -> States:
        """What steps move, from v on; known: problem and state that led there, or None."""
        return PlainStates(self, v)

    def at_share(self, share: float) -> NonlinearProblem:
        """The problem at a share of the load between the known state and the whole load."""
        ...

    def predicted(self, share: float, goal: float, v: Array) -> tuple[Linear, Array]:
        """The linearisation at a share, and the first-order change of F, (n,), to another."""
        ...

    def towards(self, share: float, goal: float, v: Array) -> FrictionProblem:
        """The tangent problem with contact at a share, under the load of another."""
        ...

    def remark(self, v: Array) -> str:
        """What may be wrong at a state beyond which no equilibrium is found; "" for nothing."""
        return ""

    def closed_pieces(self, v: Array) -> list[Any]:
        """Pieces with ever more contacts closed, for states at which nothing holds a body."""
        ...

    @property
    def meets_first(self) -> bool:
        """True where load steps begin with the tangent problem with contact."""
        ...

    @property
    def known_state(self) -> Array:
        """The state at share 0."""
        ...


class Crossing(Protocol):
    """Leads on from where load steps end."""

    def across(self, problem: Any, share: float, v: Array, target: Target) -> tuple[Array, str]:
        """(state at the whole load, what happened on the way); Breakdown where it can not."""
        ...


@dataclass(frozen=True)
class NonlinearNewton:
    """The method for large deformations."""

    halvings: int = 7  # of a Newton step in the line search
    patience: int = 12  # Newton steps without halving the residual before the load step is cut
    smallest_share: float = 1e-4  # of the load in one load step
    linear: LinearSolver | None = None  # of its steps; by default chosen by their size
    crossing: Crossing | None = None  # what leads on where load steps end, see `PathCrossing`

    solves: ClassVar[tuple[type, ...]] = (NonlinearProblem,)

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(0, halvings=self.halvings)
        check_at_least(1, patience=self.patience)
        check_positive(smallest_share=self.smallest_share)

    def iterates(
        self, problem: NonlinearProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Newton steps at full load from a given v, else load steps from the known state.

        Only states better than all before are shown to the driver.
        """
        shown, linear = _Shown(), LinearSteps(self.linear)
        if start.v is not None:
            try:
                states = problem.states(start.v)
                yield from shown.best(self._newton(problem, states, target, linear))
            except (_Failed, InvertedCells):
                pass  # the start was no help
        share, step, reason = 0.0, 1.0, ""
        v = problem.known_state
        while True:
            if step < self.smallest_share:
                if self.crossing is not None:
                    v, told = self.crossing.across(problem, share, v, target)
                    found = self._newton(problem, problem.states(v), target, linear)
                    yield from shown.best(found, told)
                hint = "" if self.crossing is not None else JUMP
                if remark := problem.at_share(share).remark(v):
                    hint = f"; {remark}"
                raise Breakdown(
                    f"no equilibrium found beyond {share:.4g} of the load: {reason}{hint}"
                )
            goal = min(1.0, share + step)
            for predict in self._predictors(problem):
                try:
                    first = predict(problem, share, goal, v, target, linear)
                    if goal == 1.0:
                        states = problem.states(first, (problem.at_share(share), v))
                        yield from shown.best(self._newton(problem, states, target, linear))
                    then = problem.at_share(goal)
                    states = then.states(first, (problem.at_share(share), v))
                    v, steps = self._equilibrium(then, states, target, linear)
                    break
                except (_Failed, InvertedCells) as failure:
                    reason = str(failure)
            else:
                step /= 4 if share == 0 and step == 1.0 else 2
                continue
            shown.waiting += steps
            share = goal
            step *= 2 if steps <= EASY else 1

    def _predictors(self, problem: NonlinearProblem) -> Sequence[Callable[..., Array]]:
        """In the order in which they are tried."""
        tangent, contact = self._predict, self._predict_contact
        if problem.shortest > 0 and not problem.meets_first:
            if problem.unknowns >= LARGE[problem.dimension]:
                return self._predict_by_cycles, tangent, contact
            return contact, tangent
        return (contact, tangent) if problem.meets_first else (tangent, contact)

    def _predict(
        self, problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
        linear: LinearSteps,
    ) -> Array:  # fmt: skip
        """The tangent predictor from a state at one share of the load to another."""
        try:
            here, change = problem.predicted(share, goal, v)
            now = problem.at_share(share)
            return v + self._solve(now, v, here, here.residual + change, linear)[0]
        except (InvertedCells, SingularOperator) as reason:
            raise _Failed(str(reason)) from reason

    def _predict_contact(
        self, problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
        linear: LinearSteps,
    ) -> Array:  # fmt: skip
        """The solution of the tangent problem with contact: its statuses are right together.

        Newton's steps change them one after another, and may go round in circles where many
        contacts close at once.
        """
        from ..auto.hybrid import Auto  # which takes this method, too

        whole = problem.towards(share, goal, v)
        whole = replace(whole, near_nullspace=None)  # by factors, which are cheaper here
        tangent = whole if whole.law.varies else whole.plain  # with springs behind v
        start = Iterate(np.zeros((tangent.contacts, tangent.dimension)))
        try:
            most = EARLY if tangent.gains_energy else CONTACT_STEPS
            iterates = first_of(Auto().iterates(tangent, start, target), most)
            iterate = sent(iterates, None)
            while iterate is not None:
                state = iterate.v if iterate.v is not None else tangent.velocity(iterate.r)[1]
                error = tangent.error(iterate.r, state)
                if error <= STATUSES and state is not None:
                    return state[: whole.unknowns]
                if target.deadline.passed:
                    break
                iterate = sent(iterates, Judgement(error, None, target.deadline))
        except (Breakdown, SingularOperator) as reason:
            raise _Failed(str(reason)) from reason
        raise _Failed("the tangent problem with contact was not solved")

    def _predict_by_cycles(
        self, problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
        linear: LinearSteps,
    ) -> Array:  # fmt: skip
        """The same to ROUGH, for about the price of one Newton step whatever the size."""
        from ..multigrid.cycles import ContactMultigrid  # as above

        whole = problem.towards(share, goal, v)
        tangent, cycles = whole if whole.law.varies else whole.plain, 0
        start = Iterate(np.zeros((tangent.contacts, tangent.dimension)))
        try:
            goal_of_cycles = Target(ROUGH, target.deadline)
            for iterate in ContactMultigrid().iterates(tangent, start, goal_of_cycles):
                cycles += iterate.iterations
                if iterate.v is not None and iterate.own[-1] <= ROUGH:
                    return iterate.v[: whole.unknowns]
                if cycles >= CYCLES or target.deadline.passed:
                    break
        except (Breakdown, SingularOperator, UnsupportedForm) as reason:
            raise _Failed(str(reason)) from reason
        raise _Failed("the tangent problem with contact was not solved")

    def _equilibrium(
        self, problem: NonlinearProblem, states: States, target: Target, linear: LinearSteps
    ) -> tuple[Array, int]:
        """(v, Newton steps) at a load between, found loosely."""
        steps, v = 0, states.v(states.start)
        found = self._newton(problem, states, target, linear)
        while problem.error(problem.reactions(v), v) > LOOSE:
            v, steps = next(found)[0], steps + 1
        return v, steps

    def _newton(
        self, problem: NonlinearProblem, states: States, target: Target, linear: LinearSteps
    ) -> Iterator[tuple[Array, Array, float]]:
        """(v, r, |F| one step before) of Newton steps; _Failed when they lead nowhere."""
        sizes: list[float] = []
        patience, w = Patience(self.patience), states.start
        while target.seconds_left > 0:
            v = states.v(w)
            try:
                here = states.linearisation(w)
                size = states.size(w, here)
                again = any(abs(size - old) <= REPEATED * size for old in sizes)
                sizes.append(size)
                if again or patience.over(size):
                    self._stop(problem, v)
                moved, factor = self._solve(
                    problem, v, here, here.residual, linear, forcing(sizes)
                )
            except SingularOperator as reason:
                raise _Failed(str(reason)) from reason
            step = states.whole(w, moved)
            if problem.shortest > 0:
                w = w + self._natural_length(problem, states, w, step, factor) * step
            else:
                w = w + self._length(states, w, step, sizes) * step
            yield states.v(w), problem.reactions(states.v(w)), size
        raise Breakdown("out of time between two load steps")

    @staticmethod
    def _stop(problem: NonlinearProblem, v: Array) -> None:
        """Raise _Failed, or Breakdown where the state is right up to rounding."""
        reason = "Newton's steps no longer reduce the residual"
        if problem.error(problem.reactions(v), v) <= LOOSE:
            raise Breakdown(reason)
        raise _Failed(reason)

    @staticmethod
    def _solve(
        problem: NonlinearProblem, v: Array, here: Linear, F: Array, linear: LinearSteps,
        tolerance: float = LOOSEST,
    ) -> tuple[Array, Factor]:  # fmt: skip
        """-dF/dv^-1 F and the factors; with more contacts closed where a body is loose."""
        try:
            return linear.solved(here, F, tolerance)
        except SingularOperator:
            for pieces in problem.closed_pieces(v):
                try:
                    return linear.solved(problem.linearisation(v, pieces), F, tolerance)
                except SingularOperator:
                    continue
            raise

    def _length(
        self, states: States, w: Array, step: Array, sizes: list[float]
    ) -> float:
        """The part of a Newton step to take; the best of all tried where none is enough."""
        allowed = max(sizes[-MEMORY:])
        best, found, reason = np.inf, 0.0, ""
        for k in range(self.halvings + 1):
            length = 0.5**k
            try:
                size = float(np.linalg.norm(states.residual(w + length * step)))
            except InvertedCells as why:
                reason = str(why)
                continue
            if size <= (1 - ENOUGH * length) * allowed:
                return length
            if size < best:
                best, found = size, length
        if not np.isfinite(best):
            raise _Failed(f"every step leads to where {reason}")
        return found

    def _natural_length(
        self, problem: NonlinearProblem, states: States, w: Array, step: Array, factor: Factor
    ) -> float:
        """The same by the natural monotonicity test, no shorter than `problem.shortest`."""
        size = float(np.linalg.norm(states.v(w + step) - states.v(w)))
        best, found, reason = np.inf, 0.0, ""
        for k in range(self.halvings + 1):
            length = 0.5**k
            if length < problem.shortest and np.isfinite(best):
                break
            try:
                F = problem.residual(states.v(w + length * step))
            except InvertedCells as why:
                reason = str(why)
                continue
            again = float(np.linalg.norm(factor.solve(-F)))
            if again <= (1 - NATURAL * length) * size:
                return length
            if again < best:
                best, found = again, length
        if not np.isfinite(best):
            raise _Failed(f"every step leads to where {reason}")
        return found


class _Failed(Exception):
    """Newton's method does not converge at this load."""


@dataclass
class _Shown:
    """Lets pass what is better than all before, and counts what it keeps back."""

    size: float = np.inf
    waiting: int = 0

    def best(
        self, steps: Iterator[tuple[Array, Array, float]], told: str = ""
    ) -> Iterator[Iterate]:
        """The iterates whose |F| is the least so far."""
        for v, r, size in steps:
            self.waiting += 1
            if size < self.size:
                yield Iterate(r, v, self.waiting, self.waiting, told)
                self.size, self.waiting = size, 0
