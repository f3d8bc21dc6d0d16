"""Derivatives of the averages between two deforming bodies by the positions of all nodes.

With own = [mass, integrals with middles] and cross of `facet_integrals` on a slave facet,
W_p = sum_t mass_pt of nodes that carry force and psi = A phi = W Q phi the dual functions, all
follows from

    d(A h) = dW Q h - A dmass Q h + A dh       for h linear in own and cross.               (1)

With bulges chi = theta A + (1 - theta) P of `shared` is in the place of A.

Derivatives stand in dense blocks, one for a pair of facets, until they are summed up once:
sparse products of single steps would cost more than all numbers in them.
Notation is that of `current_mortar`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import (
    Blocks,
    Product,
    Rows,
    by_components,
    rows_of_blocks,
    rows_of_products,
    sum_of_blocks,
    sum_of_products,
)
from .bulge_slopes import BulgeSlopes
from .facet_integrals import FacetPairs
from .facing import dofs_of

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SlotSlopes:
    """Derivatives of a vector at slave nodes in parts.

    values (q, a, d, w): added at rows (q, a), < 0 for none, by the dofs (q, w).
    """

    values: Array
    rows: Index
    dofs: Index

    def times(self, factors: Array) -> Blocks:
        """Entries of the derivatives of factors_p (nc, m, d) times the vector of p."""
        there = self.rows >= 0
        by_row = np.where(there[:, :, None, None], factors[self.rows], 0.0)
        (q, a), m = self.rows.shape, factors.shape[1]
        values = (by_row @ self.values).reshape(q, a * m, self.dofs.shape[1])
        rows = np.where(there[:, :, None], self.rows[:, :, None] * m + np.arange(m), -1)
        return values, rows.reshape(q, a * m), self.dofs


@dataclass(frozen=True, eq=False)
class MortarSlopes:
    """Derivatives of what a meeting holds; arrays are made when they are asked for."""

    at: MortarMeeting

    def combined(
        self, by_normal: Array, by_distance: Array, by_motion: Array, earlier: MortarMeeting
    ) -> sparse.csr_array:
        """Derivative of by_normal n + by_distance G + by_motion s, (nc m, nodes d).

        All factors (nc, m, d); that of G, the mean distance, of nodes that meet.
        """
        newcomers = self.at.newcomers(earlier)
        entries = [] if newcomers is None else newcomers.entries(by_motion)
        by_motion = by_motion * (self.at.met * earlier.remembered)[:, None, None]
        by_distance = by_distance - by_motion
        if earlier.approach.nnz:
            closed = self.at.closed_by(earlier)[:, None, None]
            entries.append(averaged(earlier.approach, -closed * by_motion))
            beside = np.asarray(earlier.approach @ self.at.x) * earlier.by_opening[:, None]
            by_gap = by_motion @ beside[:, :, None]
            by_normal = by_normal + by_gap * self.at.distances[:, None]
            by_distance = by_distance + by_gap * self.at.normals[:, None]
        entries += [*(part.times(by_normal) for part in self.at.facing.slopes),
                    *self._by_means(by_distance),
                    averaged(earlier.averages, by_motion / earlier.passed[:, None, None])]
        nc, m = by_normal.shape[:2]
        return sum_of_blocks(entries, (nc * m, self.at.x.size))

    def _alone(self, count: int = 0, **factors: Array) -> sparse.csr_array:
        """`combined` without the motion; factors left out are zero."""
        nc, d = self.at.normals.shape
        nothing = np.zeros((nc, count or d, d))
        return self.combined(factors.get("by_normal", nothing),
                             factors.get("by_distance", nothing), nothing, self.at)  # fmt: skip

    @property
    def _eyes(self) -> Array:
        nc, d = self.at.normals.shape
        return np.broadcast_to(np.eye(d), (nc, d, d))

    @property
    def normals(self) -> sparse.csr_array:
        """dn/dx, (nc d, nodes d)."""
        return self._alone(by_normal=self._eyes)

    @property
    def distances(self) -> sparse.csr_array:
        """dG/dx, (nc d, nodes d), of nodes that meet; zero for the others."""
        return self._alone(by_distance=self._eyes)

    def _by_means(self, factors: Array) -> list[Blocks]:
        """Entries of factors (nc, m, d) times dG/dx, (nc m, nodes d), of nodes that meet."""
        if not self.at.shared.leaving.any():
            return self.by_distances(factors)
        factors = factors / self.at.passed[:, None, None]
        grown = factors @ self.at.distances[:, :, None]
        return [*self.by_distances(factors), self._passed.times(-grown)]

    def by_distances(self, factors: Array) -> list[Blocks]:
        """The same of pi G."""
        return [self._distances.times(factors), averaged(self.at.met_averages, factors)]

    @property
    def gap(self) -> sparse.csr_array:
        """dg/dx, (nc, nodes d), of nodes that meet; zero for the others."""
        apart = (self.at.distances * self.at.met[:, None])[:, None]
        return self._alone(1, by_normal=apart, by_distance=self.at.normals[:, None])

    def motion(self, earlier: MortarMeeting) -> sparse.csr_array:
        """ds/dx, (nc d, nodes d)."""
        nothing = np.zeros(self._eyes.shape)
        return self.combined(nothing, nothing, self._eyes, earlier)

    @cached_property
    def _bulges(self) -> BulgeSlopes:
        """What theta adds."""
        return BulgeSlopes(self.at, self.integrals)

    @cached_property
    def integrals(self) -> tuple[Array, Array, Index]:
        """Of own (k, a, a + e, w) and cross (k, a, b + h, w) of every pair by dofs (k, w).

        Those of own add up to the ones of their facet.
        """
        parts, pair, d = self.at.shared, self.at.pair, self.at.x.shape[1]
        count = len(parts.slave if parts.cut is None else parts.cut.share)
        of, other = parts.slave[:count], parts.master[:count]
        own, cross = FacetPairs.of(pair.slave, of, pair.master, other, self.at.x).slopes()
        dofs = dofs_of(
            np.concatenate([pair.slave.nodes[of], pair.master.nodes[other]], axis=1), d
        )
        if parts.cut is None:
            return own, cross, dofs
        whole = pair.slave.size_slopes(self.at.x, parts.cut.facets)
        own, cross, beside = parts.cut.slopes(own, cross, parts.cross[:count], whole)
        nothing = np.zeros((len(beside), *own.shape[1:]))
        return np.concatenate([own, nothing]), cross, np.concatenate([dofs, dofs[beside]])

    @cached_property
    def weights(self) -> Rows:
        """dD/dx, (nc, nodes d)."""
        own, _, dofs = self.integrals
        mass = own[:, :, : self.at.pair.slave.nodes.shape[1]]
        rows = self.at.rows[self.at.shared.of]
        shape = len(self.at.slaves), self.at.x.size
        return rows_of_blocks([(mass.sum(axis=2), rows, dofs)], shape)

    @cached_property
    def _distances(self) -> SlotSlopes:
        """Of pi G by the integrals, a part per pair of facets; B is held."""
        parts, pair, d = self.at.shared, self.at.pair, self.at.x.shape[1]
        at, there = self._bulges.places
        theta = parts.blend[0][:, None, None]
        at[:, pair.slave.nodes.shape[1] :] *= theta
        there[:, pair.master.nodes.shape[1] :] *= theta[parts.of]
        h = parts.own @ at
        np.subtract.at(h, parts.of, parts.cross @ there)
        kept, psi, row = parts.kept, parts.psi, self.at.rows
        y = np.where(kept[:, :, None], parts.inverse @ h, 0.0)
        scale = np.where(kept, self.at.by_weight[row], 0.0)
        apart = self.at.distances * self.at.passed[:, None]
        apart = y - np.where(kept[:, :, None], apart[row], 0.0)
        apart = apart * scale[:, :, None]
        a, scaled = psi.shape[1], psi * scale[:, :, None]
        # by own_rt, where the first a of t are mass_rt, of all r: psi_pr times (t, c)
        beside = at.copy()
        beside[:, :a] -= y
        own, cross, dofs = self.integrals
        moved = beside.swapaxes(1, 2)[parts.of][:, None] @ own
        moved -= there.swapaxes(1, 2)[:, None] @ cross  # (k, r, c, w)
        k, w = dofs.shape
        values = (scaled[parts.of] @ moved.reshape(k, a, d * w)).reshape(k, a, d, w)
        values += apart[parts.of][..., None] * own[:, :, :a].sum(axis=2)[:, :, None]
        if self.at.has_bulges:
            values += scale[parts.of][:, :, None, None] * self._bulges.distances()
        return SlotSlopes(values, row[parts.of], dofs)

    @cached_property
    def _passed(self) -> SlotSlopes:
        """Of pi: (1) for h = int phi, which has y = 1 but where nodes leave their share."""
        parts, kept, row = self.at.shared, self.at.shared.kept, self.at.rows
        y = np.where(kept, (parts.inverse @ parts.mass.sum(axis=2)[:, :, None])[:, :, 0], 0.0)
        scale = np.where(kept, self.at.by_weight[row], 0.0)
        real = self.at.pair.slave.real[parts.facets]
        own, _, dofs = self.integrals
        mass = own[:, :, : kept.shape[1]]
        moved = ((1 - y) * real)[parts.of][:, None, None] @ mass  # (k, r, 1, w)
        values = (parts.psi * scale[:, :, None])[parts.of] @ moved[:, :, 0]
        more = (y - np.where(kept, self.at.passed[row], 0.0)) * scale
        values += more[parts.of][:, :, None] * mass.sum(axis=2)
        return SlotSlopes(values[:, :, None], row[parts.of], dofs)

    def pushed(self, force: Array) -> sparse.csr_array:
        """Derivative of all forces by x, (nodes d, nodes d); force (nc, d): lambda, held."""
        n = self.at.x.size
        return sum_of_products(self.products(force), (n, n))

    def products(self, force: Array) -> list[Product]:
        """Those that add up to `pushed`."""
        return self._spread(force) + self.at.couples.products(force)

    def spread(self, force: Array) -> sparse.csr_array:
        """Derivative of sum_p B_pj lambda_p at all nodes j by x, (nodes d, nodes d).

        force (nc, d): lambda, held.
        """
        n = self.at.x.size
        return sum_of_products(self._spread(force), (n, n))

    def _spread(self, force: Array) -> list[Product]:
        """The products of `spread`.

        With z_r = sum_p psi_pr lambda_p / D_p on every facet that
        is z own at nodes of the slave and -z cross at those of the master; by (1) its change is

            d(z h) = v Q h + z dh,    v_t = lambda_t d(W_t / D_t) - sum_r z_r dmass_rt.    (2)

        That z changes by v Q, which is large on slivers, is left out, as Q h is not.
        """
        parts, slave, master = self.at.shared, self.at.pair.slave, self.at.pair.master
        scaled = force * self.at.by_weight[:, None]
        carries = (parts.kept & (self.at.rows >= 0))[:, :, None]
        w = np.where(carries, scaled[self.at.rows], 0.0)  # (f, p, c)
        z = parts.psi.swapaxes(1, 2) @ w  # (f, r, c)
        by_x, theta = self._changes(z, w), parts.blend[0]
        a, b = slave.nodes.shape[1], master.nodes.shape[1]
        left = np.where(~parts.kept & slave.real[parts.facets], slave.nodes[parts.facets], -1)
        out = self._onto(z, by_x, (left, slice(a)), (master.nodes[parts.master], slice(b)),
                         np.ones(len(theta)))  # fmt: skip
        if self.at.has_bulges:
            sides = ((slave.middles[parts.facets], slice(a, None)),
                     (master.middles[parts.master], slice(b, None)))  # fmt: skip
            bent = self._onto(parts.chi.swapaxes(1, 2) @ w, by_x, *sides, theta)
            bent += self._bulges.spread(w, *sides)
            lifts = by_components(sparse.csr_array(self.at.bulges.T), np.ones(self.at.x.shape))
            n = self.at.x.size
            out.append((lifts, rows_of_products(bent, (n, n))))
        return out

    def _changes(self, z: Array, w: Array) -> Rows:
        """v by x of (2), (f a d, nodes d), for z (f, a, d); w (f, p, d): lambda / D."""
        parts, row = self.at.shared, self.at.rows
        f, a, d = z.shape
        n, nc = self.at.x.size, len(self.at.pair.slaves)
        own, _, dofs = self.integrals
        mass = own[:, :, :a]
        # (k, t, c, w)
        values = w[parts.of][..., None] * mass.sum(axis=2)[:, :, None]
        k, ways = dofs.shape
        held = z.swapaxes(1, 2)[parts.of] @ mass.reshape(k, a, a * ways)
        values -= held.reshape(k, d, a, ways).swapaxes(1, 2)
        rows = parts.of[:, None] * a * d + np.arange(a * d)
        blocks = values.reshape(k, a * d, ways), rows, dofs
        # D_t in lambda W / D_t
        scale = np.where(row >= 0, self.at.by_weight[row], 0.0) * parts.weights
        by_weight = -(w * scale[:, :, None]).reshape(-1, d, 1)
        rows = np.arange(f * a * d).reshape(-1, d)
        into = np.maximum(row, 0).reshape(-1, 1)
        by_weights = rows_of_blocks([(by_weight, rows, into)], (f * a * d, nc))
        rest = rows_of_blocks([blocks], (f * a * d, n))
        return rows_of_products([(None, rest), (by_weights, self.weights)], (f * a * d, n))

    def _onto(
        self, z: Array, by_x: Rows, mine: tuple[Index, slice], theirs: tuple[Index, slice],
        theta: Array,
    ) -> list[Product]:  # fmt: skip
        """Of z own at nodes of the slave's facets (f, s), and -z cross at the master's (k, b).

        by_x: v of (2) by x, of which z hears theta (f,); with the nodes come their slots in own
        and cross.
        """
        parts = self.at.shared
        f, a, d = z.shape
        own, cross, dofs = self.integrals
        forms, local = [], []
        for (nodes, slots), held, slopes, of in (
            (mine, parts.own, own, np.arange(f)), (theirs, -parts.cross, -cross, parts.of)
        ):  # fmt: skip
            s = nodes.shape[1]
            held = theta[of, None, None] * (parts.inverse[of] @ held[:, :, slots])
            held = held.swapaxes(1, 2)  # Q h, (., s, r)
            at = np.where(nodes[:, :, None] >= 0, nodes[:, :, None] * d + np.arange(d), -1)
            columns = of[:, None, None] * a * d + np.arange(a * d).reshape(a, d)
            for c in range(d):
                forms.append((held, at[..., c], columns[..., c]))
            by_pair = slopes[:, :, slots].swapaxes(1, 2)  # (k, s, r, w)
            values = z.swapaxes(1, 2)[parts.of][:, None] @ by_pair  # (k, s, c, w)
            at = at if of is parts.of else at[parts.of]
            values = values.reshape(len(dofs), s * d, dofs.shape[1])
            local.append((values, at.reshape(len(dofs), s * d), dofs))
        n = self.at.x.size
        by_z = rows_of_blocks(forms, (n, f * a * d))
        return [(by_z, by_x), (None, rows_of_blocks(local, (n, n)))]


def averaged(averages: sparse.csr_array, factors: Array) -> Blocks:
    """Entries of the derivatives of factors_p (nc, m, d) times sum_j averages_pj x_j."""
    m, d = factors.shape[1:]
    rows = np.repeat(np.arange(len(factors)), np.diff(averages.indptr))
    values = averages.data[:, None, None] * factors[rows]
    columns = averages.indices.astype(np.int64)[:, None] * d + np.arange(d)
    return values, rows[:, None] * m + np.arange(m), columns


def blocks_of(values: Array) -> sparse.csr_array:
    """Blocks (nc, m, d) on the diagonal of a matrix (nc m, nc d)."""
    nc, m, d = values.shape
    columns = np.broadcast_to(np.arange(nc * d).reshape(nc, 1, d), values.shape)
    entries = (values.ravel(), columns.ravel(), np.arange(0, nc * m * d + 1, d))
    return sparse.csr_array(entries, shape=(nc * m, nc * d))
