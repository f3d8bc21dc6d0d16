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

Nodes of which hardly anything faces the master, `contact.fading`, have averages B that are
extrapolations from a sliver of width d: these change by 1 / d and are told to eps / d^2 only.
What the law gives such a node is next to nothing, but lambda, which its body asks for, may be
anything away from a solution.  With theta_p of (4) there and law_p, (2) of `contact.current`,
other nodes get

    lambda_p - (1 - theta_p) law_p                                                          (3)

in the place of lambda_p in (1): the same where F = 0, and else, as theta goes to zero, the
force of the law itself: none of nodes that are open, and next to nothing where w goes to zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.condensed import Structure
from ...linear.sums import (
    Product,
    Rows,
    among,
    by_components,
    in_rows,
    rows_of_products,
    sum_of_products,
)
from ..contact.carried import TiedMeeting
from ..contact.current import ContactPoint, Partials, Pieces
from ..contact.current_mortar import MortarMeeting
from ..contact.current_pairs import AnyMeeting, Meeting, Meetings
from ..contact.current_slopes import blocks_of
from ..contact.dragged import asked, between_bodies, missed, of_held
from .given_forces import carried, given_to_others, kept_back, others, unchained
from .nodal_forces import NodalForces
from .nonlinear_parts import NonlinearParts
from .tangent_structure import structure_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairLinearisation:
    """F and its derivatives at one state, displacements u (nodes, d).

    rest (dofs,): f_int - f, balanced; blocks: derivative of f_int - f in node blocks; given
    (nc,): pieces of the law, the active ones for None.
    """

    parts: NonlinearParts
    u: Array
    rest: Array
    blocks: Array
    point: ContactPoint
    earlier: Meetings
    given: Pieces | None = None

    @cached_property
    def residual(self) -> Array:
        """F, (n,), with what forces along held components miss made good to first order."""
        out = self.rest.copy()
        out[self.parts.at] = self.point.residual()
        out = out[self.parts.free]
        if between_bodies(self.point) is None:
            return out
        return out + self._by_held(missed(self.point))

    @cached_property
    def _chained(self) -> tuple[Partials, Array, Array]:
        """Partials of the law by gap and motion themselves, and those of `fading`."""
        mixed, partials = self.point.mixed, self.point.partials(self.given)
        if mixed is not None:
            return mixed.chained(partials)
        return partials, np.zeros(0), np.zeros(0)

    @property
    def structure(self) -> Structure:
        """What the matrix consists of."""
        returned = self._returned[self.parts.free]
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
        return others(self.parts, self.point.meeting)

    @cached_property
    def _faint(self) -> Array:
        """1 - theta of (3), zero for components that supports take, (nc d,)."""
        assert self.point.mixed is not None
        return np.ravel((1 - self.point.mixed.theta)[:, None] * self.parts.contact.free)

    @cached_property
    def _held(self) -> tuple[Array, tuple[Partials, Array, Array]] | None:
        """Forces along held components, (nc, d), and what `_chained` has of the law."""
        held, mixed = of_held(self.point), self.point.mixed
        if held is None:
            return None
        force, partials = held
        if mixed is not None:
            return force, mixed.chained(partials)
        return force, (partials, np.zeros(0), np.zeros(0))

    @cached_property
    def _given(self) -> sparse.csr_array:
        """Forces on other nodes per force on the slaves, held components too, (dofs, nc d)."""
        return given_to_others(self.parts, self.point.meeting)

    @cached_property
    def _by_force(self) -> sparse.csr_array:
        """Derivative of the law by lambda, (nc d, nc d)."""
        return self._of_force(self._chained)

    def _of_force(self, chained: tuple[Partials, Array, Array]) -> sparse.csr_array:
        partials, by_share, _ = chained
        by_force = blocks_of(partials[0])
        if self.point.mixed is not None:
            free = self.parts.contact.free.astype(float)
            shares = by_components(self.point.meeting.shares, free)
            by_force = sparse.csr_array(by_force + blocks_of(by_share) @ shares)
        return by_force

    @cached_property
    def _law(self) -> sparse.csr_array:
        """Derivative of the rows of contacts by the forces on their side, (dofs, dofs)."""
        by_force = self._by_force @ self.parts.gathers
        return in_rows(by_force, self.parts.at.ravel(), len(self.rest))

    @cached_property
    def _returned(self) -> sparse.csr_array:
        """Derivative of the forces on other nodes by lambda, (dofs, nc d): O with (3)."""
        out = self._others
        if self.point.mixed is not None:
            less = sparse.diags_array(self._faint) @ self._by_force
            out = sparse.csr_array(out - out @ less)
        if self._held is not None:
            out = sparse.csr_array(out + self._given @ self._of_force(self._held[1]))
        return out

    def _left(self, needed: Any) -> Any:
        """What (1) leaves of f_int - f on all nodes, of an array or matrix (dofs, ...)."""
        own = self.parts.gathers @ needed
        if self.parts.chained:
            own = unchained(self.parts, self._returned, own)
        return own

    def passed(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of f_int - f, (dofs,)."""
        rest = change - self._returned @ self._left(change)
        return (self._kept * rest + self._law @ rest)[self.parts.free]

    def with_law(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of the law at contacts, (nc, d)."""
        out = np.zeros(len(self.rest))
        out[self.parts.at] = change
        out = out[self.parts.free]
        if self.point.mixed is None:
            return out
        return out + self.passed(self._others @ (self._faint * change.ravel()))

    def with_held(self, law: Array) -> Array:
        """First-order change of F, (n,), with what is asked of held components.

        By the law at contacts, (nc, d), of another state.
        """
        return self._by_held(asked(self.point, law))

    def _by_held(self, change: Array) -> Array:
        """First-order change of F, (n,), with one of forces along held components, (nc, d)."""
        by_force = np.einsum("pij,pj->pi", self.point.slopes[0], change)
        return self.with_law(by_force) - self.passed(self._given @ change.ravel())

    @cached_property
    def _force(self) -> Array:
        """lambda of nodes that meet, (nc, d)."""
        return self.rest[self.parts.at] * carried(self.parts, self.point.meeting)

    @property
    def _each(self) -> Iterator[tuple[AnyMeeting, AnyMeeting, slice]]:
        """Pairs now and earlier, and which contacts are theirs."""
        start = 0
        for part, old in zip(self.point.meeting.parts, self.earlier.parts, strict=True):
            mine = slice(start, start + len(part.slaves))
            start = mine.stop
            yield part, old, mine

    def _by_growth(
        self, value: Array, chained: tuple[Partials, Array, Array]
    ) -> Array | None:
        """(2) of `contact.grown_areas` of a value (nc, d), (nc, d, 1); None for no stress."""
        point, (partials, by_share, _) = self.point, chained
        if not point.contact.law.has_stresses:
            return None
        left = value - np.einsum("pij,pj->pi", partials[0], point.force)
        if point.mixed is not None:
            left -= np.einsum("pij,pj->pi", by_share, point.mixed.passed)
        return (left / point.meeting.growth[:, None])[:, :, None]

    @cached_property
    def _by_place(self) -> sparse.csr_array:
        """Derivative of the law by the place of all nodes, lambda held, (nc d, dofs)."""
        return self._of_place(self.point.residual(self.given), self._chained)

    def _of_place(
        self, value: Array, chained: tuple[Partials, Array, Array]
    ) -> sparse.csr_array:
        parts, meeting, rows = self.parts, self.point.meeting, []
        (_, by_normal, by_gap, by_motion, by_axis), by_share, by_weight = chained
        by_growth = self._by_growth(value, chained)
        for part, old, mine in self._each:
            slopes = by_normal[mine], by_gap[mine], by_motion[mine]
            if isinstance(part, MortarMeeting) and isinstance(old, MortarMeeting):
                row = _law_of_pair(part, old, *slopes)
                if part.fading is not None:
                    known = self._force[mine], by_share[mine], by_weight[mine]
                    row = sparse.csr_array(row + part.fading.slopes(*known))
                rows.append(row)
            elif isinstance(part, TiedMeeting):
                rows.append(_law_of_tie(part, old, *slopes))
            else:
                rows.append(_law_at_obstacle(part, *slopes))
            if by_growth is not None and not isinstance(part, TiedMeeting):
                grown = blocks_of(by_growth[mine]) @ part.growth_slopes
                rows[-1] = sparse.csr_array(rows[-1] + grown)
        local = rows[0] if len(rows) == 1 else sparse.csr_array(sparse.vstack(rows))
        if by_axis is not None and meeting.axes is not None:
            turned = sparse.kron(meeting.axes, sparse.eye_array(len(parts.points[0])), "csr")
            local = sparse.csr_array(local + blocks_of(by_axis) @ turned)
        return local

    @property
    def _turned(self) -> Iterator[list[Product]]:
        """Derivatives of the forces on other nodes by all places, lambda held, (dofs, dofs).

        With the other sign: products that add up to them.
        """
        less, force = kept_back(self.point, self.given), self._force
        for part, _, mine in self._each:
            if isinstance(part, MortarMeeting):
                yield part.slopes.products((-force if less is None else less - force)[mine])
        if self._held is not None:
            yield [(self._given, sparse.csr_array(-self._of_place(*self._held)))]
        if self.point.mixed is None:
            return
        law, rows = self.point.residual(self.given) * self.parts.contact.free, []
        for part, _, mine in self._each:
            fading = part.fading if isinstance(part, MortarMeeting) else None
            if fading is None:
                rows.append(sparse.csr_array((law[mine].size, len(self.rest))))
            else:
                rows.append(fading.theta_slopes(law[mine]))
        kept = sparse.csr_array(sparse.diags_array(self._faint) @ self._by_place)
        yield [(self._others, sparse.csr_array(kept - sparse.csr_array(sparse.vstack(rows))))]

    @cached_property
    def _near(self) -> Rows:
        """dF/dx without the rows of `blocks` that are `_kept`, (dofs, dofs)."""
        parts, shape = self.parts, (len(self.rest), len(self.rest))
        own = needed = parts.gathered(self.blocks)
        if parts.chained:
            needed = sparse.csr_array(unchained(parts, self._returned, own.matrix))
        taken: list[Product] = [(self._returned, -needed)]
        for turned in self._turned:
            taken += turned
            if parts.chained:
                left = self._left(sum_of_products(turned, shape))
                taken.append((self._returned, sparse.csr_array(-left)))
        change = rows_of_products(taken, shape)  # of what is left of f_int - f
        by_force, by_place = (in_rows(part, parts.at.ravel(), len(self.rest))
                              for part in (self._by_force, self._by_place))  # fmt: skip
        products = [(None, change.times(self._kept)), (by_force, own), (self._law, change),
                    (None, by_place)]  # fmt: skip
        return rows_of_products(products, shape)

    def followed(self, moved: Array, more: Array | float = 0.0) -> Array:
        """How forces along held components go with displacements (dofs,), (nc, d).

        To first order; what their law misses here is made good.  more (dofs,): change of
        f_int - f beside that.
        """
        assert self._held is not None
        change = self.parts.matrix(self.blocks) @ moved + more
        if self.parts.chained:
            for turned in self._turned:
                change += sum_of_products(turned, (len(moved), len(moved))) @ moved
        out = self._of_force(self._held[1]) @ self._left(change)
        out += self._of_place(*self._held) @ moved
        return out.reshape(self.parts.at.shape) + missed(self.point)

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
        change += self._near.matrix @ prescribed
        out = change[self.parts.free] - self.passed(NodalForces.of(load).at(self.u))
        if drift is not None:
            out += self.with_law(np.einsum("pij,pj->pi", self._chained[0][3], drift))
            if self._held is not None:
                more = np.einsum("pij,pj->pi", self._held[1][0][3], drift)
                out -= self.passed(self._given @ more.ravel())
        return out


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
