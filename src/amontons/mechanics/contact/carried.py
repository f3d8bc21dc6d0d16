"""Ties that bodies carry along: pairs of the undeformed state, whatever motions come.

With B of `current_mortar` at the undeformed positions X, and c of nodes of the slave's body
near p with sum_j c_pj X_j the distance vector that the sides have there,

    T = B - c,    T X = 0,    sum_j T_pj = 0,    and    T x = 0                             (1)

is the tie: linear, kept by every affine motion x = A X + b, so that bodies turn as one.  The
distance goes with the deformation of the slave's body beside it, whose nodes take part in what
it bears.  The forces -T_pj lambda_p are without sum, and without moment, as
sum_j x_j x T_pj lambda_p = (T x)_p x lambda_p ([P]: there the mesh is moved until c = 0).
c is that of least squares, on p and nodes off the slave's surface, so that the force on p is
still that of p alone; rows are scaled to T_pp = 1, T = a (B - c).

An elastic bond has T x = -a pi C lambda in the place of T x = 0, normal and tangential, pi of
`current_mortar`: the slave's side gets a pi lambda, and its mean distance is T x / (a pi).
lambda acts on an area D_p / a, for which C and the stresses that are told are taken.

[P] M. Puso, "A 3D mortar method for solid mechanics", Int. J. Numer. Meth. Engng 59 (2004).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import UnsupportedForm
from .current_mortar import MortarMeeting, MortarPair
from .current_slopes import blocks_of
from .grown_areas import GrownAreas

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
TOUCHING = 1e-12  # distance over the size of the surface that is none
RINGS = 6  # how far around a node others are sought that its distance is told by
FLAT = 1e-6  # singular value over the largest below which nodes lie on a plane


@dataclass(frozen=True, eq=False)
class TiedPair:
    """Sides that neither part nor slip: pair, of the undeformed state; rows T (nc, nodes).

    passed (nc,): a pi; share (nc,): 1 / a; areas: how those around the slaves grow, for what is
    told of stresses: bonds keep theirs.
    """

    pair: MortarPair
    rows: sparse.csr_array
    passed: Array
    share: Array
    areas: GrownAreas

    @classmethod
    def of(cls, pair: MortarPair, X: Array, beside: sparse.csr_array) -> TiedPair:
        """Ties at undeformed positions X (nodes, d); all slaves of the pair meet there.

        beside (nodes, nodes): entries where two nodes share a cell.
        """
        rows = pair.at(X).averages
        onto = np.asarray(rows[:, pair.master.every].sum(axis=1)).ravel()
        apart = rows @ X
        size = np.ptp(X[pair.slave.all], axis=0).max()
        far = np.flatnonzero(np.linalg.norm(apart, axis=1) > TOUCHING * size)
        on_slave = np.zeros(len(X), dtype=bool)
        on_slave[pair.slave.every] = True
        entries: list[tuple[Array, Index, Index]] = []
        share = np.ones(len(apart))
        for p in far:
            node = int(pair.slaves[p])
            nodes, parts = _told_by(node, apart[p], X, beside, on_slave)
            own = -parts.sum()
            share[p] = 1 - own
            entries.append((np.append(parts, own), np.full(len(nodes) + 1, p),
                            np.append(nodes, node)))  # fmt: skip
        if entries:
            values, row, column = (np.concatenate(k) for k in zip(*entries, strict=True))
            away = sparse.coo_array((values, (row, column)), shape=rows.shape)
            rows = sparse.diags_array(1 / share) @ (rows - away.tocsr())
        areas = GrownAreas(pair.slaves, pair.slave, X)
        return cls(pair, sparse.csr_array(rows), -onto / share, share, areas)

    @property
    def slaves(self) -> Index:
        """Nodes with a row, (nc,)."""
        return self.pair.slaves

    @cached_property
    def pressed(self) -> Index:
        """Nodes that may get forces beside the slaves."""
        every = np.unique(self.rows.indices).astype(np.int64)
        return every[~np.isin(every, self.slaves)]

    def at(self, positions: Array) -> TiedMeeting:
        """The ties at the positions (nodes, d) of all nodes."""
        return TiedMeeting(self, positions)


def _told_by(
    node: int, apart: Array, X: Array, beside: sparse.csr_array, on_slave: Mask
) -> tuple[Index, Array]:
    """Nodes off the surface and their parts c with sum c_j (X_j - X_node) = apart."""
    ring = np.array([node], dtype=np.int64)
    for _ in range(RINGS):
        ring = np.unique(np.concatenate([ring, *(
            beside.indices[beside.indptr[k] : beside.indptr[k + 1]] for k in ring
        )])).astype(np.int64)  # fmt: skip
        nodes = ring[~on_slave[ring]]
        arms = (X[nodes] - X[node]).T
        if arms.shape[1] < len(apart):
            continue
        sizes = np.linalg.svd(arms, compute_uv=False)
        if sizes[-1] > FLAT * sizes[0]:
            return nodes, np.linalg.lstsq(arms, apart, rcond=None)[0]
    raise UnsupportedForm(
        f"the tie at {X[node].tolist()} bridges a distance of {np.linalg.norm(apart):.3g}, and "
        "the slave's body has no nodes beside its surface that would carry that along; let "
        "the sides touch, or exchange slave and master", ("contacts",),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class TiedMeeting:
    """Ties at positions x (nodes, d)."""

    pair: TiedPair
    x: Array
    axes = along = None  # bonds are alike in all tangents

    @property
    def slaves(self) -> Index:
        """Nodes with a row, (nc,)."""
        return self.pair.slaves

    @property
    def met(self) -> Mask:
        """All of them, (nc,)."""
        return np.ones(len(self.slaves), dtype=bool)

    @property
    def growth(self) -> Array:
        """Of `grown_areas`, (nc,): bonds keep their area, D_p / a."""
        return self.pair.share

    @cached_property
    def stretch(self) -> Array:
        """Of areas around the slaves, (nc,), as `grown_areas` has it in front of obstacles."""
        return self.pair.areas.at(self.x) * self.pair.share

    @property
    def passed(self) -> Array:
        """How much of lambda_p all nodes of the slave's side get, (nc,)."""
        return self.pair.passed

    @property
    def averages(self) -> sparse.csr_array:
        """T, (nc, nodes)."""
        return self.pair.rows

    @cached_property
    def _surface(self) -> MortarMeeting:
        return self.pair.pair.at(self.x)

    @property
    def normals(self) -> Array:
        """Normals of the slave's surface, (nc, d)."""
        return self._surface.normals

    @cached_property
    def distances(self) -> Array:
        """T x over `passed`, the mean, (nc, d): zero but for what bonds give way."""
        return self.pair.rows @ self.x / self.passed[:, None]

    @property
    def gap(self) -> Array:
        """Its normal part, (nc,)."""
        return (self.normals * self.distances).sum(axis=1)

    def motion(self, _: object) -> Array:
        """`distances`, of whichever step: they count from the undeformed state."""
        return self.distances

    @cached_property
    def slopes(self) -> TiedSlopes:
        """Derivatives by the positions of all nodes."""
        return TiedSlopes(self)


@dataclass(frozen=True, eq=False)
class TiedSlopes:
    """Derivatives of what ties hold."""

    at: TiedMeeting

    @property
    def normals(self) -> sparse.csr_array:
        """dn/dx, (nc d, nodes d)."""
        return self.at._surface.slopes.normals

    def motion(self, _: object) -> sparse.csr_array:
        """Of the distances, (nc d, nodes d)."""
        eye = sparse.eye_array(self.at.x.shape[1])
        means = sparse.diags_array(1 / self.at.passed) @ self.at.averages
        return sparse.csr_array(sparse.kron(means, eye))

    @property
    def gap(self) -> sparse.csr_array:
        """Its normal part, (nc, nodes d)."""
        along = blocks_of(self.at.normals[:, None]) @ self.motion(None)
        return sparse.csr_array(along + blocks_of(self.at.distances[:, None]) @ self.normals)
