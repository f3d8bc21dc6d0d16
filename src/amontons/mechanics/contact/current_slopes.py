"""Derivatives of the averages between two deforming bodies by the positions of all nodes.

With own = [mass, integrals with middles] and cross of `facet_integrals` on a slave facet,
W_p = sum_t mass_pt of nodes that carry force and psi = A phi = W Q phi the dual functions, all
follows from

    d(A h) = dW Q h - A dmass Q h + A dh       for h linear in own and cross.               (1)

Notation is that of `current_mortar`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MortarSlopes:
    """Derivatives of what a meeting holds; arrays are made when they are asked for."""

    at: MortarMeeting

    @cached_property
    def normals(self) -> sparse.csr_array:
        """dn/dx, (nc d, nodes d)."""
        (skin, heeded), n = self.at.pair.around, self.at.normals
        (f, a), (nc, d) = skin.nodes.shape, n.shape
        length = np.linalg.norm(self.at.sums, axis=1)
        project = (np.eye(d) - n[:, :, None] * n[:, None, :]) / length[:, None, None]
        project = project * self.at.pair.free[:, None, :]
        share = -skin.area_slopes(self.at.x).reshape(f, 1, d, a * d)
        own = np.full(len(self.at.x), -1)
        own[self.at.slaves] = np.arange(nc)
        row = np.where(heeded, own[skin.nodes], -1)
        values = np.where((row >= 0)[:, :, None, None], project[row], 0.0)
        values = values @ (share / skin.corners[:, None, None, None])  # (f, a, d, a d)
        columns = np.broadcast_to(_dofs(skin.nodes, d)[:, None, None], values.shape)
        rows = np.broadcast_to((row[:, :, None] * d + np.arange(d))[..., None], values.shape)
        return summed(values, rows, columns, (nc * d, self.at.x.size))

    def motion(self, earlier: MortarMeeting) -> sparse.csr_array:
        """ds/dx, (nc d, nodes d)."""
        d = self.at.x.shape[1]
        both = sparse.diags_array(np.repeat((self.at.met & earlier.met).astype(float), d))
        moved = sparse.kron(earlier.references, sparse.eye_array(d))
        return sparse.csr_array(moved - both @ self.distances)

    @cached_property
    def gap(self) -> sparse.csr_array:
        """dg/dx, (nc, nodes d), of nodes that meet; zero for the others."""
        met = self.at.met[:, None]
        by_normal = blocks_of((self.at.distances * met)[:, None]) @ self.normals
        along = blocks_of(self.at.normals[:, None]) @ self.distances
        return sparse.csr_array(by_normal + along)

    @cached_property
    def _slopes(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Derivatives of own (f a (a + e), nodes d) and cross (k a (b + h), nodes d)."""
        parts, pair = self.at.shared, self.at.pair
        slave, master = pair.slave.nodes[parts.slave], pair.master.nodes[parts.master]
        own, cross = self.at.facet_pairs(parts.slave, parts.master).slopes()
        k = len(slave)
        dofs = _dofs(np.concatenate([slave, master], axis=1), self.at.x.shape[1])
        out = []
        for values, group, count in (
            (own, parts.of, len(parts.facets)), (cross, np.arange(k), k),
        ):  # fmt: skip
            inner = values.shape[1] * values.shape[2]
            values = values.reshape(k, inner, dofs.shape[1])
            rows = np.broadcast_to(
                (group[:, None] * inner + np.arange(inner))[:, :, None], values.shape
            )
            columns = np.broadcast_to(dofs[:, None], values.shape)
            out.append(summed(values, rows, columns, (count * inner, self.at.x.size)))
        return out[0], out[1]

    @cached_property
    def distances(self) -> sparse.csr_array:
        """dG/dx, (nc d, nodes d), of nodes that meet; zero for the others."""
        parts, pair, d = self.at.shared, self.at.pair, self.at.x.shape[1]
        at = pair.slave.values(self.at.x)[parts.facets]
        there = pair.master.values(self.at.x)[parts.master]
        h = parts.own @ at
        np.subtract.at(h, parts.of, parts.cross @ there)
        kept, psi, row = parts.kept, parts.psi, self.at.rows
        y = np.where(kept[:, :, None], parts.inverse @ h, 0.0)
        scale = np.where(kept, self.at.by_weight[row], 0.0)
        apart = y - np.where(kept[:, :, None], self.at.distances[row], 0.0)
        apart = apart * scale[:, :, None]
        a = psi.shape[1]
        # (f, p, c, r, t): by own_rt, where the first a of t are mass_rt
        beside = at.copy()
        beside[:, :a] -= y
        by_own = np.einsum("fpr,ftc->fpcrt", psi * scale[:, :, None], beside)
        by_own[..., :a] += np.einsum("fpc,pr,t->fpcrt", apart, np.eye(a), np.ones(a))
        by_cross = -np.einsum("kpr,kbc->kpcrb", (psi * scale[:, :, None])[parts.of], there)
        own, cross = self._slopes
        nc, facets, numbers = len(pair.slaves), np.arange(len(y)), np.arange(len(there))
        whole = sparse.kron(self.at.met_averages, sparse.eye_array(d))
        whole = whole + _placed(by_own, row, facets, nc, own.shape[0]) @ own
        whole = whole + _placed(by_cross, row[parts.of], numbers, nc, cross.shape[0]) @ cross
        return sparse.csr_array(whole)

    def spread(self, force: Array) -> sparse.csr_array:
        """Derivative of sum_p B_pj lambda_p at all nodes j by x, (nodes d, nodes d).

        force (nc, d): lambda, held.
        """
        parts, slave, master = self.at.shared, self.at.pair.slave, self.at.pair.master
        scaled = force * self.at.by_weight[:, None]
        by_own, others, by_cross = self._by_integrals(scaled)
        own, cross = self._slopes
        facets, numbers = np.arange(len(parts.facets)), np.arange(len(parts.of))
        a, b, n = slave.nodes.shape[1], master.nodes.shape[1], len(self.at.x)

        def onto(mine: Index, its: slice, theirs: Index, their: slice) -> sparse.csr_array:
            """At nodes mine of the slave's facets, and theirs of the master's."""
            out = _placed(by_own[:, its], mine, facets, n, own.shape[0])
            out += _placed(others[:, their], theirs, parts.of, n, own.shape[0])
            across = _placed(by_cross[:, their], theirs, numbers, n, cross.shape[0])
            return sparse.csr_array(out @ own + across @ cross)

        left = np.where(~parts.kept & slave.real[parts.facets], slave.nodes[parts.facets], -1)
        out = onto(left, slice(a), master.nodes[parts.master], slice(b))
        if self.at.has_bulges:
            bent = onto(slave.middles[parts.facets], slice(a, None),
                        master.middles[parts.master], slice(b, None))  # fmt: skip
            out = out + sparse.kron(self.at.bulges.T, sparse.eye_array(force.shape[1])) @ bent
        return sparse.csr_array(out - self._by_weights(scaled))

    def _by_integrals(self, scaled: Array) -> tuple[Array, Array, Array]:
        """Derivatives of sum_p D_p B_pj lambda_p / D_p by own and cross; scaled: lambda / D.

        At corners and middles of the slave by own, (f, s, c, r, t), of the master by own,
        (k, b, c, r, t), and by cross, (k, b, c, r, b').
        """
        parts = self.at.shared
        kept, psi = parts.kept, parts.psi
        a, width, across = psi.shape[1], parts.own.shape[2], parts.cross.shape[2]
        w = np.where(kept[:, :, None], scaled[self.at.rows], 0.0)  # (f, p, c)
        through = np.einsum("fpr,fpc->frc", psi, w)
        inner = np.where(kept[:, :, None], parts.inverse @ parts.own, 0.0)
        here = np.einsum("frc,ts->fscrt", through, np.eye(width))
        here[..., :a] += np.einsum("frc,frs,t->fscrt", w, inner, np.ones(a))
        here[..., :a] -= np.einsum("frc,fts->fscrt", through, inner)
        outer = np.where(kept[parts.of][:, :, None], parts.inverse[parts.of] @ parts.cross, 0.0)
        there = np.einsum("krc,ktb->kbcrt", through[parts.of], outer)
        there -= np.einsum("krc,krb,t->kbcrt", w[parts.of], outer, np.ones(a))
        there = np.pad(there, [(0, 0)] * 4 + [(0, width - a)])
        return here, there, -np.einsum("krc,be->kbcre", through[parts.of], np.eye(across))

    def _by_weights(self, scaled: Array) -> sparse.csr_array:
        """sum_p B_pj lambda_p dD_p / D_p, (nodes d, nodes d); scaled (nc, d): lambda / D."""
        row = self.at.rows
        nc, d = scaled.shape
        a = row.shape[1]
        ones = np.broadcast_to(np.ones(a), (*row.shape, a))
        rows = np.broadcast_to(row[:, :, None], ones.shape)
        slots = np.arange(self.at.shared.own.size).reshape(self.at.shared.own.shape)
        own = self._slopes[0]
        weights = summed(ones, rows, slots[:, :, :a], (nc, own.shape[0])) @ own
        kept = (np.asarray(self.at.met, dtype=float), (np.arange(nc), self.at.pair.slaves))
        off = self.at.met_averages - sparse.coo_array(kept, shape=self.at.averages.shape)
        off = off.tocoo()
        p, j = (np.asarray(k, dtype=np.int64) for k in off.coords)
        entries = off.data[:, None] * scaled[p]
        rows = j[:, None] * d + np.arange(d)
        columns = np.broadcast_to(p[:, None], entries.shape)
        onto = summed(entries, rows, columns, (self.at.x.size, nc))
        return sparse.csr_array(onto @ weights)


