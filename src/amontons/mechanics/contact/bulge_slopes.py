"""Derivatives of bulges in the averages, beyond what `current_slopes` has for them.

There theta psi are the functions in the place of chi = theta psi + (1 - theta) phi of `shared`,
theta held; here are the change of theta and that of the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...linear.sums import Product, rows_of_blocks

if TYPE_CHECKING:
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class BulgeSlopes:
    """Of a meeting; integrals: those of `MortarSlopes`, own, cross and dofs."""

    at: MortarMeeting
    integrals: tuple[Array, Array, Index]

    @property
    def places(self) -> tuple[Array, Array]:
        """Corners and bulges of the slave's facets (f, a + e, d), the master's (k, ...)."""
        parts, pair, x = self.at.shared, self.at.pair, self.at.x
        return pair.slave.values(x)[parts.facets], pair.master.values(x)[parts.master]

    @cached_property
    def _blends(self) -> Array:
        """Derivatives of theta by the dofs of pairs, (k, w), that add up to those of facets."""
        parts, skin, own = self.at.shared, self.at.pair.slave, self.integrals[0]
        f, (a, d) = len(parts.facets), (skin.nodes.shape[1], self.at.x.shape[1])
        whole = np.linalg.norm(skin.areas(self.at.x)[parts.facets], axis=1)
        grown = skin.size_slopes(self.at.x, parts.facets)
        out = own[:, :, :a].sum(axis=(1, 2))  # of c times the area; the area's in equal parts
        grown *= (parts.covered / np.bincount(parts.of, minlength=f))[:, None]
        out[:, : a * d] -= grown[parts.of]
        return out * (parts.blend[1] / whole)[parts.of, None]

    def distances(self) -> Array:
        """Derivatives (k, a, d, w) of chi times integrals of bulges, theta A dh left out."""
        parts, pair, (own, cross, _) = self.at.shared, self.at.pair, self.integrals
        a, b = pair.slave.nodes.shape[1], pair.master.nodes.shape[1]
        at, there = (side[:, n:] for side, n in zip(self.places, (a, b), strict=True))
        h = parts.own[:, :, a:] @ at
        np.subtract.at(h, parts.of, parts.cross[:, :, b:] @ there)
        turned = (parts.psi - parts.even) @ h
        out = turned[parts.of][..., None] * self._blends[:, None, None]
        moved = at.swapaxes(1, 2)[parts.of][:, None] @ own[:, :, a:]
        moved -= there.swapaxes(1, 2)[:, None] @ cross[:, :, b:]
        less = (1 - parts.blend[0])[:, None, None] * parts.even
        return out + np.einsum("kpr,krdw->kpdw", less[parts.of], moved)

    def spread(
        self, w: Array, mine: tuple[Index, slice], theirs: tuple[Index, slice]
    ) -> list[Product]:
        """Of forces of bulges what changes with theta, and with D in (1 - theta) P.

        w (f, p, d): lambda / D; nodes and slots as in `MortarSlopes`.
        """
        parts, rows, d = self.at.shared, np.maximum(self.at.rows, 0), w.shape[2]
        turned = (parts.psi - parts.even).swapaxes(1, 2) @ w  # (f, r, d)
        less = (1 - parts.blend[0])[:, None, None] * parts.even
        by_weight = -w * self.at.by_weight[rows][:, :, None]
        by_theta, by_weights = [], []
        for (nodes, slots), held, of in (
            (mine, parts.own, np.arange(len(w))), (theirs, -parts.cross, parts.of)
        ):  # fmt: skip
            k, s = nodes.shape
            if not s:  # of first order
                continue
            held = held[:, :, slots].swapaxes(1, 2)  # (., s, r)
            at = (nodes[:, :, None] * d + np.arange(d)).reshape(k, s * d)
            values = ((held @ less[of].swapaxes(1, 2))[:, :, None]
                      * by_weight[of].swapaxes(1, 2)[:, None])  # fmt: skip  # (., s, c, p)
            by_weights.append((values.reshape(k, s * d, w.shape[1]), at, rows[of]))
            by_theta.append(((held @ turned[of]).reshape(k, s * d, 1), at, of[:, None]))
        n, nc, f = self.at.x.size, len(self.at.slaves), len(w)
        theta = self._blends[:, None], parts.of[:, None], self.integrals[2]
        return [(rows_of_blocks(by_theta, (n, f)), rows_of_blocks([theta], (f, n))),
                (rows_of_blocks(by_weights, (n, nc)), self.at.slopes.weights)]  # fmt: skip
