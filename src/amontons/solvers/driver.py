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
from ..core.errors import (
    InvalidInput,
    SingularOperator,
    TimeUp,
    UnsupportedForm,
    UnsupportedLaw,
    shown,
)
from ..core.interrupts import Watching
from ..core.words import near
from ..problem.judge.measures import Criterion, Measure
from ..problem.law import Coulomb
from ..problem.protocol import Problem
from ..problem.solution import Convergence, FrictionSolution, Outcome, Step, StoppedBy
from . import Auto
from .changed_law import pressed_start, released, released_callback
from .contract import (
    Breakdown,
    Iterate,
    Solver,
    Target,
    check_goals,
    check_solves,
    sent,
    taken_by,
)
from .first_iterate import as_it_is, first_iterate, own_motion, with_motion
from .judging import BLUR, PATIENCE, Taken, Watch
from .varying_law import varying_law

Array = NDArray[np.float64]
Callback = Callable[[Step, Iterate], bool | None]
CONTENT = 5  # iterates with which a solver is content before its goal is tightened
QUICK = 300  # contacts up to which one iterate is no time to press Ctrl-C
EARLY = 100  # iterates after which a problem that no method is made for is given up
GAVE_UP = (Outcome.STAGNATED, Outcome.BREAKDOWN, Outcome.CYCLED, Outcome.NON_FINITE)
TIGHTEST = 1e-300  # smallest goal: contacts far smaller than others need tiny sums


