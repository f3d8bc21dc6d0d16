"""The driver: it alone judges, stops, records, and turns the best iterate into a solution.

An iterate has converged when its error is below the tolerance and so is, on its own scale, that
of its weakest contact (`judge`).  Where only the first holds, the solver is started again from
there with a tolerance that promises the second; where that does not come about, the outcome is
WEAK_CONTACTS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .clock import Deadline, TimeLimit, compiling, deadline_of, now
from .cones import Coulomb
from .errors import InvalidInput, SingularOperator, TimeUp, UnsupportedForm, shown
from .indefinite import gains_energy, with_obstruction
from .interrupts import Watching
from .judge import EPSILON, Measure, Weakest
from .nitsche_problem import NO_MULTIPLIERS, NitscheProblem
from .problem import Form, FrictionProblem
from .settling import Motion, Settled, at_rest, motion, settled_state
from .solution import Convergence, FrictionSolution, Outcome, Step
from .solvers import Auto
from .solvers.base import Breakdown, Iterate, Solver, Target
from .solvers.first_iterate import first_iterate, no_reactions, with_motion

Array = NDArray[np.float64]
Callback = Callable[[Step, Iterate], bool | None]
MEMORY = 64  # iterates among which a repetition counts as a cycle
AT_REST = 1e-10  # relative change of r below which an iterate has not moved
PATIENCE = 500  # iterates without any progress before a solve counts as stagnated
PROGRESS = 0.99  # the best error must fall at least by this factor within PATIENCE
EARLY = 100  # iterates after which a problem that no method is made for is given up
BLUR = 1e-2  # rounding, relative to the tolerance, above which an error is evaluated sharply
BLURRED = 20  # iterates that would do if rounding could hide no error in them
TIGHTER = 0.3  # goal of a second start, relative to what would just do
GAVE_UP = (Outcome.STAGNATED, Outcome.BREAKDOWN, Outcome.CYCLED, Outcome.NON_FINITE)
TIGHTEST = 1e-300  # smallest goal: contacts far smaller than others need tiny sums


@dataclass
class _Watch:
    """The driver's memory of one solve."""

    problem: FrictionProblem | NitscheProblem
    tolerance: float
    contact_tolerance: float
    started: float = field(default_factory=now)
    compiled: float = field(default_factory=compiling)  # until then
    best: Iterate | None = None
    told: tuple[Motion, Settled] | None = None  # of the best iterate where it is good enough
    error: float = np.inf
    weakest: Weakest | None = None  # contact of the best iterate, once its error will do
    iterations: int = 0
    linear_iterations: int = 0
    history: list[Step] = field(default_factory=list)
    seen: list[tuple[float, Array]] = field(default_factory=list)
    blurred: int = 0  # iterates whose error rounding hides
    mark: tuple[int, float] = (0, np.inf)  # iterate and error of the last real progress

    def judge(self, iterate: Iterate) -> Step:
        """Judge an iterate and remember it if it is the best."""
        error, weakest, told = self.problem.error(iterate.r, iterate.v), None, None
        if error <= self.tolerance and not isinstance(self.problem, NitscheProblem):
            told = settled_state(self.problem, iterate.r, iterate.v)
            if told[1].r is not iterate.r:  # judged exactly, their motion is found again
                v = None if self.problem.measure is Measure.EXACT else iterate.v
                iterate = replace(iterate, r=told[1].r, v=v)
                error = self.problem.error(iterate.r, iterate.v)
        if error <= self.tolerance:
            weakest = self.problem.weakest(iterate.r, iterate.v)
            if weakest is not None and weakest.hidden > BLUR * self.tolerance:
                error = self.problem.certain_error(iterate.r, iterate.v)
                if error > self.tolerance:
                    weakest = None
                    self.blurred += 1
        self.iterations += iterate.iterations
        self.linear_iterations += iterate.linear_iterations
        seconds = now() - self.started
        step = Step(self.iterations, error, self.linear_iterations, seconds, iterate.sets)
        self.history.append(step)
        if self.best is None or self._better(error, weakest):
            self.best, self.error, self.weakest = iterate, error, weakest
            self.told = told
        if error < PROGRESS * self.mark[1]:
            self.mark = (len(self.history), error)
        return step

    def _better(self, error: float, weakest: Weakest | None) -> bool:
        """True for an error below the best; of those that will do, for the better contacts."""
        if weakest is None or self.weakest is None:
            return error < self.error
        return weakest.error < self.weakest.error

    @property
    def converged(self) -> bool:
        """True when the best iterate will do in the sum and at every contact."""
        good = self.error <= self.tolerance
        return good and (self.weakest is None or self.weakest.error <= self.contact_tolerance)

    @property
    def weak(self) -> bool:
        """True when the best iterate will do in the sum alone."""
        return self.error <= self.tolerance and not self.converged

    @property
    def in_words(self) -> str:
        """Why the best iterate will not do though its error is small; "" where it would."""
        if self.best is not None and not self.converged:
            hidden = self.problem.rounding(self.best.r)
            law = self.problem.law
            mu = law.mu.max(initial=0.0) if isinstance(law, Coulomb) else 0.0
            if mu * EPSILON > self.tolerance:
                return (
                    f"rounding of the slip, times friction of {mu:.0e}, is above the "
                    "tolerance: hold contacts that can not slip by supports, or take mu below "
                    "1e7"
                )
            if hidden > self.tolerance:
                return (
                    f"rounding alone may hide an error of {hidden:.1e}: reactions are huge "
                    "beside what loads the contacts"
                )
        if not self.weak or self.weakest is None:
            return ""
        return (
            f"contact {self.weakest.contact} misses its law by {self.weakest.error:.1e} on its "
            f"own scale, {self.contact_tolerance:.0e} is allowed"
        )

    def tighter(self, goal: float) -> float:
        """The next goal for the error, so that the weakest contact will do too."""
        assert self.weakest is not None
        share = TIGHTER * self.contact_tolerance / self.weakest.error
        return max(min(self.error * share, TIGHTER * goal), np.finfo(float).tiny)

    def cycled(self, iterate: Iterate, error: float) -> bool:
        """True when this iterate was here before, with other iterates in between.

        One that hardly moves does not come back: its method may wait for something else.
        """
        same = [self._repeats(iterate, error, *old) for old in self.seen]
        size = np.abs(iterate.r).max(initial=0.0)
        moved = not self.seen or np.abs(self.seen[-1][1] - iterate.r).max(initial=0.0)
        self.seen.append((error, iterate.r))
        del self.seen[:-MEMORY]
        return any(same) and not same[-1] and moved > AT_REST * size

    @staticmethod
    def _repeats(iterate: Iterate, error: float, old_error: float, old: Array) -> bool:
        if abs(old_error - error) > 1e-12 * error:
            return False
        size = np.abs(iterate.r).max(initial=0.0)
        return bool(np.abs(old - iterate.r).max(initial=0.0) <= 1e-13 * size)

    @property
    def stagnated(self) -> bool:
        """True when the best error has not moved for PATIENCE iterates.

        Or when rounding has hidden that of BLURRED ones: more of them will not be known better.
        """
        return len(self.history) - self.mark[0] > PATIENCE or self.blurred > BLURRED


