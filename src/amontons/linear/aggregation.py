"""Coarse levels where a mesh has none: smoothed aggregation for rigid motions.

Nodes that touch make an aggregate, whose unknowns are the amplitudes of the k near-null motions
on it, orthonormalised there; the prolongation is smoothed by one damped block Jacobi step,

    P = (I - omega D^-1 A) T,    omega = 4/3 / rho(D^-1 A)                            [VMB]

with T those motions cut up.  Aggregates and T are made by pyamg; rho is estimated from a fixed
start, so that the same matrix always has the same levels, to the last bit.

An aggregate is a unit of k / 3 block rows that stay together.

[VMB] P. Vanek, J. Mandel, M. Brezina, "Algebraic multigrid by smoothed aggregation for second
and fourth order elliptic problems", Computing 56 (1996).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .chunks import units_of
from .node_blocks import NodeBlocks
from .transfer import Transfer
from .vectors import dot

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEPS = 12  # of Lanczos's method for rho: within some per cent
OMEGA = 4 / 3


@dataclass(frozen=True, eq=False)
class Aggregates:
    """What the next coarser level is made of: modes (3 nodes, k), block rows of a unit."""

    modes: Array
    width: int = 1

    def coarsen(self, A: NodeBlocks) -> tuple[Transfer, Aggregates] | None:
        """Prolongation to aggregates of units of A, and the same of them; None without any."""
        from pyamg.aggregation import fit_candidates, standard_aggregation

        graph = units_of(A.indptr, A.indices, self.width)
        joined, _ = standard_aggregation(graph)
        if not joined.nnz or joined.shape[1] >= graph.shape[0]:
            return None
        columns = -self.modes.shape[1] % 3
        modes = np.column_stack([self.modes, np.zeros((len(self.modes), columns))])
        pieces, coarse = fit_candidates(joined, modes)
        T = sparse.bsr_array(sparse.bsr_array(pieces).tobsr((3, 3)))
        P = _smoothed(A, T)
        idle = np.flatnonzero(np.einsum("kii->ki", A.diagonal_blocks).ravel() == 0)
        transfer = Transfer.of(P, idle, np.empty(0, dtype=np.int64))
        return transfer, Aggregates(np.asarray(coarse), modes.shape[1] // 3)

    def renumbered(self, number: Index | None) -> Aggregates:
        """The same with block rows of other numbers, (nodes,); units stay together."""
        if number is None:
            return self
        modes = self.modes.reshape(len(number), 3, -1)[np.argsort(number)]
        return Aggregates(modes.reshape(self.modes.shape), self.width)


def _smoothed(A: NodeBlocks, T: sparse.bsr_array) -> sparse.bsr_array:
    n = 3 * A.nodes
    scaled = np.matmul(np.repeat(A.inverse, np.diff(A.indptr), axis=0), A.data)
    matrix = sparse.bsr_array((scaled, A.indices, A.indptr), shape=(n, n))
    step = sparse.bsr_array(matrix @ T)
    step.data *= -OMEGA / _largest_eigenvalue(A)
    return sparse.bsr_array((T + step).tobsr((3, 3)))


def _largest_eigenvalue(A: NodeBlocks) -> float:
    """Of D^-1 A, D the diagonal blocks, by Lanczos's method in the product of D."""
    D = A.diagonal_blocks
    x = np.cos(np.arange(3.0 * A.nodes)).reshape(-1, 3)
    z, before = np.empty_like(x), np.zeros_like(x)
    y = _applied(A.inverse, _applied(D, x))  # nothing where D has none
    alphas, betas = [], []
    for _ in range(STEPS):
        square = dot(y, _applied(D, y))
        if not square > 0 or (alphas and square <= 1e-20 * alphas[-1] ** 2):
            break
        beta = float(np.sqrt(square))
        before, x = x if alphas else before, y / beta
        A.times(x, z)
        alphas.append(dot(x, z))
        betas.append(beta)
        y = _applied(A.inverse, z) - alphas[-1] * x - beta * before
    beside = betas[1:]
    matrix = np.diag(alphas) + np.diag(beside, 1) + np.diag(beside, -1)
    return float(np.linalg.eigvalsh(matrix)[-1]) if alphas else 1.0


def _applied(blocks: Array, x: Array) -> Array:
    """Blocks (n, 3, 3) times x (n, 3)."""
    return np.asarray(np.matmul(blocks, x[:, :, None])[:, :, 0])
