"""Linear elasticity: materials, stiffness, body forces, stresses.

Small strains: sigma = lame_lambda tr(eps) I + 2 shear eps.  In 2D plane strain, or plane stress
with lame_lambda replaced by 2 lame_lambda shear / (lame_lambda + 2 shear); unit thickness.
Axisymmetric meshes, without twist: all is of the whole body, around the axis once.
Degrees of freedom are interleaved: node * dim + component.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import number, read_only
from ...core.errors import InvalidInput
from ...core.threads import over_stages
from ...core.words import helpful
from ..meshes.cells import CELLS
from ..meshes.check import around, determinant, parts_of
from ..meshes.facets import Cells
from ..meshes.linear_cells import Rule
from ..meshes.mesh import Mesh, unknown
from .cell_loops import stiffness_inplace
from .cell_matrices import add_blocks, cell_stiffness, rule_of
from .hybrid import averaged, element_formulation, is_hybrid, volume_modes, volume_modulus
from .hybrid_loops import volume_terms_inplace
from .pattern import node_pattern
from .slabs import in_slabs
from .uniform import mean_gradient

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Elastic(Protocol):
    """What element loops ask of a law of small strains."""

    def moduli(self, dim: int) -> Array:
        """d stress_ik / d gradient_jl at [i, j, k, l], (dim, dim, dim, dim), unit of stress."""
        ...


class Isotropic:
    """What follows from young and poisson at small strains."""

    young: float
    poisson: float
    plane: str = "strain"
    finite: ClassVar[bool] = False  # a law of finite strains

    @property
    def shear(self) -> float:
        """Shear modulus, at finite strains that at F = I; unit of stress."""
        return self.young / (2 * (1 + self.poisson))

    def lame_lambda(self, dim: int = 3) -> float:
        """First Lamé constant, at F = I, in 2D that of the plane state; unit of stress."""
        lame = self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
        return self.plane_lambda(lame, dim)

    def plane_lambda(self, lame: float, dim: int) -> float:
        """What lame, the first Lamé constant, becomes in plane stress; else itself."""
        if dim == 2 and self.plane == "stress":
            return 2 * lame * self.shear / (lame + 2 * self.shear)
        return lame

    def moduli(self, dim: int) -> Array:
        """d stress_ik / d gradient_jl at [i, j, k, l], (dim, dim, dim, dim), unit of stress."""
        eye = np.eye(dim)
        out = self.lame_lambda(dim) * np.einsum("ik,jl->ijkl", eye, eye)
        return out + self.shape_moduli(dim)

    def shape_moduli(self, dim: int) -> Array:
        """`moduli` without the volume term lame_lambda (tr eps)^2 / 2 of hybrid cells."""
        eye, shear = np.eye(dim), self.shear
        out = shear * np.einsum("ij,kl->ijkl", eye, eye)
        return out + shear * np.einsum("il,jk->ijkl", eye, eye)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U, U' and U'' of the volume term of hybrid cells, at J = 1 + tr eps of any shape."""
        change, lame = J - 1, self.lame_lambda()
        return lame / 2 * change**2, lame * change, np.full_like(change, lame)


