"""Contact of two deforming bodies in the equations of large deformations.

The force lambda_p on a slave node is all that its body needs there, sum_j C_pj (f_int - f)_j
with C of `contact.current_mortar` (of first order at p alone), as the dual functions leave no
other slave's force on it.  The other nodes j of its pair carry

    f_int - f = sum_p B_pj lambda_p,                                                        (1)

B of `contact.current_mortar`.  With both eliminated that way the displacements are all
unknowns; `PairLinearisation` has the derivative of (1) and of the law in them.

Where slaves of one pair are of another one's master, their lambda is what is left beside (1):
with O the part of (1) that contacts of nodes that meet give to others, in global axes,

    lambda = C (f_int - f - O lambda),    lambda = (I + C O)^-1 C (f_int - f).              (2)

No two pairs are slave and master of each other, along none of their chains, so that C O is
nilpotent: (I + C O)^-1 = I - C O + (C O)^2 - ..., with as many terms as the chain has pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..contact.carried import TiedMeeting
from ..contact.current import ContactPoint
from ..contact.current_mortar import MortarMeeting
from ..contact.current_pairs import AnyMeeting, Meeting, Meetings
from ..contact.current_slopes import blocks_of
from .nodal_forces import NodalForces
from .nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]


def balanced(parts: NonlinearParts, meeting: Meetings, rest: Array) -> Array:
    """f_int - f (dofs,) without the forces that contacts give to nodes other than the slave.

    At slaves it is C times that.
    """
    if meeting.only_obstacles:
        return rest
    own = _own(parts, meeting, rest)
    out = rest - (meeting.others @ own).ravel()
    out[parts.at] = (parts.gathers @ out).reshape(parts.at.shape)
    return out


def _own(parts: NonlinearParts, meeting: Meetings, needed: Array) -> Array:
    """lambda (nc, d) of nodes that meet, of f_int - f (dofs,)."""
    gathered = parts.gathers @ needed
    if parts.chained:
        gathered = _unchained(parts, _others(parts, meeting), gathered)
    return gathered.reshape(parts.at.shape) * parts.contact.free * meeting.met[:, None]


def _unchained(parts: NonlinearParts, others: sparse.csr_array, gathered: Any) -> Any:
    """(I + C O)^-1 of (2) times an array or matrix (nc d, ...)."""
    out = term = gathered
    for _ in range(parts.chained):
        term = -(parts.gathers @ (others @ term))
        out = out + term
    return out


def _others(parts: NonlinearParts, meeting: Meetings) -> sparse.csr_array:
    """Forces on other nodes per force on the slaves, (dofs, nc d)."""
    d = parts.at.shape[1]
    counts = (parts.contact.free * meeting.met[:, None]).astype(float)
    by_slave = meeting.others.tocsc()
    p = np.repeat(np.arange(len(counts)), np.diff(by_slave.indptr))
    values = by_slave.data[:, None] * counts[p]
    rows = by_slave.indices[:, None] * d + np.arange(d)
    columns = p[:, None] * d + np.arange(d)
    entries = (values.ravel(), (rows.ravel(), columns.ravel()))
    return sparse.csr_array(entries, shape=(parts.X.size, parts.at.size))


@dataclass(frozen=True, eq=False)
class Linearisation:
    """F and its derivatives at one state, with obstacles alone.

    u (nodes, d): displacements; rest (dofs,): f_int - f; blocks: its derivative; by_force,
    by_x, by_motion (nc, d, d): those of the contact law.
    """

    parts: NonlinearParts
    u: Array
    rest: Array
    blocks: Array
    point: ContactPoint
    by_force: Array
    by_x: Array
    by_motion: Array

    @property
    def residual(self) -> Array:
        """F, (n,)."""
        parts = self.parts
        out = self.rest.copy()
        out[parts.at] = self.point.residual()
        return out[parts.free]

    @cached_property
    def matrix(self) -> sparse.csc_array:
        """dF/dv, (n, n)."""
        parts = self.parts
        blocks = self.blocks.copy()
        rows = np.flatnonzero(parts.row_contact >= 0)
        blocks[rows] = self.by_force[parts.row_contact[rows]] @ blocks[rows]
        blocks[parts.diagonal] += self.by_x + self.by_motion
        return parts.on_free(blocks)

    def shifted(
        self, load: NodalForces | Array, prescribed: Array, drift: Array | None = None
    ) -> Array:
        """First-order change of F, (n,), with changes of load, prescribed (dofs,) and drift."""
        parts = self.parts
        change = parts.matrix(self.blocks) @ prescribed - NodalForces.of(load).at(self.u)
        at = np.einsum("pij,pj->pi", self.by_force, change[parts.at])
        if drift is not None:
            at += np.einsum("pij,pj->pi", self.by_motion, drift)
        change[parts.at] = at
        return change[parts.free]

    def passed(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of f_int - f, (dofs,)."""
        parts, out = self.parts, change.copy()
        out[parts.at] = np.einsum("pij,pj->pi", self.by_force, change[parts.at])
        return out[parts.free]


