"""The driver: it checks what it is asked for, and brings problem and solver together.

`judging` has what follows: the loop over the iterates, and the record of it.
"""

from __future__ import annotations

from functools import partial

from ..core.clock import TimeLimit
from ..core.errors import TimeUp
from ..core.interrupts import Watching
from ..problem.judge.measures import Criterion
from ..problem.protocol import Problem
from ..problem.solution import FrictionSolution, Outcome
from . import Auto
from .asked import PATIENCE, Asked, Callback
from .at_once import at_once
from .auto.hybrid import Continued
from .changed_law import changed_law
from .contract import Iterate, Solver, check_solver, fitted
from .first_iterate import as_it_is, first_iterate, own_motion
from .judging import Taken, Watch, finished, run
from .varying_law import varying_law

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
    asked = Asked(
        tolerance, contact_tolerance, max_iterations, time_limit, callback, criterion, patience,
        condense,
    )  # fmt: skip
    return drive_as_asked(problem, asked, start, solver)


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
    asked = Asked(tolerance, contact_tolerance, max_iterations, time_limit, callback)
    return drive_as_asked(problem, asked, start, solver, as_it_is)


def drive_as_asked(
    problem: Problem,
    asked: Asked,
    start: Iterate | FrictionSolution | None = None,
    solver: Solver | None = None,
    taken: Taken = own_motion,
) -> FrictionSolution:
    """The solve that `drive` makes; `taken` makes of an iterate what is judged of it."""
    solver = solver if solver is not None else Auto()
    begun = None
    if isinstance(solver, Auto):
        found = at_once(problem, asked, start) if taken is own_motion else None
        if isinstance(found, FrictionSolution):
            return found
        solver, begun = solver.choice(problem), found
    check_solver(solver)
    if problem.law.varies or problem.plain is not problem:
        solved = varying_law if problem.law.varies else changed_law
        again = partial(drive_as_asked, solver=solver, taken=taken)
        return solved(problem, asked, start, again)
    asked.check_fits(problem)
    watch = Watch(problem, asked, type(solver).__name__, taken)
    solver = solver if begun is None else Continued(begun)
    condensed_by = asked.deadline if asked.condense else None
    try:
        fit = watch.problem = fitted(problem, solver, condensed_by)
    except TimeUp:
        return finished(watch, problem, Outcome.TIME_LIMIT)
    begin = first_iterate(fit, start)
    with Watching(later=fit.contacts <= QUICK) as watching:
        outcome, detail = run(watching, watch, solver, begin)
    whole = fit if fit.has_v is problem.has_v else problem
    return finished(watch, whole, outcome, detail)
