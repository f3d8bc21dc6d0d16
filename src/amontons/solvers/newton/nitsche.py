"""Newton's method for Nitsche's contact: residual and tangent of displacements, a line search.

    dF/dv dv = -F(v),   v <- v + t dv,   t by a line search on |F|_*, the norm of the judge.

F is piecewise smooth (without friction, or in 2D, piecewise linear), [R]; full steps end after
a few pieces or cycle.  Where they make no way, as for bodies that friction alone holds, whose
tangents are nearly singular, `proximal` adds springs at all contact points that are relaxed at
the last solution v_k (the proximal point method),

    F(v) + firmness springs (v - v_k) = 0,

solves this by Newton's method with a line search, and goes on from there with softer springs,
or stiffer ones where that failed.

[R] Y. Renard, "Generalized Newton's methods for the approximation and resolution of frictional
contact problems in elasticity", Comput. Methods Appl. Mech. Eng. 256 (2013).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...linear import Direct, LinearSolver
from ...problem.nitsche import NitscheProblem
from ..contract import Breakdown, Iterate, Iterates, Judgement, Patience, Target
from .line_search import Armijo, LineSearch

Array = NDArray[np.float64]
STALLED = 12  # Newton steps without halving the residual after which springs are added
FIRMNESS = 0.1  # of the first springs, relative to the cells behind the surface
CHANGE, STIFFEST = 5.0, 1e6  # factor between two of them; the largest one
INNER = 0.1  # residual of a problem with springs, relative to that of its start
QUICK, INNER_STEPS = 4, 15  # Newton steps after which springs get softer, or stiffer
REPEATED = 1e-12  # relative difference of residuals below which steps go round in circles


def newton_iterates(
    problem: NitscheProblem,
    start: Iterate,
    line_search: LineSearch,
    linear: LinearSolver | None,
) -> Iterator[Iterate]:
    """Newton steps from the v of `start`, or from the problem's own guess."""
    v = problem.guess if start.v is None else start.v
    values: list[float] = []
    while True:
        v = _next(problem, v, line_search, linear or Direct(), values)
        yield Iterate(problem.reaction(v), v)


@np.errstate(over="ignore", invalid="ignore")  # steps without a line search may run away
def _next(
    problem: NitscheProblem, v: Array, line_search: LineSearch, linear: LinearSolver,
    values: list[float],
) -> Array:  # fmt: skip
    """v after one step; appends to the values of the merit."""
    values.append(problem.size(problem.residual(v)))
    if not np.isfinite(values[-1]):
        raise Breakdown("the iterates grow without bound")
    step = problem.newton_step(v, linear)
    if not np.isfinite(step).all():
        raise Breakdown("the Newton step is not finite")
    length = line_search.length(lambda t: problem.size(problem.residual(v + t * step)), values)
    return v + length * step


def robust_iterates(
    problem: NitscheProblem, start: Iterate, target: Target
) -> Iterates:
    """What Auto does: Newton with a line search, and proximal points where that stalls."""
    best = yield from _while_falling(problem, start, target)
    yield from proximal_iterates(problem, best)


def _while_falling(
    problem: NitscheProblem, start: Iterate, target: Target
) -> Generator[Iterate, Judgement | None, Iterate]:
    """Newton steps from the start as long as the residual falls; returns the best iterate."""
    best, error = start, target.start_error
    patience, seen = Patience(STALLED, mark=error), [error]
    try:
        for iterate in newton_iterates(problem, start, Armijo(), None):
            new = target.error(problem, iterate, (yield iterate))
            if new < error:
                best, error = iterate, new
            if np.abs(np.array(seen) - new).min() <= REPEATED * new or patience.over(new):
                break
            seen.append(new)
    except Breakdown:
        pass
    return best


def proximal_iterates(problem: NitscheProblem, start: Iterate) -> Iterator[Iterate]:
    """Solutions with springs relaxed at the one before; Breakdown where none is found."""
    v, firmness = problem.guess if start.v is None else start.v, FIRMNESS
    size = problem.size(problem.residual(v))
    while firmness <= STIFFEST:
        found, steps = _with_springs(problem, v, firmness, INNER * size)
        if found is None:
            firmness *= CHANGE
            continue
        v, size = found, problem.size(problem.residual(found))
        if steps <= QUICK:
            firmness /= CHANGE
        yield Iterate(problem.reaction(v), v, steps, stage="proximal point")
    raise Breakdown("no springs at the contact make a problem that Newton's method solves")


def _with_springs(
    problem: NitscheProblem, v0: Array, firmness: float, goal: float
) -> tuple[Array | None, int]:
    """v with |F(v) + firmness springs (v - v0)|_* <= goal, or None; number of Newton steps."""
    springs = firmness * problem.matrices.springs

    def size(v: Array) -> float:
        return problem.size(problem.residual(v) + springs @ (v - v0))

    v, values = v0, [size(v0)]
    for count in range(1, INNER_STEPS + 1):
        right = problem.residual(v) + springs @ (v - v0)
        try:
            step = Direct().factor(sparse.csc_array(problem.tangent(v) + springs)).solve(-right)
        except SingularOperator:
            return None, count
        v = v + Armijo().length(lambda t, v=v, step=step: size(v + t * step), values) * step
        values.append(size(v))
        if values[-1] <= goal:
            return v, count
    return None, INNER_STEPS
