"""Conjugate gradients preconditioned by multigrid on given levels, or on algebraic ones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import InvalidInput, SingularOperator
from ..core.options import check_options
from .base import by_columns, check_stopping
from .chunks import better_numbers
from .grid_matrix import GridMatrix
from .hierarchy import Hierarchy, Nodes, components
from .levels import Levels

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GeometricMultigrid:
    """CG with one symmetric V(1,1) cycle of block Gauss-Seidel per iteration.

    levels: prolongations of the unknowns, finest first, as in `FrictionProblem.levels`; levels
    of smoothed aggregation follow where they end too early.  dimension: unknowns per node.
    """

    levels: Levels = ()
    dimension: int = 3
    tolerance: float = 1e-11  # relative residual
    max_iterations: int = 200

    def __post_init__(self) -> None:
        check_options(self)
        check_stopping(self.tolerance, self.max_iterations)
        if self.dimension not in (2, 3):
            raise InvalidInput(f"expected 2 or 3, got {self.dimension}", ("dimension",))

    def factor(
        self, matrix: sparse.csc_array, near_nullspace: Array | None = None
    ) -> MultigridFactor:
        """Levels of a symmetric positive definite matrix, (n, n).

        Raises InvalidInput where its unknowns do not come in nodes: near_nullspace tells.
        """
        n = matrix.shape[0]
        hierarchy = prepared(matrix, self.levels, near_nullspace, self.dimension)
        if hierarchy is None:
            raise InvalidInput(
                f"matrix: its {n} unknowns do not come in nodes of {self.dimension}; pass the "
                "rigid modes as near_nullspace, translations first"
            )
        return MultigridFactor(hierarchy, hierarchy.nodes, self)


def prepared(
    matrix: sparse.csc_array,
    levels: Levels,
    modes: Array | None,
    dimension: int,
    *,
    component: NDArray[np.int64] | None = None,
) -> Hierarchy | None:
    """All levels of a matrix (n, n); None where its unknowns do not come in nodes.

    component (n,): directions of unknowns, node by node; else guessed of rigid modes (n, k),
    translations first, or of an n that is a multiple of dimension.
    """
    if isinstance(matrix, GridMatrix):
        return matrix.hierarchy
    if component is None:
        component = components(modes, matrix.shape[0], dimension)
    if component is None:
        return None
    nodes = Nodes.of(component)
    A = nodes.blocks(matrix)
    number = better_numbers(A.indptr, A.indices)
    if number is not None:
        nodes, A = nodes.renumbered(number), A.renumbered(number)
    return Hierarchy.of(A, component, levels, modes, nodes)


@dataclass
class MultigridFactor:
    """Prepared levels."""

    hierarchy: Hierarchy
    nodes: Nodes
    options: GeometricMultigrid
    exact: bool = field(default=False, init=False)
    iterations: int = field(default=0, init=False)

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b to the options' tolerance, shape of b."""
        return by_columns(self._solve_one, b)

    def _solve_one(self, b: Array) -> Array:
        most = self.options.max_iterations
        x, count = self.hierarchy.solve(0, self.nodes.spread(b), self.options.tolerance, most)
        self.iterations += min(count, most)
        if count > most or not np.isfinite(x).all():
            raise SingularOperator(
                f"multigrid: no convergence in {most} iterations; is the matrix symmetric "
                "positive definite?"
            )
        return self.nodes.gather(x)
