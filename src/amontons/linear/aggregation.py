"""Coarse levels where a mesh has none: smoothed aggregation for rigid motions.

Nodes that touch make an aggregate, whose unknowns are the amplitudes of the k near-null motions
on it, orthonormalised there; the prolongation is smoothed by one damped block Jacobi step,

    P = (I - omega D^-1 A) T,    omega = 4/3 / rho(D^-1 A)                            [VMB]

with T those motions cut up.  Aggregates and T are made by pyamg; rho is estimated from a fixed
start, so that the same matrix always has the same levels, to the last bit.

Nodes i and j do not touch where |A_ij|^2 < WEAK^2 m_i m_j, m_i the largest |A_il| with l not i:
an aggregate must not bridge the soft layer between two stiff ones, which move on their own.
Couplings are not compared with diagonal blocks, which hold the ones of padding.

An aggregate is a unit of k / 3 block rows that stay together.  Where nodes have parts (pieces
of bodies that hang together without contact), an aggregate keeps to one of them, so that
coarse levels hold the rigid motions of each on its own: what slides or opens does not have to
be resolved by the finest.  A with parts need not be symmetric: restriction is P^T all the same.

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
from .products import product
from .transfer import Transfer
from .vectors import dot, norm

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEPS = 12  # of Lanczos's method for rho, or of the power iteration: within some per cent
MISSED = 1.1  # by which rho is taken larger after power iterations, which come from below
OMEGA = 4 / 3
LARGEST = 600  # block rows that are inverted whole at most
JUMP = 50.0  # of couplings from node to node at which parts move on their own
RANK = 6  # of the coupling that stands for a node: of the largest ones some are of flat cells
WEAK = 0.05  # couplings below this part of the largest ones of both units join nothing


@dataclass(frozen=True, eq=False)
class Aggregates:
    """What the next coarser level is made of: modes (3 nodes, k), block rows of a unit.

    part (units,): of each unit, None where aggregates may join all and A is symmetric.
    """

    modes: Array
    width: int = 1
    part: Index | None = None

    def coarsen(self, A: NodeBlocks) -> tuple[Transfer, Aggregates] | None:
        """Prolongation to aggregates of units of A, and the same of them; None without any.

        Units without neighbours are left out, also where there are no others: many of these,
        on the coarsest level, would be inverted together.
        """
        from pyamg.aggregation import fit_candidates, standard_aggregation

        graph = _strong(A, self.width)
        if self.part is not None:
            graph = _within(graph, self.part)
        joined, _ = standard_aggregation(graph)
        if joined.shape[1] >= graph.shape[0] or not (joined.nnz or A.nodes > LARGEST):
            return None
        columns = -self.modes.shape[1] % 3
        modes = np.column_stack([self.modes, np.zeros((len(self.modes), columns))])
        if not joined.nnz:
            return self._nothing(A.nodes, modes.shape[1])
        pieces, coarse = fit_candidates(joined, modes)
        T = sparse.bsr_array(sparse.bsr_array(pieces).tobsr((3, 3)))
        rho = _by_lanczos(A) if self.part is None else MISSED * _by_powers(A)
        P = _smoothed(A, T, OMEGA / rho)
        idle = np.flatnonzero(np.einsum("kii->ki", A.diagonal_blocks).ravel() == 0)
        transfer = Transfer.of(P, idle, np.empty(0, dtype=np.int64))
        width = modes.shape[1] // 3
        return transfer, Aggregates(np.asarray(coarse), width, self._part_of(joined))

    def _part_of(self, joined: sparse.csr_array) -> Index | None:
        """The parts of aggregates, from the units (units, aggregates) that they join."""
        if self.part is None:
            return None
        out = np.zeros(joined.shape[1], dtype=np.int64)
        units = np.repeat(np.arange(joined.shape[0]), np.diff(joined.indptr))
        out[joined.indices] = self.part[units]
        return out

    def _nothing(self, nodes: int, count: int) -> tuple[Transfer, Aggregates]:
        """A next level of one unit that gets nothing and gives nothing."""
        width, none = count // 3, np.empty(0, dtype=np.int64)
        pointers = np.minimum(np.arange(nodes + 1), width)
        zero = (np.zeros((width, 3, 3)), np.arange(width), pointers)
        tiles = sparse.bsr_array(zero, shape=(3 * nodes, 3 * width))
        part = None if self.part is None else np.zeros(1, dtype=np.int64)
        below = Aggregates(np.zeros((3 * width, count)), width, part)
        return Transfer.of(tiles, none, none), below

    def renumbered(self, number: Index | None) -> Aggregates:
        """The same with block rows of other numbers, (nodes,); units stay together."""
        if number is None:
            return self
        order = np.argsort(number)
        modes = self.modes.reshape(len(number), 3, -1)[order].reshape(self.modes.shape)
        part = None if self.part is None else self.part[order[:: self.width] // self.width]
        return Aggregates(modes, self.width, part)


def separates(A: NodeBlocks) -> bool:
    """True where the stiffness jumps from node to node, or soft cells part strong couplings.

    Jumps are those of the largest coupling of a node and of the sixth largest, of few ones of
    that in the middle: a flat cell makes a few as large as one likes, stiff material makes most
    of them so.  The largest come first, as sorting takes longer than all else.
    """
    from scipy.sparse import csgraph

    row, column, squares, largest = _couplings(A, 1)
    if _jumps(row, column, largest) and _jumps(row, column, _ranked(A, squares)):
        return True
    whole = sparse.csr_matrix((squares > 0, A.indices, A.indptr), shape=(A.nodes,) * 2)
    strong = sparse.csr_matrix(_strong(A, 1))
    count = csgraph.connected_components
    return bool(count(strong, directed=False)[0] > count(whole, directed=False)[0])


def _jumps(row: Index, column: NDArray[np.integer], size: Array) -> bool:
    """True where squares of a node are JUMP^2 times those of one that it is coupled with."""
    known = size[column] > 0
    return bool((size[row[known]] / size[column[known]]).max(initial=0.0) > JUMP**2)


def _ranked(A: NodeBlocks, squares: Array) -> Array:
    """The coupling of every node of which RANK - 1 others are larger, or half of them."""
    others = np.diff(A.indptr) - 1
    rank = np.minimum(RANK, (others + 1) // 2)  # its own is the largest
    row = np.repeat(np.arange(A.nodes), np.diff(A.indptr))
    descending = squares[np.lexsort((-squares, row))]
    return np.where(rank > 0, descending[A.indptr[:-1] + rank], 0.0)


def _strong(A: NodeBlocks, width: int) -> sparse.csr_array:
    """The graph of units of `width` block rows with the couplings that are not WEAK."""
    return strong_graph(*_couplings(A, width))


def strong_graph(
    row: NDArray[np.integer], column: NDArray[np.integer], squares: Array, largest: Array
) -> sparse.csr_array:
    """The graph of units (units,) with couplings of squares (k,) that are not WEAK.

    largest (units,): of the squares of each, but its own.
    """
    strong = squares >= WEAK**2 * np.sqrt(largest[row] * largest[column])
    kept = (np.ones(np.count_nonzero(strong)), (row[strong], column[strong]))
    return sparse.csr_array(sparse.coo_array(kept, shape=(len(largest),) * 2))


def _couplings(A: NodeBlocks, width: int) -> tuple[Index, NDArray[np.integer], Array, Array]:
    """(row, column, |A_ij|^2) of units of `width` block rows, and the largest of each row.

    The largest one is of other units, and couplings of a unit with itself count as infinite.
    """
    graph = units_of(A.indptr, A.indices, width)
    squares = np.einsum("kij,kij->k", A.data, A.data)
    if width > 1:
        unit = np.arange(A.nodes) // width
        at = np.repeat(unit, np.diff(A.indptr)), unit[A.indices]
        whole = sparse.coo_array((squares, at), shape=graph.shape).tocsr()
        whole.sort_indices()
        squares = whole.data  # a product of matrices would leave out what is zero
    row = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
    own = row == graph.indices
    largest = np.maximum.reduceat(np.where(own, 0.0, squares), graph.indptr[:-1])
    return row, graph.indices, np.where(own, np.inf, squares), largest


def _within(graph: sparse.csr_array, part: Index) -> sparse.csr_array:
    """Only what couples units of one part."""
    entries = graph.tocoo()
    row, column = entries.coords
    same = part[row] == part[column]
    kept = (entries.data[same], (row[same], column[same]))
    return sparse.csr_array(sparse.coo_array(kept, shape=graph.shape))


def _smoothed(A: NodeBlocks, T: sparse.bsr_array, omega: float) -> sparse.bsr_array:
    """T - omega D^-1 A T."""
    n = 3 * A.nodes
    scaled = np.matmul(np.repeat(A.inverse, np.diff(A.indptr), axis=0), A.data)
    matrix = sparse.bsr_array((scaled, A.indices, A.indptr), shape=(n, n))
    step = product(matrix, T)
    step.data *= -omega
    return sparse.bsr_array((T + step).tobsr((3, 3)))


def _by_powers(A: NodeBlocks) -> float:
    """The size of D^-1 A, D the diagonal blocks, by power iterations."""
    x = np.cos(np.arange(3.0 * A.nodes)).reshape(-1, 3)
    y, size = np.empty_like(x), norm(x)
    rho = 0.0
    for _ in range(STEPS):
        A.times(x, y)
        x = _applied(A.inverse, y)
        grown = norm(x)
        if not 0 < grown < np.inf:
            return 1.0
        rho, size = grown / size, 1.0
        x /= grown
    return rho


def _by_lanczos(A: NodeBlocks) -> float:
    """The same of a symmetric A, by Lanczos's method in the product of D."""
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