@helpful
@dataclass(frozen=True)
class LinearElastic(Isotropic):
    """Isotropic elasticity: young, unit of stress, > 0; -1 < poisson < 0.5.

    plane: "strain" or "stress", read in 2D only.  density: mass per volume (per area in 2D),
    read by dynamics only.  expansion: strain per temperature, see `Temperature`.
    """

    young: float
    poisson: float
    plane: str = "strain"
    density: float | None = None
    expansion: float = 0.0

    def __post_init__(self) -> None:
        number("expansion", self.expansion)
        number("young", self.young)
        number("poisson", self.poisson)
        if self.density is not None:
            number("density", self.density)
        if not self.young > 0:
            raise InvalidInput(f"young: expected a finite stress > 0, got {self.young!r}")
        if not -1 < self.poisson < 0.5:
            why = (
                "; at 0.5 the material is incompressible and its stiffness infinite: "
                "take 0.49 or less"
                if self.poisson >= 0.5
                else ""
            )
            raise InvalidInput(
                f"poisson: expected between -1 and 0.5, got {self.poisson!r}{why}"
            )
        if self.plane not in ("strain", "stress"):
            raise InvalidInput(f'plane: expected "strain" or "stress", got {self.plane!r}')
        if self.density is not None and not self.density > 0:
            raise InvalidInput(f"density: expected a finite number > 0, got {self.density!r}")

    def shape_stress(self, gradient: Array) -> Array:
        """`stress` without that of the volume term of hybrid cells."""
        dim = gradient.shape[1]
        out = np.zeros((len(gradient), 3, 3))
        out[:, :dim, :dim] = self.shear * (gradient + gradient.swapaxes(1, 2))
        return out

    def stress(self, gradient: Array) -> Array:
        """Stress (k, 3, 3) of displacement gradients (k, dim, dim); see `cell_stress`."""
        dim, out = gradient.shape[1], self.shape_stress(gradient)
        across = 3 if dim == 3 or self.plane == "strain" else 2
        lame = self.lame_lambda(dim) * np.trace(gradient, axis1=1, axis2=2)
        for k in range(across):
            out[:, k, k] += lame
        return out


Materials = Mapping[str, LinearElastic]
Law = TypeVar("Law")


def materials_by_region(
    mesh: Mesh, material: Law | Mapping[str, Law]
) -> dict[str, Law]:
    """One material per region of the mesh; InvalidInput for missing or unknown ones."""
    if not isinstance(material, Mapping):
        return dict.fromkeys(mesh.regions, material)
    for region in material:
        if region not in mesh.regions:
            raise InvalidInput(unknown("region", region, mesh.regions), (), "material")
    missing = [region for region in mesh.regions if region not in material]
    if missing:
        raise InvalidInput(f"expected one for region {missing[0]!r}, got none", (), "material")
    return dict(material)


def stiffness(
    mesh: Mesh, material: Elastic | Mapping[str, Elastic]
) -> sparse.bsr_array:
    """Stiffness matrix (n dim, n dim) in blocks of dim x dim, force per length.

    Exactly symmetric.  Integrated exactly where the sides of quadrilaterals and hexahedra are
    parallel; otherwise with mesh.order + 1 Gauss points per direction, and with fewer where
    cells ask for reduced integration.  Near incompressibility see `element_formulation`.
    Axisymmetric meshes: of the whole body around the axis.
    """
    by_region = materials_by_region(mesh, material)
    pointers, columns = node_pattern(mesh.cells, len(mesh.points))
    blocks = np.zeros((len(columns), mesh.dim, mesh.dim))
    for cells in mesh.cells:
        law = by_region[cells.region]
        formulation = element_formulation(mesh, cells, law)
        if mesh.axisymmetric or formulation.endswith("incompatible"):
            add_blocks(blocks, (pointers, columns), cell_stiffness(mesh, cells, law))
            continue
        rule, unit = rule_of(mesh, cells), (1.0,) * mesh.dim
        geometry = geometry_of(mesh, cells, rule)
        if formulation != "hybrid":
            moduli = law.moduli(mesh.dim)
            _add_stiffness(geometry, moduli, (pointers, columns), blocks)
            continue
        moduli = law.shape_moduli(mesh.dim)  # type: ignore[attr-defined]  # of hybrid cells
        _add_stiffness(geometry, moduli, (pointers, columns), blocks)
        modes, _ = volume_modes(mesh, cells, rule)
        bulk = volume_modulus(law) * np.eye(modes.shape[1])
        bulk = np.tile(bulk, (len(modes), 1, 1))
        rest = np.zeros(mesh.points.shape)
        volume_terms_inplace(rest, *geometry, modes, bulk, pointers, columns, blocks, unit)
    return sparse.bsr_array((blocks, columns, pointers), shape=(mesh.points.size,) * 2)


