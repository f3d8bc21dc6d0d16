"""Levels of smoothed aggregation below a matrix of node blocks, with aggregates of one part.

Parts are pieces of bodies that hang together without contact.  Where contact couples nodes of
two parts, every aggregate still keeps to one of them, so that coarse levels hold the rigid
motions of each on its own: what slides or opens does not have to be resolved by the finest.
The matrix need not be symmetric: restriction is the transpose of prolongation all the same.

All is deterministic: the spectral radius for the damping of prolongations comes from a few
power iterations with a given start.

[VMB] P. Vanek, J. Mandel, M. Brezina, "Algebraic multigrid by smoothed aggregation for second
and fourth order elliptic problems", Computing 56 (1996).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator
from .hierarchy import COARSEST, Hierarchy, Level, Nodes
from .node_blocks import NodeBlocks
from .transfer import Transfer

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DAMPING = 4 / 3  # over the spectral radius, [VMB]
POWERS = 10  # iterations for the spectral radius, which they miss from below by some percent
MISSED = 1.1  # by which it is taken larger
LARGEST = 400  # nodes of a coarsest level that is inverted; more do not coarsen


def aggregated(A: NodeBlocks, nodes: Nodes, modes: Array, part: Index) -> Hierarchy:
    """All levels below A; modes (3 nodes, k): near-nullspace, part (nodes,): of each node.

    Raises SingularOperator where nodes do not gather into few.
    """
    levels, idle = [Level(A)], nodes.idle
    modes = np.column_stack([modes, np.zeros((len(modes), -modes.shape[1] % 3))])
    together = 1  # nodes that share an aggregate's modes, and are gathered together
    while A.nodes > COARSEST:
        groups, part = _gathered(A, together, part)
        if groups.shape[1] * modes.shape[1] >= 3 * A.nodes:
            break
        P, modes = _prolongation(A, groups, modes)
        levels[-1].P = Transfer.of(P, idle, np.empty(0, dtype=np.int64))
        A = levels[-1].P.galerkin(A)
        levels.append(Level(A))
        idle, together = np.empty(0, dtype=np.int64), modes.shape[1] // 3
    if A.nodes > LARGEST:
        raise SingularOperator(f"multigrid: {A.nodes} nodes do not gather into fewer")
    return Hierarchy(levels, 1, nodes)


def _gathered(A: NodeBlocks, together: int, part: Index) -> tuple[sparse.csr_array, Index]:
    """Aggregates (groups of nodes, aggregates) within parts, and the parts of these."""
    from pyamg.aggregation import standard_aggregation

    n = A.nodes // together
    row = np.repeat(np.arange(A.nodes), np.diff(A.indptr)) // together
    column = A.indices // together
    same = part[row] == part[column]
    entries = (np.ones(np.count_nonzero(same)), (row[same], column[same]))
    found, _ = standard_aggregation(sparse.csr_matrix(entries, shape=(n, n)))
    groups = sparse.csr_array(found)
    own = np.zeros(groups.shape[1], dtype=np.int64)
    own[groups.indices] = part[np.repeat(np.arange(n), np.diff(groups.indptr))]
    return groups, own


def _prolongation(
    A: NodeBlocks, groups: sparse.csr_array, modes: Array
) -> tuple[sparse.bsr_array, Array]:
    """(I - w D^-1 A) T in blocks, T the modes on every aggregate, and the coarse modes."""
    from pyamg.aggregation import fit_candidates

    T, coarse = fit_candidates(sparse.csr_matrix(groups), modes)
    n = 3 * A.nodes
    tiles = sparse.bsr_array((A.data, A.indices, A.indptr), shape=(n, n))
    diagonal = tiles.diagonal()
    inverse = 1 / np.where(diagonal > 0, diagonal, np.inf)
    x = np.cos(np.arange(n, dtype=float)).reshape(-1, 3)
    y, radius = np.empty_like(x), 1.0
    for _ in range(POWERS):
        A.times(x, y)
        y *= inverse.reshape(-1, 3)
        radius = float(np.linalg.norm(y) / np.linalg.norm(x))
        x = y / np.linalg.norm(y)
    T = sparse.bsr_array(T.tobsr((3, 3)))
    weights = sparse.diags_array(DAMPING / (MISSED * radius) * inverse)
    smooth = (weights @ (tiles @ T).tocsr()).tobsr((3, 3))
    return sparse.bsr_array(T - smooth).tobsr((3, 3)), coarse
