"""Hyperelasticity at finite strains: laws, nodal forces and exact tangents on any mesh.

Energies are per volume of the reference configuration, with F = I + grad u and C = F^T F; see
`cell_loops` for the family of which both laws are members.  2D is plane strain, or plane
stress (`plane_stress`), with unit thickness where nothing is deformed.  Both laws are linear
elasticity with the same young and poisson at F = I.

[C] P. G. Ciarlet, "Mathematical elasticity I", North-Holland 1988, section 4.10.
[BW] J. Bonet, R. D. Wood, "Nonlinear continuum mechanics for finite element analysis",
Cambridge 2008, section 6.4.3.
[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.2.2.  Its stress lacks a factor F.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ...core.words import helpful
from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_matrices import rule_of
from .elasticity import (
    Isotropic,
    LinearElastic,
    cell_stress,
    materials_by_region,
)
from .energies import PointLaw, deformation
from .finite_cells import FamilyCells, FiniteCells, PointCells
from .hybrid import element_formulation, is_thin
from .pattern import node_pattern
from .plane_stress import Thin, is_thin_at, thin_stress
from .point_loops import family_inplace
from .uniform_cells import UniformCells

Array = NDArray[np.float64]


class _Family(Isotropic):
    """What all members of the family have."""

    finite: ClassVar[bool] = True
    plane: str = "strain"

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        raise NotImplementedError

    @property
    def shape_coefficients(self) -> tuple[float, float, float, float, float]:
        """The same without the volume term of hybrid cells."""
        raise NotImplementedError

    def stress(self, gradient: Array) -> Array:
        """Cauchy stress P F^T / J (k, 3, 3) of displacement gradients (k, dim, dim).

        Raises InvertedCells where J <= 0.
        """
        if is_thin_at(self, gradient):
            return thin_stress(self, gradient)
        return self._cauchy(gradient, self.coefficients)

    def shape_stress(self, gradient: Array) -> Array:
        """`stress` without that of the volume term of hybrid cells."""
        return self._cauchy(gradient, self.shape_coefficients)

    def respond(self, C: Array) -> tuple[Array, Array, Array]:
        """W (n,), S = 2 dW/dC (n, 3, 3) and 2 dS/dC (n, 3, 3, 3, 3), without that term."""
        W, S, D = np.empty(len(C)), np.empty((len(C), 3, 3)), np.empty((len(C), 3, 3, 3, 3))
        family_inplace(np.ascontiguousarray(C), np.linalg.inv(C), np.sqrt(np.linalg.det(C)),
                       np.array(self.shape_coefficients), W, S, D)  # fmt: skip
        return W, S, D

    def _cauchy(
        self, gradient: Array, coefficients: tuple[float, float, float, float, float]
    ) -> Array:
        F, J = deformation(gradient)
        a, b, c, d, e = coefficients
        B = F @ F.swapaxes(1, 2)
        trace = np.trace(B, axis1=1, axis2=2)[:, None, None]
        g = (2 * c * J**2 - d + e * np.log(J))[:, None, None]
        kirchhoff = 2 * a * B + 2 * b * (trace * B - B @ B) + g * np.eye(3)
        return kirchhoff / J[:, None, None]


@helpful
@dataclass(frozen=True)
class NeoHookean(_Family):
    """Compressible neo-Hookean law: young, unit of stress, > 0; -1 < poisson < 0.5.

    density: mass per volume of the reference configuration, read by dynamics only; plane:
    "strain" or "stress", read in 2D only (`plane_stress`).

    W = shear / 2 (tr C - 3) - shear ln J + lame_lambda / 2 (ln J)^2, [BW] eq. (6.27).
    """

    young: float
    poisson: float
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson, self.plane, self.density)  # its checks

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        return self.shear / 2, 0.0, 0.0, self.shear, self.lame_lambda()

    @property
    def shape_coefficients(self) -> tuple[float, float, float, float, float]:
        """The same without the volume term of hybrid cells."""
        return self.shear / 2, 0.0, 0.0, self.shear, 0.0

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U = lame_lambda / 2 (ln J)^2, U' and U'' of J > 0 of any shape."""
        log, lame = np.log(J), self.lame_lambda()
        return lame / 2 * log**2, lame * log / J, lame * (1 - log) / J**2


