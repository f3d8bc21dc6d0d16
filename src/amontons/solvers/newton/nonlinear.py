"""Semismooth Newton with line search and load steps, for problems without one stiffness.

The problem is F(v) = 0, piecewise smooth, with a linearisation at every admissible state; see
`model.large_deformation`.  It is tried at full load at once; where that fails the load grows in
steps from a state that is known, each begun by one of `predictors`: where Newton's method fails
from one the next is tried.  `step_lengths` says how far steps go.  Where two bodies slide and a
state under load is known, a Newton step that passes the test in no part ends the attempt.
After the last predictor, however that ends, bodies creep on (`creeping`) from the first state
where an attempt ended so, whatever the load step, as cut ones lead to the same state by more
Newton steps.  Where bodies do not come to rest the load step is cut, and where they do not in a
SHORT one load steps begin anew, with patience for steps that do not pass.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells, SingularOperator, TimeUp
from ...core.options import check_options
from ...linear import LinearSolver
from ...problem.friction import FrictionProblem
from ...problem.protocol import Problem
from ..contract import Breakdown, Iterate, Patience, Target, check_at_least, check_positive
from .creeping import creeping
from .linear_steps import LinearSteps, forcing, newton_step
from .predictors import predictors
from .states import Linear, PlainStates, States
from .step_lengths import Failed, by_natural_test, by_residual

Array = NDArray[np.float64]
LOOSE = 1e-5  # error, unit-free, at which a load step is good enough to go on
REPEATED = 1e-12  # relative difference of |F| below which steps go round in circles
SHORT = 1 / 16  # of the load: steps that are not cut where bodies do not come to rest
CREPT = "over a jump, to where bodies creep"
JUMP = "; if the body jumps there, crossing=PathCrossing() of this solver follows it"
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

    def astray(self, v: Array, known: Any, jumped: bool = True) -> str:
        """Why no step leads to v though it is an equilibrium; "" for nothing.

        known: problem and state that it begins at; jumped: over a jump.
        """
        return ""

    def closed_pieces(self, v: Array) -> list[Any]:
        """Pieces with ever more contacts closed, for states at which nothing holds a body."""
        ...

    def held(self, v: Array, firmness: float) -> NonlinearProblem:
        """The problem with a part of the stiffness at rest as springs relaxed at a state."""
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
                yield from shown.best(self._newton(problem, states, target, linear, shown))
            except (Failed, InvertedCells):
                pass  # the start was no help
        share, step, v, reason, refused = 0.0, 1.0, problem.known_state, "", ""
        creeping_helps = self.crossing is None and problem.shortest > 0
        while True:
            loaded = share > 0 or bool(problem.known_state.any())
            if step < self.smallest_share and creeping_helps and loaded:  # with patience, then
                creeping_helps, share, step, v = False, 0.0, 1.0, problem.known_state
                shown.note, shown.wild = "", True
            if step < self.smallest_share:
                if self.crossing is not None:
                    v, told = self.crossing.across(problem, share, v, target)
                    found = self._newton(problem, problem.states(v), target, linear, shown)
                    yield from shown.best(found, told)
                remark = problem.at_share(share).remark(v)
                if refused and refused != reason:
                    told = f"a state beyond was refused: {refused}"
                    remark = f"{told}; {remark}" if remark else told
                hint = f"; {remark}" if remark else JUMP if self.crossing is None else ""
                raise Breakdown(
                    f"no equilibrium found beyond {share:.4g} of the load: {reason}{hint}"
                )
            goal = min(1.0, share + step)
            before, note, stuck = shown.waiting, shown.note, None
            arrived: Array | None = None
            shown.brief = creeping_helps and loaded
            for predict in (*predictors(problem), None):
                try:
                    first = stuck
                    if predict is not None:
                        first = predict(problem, share, goal, v, target, linear)
                    if first is None:  # nowhere to creep from
                        break
                    before = shown.waiting
                    arrived = yield from self._reached(
                        problem, (share, goal, v), first, target, linear, shown, predict is None
                    )
                    break
                except (Breakdown, TimeUp) as ended:
                    known = problem.at_share(share)
                    raise self._placed(ended, known, v, target, reason) from ended
                except (Failed, InvertedCells) as failure:
                    reason, shown.note = str(failure), note
                    refused = reason if isinstance(failure, _Astray) else refused
                    if stuck is None and isinstance(failure, _Stuck):
                        stuck = failure.v
            if arrived is not None:
                share, v = goal, arrived
                step *= 2 if shown.waiting - before <= EASY else 1
            elif shown.brief and step <= SHORT:
                step = 0.0
            else:
                step = (goal - share) / (4 if goal - share == 1.0 else 2)

    def _reached(
        self, problem: NonlinearProblem, way: tuple[float, float, Array], first: Array,
        target: Target, linear: LinearSteps, shown: _Shown, creeps: bool,
    ) -> Generator[Iterate, None, Array]:  # fmt: skip
        """The state at a share of the load, from first; way: shares, the state at the lower."""
        share, goal, v = way
        known = problem.at_share(share), v
        jumped = creeps or shown.wild
        if goal == 1.0:
            states = problem.states(first, known)
            found = self._newton(problem, states, target, linear, shown, creeps)
            yield from shown.best(_not_astray(found, problem, known, target.tolerance, jumped))
        then = problem.at_share(goal)
        states = then.states(first, known)
        found = self._newton(then, states, target, linear, shown, creeps)
        arrived = shown.reached(found, then, states.v(states.start))
        if why := then.astray(arrived, known, jumped):
            raise _Astray(why)
        return arrived

    def _newton(
        self, problem: NonlinearProblem, states: States, target: Target, linear: LinearSteps,
        shown: _Shown, creeps: bool = False,
    ) -> Iterator[tuple[Array, Array, float]]:  # fmt: skip
        """(v, r, |F| one step before) of Newton steps; Failed when they lead nowhere.

        creeps: over a jump first.
        """
        sizes: list[float] = []
        patience, w = Patience(self.patience), states.start
        if creeps:
            shown.note = CREPT
            for way in creeping(problem, states.v(w), self.halvings, linear, target):
                shown.waiting += 1
                yield way, problem.reactions(way), np.inf
                w = problem.states(way).start
        while target.seconds_left > 0:
            v = states.v(w)
            try:
                here = states.linearisation(w)
                size = states.size(w, here)
                again = any(abs(size - old) <= REPEATED * size for old in sizes)
                sizes.append(size)
                if again or patience.over(size):
                    self._stop(problem, v)
                moved, factor = newton_step(
                    problem, v, here, here.residual, linear, forcing(sizes)
                )
            except SingularOperator as reason:
                raise Failed(str(reason)) from reason
            shown.waiting += 1
            step, goes = states.whole(w, moved), True
            if problem.shortest > 0:
                length, goes = by_natural_test(problem, states, w, step, factor, self.halvings)
            else:
                length = by_residual(states, w, step, sizes, self.halvings)
            if not goes and shown.brief and not self._right(problem, v, target):
                raise _Stuck(v)
            w = w + length * step
            yield states.v(w), states.reactions(w), size
        raise Breakdown("out of time between two load steps")

    @staticmethod
    def _right(problem: NonlinearProblem, v: Array, target: Target) -> bool:
        """True for a state that will do: tests of steps there compare rounding."""
        return problem.error(problem.reactions(v), v) <= target.tolerance

    @staticmethod
    def _placed(
        ended: Breakdown | TimeUp, problem: NonlinearProblem, v: Array, target: Target,
        reason: str,
    ) -> Exception:  # fmt: skip
        """The same end; where time is over with why load steps ended, and what v has to say."""
        if target.seconds_left > 0:
            return ended
        why = f"load steps ended, as {reason}" if reason else ""
        told = "; ".join(part for part in (str(ended), why, problem.remark(v)) if part)
        return Breakdown(told)

    @staticmethod
    def _stop(problem: NonlinearProblem, v: Array) -> None:
        """Raise Failed, or Breakdown where the state is right up to rounding."""
        reason = "Newton's steps no longer reduce the residual"
        if problem.error(problem.reactions(v), v) <= LOOSE:
            raise Breakdown(reason)
        raise Failed(reason)


def _not_astray(
    steps: Iterator[tuple[Array, Array, float]], problem: NonlinearProblem,
    known: tuple[NonlinearProblem, Array], tolerance: float, jumped: bool,
) -> Iterator[tuple[Array, Array, float]]:  # fmt: skip
    """Steps from a known state; Failed where they end at one that none leads to."""
    for v, r, size in steps:
        if problem.error(r, v) <= tolerance and (why := problem.astray(v, known, jumped)):
            raise _Astray(why)
        yield v, r, size


class _Astray(Failed):
    """There is an equilibrium, but no step leads to it."""


class _Stuck(Failed):
    """A Newton step from v (n,) passes the test in no part."""

    def __init__(self, v: Array) -> None:
        super().__init__("no part of a Newton step leads nearer")
        self.v = v


@dataclass
class _Shown:
    """Lets pass what is better than all before."""

    size: float = np.inf
    waiting: int = 0  # Newton steps since then, those that led nowhere, too
    brief: bool = False  # steps that the test refuses end an attempt: another way is next
    wild: bool = False  # all ways but steps that the test refuses have failed: bodies may jump
    note: str = ""  # what happened on the way

    def best(
        self, steps: Iterator[tuple[Array, Array, float]], told: str = ""
    ) -> Iterator[Iterate]:
        """The iterates whose |F| is the least so far."""
        for v, r, size in steps:
            if size < self.size:
                yield Iterate(r, v, self.waiting, self.waiting, told or self.note)
                self.size, self.waiting = size, 0

    def reached(
        self, steps: Iterator[tuple[Array, Array, float]], problem: NonlinearProblem, v: Array
    ) -> Array:
        """The first state from v on that is good enough for a load between."""
        while problem.error(problem.reactions(v), v) > LOOSE:
            v = next(steps)[0]
        return v
