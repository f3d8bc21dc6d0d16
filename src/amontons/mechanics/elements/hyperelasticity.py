"""Hyperelasticity at finite strains: laws, nodal forces and exact tangents on any mesh.

Energies are per volume of the reference configuration, with F = I + grad u and C = F^T F; see
`cell_loops` for the family of which both laws are members.  2D is plane strain, with
unit thickness.  Both laws are linear elasticity with the same young and poisson at F = I.

[C] P. G. Ciarlet, "Mathematical elasticity I", North-Holland 1988, section 4.10.
[BW] J. Bonet, R. D. Wood, "Nonlinear continuum mechanics for finite element analysis",
Cambridge 2008, section 6.4.3.
[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.2.2.  Its stress lacks a factor F.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, InvertedCells
from ..meshes.cells import CELLS, ReferenceCell
from ..meshes.check import determinant
from ..meshes.linear_cells import Rule
from ..meshes.mesh import Mesh
from .cell_loops import energy_of, forces_inplace, tangent_inplace
from .elasticity import Isotropic, LinearElastic, geometry_of, materials_by_region
from .pattern import node_pattern

Array = NDArray[np.float64]


class _Family(Isotropic):
    """What all members of the family have."""

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        raise NotImplementedError

    def stress(self, gradient: Array) -> Array:
        """Cauchy stress P F^T / J (k, 3, 3) of displacement gradients (k, dim, dim).

        Raises InvertedCells where J <= 0.
        """
        dim = gradient.shape[1]
        F = np.tile(np.eye(3), (len(gradient), 1, 1))
        F[:, :dim, :dim] += gradient
        J = np.linalg.det(F)
        _check(float(J.min(initial=np.inf)))
        a, b, c, d, e = self.coefficients
        B = F @ F.swapaxes(1, 2)
        trace = np.trace(B, axis1=1, axis2=2)[:, None, None]
        g = (2 * c * J**2 - d + e * np.log(J))[:, None, None]
        kirchhoff = 2 * a * B + 2 * b * (trace * B - B @ B) + g * np.eye(3)
        return kirchhoff / J[:, None, None]


@dataclass(frozen=True)
class NeoHookean(_Family):
    """Compressible neo-Hookean law: young, unit of stress, > 0; -1 < poisson < 0.5.

    W = shear / 2 (tr C - 3) - shear ln J + lame_lambda / 2 (ln J)^2, [BW] eq. (6.27).
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson)  # its checks

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        return self.shear / 2, 0.0, 0.0, self.shear, self.lame_lambda()


@dataclass(frozen=True)
class CiarletGeymonat(_Family):
    """Ciarlet-Geymonat law: young, unit of stress, > 0; 0 < poisson < 0.5.

    W = a (tr C - 3) + b (tr cof C - 3) + c (J^2 - 1) - d ln J with b = shear / 2 - a,
    c = lame_lambda / 4 - shear / 2 + a, d = lame_lambda / 2 + shear ([C] section 4.10, [LR]).
    a, unit of stress: polyconvex for a, b, c > 0; the middle of what that allows by default,
    shear / 4 where lame_lambda >= 2 shear.
    """

    young: float
    poisson: float
    a: float | None = None

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson)  # its checks
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


Hyperelastic = NeoHookean | CiarletGeymonat


def is_hyperelastic(material: object) -> bool:
    """True for a hyperelastic law, or a table of regions that holds one."""
    if isinstance(material, Mapping):
        return any(isinstance(law, Hyperelastic) for law in material.values())
    return isinstance(material, Hyperelastic)