@helpful
@dataclass(frozen=True)
class CiarletGeymonat(_Family):
    """Ciarlet-Geymonat law: young, unit of stress, > 0; 0 < poisson < 0.5.

    W = a (tr C - 3) + b (tr cof C - 3) + c (J^2 - 1) - d ln J with b = shear / 2 - a,
    c = lame_lambda / 4 - shear / 2 + a, d = lame_lambda / 2 + shear ([C] section 4.10, [LR]).
    a, unit of stress: polyconvex for a, b, c > 0; the middle of what that allows by default,
    shear / 4 where lame_lambda >= 2 shear.  density, plane: as in `NeoHookean`.
    """

    young: float
    poisson: float
    a: float | None = None
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson, self.plane, self.density)  # its checks
        if not self.poisson > 0:
            raise InvalidInput(
                f"poisson: Ciarlet-Geymonat needs one above 0, got {self.poisson!r}; "
                "take NeoHookean"
            )
        low, high = self._allowed
        if self.a is None:
            object.__setattr__(self, "a", (low + high) / 2)
        number = isinstance(self.a, int | float | np.number)
        if not (number and low < self.a < high):  # type: ignore[operator]
            raise InvalidInput(
                f"a: expected between {low:g} and {high:g}, where the energy is polyconvex, "
                f"got {self.a!r}"
            )

    @classmethod
    def from_lame(
        cls, lame_lambda: float, shear: float, a: float | None = None
    ) -> CiarletGeymonat:
        """The law of given Lamé constants at F = I, both > 0, unit of stress."""
        numbers = all(isinstance(x, int | float | np.number) for x in (lame_lambda, shear))
        if not (numbers and 0 < lame_lambda < np.inf and 0 < shear < np.inf):
            raise InvalidInput(
                f"lame_lambda, shear: expected stresses > 0, got {lame_lambda!r}, {shear!r}"
            )
        both = lame_lambda + shear
        return cls(shear * (3 * lame_lambda + 2 * shear) / both, lame_lambda / (2 * both), a)

    @property
    def _allowed(self) -> tuple[float, float]:
        return max(0.0, self.shear / 2 - self.lame_lambda() / 4), self.shear / 2

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        a, half = float(self.a), self.shear / 2  # type: ignore[arg-type]
        quarter = self.lame_lambda() / 4
        return a, half - a, quarter - half + a, 2 * quarter + 2 * half, 0.0

    @property
    def shape_coefficients(self) -> tuple[float, float, float, float, float]:
        """The same without the volume term of hybrid cells."""
        a, half = float(self.a), self.shear / 2  # type: ignore[arg-type]
        return a, half - a, a - half, 2 * half, 0.0

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U = lame_lambda / 4 (J^2 - 1 - 2 ln J), U' and U'' of J > 0 of any shape."""
        half = self.lame_lambda() / 2
        energy = half / 2 * (J**2 - 1 - 2 * np.log(J))
        return energy, half * (J - 1 / J), half * (1 + 1 / J**2)


Hyperelastic = NeoHookean | CiarletGeymonat | PointLaw
NAMES = (
    "NeoHookean, CiarletGeymonat, MooneyRivlin, ReducedPolynomial, Ogden, "
    "SaintVenantKirchhoff or UserEnergy"
)


def is_hyperelastic(material: object) -> bool:
    """True for a hyperelastic law, or a table of regions that holds one."""
    if isinstance(material, Mapping):
        return any(isinstance(law, Hyperelastic) for law in material.values())
    return isinstance(material, Hyperelastic)


def _finite_cells(mesh: Mesh, cells: Cells, law: Hyperelastic) -> FiniteCells:
    """The cells of one block of a mesh."""
    thin = is_thin(law, mesh)
    given = Thin(law) if thin else law
    if element_formulation(mesh, cells, law) in ("incompatible", "hybrid-incompatible"):
        return UniformCells(mesh, cells, given)
    by_points = thin or isinstance(law, PointLaw)
    return (PointCells if by_points else FamilyCells)(mesh, cells, given)


