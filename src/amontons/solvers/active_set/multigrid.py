"""Multigrid cycles for the linear problems of active set methods, after [HSW] section 4.

The rows of the contact nodes carry the conditions of the active sets in the local basis,

    F^T G_r F (M v - f) / a^2 + F^T G_u (F v + w) = F^T b,

F = frames, a the length of their columns (1 but where nodes bear the share of others), which
keeps every node block 3x3 and couples a contact to no new node: block
Gauss-Seidel respects Dirichlet, Robin and natural conditions alike.  Coarse levels are Galerkin
products with test and trial functions that vanish in the Dirichlet directions of the finest
level.  Only what couples to those directions changes from step to step:

    P~^T (M + L) P~ = P^T M P - X - X^T + P~^T L P~,   P~ = P - Q P,
    X = (Q P)^T M P - (Q P)^T M (Q P) / 2,             Q = projection onto Dirichlet directions,

and the levels below take P^T of the difference.

[HSW]: see `conditions`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from threading import Lock

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ...core.options import check_options
from ...linear.coarsest import pseudo_inverse
from ...linear.hierarchy import Hierarchy, Nodes
from ...linear.level_matrix import LevelMatrix
from ...linear.node_blocks import NodeBlocks, block_inverse
from ...problem.one_sided import HELD, OneSided
from ..contract import check_at_least
from .conditions import Conditions

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class CycleShape(Enum):
    """Order in which the levels are visited."""

    V = "v"
    W = "w"
    F = "f"


@dataclass(frozen=True)
class MultigridCycle:
    """Geometric multigrid: shape of the cycle, and symmetric Gauss-Seidel sweeps on each side.

    The default is that of [HSW].  Without levels in the problem they are made algebraically.
    """

    shape: CycleShape = CycleShape.W
    smoothing: int = 3  # symmetric block Gauss-Seidel sweeps before and after, each

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, smoothing=self.smoothing)


@dataclass(eq=False)
class Contacts:
    """Where contacts sit among node blocks: node (nc,), frames (nc, 3, 3) on the padded node.

    squared (nc, 1, 1): the length of their columns, squared; idle (nc, 3): components of those
    nodes that are no unknowns.
    """

    node: Index
    frames: Array
    squared: Array
    idle: NDArray[np.bool_]

    @classmethod
    def of(cls, basis: OneSided, nodes: Nodes) -> Contacts:
        """From dofs and frames of the one-sided basis."""
        nc, d = basis.dofs.shape
        frames = np.zeros((nc, 3, 3))
        place = np.where(basis.dofs == HELD, 0, nodes.place[basis.dofs])
        contact, slot = np.nonzero(basis.dofs != HELD)
        component = place[contact, slot] % 3
        frames[contact, :d, component] = basis.frames[contact, :, slot]
        idle = np.ones((nc, 3), dtype=bool)
        idle[contact, component] = False
        return cls(place[:, 0] // 3, frames, basis.scale[:, None, None] ** 2, idle)

    def to_nodes(self, blocks: Array) -> Array:
        """F^T blocks F, (nc, 3, 3), of local blocks (nc, d, d): forces by displacements."""
        d = blocks.shape[1]
        F = self.frames[:, :d]
        return np.einsum("kai,kab,kbj->kij", F, blocks, F)

    def among_nodes(self, blocks: Array) -> Array:
        """F^T blocks F^-T, (nc, 3, 3): forces by forces, or displacements by displacements."""
        return self.to_nodes(blocks) / self.squared


class ContactCycles:
    """The linear problem of one step after another, and multigrid cycles for it.

    All solves of a problem share it: `set` and the cycles that follow need `lock`.
    """

    def __init__(self, basis: OneSided, component: Index | None) -> None:
        """component (n,): directions of the unknowns, node by node."""
        if component is None:
            raise InvalidInput("near_nullspace: multigrid needs translations among its columns")
        self.lock = Lock()
        self.nodes = Nodes.of(component)
        place = None if self.nodes.plain else self.nodes.place
        A = NodeBlocks.from_sparse(basis.M, place, self.nodes.count)
        given = Hierarchy.of(A, component, basis.levels, basis.near_nullspace)
        self.levels, self.coarse_inverse = given.levels, given.coarse_inverse
        self.matrices = [level.A.stored() for level in self.levels]
        self.plain = [A.data.copy() for A in self.matrices[1:]]
        self.contacts = Contacts.of(basis, self.nodes)
        self._prepare_rows()
        self._prepare_galerkin()

    # ------------------------------------------------------------------ finest level
    def _prepare_rows(self) -> None:
        """The original rows of the contact nodes, and where they are stored."""
        A, node = self.matrices[0], self.contacts.node
        self.stored, ends = A.slots(node)
        self.owner = np.repeat(np.arange(len(node)), np.diff(ends))
        self.rows = A.data[self.stored].copy()
        self.own = np.flatnonzero(A.indices[self.stored] == node[self.owner])
        self.size = np.abs(self.rows[self.own]).max(axis=(1, 2), initial=0.0)
        self.none_held = np.zeros(A.nodes, dtype=bool)

    def set(self, given: Conditions, f: Array, w: Array) -> None:
        """Take over the conditions of a step; f (n,) load, w (nc, d) constant part of u."""
        A, contacts = self.matrices[0], self.contacts
        K, U = contacts.among_nodes(given.G_r), contacts.to_nodes(given.G_u)
        U[:, range(3), range(3)] += contacts.idle * self.size[:, None]
        scale = self.size[:, None, None]  # Dirichlet rows in the unit of the others
        U += (scale - 1) * contacts.to_nodes(self._dirichlet(given)[:, :, None] * given.G_u)
        rows = np.matmul(K[self.owner], self.rows)
        rows[self.own] += U
        A.data[self.stored] = rows
        A.inverse[contacts.node] = np.linalg.inv(rows[self.own])
        force = given.b - np.einsum("kij,kj->ki", given.G_u, w)
        force *= np.where(self._dirichlet(given), self.size[:, None], 1.0)
        d = w.shape[1]
        self.b = self.nodes.spread(f)
        self.b[contacts.node] = np.einsum("kij,kj->ki", K, self.b[contacts.node])
        self.b[contacts.node] += np.einsum("kai,ka->ki", contacts.frames[:, :d], force)
        self._update_coarse(given)

    @staticmethod
    def _dirichlet(given: Conditions) -> NDArray[np.bool_]:
        """Local directions in which a displacement is prescribed, (nc, d)."""
        return np.einsum("kii->ki", given.G_r) == 0

    # ------------------------------------------------------------------ coarse levels
    def _prepare_galerkin(self) -> None:
        """What the difference of the coarse matrices is made of: P and M on contact rows."""
        self.prolongations = [
            level.P.masked() for level in self.levels if level.P is not None
        ]
        if not self.prolongations:
            return
        A, nodes = self.matrices[0], self.contacts.node
        size = 3 * A.nodes
        M = sparse.bsr_array((A.data, A.indices, A.indptr), shape=(size, size))
        self.unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
        rows = M.tocsr()[self.unknowns]
        self.P = self.prolongations[0][self.unknowns]
        self.MP = sparse.csr_array(rows @ self.prolongations[0])
        self.M_contact = sparse.csr_array(rows[:, self.unknowns])

    def _update_coarse(self, given: Conditions) -> None:
        """Galerkin matrices of this step, from the differences to the plain ones."""
        if not self.prolongations:  # small enough to be solved at once
            self.coarse_inverse = pseudo_inverse(self.matrices[0].dense())
            return
        fixed = self._dirichlet(given)
        identity = np.eye(fixed.shape[1])
        self.projection = self.contacts.among_nodes(fixed[:, :, None] * identity)
        Q = _blocks(self.projection)
        QP = Q @ self.P
        X = QP.T @ (self.MP - 0.5 * (self.M_contact @ QP))
        free = ~fixed
        L = self.contacts.to_nodes(free[:, :, None] * given.G_u * free[:, None, :])
        truncated = self.P - QP
        delta = sparse.csr_array(truncated.T @ (_blocks(L) @ truncated) - X - X.T)
        for k, A in enumerate(self.matrices[1:]):
            if k:
                P = self.prolongations[k]
                delta = sparse.csr_array(P.T @ (delta @ P))
            _add_blocks(A, self.plain[k], delta)
        self.coarse_inverse = pseudo_inverse(self.matrices[-1].dense())

    # ------------------------------------------------------------------ cycles
    def cycle(self, x: Array, option: MultigridCycle) -> float:
        """One cycle in place on x, (nodes, 3); returns the residual after it over that of 0."""
        self._visit(0, self.b, x, option.shape, option.smoothing)
        return self.residual(x)

    def residual(self, x: Array) -> float:
        """|b - A x| / |b| of the linear problem."""
        r = self.levels[0].work.r
        self.matrices[0].residual(x, self.b, r)
        return float(np.linalg.norm(r) / max(np.linalg.norm(self.b), 1e-300))

    def _visit(self, k: int, b: Array, x: Array, shape: CycleShape, sweeps: int) -> None:
        level = self.levels[k]
        if level.P is None:
            x[:] = (self.coarse_inverse @ b.reshape(-1)).reshape(-1, 3)
            return
        A, r, coarse, below = level.A, level.work.r, self.levels[k + 1], self.levels[k + 1].work
        self._smooth(A, b, x, sweeps)
        A.residual(x, b, r)
        self._keep_free(k, r)
        level.P.restrict(r, below.b)
        below.x[:] = 0.0
        self._visit(k + 1, below.b, below.x, shape, sweeps)
        if shape is not CycleShape.V and coarse.P is not None:
            again = CycleShape.W if shape is CycleShape.W else CycleShape.V
            self._visit(k + 1, below.b, below.x, again, sweeps)
        r[:] = 0.0
        level.P.add(below.x, r)
        self._keep_free(k, r)
        x += r
        self._smooth(A, b, x, sweeps)

    def _keep_free(self, k: int, values: Array) -> None:
        """On the finest level, leave out the Dirichlet directions of the contact nodes."""
        if k == 0:
            node = self.contacts.node
            values[node] -= np.einsum("kij,kj->ki", self.projection, values[node])

    def _smooth(self, A: LevelMatrix, b: Array, x: Array, sweeps: int) -> None:
        held = self.none_held[: A.nodes]
        for _ in range(sweeps):
            A.smooth(b, x, held, False)
            A.smooth(b, x, held, True)


def _blocks(blocks: Array) -> sparse.csr_array:
    """A block diagonal matrix."""
    k = len(blocks)
    tiles = sparse.bsr_array((blocks, np.arange(k), np.arange(k + 1)), shape=(3 * k, 3 * k))
    return sparse.csr_array(tiles)


def _add_blocks(A: NodeBlocks, plain: Array, delta: sparse.csr_array) -> None:
    """Set A to its plain values plus a difference within its pattern."""
    tiles = delta.tobsr((3, 3))
    n = A.nodes
    key = np.repeat(np.arange(n), np.diff(A.indptr)) * n + A.indices
    wanted = np.repeat(np.arange(n), np.diff(tiles.indptr)) * n + tiles.indices
    where = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
    known = key[where] == wanted  # the rest are zeros that a product has stored
    where, values = where[known], tiles.data[known]
    A.data[:] = plain
    np.add.at(A.data, where, values)
    diagonal = A.diagonal()
    size = np.abs(plain[diagonal]).max(axis=(1, 2), initial=0.0)
    A.inverse = block_inverse(A.data[diagonal], size)
