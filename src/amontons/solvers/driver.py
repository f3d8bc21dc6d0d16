"""The driver: it checks what it is asked for, and brings problem and solver together.

`judging` has what follows: the loop over the iterates, and the record of it.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.clock import TimeLimit, deadline_of
from ..core.errors import InvalidInput, TimeUp, UnsupportedForm, shown
from ..core.interrupts import Watching
from ..problem.judge.measures import Criterion
from ..problem.protocol import Problem
from ..problem.solution import FrictionSolution, Outcome
from . import Auto
from .changed_law import changed_law
from .contract import Iterate, Solver, check_goals, check_solver, fitted
from .first_iterate import as_it_is, first_iterate, own_motion
from .judging import PATIENCE, Callback, Taken, Watch, finished, run
from .varying_friction import varying_friction

Array = NDArray[np.float64]
QUICK = 300  # contacts up to which one iterate is no time to press Ctrl-C


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
    return _drive(problem, given, start, solver, own_motion)


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
    return _drive(problem, given, start, solver, as_it_is)


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
    given: _Options,
    start: Iterate | FrictionSolution | None,
    solver: Solver | None,
    taken: Taken,
) -> FrictionSolution:
    """The solve; `taken` makes of an iterate what is judged of it."""
    solver = solver if solver is not None else Auto()
    if isinstance(solver, Auto):
        solver = solver.choice(problem)
    given.check()
    check_solver(solver)
    if problem.law.varies or problem.plain is not problem:
        solved = varying_friction if problem.law.varies else changed_law
        return solved(problem, given, start, partial(_drive, solver=solver, taken=taken))
    deadline = deadline_of(given.time_limit)
    _check_stop(problem, given.criterion, given.patience)
    watch = Watch(
        problem, type(solver).__name__, given.tolerance, given.of_contacts, given.criterion,
        given.patience, taken,
    )  # fmt: skip
    try:
        fit = watch.problem = fitted(problem, solver, deadline if given.condense else None)
    except TimeUp:
        return finished(watch, problem, Outcome.TIME_LIMIT)
    begin, limit = first_iterate(fit, start), given.max_iterations or np.inf
    with Watching(later=fit.contacts <= QUICK) as watching:
        outcome, detail = run(watching, watch, solver, begin, deadline, limit, given.callback)
    whole = fit if fit.has_v is problem.has_v else problem
    return finished(watch, whole, outcome, detail)


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
