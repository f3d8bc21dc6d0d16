"""Contact nodes of a mesh: exact local solves in sweeps, the natural map, and the tangent.

At a contact node p with v = y + A_pp^-1 H r, where A_pp y is the load minus the forces of the
neighbours,

    u = W r + b,    W = H^T A_pp^-1 H,    b = H^T y + w

is the problem of a single contact, which `one_contact` solves exactly.

The tangent at the states found, in the displacements of the node, n and T the columns of H:

    state                trial V        test W                               added L
    open                 1              1                                    0
    closed, stick        0              0                                    0
    closed, slip         1 - n n^T      V + n (mu t^T V) / (|n| - mu t.n)    (bound / |u_T|)
                                                                             T (1 - t t^T) T^T
    open, Tresca slip    1              1                                    the same
    open, Tresca stick   n n^T          n n^T                                0
    closed, slip, given  1 - n n^T      V                                    the same

t: direction of slip as a vector of the node.  The test space of Coulomb slip holds all
directions in which a force r_N (n - mu t) does no work.  Where the bound is given, under
Tresca's law and at a cap (`Law.given`), W = V.

A tangent that a support drives (`driven`) has no column in H and no row in W; its part of r
moves nothing and is the friction that the law gives for u.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.threads import Range, over_rows, over_stages
from ...linear.chunks import chunks_among
from ...linear.hierarchy import Nodes
from ...linear.level_matrix import LevelMatrix
from ...linear.node_blocks import NodeBlocks
from ...linear.some_rows import SomeRows, residual_rows
from ...linear.vectors import norm, norms_of
from ...problem.judge.measures import contact_residual
from ...problem.law import Kind, Law, Tied, Tresca
from ...problem.law.law import BOUND, MU, columns_of, given
from ...problem.law.mixed import of_kinds
from ...problem.law.states import OPEN, SLIP, STICK
from ...problem.one_sided import HELD, OneSided
from ..driven import moves
from .visits import CLOSED, sweep_contacts

Array = NDArray[np.float64]
Index = NDArray[np.int64]
CONTACT_WORK = 150.0  # of the solution of a contact, in numbers that a sweep touches
HALVINGS = 10  # of the interval of a step length
STIFF = 1e3  # L stays below this multiple of the node's own stiffness


@dataclass(eq=False)
class ContactNodes:
    """Contacts at nodes: node (nc,), H (nc, 3, 3), w (nc, 3), and their law.

    inverse, compliance, to_reaction (nc, 3, 3): A_pp^-1, H^T A_pp^-1 H and H^-1; rho (nc,): of
    the judge; rows: indptr, columns and blocks of their rows of the matrix; near: those of the
    nodes that they touch; chunks of contacts, which threads share; others: how many other nodes
    there are, where these are the first and contacts the last; bulk: their rows.  State of the
    iteration: r, u (nc, 3), and state (nc,) of the last local solves.
    """

    node: Index
    H: Array
    inverse: Array
    compliance: Array
    to_reaction: Array
    rho: Array
    rows: tuple[NDArray[np.int32], NDArray[np.int32], Array]
    near: SomeRows
    chunks: list[Range]
    others: int | None = None
    bulk: NodeBlocks | None = None
    w: Array = field(default_factory=lambda: np.zeros((0, 3)))
    law: Law = field(default_factory=lambda: Tresca(np.zeros(0)))
    driven: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 3), dtype=bool))
    r: Array = field(init=False)
    u: Array = field(init=False)
    state: NDArray[np.int8] = field(init=False)

    def __post_init__(self) -> None:
        self.r, self.u = np.zeros((len(self.node), 3)), np.zeros((len(self.node), 3))
        self.state = np.full(len(self.node), -1, dtype=np.int8)

    @classmethod
    def at_nodes(cls, node: Index, H: Array, A: LevelMatrix) -> ContactNodes:
        """Contacts without a law at nodes of a level with matrix A."""
        rows = A.rows(node)
        inverse = rows.inverse
        compliance = np.einsum("kai,kab,kbj->kij", H, inverse, H)
        size = np.linalg.norm(compliance, 2, axis=(1, 2)) if len(node) else np.zeros(0)
        k, i = np.nonzero(np.abs(H).max(axis=1, initial=0.0) == 0)  # the second tangent in 2D
        compliance[k, i, i] = 1.0
        back: Any = np.linalg.pinv(H)
        near = SomeRows.of(A, np.setdiff1d(rows.indices, node).astype(np.int64))
        others = _others(A.nodes, near.node, node) if isinstance(A, NodeBlocks) else None
        bulk = A.leading(others) if isinstance(A, NodeBlocks) and others is not None else None
        return cls(node, H, inverse, compliance, back, 1 / size,
                   (rows.indptr, rows.indices, rows.data), near,
                   chunks_among(node, rows.indptr, rows.indices), others, bulk)  # fmt: skip

    def at(self, chosen: NDArray[np.bool_], node: Index, A: LevelMatrix) -> ContactNodes:
        """Some of the contacts at nodes (k,) of another level."""
        return ContactNodes.at_nodes(node, self.H[chosen], A)

    def under(self, law: Law, w: Array, rho: Array) -> ContactNodes:
        """The contacts with a law and gaps, without states."""
        driven = (np.abs(self.H).max(axis=1, initial=0.0) == 0) & moves(w)
        compliance = self.compliance
        if driven.any():
            compliance = compliance.copy()
            k, i = np.nonzero(driven)
            compliance[k, i, i] = 0.0
        return replace(self, w=w, law=law, rho=rho, driven=driven, compliance=compliance)

    @classmethod
    def of(cls, basis: OneSided, nodes: Nodes, A: LevelMatrix) -> ContactNodes | None:
        """From the one-sided basis; None where a contact is spread over several nodes."""
        nc, d = basis.dofs.shape
        held = basis.dofs == HELD
        place = nodes.place[np.where(held, basis.dofs[:, :1], basis.dofs)]
        node = place[:, 0] // 3
        if (place // 3 != node[:, None]).any() or len(np.unique(node)) < nc:
            return None
        H = np.zeros((nc, 3, 3))
        for slot in range(d):
            rows = np.flatnonzero(~held[:, slot])
            H[rows, place[rows, slot] % 3, :d] = basis.frames[rows, :, slot]
        return cls.at_nodes(node, H, A)

    def sweep(self, f: Array, x: Array, backward: bool = False) -> None:
        """Solve every contact once in turn; r, u and state are those of these solves."""
        work = 10.0 * len(self.rows[1]) + CONTACT_WORK * len(self.node)
        over_stages(
            sweep_contacts, self.chunks, work, *self.rows, self.node, self.H, self.inverse,
            self.compliance, self.w, self.law.kind, self.law.parameters, f, x, self.r, self.u,
            self.state, backward, backward=backward,
        )  # fmt: skip

    def relax(
        self, f: Array, x: Array, held: NDArray[np.bool_], backward: bool, once: bool = False
    ) -> None:
        """`sweep`, a sweep over the nodes that contacts touch, and `sweep` again.

        held (nodes,): the contact nodes.  What the first sweep leaves there would be all that
        the next level sees of the bulk: most of the residual where such rows are strongly
        coupled, as those of the nodes of a master surface are in the one-sided basis.
        once: one sweep over the contacts and no other.
        """
        if not once:
            self.sweep(f, x, backward)
            self.near.smooth(f, x, held, backward)
        self.sweep(f, x, backward)

    def residual(self, f: Array, x: Array, out: Array) -> None:
        """out = f - A x in all rows that a sweep over the contacts changes."""
        self.own_residual(f, x, out)
        self.near.residual(x, f, out)

    def own_residual(self, f: Array, x: Array, out: Array) -> None:
        """The same in their own rows."""
        work = 10.0 * len(self.rows[1])
        over_rows(residual_rows, len(self.node), work, self.node, *self.rows, x, f, out)

    def natural_map(self, x: Array, residual: Array) -> float:
        """|natural map / rho|, unit of u, with r from the residual f - A x of the nodes.

        r and u are set; unlike in `sweep` they are those of one state x.
        """
        return _natural_map(
            self.node, self.H, self.to_reaction, self.w, self.law.kind, self.law.parameters,
            self.rho, self.driven, x, residual, self.r, self.u,
        )  # fmt: skip

    def balance(self, residual: Array, kind: NDArray[np.int8]) -> tuple[float, float]:
        """|residual| in the rows of all nodes but their own, and of those BESIDE alone."""
        if self.others is None:
            return norms_of(residual, kind)
        first, end = self.others, len(residual) - len(self.node)
        near = norm(residual[first:end])
        return float(np.hypot(norm(residual[:first]), near)), near

    @cached_property
    def stiffness(self) -> Array:
        """Size of the node's own one, (nc,), unit of A."""
        return 1 / np.abs(self.inverse).max(axis=(1, 2), initial=np.finfo(float).tiny)

    def tangent(self) -> tuple[Array, Array, Array]:
        """V, W and L, each (nc, 3, 3), at the present states."""
        V, W, L = (np.empty_like(self.H) for _ in range(3))
        size = STIFF * self.stiffness
        _tangent(self.H, self.law.kind, self.law.parameters, self.r, self.u, self.state, size,
                 V, W, L)  # fmt: skip
        return V, W, L

    def limit(self, V: Array, before: Array, x: Array) -> None:
        """Keep of the motion since `before`, (nc, 3), what the tangent holds for.

        That is what its trial space V allows, and of a slip up to where it would turn round:
        there friction jumps by twice its bound, of which the tangent knows nothing.
        """
        _limit(self.node, self.H, self.to_reaction, self.w, self.law.kind,
               self.law.parameters, self.r, self.u, self.state, V, before, x)  # fmt: skip

    def frozen(self) -> ContactNodes:
        """The same states under Tresca's law with the present bounds; ties as they are."""
        if isinstance(self.law, Tresca | Tied):
            return self
        kind = np.where(self.law.tied, Kind.TIED, Kind.TRESCA).astype(np.int8)
        law = of_kinds(kind, columns_of(0.0, self.law.bound(self.r), len(kind)))
        out = replace(self, law=law)
        out.r, out.u, out.state = self.r, self.u, self.state
        return out

    def lift(self, x: Array) -> None:
        """Move nodes that penetrate to the surface, along the normal."""
        n = self.H[:, :, 0]
        gap = self.w[:, 0] + np.einsum("ca,ca->c", n, x[self.node])
        x[self.node] -= (np.minimum(gap, 0.0) / np.einsum("ca,ca->c", n, n))[:, None] * n

    def step_length(self, step: Array, force: float, stiffness: float) -> float:
        """Length, up to 1, at which the energy along a step (nodes, 3) is least.

        E'(a) = a stiffness - force + sum of bound |u_T + a d_T|'; under Tresca's law.
        """
        d = np.einsum("cai,ca->ci", self.H[:, :, 1:], step[self.node])
        bound = np.where(self.law.tied, 0.0, self.law.bound(self.r))

        def slope(a: float) -> float:
            u = self.u[:, 1:] + a * d
            size = np.linalg.norm(u, axis=1)
            work = np.einsum("ci,ci->c", u, d) / np.where(size > 0, size, 1.0)
            return a * stiffness - force + float(bound @ work)

        if slope(1.0) <= 0:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if slope(middle) > 0 else (middle, high)
        return low

    def combine(self, W: Array, residual: Array) -> None:
        """The rows of contacts become W^T of (law's force - force), in place."""
        _combine(self.node, self.H, self.law.kind, self.law.parameters, self.r, self.u,
                 self.state, W, residual)  # fmt: skip