def drive(
    problem: FrictionProblem | NitscheProblem,
    solver: Solver | None = None,
    *,
    tolerance: float = 1e-8,
    contact_tolerance: float | None = None,
    max_iterations: int | None = None,
    time_limit: TimeLimit = None,
    start: Iterate | FrictionSolution | None = None,
    callback: Callback | None = None,
) -> FrictionSolution:
    """Run a solver until the judge is content or a limit is met; never raises for a failure.

    tolerance: on the unit-free error of `judge`; contact_tolerance: on the contactwise one, by
    default the square root of the tolerance, infinite to ask for the first alone.  time_limit
    in seconds, those of compiling not counted, or a Deadline.
    callback(step, iterate) is called after every iterate; returning True stops.  Ctrl-C gives
    the outcome STOPPED with the best iterate.  Raises UnsupportedForm when the solver needs
    the other form.
    """
    given = _Options(tolerance, contact_tolerance, max_iterations, time_limit, callback)
    return _drive(problem, solver, given, start, with_motion)


def drive_from(
    start: Iterate,
    problem: FrictionProblem | NitscheProblem,
    solver: Solver | None = None,
    *,
    tolerance: float = 1e-8,
    contact_tolerance: float | None = None,
    max_iterations: int | None = None,
    time_limit: TimeLimit = None,
    callback: Callback | None = None,
) -> FrictionSolution:
    """Like `drive`, for the question what a solver makes of a start.

    The start is a solution only with the v that it has.  `drive` asks whether the reactions of
    the start are right, where it can find their motion: no contact force and another v would
    be the end at once where the bodies move away, and the solver were never asked.
    """
    given = _Options(tolerance, contact_tolerance, max_iterations, time_limit, callback)
    return _drive(problem, solver, given, start, lambda problem, start: start)


