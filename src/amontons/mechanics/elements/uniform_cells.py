"""Cells of `uniform` at finite strains: forces, tangent, energy and pressures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_matrices import rule_of
from .elasticity import geometry_of
from .energies import check_least
from .finite_cells import FiniteCells
from .hybrid import element_formulation
from .point_loops import add_volume_inplace
from .uniform import uniform
from .uniform_loops import (
    gradients_of_inplace,
    least_ratio,
    modes_energy,
    uniform_forces_inplace,
    uniform_tangent_inplace,
)

Array = NDArray[np.float64]


class UniformCells(FiniteCells):
    """The law at the mean of every cell; its pressures, where it keeps its volume, too."""

    def __init__(self, mesh: Mesh, cells: Cells, law: Any) -> None:
        self.law, self.unit = law, (1.0,) * mesh.dim
        self._nodes = geometry_of(mesh, cells, rule_of(mesh, cells, finite=True))[1]
        self._parts = parts = uniform(mesh, cells)
        self.hybrid = element_formulation(mesh, cells, law) == "hybrid-incompatible"
        self._bending = parts.stiffness(law, whole=not self.hybrid)
        self._volumes = parts.volumes[:, None]
        self.modes = 1 / np.sqrt(self._volumes)[:, :, None]
        self.modulus = 2 * law.shear + law.lame_lambda()

    def add_forces(self, u: Array, given: Array | None, out: Array) -> None:
        """See `FiniteCells`."""
        F, J = self._deformation(u)
        self._add_forces(u, F, self._respond(F, J, given)[1], out)

    def add_tangent(
        self, u: Array, given: Array | None, pattern: tuple, out: Array, blocks: Array
    ) -> None:
        """See `FiniteCells`."""
        F, J = self._deformation(u)
        _, S, D = self._respond(F, J, given)
        self._add_forces(u, F, S, out)
        cells = self._parts
        uniform_tangent_inplace(u, self._nodes, cells.mean, cells.volumes, cells.gamma,
                                self._bending, F, S, D, *pattern, blocks, self.unit)

    def energy(self, u: Array) -> float:
        """See `FiniteCells`."""
        F, J = self._deformation(u)
        W = self._respond(F, J, None)[0]
        bent = modes_energy(u, self._nodes, self._parts.gamma, self._bending, F, self.unit)
        return float(self._parts.volumes @ W) + float(bent)

    def coefficients(self, u: Array, du: Array) -> Array:
        """See `FiniteCells`."""
        F, J = self._deformation(u)
        dim = len(self.unit)
        inverse = np.linalg.inv(F[:, :dim, :dim])
        change = np.einsum("kai,kaj,kji->k", du[self._nodes], self._parts.mean, inverse,
                           optimize=True) * J  # fmt: skip
        _, slope, bend = self.law.volume(J)
        return np.sqrt(self._volumes) * (slope + bend * change)[:, None]

    def _deformation(self, u: Array) -> tuple[Array, Array]:
        """F (k, 3, 3) and det F (k,); raises InvertedCells, also for points of integration."""
        parts = self._parts
        F = np.tile(np.eye(3), (len(self._nodes), 1, 1))
        check_least(gradients_of_inplace(u, self._nodes, parts.mean, F, self.unit))
        check_least(least_ratio(u, self._nodes, parts.gamma, parts.gradients, F, self.unit))
        return F, np.linalg.det(F)

    def _respond(self, F: Array, J: Array, given: Array | None) -> tuple[Array, Array, Array]:
        """W (k,), S (k, 3, 3) and D (k, 3, 3, 3, 3), the latter with changes of pressure."""
        C = F.swapaxes(1, 2) @ F
        check_least(float(np.linalg.det(C).min(initial=np.inf)))  # flat but for rounding
        W, S, D = self.law.respond(C)
        if self.law.volume is None:
            return W, S, D
        U, slope, bend = self.law.volume(J)
        if given is not None:
            slope = given[:, 0] * self.modes[:, 0, 0]
        add_volume_inplace(np.linalg.inv(C), J, slope, bend, S, D)
        return W + U, S, D

    def _add_forces(self, u: Array, F: Array, S: Array, out: Array) -> None:
        parts = self._parts
        uniform_forces_inplace(u, self._nodes, parts.mean, parts.volumes, parts.gamma,
                               self._bending, F, S, out, self.unit)  # fmt: skip
