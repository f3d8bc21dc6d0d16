"""The verbs: they take a model or a discrete problem and call the layers below."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, overload

from ..core.clock import TimeLimit, compiling, deadline_of, now
from ..core.errors import Interrupted, InvalidInput, NotConverged, TimeUp, UnsupportedForm
from ..problem.friction import Form, FrictionProblem
from ..problem.judge.measures import Criterion
from ..problem.law.cones import Coulomb, Tresca
from ..problem.solution import FrictionSolution, Outcome, Step
from ..solvers.contract import Iterate, Solver
from ..solvers.driver import Callback, drive
from ..solvers.judging import PATIENCE
from .model_solution import ModelSolution

if TYPE_CHECKING:
    from ..analysis.basins.study import Basins
    from ..analysis.certificates.critical_friction import CriticalFriction
    from ..analysis.certificates.older_criteria import CriterionFriction
    from ..analysis.certificates.opening import Opening
    from ..analysis.certificates.uniqueness import Uniqueness
    from ..analysis.paths.continuation import Continuation
    from ..analysis.paths.diagram import Diagram
    from ..analysis.paths.path import Branch, PathProblem
    from ..analysis.paths.tangents import FirstOrder, Tangent
    from ..analysis.solutions.enumerate import Solutions
    from ..mechanics.model import Model

FEW = 10  # starts of Newton's method where a search ends without any solution
LEAST = 1.0  # seconds for them beyond a time limit
SEARCH, WORK = 0.5, 60.0  # share of a limit, or seconds of work, for the search in `basins`
HUGE = 1e12  # friction above which rounding hides what the law says
Start = Iterate | FrictionSolution | ModelSolution | None


@overload
def solve(
    problem: FrictionProblem, solver: Solver | None = None, *, tolerance: float = 1e-8,
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
def solve(problem, solver=None, *, tolerance=1e-8, contact_tolerance=None, max_iterations=None,
          time_limit=None, start=None, callback=None, check=True,
          criterion=Criterion.JUDGE, patience=PATIENCE):  # fmt: skip
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
    its owner chose, and the wrong one raises UnsupportedForm.  A model in large deformations
    (`Model.is_large`) is solved by `NonlinearNewton`; the problem of its solution is the
    tangent one of the deformed state.
    """
    run = drive if isinstance(problem, FrictionProblem) else drive_any_form
    options = {"tolerance": tolerance, "contact_tolerance": contact_tolerance,
               "max_iterations": max_iterations, "time_limit": time_limit,
               "start": start, "criterion": criterion, "patience": patience}  # fmt: skip
    result = _solve(problem, solver, run, callback, options)
    if check:
        raise_unless_converged(result)
    return result


def all_solutions(
    problem: FrictionProblem | Model, *, time_limit: TimeLimit = None,
    keep_proof: bool = False,
) -> Solutions:  # fmt: skip
    """All solutions of a Coulomb problem, and whether there can be no other.

    time_limit: seconds, after which the list may lack some; in 3D by default the work of about
    60 s, counted in operations, so that a busy machine finds the same.  keep_proof: keep what
    excludes all others, in `Solutions.proof`.  In 2D the search takes milliseconds for ten
    contacts and grows exponentially: some ten contacts with much friction, some fifty with
    little; more than 200 are left to `multistart`, which proves nothing.  In 3D some contacts
    with much friction, some tens with little.  Raises UnsupportedForm under Tresca's law.
    """
    limit = _begun(time_limit)
    discrete = _discrete(problem)
    from ..analysis.solutions import enumerate as exact

    _searchable(discrete)
    _check_has_W(problem, "all solutions", limit)
    if discrete.dimension == 3:
        from ..analysis.solutions.discs.search import enumerate_discs

        return enumerate_discs(discrete, time_limit=limit, keep_proof=keep_proof)
    if discrete.dimension == 2 and discrete.contacts > exact.CONTACTS:
        found = multistart(discrete, time_limit=limit)
        reason = f"more than {exact.CONTACTS} contacts: {found.reason}"
        return replace(found, reason=reason)
    found = exact.enumerate_solutions(discrete, time_limit=limit, keep_proof=keep_proof)
    if found.complete or found.solutions:
        return found
    some = multistart(discrete, starts=FEW, time_limit=None if limit is None else LEAST)
    # the search did not come to any
    return replace(found, solutions=some.solutions, resolution=some.resolution)


