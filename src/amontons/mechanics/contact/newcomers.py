"""Motion of nodes that meet the master, and hardly faced anybody at the end of the last step.

Averages B' of `current_mortar` (3) there are none, or they are extrapolations from a sliver,
which tell small motions as large ones: that of a node whose law had the weight w' of `fading`
is w' times (3), and 1 - w' times s_p here.  Such a node p counts its motion against the facets
f of the master that it meets now, by the parts w_pf of it that face them: each takes along the
place x'_p that p had beside it.  With N_q the functions of its corners, c and n its centre and
unit normal, a prime where the last step ended, and grad along the facet there, at its centre,

    A_pfq = N_q(c) + grad' N_q . (x'_p - c'),       h_pf = n'_f . (x'_p - c'),
    y_pf = sum_q A_pfq x_q + h_pf n_f,              y'_pf = x'_p,                           (1)
    s_p = x_p - sum_f w_pf y_pf,    w_pf = int_f phi_p / D_p,    sum_f w_pf = 1.            (2)

Rotations of everything turn s_p with the facets, whatever they were since the last step, and
none of them is a motion; nor is a stretch along facets that p follows.  w is continuous in the
positions, and no choice among facets that are equally far.  With W_pf = int_f phi_p,

    ds_p = dx_p - sum_f w_pf dy_pf - sum_f (y_pf - x_p + s_p) dW_pf / D_p.                  (3)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...linear.sums import Blocks
from .facing import Skin, dofs_of, shapes

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Newcomers:
    """(2) of the nodes that meet at `at`, and at `earlier` did not or faded, times 1 - w'.

    new (nc,): 1 - w'.  k parts: of node `row` (k,) in the slot `slot` (k,) of the pair of
    facets `pair` (k,).
    """

    at: MortarMeeting
    earlier: MortarMeeting
    new: Array
    row: Index
    pair: Index
    slot: Index

    @classmethod
    def between(cls, at: MortarMeeting, earlier: MortarMeeting) -> Newcomers | None:
        """Those of two meetings of one pair; None where there are none."""
        new = at.met * (1 - earlier.remembered)
        if not new.any():
            return None
        rows = at.rows[at.shared.of]
        pair, slot = np.nonzero((rows >= 0) & (new[rows] > 0))
        return cls(at, earlier, new, rows[pair, slot], pair, slot)

    @cached_property
    def _facets(self) -> Skin:
        """The master's facet of each part."""
        return self.at.pair.master.part(self.at.shared.master[self.pair])

    @cached_property
    def _weights(self) -> Array:
        """w, (k,)."""
        corners = self._facets.nodes.shape[1]
        parts = self.at.shared.cross[self.pair, self.slot, :corners].sum(axis=1)
        return np.asarray(parts * self.at.by_weight[self.row], dtype=np.float64)

    @cached_property
    def _held(self) -> tuple[Array, Array]:
        """A (k, b) and h (k,)."""
        facets, x = self._facets, self.earlier.x
        centre, normal, _ = shapes(facets, x)
        apart = x[self.at.slaves[self.row]] - centre
        slopes = facets.gradients(x, np.arange(len(centre)))
        along = np.einsum("kbc,kc->kb", slopes, apart)
        middle = facets.real / facets.corners[:, None]
        return middle + along, np.einsum("kc,kc->k", normal, apart)

    @cached_property
    def _apart(self) -> Array:
        """y - x, (k, d)."""
        (A, h), x = self._held, self.at.x
        p = x[self.at.slaves[self.row]]
        there = x[self._facets.nodes] - p[:, None]
        return np.einsum("kb,kbc->kc", A, there) + h[:, None] * shapes(self._facets, x)[1]

    @cached_property
    def _whole(self) -> Array:
        """s, (nc, d), zero of all others."""
        out = np.zeros(self.at.normals.shape)
        np.add.at(out, self.row, -self._weights[:, None] * self._apart)
        return out

    @property
    def motion(self) -> Array:
        """(1 - w') s, (nc, d), zero of all others."""
        return self.new[:, None] * self._whole

    def entries(self, factors: Array) -> list[Blocks]:
        """Those of the derivatives of factors_p (nc, m, d) times `motion`."""
        factors = factors * self.new[:, None, None]
        (m, d), k, facets = factors.shape[1:], len(self.row), self._facets
        (A, h), w = self._held, self._weights
        by, rows = factors[self.row], self.row[:, None] * m + np.arange(m)
        there = dofs_of(facets.nodes, d)
        turned = h[:, None, None] * facets.normal_slopes(self.at.x, np.arange(k))
        moved = (A[:, None, :, None] * np.eye(d)[:, None]).reshape(k, d, -1) + turned
        _, cross, dofs = self.at.slopes.integrals
        corners = facets.nodes.shape[1]
        grown = cross[self.pair, self.slot, :corners].sum(axis=1)  # dW, (k, ways)
        beside = self._apart + self._whole[self.row]
        grown *= self.at.by_weight[self.row, None]
        change = (by @ beside[:, :, None]) * grown[:, None]
        new = np.unique(self.row)
        at = dofs_of(self.at.slaves[new, None], d)
        return [(factors[new], new[:, None] * m + np.arange(m), at),
                (by @ (-w[:, None, None] * moved), rows, there),
                (-change, rows, dofs[self.pair])]  # fmt: skip
