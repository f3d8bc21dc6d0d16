"""Inner forces between two states, whose work is exactly the change of the stored energy.

A cell has an energy e(X) of what rotations leave as it is: X = C = F^T F at its points, and in
cells of `uniform` also z_m = F^T h_m of their modes.  Along a straight way of its nodes

    C1 - C0 = 2 sym(F_h^T (F1 - F0)),    z1 - z0 = F_h^T (h1 - h0) + (F1 - F0)^T h_h,

with F_h, h_h the means of both ends.  So the gradient [G]

    g = de/dX + (e1 - e0 - de/dX . (X1 - X0)) / |X1 - X0|^2 (X1 - X0),   de/dX at (X0 + X1) / 2,

has g . (X1 - X0) = e1 - e0, and with g = (T / 2, p) the forces

    f_a = sum_q F_h T_q G_qa + sum_m (gamma_ma F_h p_m + h_hm (p_m . G_a))

do the work e1 - e0 to the last digit; their sum, and their moment about the means of both ends
of the nodes, are zero.

[G] O. Gonzalez, "Exact energy and momentum conserving algorithms for general models in
nonlinear elasticity", CMAME 190 (2000) 1763-1783.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_matrices import rule_of
from .energies import check_least
from .hybrid import averaged, element_formulation, is_thin, volume_modes, volumes_of
from .plane_stress import Thin
from .point_loops import add_volume_inplace
from .uniform import uniform

Array = NDArray[np.float64]
SMALL = 3e-3  # change of C up to which Simpson's rule gives e1 - e0 to rounding


class DiscreteCells:
    """Cells of one law and their X."""

    def __init__(self, mesh: Mesh, cells: Cells, law: Any) -> None:
        law = Thin(law) if is_thin(law, mesh) else law
        self.law, self._nodes, dim = law, cells.nodes, mesh.dim
        formulation = element_formulation(mesh, cells, law)
        self._modes = None
        self._gamma = np.zeros((len(cells.nodes), 0, cells.nodes.shape[1]))
        self._K = np.zeros((len(cells.nodes), 0, dim, 0, dim))
        if formulation.endswith("incompatible"):
            parts = uniform(mesh, cells)
            self._G, self._v = parts.mean[:, None], parts.volumes[:, None]
            self._gamma = parts.gamma
            self._K = parts.stiffness(law, whole=not formulation.startswith("hybrid"))
        else:
            rule, cell = rule_of(mesh, cells, finite=True), CELLS[cells.kind]
            x = mesh.points[cells.nodes]
            self._G = np.stack([cell.gradients(x, at) for at in rule[0]], axis=1)
            self._v = volumes_of(mesh, cells, rule)
            if formulation == "hybrid":
                self._modes = volume_modes(mesh, cells, rule)[0]
        self._per_mode = self._v.sum(axis=1) ** (1 - 2 / dim)  # weighs |z|^2 beside |C|^2

    def _deformed(self, u: Array) -> tuple[Array, Array]:
        """F (k, q, 3, 3) and h (k, m, dim) at displacements u (n, dim)."""
        own = u[self._nodes]
        dim = u.shape[1]
        F = np.tile(np.eye(3), (*self._v.shape, 1, 1))
        F[:, :, :dim, :dim] += np.einsum("kai,kqaj->kqij", own, self._G, optimize=True)
        return F, np.einsum("kma,kai->kmi", self._gamma, own)

    def _slopes(self, C: Array, z: Array) -> tuple[Array, Array, Array]:
        """Energies (k,), T (k, q, 3, 3) and p (k, m, dim) at C (k, q, 3, 3), z (k, m, dim)."""
        flat = np.ascontiguousarray(C.reshape(-1, 3, 3))
        squares = np.linalg.det(flat)
        check_least(float(squares.min(initial=np.inf)))
        J = np.sqrt(squares)
        W, S, D = self.law.respond(flat)
        energy = (W.reshape(self._v.shape) * self._v).sum(axis=1)
        if self.law.volume is not None:
            ratio = J.reshape(self._v.shape)
            theta = ratio if self._modes is None else averaged(self._modes, self._v, ratio)
            check_least(float(theta.min(initial=np.inf)))
            U, slope, bend = self.law.volume(theta)
            energy = energy + (U * self._v).sum(axis=1)
            if self._modes is not None:
                slope = averaged(self._modes, self._v, slope)
            add_volume_inplace(np.linalg.inv(flat), J, slope.ravel(), 0 * bend.ravel(), S, D)
        T = S.reshape(C.shape) * self._v[:, :, None, None]
        if not self._gamma.shape[1]:
            return energy, T, np.zeros_like(z)
        dim = z.shape[2]
        inverse = np.linalg.inv(C[:, 0, :dim, :dim])
        y = np.einsum("kij,kmj->kmi", inverse, z)
        bent = np.einsum("kminj,knj->kmi", self._K, y)
        p = np.einsum("kij,kmj->kmi", inverse, bent)
        both = np.einsum("kmi,kmj->kij", p, y)
        T[:, 0, :dim, :dim] -= both + both.swapaxes(1, 2)
        return energy + 0.5 * (bent * y).sum(axis=(1, 2)), T, p

    def add_between(self, before: Array, after: Array, out: Array) -> None:
        """Add the forces between displacements before and after (n, dim) to out (n, dim).

        Raises InvertedCells where cells are inverted at either, or halfway.
        """
        (F0, h0), (F1, h1) = self._deformed(before), self._deformed(after)
        for F in (F0, F1):
            check_least(float(np.linalg.det(F).min(initial=np.inf)))
        C0, C1 = (F.swapaxes(2, 3) @ F for F in (F0, F1))
        dim = before.shape[1]
        z0, z1 = (
            np.einsum("kji,kmj->kmi", F[:, 0, :dim, :dim], h) for F, h in ((F0, h0), (F1, h1))
        )
        dC, dz = C1 - C0, z1 - z0
        e0, T0, p0 = self._slopes(C0, z0)
        e1, T1, p1 = self._slopes(C1, z1)
        _, T, p = self._slopes((C0 + C1) / 2, (z0 + z1) / 2)
        size = (self._v * (dC * dC).sum(axis=(2, 3))).sum(axis=1)
        size += self._per_mode * (dz * dz).sum(axis=(1, 2))
        # differences of energies have few digits where little changes
        near = _work(T0 + T1 - 2 * T, p0 + p1 - 2 * p, dC, dz) / 6
        is_small = size <= SMALL**2 * self._v.sum(axis=1)
        rest = np.where(is_small, near, e1 - e0 - _work(T, p, dC, dz))
        share = rest / np.where(size > 0, size, 1.0)
        T = T + 2 * (share[:, None] * self._v)[:, :, None, None] * dC
        p = p + (share * self._per_mode)[:, None, None] * dz
        F, h = ((F0 + F1) / 2)[:, :, :dim, :dim], (h0 + h1) / 2
        force = np.einsum("kqij,kqjl,kqal->kai", F, T[:, :, :dim, :dim], self._G, optimize=True)
        force += np.einsum("kma,kij,kmj->kai", self._gamma, F[:, 0], p, optimize=True)
        force += np.einsum("kmi,kmj,kaj->kai", h, p, self._G[:, 0], optimize=True)
        np.add.at(out, self._nodes, force)


def _work(T: Array, p: Array, dC: Array, dz: Array) -> Array:
    """(T / 2, p) . (dC, dz) of every cell, (k,)."""
    return 0.5 * (T * dC).sum(axis=(1, 2, 3)) + (p * dz).sum(axis=(1, 2))


class DiscreteBody:
    """The forces of all cells of a body of finite strains."""

    def __init__(self, mesh: Mesh, laws: dict[str, Any]) -> None:
        self._blocks = [DiscreteCells(mesh, cells, laws[cells.region]) for cells in mesh.cells]

    def between(self, before: Array, after: Array) -> Array:
        """Forces (n, dim) of the way from displacements before to after, (n, dim)."""
        out = np.zeros_like(before)
        for block in self._blocks:
            block.add_between(before, after, out)
        return out