def multistart(
    problem: FrictionProblem | Model, *, starts: int = 1000, seed: int = 0,
    time_limit: TimeLimit = None,
) -> Solutions:  # fmt: skip
    """Solutions of a Coulomb problem, 2D or 3D, by Newton's method from many starts; no proof.

    starts: their number; seed: of their random choice; time_limit: seconds.  Finds in seconds
    what there is up to some hundred contacts, as far as it can be checked.  Raises
    UnsupportedForm under Tresca's law.
    """
    from ..analysis.solutions.multistart import multistart as search

    limit = _begun(time_limit)
    discrete = _discrete(problem)
    _check_has_W(problem, "multistart", limit)
    return search(discrete, starts=starts, seed=seed, time_limit=limit)


def basins(
    problem: FrictionProblem | Model, methods: Any = ("auto",), parameters: Any = None,
    starts: Any = None, *, solutions: Any = None, draws: int = 10, seed: int = 0,
    tolerance: float = 1e-8, within: float = 1e-4, max_iterations: int | None = None,
    run_limit: float | None = None, reaction_size: float | None = None,
    displacement_size: float | None = None, time_limit: TimeLimit = None,
    callback: Callable[[int, int], None] | None = None,
) -> Basins:  # fmt: skip
    """Which solution each method finds, with each value of its parameters, from each start.

    methods: names such as "uzawa", solvers, or `BasinMethod`s; a mapping gives them names.
    Of a model also "nitsche": its contact by Nitsche's method, with the fields of `Nitsche`.
    parameters: values by field, {"rho": [1, 10]} or {"uzawa.rho": …}; all combinations are run.
    starts: names of `analysis.basin_starts` ("cone", "cone:20", …) or a mapping, also of other
    names to an Iterate or several; draws: random starts of each kind; reaction_size,
    displacement_size: how large, by default as in the solutions.  solutions: those that runs
    are told by, {"free": …} with anything that has r, or what `all_solutions` gave; by default
    they are searched for, with up to half the time_limit, and without proof those that runs
    find are added.  within: how near they are told by, in energy norm, relative to the largest.
    run_limit: seconds of one run, more is a failure; time_limit: seconds of everything, runs
    that do not fit are left out and said to be missing.  A run counts as a solution only when
    the judge agrees to `tolerance`, the balance of its r and v included.  callback(done, all)
    is called after each run.
    """
    from ..analysis.basins.nitsche import by_nitsche
    from ..analysis.basins.solutions import Atlas, given_solutions
    from ..analysis.basins.study import StudyOptions, check_callback, study

    options = StudyOptions(draws, seed, tolerance, within, max_iterations, run_limit,
                           reaction_size, displacement_size)  # fmt: skip
    check_callback(callback)
    deadline = deadline_of(time_limit)
    discrete = _discrete(problem)
    _check_has_W(problem, "basins", _begun(time_limit))
    atlas = Atlas(discrete, within)
    if solutions is not None:
        given_solutions(atlas, solutions)
    elif isinstance(discrete.law, Tresca):
        atlas.reason = "given bounds of friction (Tresca): nobody has searched for all"
    else:
        limit = deadline.share(SEARCH) if time_limit is not None else deadline_of(None, WORK)
        given_solutions(atlas, all_solutions(discrete, time_limit=limit))
    makers = {} if isinstance(problem, FrictionProblem) else {"nitsche": by_nitsche(problem)}
    return study(atlas, methods, parameters, starts, options, deadline, callback, makers)


