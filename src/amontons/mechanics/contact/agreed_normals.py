"""Normals at ridges of the slave, on which both sides agree: more of the side that bends less.

At a ridge, as between cone and cylinder of a pin, the mean n_s of the facets around a node is
none of the normals of contact: a smooth master goes on over the ridge, and forces along n_s
hold the bodies back or push them on, which with the other side as the slave they do not.  What
sides share falls into k parts, of slave and master facets with unit normals n_f, n_g out of
these and weights W_kp = int phi_p.  Of a node p, with n_s of `faced_normals` and in free
directions,

    n_m = sum_k W_kp n_g / | |,    S_s = sum_k W_kp (-n_f - n_s) (-n_f - n_s)^T / sum_k W_kp,

S_m likewise, tell two directions and how far each side scatters about its own.  Their mean by
inverse scatter, as of two measurements,

    v = n_s + r (S_s + e) T (n_m - n_s),    T = (S_s + S_m + 2 e)^-1,    n = v / |v|,       (1)

takes each component from the side that is straight along it: axial ones of a ridged pin from
its tube, whatever facets it has around.  Two flat sides that are tilted halve the angle, by
e = EVEN.  r of `ridges`, of the undeformed slave, is how much of a ridge p is: on a curved
surface without one facets scatter, too, but n_s is right to second order, and stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .current_slopes import SlotSlopes
from .faced_normals import FacedNormals
from .facing import shapes
from .ridges import EVEN

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Side:
    """Of one side: directions of k parts (k, d) in all, mean (nc, d) and scatter (nc, d, d)."""

    parts: Array
    mean: Array
    scatter: Array
    off: Array  # (nc, d), mean of deviations from `mean`


@dataclass(frozen=True, eq=False)
class AgreedNormals:
    """(1) of a meeting; without `ridges` of the pair n is n_s."""

    at: MortarMeeting

    @cached_property
    def own(self) -> FacedNormals:
        """n_s."""
        return FacedNormals(self.at)

    @property
    def _ridges(self) -> Array:
        """r, (nc,)."""
        found = self.at.pair.ridges
        return np.zeros(len(self.at.slaves)) if found is None else found

    @property
    def _both(self) -> bool:
        """False where the slave's alone count."""
        return self.at.pair.ridges is not None and bool(len(self._parts))

    # ------------------------------------------------------------------- sums over parts
    @cached_property
    def _every(self) -> Index:
        """Rows of the slave's slots at ridges of all parts, -1 for none."""
        rows = self.at.rows[self.at.shared.of]
        ridges = np.append(self._ridges, 0.0)  # the last one: of none
        return np.where(ridges[rows] > 0, rows, -1)

    @cached_property
    def _parts(self) -> Index:
        """The k parts that lie at ridges, of all."""
        return np.flatnonzero((self._every >= 0).any(axis=1))

    @cached_property
    def _rows(self) -> Index:
        """Of these, (k, a)."""
        return self._every[self._parts]

    @cached_property
    def _weights(self) -> Array:
        """W, (k, a)."""
        corners = self.at.pair.master.nodes.shape[1]
        weights = self.at.shared.cross[self._parts][:, :, :corners].sum(axis=2)
        return np.where(self._rows >= 0, weights, 0.0)

    def _summed(self, values: Array) -> Array:
        """Sums (nc, ...) of values (k, a, ...) times W."""
        values = values * self._weights.reshape(self._weights.shape + (1,) * (values.ndim - 2))
        out = np.zeros((len(self.at.slaves), *values.shape[2:]))
        there = self._rows >= 0
        np.add.at(out, self._rows[there], values[there])
        return out

    @cached_property
    def _by_total(self) -> Array:
        """1 / sum_k W, (nc,), zero where nobody meets."""
        total = self._summed(np.ones(self._rows.shape))
        return np.where(total > 0, 1.0, 0.0) / np.where(total > 0, total, 1.0)

    @cached_property
    def _slave(self) -> _Side:
        """-n_f, n_s, S_s."""
        facing = -shapes(self.at.pair.slave, self.at.x)[1][self.at.shared.slave[self._parts]]
        return self._side(facing, self.own.unit)

    @cached_property
    def _across(self) -> Array:
        """sum_k W n_g in free directions, (nc, d)."""
        n = self._facing[:, None] + np.zeros((*self._rows.shape, 1))
        return self._summed(n) * self.at.pair.free

    @cached_property
    def _facing(self) -> Array:
        """n_g, (k, d)."""
        return shapes(self.at.pair.master, self.at.x)[1][self.at.shared.master[self._parts]]

    @cached_property
    def _master(self) -> _Side:
        """n_g, n_m, S_m."""
        size = np.linalg.norm(self._across, axis=1, keepdims=True)
        return self._side(self._facing, self._across / np.where(size > 0, size, 1.0))

    def _side(self, parts: Array, mean: Array) -> _Side:
        e = self._deviations(parts, mean)
        by_total = self._by_total[:, None]
        scatter = self._summed(e[..., :, None] * e[..., None, :]) * by_total[:, :, None]
        return _Side(parts, mean, scatter, self._summed(e) * by_total)

    def _deviations(self, parts: Array, mean: Array) -> Array:
        """Of directions (k, d) from means (nc, d) in free directions, (k, a, d)."""
        return parts[:, None] * self.at.pair.free[self._rows] - mean[self._rows]

    # ------------------------------------------------------------------- normals
    @cached_property
    def _shares(self) -> tuple[Array, Array, Array, Array]:
        """Factors (nc, d, d) of n_s and n_m in v and of dS_s y in dv; y = T (n_m - n_s)."""
        even = EVEN * np.eye(self.at.x.shape[1])
        s, m = self._slave, self._master
        T = np.linalg.inv(s.scatter + m.scatter + 2 * even)
        y = np.einsum("pij,pj->pi", T, m.mean - s.mean)
        y = np.where(self._by_total[:, None] > 0, y, 0.0)  # of those who meet nobody
        part = np.where(self._by_total > 0, self._ridges, 0.0)[:, None, None]
        theirs = part * ((s.scatter + even) @ T)
        eye = np.eye(len(even))
        return eye - theirs, theirs, part * eye - theirs, y

    @cached_property
    def _agreed(self) -> Array:
        """v, (nc, d)."""
        own, theirs = self._shares[:2]
        mean = np.einsum("pij,pj->pi", own, self._slave.mean)
        return mean + np.einsum("pij,pj->pi", theirs, self._master.mean)

    @cached_property
    def unit(self) -> Array:
        """n, (nc, d); zero where all facets around have shrunk to points."""
        if not self._both:
            return self.own.unit
        size = np.linalg.norm(self._agreed, axis=1, keepdims=True)
        return self._agreed / np.where(size > 0, size, 1.0)

    # ------------------------------------------------------------------- slopes
    @cached_property
    def slopes(self) -> list[SlotSlopes]:
        """Of n: those of n_s, turned, and one part per pair of facets."""
        if not self._both:
            return self.own.slopes
        n, y, eye = self.unit, self._shares[3], np.eye(self.at.x.shape[1])
        size = np.linalg.norm(self._agreed, axis=1)
        project = (eye - n[:, :, None] * n[:, None, :]) / np.where(size > 0, size, 1.0)[
            :, None, None
        ]
        own, theirs, bent = (project @ share for share in self._shares[:3])
        by_slave = own - bent @ _by_deviation(self._slave.off, y)
        by_master = theirs + theirs @ _by_deviation(self._master.off, y)
        out = []
        for part in self.own.slopes:
            turned = np.where((part.rows >= 0)[:, :, None, None], by_slave[part.rows], 0.0)
            out.append(SlotSlopes(turned @ part.values, part.rows, part.dofs))
        m, size = self._master.mean, np.linalg.norm(self._across, axis=1)
        size = np.where(size > 0, size, 1.0)[:, None, None]
        by_sum = by_master @ ((eye - m[:, :, None] * m[:, None, :]) / size)
        return [*out, self._of_parts(bent, theirs, by_sum)]

    def _of_parts(self, bent: Array, theirs: Array, by_sum: Array) -> SlotSlopes:
        """By weights and directions of parts; n_s is held.

        bent, theirs (nc, d, d): n by S_s y and by -S_m y; by_sum (nc, d, d): by sum_k W n_g.
        """
        at, row, y = self.at, self._rows, self._shares[3]
        free, there = at.pair.free[row], row >= 0
        share = (self._weights * self._by_total[row])[:, :, None, None]
        by_weight, by_parts = np.zeros((*row.shape, y.shape[1])), []
        for side, factor in ((self._slave, bent), (self._master, -theirs)):
            e = self._deviations(side.parts, side.mean)
            along = np.einsum("pij,pj->pi", side.scatter, y)
            more = e * (e * y[row]).sum(axis=2, keepdims=True) - along[row]
            grown = np.einsum("kaij,kaj->kai", factor[row], more)
            by_weight += grown * self._by_total[row][:, :, None]
            by_parts.append(factor[row] @ _by_deviation(e, y[row]) * share)
        by_weight += np.einsum("kaij,kaj->kai", by_sum[row], self._facing[:, None] * free)
        by_parts[1] += by_sum[row] * self._weights[:, :, None, None]
        by_own, by_other = (
            np.where(there[:, :, None, None], part, 0.0) * free[:, :, None, :]
            for part in by_parts
        )
        _, cross, dofs = at.slopes.integrals
        corners, parts = at.pair.master.nodes.shape[1], self._parts
        grown = cross[parts][:, :, :corners].sum(axis=2)
        by_weight = np.where(there[:, :, None], by_weight, 0.0)
        values = by_weight[..., None] * grown[:, :, None, :]
        mine = at.pair.slave.normal_slopes(at.x, at.shared.slave[parts])
        values[..., : mine.shape[2]] -= by_own @ mine[:, None]
        other = at.pair.master.normal_slopes(at.x, at.shared.master[parts])
        values[..., -other.shape[2] :] += by_other @ other[:, None]
        return SlotSlopes(values, row, dofs[parts])


def _by_deviation(e: Array, y: Array) -> Array:
    """Derivative of e (e . y) by e, (..., d, d), of e and y (..., d)."""
    eye = np.eye(e.shape[-1])
    along = (e * y).sum(axis=-1)[..., None, None]
    return along * eye + e[..., :, None] * y[..., None, :]
