"""The driver: it alone judges, stops, records, and turns the best iterate into a solution.

An iterate has converged when its error is below the tolerance and so is, on its own scale, that
of its weakest contact (`judge`).  Where only the first holds, the solver is started again from
there with a tolerance that promises the second; where that does not come about, the outcome is
WEAK_CONTACTS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.clock import Deadline, TimeLimit, compiling, deadline_of, now
from ..core.errors import InvalidInput, SingularOperator, TimeUp, UnsupportedForm, shown
from ..core.interrupts import Watching
from ..problem.friction import Form, FrictionProblem
from ..problem.indefinite import gains_energy, with_obstruction
from ..problem.judge.measures import Criterion, Measure
from ..problem.nitsche import NO_MULTIPLIERS, NitscheProblem
from ..problem.settling import at_rest, motion
from ..problem.solution import Convergence, FrictionSolution, Outcome, Step
from . import Auto
from .contract import Breakdown, Iterate, Solver, Target
from .first_iterate import as_it_is, first_iterate, no_reactions, own_motion, with_motion
from .judging import BLUR, PATIENCE, Taken, Watch

Array = NDArray[np.float64]
Callback = Callable[[Step, Iterate], bool | None]
CONTENT = 5  # iterates with which a solver is content before its goal is tightened
QUICK = 300  # contacts up to which one iterate is no time to press Ctrl-C
EARLY = 100  # iterates after which a problem that no method is made for is given up
GAVE_UP = (Outcome.STAGNATED, Outcome.BREAKDOWN, Outcome.CYCLED, Outcome.NON_FINITE)
TIGHTEST = 1e-300  # smallest goal: contacts far smaller than others need tiny sums


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
    criterion: Criterion = Criterion.JUDGE,
    patience: int | None = PATIENCE,
) -> FrictionSolution:
    """Run a solver until the judge is content or a limit is met; never raises for a failure.

    tolerance: on the unit-free error of `judge`; contact_tolerance: on the contactwise one, by
    default the square root of the tolerance, infinite to ask for the first alone.  time_limit
    in seconds, those of compiling not counted, or a Deadline.
    Where the exact measure judges, the answer is r with its motion, and the v of iterates is
    not read; `drive_from` reads it.
    callback(step, iterate) is called after every iterate; returning True stops.  criterion:
    what the tolerance is for, the unit-free judge or a published error.  patience: iterates
    without progress after which a solve counts as stagnated; None to let time decide, as in a
    race of methods.  Ctrl-C gives the outcome STOPPED with the best iterate.  Raises
    UnsupportedForm when the solver needs the other form.
    """
    given = _Options(
        tolerance, contact_tolerance, max_iterations, time_limit, callback, criterion, patience
    )
    return _drive(problem, solver, given, start, own_motion)


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

    The start and the iterates are solutions only with the v that they have.  To `drive` it is
    enough that reactions are right, where it can find their motion: no contact force would be
    the end wherever the bodies can move away, also where the solver goes somewhere else.
    """
    given = _Options(tolerance, contact_tolerance, max_iterations, time_limit, callback)
    return _drive(problem, solver, given, start, as_it_is)


