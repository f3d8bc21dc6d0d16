"""Combinations: `Hybrid` runs one solver after another, `Auto` is what a plain `solve` runs.

    problem                         what Auto does
    Delassus form, joints           `inexact`: accelerated sweeps, then inexact Newton with a
                                    kept block LU; when that stalls, as below.  Joints:
                                    groups of contacts with the same neighbours, not rigid
    Delassus form                   `portfolio`: sweeps, smoothing Newton, proximal point
    global form, W cheap            the same on W = H^T M^-1 H
    global form, mesh, W dear       `ContactMultigrid` from MESH unknowns on, bodies held or
                                    not; when it breaks down or stalls, as below
    global form, W dear             `CompressedDelassus`, then semismooth Newton without W, then
                                    the Delassus form after all if W fits into memory
    global form, M singular         semismooth Newton with a factor of the whole system;
                                    on a mesh `ContactMultigrid`; Newton on the natural map
    Nitsche's method                Newton, then proximal points (`newton.nitsche`)

A mesh is what has levels or rigid modes (`FrictionProblem.levels`, `near_nullspace`).

When is W cheap (`GlobalMatrices.condensing_is_cheap`; it then also judges)?

    bodies of M                     W is formed
    rigid, at most 48 unknowns      always: W is sparse
    n nc d <= EXACT_WORK            always: small
    deformable                      when it takes at most CHEAP times the work of a compressed W
                                    (`condensation`) and its blocks fit into DENSE_LIMIT: walls
                                    of many equal blocks yes, one meshed body of 10 000 unknowns
                                    no; never where a body of LARGE_BODY unknowns has levels

Whether to sweep or to take Newton steps is decided while solving, from the measured rate of the
sweeps and operation counts of Newton (`Joints.newton_cost`, `Portfolio.costs`).

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `sweeps.gauss_seidel`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import ClassVar

import numpy as np

from ...core.errors import InvalidInput, SingularOperator
from ...core.options import check_options
from ...linear import Direct
from ...linear.blocks import spatial
from ...linear.distributed import DistributedMatrix
from ...problem.friction import Form, FrictionProblem
from ...problem.judge.measures import Measure
from ...problem.nitsche import NitscheProblem
from ..contract import Breakdown, Iterate, Patience, Solver, Target, check_at_least
from ..multigrid.cycles import ContactMultigrid
from ..newton.functions import NaturalMap
from ..newton.inexact import DeformablePortfolio
from ..newton.nitsche import robust_iterates
from ..newton.semismooth import SemismoothNewton
from ..sweeps.gauss_seidel import GaussSeidel
from .compressed import CompressedDelassus

MESH = 3_000  # unknowns of a mesh from which multigrid beats a factorisation
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
    ) -> Iterator[Iterate]:
        """Iterates of `first`, then of `main`; condensed where one of them needs it."""
        for iterate in islice(_run(self.first, problem, start, target), self.iterates_of_first):
            start = iterate
            yield iterate
        yield from _run(self.main, problem, start, target)


def _run(
    solver: Solver, problem: FrictionProblem, start: Iterate, target: Target
) -> Iterator[Iterate]:
    """Iterates of a solver, on the condensed problem if it needs the Delassus form."""
    if solver.form is Form.DELASSUS:
        problem = problem.condensed(target.deadline)
    elif solver.form is Form.GLOBAL and problem.form is Form.DELASSUS:
        raise InvalidInput(f"{type(solver).__name__}: the problem has no global form")
    return solver.iterates(problem, start, target)


@dataclass(frozen=True)
class Auto:
    """Tries, watches the error, switches; see the table of this module."""

    form: ClassVar[Form] = Form.ANY
    matrix_free: ClassVar[bool] = True
    nitsche: ClassVar[bool] = True

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Iterates of one method after another, until nothing is left to try."""
        if isinstance(problem, NitscheProblem):
            yield from robust_iterates(problem, start, target)
            return
        if problem.contacts == 0:
            return
        best = [start]
        if _worth_multigrid(problem):
            yield from _watched(ContactMultigrid(), problem, start, target, best)
        problem = problem.assembled()
        if problem.form is Form.GLOBAL and not _regular(problem):
            yield from _held_by_contact(problem, start, target, best)
        elif problem.condensing_is_cheap:
            yield from DeformablePortfolio(
                problem.condensed(target.deadline), target, spatial(start.r)
            ).stages()
        else:
            yield from self._on_meshes(problem, target, best)

    def _on_meshes(
        self, problem: FrictionProblem, target: Target, best: list[Iterate]
    ) -> Iterator[Iterate]:
        for solver in (CompressedDelassus(), SemismoothNewton()):
            yield from _watched(solver, problem, best[0], target, best)
        try:
            condensed = problem.condensed(target.deadline)
        except InvalidInput as reason:
            raise Breakdown(str(reason)) from reason
        yield from DeformablePortfolio(condensed, target, spatial(best[0].r)).stages()


def _held_by_contact(
    problem: FrictionProblem, start: Iterate, target: Target, best: list[Iterate]
) -> Iterator[Iterate]:
    """Newton on the whole system, M being singular; then multigrid, and Newton from there.

    Where contact just holds a body its branches may leave no stiffness against sliding.
    """
    whole = SemismoothNewton(linear=Direct())
    yield from _watched(whole, problem, start, target, best)
    if _is_mesh(problem):
        yield from _watched(ContactMultigrid(), problem, start, target, best)
    natural = replace(whole, function=NaturalMap())
    yield from _watched(natural, problem, best[0], target, best)


def _is_mesh(problem: FrictionProblem) -> bool:
    return bool(problem.levels) or problem.near_nullspace is not None


def _worth_multigrid(problem: FrictionProblem) -> bool:
    """True for meshes on which a factorisation takes longer than some cycles."""
    if problem.form is not Form.GLOBAL or problem.unknowns < MESH:
        return False
    if isinstance(problem.M, DistributedMatrix):
        return False  # its levels would have to be spread too
    return _is_mesh(problem) and not problem.condensing_is_cheap


def _regular(problem: FrictionProblem) -> bool:
    """False when M can not be inverted: a body is held by contact alone."""
    try:
        _ = problem.free_velocity
    except SingularOperator:
        return False
    return True


def _watched(
    solver: Solver,
    problem: FrictionProblem,
    start: Iterate,
    target: Target,
    best: list[Iterate],
) -> Iterator[Iterate]:
    """Iterates of a solver until it breaks down or stalls; best[0] becomes the best of them."""
    known = start.v is not None or problem.measure is Measure.EXACT
    error = problem.error(start.r, start.v) if known else np.inf  # v would cost a linear solve
    patience = Patience(STALLED, mark=error)
    try:
        for iterate in solver.iterates(problem, start, target):
            new = problem.error(iterate.r, iterate.v)
            if new < error:
                error, best[0] = new, iterate
            stalled = patience.over(error)
            yield iterate
            if stalled:
                return
    except (Breakdown, SingularOperator):
        return
