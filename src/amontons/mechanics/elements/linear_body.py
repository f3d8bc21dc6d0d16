"""Linear elasticity in the form of `HyperelasticBody`: forces K u, and a tangent that is K."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.mesh import Mesh
from .elasticity import LinearElastic, stiffness
from .hyperelasticity import node_pattern

Array = NDArray[np.float64]


class LinearBody:
    """Nodal forces and tangent of a mesh of small strains, as functions of displacements."""

    def __init__(self, mesh: Mesh, material: LinearElastic | Mapping[str, LinearElastic]):
        self.mesh = mesh
        self.pointers, self.columns, _ = node_pattern(mesh)
        K = stiffness(mesh, material).tocsr().tobsr((mesh.dim, mesh.dim))
        K.sort_indices()
        self._blocks = np.zeros((len(self.columns), mesh.dim, mesh.dim))
        self._blocks[self._places(K)] = K.data
        self._K = self.matrix(self._blocks)

    def _places(self, K: sparse.bsr_array) -> NDArray[np.int64]:
        """Where the blocks of K stand in the pattern of all pairs of nodes of a cell."""
        n = len(self.mesh.points)
        pattern = _keys(self.pointers, self.columns, n)
        return np.searchsorted(pattern, _keys(K.indptr, K.indices, n))

    def matrix(self, blocks: Array) -> sparse.bsr_array:
        """The blocks of `tangent` as a matrix (n dim, n dim)."""
        size = self.mesh.points.size
        return sparse.bsr_array((blocks, self.columns, self.pointers), shape=(size, size))

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
        return np.bincount(rows, sizes, minlength=len(self.mesh.points))


def _keys(pointers: NDArray, columns: NDArray, n: int) -> NDArray[np.int64]:
    """One ascending number per block."""
    rows = np.repeat(np.arange(n, dtype=np.int64), np.diff(pointers))
    return rows * n + columns