def _others(nodes: int, near: Index, node: Index) -> int | None:
    """How many nodes are neither, where those are the last, contacts behind."""
    first, contact = nodes - len(near) - len(node), nodes - len(node)
    last = near.min(initial=first) == first and node.min(initial=contact) == contact
    return first if last else None


@njit(cache=True, error_model="numpy")
def _natural_map(  # noqa: PLR0913
    node, H, to_reaction, w, kind, parameters, rho, driven, x, residual, r, u
):
    total = 0.0
    for c in range(len(node)):
        p = node[c]
        for i in range(3):
            s = w[c, i]
            force = 0.0
            for a in range(3):
                s += H[c, a, i] * x[p, a]
                force -= to_reaction[c, i, a] * residual[p, a]
            u[c, i] = s
            r[c, i] = force
        if driven[c, 1] or driven[c, 2]:
            bound = parameters[c, MU] * max(r[c, 0], 0.0)
            if given(kind[c], parameters[c], r[c, 0]):
                bound = parameters[c, BOUND]
            slip = np.sqrt(u[c, 1] ** 2 + u[c, 2] ** 2)
            for i in range(1, 3):
                if driven[c, i] and slip > 0.0:
                    r[c, i] = -bound * u[c, i] / slip
        if rho[c] > 0.0:
            e0, e1, e2 = contact_residual(
                r[c, 0], r[c, 1], r[c, 2], u[c, 0], u[c, 1], u[c, 2], rho[c], kind[c],
                parameters[c],
            )  # fmt: skip
            total += max(e0 * e0 + e1 * e1 + e2 * e2, 0.25 * min(u[c, 0], 0.0) ** 2)
    return np.sqrt(total)


