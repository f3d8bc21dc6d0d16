"""Hyperelasticity at finite strains: laws, nodal forces and exact tangents on any mesh.

Energies are per volume of the reference configuration, with F = I + grad u and C = F^T F; see
`hyperelastic_cells` for the family of which both laws are members.  2D is plane strain, with
unit thickness.  Both laws are linear elasticity with the same young and poisson at F = I.

[C] P. G. Ciarlet, "Mathematical elasticity I", North-Holland 1988, section 4.10.
[BW] J. Bonet, R. D. Wood, "Nonlinear continuum mechanics for finite element analysis",
Cambridge 2008, section 6.4.3.
[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.2.2.  Its stress lacks a factor F.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import roots_jacobi

from ...core.errors import InvalidInput, InvertedCells
from ..meshes.cells import CELLS, ReferenceCell
from ..meshes.check import determinant
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .elasticity import LinearElastic, materials_by_region
from .hyperelastic_cells import energy_of, forces_inplace, tangent_inplace

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class NeoHookean:
    """Compressible neo-Hookean law: young, unit of stress, > 0; -1 < poisson < 0.5.

    W = shear / 2 (tr C - 3) - shear ln J + lame_lambda / 2 (ln J)^2, [BW] eq. (6.27).
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson)  # its checks

    @property
    def shear(self) -> float:
        """Shear modulus at F = I, unit of stress."""
        return LinearElastic(self.young, self.poisson).shear

    def lame_lambda(self, dim: int = 3) -> float:
        """First Lamé constant at F = I, also of plane strain; unit of stress."""
        return LinearElastic(self.young, self.poisson).lame_lambda(dim)

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """a, b, c, d, e of the family, unit of stress."""
        return self.shear / 2, 0.0, 0.0, self.shear, self.lame_lambda()


@dataclass(frozen=True)
class CiarletGeymonat:
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
    def shear(self) -> float:
        """Shear modulus at F = I, unit of stress."""
        return LinearElastic(self.young, self.poisson).shear

    def lame_lambda(self, dim: int = 3) -> float:
        """First Lamé constant at F = I, also of plane strain; unit of stress."""
        return LinearElastic(self.young, self.poisson).lame_lambda(dim)

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