class HyperelasticBody:
    """Nodal forces and tangent of a mesh with hyperelastic laws, as functions of displacements.

    The pattern of the tangent never changes: blocks of dim x dim in rows `pointers` and columns
    `columns` of nodes, sorted.  All functions raise InvertedCells where J <= 0 at a point of
    integration.
    """

    def __init__(self, mesh: Mesh, material: Hyperelastic | Mapping[str, Hyperelastic]) -> None:
        self.mesh = mesh
        laws = materials_by_region(mesh, material)  # type: ignore[arg-type]
        for region, law in laws.items():
            if not isinstance(law, Hyperelastic):
                raise InvalidInput(
                    f"material of region {region!r}: expected NeoHookean or CiarletGeymonat "
                    f"as in the other regions, got {law!r}"
                )
        self.pointers, self.columns = node_pattern(mesh.cells, len(mesh.points))
        self._unit = (1.0,) * mesh.dim
        self._blocks = [
            (geometry_of(mesh, cells, _rule(CELLS[cells.kind])),
             np.array(laws[cells.region].coefficients))  # type: ignore[attr-defined]
            for cells in mesh.cells
        ]  # fmt: skip

    def forces(self, u: Array) -> Array:
        """Nodal forces (n, dim) that hold the displacements u (n, dim): dE/du."""
        u = np.ascontiguousarray(u, dtype=float)
        out = np.zeros_like(u)
        for geometry, law in self._blocks:
            _check(forces_inplace(u, *geometry, law, out, self._unit))
        return out

    def tangent(self, u: Array) -> tuple[Array, Array]:
        """(forces (n, dim), blocks (m, dim, dim) of the derivative by u)."""
        u = np.ascontiguousarray(u, dtype=float)
        dim = u.shape[1]
        out, blocks = np.zeros_like(u), np.zeros((len(self.columns), dim, dim))
        for geometry, law in self._blocks:
            _check(tangent_inplace(u, *geometry, law, self.pointers, self.columns, out, blocks,
                                   self._unit))  # fmt: skip
        return out, blocks

    def unit_forces(self) -> Array:
        """Sizes of nodal forces (n,) where stresses are as large as moduli, for rounding."""
        out = np.zeros(len(self.mesh.points))
        for cells, (_, law) in zip(self.mesh.cells, self._blocks, strict=True):
            cell, coordinates = CELLS[cells.kind], self.mesh.points[cells.nodes]
            modulus = law @ [2, 4, 4, 1, 1]
            for at, weight in zip(*_rule(cell), strict=True):
                volume = weight * determinant(cell.jacobians(coordinates, at))
                sizes = np.linalg.norm(cell.gradients(coordinates, at), axis=2)
                np.add.at(out, cells.nodes, modulus * sizes * volume[:, None])
        return out

    def matrix(self, blocks: Array) -> sparse.bsr_array:
        """The blocks of `tangent` as a matrix (n dim, n dim)."""
        size = self.mesh.points.size
        return sparse.bsr_array((blocks, self.columns, self.pointers), shape=(size, size))

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (n, dim), unit of work; zero at rest."""
        u = np.ascontiguousarray(u, dtype=float)
        total = 0.0
        for geometry, law in self._blocks:
            part, least = energy_of(u, *geometry, law, self._unit)
            _check(least)
            total += part
        return total


def _check(least: float) -> None:
    """Raise InvertedCells where J is not positive (or not a number)."""
    if not least > 0:
        raise InvertedCells(f"cells are inverted: the least det F is {least:.3g}")


def _rule(cell: ReferenceCell) -> Rule:
    """First order: as the stiffness; second: more, the laws are no polynomials."""
    return cell.stiffness if cell.order == 1 else cell.gauss


def cauchy_stress(
    mesh: Mesh, material: Hyperelastic | Mapping[str, Hyperelastic], displacement: Array
) -> Array:
    """Cauchy stress P F^T / J at the centre of every cell, (cells, 3, 3), as `cell_stress`.

    displacement (n, dim); raises InvertedCells where J <= 0.
    """
    laws = materials_by_region(mesh, material)  # type: ignore[arg-type]
    parts = []
    for cells in mesh.cells:
        cell = CELLS[cells.kind]
        slopes = cell.gradients(mesh.points[cells.nodes], cell.centre)
        gradient = np.einsum("kac,kad->kcd", displacement[cells.nodes], slopes)
        parts.append(laws[cells.region].stress(gradient))  # type: ignore[attr-defined]
    return np.concatenate(parts)
