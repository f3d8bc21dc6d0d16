"""Proximal points for bodies that contact alone holds: tied by weak springs to where they were.

M is singular then, and sweeps and Newton methods on W = H^T M^-1 H have no W.  With springs
S = s diag(M) the problem

    (M + S) v = f + S v_k + H r,  u = H^T v + w,  law(u, r)                                  (1)

has one, and is solved by all that the Delassus form is solved by.  Its solution is the next
v_k; where the springs no longer pull it solves the problem without them.  This is the proximal
point method (R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)) in the metric of S.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, SingularOperator
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ..contract import Breakdown, Iterate, Iterates, Patience, Target
from .portfolio import TRACKS, Portfolio

Array = NDArray[np.float64]
FIRST_SPRINGS = 1e-3  # share of the diagonal of M
SOFTER = 0.1  # times as stiff where the error falls slowly
SOFTEST = 1e-7  # below, W is rounding
SLOW = 0.5  # least ratio of the errors of SOME steps that calls for softer springs
SOME = 8
STEPS = 60  # with springs
INNER = 100  # chunks of the race in a step that may pass without halving its error
SHARP = 1e-4  # error of a step, in errors of the problem without springs
LEAST = 1e-13  # rounding of such an error


@dataclass(frozen=True)
class Tethers:
    """Steps (1), softer springs where the error falls slowly."""

    form: ClassVar[Form] = Form.GLOBAL

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterates:
        """Iterates (r, v) of a global problem with a singular M, one for each step."""
        stiffness = problem.diagonal
        r, v = start.r, np.zeros(problem.unknowns) if start.v is None else start.v
        share, last, errors = FIRST_SPRINGS, 1.0, [np.inf]
        for _ in range(STEPS):
            springs = share * stiffness
            tied = _tied(problem, springs, v)
            goal = max(SHARP * last, LEAST)
            r, count = _solved(tied, r, goal, target)
            v = tied.solve_M(tied.f + tied.H @ r.ravel())
            judged = yield Iterate(r, v, iterations=count, stage="tethers")
            error = target.error(problem, Iterate(r, v), judged)
            errors.append(error)
            last = min(last, error)
            if len(errors) > SOME and min(errors[-SOME:]) > SLOW * min(errors[:-SOME]):
                share, errors = share * SOFTER, [error]
                if share < SOFTEST:
                    return


def _tied(problem: FrictionProblem, springs: Array, v: Array) -> FrictionProblem:
    """The problem with springs to v."""
    M, H, f, w = problem.M, problem.H, problem.f, problem.w
    assert M is not None and H is not None and f is not None and w is not None
    tied = sparse.csc_array(M + sparse.diags_array(springs))
    return FrictionProblem.from_global(tied, H, f + springs * v, w, problem.law)


def _solved(
    problem: FrictionProblem, r: Array, goal: float, target: Target
) -> tuple[Array, int]:
    """The best reaction of the problem with springs, and the iterations that it took."""
    try:
        condensed = problem.condensed(target.deadline)
    except (InvalidInput, SingularOperator) as reason:
        raise Breakdown(str(reason)) from reason
    best, least, count = r, condensed.error(r), 0
    inner = replace(target, tolerance=goal, start_error=least)
    patience = Patience(INNER, mark=least)
    for iterate in Portfolio(condensed, inner, spatial(r), TRACKS[:-1]).iterates():
        error = condensed.error(iterate.r)
        count += iterate.iterations
        if error < least:
            best, least = iterate.r, error
        if least <= goal or patience.over(error) or target.deadline.passed:
            break
    return best, count