def _begun(time_limit: TimeLimit) -> TimeLimit:
    """The limit as a deadline from now on, so that assembling counts too; None without one."""
    return None if time_limit is None else deadline_of(time_limit)


def _searchable(problem: FrictionProblem) -> None:
    """Raise UnsupportedForm where there is no mu to search with."""
    if isinstance(problem.law, Tresca):
        raise UnsupportedForm(
            "all solutions: expected Coulomb friction; with given bounds (Tresca) there is one "
            "motion, see uniqueness"
        )


def _discrete(problem: FrictionProblem | Model) -> FrictionProblem:
    """The problem, or that of a model; raises InvalidInput for friction without limits."""
    problem = _checked(problem)
    discrete = problem if isinstance(problem, FrictionProblem) else problem.assemble()
    largest = float(discrete.law.coefficient.max(initial=0.0))
    if isinstance(discrete.law, Coulomb) and largest > HUGE:
        raise InvalidInput(
            f"mu: expected friction of at most {HUGE:g} to ask for all solutions, got "
            f"{largest:g}; contacts that can not slip are bonded, hold them by supports"
        )
    return discrete


def follow(
    problem: FrictionProblem | Model | PathProblem, parameter: str = "load",
    interval: tuple[float, float] = (0.0, 1.0), *, base: FrictionProblem | Model | None = None,
    start: object = None, at: float | None = None, options: Continuation | None = None,
    along: Tangent | None = None, **limits: Any,
) -> Branch:  # fmt: skip
    """The solution curve over a parameter, both ways from a start, with its folds and events.

    parameter: "load" or "friction", see `path_of`; a PathProblem has its own.  base, for
    "load": the problem at 0, `problem` being that at 1.  start: a point or an event of a
    branch, or a solution at the parameter `at`, by default the lower end of the interval;
    without one the curve begins at a solution found there.  2D problems with Coulomb friction
    under a load are tracked exactly, from event to event; others are continued step by step,
    with `options`, which also asks for that.
    along: one of the tangents of `first_order` at the start, to go that way only.
    limits: max_points (per direction), time_limit (seconds for all), callback(point, event),
    which stops by returning True.
    Each end of the branch has a named reason.
    """
    from ..analysis.paths import asked, checks
    from ..analysis.paths.following import Limits, follow_path

    checks.check_options(options)
    bounds = Limits(checks.checked_interval(interval), **checks.checked_limits(limits))
    _check_followed(problem, "follow", bounds.deadline)
    path, y, p = asked.on_path(problem, parameter, bounds, _base(base), start, at)
    if along is None:
        return follow_path(path, y, p, bounds, options=options)
    return asked.followed_along(path, y, p, bounds, options, along)


def first_order(
    problem: FrictionProblem | Model | PathProblem, parameter: str = "load",
    interval: tuple[float, float] = (0.0, 1.0), *, base: FrictionProblem | Model | None = None,
    start: object = None, at: float | None = None, tolerance: float = 1e-9,
) -> FirstOrder:  # fmt: skip
    """All one-sided tangents of the solution curves through a solution, as in `follow`.

    They solve the first-order system; directions that lie on a border of their piece are kept
    where a curve leaves along them.  tolerance: distance to a border that counts as none, in
    the unknowns of the path.
    """
    from ..analysis.paths import asked, checks
    from ..analysis.paths.following import Limits

    bounds = Limits(checks.checked_interval(interval))
    _check_followed(problem, "first_order", bounds.deadline)
    path, y, p = asked.on_path(problem, parameter, bounds, _base(base), start, at)
    return asked.tangents_at(path, y, p, tolerance)


def _check_followed(problem: Any, verb: str, limit: TimeLimit) -> None:
    """Raise where a problem is no PathProblem, and has no load and friction to follow."""
    from ..analysis.paths.path import PathProblem

    if not isinstance(problem, PathProblem):
        _check_has_W(_checked(problem), verb, limit)


