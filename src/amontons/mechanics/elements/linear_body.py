"""Linear elasticity in the form of `HyperelasticBody`: forces K u, and a tangent that is K."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..meshes.mesh import Mesh
from .elasticity import LinearElastic, stiffness

Array = NDArray[np.float64]


class LinearBody:
    """Nodal forces and tangent of a mesh of small strains, as functions of displacements."""

    keeps_volume = False  # its forces are linear

    def __init__(self, mesh: Mesh, material: LinearElastic | Mapping[str, LinearElastic]):
        self.mesh = mesh
        self._K = K = stiffness(mesh, material)
        self.pointers, self.columns, blocks = K.indptr, K.indices, K.data
        self._blocks: Array = blocks  # type: ignore[assignment]  # scipy guesses any number

    def pressures(self, u: Array, du: Array) -> Array:
        """None of its own."""
        return np.zeros(0)

    @property
    def pressure_forces(self) -> Array:
        """None of its own."""
        return np.zeros(0)

    def forces(self, u: Array) -> Array:
        """Nodal forces (n, dim) that hold the displacements u (n, dim)."""
        return (self._K @ u.ravel()).reshape(u.shape)

    def tangent(self, u: Array) -> tuple[Array, Array]:
        """(forces (n, dim), blocks (m, dim, dim) of the derivative by u)."""
        return self.forces(u), self._blocks.copy()

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (n, dim), unit of work."""
        return 0.5 * float(u.ravel() @ self.forces(u).ravel())

    def unit_forces(self) -> Array:
        """Sizes of nodal forces (n,) where strains are 1, for rounding."""
        rows = np.repeat(np.arange(len(self.mesh.points)), np.diff(self.pointers))
        apart = np.linalg.norm(self.mesh.points[self.columns] - self.mesh.points[rows], axis=1)
        sizes = np.linalg.norm(self._blocks, axis=(1, 2)) * apart
        return np.bincount(rows, sizes, minlength=len(self.mesh.points))  # type: ignore[return-value]  # numpy types only counts

    def unit_stiffness(self) -> Array:
        """Sizes of nodal forces per displacement (n,) where terms of K u do not cancel."""
        rows = np.repeat(np.arange(len(self.mesh.points)), np.diff(self.pointers))
        squares = (self._blocks**2).sum(axis=(1, 2))
        return np.sqrt(np.bincount(rows, squares, minlength=len(self.mesh.points)))