@dataclass(frozen=True)
class _Options:
    """What `drive` takes, checked."""

    tolerance: float
    contact_tolerance: float | None
    max_iterations: int | None
    time_limit: TimeLimit
    callback: Callback | None

    def __post_init__(self) -> None:
        if self.callback is not None and not callable(self.callback):
            raise InvalidInput(f"callback: expected a function, got {self.callback!r}")
        _check_options(self.tolerance, self.contact_tolerance, self.max_iterations)

    @property
    def of_contacts(self) -> float:
        """The contact tolerance that holds."""
        given = self.contact_tolerance
        return self.tolerance**0.5 if given is None else given


def _drive(
    problem: FrictionProblem | NitscheProblem,
    solver: Solver | None,
    given: _Options,
    start: Iterate | FrictionSolution | None,
    first: Callable[[FrictionProblem | NitscheProblem, Iterate], Iterate],
) -> FrictionSolution:
    """The solve; `first` makes of the start what is judged before the first iteration."""
    solver = solver if solver is not None else Auto()
    deadline = deadline_of(given.time_limit)
    _check_solver(problem, solver)
    if not getattr(solver, "matrix_free", False):
        problem = problem.assembled()
    watch = _Watch(problem, given.tolerance, given.of_contacts)
    begin, limit = first_iterate(problem, start), given.max_iterations or np.inf
    target = Target(given.tolerance, deadline)
    with Watching():
        outcome, detail = _run(watch, solver, begin, target, limit, given.callback, first)
    return _finish(watch, outcome, detail, solver)


def _check_solver(problem: FrictionProblem | NitscheProblem, solver: Solver) -> None:
    """Raise InvalidInput for what is no solver, UnsupportedForm for one of another form."""
    if isinstance(solver, type) or not hasattr(solver, "iterates"):
        raise InvalidInput(
            f"solver: expected an instance such as GaussSeidel(), got {solver!r}"
        )
    if problem.form is Form.NITSCHE:
        if not getattr(solver, "nitsche", False):
            raise UnsupportedForm(f"{type(solver).__name__}: {NO_MULTIPLIERS}")
    elif solver.form is not Form.ANY and solver.form is not problem.form:
        problem_form = problem.form.value
        condense = solver.form is Form.DELASSUS
        hint = "problem.condensed()" if condense else "Auto or a solver of the local form"
        raise UnsupportedForm(
            f"{type(solver).__name__} needs the {solver.form.value} form, the problem is "
            f"{problem_form}; use {hint}"
        )


def _run(
    watch: _Watch,
    solver: Solver,
    start: Iterate,
    target: Target,
    limit: float,
    callback: Callback | None,
    first: Callable[[FrictionProblem | NitscheProblem, Iterate], Iterate],
) -> tuple[Outcome, str]:
    """Start the solver, and again with a tighter goal while only contacts are not settled."""
    try:
        _prepare(watch.problem, target.deadline)
        watch.judge(first(watch.problem, start))
        if watch.converged:
            return Outcome.CONVERGED, ""
        ended = (Outcome.STAGNATED, "")
        while target.tolerance >= TIGHTEST:
            if watch.weak:
                goal = watch.tighter(target.tolerance)
                start, target = watch.best or start, replace(target, tolerance=goal)
            ended = _once(watch, solver, start, target, limit, callback)
            if ended is not None:
                break
        outcome, detail = ended or (Outcome.STAGNATED, "")
    except TimeUp:
        outcome, detail = Outcome.TIME_LIMIT, ""
    except KeyboardInterrupt:
        return Outcome.STOPPED, "by the user"
    if watch.weak and outcome in GAVE_UP:
        return Outcome.WEAK_CONTACTS, watch.in_words
    return outcome, "; ".join(text for text in (detail, watch.in_words) if text)


