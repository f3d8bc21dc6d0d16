"""Newton's method for Nitsche's contact: residual and tangent of displacements, a line search.

    dF/dv dv = -F(v),   v <- v + t dv,   t by a line search on |F|_*, the norm of the judge.

F is piecewise smooth (without friction, or in 2D, piecewise linear), [R]; full steps end after
a few pieces or cycle.  Where friction makes them cycle or climb, `settled` takes its bound from
the last solution instead (Tresca's law): the law is then a projection onto fixed disks, a
monotone map, and Newton's method with a line search goes down to its solution.

[R] Y. Renard, "Generalized Newton's methods for the approximation and resolution of frictional
contact problems in elasticity", Comput. Methods Appl. Mech. Eng. 256 (2013).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..cones import Coulomb, Tresca
from ..linear import Direct, LinearSolver
from ..nitsche_problem import NitscheProblem
from .base import Breakdown, Iterate, Patience, Target
from .line_search import Armijo, LineSearch

Array = NDArray[np.float64]
STALLED = 12  # Newton steps without halving the residual after which friction is settled apart
WITHIN = 0.1  # residual of a problem with given friction, relative to that of its start
GIVEN_STEPS = 30  # Newton steps of such a problem
ROUNDS = (0, 2, 5, 10, 20, 50, 100)  # such problems before each try of Newton's method
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
) -> Iterator[Iterate]:
    """What Auto does: Newton, with settled friction before the next try when that stalls."""
    best = [start]
    for rounds in ROUNDS:
        for iterate in islice(settled(problem, best[0], target), rounds):
            best[0] = iterate
            yield iterate
        yield from _while_falling(problem, best)


def _while_falling(problem: NitscheProblem, best: list[Iterate]) -> Iterator[Iterate]:
    """Newton steps from best[0] as long as the residual falls; best[0] becomes the best."""
    error = problem.error(best[0].r, best[0].v)
    patience, seen = Patience(STALLED, mark=error), [error]
    try:
        for iterate in newton_iterates(problem, best[0], Armijo(), None):
            new = problem.error(iterate.r, iterate.v)
            if new < error:
                error, best[0] = new, iterate
            if np.abs(np.array(seen) - new).min() <= REPEATED * new or patience.over(new):
                return
            seen.append(new)
            yield iterate
    except Breakdown:
        return


def settled(problem: NitscheProblem, start: Iterate, target: Target) -> Iterator[Iterate]:
    """Newton for the friction bound of the last solution, the bound renewed each time."""
    law = problem.law
    v = problem.guess if start.v is None else start.v
    if not isinstance(law, Coulomb):
        return
    while True:
        bound = law.bound(problem.reaction(v))
        given = problem.with_law(Tresca(bound))
        goal = WITHIN * given.size(given.residual(v))
        values: list[float] = []
        for _ in range(GIVEN_STEPS):
            v = _next(given, v, Armijo(), Direct(), values)
            if given.size(given.residual(v)) <= goal or target.seconds_left <= 0:
                break
        yield Iterate(problem.reaction(v), v, len(values), stage="settled friction")
