"""Normals at slave nodes: of what faces the master, and where it ends those of the master.

Around a node p are slave facets f with r_f corners and the area vectors a_f, out of the slave,
of which parts k of the areas C_k face master facets with the unit normals n_k, out of these,
and stand opposite them by o_k (`opposed`, which the areas C_k are taken times):

    c_f = sum_k C_k / |a_f|,    b_k = (1 - c_f) o_k,    m_f = - a_f / |a_f|,
    N_p = sum_f sum_k C_k ((1 - b_k) m_f + b_k n_k) / r_f,      n_p = N_p / |N_p|,          (1)

the area average of what faces the master, by 1 - b_k of the slave's own normals m and by b_k of
the master's.  A facet that faces the master from end to end has its own; one that goes on
beyond the master's end is a chord from below a rim to what rises beside it: its tilt is none
of the contact, and no mesh makes it smaller, while the side that ends has its normal up to
there.  With it the forces on a die whose rim is pressed into a slab were tilted, more with
the slab's side as the slave: horizontal ones by .7 % on every mesh.

Of a node that faces nobody, and where `areas` of the pair are None, all facets have c = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .current_slopes import SlotSlopes
from .facet_integrals import FacetPairs
from .facing import dofs_of, shapes

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FacedNormals:
    """(1) of a meeting, of f facets around its slaves and k parts of them."""

    at: MortarMeeting

    @cached_property
    def of(self) -> Index:
        """Which of the facets around, (k,)."""
        return self._around(self.at.shared.facets[self.at.shared.of])

    def _around(self, numbers: Index) -> Index:
        """Facets of the slave as they are counted around its nodes."""
        fold = self.at.pair.fold
        return numbers if fold is None else fold.halves[0][numbers]

    @cached_property
    def _areas(self) -> Array:
        """C, (k,)."""
        corners = self.at.pair.master.nodes.shape[1]
        return np.asarray(self.at.shared.cross[:, :, :corners].sum(axis=(1, 2)))

    @cached_property
    def _master(self) -> Array:
        """n_k, (k, d)."""
        return shapes(self.at.pair.master, self.at.x)[1][self.at.shared.master]

    @cached_property
    def _own(self) -> Array:
        """a, (f, d)."""
        return self.at.pair.around[0].areas(self.at.x)

    @cached_property
    def covered(self) -> Array:
        """c, (f,)."""
        facets = len(self._own)
        if self.at.pair.areas is None:
            return np.ones(facets)
        out = np.zeros(facets)
        out[self._around(self.at.shared.facets)] = self.at.shared.covered
        return out

    @cached_property
    def _partly(self) -> Mask:
        """Slots (f, a) of nodes that meet, at facets of which a part alone does."""
        (skin, heeded), at = self.at.pair.around, self.at
        cut = np.asarray(self.covered != 1)
        if not cut.any():
            return np.zeros(heeded.shape, dtype=bool)
        return heeded & cut[:, None] & np.isin(skin.nodes, at.slaves[at.met])

    @cached_property
    def _there(self) -> Array:
        """sum_k o_k C_k n_k, (f, d)."""
        out = np.zeros(self._own.shape)
        parts = (self.at.shared.opposed * self._areas)[:, None] * self._master
        np.add.at(out, self.of, parts)
        return out

    @cached_property
    def _whole(self) -> Array:
        """|a|, (f, 1), 1 of points."""
        whole = np.linalg.norm(self._own, axis=1)[:, None]
        return np.where(whole > 0, whole, 1.0)

    @cached_property
    def _opposed(self) -> Array:
        """q = sum_k o_k C_k / |a|, (f,)."""
        parts = self.at.shared.opposed * self._areas
        return np.bincount(self.of, parts, minlength=len(self._own)) / self._whole[:, 0]

    @cached_property
    def _factor(self) -> Array:
        """c - (1 - c) q (f, a, 1), 1 of nodes that do not meet."""
        out = np.ones((*self._partly.shape, 1))
        if self._partly.any():
            own = self.covered - (1 - self.covered) * self._opposed
            out[self._partly] = np.broadcast_to(own[:, None, None], out.shape)[self._partly]
        return out

    @cached_property
    def sums(self) -> Array:
        """N in free directions, (nc, d)."""
        (skin, heeded), at = self.at.pair.around, self.at
        parts = -self._own[:, None] * self._factor * heeded[:, :, None]
        if self._partly.any():
            beside = (1 - self.covered)[:, None] * self._there
            parts += beside[:, None] * self._partly[:, :, None]
        out = np.zeros(at.x.shape)
        parts /= skin.corners[:, None, None]
        for slot in range(skin.nodes.shape[1]):
            np.add.at(out, skin.nodes[:, slot], parts[:, slot])
        return out[at.slaves] * at.pair.free

    @cached_property
    def unit(self) -> Array:
        """n, (nc, d); zero where all facets around have shrunk to points."""
        size = np.linalg.norm(self.sums, axis=1, keepdims=True)
        return self.sums / np.where(size > 0, size, 1.0)

    @cached_property
    def slopes(self) -> list[SlotSlopes]:
        """Of n, a part per facet, and one per part of facets that face the master partly."""
        (skin, heeded), n, x = self.at.pair.around, self.unit, self.at.x
        (f, a), (nc, d) = skin.nodes.shape, n.shape
        length = np.linalg.norm(self.sums, axis=1)
        length = np.where(length > 0, length, 1.0)
        project = (np.eye(d) - n[:, :, None] * n[:, None, :]) / length[:, None, None]
        project = project * self.at.pair.free[:, None, :]
        number = np.full(len(x), -1)
        number[self.at.slaves] = np.arange(nc)
        row = np.where(heeded, number[skin.nodes], -1)
        by_sum = np.where((row >= 0)[:, :, None, None], project[row], 0.0)
        by_sum /= skin.corners[:, None, None, None]
        slopes = skin.area_slopes(x).reshape(f, 1, d, a * d)
        values = -(by_sum * self._factor[..., None]) @ slopes
        out = [SlotSlopes(values, row, dofs_of(skin.nodes, d))]
        if self._partly.any():
            by_sum = by_sum * self._partly[:, :, None, None]
            out.append(self._of_parts(values, by_sum, slopes[:, 0], row))
        return out

    def _of_parts(self, own: Array, by_sum: Array, slopes: Array, row: Index) -> SlotSlopes:
        """By what both facets of a part do; what |a| does to c is added to `own`.

        own (f, a, d, a d): by corners of the slave; by_sum (f, a, d, d): n by N, of slots that
        meet partly; slopes (f, d, a d): of area vectors; row (f, a).
        """
        c, q, unit = self.covered[:, None], self._opposed[:, None], self._own / self._whole
        by_c = -(1 + q) * unit - self._there / self._whole  # N by c, over |a|
        by_whole = by_sum @ (c * by_c + (1 - c) * q * unit)[:, None, :, None]
        along = np.einsum("fd,fdw->fw", unit, slopes)
        own -= by_whole * along[:, None, None, :]
        cut = np.asarray(self._partly.any(axis=1))
        pairs = np.flatnonzero(cut[self.of])
        of, o = self.of[pairs], self.at.shared.opposed[pairs, None]
        left, C = 1 - c[of], self._areas[pairs, None]
        _, cross, dofs = self.at.slopes.integrals
        master, corners = self.at.pair.master, self.at.pair.master.nodes.shape[1]
        grown = cross[pairs][:, :, :corners].sum(axis=(1, 2))
        apart = left * (unit[of] + self._master[pairs])
        values = by_sum[of] @ (by_c[of] + o * apart)[:, None, :, None]
        values = values * grown[:, None, None, :]
        by_o = by_sum[of] @ (C * apart)[:, None, :, None]
        values += by_o * self._opposed_slopes(pairs)[:, None, None, :]
        turned = master.normal_slopes(self.at.x, self.at.shared.master[pairs])
        turned *= (left * o * C)[:, :, None]
        values[..., -turned.shape[2] :] += by_sum[of] @ turned[:, None]
        return SlotSlopes(values, np.where(self._partly[of], row[of], -1), dofs[pairs])

    def _opposed_slopes(self, chosen: Index) -> Array:
        """Derivatives of o by the dofs of chosen parts, (q, w)."""
        at, parts = self.at, self.at.shared
        return FacetPairs.of(at.pair.slave, parts.slave[chosen], at.pair.master,
                             parts.master[chosen], at.x).opposed_slopes()  # fmt: skip
