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

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import Blocks, Product, rows_of_blocks, sum_of_blocks, sum_of_products
from .couple_loops import arms_inplace, forces_inplace, slopes_inplace

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

    @cached_property
    def _arms_and_inverse(self) -> tuple[Array, Array]:
        """d_pq, (k, a, b, d), and J^-1, (nc, r, r)."""
        w, axes = self._weights, self._axes
        (nc, r), d = (len(self.at.slaves), len(axes)), self.x.shape[1]
        arms, J = np.empty((*w.shape, d)), np.zeros((nc, r, r))
        arms_inplace(self.x, self._nodes, self._rows, w, self.at.by_weight, axes, arms, J)
        size = np.trace(J, axis1=1, axis2=2)
        least = np.where(size > 0, FLAT * size, 1.0)
        regular = J + least[:, None, None] * np.eye(r)
        return arms, np.asarray(np.linalg.inv(regular), dtype=np.float64)

    @cached_property
    def _levers(self) -> Array:
        """J^-1 R_r G, (nc, r, d): -omega per force."""
        apart = (self.at.references @ self.x) * self.at.met[:, None]
        turned: Array = np.einsum("rcd,pd->prc", self._axes, apart)
        return self._arms_and_inverse[1] @ turned

    def _dofs(self) -> Index:
        """(k, b d)."""
        d = self.x.shape[1]
        return (self._nodes[:, :, None] * d + np.arange(d)).reshape(len(self._nodes), -1)

    def _numbers(self, m: int) -> Index:
        """Rows of m values of every p, (k, a m), -1 for none."""
        at = np.where((self._rows >= 0)[:, :, None], self._rows[:, :, None] * m + np.arange(m),
                      -1)  # fmt: skip
        return at.reshape(len(at), at.shape[1] * m)

    def _onto_nodes(self, values: Array, m: int) -> Blocks:
        """Entries (k, b d, a m) of m values of p at the nodes q."""
        return values, self._dofs(), np.maximum(self._numbers(m), 0)

    @cached_property
    def matrix(self) -> sparse.csr_array:
        """Forces of the couples, (nodes d, nc d), per force lambda on the slaves."""
        d = self.x.shape[1]
        shape = self.x.size, len(self.at.slaves) * d
        if not self.at.met.any():
            return sparse.csr_array(shape)
        w, arms = self._weights, self._arms_and_inverse[0]
        k, a, b = w.shape
        by_force = np.zeros((k, b * d, a * d))
        forces_inplace(w, self._rows, arms, self._levers, self._axes, by_force)
        return sum_of_blocks([self._onto_nodes(by_force, d)], shape)

    def slopes(self, force: Array) -> sparse.csr_array:
        """Derivative of `matrix` times held forces (nc, d) by x, (nodes d, nodes d).

        Of couples where the meeting is.
        """
        n = self.x.size
        return sum_of_products(self.products(force), (n, n))

    def products(self, force: Array) -> list[Product]:
        """Those that add up to `slopes`; none where nobody meets."""
        (nc, d), n, w = force.shape, self.x.size, self._weights
        if not self.at.met.any():
            return []
        (k, a, b), r = w.shape, len(self._axes)
        arms, inverse = self._arms_and_inverse
        omega = -(self._levers @ force[:, :, None])[:, :, 0]
        _, cross, dofs = self.at.slopes.integrals
        by_w, m = np.ascontiguousarray(cross[:, :, :b]), d + r
        held, changes = np.zeros((k, b * d, by_w.shape[3])), np.zeros((k, a * m, by_w.shape[3]))
        onto = np.zeros((k, b * d, a * m))
        slopes_inplace(w, by_w, self._rows, arms, self._axes, omega, self.at.by_weight, inverse,
                       held, changes, onto)  # fmt: skip
        apart = np.zeros((nc, m, d))  # of omega by G
        apart[:, d:] = -inverse @ np.einsum("pc,scd->psd", force, self._axes)
        through = [(changes, self._numbers(m), dofs), *self.at.slopes.by_distances(apart)]
        left = rows_of_blocks([self._onto_nodes(onto, m)], (n, nc * m))
        right = rows_of_blocks(through, (nc * m, n))
        return [(None, rows_of_blocks([(held, self._dofs(), dofs)], (n, n))), (left, right)]