def blocks_of(values: Array) -> sparse.csr_array:
    """Blocks (nc, m, d) on the diagonal of a matrix (nc m, nc d)."""
    nc, m, d = values.shape
    entries = (values, np.arange(nc), np.arange(nc + 1))
    return sparse.csr_array(sparse.bsr_array(entries, shape=(nc * m, nc * d)))


def _dofs(nodes: Index, d: int) -> Index:
    """Dofs (k, a d) of nodes (k, a)."""
    return (nodes[:, :, None] * d + np.arange(d)).reshape(len(nodes), nodes.shape[1] * d)


def summed(
    values: Array, rows: Index, columns: Index, shape: tuple[int, int]
) -> sparse.csr_array:
    """Sum of entries without those in negative rows."""
    kept = (rows >= 0) & (values != 0)
    entries = (values[kept], (rows[kept], columns[kept]))
    return sparse.coo_array(entries, shape=shape).tocsr()


def _placed(values: Array, nodes: Index, of: Index, n: int, width: int) -> sparse.csr_array:
    """Entries (k, s, c, r, t) at nodes (k, s), < 0 for none, as a matrix (n c, width).

    of (k,): which r t columns they stand in.
    """
    k, s, c = values.shape[:3]
    inner = values.shape[3] * values.shape[4]
    flat = values.reshape(k, s, c, inner)
    rows = np.where(nodes[:, :, None] >= 0, nodes[:, :, None] * c + np.arange(c), -1)
    columns = (of[:, None] * inner + np.arange(inner))[:, None, None]
    rows = np.broadcast_to(rows[..., None], flat.shape)
    return summed(flat, rows, np.broadcast_to(columns, flat.shape), (n * c, width))