def diagram(
    problem: FrictionProblem | Model, parameter: str = "load",
    interval: tuple[float, float] = (0.0, 1.0), *, base: FrictionProblem | Model | None = None,
    at: Sequence[float] | None = None, options: Continuation | None = None, **limits: Any,
) -> Diagram:  # fmt: skip
    """All branches through all solutions at the values `at` of a parameter, in 2D.

    at: by default both ends and the middle of the interval; all solutions there are searched
    for as in `all_solutions`, with their share of the time each.  Others as in `follow`.
    """
    from ..analysis.paths import checks
    from ..analysis.paths.diagram import bifurcation_diagram
    from ..analysis.paths.following import Limits
    from ..analysis.paths.parametrised import path_of

    checks.check_options(options)
    bounds = Limits(checks.checked_interval(interval), **checks.checked_limits(limits))
    a, b = bounds.interval
    values = (a, (a + b) / 2, b) if at is None else checks.checked_values(at, bounds.interval)
    _check_has_W(_checked(problem), "diagram", bounds.deadline)
    path = path_of(problem, parameter, bounds.interval, _base(base))
    return bifurcation_diagram(path, bounds, values, options=options)


def _check_has_W(problem: FrictionProblem | Model, verb: str, limit: TimeLimit) -> None:
    """Raise SingularOperator where `verb` needs W and contact alone holds a body."""
    if not getattr(problem, "is_large", False):  # those are followed in displacements
        from ..mechanics.model.diagnosis import check_has_W
        from ..mechanics.steps.timed import steady

        examined = problem if isinstance(problem, FrictionProblem) else steady(problem)
        with suppress(TimeUp):  # the verb says so
            check_has_W(examined, verb, deadline_of(limit))


def _base(base: Any) -> FrictionProblem | Model | None:
    return None if base is None else _checked(base, "base")


def _checked(problem: Any, name: str = "problem") -> FrictionProblem | Model:
    if not isinstance(problem, type) and (
        isinstance(problem, FrictionProblem) or hasattr(problem, "assemble")
    ):
        return problem
    raise InvalidInput(f"{name}: expected a Model or a FrictionProblem, got {problem!r}")


def uniqueness(
    problem: FrictionProblem | Model, solution: FrictionSolution | ModelSolution | None = None,
    *, time_limit: TimeLimit = None,
) -> Uniqueness:  # fmt: skip
    """Whether a problem has one solution: for every load, for this load, or more than one.

    solution: one that was found; by default the problem is solved.  time_limit: seconds, half
    of them at most for the bounds on the critical friction; by default the work of about 60 s,
    counted in operations, so that a busy machine comes to the same verdict.  The verdict is
    undecided, with the reason, where there is neither a proof nor a second solution.
    """
    limit = _begun(time_limit)
    discrete = _discrete(problem)
    found = solution.solution if isinstance(solution, ModelSolution) else solution
    from ..analysis.certificates.uniqueness import assess

    verdict = assess(discrete, found, time_limit=limit)
    if isinstance(problem, FrictionProblem) or not problem.held_by_contact:
        return verdict
    reason = verdict.reason.replace("holds a body", f"holds {problem.held_by_contact}")
    balance = problem.imbalance()
    if "there is no solution" in balance:
        reason += f" {balance[0].upper()}{balance[1:]}."
    return replace(verdict, reason=reason)


def existence(
    problem: FrictionProblem | Model, *, time_limit: TimeLimit = None
) -> Opening:
    """Whether a problem has a solution for every load: a motion that opens all contacts.

    Else reactions that hold each other, on which it depends; or undecided, with the reason.
    time_limit: seconds, by default the work of about 20 s, counted in operations.
    """
    from ..analysis.certificates.opening import opening

    return opening(_discrete(problem), time_limit=_begun(time_limit))


