"""Combinations: `Hybrid` runs one solver after another, `Auto` is what a plain `solve` runs.

    problem                         what Auto does
    Delassus form                   `portfolio`: a race of sweeps, interior point, smoothing and
                                    inexact Newton by measured progress (`race`)
    global form, W cheap            the same on W = H^T M^-1 H
    global form, mesh, W dear       `ContactMultigrid` from MESH unknowns on, bodies held or
                                    not; when it breaks down or stalls, as below
    global form, W dear             `CompressedDelassus`, then semismooth Newton without W, then
                                    the Delassus form after all if W fits into memory
    global form, M singular, mu = 0 `FrictionlessInteriorPoint`, then as below
    global form, M singular         semismooth Newton with a factor of the whole system;
                                    on a mesh `ContactMultigrid`; Newton on the natural map;
                                    active sets; proximal points (`tethers`)
    Nitsche's method                Newton, then proximal points (`newton.nitsche`)
    large deformations              `NonlinearNewton`
    bodies that yield               `TangentNewton`
    contacts with moments           `RollingSweeps`

A mesh is what has levels or rigid modes (`FrictionProblem.levels`, `near_nullspace`).

When is W cheap (`GlobalMatrices.condensing_is_cheap`; it then also judges)?

    bodies of M                     W is formed
    rigid, at most 48 unknowns      always: W is sparse
    n nc d <= EXACT_WORK            always: small
    deformable                      when it takes at most CHEAP times the work of a compressed W
                                    (`condensation`) and its blocks fit into DENSE_LIMIT: walls
                                    of many equal blocks yes, one meshed body of 10 000 unknowns
                                    no; never where a body of LARGE_BODY unknowns has levels

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `sweeps.gauss_seidel`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import numpy as np

from ...core.errors import InvalidInput, SingularOperator
from ...core.options import check_options
from ...linear import Direct
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ...problem.rolling import RollingProblem
from ..active_set.sets import ActiveSet
from ..contract import (
    Breakdown,
    Iterate,
    Iterates,
    Patience,
    Solver,
    Target,
    check_at_least,
    taken_by,
)
from ..judging import first_of, sent
from ..multigrid.cycles import ContactMultigrid
from ..newton.frictionless import FrictionlessInteriorPoint, has_no_friction
from ..newton.functions import NaturalMap
from ..newton.nitsche import robust_iterates
from ..newton.nonlinear import NonlinearNewton, NonlinearProblem
from ..newton.semismooth import SemismoothNewton
from ..newton.tangents import TangentNewton, TangentProblem
from ..sweeps.gauss_seidel import GaussSeidel
from ..sweeps.rolling import RollingSweeps
from .compressed import CompressedDelassus
from .portfolio import Portfolio
from .state import Begun
from .tethers import Tethers

MESH = 3_000  # unknowns of a mesh from which multigrid beats a factorisation
FACTORED = 300_000  # unknowns up to which some tens of factorisations are no matter
SAME = 1e-12  # relative difference of errors up to which they are the same
STALLED = 20  # iterates without halving the error after which Auto changes the method


@dataclass(frozen=True)
class Hybrid:
    """`first` for some iterates, then `main` from the last of them ([ABD] NSN-AC-HYBRID)."""

    form: ClassVar[Form] = Form.ANY
    first: Solver = field(default_factory=lambda: GaussSeidel(batch=100))
    main: Solver = field(default_factory=SemismoothNewton)
    iterates_of_first: int = 1

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, iterates_of_first=self.iterates_of_first)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterates:
        """Iterates of `first`, then of `main`; condensed where one of them needs it."""
        first = _run(self.first, problem, start, target)
        last = yield from first_of(first, self.iterates_of_first)
        yield from first_of(_run(self.main, problem, last or start, target))


def _run(
    solver: Solver, problem: FrictionProblem, start: Iterate, target: Target
) -> Iterator[Iterate]:
    """Iterates of a solver, on the condensed problem if it needs the Delassus form."""
    form = taken_by(solver).form
    if form is Form.DELASSUS:
        problem = problem.condensed(target.deadline)
    elif form is Form.GLOBAL and problem.form is Form.DELASSUS:
        raise InvalidInput(f"{type(solver).__name__}: the problem has no global form")
    return _staged(iter(solver.iterates(problem, start, target)), solver)


def _staged(iterates: Iterator[Iterate], solver: Solver) -> Iterates:
    """The same iterates, named by their solver; it is told what is sent."""
    judged = None
    while (iterate := sent(iterates, judged)) is not None:
        judged = yield _named(iterate, solver)


class Attempt(NamedTuple):
    """A method that Auto tries on the global form; from the best iterate or the start."""

    solver: Solver
    from_best: bool = True
    on_meshes: bool = False  # there alone


WHOLE = SemismoothNewton(linear=Direct())
# M is singular: where contact just holds a body, the branches of Newton's method may leave no
# stiffness against sliding; those of the natural map do, from a state that is nearly right.
HELD = (
    Attempt(WHOLE, from_best=False),
    Attempt(ContactMultigrid(), from_best=False, on_meshes=True),
    Attempt(replace(WHOLE, function=NaturalMap())),
    Attempt(ActiveSet(), from_best=False),
    Attempt(Tethers(), from_best=False),
    Attempt(WHOLE),
)
DEAR = (Attempt(CompressedDelassus()), Attempt(SemismoothNewton()))  # W is


@dataclass(eq=False)
class _Best:
    """The best iterate so far and its error."""

    iterate: Iterate
    error: float


@dataclass(frozen=True)
class Auto:
    """Tries, watches the error, switches; see the table of this module."""

    solves: ClassVar[tuple[type, ...]] = (
        FrictionProblem, NitscheProblem, NonlinearProblem, RollingProblem, TangentProblem
    )  # fmt: skip
    form: ClassVar[Form] = Form.ANY
    matrix_free: ClassVar[bool] = True
    changes_method: ClassVar[bool] = True

    def choice(
        self, problem: Problem
    ) -> Auto | NonlinearNewton | RollingSweeps | TangentNewton:
        """The method of a problem that one alone solves, else itself."""
        if isinstance(problem, TangentProblem):
            return TangentNewton()
        if isinstance(problem, RollingProblem):
            return RollingSweeps()
        return NonlinearNewton() if isinstance(problem, NonlinearProblem) else self

    def iterates(
        self, problem: FrictionProblem | NitscheProblem, start: Iterate, target: Target
    ) -> Iterates:
        """Iterates of one method after another, until nothing is left to try."""
        if not isinstance(problem, FrictionProblem):
            yield from robust_iterates(problem, start, target)
        elif problem.contacts and problem.has_v:
            yield from _of_global_form(problem, start, target)
        elif problem.contacts:
            yield from _stages(problem, start, target)


@dataclass(frozen=True)
class Continued(Auto):
    """Auto where the first stage has begun: the race goes on from there."""

    begun: Begun

    def iterates(
        self, problem: FrictionProblem | NitscheProblem, start: Iterate, target: Target
    ) -> Iterates:
        """As of Auto; from another start nothing has begun."""
        assert isinstance(problem, FrictionProblem)
        r = spatial(start.r)
        begun = self.begun if np.array_equal(r, self.begun.start) else None
        yield from Portfolio(problem, target, r, begun=begun).iterates()


def _of_global_form(problem: FrictionProblem, start: Iterate, target: Target) -> Iterates:
    best = _Best(start, target.start_error)
    if _is_loose_without_friction(problem):
        slides = FrictionlessInteriorPoint()
        yield from _watched(slides, problem.assembled(), best, target, best)
    if _worth_multigrid(problem):
        yield from _watched(ContactMultigrid(), problem, best, target, best)
    problem = problem.assembled()
    if not _regular(problem):
        yield from _tried(HELD, problem, start, target, best)
        return
    if not problem.condensing_is_cheap:
        yield from _tried(DEAR, problem, start, target, best)
    try:
        condensed = problem.condensed(target.deadline)
    except InvalidInput as reason:
        raise Breakdown(str(reason)) from reason
    yield from _stages(condensed, best.iterate, target)


def _tried(
    attempts: tuple[Attempt, ...],
    problem: FrictionProblem,
    start: Iterate,
    target: Target,
    best: _Best,
) -> Iterates:
    """Iterates of one method after another, each until it breaks down or stalls."""
    first = _Best(start, target.start_error)
    for solver, from_best, on_meshes in attempts:
        if not on_meshes or _is_mesh(problem):
            yield from _watched(solver, problem, best if from_best else first, target, best)


def _stages(problem: FrictionProblem, start: Iterate, target: Target) -> Iterates:
    return Portfolio(problem, target, spatial(start.r)).iterates()


def _is_mesh(problem: FrictionProblem) -> bool:
    return problem.is_mesh


def _worth_multigrid(problem: FrictionProblem) -> bool:
    """True for meshes on which a factorisation takes longer than some cycles."""
    if problem.unknowns < MESH:
        return False
    return _is_mesh(problem) and not problem.condensing_is_cheap


def _is_loose_without_friction(problem: FrictionProblem) -> bool:
    """True where neither M nor friction holds a body, and a factor of M is no great matter.

    Without a mesh that factor comes first: modes of many bodies would take longer.
    """
    if problem.unknowns > FACTORED or not has_no_friction(problem):
        return False
    if not _is_mesh(problem) and _regular(problem):
        return False
    return problem.matrices.loose_modes.shape[1] > 0


def _regular(problem: FrictionProblem) -> bool:
    """False when M can not be inverted: a body is held by contact alone."""
    try:
        _ = problem.free_velocity
    except SingularOperator:
        return False
    return True


def _repeats(errors: list[float], error: float) -> bool:
    """True where an error comes back after another one: a cycle of the method."""
    near = SAME * error
    earlier = [abs(old - error) <= near for old in errors]
    return any(earlier) and not earlier[-1]


def _named(iterate: Iterate, solver: Solver) -> Iterate:
    """The iterate with the name of its solver as stage, unless it has one."""
    return iterate if iterate.stage else replace(iterate, stage=type(solver).__name__)


def _watched(
    solver: Solver,
    problem: FrictionProblem,
    start: _Best,
    target: Target,
    best: _Best,
) -> Iterates:
    """Iterates of a solver until it breaks down, stalls or repeats; best: the best so far."""
    patience = Patience(STALLED, mark=start.error)
    errors: list[float] = []
    iterates, judged = solver.iterates(problem, start.iterate, target), None
    try:
        while (iterate := sent(iterates, judged)) is not None:
            judged = yield _named(iterate, solver)
            error = target.error(problem, iterate, judged)
            if error < best.error:
                best.iterate, best.error = iterate, error
            if patience.over(error) or _repeats(errors, error):
                return
            errors.append(error)
    except (Breakdown, SingularOperator):
        return