@dataclass(frozen=True, eq=False)
class PairLinearisation:
    """F and its derivatives at one state, displacements u (nodes, d).

    needed, rest (dofs,): f_int - f, and balanced; blocks: derivative of the first in node
    blocks; partials: of the law, see `ContactPoint.partials`.
    """

    parts: NonlinearParts
    u: Array
    needed: Array
    rest: Array
    blocks: Array
    point: ContactPoint
    earlier: Meetings
    partials: tuple[Array, Array, Array, Array]

    @cached_property
    def residual(self) -> Array:
        """F, (n,)."""
        out = self.rest.copy()
        out[self.parts.at] = self.point.residual()
        return out[self.parts.free]

    def passed(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of f_int - f, (dofs,)."""
        return self._passed(change)[self.parts.free]

    def _passed(self, change: Array) -> Array:
        """The same of all dofs."""
        out = balanced(self.parts, self.point.meeting, change)
        at = self.parts.at
        out[at] = np.einsum("pij,pj->pi", self.partials[0], out[at])
        return out

    @cached_property
    def _by_x(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Derivatives by the place of all nodes, (., dofs), as if no node were held.

        Of f_int - f without what contacts give to other nodes, and of the law, (nc d, dofs).
        """
        parts, meeting = self.parts, self.point.meeting
        by_force, by_normal, by_gap, by_motion = self.partials
        force = _own(parts, meeting, self.needed)
        stiffness, law = sparse.csr_array(parts.matrix(self.blocks).tocsr()), []
        turned: sparse.csr_array | None = None
        start = 0
        for part, old in zip(meeting.parts, self.earlier.parts, strict=True):
            mine = slice(start, start + len(part.slaves))
            start = mine.stop
            slopes = by_normal[mine], by_gap[mine], by_motion[mine]
            if isinstance(part, MortarMeeting) and isinstance(old, MortarMeeting):
                spread = part.slopes.spread(force[mine])
                turned = spread if turned is None else sparse.csr_array(turned + spread)
                law.append(_law_of_pair(part, old, *slopes))
            elif isinstance(part, TiedMeeting):
                law.append(_law_of_tie(part, old, *slopes))
            else:
                law.append(_law_at_obstacle(part, *slopes))
        rest = self._without_others(stiffness, turned)
        own = blocks_of(by_force) @ (parts.gathers @ rest)
        return rest, sparse.csr_array(own + sparse.vstack(law))

    def _without_others(
        self, stiffness: sparse.csr_array, turned: sparse.csr_array | None
    ) -> sparse.csr_array:
        """Derivative of f_int - f without what contacts give to other nodes, (dofs, dofs).

        turned: of these at held forces, which pass through chains of contacts themselves.
        """
        parts, gathers = self.parts, self.parts.gathers
        others = _others(parts, self.point.meeting)
        if parts.chained:
            gathers = _unchained(parts, others, gathers)
            stiffness = stiffness if turned is None else stiffness - turned
        rest = stiffness - others @ (gathers @ stiffness)
        if turned is not None and not parts.chained:
            rest = rest - turned
        return sparse.csr_array(rest)

    @cached_property
    def matrix(self) -> sparse.csc_array:
        """dF/dv, (n, n)."""
        rest, law = self._by_x
        rows = np.arange(rest.shape[0])
        rows[self.parts.at.ravel()] = rest.shape[0] + np.arange(law.shape[0])
        free = self.parts.free
        chosen = sparse.csr_array(sparse.vstack([rest, law], format="csr"))[rows[free]]
        return sparse.csc_array(chosen.tocsc()[:, free])

    def shifted(
        self, load: NodalForces | Array, prescribed: Array, drift: Array | None = None
    ) -> Array:
        """First-order change of F, (n,), with changes of load, prescribed (dofs,) and drift."""
        rest, law = self._by_x
        at = self.parts.at
        change = rest @ prescribed
        change[at] = (law @ prescribed).reshape(at.shape)
        change -= self._passed(NodalForces.of(load).at(self.u))
        if drift is not None:
            change[at] += np.einsum("pij,pj->pi", self.partials[3], drift)
        return change[self.parts.free]


def _law_of_pair(
    part: MortarMeeting, old: MortarMeeting, by_normal: Array, by_gap: Array, by_motion: Array
) -> sparse.csr_array:
    """Derivative of the law by the place of all nodes through n, g = n . G and s."""
    apart = part.distances * part.met[:, None]
    by_normal = by_normal + by_gap[:, :, None] * apart[:, None, :]
    by_distance = by_gap[:, :, None] * part.normals[:, None, :]
    return part.slopes.combined(by_normal, by_distance, by_motion, old)


def _law_of_tie(
    part: TiedMeeting, old: AnyMeeting, by_normal: Array, by_gap: Array, by_motion: Array
) -> sparse.csr_array:
    """The same where the averages stay."""
    slopes = part.slopes
    out = blocks_of(by_normal) @ slopes.normals + blocks_of(by_motion) @ slopes.motion(old)
    return sparse.csr_array(out + blocks_of(by_gap[:, :, None]) @ slopes.gap)


def _law_at_obstacle(
    part: AnyMeeting, by_normal: Array, by_gap: Array, by_motion: Array
) -> sparse.csr_array:
    """The same where the other side is an obstacle."""
    assert isinstance(part, Meeting)
    by_x = by_normal @ part.side.normal_slopes(part.x) + by_motion
    by_x = by_x + by_gap[:, :, None] * part.side.gap_slopes(part.x)[:, None, :]
    return _at_slaves(part, by_x, part.nodes * part.x.shape[1])


def _at_slaves(part: Meeting, values: Array, dofs: int) -> sparse.csr_array:
    """Rows (nc, m, d) by the place of the slave alone, (nc m, dofs)."""
    nc, m, d = values.shape
    rows = np.broadcast_to(np.arange(nc * m).reshape(nc, m, 1), values.shape)
    columns = part.slaves[:, None, None] * d + np.arange(d)
    entries = (values.ravel(), (rows.ravel(), np.broadcast_to(columns, values.shape).ravel()))
    return sparse.coo_array(entries, shape=(nc * m, dofs)).tocsr()


def turned_forces(axes: Array, r: Array, bend: Array) -> Array:
    """Derivative of the forces sum_k r_k axis_k by the position, (nc, d, d).

    dn = bend dx, and tangents are carried along: dt = -n (t . dn).
    """
    n, t = axes[:, 0], axes[:, 1:]
    along = np.einsum("pk,pkc,pcj->pj", r[:, 1:], t, bend)
    return r[:, 0, None, None] * bend - n[:, :, None] * along[:, None, :]