def _add_stiffness(
    geometry: tuple[Array, Index, Array, Array],
    moduli: Array,
    pattern: tuple[NDArray[np.int32], NDArray[np.int32]],
    blocks: Array,
) -> None:
    """Add (1) of `cell_loops` to the blocks (m, dim, dim) of a pattern, in threads."""
    points, nodes, slopes, weights = geometry
    sorted_nodes, slabs = in_slabs(points, nodes)
    nodes = read_only(sorted_nodes.view())
    unit = (1.0,) * points.shape[1]
    work = float(nodes.size * len(weights) * blocks[0].size * nodes.shape[1])
    arguments = points, nodes, slopes, weights, moduli, *pattern, blocks, unit
    over_stages(stiffness_inplace, slabs, work, *arguments)


def geometry_of(mesh: Mesh, cells: Cells, rule: Rule) -> tuple[Array, Index, Array, Array]:
    """What the loops over cells begin with: points, nodes, slopes and weights.

    Of one type for all cells: another one would have the loops compiled again.
    """
    nodes = read_only(np.ascontiguousarray(cells.nodes).view())
    return mesh.points, nodes, np.array(CELLS[cells.kind].gradient(rule[0]), order="C"), rule[1]


def body_load(mesh: Mesh, force: Array, region: str | None = None) -> Array:
    """Nodal forces (n, dim) of a force per volume (n, dim) given at the nodes.

    Cells of reduced integration sum it up at the points of their stiffness, as CalculiX does.
    """
    if region is not None and region not in mesh.regions:
        raise InvalidInput("body force: " + unknown("region", region, mesh.regions))
    load = np.zeros_like(mesh.points)
    for block in mesh.cells:
        if region is not None and block.region != region:
            continue
        cell = CELLS[block.kind]
        coordinates = mesh.points[block.nodes]
        reduced = block.integration == "reduced" and cell.reduced is not None
        for at, weight in zip(*(rule_of(mesh, block) if reduced else cell.gauss), strict=True):
            shape = cell.shape(at)
            volume = weight * determinant(cell.jacobians(coordinates, at))
            where = np.einsum("a,kac->kc", shape, coordinates)
            volume = volume * around(where, axisymmetric=mesh.axisymmetric)
            value = np.einsum("a,kac->kc", shape, force[block.nodes]) * volume[:, None]
            for local, share in enumerate(shape):
                np.add.at(load, block.nodes[:, local], share * value)
    return load


def cell_stress(
    mesh: Mesh, material: LinearElastic | Materials, displacement: Array,
    warming: Array | None = None,
) -> Array:  # fmt: skip
    """Stress at the centre of every cell, (cells, 3, 3), in the order of mesh.cells.

    displacement (n, dim).  In 2D the third row holds the stress across the plane: zero in plane
    stress, poisson (s_xx + s_yy) in plane strain, that around the axis in axisymmetric meshes.
    warming (n,): change of temperature.  Hybrid cells have the pressure of their mean volume.
    """
    by_region = materials_by_region(mesh, material)
    parts = []
    for block in mesh.cells:
        cell, law = CELLS[block.kind], by_region[block.region]
        gradient = gradient_at(mesh, block, displacement, cell.centre)
        hybrid = is_hybrid(mesh, block, law)
        stress = law.shape_stress(gradient) if hybrid else law.stress(gradient)
        if hybrid:
            p = volume_stress(mesh, block, law, displacement, cell.centre[None], warming)
            stress += p[:, :1, None] * np.eye(3)
        if warming is not None:
            change = warming[block.nodes] @ cell.shape(cell.centre)
            stress -= change[:, None, None] * shape_held(law, mesh, hybrid=hybrid)
        parts.append(stress)
    return np.concatenate(parts)