@dataclass(frozen=True, eq=False)
class _Block:
    """Cells of one kind and region, ready for the compiled loops."""

    nodes: Index
    gradients: Array
    volumes: Array
    laws: Array
    places: Index


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
        self.pointers, self.columns, places = node_pattern(mesh)
        self.blocks = [
            _block(mesh, cells, laws[cells.region].coefficients, place)  # type: ignore[attr-defined]
            for cells, place in zip(mesh.cells, places, strict=True)
        ]

    def forces(self, u: Array) -> Array:
        """Nodal forces (n, dim) that hold the displacements u (n, dim): dE/du."""
        u = np.ascontiguousarray(u, dtype=float)
        out = np.zeros_like(u)
        for block in self.blocks:
            least = forces_inplace(
                u, block.nodes, block.gradients, block.volumes, block.laws, out
            )
            _check(least)
        return out

    def tangent(self, u: Array) -> tuple[Array, Array]:
        """(forces (n, dim), blocks (m, dim, dim) of the derivative by u)."""
        u = np.ascontiguousarray(u, dtype=float)
        dim = u.shape[1]
        out, blocks = np.zeros_like(u), np.zeros((len(self.columns), dim, dim))
        for block in self.blocks:
            least = tangent_inplace(u, block.nodes, block.gradients, block.volumes, block.laws,
                                    block.places, out, blocks)  # fmt: skip
            _check(least)
        return out, blocks

    def unit_forces(self) -> Array:
        """Sizes of nodal forces (n,) where stresses are as large as moduli, for rounding."""
        out = np.zeros(len(self.mesh.points))
        for block in self.blocks:
            a, b, c, d, e = block.laws[0]
            modulus = 2 * a + 4 * b + 4 * c + d + e
            sizes = np.linalg.norm(block.gradients, axis=3) * block.volumes[:, :, None]
            np.add.at(out, block.nodes, modulus * sizes.sum(axis=1))
        return out

    def matrix(self, blocks: Array) -> sparse.bsr_array:
        """The blocks of `tangent` as a matrix (n dim, n dim)."""
        size = self.mesh.points.size
        return sparse.bsr_array((blocks, self.columns, self.pointers), shape=(size, size))

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (n, dim), unit of work; zero at rest."""
        u = np.ascontiguousarray(u, dtype=float)
        total = 0.0
        for block in self.blocks:
            part, least = energy_of(u, block.nodes, block.gradients, block.volumes, block.laws)
            _check(least)
            total += part
        return total


def _check(least: float) -> None:
    """Raise InvertedCells where J is not positive (or not a number)."""
    if not least > 0:
        raise InvertedCells(f"cells are inverted: the least det F is {least:.3g}")


def node_pattern(mesh: Mesh) -> tuple[NDArray[np.int32], NDArray[np.int32], list[Index]]:
    """Row pointers, columns, and per block of cells the place of every pair of nodes."""
    n = len(mesh.points)
    keys = [cells.nodes[:, :, None] * n + cells.nodes[:, None, :] for cells in mesh.cells]
    unique, inverse = np.unique(np.concatenate([k.ravel() for k in keys]), return_inverse=True)
    pointers = np.searchsorted(unique // n, np.arange(n + 1)).astype(np.int32)
    ends = np.cumsum([k.size for k in keys])[:-1]
    parts = np.split(inverse.ravel(), ends)
    places = [part.reshape(k.shape) for part, k in zip(parts, keys, strict=True)]
    return pointers, (unique % n).astype(np.int32), places


def _block(mesh: Mesh, cells: Cells, law: tuple[float, ...], places: Index) -> _Block:
    """Gradients of the shape functions and volumes at the points of integration."""
    cell = CELLS[cells.kind]
    gradients, volumes = [], []
    for at, weight in zip(*_rule(cell), strict=True):
        jac = cell.jacobians(mesh.points[cells.nodes], at)
        volumes.append(weight * determinant(jac))
        gradients.append(cell.gradient(at) @ np.linalg.inv(jac))
    laws = np.tile(np.asarray(law), (len(cells.nodes), 1))
    arrays = (cells.nodes, np.stack(gradients, axis=1), np.stack(volumes, axis=1), laws, places)
    return _Block(*(np.array(a, order="C") for a in arrays))  # one type for compiled loops


def _rule(cell: ReferenceCell) -> tuple[Array, Array]:
    """Points and weights: one point where F is constant, else enough to hold all modes."""
    if cell.kind in ("tri", "tet"):
        return cell.centre[None], np.array([cell.gauss[1].sum()])
    if cell.kind != "pyramid":
        return cell.gauss
    flat = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
    height, weights = roots_jacobi(2, 2, 0)  # the square of the distance from the apex
    points = [((1 - h) * x, (1 - h) * y, h)
              for h, x, y in product((1 + height) / 2, flat, flat)]  # fmt: skip
    return np.array(points), np.repeat(weights / 8, 4) / 4


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
        jac = cell.jacobians(mesh.points[cells.nodes], cell.centre)
        slopes = cell.gradient(cell.centre) @ np.linalg.inv(jac)
        F = np.tile(np.eye(3), (len(cells.nodes), 1, 1))
        F[:, : mesh.dim, : mesh.dim] += np.einsum(
            "kac,kad->kcd", displacement[cells.nodes], slopes
        )
        J = np.linalg.det(F)
        _check(float(J.min()))
        a, b, c, d, e = laws[cells.region].coefficients  # type: ignore[attr-defined]
        B = F @ F.swapaxes(1, 2)
        trace = np.trace(B, axis1=1, axis2=2)[:, None, None]
        g = (2 * c * J**2 - d + e * np.log(J))[:, None, None]
        kirchhoff = 2 * a * B + 2 * b * (trace * B - B @ B) + g * np.eye(3)
        parts.append(kirchhoff / J[:, None, None])
    return np.concatenate(parts)