@njit(cache=True, error_model="numpy")
def _slip_vector(H, u):
    """(t as a vector of the node, t1, t2, |u_T|); zero where nothing slips."""
    t = np.zeros(3)
    size = np.sqrt(u[1] * u[1] + u[2] * u[2])
    if size == 0.0:
        return t, 0.0, 0.0, 0.0
    t1, t2 = u[1] / size, u[2] / size
    for a in range(3):
        t[a] = H[a, 1] * t1 + H[a, 2] * t2
    return t, t1, t2, size


@njit(cache=True, error_model="numpy")
def _bound(kind, parameters, r):
    """The bound of friction of a contact, not positive where it has none."""
    return parameters[BOUND] if given(kind, parameters, r[0]) else parameters[MU] * r[0]


@njit(cache=True, error_model="numpy")
def _tangent(H, kind, parameters, r, u, state, size, V, W, L):  # noqa: PLR0913
    V[:], W[:], L[:] = 0.0, 0.0, 0.0
    n = np.empty(3)
    for c in range(len(H)):
        closed, motion = state[c] >= CLOSED, state[c] % CLOSED
        length = np.sqrt(H[c, 0, 0] ** 2 + H[c, 1, 0] ** 2 + H[c, 2, 0] ** 2)
        for a in range(3):
            n[a] = H[c, a, 0] / length
        for a in range(3):
            for b in range(3):
                one = 1.0 if a == b else 0.0
                if motion == STICK:
                    V[c, a, b] = 0.0 if closed else n[a] * n[b]
                else:
                    V[c, a, b] = one - n[a] * n[b] if closed else one
                W[c, a, b] = V[c, a, b]
        if motion != SLIP:
            continue
        t, t1, t2, slip = _slip_vector(H[c], u[c])
        fixed, mu = given(kind[c], parameters[c], r[c, 0]), parameters[c, MU]
        bound = _bound(kind[c], parameters[c], r[c])
        if slip == 0.0 or not bound > 0.0:
            continue
        if not fixed:
            along = length - mu * (t[0] * n[0] + t[1] * n[1] + t[2] * n[2])
            for b in range(3):
                tv = t[0] * V[c, 0, b] + t[1] * V[c, 1, b] + t[2] * V[c, 2, b]
                for a in range(3):
                    W[c, a, b] += n[a] * mu * tv / along
        curvature = min(bound / slip, size[c])
        for a in range(3):
            across = -t2 * H[c, a, 1] + t1 * H[c, a, 2]
            for b in range(3):
                L[c, a, b] = curvature * across * (-t2 * H[c, b, 1] + t1 * H[c, b, 2])


