"""Cells of one law at finite strains: forces, tangent, energy, and pressures of hybrid cells.

Laws of the family of `cell_loops` have loops of their own; all others say stress and moduli at
the points of integration (`energies`), some thousands of them at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.locks import KeepsLocks
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_loops import energy_of, forces_inplace, tangent_inplace
from .cell_matrices import rule_of
from .elasticity import geometry_of
from .energies import PointLaw, check_least
from .hybrid import averaged, curvature, element_formulation, volume_modes
from .hybrid_loops import (
    volume_ratios_inplace,
    volume_slopes_inplace,
    volume_terms_inplace,
)
from .point_loops import deformations_inplace, forces_of_inplace, tangent_of_inplace

Array = NDArray[np.float64]
AT_ONCE = 16_000  # points of integration, for memory: the moduli have 81 numbers each


class FiniteCells(KeepsLocks):
    """What all have: the geometry, and the pressures of hybrid cells."""

    modulus: float  # that stresses of strains near 1 are measured by

    def __init__(self, mesh: Mesh, cells: Cells, law: Any) -> None:
        rule = rule_of(mesh, cells, finite=True)
        self.law, self.geometry = law, geometry_of(mesh, cells, rule)
        self.unit = (1.0,) * mesh.dim
        self.hybrid = element_formulation(mesh, cells, law) == "hybrid"
        self._none = np.zeros((0, len(rule[1])))
        if self.hybrid:
            self.modes, self._volumes = volume_modes(mesh, cells, rule)

    def add_forces(self, u: Array, given: Array | None, out: Array) -> None:
        """Add nodal forces to out (n, dim); given (k, M): coefficients of pressures."""
        raise NotImplementedError

    def add_tangent(
        self, u: Array, given: Array | None, pattern: tuple, out: Array, blocks: Array
    ) -> None:
        """Add forces to out (n, dim), derivatives to blocks (m, dim, dim) of a pattern."""
        raise NotImplementedError

    def energy(self, u: Array) -> float:
        """Stored energy."""
        raise NotImplementedError

    def pressures(
        self, u: Array, given: Array | None = None
    ) -> tuple[Array, Array | None, float]:
        """Pressures (k, q), N (k, M, M) of `hybrid` and energy of the volume term; or none.

        given (k, M): coefficients of pressures that are not those of u.
        """
        if not self.hybrid:
            return self._none, None, 0.0
        energy, slope, bend = self.law.volume(self._mean_ratio(u))
        held = averaged(self.modes, self._volumes, slope)
        if given is not None:
            held = np.einsum("kmq,km->kq", self.modes, given)
        bulk = curvature(self.modes, self._volumes, bend)
        return held, bulk, float((self._volumes * energy).sum())

    def add_volume_terms(
        self, u: Array, bulk: Array | None, pattern: tuple, blocks: Array
    ) -> None:
        """Add what the changes of pressure do, N of `pressures`."""
        if bulk is not None:
            volume_terms_inplace(u, *self.geometry, self.modes, bulk, *pattern, blocks,
                                 self.unit)  # fmt: skip

    def _mean_ratio(self, u: Array) -> Array:
        """theta (k, q) of `hybrid`."""
        J = np.empty_like(self._volumes)
        volume_ratios_inplace(u, *self.geometry, J, self.unit)
        check_least(float(J.min(initial=np.inf)))
        theta = averaged(self.modes, self._volumes, J)
        check_least(float(theta.min(initial=np.inf)))
        return theta

    def coefficients(self, u: Array, du: Array) -> Array:
        """Coefficients (k, M) of the pressures at u, to first order at u + du."""
        _, slope, bend = self.law.volume(self._mean_ratio(u))
        change = np.empty_like(self._volumes)
        volume_slopes_inplace(u, du, *self.geometry, change, self.unit)
        slope = slope + bend * averaged(self.modes, self._volumes, change)
        return np.einsum("kmq,kq->km", self.modes, self._volumes * slope)

    def forces_of_pressures(self) -> Array:
        """Per unit of the coefficients (k, M): shear modulus times area times strain."""
        if not self.hybrid:
            return np.zeros(0)
        size = self._volumes.sum(axis=1) ** (0.5 - 1 / len(self.unit))
        share = self.law.shear / self.law.lame_lambda()
        return np.repeat((share * size)[:, None], self.modes.shape[1], axis=1)


class FamilyCells(FiniteCells):
    """Cells of a law of the family of `cell_loops`."""

    def __init__(self, mesh: Mesh, cells: Cells, law: Any) -> None:
        super().__init__(mesh, cells, law)
        self._numbers = np.array(law.shape_coefficients if self.hybrid else law.coefficients)
        self.modulus = float(np.array(law.coefficients) @ [2, 4, 4, 1, 1])

    def add_forces(self, u: Array, given: Array | None, out: Array) -> None:
        """See `FiniteCells`."""
        held = self.pressures(u, given)[0]
        check_least(forces_inplace(u, *self.geometry, self._numbers, held, out, self.unit))

    def add_tangent(
        self, u: Array, given: Array | None, pattern: tuple, out: Array, blocks: Array
    ) -> None:
        """See `FiniteCells`."""
        held, bulk, _ = self.pressures(u, given)
        check_least(tangent_inplace(u, *self.geometry, self._numbers, held, *pattern, out,
                                    blocks, self.unit))  # fmt: skip
        self.add_volume_terms(u, bulk, pattern, blocks)

    def energy(self, u: Array) -> float:
        """See `FiniteCells`."""
        part, least = energy_of(u, *self.geometry, self._numbers, self.unit)
        check_least(least)
        return float(part) + self.pressures(u)[2]


class PointCells(FiniteCells):
    """Cells of a law that is given point by point."""

    law: PointLaw

    def __init__(self, mesh: Mesh, cells: Cells, law: Any) -> None:
        super().__init__(mesh, cells, law)
        self.modulus = float(abs(law.whole(np.eye(3)[None], np.ones(1))[2]).max())

    def _parts(self, u: Array, held: Array) -> Iterator[tuple]:
        """Geometry, F (k, q, 3, 3) and W, S, D of some of the cells at a time."""
        points, nodes, slopes, weights = self.geometry
        at_once = max(1, AT_ONCE // len(weights))
        for first in range(0, len(nodes), at_once):
            some = slice(first, first + at_once)
            geometry = (points, nodes[some], slopes, weights)
            F = np.tile(np.eye(3), (len(nodes[some]), len(weights), 1, 1))
            check_least(deformations_inplace(u, *geometry, F, self.unit))
            flat = F.reshape(-1, 3, 3)
            given = held[some].ravel() if len(held) else None
            C = flat.swapaxes(1, 2) @ flat
            check_least(float(np.linalg.det(C).min(initial=np.inf)))  # flat but for rounding
            W, S, D = self.law.whole(C, np.linalg.det(flat), given)
            yield geometry, F, W.reshape(F.shape[:2]), S.reshape(F.shape), D.reshape(
                *F.shape, 3, 3
            )

    def add_forces(self, u: Array, given: Array | None, out: Array) -> None:
        """See `FiniteCells`."""
        for geometry, F, _, S, _ in self._parts(u, self.pressures(u, given)[0]):
            forces_of_inplace(*geometry, F, S, out, self.unit)

    def add_tangent(
        self, u: Array, given: Array | None, pattern: tuple, out: Array, blocks: Array
    ) -> None:
        """See `FiniteCells`."""
        held, bulk, _ = self.pressures(u, given)
        for geometry, F, _, S, D in self._parts(u, held):
            forces_of_inplace(*geometry, F, S, out, self.unit)
            tangent_of_inplace(*geometry, F, S, D, *pattern, blocks, self.unit)
        self.add_volume_terms(u, bulk, pattern, blocks)

    def energy(self, u: Array) -> float:
        """See `FiniteCells`."""
        total = self.pressures(u)[2]
        for geometry, _, W, _, _ in self._parts(u, self._zero_pressures()):
            total += float((W * self._sizes(geometry)).sum())
        return total

    def _zero_pressures(self) -> Array:
        """Of hybrid cells none, so that the volume term is left out; else nothing is held."""
        nodes, weights = self.geometry[1], self.geometry[3]
        return np.zeros((len(nodes), len(weights))) if self.hybrid else self._none

    def _sizes(self, geometry: tuple) -> Array:
        """Volumes (k, q) of points of integration."""
        points, nodes, slopes, weights = geometry
        jac = np.einsum("kas,qad->kqsd", points[nodes], slopes)
        return np.linalg.det(jac) * weights
