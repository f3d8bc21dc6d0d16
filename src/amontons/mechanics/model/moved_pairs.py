"""Contact of two deforming bodies in the equations of large deformations.

The force lambda_p on a slave node is all that its body needs there, sum_j C_pj (f_int - f)_j
with C of `contact.current_mortar` (of first order at p alone), as the dual functions leave no
other slave's force on it.  The other nodes j of its pair carry

    f_int - f = sum_p B_pj lambda_p,                                                        (1)

and `contact.couples`, B of `contact.current_mortar`.  With both eliminated that way the
displacements are all unknowns; `PairLinearisation` has the derivative of (1) and of the law.

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

from ...linear.condensed import Structure
from ...linear.sums import among, by_components, in_rows, sum_of_products
from ..contact.carried import TiedMeeting
from ..contact.current import ContactPoint, Partials
from ..contact.current_mortar import MortarMeeting
from ..contact.current_pairs import AnyMeeting, Meeting, Meetings
from ..contact.current_slopes import blocks_of
from .nodal_forces import NodalForces
from .nonlinear_parts import NonlinearParts
from .tangent_structure import structure_of

Array = NDArray[np.float64]


def balanced(parts: NonlinearParts, meeting: Meetings, rest: Array) -> Array:
    """f_int - f (dofs,) without the forces that contacts give to nodes other than the slave.

    At slaves it is C times that.
    """
    if meeting.only_obstacles:
        return rest
    own = _own(parts, meeting, rest)
    out = rest - meeting.given(own)
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
    counts = parts.contact.free * meeting.met[:, None]
    return meeting.returned(counts.astype(float))


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

    @property
    def structure(self) -> Structure:
        """What the matrix consists of."""
        nothing = sparse.csr_array((len(self.parts.free), self.parts.at.size))
        return structure_of(self.parts, self.u, self.by_force, nothing)

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
    partials: Partials

    @cached_property
    def residual(self) -> Array:
        """F, (n,)."""
        out = self.rest.copy()
        out[self.parts.at] = self.point.residual()
        return out[self.parts.free]

    @cached_property
    def _chained(self) -> tuple[Partials, Array, Array]:
        """Partials of the law by gap and motion themselves, and those of `fading`."""
        mixed = self.point.mixed
        if mixed is not None:
            return mixed.chained(self.partials)
        return self.partials, np.zeros(0), np.zeros(0)

    @property
    def structure(self) -> Structure:
        """What the matrix consists of."""
        returned = self._others[self.parts.free]
        return structure_of(self.parts, self.u, self._chained[0][0], returned)

    @cached_property
    def _kept(self) -> Array:
        """1 for rows of F that are f_int - f, 0 for those of contacts, (dofs,)."""
        out = np.ones(len(self.rest))
        out[self.parts.at] = 0.0
        return out

    @cached_property
    def _others(self) -> sparse.csr_array:
        """Forces on other nodes per force on the slaves, (dofs, nc d)."""
        return _others(self.parts, self.point.meeting)

    @cached_property
    def _law(self) -> sparse.csr_array:
        """Derivative of the rows of contacts by the forces on their side, (dofs, dofs)."""
        partials, by_share, _ = self._chained
        by_force = blocks_of(partials[0])
        if self.point.mixed is not None:
            free = self.parts.contact.free.astype(float)
            shares = by_components(self.point.meeting.shares, free)
            by_force = by_force + blocks_of(by_share) @ shares
        by_force = by_force @ self.parts.gathers
        return in_rows(by_force, self.parts.at.ravel(), len(self.rest))

    def _left(self, needed: Any) -> Any:
        """What (1) leaves of f_int - f on all nodes, of an array or matrix (dofs, ...)."""
        own = self.parts.gathers @ needed
        if self.parts.chained:
            own = _unchained(self.parts, self._others, own)
        return own

    def passed(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of f_int - f, (dofs,)."""
        rest = change - self._others @ self._left(change)
        return (self._kept * rest + self._law @ rest)[self.parts.free]

    @cached_property
    def _near(self) -> sparse.csr_array:
        """dF/dx without the rows of `blocks` that are `_kept`, (dofs, dofs)."""
        parts, meeting = self.parts, self.point.meeting
        shape = len(self.rest), len(self.rest)
        (_, by_normal, by_gap, by_motion, by_axis), by_share, by_weight = self._chained
        force = _own(parts, meeting, self.needed)
        stiffness = sparse.csr_array(parts.matrix(self.blocks))
        rows, taken = [], [(-self._others, sparse.csr_array(self._left(stiffness)))]
        start = 0
        for part, old in zip(meeting.parts, self.earlier.parts, strict=True):
            mine = slice(start, start + len(part.slaves))
            start = mine.stop
            slopes = by_normal[mine], by_gap[mine], by_motion[mine]
            if isinstance(part, MortarMeeting) and isinstance(old, MortarMeeting):
                turned = part.slopes.pushed(force[mine])
                taken.append((None, -turned))
                if parts.chained:
                    taken.append((self._others, sparse.csr_array(self._left(turned))))
                row = _law_of_pair(part, old, *slopes)
                if part.fading is not None:
                    known = force[mine], by_share[mine], by_weight[mine]
                    row = sparse.csr_array(row + part.fading.slopes(*known))
                rows.append(row)
            elif isinstance(part, TiedMeeting):
                rows.append(_law_of_tie(part, old, *slopes))
            else:
                rows.append(_law_at_obstacle(part, *slopes))
        change = sum_of_products(taken, shape)  # of what is left of f_int - f
        local = rows[0] if len(rows) == 1 else sparse.csr_array(sparse.vstack(rows))
        if by_axis is not None and meeting.axes is not None:
            turned = sparse.kron(meeting.axes, sparse.eye_array(len(parts.points[0])), "csr")
            local = sparse.csr_array(local + blocks_of(by_axis) @ turned)
        own = in_rows(local, parts.at.ravel(), len(self.rest))
        kept = sparse.csr_array(
            (change.data * np.repeat(self._kept, np.diff(change.indptr)), change.indices,
             change.indptr), shape=shape)  # fmt: skip
        products = [(None, kept), (self._law, stiffness), (self._law, change), (None, own)]
        return sum_of_products(products, shape)

    @cached_property
    def matrix(self) -> sparse.csc_array:
        """dF/dv, (n, n)."""
        free = self.parts.free
        stiffness = self.parts.on_free(self.blocks)
        stiffness.data *= self._kept[free][stiffness.indices]
        return sparse.csc_array(stiffness + among(self._near, free))

    def shifted(
        self, load: NodalForces | Array, prescribed: Array, drift: Array | None = None
    ) -> Array:
        """First-order change of F, (n,), with changes of load, prescribed (dofs,) and drift."""
        change = self._kept * (self.parts.matrix(self.blocks) @ prescribed)
        change += self._near @ prescribed
        if drift is not None:
            change[self.parts.at] += np.einsum("pij,pj->pi", self._chained[0][3], drift)
        return change[self.parts.free] - self.passed(NodalForces.of(load).at(self.u))


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
