"""Which linear solver takes a Newton step: a direct factor, or multigrid where it is cheaper.

A factor of a body in three dimensions costs n^2 operations, multigrid n.  From LARGE unknowns
on the steps of one solve begin with `linear.condensed`, whose levels stay while the constraints
of contact stay the same and GMRES does not need many more steps than with new ones.  Where it
fails the direct solver takes over until the end of the solve; that also says whether a matrix
is singular.  Small systems go to `linear.small`.  What is kept never outlives a solve, which so
does not depend on earlier ones.

Steps are as exact as Newton's method can use [EW], choice 2: a small part of the square of the
last ratio of residuals, so that its last steps stay quadratic.

[EW] S. Eisenstat, H. Walker, "Choosing the forcing terms in an inexact Newton method", SIAM J.
Sci. Comput. 17 (1996).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...linear import Direct, LinearSolver
from ...linear.base import Factor
from ...linear.condensed import Condensed, CondensedFactor, Structure
from ...linear.small import factor_of_small
from .states import Linear

if TYPE_CHECKING:
    from .nonlinear import NonlinearProblem

Array = NDArray[np.float64]
LARGE = {2: 100_000, 3: 8_000}  # unknowns from which multigrid is cheaper, by dimension
LOOSEST, TIGHTEST = 1e-4, 1e-10  # relative residuals of steps
PART = 0.1  # of the square of the last ratio of residuals
TRIAL = 1e-2  # relative residual of steps that are measured only, for the line search
WORN = 1.5, 5  # GMRES steps: factor and number beyond those with new levels that make them old


def forcing(sizes: Sequence[float]) -> float:
    """Relative residual of the next step, of |F| so far."""
    if len(sizes) < 2:
        return LOOSEST
    return float(np.clip(PART * (sizes[-1] / sizes[-2]) ** 2, TIGHTEST, LOOSEST))


class LinearSteps:
    """Linear solves of the Newton steps of one solve.

    linear: the solver to take; None: chosen as said above.
    """

    def __init__(self, linear: LinearSolver | None) -> None:
        self._direct = Direct() if linear is None else linear
        self._chosen = self._iterative = linear is None
        self._kept: CondensedFactor | None = None
        self._usual = 0  # GMRES steps with new levels

    def solved(self, here: Linear, F: Array, tolerance: float) -> tuple[Array, Factor]:
        """(-A^-1 F, the factor) of a linearisation; raises SingularOperator."""
        if self._iterative and len(F) >= min(LARGE.values()):
            structure = getattr(here, "structure", None)
            if structure is not None and len(F) >= LARGE[structure.dimension]:
                try:
                    return self._by_multigrid(here.matrix, structure, F, tolerance)
                except SingularOperator:
                    self._iterative, self._kept = False, None
        factor = factor_of_small(here.matrix) if self._chosen else None
        if factor is None:
            factor = self._direct.factor(here.matrix)
        return factor.solve(-F), factor

    def _by_multigrid(
        self, matrix: sparse.csc_array, structure: Structure, F: Array, tolerance: float
    ) -> tuple[Array, CondensedFactor]:
        condensed = Condensed(matrix, structure)
        kept = self._kept
        if kept is not None and np.array_equal(kept.condensed.held, condensed.held):
            factor = CondensedFactor(condensed, kept.levels, tolerance=TRIAL)
            try:
                x = factor.solved(-F, tolerance)
                worn = factor.iterations > WORN[0] * self._usual + WORN[1]
                self._kept = None if worn else factor
                return x, factor
            except SingularOperator:
                pass  # old levels
        factor = CondensedFactor(condensed, condensed.hierarchy(), tolerance=TRIAL)
        x = factor.solved(-F, tolerance)
        self._kept, self._usual = factor, factor.iterations
        return x, factor


def newton_step(
    problem: NonlinearProblem, v: Array, here: Linear, F: Array, linear: LinearSteps,
    tolerance: float = LOOSEST,
) -> tuple[Array, Factor]:  # fmt: skip
    """-dF/dv^-1 F and the factors; with more contacts closed where a body is loose."""
    try:
        return linear.solved(here, F, tolerance)
    except SingularOperator:
        for pieces in problem.closed_pieces(v):
            try:
                return linear.solved(problem.linearisation(v, pieces), F, tolerance)
            except SingularOperator:
                continue
        raise
