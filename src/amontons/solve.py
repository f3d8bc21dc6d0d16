"""The driver: it alone judges, stops, records, and turns the best iterate into a solution.

An iterate has converged when its error is below the tolerance and so is, on its own scale, that
of its weakest contact (`judge`).  Where only the first holds, the solver is started again from
there with a tolerance that promises the second; where that does not come about, the outcome is
WEAK_CONTACTS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checked_arrays import real
from .clock import Deadline, TimeLimit, compiling, deadline_of, now
from .errors import InvalidInput, SingularOperator, TimeUp, UnsupportedForm, shown
from .indefinite import gains_energy, with_obstruction
from .interrupts import Watching
from .judge import Criterion, Measure
from .judging import BLUR, PATIENCE, Watch
from .nitsche_problem import NO_MULTIPLIERS, NitscheProblem
from .problem import Form, FrictionProblem
from .settling import at_rest, motion
from .solution import Convergence, FrictionSolution, Outcome, Step
from .solvers import Auto
from .solvers.base import Breakdown, Iterate, Solver, Target

Array = NDArray[np.float64]
Callback = Callable[[Step, Iterate], bool | None]
EARLY = 100  # iterates after which a problem that no method is made for is given up
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
    callback(step, iterate) is called after every iterate; returning True stops.  criterion:
    what the tolerance is for, the unit-free judge or a published error.  patience: iterates
    without progress after which a solve counts as stagnated; None to let time decide, as in a
    race of methods.  Ctrl-C gives the outcome STOPPED with the best iterate.  Raises
    UnsupportedForm when the solver needs the other form.
    """
    solver = solver if solver is not None else Auto()
    if isinstance(solver, type) or not hasattr(solver, "iterates"):
        raise InvalidInput(
            f"solver: expected an instance such as GaussSeidel(), got {solver!r}"
        )
    if callback is not None and not callable(callback):
        raise InvalidInput(f"callback: expected a function, got {callback!r}")
    _check_options(tolerance, contact_tolerance, max_iterations)
    _check_stop(problem, criterion, patience)
    deadline = deadline_of(time_limit)
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
    if not getattr(solver, "matrix_free", False):
        problem = problem.assembled()
    allowed = tolerance**0.5 if contact_tolerance is None else contact_tolerance
    watch = Watch(problem, tolerance, allowed, criterion, patience)
    begin, limit = _start(problem, start), max_iterations or np.inf
    with Watching():
        outcome, detail = _run(
            watch, solver, begin, Target(tolerance, deadline, criterion), limit, callback
        )
    return _finish(watch, outcome, detail, solver)


def _run(
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
        watch.judge(_with_motion(watch.problem, start))
        if watch.converged:
            return Outcome.CONVERGED, ""
        ended: tuple[Outcome, str] | None = (Outcome.STAGNATED, "")
        while target.tolerance >= TIGHTEST:
            if watch.weak or ended is None:
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
    gave_up = outcome in (Outcome.STAGNATED, Outcome.BREAKDOWN, Outcome.CYCLED)
    if watch.weak and gave_up:
        return Outcome.WEAK_CONTACTS, watch.in_words
    return outcome, "; ".join(text for text in (detail, watch.in_words) if text)


def _once(
    watch: Watch,
    solver: Solver,
    start: Iterate,
    target: Target,
    limit: float,
    callback: Callback | None,
) -> tuple[Outcome, str] | None:
    """The loop over the iterates of one start.

    Returns why it ended; None when the error is below the target, but not that of contacts.
    """
    try:
        each = _operations(watch.problem) if target.deadline.work is not None else 0.0
        for iterate in solver.iterates(watch.problem, start, target):
            target.deadline.spend(iterate.iterations * each)
            step = watch.judge(iterate)
            stop = callback is not None and callback(step, iterate)
            if watch.converged:
                return Outcome.CONVERGED, iterate.stage
            if stop:
                return Outcome.STOPPED, "by the callback"
            if not np.isfinite(step.error):
                return Outcome.NON_FINITE, ""
            if watch.iterations >= limit:
                return Outcome.MAX_ITERATIONS, ""
            if target.deadline.passed:
                return Outcome.TIME_LIMIT, ""
            if watch.weak and step.error <= target.tolerance:
                return None
            if _content_too_early(watch, iterate, target):
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


def _content_too_early(watch: Watch, iterate: Iterate, target: Target) -> bool:
    """True where a solver is content by the judge's error, but the criterion is another one."""
    if watch.criterion is Criterion.JUDGE:
        return False
    return watch.problem.error(iterate.r, iterate.v) <= target.tolerance


def _finish(watch: Watch, outcome: Outcome, detail: str, solver: Solver) -> FrictionSolution:
    problem = watch.problem
    best = watch.best if watch.best is not None else Iterate(_zero(problem))
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


def _zero(problem: FrictionProblem) -> Array:
    return np.zeros((problem.contacts, problem.dimension))


def _start(
    problem: FrictionProblem | NitscheProblem, start: Iterate | FrictionSolution | None
) -> Iterate:
    """The first iterate: zero reactions, or a copy of what the user gives."""
    if start is None:
        if isinstance(problem, NitscheProblem):
            return _start_of_nitsche(problem, None)
        return Iterate(_zero(problem), None, 0)
    if not hasattr(start, "r") or not hasattr(start, "v"):
        raise InvalidInput(
            f"start: expected a solution or an Iterate, got {type(start).__name__}"
        )
    if isinstance(problem, NitscheProblem):
        return _start_of_nitsche(problem, start.v)
    r = real("start: r", start.r)
    if r.shape != (problem.contacts, problem.dimension):
        raise InvalidInput(
            f"start: expected r of shape {(problem.contacts, problem.dimension)}, got {r.shape}"
        )
    if not np.isfinite(r).all():
        raise InvalidInput("start: r holds a number that is not finite")
    if start.v is None or problem.form is not Form.GLOBAL:
        return Iterate(r, None, 0)
    return Iterate(r, _motion(start.v, problem.unknowns), 0)


def _start_of_nitsche(problem: NitscheProblem, v: Array | None) -> Iterate:
    """The displacements v (n,) of a start; its reactions may be those of another method."""
    v = problem.guess if v is None else _motion(v, problem.unknowns)
    return Iterate(problem.reaction(v), v, 0)


def _motion(v: ArrayLike, n: int) -> Array:
    """A copy of v, (n,), of a start."""
    v = real("start: v", v)
    if v.shape != (n,):
        raise InvalidInput(f"start: expected v of {n} entries, got {v.size}")
    if not np.isfinite(v).all():
        raise InvalidInput("start: v holds a number that is not finite")
    return v


def _with_motion(problem: FrictionProblem, start: Iterate) -> Iterate:
    """The start with some v where finding that of its r would cost a linear solve."""
    if start.v is not None or problem.measure is Measure.EXACT:
        return start
    guess = problem.guess
    return replace(start, v=guess if guess is not None else np.zeros(problem.unknowns))


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