@njit(cache=True, error_model="numpy")
def _limit(  # noqa: PLR0913
    node, H, to_reaction, w, kind, parameters, r, u, state, V, before, x
):
    moved = np.empty(3)
    for c in range(len(node)):
        p = node[c]
        for a in range(3):
            moved[a] = x[p, a] - before[c, a]
        for a in range(3):
            x[p, a] = before[c, a] + (
                V[c, a, 0] * moved[0] + V[c, a, 1] * moved[1] + V[c, a, 2] * moved[2]
            )
        if state[c] % CLOSED != SLIP or not _bound(kind[c], parameters[c], r[c]) > 0.0:
            continue
        u1, u2 = w[c, 1], w[c, 2]
        for a in range(3):
            u1 += H[c, a, 1] * x[p, a]
            u2 += H[c, a, 2] * x[p, a]
        if u1 * u[c, 1] + u2 * u[c, 2] < 0.0:
            for a in range(3):
                x[p, a] -= to_reaction[c, 1, a] * u1 + to_reaction[c, 2, a] * u2


@njit(cache=True, error_model="numpy")
def _combine(node, H, kind, parameters, r, u, state, W, residual):  # noqa: PLR0913
    for c in range(len(node)):
        if state[c] == OPEN:
            continue
        p = node[c]
        g0, g1, g2 = residual[p, 0], residual[p, 1], residual[p, 2]
        if state[c] % CLOSED == SLIP and given(kind[c], parameters[c], r[c, 0]):
            t, _, _, _ = _slip_vector(H[c], u[c])
            bound = parameters[c, BOUND]
            g0 -= bound * t[0]
            g1 -= bound * t[1]
            g2 -= bound * t[2]
        for a in range(3):
            residual[p, a] = W[c, 0, a] * g0 + W[c, 1, a] * g1 + W[c, 2, a] * g2
