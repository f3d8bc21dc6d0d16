"""Questions about a model or a discrete problem: other verbs than `solve`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..core.clock import TimeLimit, deadline_of
from ..problem.friction import FrictionProblem
from ..problem.law import Coulomb, Tresca
from ..problem.solution import FrictionSolution
from .api import checked
from .askable import (
    begun,
    check_followed,
    check_has_W,
    check_searchable,
    checked_base,
    discrete_of,
    with_W,
)
from .model_solution import ModelSolution
from .progress import searching

if TYPE_CHECKING:
    from ..analysis.basins.study import Basins
    from ..analysis.certificates.critical_friction import CriticalFriction
    from ..analysis.certificates.older_criteria import CriterionFriction
    from ..analysis.certificates.opening import Opening
    from ..analysis.certificates.verdict import Uniqueness
    from ..analysis.paths.continuation import Continuation
    from ..analysis.paths.diagram import Diagram
    from ..analysis.paths.path import Branch, PathProblem
    from ..analysis.paths.tangents import FirstOrder, Tangent
    from ..analysis.solutions.enumerate import Solutions
    from ..analysis.solutions.large_multistart import LargeSolutions
    from ..mechanics.model import Model

FEW = 10  # starts of Newton's method where a search ends without any solution
LEAST = 1.0  # seconds for them beyond a time limit
SEARCH, WORK = 0.5, 60.0  # share of a limit, or seconds of work, for the search in `basins`


@searching("all solutions")
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
    limit = begun(time_limit)
    discrete = discrete_of(problem)
    from ..analysis.solutions import enumerate as exact

    check_searchable(discrete)
    check_has_W(problem, "all solutions", limit)
    if discrete.dimension == 3:
        from ..analysis.solutions.discs.search import enumerate_discs

        return enumerate_discs(discrete, time_limit=limit, keep_proof=keep_proof)
    if discrete.dimension == 2 and discrete.contacts > exact.CONTACTS:
        found = _many_starts(discrete, time_limit=limit)
        reason = f"more than {exact.CONTACTS} contacts: {found.reason}"
        return replace(found, reason=reason)
    found = exact.enumerate_solutions(discrete, time_limit=limit, keep_proof=keep_proof)
    if found.complete or found.solutions:
        return found
    some = _many_starts(discrete, starts=FEW, time_limit=None if limit is None else LEAST)
    # the search did not come to any
    return replace(found, solutions=some.solutions, resolution=some.resolution)


@searching("solutions from many starts")
def multistart(
    problem: FrictionProblem | Model, *, starts: int | None = None, seed: int = 0,
    time_limit: TimeLimit = None,
) -> Solutions | LargeSolutions:  # fmt: skip
    """Solutions of a Coulomb problem, 2D or 3D, by Newton's method from many starts; no proof.

    starts: their number, 1000 by default and 60 at large strains; seed: of their random choice;
    time_limit: seconds.  Finds in seconds what there is up to some hundred contacts, as far as
    it can be checked; at large strains what lies beside known solutions, along their softest
    modes.  Raises UnsupportedForm under Tresca's law; NotConverged where load steps of large
    strains find no solution.
    """
    limit = begun(time_limit)
    problem = checked(problem)
    if not isinstance(problem, FrictionProblem):
        from ..analysis.solutions import large_multistart as large
        from ..mechanics.model.large_deformation import LargeDeformation

        moved = problem.discrete_problem()
        if isinstance(moved, LargeDeformation):
            count = large.LARGE_STARTS if starts is None else starts
            return large.large_multistart(moved, starts=count, seed=seed, time_limit=limit)
    count = 1000 if starts is None else starts
    return _many_starts(problem, starts=count, seed=seed, time_limit=limit)


def _many_starts(
    problem: FrictionProblem | Model, *, starts: int = 1000, seed: int = 0,
    time_limit: TimeLimit = None,
) -> Solutions:  # fmt: skip
    """`multistart` of a problem that is linear but for its law."""
    from ..analysis.solutions.multistart import multistart as search

    limit = begun(time_limit)
    discrete = discrete_of(problem)
    check_has_W(problem, "multistart", limit)
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
    discrete = discrete_of(problem)
    check_has_W(problem, "basins", begun(time_limit))
    atlas = Atlas(discrete, within)
    if solutions is not None:
        given_solutions(atlas, solutions)
    elif isinstance(discrete.law, Tresca):
        atlas.reason = "given bounds of friction (Tresca): nobody has searched for all"
    elif not isinstance(discrete.law, Coulomb):
        atlas.reason = f"{discrete.law.name}: nobody has searched for all"
    else:
        limit = deadline.share(SEARCH) if time_limit is not None else deadline_of(None, WORK)
        given_solutions(atlas, all_solutions(discrete, time_limit=limit))
    makers = {} if isinstance(problem, FrictionProblem) else {"nitsche": by_nitsche(problem)}
    return study(atlas, methods, parameters, starts, options, deadline, callback, makers)


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
    Each end of the branch has a named reason; `warnings` of that of a model are reasons to
    doubt its states, as those of solutions.
    """
    from ..analysis.paths import asked, checks
    from ..analysis.paths.following import Limits, follow_path

    checks.check_options(options)
    bounds = Limits(checks.checked_interval(interval), **checks.checked_limits(limits))
    check_followed(problem, "follow", bounds.deadline)
    path, y, p = asked.on_path(problem, parameter, bounds, checked_base(base), start, at)
    if along is None:
        branch = follow_path(path, y, p, bounds, options=options)
    else:
        branch = asked.followed_along(path, y, p, bounds, options, along)
    return replace(branch, model=_model(problem))


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
    check_followed(problem, "first_order", bounds.deadline)
    path, y, p = asked.on_path(problem, parameter, bounds, checked_base(base), start, at)
    return asked.tangents_at(path, y, p, tolerance)