class _Options(NamedTuple):
    """What `drive` takes."""

    tolerance: float
    contact_tolerance: float | None
    max_iterations: int | None
    time_limit: TimeLimit
    callback: Callback | None
    criterion: Criterion = Criterion.JUDGE
    patience: int | None = PATIENCE

    def check(self) -> None:
        """Raise InvalidInput for what is no option."""
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
    taken: Taken,
) -> FrictionSolution:
    """The solve; `taken` makes of an iterate what is judged of it."""
    solver = solver if solver is not None else Auto()
    given.check()
    deadline = deadline_of(given.time_limit)
    _check_stop(problem, given.criterion, given.patience)
    _check_solver(problem, solver)
    if not getattr(solver, "matrix_free", False):
        problem = problem.assembled()
    watch = Watch(
        problem, given.tolerance, given.of_contacts, given.criterion, given.patience, taken
    )
    begin, limit = first_iterate(problem, start), given.max_iterations or np.inf
    target = Target(given.tolerance, deadline, given.criterion)
    with Watching(later=problem.contacts <= QUICK) as watching:
        outcome, detail = _run(watching, watch, solver, begin, target, limit, given.callback)
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
    watching: Watching,
    watch: Watch,
    solver: Solver,
    start: Iterate,
    target: Target,
    limit: float,
    callback: Callback | None,
) -> tuple[Outcome, str]:
    """Start the solver, and again with a tighter goal while only contacts are not settled."""
    try:
        _prepare(watch.problem, target.deadline)
        watch.judge(with_motion(watch.problem, start))
        if watch.converged:
            return Outcome.CONVERGED, ""
        ended: tuple[Outcome, str] | None = (Outcome.STAGNATED, "")
        while target.tolerance >= TIGHTEST:
            if watch.weak or ended is None:
                goal = watch.tighter(target.tolerance)
                start, target = watch.best or start, replace(target, tolerance=goal)
                watch.content = 0
            ended = _once(watching, watch, solver, start, target, limit, callback)
            if ended is not None:
                break
        outcome, detail = ended or (Outcome.STAGNATED, "")
    except TimeUp:
        outcome, detail = Outcome.TIME_LIMIT, ""
    except KeyboardInterrupt:
        return Outcome.STOPPED, "by the user"
    if outcome is Outcome.CONVERGED:
        return outcome, detail
    if watch.weak and outcome in GAVE_UP:
        return Outcome.WEAK_CONTACTS, watch.in_words
    return outcome, "; ".join(text for text in (detail, watch.in_words) if text)


def _once(
    watching: Watching,
    watch: Watch,
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
            if not watch.converged:
                watching.begin()
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
            if _content_too_early(watch, iterate, target):
                return None
            if len(watch.history) == EARLY and gains_energy(watch.problem):
                return Outcome.BREAKDOWN, "stopped early"
            if watch.cycled(iterate, step.error):
                return Outcome.CYCLED, ""
            if watch.stagnated:
                return Outcome.STAGNATED, ""
        if watch.content:
            return None
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


def _content_too_early(watch: Watch, iterate: Iterate, target: Target) -> bool:
    """True where a solver is content by the judge's error, but the criterion is another one.

    Some iterates of it may come first: Newton is there with one more, and keeps its history.
    """
    if watch.criterion is Criterion.JUDGE:
        return False
    content = watch.problem.error(iterate.r, iterate.v) <= target.tolerance
    watch.content = watch.content + 1 if content else 0
    return watch.content > CONTENT


def _finish(watch: Watch, outcome: Outcome, detail: str, solver: Solver) -> FrictionSolution:
    problem = watch.problem
    best = watch.best if watch.best is not None else Iterate(no_reactions(problem))
    measure = problem.measure if watch.best is not None else Measure.EXACT
    natural = watch.criterion is Criterion.NATURAL
    told = None if watch.told is None else watch.told[1]
    if watch.told is not None and problem.form is Form.DELASSUS:
        u, v = watch.told[0]
    elif watch.best is None and problem.form is Form.GLOBAL:
        u, v = at_rest(problem)  # stopped in the first factorisation: do not start it again
    else:
        u, v = motion(problem, best.r, best.v if measure is not Measure.EXACT else None)
    error, weakest = watch.error, watch.weakest
    if weakest is None and watch.best is not None and not natural:
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
        Measure.NATURAL if natural else measure,
        detail,
        contact_error=None if weakest is None else weakest.error,
        contact_tolerance=watch.contact_tolerance,
        weakest=None if weakest is None else weakest.contact,
        compiling=compiling() - watch.compiled,
        flops=watch.flops,
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


def _check_stop(
    problem: FrictionProblem | NitscheProblem, criterion: Criterion, patience: int | None
) -> None:
    """Raise InvalidInput for what is no criterion or no number of iterates."""
    if not isinstance(criterion, Criterion):
        words = ", ".join(f"Criterion.{member.name}" for member in Criterion)
        raise InvalidInput(f"criterion: expected one of {words}, got {shown(criterion)}")
    if criterion is not Criterion.JUDGE and not isinstance(problem, FrictionProblem):
        raise UnsupportedForm(
            f"criterion {criterion.value}: |F_nat(r)| / |q| needs a problem in r, with a q"
        )
    whole = isinstance(patience, int) and not isinstance(patience, bool)
    if patience is not None and not (whole and patience >= 1):
        raise InvalidInput(
            f"patience: expected a whole number >= 1, or None, got {shown(patience)}"
        )


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