class HyperelasticBody:
    """Nodal forces and tangent of a mesh with hyperelastic laws, as functions of displacements.

    The pattern of the tangent never changes: blocks of dim x dim in rows `pointers` and columns
    `columns` of nodes, sorted.  All functions raise InvertedCells where J <= 0 at a point of
    integration.
    """

    def __init__(self, mesh: Mesh, material: Hyperelastic | Mapping[str, Hyperelastic]) -> None:
        self.mesh, self.material = mesh, material
        laws = materials_by_region(mesh, material)  # type: ignore[arg-type]
        for region, law in laws.items():
            if not isinstance(law, Hyperelastic):
                raise InvalidInput(
                    f"material of region {region!r}: expected {NAMES}, as in the other "
                    f"regions, got {law!r}"
                )
        self.pointers, self.columns = node_pattern(mesh.cells, len(mesh.points))
        self._blocks = [_finite_cells(mesh, cells, laws[cells.region]) for cells in mesh.cells]

    @property
    def keeps_volume(self) -> bool:
        """True where some cells are hybrid."""
        return any(block.hybrid for block in self._blocks)

    def pressures(self, u: Array, du: Array) -> Array:
        """Pressures of the hybrid cells at displacements u (n, dim), to first order at u + du.

        (c,), the coefficients of the polynomials of all cells; empty without hybrid cells.
        """
        u, du = (np.ascontiguousarray(x, dtype=float) for x in (u, du))
        parts = [block.coefficients(u, du).ravel() for block in self._blocks if block.hybrid]
        return np.concatenate([np.zeros(0), *parts])

    @property
    def pressure_forces(self) -> Array:
        """Forces (c,) by which changes of volume that those pressures stand for are weighed."""
        parts = [block.forces_of_pressures().ravel() for block in self._blocks]
        return np.concatenate([np.zeros(0), *parts])

    def forces(self, u: Array, pressures: Array | None = None) -> Array:
        """Nodal forces (n, dim) that hold the displacements u (n, dim): dE/du.

        pressures (c,): of the hybrid cells, else those of the displacements.
        """
        u = np.ascontiguousarray(u, dtype=float)
        out = np.zeros_like(u)
        for block, given in self._given(pressures):
            block.add_forces(u, given, out)
        return out

    def tangent(self, u: Array, pressures: Array | None = None) -> tuple[Array, Array]:
        """(forces (n, dim), blocks (m, dim, dim) of the derivative by u).

        pressures (c,): as in `forces`; the derivative is then that of a step in which they
        change as `pressures` says.
        """
        u = np.ascontiguousarray(u, dtype=float)
        dim, pattern = u.shape[1], (self.pointers, self.columns)
        out, blocks = np.zeros_like(u), np.zeros((len(self.columns), dim, dim))
        for block, given in self._given(pressures):
            block.add_tangent(u, given, pattern, out, blocks)
        return out, blocks

    def _given(self, pressures: Array | None) -> Iterator[tuple[FiniteCells, Array | None]]:
        """Every block of cells with what is given of its pressures."""
        first = 0
        for block in self._blocks:
            if pressures is None or not block.hybrid:
                yield block, None
                continue
            last = first + block.modes[:, :, 0].size
            yield block, pressures[first:last].reshape(block.modes.shape[:2])
            first = last

    def unit_forces(self) -> Array:
        """Sizes of nodal forces (n,) where stresses are as large as moduli, for rounding."""
        return self._sizes[0]

    def unit_stiffness(self) -> Array:
        """Sizes of nodal forces per displacement (n,) where terms of F do not cancel.

        F = I + sum_b u_b grad N_b has errors of eps (sum_b |u_b|^2 |grad N_b|^2)^1/2 from
        the rounding of every u_b, also where u is the same all over and F = I.
        """
        return self._sizes[1]

    @cached_property
    def _sizes(self) -> Array:
        out = np.zeros((2, len(self.mesh.points)))
        for cells, block in zip(self.mesh.cells, self._blocks, strict=True):
            cell, coordinates = CELLS[cells.kind], self.mesh.points[cells.nodes]
            for at, weight in zip(*rule_of(self.mesh, cells, finite=True), strict=True):
                volume = weight * determinant(cell.jacobians(coordinates, at))
                sizes = np.linalg.norm(cell.gradients(coordinates, at), axis=2)
                forces = block.modulus * sizes * volume[:, None]
                np.add.at(out[0], cells.nodes, forces)
                np.add.at(out[1], cells.nodes,
                          forces * np.linalg.norm(sizes, axis=1)[:, None])  # fmt: skip
        return out

    def matrix(self, blocks: Array) -> sparse.bsr_array:
        """The blocks of `tangent` as a matrix (n dim, n dim)."""
        size = self.mesh.points.size
        return sparse.bsr_array((blocks, self.columns, self.pointers), shape=(size, size))

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (n, dim), unit of work; zero at rest."""
        u = np.ascontiguousarray(u, dtype=float)
        return sum(block.energy(u) for block in self._blocks)


def cauchy_stress(
    mesh: Mesh, material: Hyperelastic | Mapping[str, Hyperelastic], displacement: Array
) -> Array:
    """Cauchy stress P F^T / J at the centre of every cell, (cells, 3, 3), as `cell_stress`.

    displacement (n, dim); raises InvertedCells where J <= 0.
    """
    return cell_stress(mesh, material, displacement)  # type: ignore[arg-type]
