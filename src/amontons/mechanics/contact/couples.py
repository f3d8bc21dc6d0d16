"""Couples on the master that leave the forces between two deforming bodies without a moment.

Forces lambda_p at a slave and -B_pj lambda_p at the other nodes of `current_mortar` have no
sum, but the moment G_p x lambda_p: they act at two places that are the distance vector G_p
apart.  As on a rigid lever of that length, the master gets its part with the line of action
that the slave's has.  With the part w_pq of the master's corners q in what p faces,

    w_pq = int phi_p N_q,  x_p = sum_q w_pq x_q / sum_q w_pq,  d_pq = x_q - x_p,
    J_p = sum_q w_pq (|d_pq|^2 1 - d_pq d_pq^T),    omega_p = - J_p^-1 (G_p x lambda_p),    (1)
    a force w_pq omega_p x d_pq on every q,

which is the couple -G_p x lambda_p without a sum, of all such forces the smallest in the norm
of 1 / w.  In virtual work,

    sum_p lambda_p . (sum_j B_pj dx_j - theta_p x G_p),
    theta_p = J_p^-1 sum_q w_pq d_pq x dx_q:                                                (2)

forces work on the motion of the slave that somebody sees who turns with the part of the master
it faces, theta_p being the mean rotation of that.  A rigid motion of everything is none, so
that force and moment vanish for any forces, with gaps, clearances and springs as well.  Where
sides touch all along G = 0 and nothing changes.  Slaves get nothing, so that lambda_p is told
by the equation of its own node as before.

In dynamics the places of the nodes in G and d are those about which momenta are counted, while
B and w are those of the meeting.  R_r v is the product of the axis r with v; 2D has one axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import Blocks, sum_of_blocks, sum_of_products

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FLAT = 1e-14  # of the trace of J, added to it: without a node off a line it has no inverse
AXES = {
    2: np.array([[[0.0, -1.0], [1.0, 0.0]]]),
    3: np.array([
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Couples:
    """Those of a meeting with all nodes at x (nodes, d)."""

    at: MortarMeeting
    x: Array

    def about(self, x: Array) -> Couples:
        """The same with places of the nodes x (nodes, d) in G and d."""
        return self if x is self.x else Couples(self.at, x)

    @property
    def _axes(self) -> Array:
        """R, (r, d, d)."""
        return AXES[self.x.shape[1]]

    @cached_property
    def _rows(self) -> Index:
        """p of every pair of facets and corner of its slave, (k, a), -1 for none."""
        return self.at.rows[self.at.shared.of]

    @cached_property
    def _weights(self) -> Array:
        """Parts of w_pq, (k, a, b)."""
        cross = self.at.shared.cross[:, :, : self.at.pair.master.nodes.shape[1]]
        return np.where((self._rows >= 0)[:, :, None], cross, 0.0)

    @property
    def _nodes(self) -> Index:
        """q, (k, b)."""
        return self.at.pair.master.nodes[self.at.shared.master]

    def _summed(self, parts: Array) -> Array:
        """Sums over the pairs of facets, (nc, ...), of parts (k, a, ...)."""
        kept = self._rows >= 0
        out = np.zeros((len(self.at.slaves), *parts.shape[2:]))
        np.add.at(out, self._rows[kept], parts[kept])
        return out

    def _of(self, values: Array) -> Array:
        """Values (nc, ...) at every pair and corner, (k, a, ...), zero for none."""
        kept = (self._rows >= 0).reshape(self._rows.shape + (1,) * (values.ndim - 1))
        return np.where(kept, values[self._rows], 0.0)

    @cached_property
    def _arms(self) -> Array:
        """d_pq, (k, a, b, d)."""
        there = self.x[self._nodes]
        means = self._summed(self._weights @ there) * self.at.by_weight[:, None]
        return there[:, None] - self._of(means)[:, :, None]

    @cached_property
    def _turned(self) -> Array:
        """R_r d_pq, (k, a, b, r, d)."""
        return np.einsum("rcd,kabd->kabrc", self._axes, self._arms)

    @cached_property
    def _inverse(self) -> Array:
        """J^-1, (nc, r, r)."""
        own = self._turned
        J = self._summed(np.einsum("kab,kabrc,kabsc->kars", self._weights, own, own))
        size = np.trace(J, axis1=1, axis2=2)
        least = np.where(size > 0, FLAT * size, 1.0)
        regular = J + least[:, None, None] * np.eye(len(self._axes))
        return np.asarray(np.linalg.inv(regular), dtype=np.float64)

    @cached_property
    def _levers(self) -> Array:
        """J^-1 R_r G, (nc, r, d): -omega per force."""
        apart = (self.at.references @ self.x) * self.at.met[:, None]
        turned: Array = np.einsum("rcd,pd->prc", self._axes, apart)
        return self._inverse @ turned

    def _dofs(self) -> Index:
        """(k, b d)."""
        d = self.x.shape[1]
        return (self._nodes[:, :, None] * d + np.arange(d)).reshape(len(self._nodes), -1)

    def _numbers(self, m: int, first: int = 0) -> Index:
        """Rows of m values of every p from `first` on, (k, a m), -1 for none."""
        at = first + self._rows[:, :, None] * m + np.arange(m)
        at = np.where((self._rows >= 0)[:, :, None], at, -1)
        return at.reshape(len(at), at.shape[1] * m)

    def _onto_nodes(self, values: Array, first: int = 0) -> Blocks:
        """Entries (k, a, b, m, d) of m values of p at the nodes q, columns from `first` on."""
        k, a, b, m, d = values.shape
        moved = values.transpose(0, 2, 4, 1, 3).reshape(k, b * d, a * m)
        return moved, self._dofs(), np.maximum(self._numbers(m, first), 0)

    @cached_property
    def matrix(self) -> sparse.csr_array:
        """Forces of the couples, (nodes d, nc d), per force lambda on the slaves."""
        d = self.x.shape[1]
        shape = self.x.size, len(self.at.slaves) * d
        if not self.at.met.any():
            return sparse.csr_array(shape)
        by_force = self._weights[..., None, None] * np.einsum(
            "kabrc,kare->kabec", self._turned, -self._of(self._levers)
        )
        return sum_of_blocks([self._onto_nodes(by_force)], shape)

    def slopes(self, force: Array) -> sparse.csr_array:
        """Derivative of `matrix` times held forces (nc, d) by x, (nodes d, nodes d).

        Of couples where the meeting is.
        """
        (nc, d), n, w = force.shape, self.x.size, self._weights
        if not self.at.met.any():
            return sparse.csr_array((n, n))
        omega = -np.einsum("prd,pd->pr", self._levers, force)
        spin = self._of(np.einsum("pr,rcd->pcd", omega, self._axes))  # v: omega x v
        pushed = np.einsum("kacd,kabd->kabc", spin, self._arms)
        (k, _, b), there = w.shape, self._dofs()
        by_w, dofs = self._by_weights
        local = np.einsum("kabc,kabw->kbcw", pushed, by_w).reshape(k, b * d, dofs.shape[1])
        turning = np.einsum("kab,kacd->kbcd", w, spin).reshape(k * b, d, d)
        nodes = there.reshape(k * b, d)
        held = sum_of_blocks([(local, there, dofs), (turning, nodes, nodes)], (n, n))
        apart = -self._inverse @ np.einsum("pc,scd->psd", force, self._axes)
        changes = [*self._of_means(), *self._of_omega(spin, pushed, nc * d),
                   *_below(self.at.slopes.by_distances(apart), nc * d)]  # fmt: skip
        by_means = -w[..., None, None] * spin.swapaxes(2, 3)[:, :, None]
        by_omega = w[..., None, None] * self._turned
        onto = [self._onto_nodes(by_means), self._onto_nodes(by_omega, nc * d)]
        count = nc * (d + len(self._axes))
        products = sum_of_blocks(onto, (n, count)), sum_of_blocks(changes, (count, n))
        return sum_of_products([(None, held), products], (n, n))

    @property
    def _by_weights(self) -> tuple[Array, Index]:
        """Derivatives of parts of w (k, a, b, w) by dofs (k, w)."""
        _, cross, dofs = self.at.slopes.integrals
        return cross[:, :, : self._weights.shape[2]], dofs

    def _of_means(self) -> list[Blocks]:
        """Derivatives of x_p, rows (nc d,)."""
        (k, a, b), d, w = self._weights.shape, self.x.shape[1], self._weights
        by_w, dofs = self._by_weights
        share, rows = self._of(self.at.by_weight), self._numbers(d)
        through = np.einsum("kabc,kabw,ka->kacw", self._arms, by_w, share)
        direct = np.einsum("kab,ka,cd->kacbd", w, share, np.eye(d))
        return [(through.reshape(k, a * d, dofs.shape[1]), rows, dofs),
                (direct.reshape(k, a * d, b * d), rows, self._dofs())]  # fmt: skip

    def _of_omega(self, spin: Array, pushed: Array, first: int) -> list[Blocks]:
        """Derivatives of omega with G held, rows (nc r,) from `first` on.

        spin (k, a, d, d): v to omega x v; pushed (k, a, b, d): that of the arms.
        """
        (k, a, b), d, w = self._weights.shape, self.x.shape[1], self._weights
        by_w, dofs = self._by_weights
        r, inverse = len(self._axes), self._of(self._inverse)
        rows = self._numbers(r, first)
        through = np.einsum("kabsc,kabc,kabw->kasw", self._turned, pushed, by_w)
        direct = np.einsum("scd,kabc->kabsd", self._axes, pushed)
        direct = direct + np.einsum("kabsc,kacd->kabsd", self._turned, spin)
        direct = np.einsum("kab,kabsd->kasbd", w, direct).reshape(k, a, r, b * d)
        return [((-inverse @ through).reshape(k, a * r, dofs.shape[1]), rows, dofs),
                ((-inverse @ direct).reshape(k, a * r, b * d), rows, self._dofs())]  # fmt: skip


def _below(entries: Sequence[Blocks], first: int) -> list[Blocks]:
    """Entries with their rows moved down by `first`."""
    return [
        (values, np.where(rows < 0, -1, rows + first), columns)
        for values, rows, columns in entries
    ]