def gradient_at(mesh: Mesh, block: Cells, displacement: Array, at: Array) -> Array:
    """Displacement gradients (k, dim, dim) of cells at a point, (k, 3, 3) around an axis."""
    cell, found = CELLS[block.kind], []
    for nodes in parts_of(block.nodes):
        x, u = mesh.points[nodes], displacement[nodes]
        gradient = np.einsum("kac,kad->kcd", u, cell.gradients(x, at))
        if mesh.axisymmetric:
            shape = cell.shape(at)
            gradient = with_hoop(gradient, x[:, :, 0] @ shape, u[:, :, 0] @ shape)
        found.append(gradient)
    return found[0] if len(found) == 1 else np.concatenate(found)


def volume_stress(  # noqa: PLR0913  # as cell_stress, and where
    mesh: Mesh, block: Cells, law: Any, displacement: Array, at: Array,
    warming: Array | None = None,
) -> Array:  # fmt: skip
    """U'(theta) (k, p) of hybrid cells at reference points (p, dim), unit of stress.

    warming (n,): change of temperature, whose expansion is taken off.
    """
    rule, cell = rule_of(mesh, block, finite=law.finite), CELLS[block.kind]
    if element_formulation(mesh, block, law) == "hybrid-incompatible":
        mean = mean_gradient(mesh, block, displacement)
        slopes = np.repeat(mean[:, None], len(rule[1]), axis=1)
    else:
        slopes = np.stack([gradient_at(mesh, block, displacement, x) for x in rule[0]], axis=1)
    if law.finite:
        ratio = np.linalg.det(np.eye(slopes.shape[-1]) + slopes)
    else:
        ratio = 1 + np.trace(slopes, axis1=2, axis2=3)
    if warming is not None:
        ratio -= 3 * law.expansion * (warming[block.nodes] @ cell.shape(rule[0]).T)
    modes, volumes = volume_modes(mesh, block, rule)
    there, _ = volume_modes(mesh, block, rule, at)
    pressure = law.volume(averaged(modes, volumes, ratio))[1]
    return averaged(modes, volumes, pressure, there)


def held_stress(law: Any, dim: int, *, axisymmetric: bool = False) -> Array:
    """Stress (3, 3) that would stretch a body as one degree does, unit of stress.

    Zero for laws that do not expand.
    """
    out = np.zeros((3, 3))
    alpha = np.asarray(getattr(law, "expansion", 0.0), dtype=float)
    if not alpha.any():
        return out
    strain = alpha * np.eye(3)
    if alpha.ndim:
        strain = law.rotation.T @ np.diag(alpha) @ law.rotation
    if dim == 2 and not axisymmetric and law.plane == "stress":
        out[:2, :2] = np.einsum("ijkl,jl->ik", law.moduli(2), strain[:2, :2])
        return out
    return np.einsum("ijkl,jl->ik", law.moduli(3), strain)


def shape_held(law: Any, mesh: Mesh, *, hybrid: bool) -> Array:
    """`held_stress` in cells of a mesh, in hybrid ones without that of the volume term."""
    held = held_stress(law, mesh.dim, axisymmetric=mesh.axisymmetric)
    return held - volume_modulus(law) * 3 * law.expansion * np.eye(3) if hybrid else held


def with_hoop(gradient: Array, r: Array, u: Array) -> Array:
    """Gradients (k, 3, 3) in r, z and around of gradients (k, 2, 2) at radii r (k,).

    u (k,): radial displacements; on the axis u / r is its slope.
    """
    out = np.zeros((len(gradient), 3, 3))
    out[:, :2, :2] = gradient
    off = r > 0
    out[:, 2, 2] = np.where(off, u / np.where(off, r, 1.0), gradient[:, 0, 0])
    return out


def von_mises(stress: Array) -> Array:
    """Von Mises equivalent of stresses (k, 3, 3): (k,), unit of stress."""
    pressure = np.trace(stress, axis1=1, axis2=2) / 3
    out = np.zeros(len(stress))
    for i in range(3):  # entry by entry: long arrays take no more than one of them
        for j in range(3):
            part = stress[:, i, j] - pressure if i == j else stress[:, i, j]
            out += part * part
    return np.sqrt(1.5 * out)