def diagram(
    problem: FrictionProblem | Model, parameter: str = "load",
    interval: tuple[float, float] = (0.0, 1.0), *, base: FrictionProblem | Model | None = None,
    at: Sequence[float] | None = None, options: Continuation | None = None, **limits: Any,
) -> Diagram:  # fmt: skip
    """All branches of an interval; `whole` of the answer tells where that is proved.

    All pieces on the interval are searched for, in 3D with up to ten contacts.  With values
    `at` of the parameter, and where that search does not end (then at both ends and the
    middle): all branches through all solutions there, as `all_solutions` finds them, with
    their share of the time each.  Others as in `follow`.
    """
    from ..analysis.paths import checks
    from ..analysis.paths.diagram import bifurcation_diagram
    from ..analysis.paths.following import Limits
    from ..analysis.paths.parametrised import path_of

    checks.check_options(options)
    bounds = Limits(checks.checked_interval(interval), **checks.checked_limits(limits))
    values = None if at is None else checks.checked_values(at, bounds.interval)
    check_has_W(checked(problem), "diagram", bounds.deadline)
    path: Any = path_of(problem, parameter, bounds.interval, checked_base(base))
    found = bifurcation_diagram(path, bounds, values, options=options)
    known = (replace(branch, model=_model(problem)) for branch in found.branches)
    return replace(found, branches=tuple(known))


def _model(problem: Any) -> Model | None:
    """The problem where it is a model, of whose states there may be doubts."""
    from ..mechanics.model import Model

    return problem if isinstance(problem, Model) else None


@searching("uniqueness")
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
    limit = begun(time_limit)
    discrete = discrete_of(problem)
    found = solution.solution if isinstance(solution, ModelSolution) else solution
    from ..analysis.certificates.uniqueness import assess

    held = "" if isinstance(problem, FrictionProblem) else problem.held_by_contact
    verdict = assess(discrete, found, time_limit=limit, held=held or "a body")
    balance = problem.imbalance() if held else None
    if balance is None or not balance.is_proved:
        return verdict
    text = f"{verdict.reason} {balance.reason[0].upper()}{balance.reason[1:]}."
    return replace(verdict, reason=text)


@searching("existence")
def existence(
    problem: FrictionProblem | Model, *, time_limit: TimeLimit = None
) -> Opening:
    """Whether a problem has a solution for every load: a motion that opens all contacts.

    Else reactions that hold each other, on which it depends; or undecided, with the reason.
    time_limit: seconds, by default the work of about 20 s, counted in operations.
    """
    from ..analysis.certificates.opening import opening

    return opening(discrete_of(problem), time_limit=begun(time_limit))


@searching("critical friction")
def critical_friction(
    problem: FrictionProblem | Model, *, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriticalFriction:
    """Bounds on the friction below which every load of a problem has exactly one solution.

    gap: relative distance of the bounds that is good enough.  time_limit: seconds, by default
    the work of about 60 s, counted in operations.  Exact in 2D up to 13 contacts; in 3D the
    lower bound is one of multipliers of every contact, the upper one of a search.  Raises
    UnsupportedForm under Tresca's law.
    """
    from ..analysis.certificates.critical_friction import critical_friction as bounds

    limit = begun(time_limit)
    discrete = discrete_of(problem)
    if isinstance(discrete.law, Coulomb):  # else it says so
        check_has_W(problem, "critical friction", limit)
    return bounds(discrete, gap=gap, time_limit=limit)


@searching("P-matrix criterion")
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

    limit = begun(time_limit)
    discrete = with_W(problem, "the P-matrix criterion", limit)
    return ask(discrete, given_tangents=given_tangents, gap=gap, time_limit=limit)


@searching("full contact")
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

    limit = begun(time_limit)
    discrete = with_W(problem, "full contact", limit)
    return ask(discrete, sharp=sharp, gap=gap, time_limit=limit)
