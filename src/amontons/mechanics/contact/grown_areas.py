"""Areas of now that stresses of a contact law act on, over those of the undeformed body.

A law in forces has stresses times the undeformed areas A_p around its nodes: bounds, cohesion,
pressure over overclosure and shear over elastic slip.  They are meant per area of the deformed
surface that faces the other side, D_p(x), so that what holds at x is the law with all of its
forces times

    a_p = D_p(x) / A_p                                                                      (1)

(`Law.scaled`; a compliance is divided by it).  D is that of `current_mortar` between bodies;
in front of an obstacle it is A_p times the growth of the facets around p.  With a rho_p in the
place of rho_p, which changes no solution, the law F of `current` is a sum of forces that are
homogeneous in lambda and a, whatever it consists of:

    F(lambda, a) = a F(lambda / a, 1),    dF/da = (F - dF/dlambda lambda) / a,              (2)

where the mean forces D_s p_s of `fading` count among lambda.  Bonds keep their area.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .facing import Skin, dofs_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEAST = 1e-12  # part of an area from which on it counts, so that stresses stay numbers


@dataclass(frozen=True, eq=False)
class GrownAreas:
    """How areas around nodes (nc,) of a skin grow, beside those at positions X (n, d)."""

    nodes: Index
    skin: Skin
    X: Array

    @cached_property
    def _around(self) -> sparse.csr_array:
        """1 for facets around nodes, corners and middles, (nc, f)."""
        table = np.concatenate([self.skin.nodes, self.skin.middles], axis=1)
        facets = np.repeat(np.arange(len(table)), table.shape[1])
        shape = len(self.X), len(table)
        found = sparse.csr_array((np.ones(table.size), (table.ravel(), facets)), shape=shape)
        found.data[:] = 1.0  # nodes that pad a table are there twice
        return sparse.csr_array(found[self.nodes])

    @cached_property
    def _undeformed(self) -> Array:
        return np.asarray(self._around @ np.linalg.norm(self.skin.areas(self.X), axis=1))

    def at(self, x: Array) -> Array:
        """a, (nc,), at positions x (n, d)."""
        found = self._around @ np.linalg.norm(self.skin.areas(x), axis=1)
        return np.asarray(np.maximum(found / self._undeformed, LEAST))

    def slopes(self, x: Array) -> sparse.csr_array:
        """da/dx, (nc, n d)."""
        values = self.skin.size_slopes(x, np.arange(len(self.skin.nodes))).ravel()
        dofs = dofs_of(self.skin.nodes, x.shape[1])
        rows = np.repeat(np.arange(len(dofs)), dofs.shape[1])
        by_x = sparse.coo_array((values, (rows, dofs.ravel())), shape=(len(dofs), x.size))
        per_area = sparse.diags_array(1 / self._undeformed)
        return sparse.csr_array(per_area @ (self._around @ by_x.tocsr()))
