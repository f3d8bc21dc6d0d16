"""The verb `solve`: it takes a model or a discrete problem and calls the layers below."""

from __future__ import annotations

import logging
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any, overload

from ..core.clock import TimeLimit, compiling, now
from ..core.errors import Interrupted, InvalidInput, NotConverged, clipped
from ..core.words import helpful
from ..problem.friction import FrictionProblem
from ..problem.judge.measures import Criterion
from ..problem.protocol import Problem
from ..problem.solution import FrictionSolution, Outcome
from ..solvers.asked import PATIENCE, Asked, Callback
from ..solvers.contract import Iterate, Solver
from ..solvers.driver import drive_as_asked
from .model_solution import ModelSolution
from .progress import progress

if TYPE_CHECKING:
    from ..mechanics.model import Model

LOGGER = logging.getLogger("amontons")
LOGGER.addHandler(logging.NullHandler())  # silent until somebody listens
Start = Iterate | FrictionSolution | ModelSolution | None


@overload
def solve(
    problem: Problem, solver: Solver | None = None, *, tolerance: float = 1e-8,
    contact_tolerance: float | None = None, max_iterations: int | None = None,
    time_limit: TimeLimit = None, start: Start = None, callback: Callback | None = None,
    check: bool = True, criterion: Criterion = Criterion.JUDGE,
    patience: int | None = PATIENCE,
) -> FrictionSolution: ...  # fmt: skip
@overload
def solve(
    problem: Model, solver: Solver | None = None, *, tolerance: float = 1e-8,
    contact_tolerance: float | None = None, max_iterations: int | None = None,
    time_limit: TimeLimit = None, start: Start = None, callback: Callback | None = None,
    check: bool = True, criterion: Criterion = Criterion.JUDGE,
    patience: int | None = PATIENCE,
) -> ModelSolution: ...  # fmt: skip
@helpful
def solve(
    problem: Any, solver: Any = None, *, tolerance: float = 1e-8, contact_tolerance: Any = None,
    max_iterations: Any = None, time_limit: Any = None, start: Any = None,
    callback: Any = None, check: bool = True, criterion: Criterion = Criterion.JUDGE,
    patience: Any = PATIENCE,
) -> Any:  # fmt: skip
    """Solve a model or a discrete problem until the independent error is below `tolerance`.

    contact_tolerance: on the error of every single contact on its own scale (`judge`), by
    default the square root of tolerance.  solver: by default the portfolio `Auto`.  time_limit:
    seconds, those of compiling not counted.  start: a solution of a neighbouring problem.
    callback(step, iterate) is called after every iterate, True stops; it replaces the progress
    line that a terminal shows.  check: raise NotConverged (Interrupted after Ctrl-C), which
    carries the best solution, instead of returning it.  criterion: what the tolerance is for;
    Criterion.NATURAL stops by a published error, to compare with papers.  patience: iterates
    without progress after which a solve counts as stagnated; None to let time decide.

    A model is condensed for solvers that need the Delassus form; a FrictionProblem has the form
    its owner chose, and the wrong one raises UnsupportedForm.  A model in large deformations is
    solved by `NonlinearNewton`; the problem of its solution is the tangent one of the deformed
    state.  A problem of your own is one that answers `Problem`.
    """
    asked = Asked(
        tolerance, contact_tolerance, max_iterations, time_limit, callback, criterion, patience,
        condense=not is_discrete(problem),
    )  # fmt: skip
    result = solve_as_asked(problem, asked, start, solver)
    if check:
        raise_unless_converged(result)
    return result


def solve_any_form(
    problem: FrictionProblem | Model, solver: Solver | None = None, *, start: Start = None,
    **options: Any,
) -> FrictionSolution | ModelSolution:  # fmt: skip
    """Solve like `solve` with check=False, condensing a FrictionProblem too where need be."""
    return solve_as_asked(problem, Asked(**options, condense=True), start, solver)


def solve_as_asked(
    problem: Any, asked: Asked, start: Start = None, solver: Solver | None = None
) -> Any:
    """Assemble, drive, recover: what `solve` does, without a look at whether it converged."""
    model: Any = None if is_discrete(problem) else checked(problem)
    began, compiled = now(), compiling()
    discrete: Any = problem if model is None else model.discrete_problem()
    assembled, compiled = now() - began, compiling() - compiled
    begin = start.solution if isinstance(start, ModelSolution) else start
    with progress(asked.callback, asked.tolerance) as seen:
        if seen is not asked.callback:
            asked = replace(asked, callback=seen)
        found = drive_as_asked(discrete, asked, begin, solver)
    if model is None:
        return _logged(found)
    record = found.convergence
    record = replace(record, compiling=record.compiling + compiled)
    found = _explained(replace(found, convergence=record), model)
    return _logged(ModelSolution(model, found, model.recover(found), assembled))


def _logged(result: Any) -> Any:
    """The result, told to the logger `amontons` with its doubts where level INFO is on."""
    if LOGGER.isEnabledFor(logging.INFO):  # else nobody asks for what takes time to tell
        found = getattr(result, "solution", result)
        LOGGER.info("%s; %s", found.headline, found.convergence)
        for doubt in result.warnings:
            LOGGER.warning("%s [%s]", doubt.message, doubt.name)
    return result


def is_discrete(problem: object) -> bool:
    """True for a discrete problem, also for one of the user's own (`Problem`)."""
    return isinstance(problem, Problem)


def checked(problem: Any, name: str = "problem") -> FrictionProblem | Model:
    """The same; raises InvalidInput for what is neither a model nor a FrictionProblem."""
    if not isinstance(problem, type) and (
        isinstance(problem, FrictionProblem) or hasattr(problem, "assemble")
    ):
        return problem
    hint = ""
    if isinstance(problem, str | os.PathLike):
        hint = f"; write read_case({os.fspath(problem)!r}).model"
    elif hasattr(problem, "mesh") or hasattr(problem, "cells"):
        hint = "; a Model has bodies, supports and contacts"
    raise InvalidInput(
        f"{name}: expected a Model or a FrictionProblem, got "
        f"{clipped(repr(problem), 120)}{hint}"
    )


def _explained(found: FrictionSolution, model: Model) -> FrictionSolution:
    """The same record; one that failed says which bodies give way."""
    from ..mechanics.model.diagnosis import with_diagnosis

    return with_diagnosis(found, model)


def raise_unless_converged(result: FrictionSolution | ModelSolution) -> None:
    """Raise NotConverged, or Interrupted after Ctrl-C, carrying the result."""
    record = result.convergence
    if record.outcome is Outcome.CONVERGED:
        return
    message = f"{record}. {record.advice}"
    raise (Interrupted if record.by_user else NotConverged)(message, result)