def drive(
    problem: Problem,
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
    condense: bool = False,
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
    race of methods.  condense: form the Delassus form for a solver that needs it; the answer
    is one of the given problem.  Ctrl-C gives the outcome STOPPED with the best iterate.
    Raises UnsupportedForm when the solver needs another problem or, unless that is condensed,
    another form; UnsupportedLaw when it needs another law.
    """
    given = _Options(
        tolerance, contact_tolerance, max_iterations, time_limit, callback, criterion, patience,
        condense,
    )  # fmt: skip
    return _drive(problem, solver, given, start, own_motion)


def drive_from(
    start: Iterate,
    problem: Problem,
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
    condense: bool = False

    def check(self) -> None:
        """Raise InvalidInput for what is no option."""
        if self.callback is not None and not callable(self.callback):
            raise InvalidInput(f"callback: expected a function, got {self.callback!r}")
        check_goals(self.tolerance, self.contact_tolerance, self.max_iterations)

    @property
    def of_contacts(self) -> float:
        """The contact tolerance that holds."""
        given = self.contact_tolerance
        return self.tolerance**0.5 if given is None else given


def _drive(
    problem: Problem,
    solver: Solver | None,
    given: _Options,
    start: Iterate | FrictionSolution | None,
    taken: Taken,
) -> FrictionSolution:
    """The solve; `taken` makes of an iterate what is judged of it."""
    solver = solver if solver is not None else Auto()
    if isinstance(solver, Auto):
        solver = solver.choice(problem)
    given.check()
    if problem.law.varies:
        _check_solver(solver)
        chosen = solver
        return varying_law(
            problem, given, start,
            lambda fixed, asked, begin: _drive(fixed, chosen, asked, begin, taken),
        )  # fmt: skip
    if problem.plain is not problem:
        asked = given._replace(callback=released_callback(problem, given.callback))
        begin = pressed_start(problem, start)
        return released(problem, _drive(problem.plain, solver, asked, begin, taken))
    deadline = deadline_of(given.time_limit)
    _check_stop(problem, given.criterion, given.patience)
    _check_solver(solver)
    watch = Watch(
        problem, given.tolerance, given.of_contacts, given.criterion, given.patience, taken
    )
    try:
        fit = watch.problem = _fit(problem, solver, deadline if given.condense else None)
    except TimeUp:
        return _finish(watch, problem, Outcome.TIME_LIMIT, "", solver)
    begin, limit = first_iterate(fit, start), given.max_iterations or np.inf
    with Watching(later=fit.contacts <= QUICK) as watching:
        outcome, detail = _run(watching, watch, solver, begin, deadline, limit, given.callback)
    whole = fit if fit.has_v is problem.has_v else problem
    return _finish(watch, whole, outcome, detail, solver)


def _check_solver(solver: Solver) -> None:
    """Raise InvalidInput for what is no solver."""
    if isinstance(solver, type) or not hasattr(solver, "iterates"):
        raise InvalidInput(
            f"solver: expected an instance such as GaussSeidel(), got {_written(solver)}"
        )


def _written(solver: object) -> str:
    """What was given for a solver, and what is to be written for it."""
    if isinstance(solver, type):
        return f"the class; write {solver.__name__}()"
    if isinstance(solver, str):
        from . import METHODS

        meant = near(solver, METHODS)
        return f"{solver!r}" + (f"; write {METHODS[meant].__name__}()" if meant else "")
    return shown(solver)


def _fit(problem: Problem, solver: Solver, deadline: Deadline | None) -> Problem:
    """The problem as the solver takes it; raises UnsupportedForm where it does not."""
    takes = taken_by(solver)
    if not isinstance(problem, takes.solves):
        check_solves(solver, type(problem))
    if takes.needs_cone and not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(
            f"{type(solver).__name__} needs Coulomb's cone, the problem has "
            f"{problem.law.name}; use Auto, SemismoothNewton or GaussSeidel", ("solver",), "",
        )  # fmt: skip
    try:
        return problem.in_form(takes.form, not takes.matrix_free, deadline)
    except UnsupportedForm as reason:
        raise UnsupportedForm(
            f"{type(solver).__name__} {reason.text}", ("solver",), ""
        ) from None


def _run(
    watching: Watching,
    watch: Watch,
    solver: Solver,
    start: Iterate,
    deadline: Deadline,
    limit: float,
    callback: Callback | None,
) -> tuple[Outcome, str]:
    """Start the solver, and again with a tighter goal while only contacts are not settled."""
    try:
        watch.problem.prepare(deadline)
        watch.judge(with_motion(watch.problem, start))
        if watch.converged:
            return Outcome.CONVERGED, ""
        known = start.v is not None or watch.problem.measure is Measure.EXACT
        error = watch.error if known else np.inf
        target = Target(watch.tolerance, deadline, watch.criterion, error)
        ended: tuple[Outcome, str] | None = (Outcome.STAGNATED, "")
        while target.tolerance >= TIGHTEST:
            if watch.weak or ended is None:
                goal = watch.tighter(target.tolerance)
                start = watch.best or start
                target = replace(target, tolerance=goal, start_error=watch.error)
                watch.content = 0
            ended = _once(watching, watch, solver, start, target, limit, callback)
            if ended is not None:
                break
        outcome, detail = ended or (Outcome.STAGNATED, "")
    except TimeUp:
        outcome, detail = Outcome.TIME_LIMIT, ""
    except KeyboardInterrupt:
        return _stopped(watch, StoppedBy.USER)
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
        each = watch.problem.operations if target.deadline.work is not None else 0.0
        iterates, judged = iter(solver.iterates(watch.problem, start, target)), None
        while (iterate := sent(iterates, judged)) is not None:
            target.deadline.spend(iterate.iterations * each)
            step = watch.judge(iterate)
            converged = watch.converged
            if not converged:
                watching.begin()
            stop = callback is not None and callback(step, iterate)
            if converged and iterate.ends != "":
                return Outcome.CONVERGED, iterate.stage or iterate.ends or ""
            if iterate.ends:
                return _stopped(watch, StoppedBy.RULE, f": {iterate.ends}")
            if stop:
                return _stopped(watch, StoppedBy.CALLBACK)
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
            if len(watch.history) == EARLY and watch.problem.gains_energy:
                return Outcome.BREAKDOWN, "stopped early"
            if watch.cycled(iterate, step.error):
                return Outcome.CYCLED, ""
            if watch.stagnated:
                return Outcome.STAGNATED, ""
            judged = watch.judgement(step, target.deadline)
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


def _stopped(watch: Watch, by: StoppedBy, why: str = "") -> tuple[Outcome, str]:
    """The end on request, noted with who asked for it."""
    watch.stopped_by = by
    return Outcome.STOPPED, f"{by.value}{why}"


def _content_too_early(watch: Watch, iterate: Iterate, target: Target) -> bool:
    """True where a solver is content by the judge's error, but the criterion is another one.

    Some iterates of it may come first: Newton is there with one more, and keeps its history.
    """
    if watch.criterion is Criterion.JUDGE:
        return False
    content = watch.problem.error(iterate.r, iterate.v) <= target.tolerance
    watch.content = watch.content + 1 if content else 0
    return watch.content > CONTENT


def _finish(
    watch: Watch, whole: Problem, outcome: Outcome, detail: str, solver: Solver
) -> FrictionSolution:
    """The record and the best state; whole: the problem that was given, perhaps condensed."""
    problem, told, best = watch.problem, watch.told, watch.best
    measure = problem.measure if best is not None else Measure.EXACT
    natural = watch.criterion is Criterion.NATURAL
    if told is not None and told.motion is not None and whole is problem and not problem.has_v:
        of, r, (u, v) = whole, told.r, told.motion
    elif best is None:  # stopped in the first factorisation: do not start it again
        r = whole.start()[0]
        of, u, v = whole.recover(r, np.zeros(whole.unknowns) if whole.has_v else None)
    else:
        r = best.r
        given = best.v if measure is not Measure.EXACT and problem.has_v else None
        of, u, v = whole.recover(r, given)
    error, weakest = watch.error, watch.weakest
    if weakest is None and best is not None and not natural:
        weakest = problem.weakest(best.r, best.v)
        if weakest is not None and weakest.hidden > BLUR * error:
            error = max(error, problem.certain_error(best.r, best.v))
    found = None
    if outcome not in (Outcome.CONVERGED, Outcome.STOPPED) and best is not None:
        found, text = problem.obstruction(u)
        detail = "; ".join(part for part in (detail, text) if part)
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
        stopped_by=watch.stopped_by,
        obstruction=found,
    )
    settled = None if told is None else told.settled
    return FrictionSolution(of, r, u, v, record, settled=settled)


def _check_stop(
    problem: Problem, criterion: Criterion, patience: int | None
) -> None:
    """Raise InvalidInput for what is no criterion or no number of iterates."""
    if not isinstance(criterion, Criterion):
        words = ", ".join(f"Criterion.{member.name}" for member in Criterion)
        raise InvalidInput(f"criterion: expected one of {words}, got {shown(criterion)}")
    if criterion is not Criterion.JUDGE and not problem.has_q:
        raise UnsupportedForm(
            f"criterion {criterion.value}: |F_nat(r)| / |q| needs a problem in r, with a q"
        )
    whole = isinstance(patience, int) and not isinstance(patience, bool)
    if patience is not None and not (whole and patience >= 1):
        raise InvalidInput(
            f"patience: expected a whole number >= 1, or None, got {shown(patience)}"
        )
