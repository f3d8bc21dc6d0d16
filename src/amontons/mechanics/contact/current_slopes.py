"""Derivatives of the averages between two deforming bodies by the positions of all nodes.

With mass and cross of `facet_integrals` on a slave facet, W_p = sum_t mass_pt of nodes that
carry force and psi = A phi = W Q phi the dual functions, all follows from

    d(A h) = dW Q h - A dmass Q h + A dh       for h linear in mass and cross.              (1)

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
        skin, n = self.at.pair.slave, self.at.normals
        (f, a), (nc, d) = skin.nodes.shape, n.shape
        length = np.linalg.norm(self.at.sums, axis=1)
        project = (np.eye(d) - n[:, :, None] * n[:, None, :]) / length[:, None, None]
        project = project * self.at.pair.free[:, None, :]
        share = -skin.area_slopes(self.at.x).reshape(f, 1, d, a * d)
        row = np.where(skin.real, self.at.row[skin.nodes], -1)
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
        """Derivatives of mass (f a a, nodes d) and cross (k a b, nodes d)."""
        parts, pair = self.at.shared, self.at.pair
        slave, master = pair.slave.nodes[parts.slave], pair.master.nodes[parts.master]
        mass, cross = self.at.facet_pairs(parts.slave, parts.master).slopes()
        (k, a), b = slave.shape, master.shape[1]
        dofs = _dofs(np.concatenate([slave, master], axis=1), self.at.x.shape[1])
        out = []
        for values, group, inner, count in (
            (mass, parts.of, a * a, len(parts.facets)), (cross, np.arange(k), a * b, k),
        ):  # fmt: skip
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
        at = self.at.x[pair.slave.nodes[parts.facets]]
        there = self.at.x[pair.master.nodes[parts.master]]
        h = parts.mass @ at
        np.subtract.at(h, parts.of, parts.cross @ there)
        kept, psi, row = parts.kept, parts.psi, self.at.rows
        y = np.where(kept[:, :, None], parts.inverse @ h, 0.0)
        scale = np.where(kept, self.at.by_weight[row], 0.0)
        own = (y - np.where(kept[:, :, None], self.at.distances[row], 0.0)) * scale[:, :, None]
        a = psi.shape[1]
        # (f, p, c, r, t): by mass_rt
        by_mass = np.einsum("fpr,ftc->fpcrt", psi * scale[:, :, None], at - y)
        by_mass += np.einsum("fpc,pr,t->fpcrt", own, np.eye(a), np.ones(a))
        by_cross = -np.einsum("kpr,kbc->kpcrb", (psi * scale[:, :, None])[parts.of], there)
        mass, cross = self._slopes
        nc, facets, numbers = len(pair.slaves), np.arange(len(own)), np.arange(len(there))
        whole = sparse.kron(self.at.met_averages, sparse.eye_array(d))
        whole = whole + _placed(by_mass, row, facets, nc, mass.shape[0]) @ mass
        whole = whole + _placed(by_cross, row[parts.of], numbers, nc, cross.shape[0]) @ cross
        return sparse.csr_array(whole)

    def spread(self, force: Array) -> sparse.csr_array:
        """Derivative of sum_p B_pj lambda_p at all nodes j by x, (nodes d, nodes d).

        force (nc, d): lambda, held.
        """
        parts, pair, n = self.at.shared, self.at.pair, len(self.at.x)
        kept, psi, row = parts.kept, parts.psi, self.at.rows
        a, eye = psi.shape[1], np.eye(psi.shape[1])
        scaled = force * self.at.by_weight[:, None]
        w = np.where(kept[:, :, None], scaled[row], 0.0)  # (f, p, c)
        through = np.einsum("fpr,fpc->frc", psi, w)
        # the other nodes of the slave: (f, s, c, r, t)
        inner = np.where(kept[:, :, None], parts.inverse @ parts.mass, 0.0)
        here = np.einsum("frc,frs,t->fscrt", w, inner, np.ones(a))
        here += np.einsum("frc,fts->fscrt", through, eye - inner)
        left = np.where(~kept & pair.slave.real[parts.facets],
                        pair.slave.nodes[parts.facets], -1)  # fmt: skip
        # master nodes: (k, b, c, r, t) by mass, (k, b, c, r, b') by cross
        outer = np.where(kept[parts.of][:, :, None], parts.inverse[parts.of] @ parts.cross, 0.0)
        there = -np.einsum("krc,krb,t->kbcrt", w[parts.of], outer, np.ones(a))
        there += np.einsum("krc,ktb->kbcrt", through[parts.of], outer)
        b = outer.shape[2]
        direct = -np.einsum("krc,be->kbcre", through[parts.of], np.eye(b))
        mass, cross = self._slopes
        facets, numbers = np.arange(len(parts.facets)), np.arange(len(parts.of))
        nodes = pair.master.nodes[parts.master]
        out = _placed(here, left, facets, n, mass.shape[0]) @ mass
        out = out + _placed(there, nodes, parts.of, n, mass.shape[0]) @ mass
        out = out + _placed(direct, nodes, numbers, n, cross.shape[0]) @ cross
        return sparse.csr_array(out - self._by_weights(scaled))

    def _by_weights(self, scaled: Array) -> sparse.csr_array:
        """sum_p B_pj lambda_p dD_p / D_p, (nodes d, nodes d); scaled (nc, d): lambda / D."""
        row = self.at.rows
        nc, d = scaled.shape
        a = row.shape[1]
        ones = np.broadcast_to(np.ones(a), (*row.shape, a))
        rows = np.broadcast_to(row[:, :, None], ones.shape)
        columns = np.arange(row.size * a).reshape(ones.shape)
        mass = self._slopes[0]
        weights = summed(ones, rows, columns, (nc, mass.shape[0])) @ mass
        off = self.at.met_averages.tocoo()
        p, j = (np.asarray(k, dtype=np.int64) for k in off.coords)
        away = j != self.at.pair.slaves[p]
        p, j, value = p[away], j[away], off.data[away]
        entries = value[:, None] * scaled[p]
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