def _once(
    watch: _Watch,
    solver: Solver,
    start: Iterate,
    target: Target,
    limit: float,
    callback: Callback | None,
) -> tuple[Outcome, str] | None:
    """The loop over the iterates of one start.

    Returns why it ended; None when the error is below the target, but not that of contacts.
    A method with a stopping rule of its own (`Iterate.ends`) is not stopped before that holds.
    """
    try:
        each = _operations(watch.problem) if target.deadline.work is not None else 0.0
        for iterate in solver.iterates(watch.problem, start, target):
            target.deadline.spend(iterate.iterations * each)
            step = watch.judge(iterate)
            stop = callback is not None and callback(step, iterate)
            if watch.converged and iterate.ends != "":
                return Outcome.CONVERGED, iterate.stage or iterate.ends or ""
            if iterate.ends:
                return Outcome.STOPPED, f"by its own rule: {iterate.ends}"
            if stop:
                return Outcome.STOPPED, "by the callback"
            if not np.isfinite(step.error):
                return Outcome.NON_FINITE, ""
            if watch.iterations >= limit:
                return Outcome.MAX_ITERATIONS, ""
            if target.deadline.passed:
                return Outcome.TIME_LIMIT, ""
            if watch.weak and step.error <= target.tolerance and iterate.ends is None:
                return None
            if len(watch.history) == EARLY and gains_energy(watch.problem):
                return Outcome.BREAKDOWN, "stopped early"
            if watch.cycled(iterate, step.error):
                return Outcome.CYCLED, ""
            if watch.stagnated:
                return Outcome.STAGNATED, ""
        return Outcome.STAGNATED, "the method has nothing left to try"
    except Breakdown as reason:
        late = target.deadline.passed
        return Outcome.TIME_LIMIT if late else Outcome.BREAKDOWN, str(reason)
    except TimeUp:
        return Outcome.TIME_LIMIT, ""
    except SingularOperator as reason:
        return Outcome.BREAKDOWN, str(reason)
    except ArithmeticError as reason:
        return Outcome.NON_FINITE, str(reason)


def _finish(watch: _Watch, outcome: Outcome, detail: str, solver: Solver) -> FrictionSolution:
    problem = watch.problem
    best = watch.best if watch.best is not None else Iterate(no_reactions(problem))
    measure = problem.measure if watch.best is not None else Measure.EXACT
    told = None if watch.told is None else watch.told[1]
    if watch.told is not None and problem.form is Form.DELASSUS:
        u, v = watch.told[0]
    elif watch.best is None and problem.form is Form.GLOBAL:
        u, v = at_rest(problem)  # stopped in the first factorisation: do not start it again
    else:
        u, v = motion(problem, best.r, best.v if measure is not Measure.EXACT else None)
    error, weakest = watch.error, watch.weakest
    if weakest is None and watch.best is not None:
        weakest = problem.weakest(best.r, best.v)
        if weakest is not None and weakest.hidden > BLUR * error:
            error = max(error, problem.certain_error(best.r, best.v))
    if outcome not in (Outcome.CONVERGED, Outcome.STOPPED) and watch.best is not None:
        detail = with_obstruction(problem, u, detail)
    seconds = now() - watch.started
    record = Convergence(
        outcome,
        watch.iterations,
        error,
        watch.tolerance,
        tuple(watch.history),
        watch.linear_iterations,
        seconds,
        type(solver).__name__,
        measure,
        detail,
        contact_error=None if weakest is None else weakest.error,
        contact_tolerance=watch.contact_tolerance,
        weakest=None if weakest is None else weakest.contact,
        compiling=compiling() - watch.compiled,
    )
    return FrictionSolution(problem, best.r, u, v, record, settled=told)


def _prepare(problem: FrictionProblem | NitscheProblem, deadline: Deadline) -> None:
    """Form W where it judges, as far as time allows; raises TimeUp."""
    if isinstance(problem, FrictionProblem):
        problem.prepare(deadline)


def _operations(problem: FrictionProblem | NitscheProblem) -> float:
    """Of an iteration, roughly: some products with W, or a solve with M.

    No Newton step, but those are few.
    """
    if problem.form is Form.DELASSUS:
        return 100.0 * problem.blocks.data.size  # type: ignore[union-attr]
    return 1000.0 * problem.unknowns


def _check_number(name: str, value: object) -> None:
    if not isinstance(value, int | float | np.number) or isinstance(value, bool):
        raise InvalidInput(f"{name}: expected a number, got {shown(value)}")
    if isinstance(value, int) and value.bit_length() > 1000:  # more than a float can hold
        raise InvalidInput(f"{name}: expected a number that floats can hold, got a larger one")


def _check_options(
    tolerance: float, contact_tolerance: float | None, max_iterations: int | None
) -> None:
    _check_number("tolerance", tolerance)
    if contact_tolerance is not None:
        _check_number("contact_tolerance", contact_tolerance)
        if not contact_tolerance > 0:
            raise InvalidInput(
                f"contact_tolerance: expected a number > 0, got {contact_tolerance}"
            )
    if max_iterations is not None:
        _check_number("max_iterations", max_iterations)
    if not (0 < tolerance < 1):
        raise InvalidInput(f"tolerance: expected between 0 and 1, got {tolerance}")
    if max_iterations is not None and max_iterations < 1:
        raise InvalidInput(f"max_iterations: expected at least 1, got {max_iterations}")