def critical_friction(
    problem: FrictionProblem | Model, *, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriticalFriction:
    """Bounds on the friction below which every load of a 2D problem has exactly one solution.

    gap: relative distance of the bounds that is good enough.  time_limit: seconds, by default
    the work of about 60 s, counted in operations.  Exact up to
    13 contacts.  Raises UnsupportedForm in 3D and under Tresca's law.
    """
    from ..analysis.certificates.critical_friction import critical_friction as bounds

    limit = _begun(time_limit)
    discrete = _discrete(problem)
    if discrete.dimension == 2 and isinstance(discrete.law, Coulomb):  # else it says so
        _check_has_W(problem, "critical friction", limit)
    return bounds(discrete, gap=gap, time_limit=limit)


def p_matrix_friction(
    problem: FrictionProblem | Model, *, given_tangents: bool = False, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriterionFriction:  # fmt: skip
    """The friction up to which the P-matrix criterion holds, in 2D and 3D, for few contacts.

    Below its `lower` every load has at most one solution.  given_tangents: as printed, with the
    tangents of the problem and a square in the place of the friction disc in 3D; that depends
    on the tangents and is not safe.  gap: relative distance of the bounds that is good enough
    in 3D.  time_limit: seconds, by default the work of about 60 s, counted in operations.
    Raises UnsupportedForm for more than 10 contacts in 2D, 4 in 3D, and under Tresca's law.
    """
    from ..analysis.certificates.older_criteria import p_matrix_friction as ask

    limit = _begun(time_limit)
    discrete = _with_W(problem, "the P-matrix criterion", limit)
    return ask(discrete, given_tangents=given_tangents, gap=gap, time_limit=limit)


def full_contact_friction(
    problem: FrictionProblem | Model, *, sharp: bool = False, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriterionFriction:  # fmt: skip
    """The friction c / sqrt(1 - c^2) of the full contact number c, in 2D and 3D.

    Not safe where contacts open: below it rates are unique while all contacts stay closed.
    sharp: what that needs in 3D, the printed c is smaller there.  Raises UnsupportedForm for
    more than 12 contacts in 2D, 4 in 3D, and under Tresca's law.  Others as of
    `p_matrix_friction`.
    """
    from ..analysis.certificates.older_criteria import full_contact_friction as ask

    limit = _begun(time_limit)
    discrete = _with_W(problem, "full contact", limit)
    return ask(discrete, sharp=sharp, gap=gap, time_limit=limit)


def _with_W(problem: FrictionProblem | Model, verb: str, limit: TimeLimit) -> FrictionProblem:
    discrete = _discrete(problem)
    if isinstance(discrete.law, Coulomb):  # else the verb says so
        _check_has_W(problem, verb, limit)
    return discrete


def solve_any_form(
    problem: FrictionProblem | Model, solver: Solver | None = None, *,
    callback: Callback | None = None, **options: Any,
) -> FrictionSolution | ModelSolution:  # fmt: skip
    """Solve like `solve` with check=False, condensing a FrictionProblem too where need be."""
    return _solve(problem, solver, drive_any_form, callback, {"tolerance": 1e-8, **options})


def _solve(
    problem: FrictionProblem | Model, solver: Solver | None, run: Callable[..., Any],
    callback: Callback | None, options: dict[str, Any],
) -> Any:  # fmt: skip
    """Assemble, drive, recover."""
    model = None if isinstance(problem, FrictionProblem) else _checked(problem)
    if model is not None and getattr(model, "is_large", False):
        return _solve_large(model, solver, callback, options)
    began, compiled = now(), compiling()
    options["time_limit"] = deadline_of(options.get("time_limit"))
    discrete = problem if model is None else model.discrete_problem()
    assembled, compiled = now() - began, compiling() - compiled
    if isinstance(options.get("start"), ModelSolution):
        options["start"] = options["start"].solution
    with _progress(callback, options["tolerance"]) as seen:
        found = run(discrete, solver, callback=seen, **options)
    if model is None:
        return found
    found = _with_record(found, compiling=found.convergence.compiling + compiled)
    found = _explained(found, model)
    return ModelSolution(model, found, model.recover(found), assembled)


def _explained(found: FrictionSolution, model: Model) -> FrictionSolution:
    """The same record; one that failed says which bodies give way."""
    from ..mechanics.model.diagnosis import with_diagnosis

    return with_diagnosis(found, model)


def _with_record(found: FrictionSolution, **changes: Any) -> FrictionSolution:
    return replace(found, convergence=replace(found.convergence, **changes))


def _solve_large(
    model: Model, solver: Solver | None, callback: Callback | None, options: dict[str, Any]
) -> ModelSolution:
    """The same of a model in large deformations: one nonlinear problem."""
    from ..mechanics.model.large_deformation import large_deformation
    from ..solvers.newton.nonlinear import nonlinear_solver

    method = nonlinear_solver(solver)
    began, compiled = now(), compiling()
    options["time_limit"] = deadline_of(options.get("time_limit"))
    problem = large_deformation(model)
    assembled, compiled = now() - began, compiling() - compiled
    if isinstance(options.get("start"), ModelSolution):
        options["start"] = options["start"].solution
    with _progress(callback, options["tolerance"]) as seen:
        found = problem.solved(drive(problem, method, callback=seen, **options))  # type: ignore[arg-type]
    found = _with_record(found, compiling=found.convergence.compiling + compiled)
    found = _explained(found, model)
    return ModelSolution(model, found, model.recover(found), assembled)


def drive_any_form(
    problem: FrictionProblem, solver: Solver | None = None, **options: Any
) -> FrictionSolution:
    """`drive`, condensing a global problem for a solver that needs the Delassus form."""
    needed = getattr(solver, "form", Form.ANY)
    if needed is not Form.DELASSUS or problem.form is Form.DELASSUS:
        return drive(problem, solver, **options)
    began, compiled = now(), compiling()
    deadline = options["time_limit"] = deadline_of(options.get("time_limit"))
    try:
        condensed = problem.condensed(deadline)
    except TimeUp:
        found = drive(problem, **options)  # says so in its record
        return _with_record(found, solver=type(solver).__name__)
    spent, compiled = now() - began, compiling() - compiled
    found = drive(condensed, solver, **options)
    u, v = problem.velocity(found.r)
    record = found.convergence
    history = tuple(step._replace(seconds=step.seconds + spent) for step in record.history)
    record = replace(record, seconds=record.seconds + spent, history=history,
                     compiling=record.compiling + compiled)  # fmt: skip
    return replace(found, problem=problem, u=u, v=v, convergence=record)


def raise_unless_converged(result: FrictionSolution | ModelSolution) -> None:
    """Raise NotConverged, or Interrupted after Ctrl-C, carrying the result."""
    record = result.convergence
    if record.outcome is Outcome.CONVERGED:
        return
    message = f"{record}. {record.advice}"
    raise (Interrupted if record.by_user else NotConverged)(message, result)


@contextmanager
def _progress(callback: Callback | None, tolerance: float) -> Iterator[Callback | None]:
    """A line on stderr with iteration, error and time, if that is a terminal."""
    if callback is not None or not sys.stderr.isatty():
        yield callback
        return
    from rich.console import Console

    with Console(stderr=True).status("solving …", refresh_per_second=8) as line:
        shown = 0.0  # drawing takes longer than a small solve: a few lines per second will do

        def show(step: Step, iterate: Iterate) -> None:
            nonlocal shown
            if step.seconds < shown + 0.1:
                return
            shown = step.seconds
            stage = f"[dim]{iterate.stage}[/dim]  " if iterate.stage else ""
            line.update(
                f"{stage}iteration {step.iteration}  error {step.error:.1e} "
                f"[dim](goal {tolerance:.0e})[/dim]  {step.seconds:.1f} s"
            )

        yield show
