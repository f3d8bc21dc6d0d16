"""Algebraic multigrid (pyamg): smoothed aggregation with the rigid modes as near-nullspace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import InvalidInput
from ..core.options import check_options
from .base import stored

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AlgebraicMultigrid:
    """One V-cycle per `solve`: an approximation, meant as a preconditioner."""

    block_size: int = 3  # unknowns per node; the matrix is stored in such blocks when it fits
    strength: float = 0.0  # smaller connections are ignored when nodes are grouped

    def __post_init__(self) -> None:
        check_options(self)
        if self.block_size < 1:
            raise InvalidInput(f"block_size: expected at least 1, got {self.block_size}")

    def factor(
        self, matrix: sparse.csc_array, near_nullspace: Array | None = None
    ) -> Hierarchy:
        """Hierarchy of a symmetric positive definite matrix, (n, n)."""
        import pyamg

        rows = sparse.csr_matrix(stored(matrix))
        blocks = rows
        if near_nullspace is not None and rows.shape[0] % self.block_size == 0:
            blocks = rows.tobsr((self.block_size, self.block_size))
        smoother = ("block_gauss_seidel", {"sweep": "symmetric"})
        levels = pyamg.smoothed_aggregation_solver(
            blocks,
            B=near_nullspace,
            strength=("symmetric", {"theta": self.strength}),
            presmoother=smoother,
            postsmoother=smoother,
            improve_candidates=None,
            max_coarse=300,
        )
        return Hierarchy(levels.aspreconditioner(cycle="V"))


@dataclass
class Hierarchy:
    """A prepared multigrid hierarchy."""

    cycle: sparse.linalg.LinearOperator
    exact: bool = False
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """One V-cycle from zero on A x = b; b of shape (n,) or (n, k)."""
        columns = b.reshape(len(b), -1)
        self.iterations += columns.shape[1]
        out = np.column_stack([self.cycle @ columns[:, k] for k in range(columns.shape[1])])
        return out.reshape(b.shape)
