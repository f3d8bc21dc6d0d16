"""Linear elasticity: materials, stiffness (by NGSolve), body forces, stresses.

Small strains: sigma = lame_lambda tr(eps) I + 2 shear eps.  In 2D plane strain, or plane stress
with lame_lambda replaced by 2 lame_lambda shear / (lame_lambda + 2 shear); unit thickness.
Degrees of freedom are interleaved: node * dim + component.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import number
from ...core.errors import InvalidInput, MissingDependency
from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.mesh import Mesh, unknown
from .nodal_basis import hierarchical_from_nodal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearElastic:
    """Isotropic elasticity: young, unit of stress, > 0; -1 < poisson < 0.5.

    plane: "strain" or "stress", read in 2D only.  density: mass per volume (per area in 2D),
    read by dynamics only.
    """

    young: float
    poisson: float
    plane: str = "strain"
    density: float | None = None

    def __post_init__(self) -> None:
        number("young", self.young), number("poisson", self.poisson)
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

    @property
    def shear(self) -> float:
        """Shear modulus, unit of stress."""
        return self.young / (2 * (1 + self.poisson))

    def lame_lambda(self, dim: int) -> float:
        """First Lamé constant, in 2D that of the plane state; unit of stress."""
        value = self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
        if dim == 2 and self.plane == "stress":
            return 2 * value * self.shear / (value + 2 * self.shear)
        return value


Materials = Mapping[str, LinearElastic]


def materials_by_region(
    mesh: Mesh, material: LinearElastic | Materials
) -> dict[str, LinearElastic]:
    """One material per region of the mesh; InvalidInput for missing or unknown ones."""
    if not isinstance(material, Mapping):
        return dict.fromkeys(mesh.regions, material)
    for region in material:
        if region not in mesh.regions:
            raise InvalidInput("material: " + unknown("region", region, mesh.regions))
    missing = [region for region in mesh.regions if region not in material]
    if missing:
        raise InvalidInput(f"material: expected one for region {missing[0]!r}, got none")
    return dict(material)


def stiffness(mesh: Mesh, material: LinearElastic | Materials) -> sparse.bsr_array:
    """Stiffness matrix (n dim, n dim) in blocks of dim x dim, force per length.

    Integrated exactly where the sides of quadrilaterals and hexahedra are parallel; otherwise
    with mesh.order + 1 Gauss points per direction.
    """
    ng = _ngsolve()
    by_region = materials_by_region(mesh, material)
    engine_mesh = _engine_mesh(mesh)
    space = ng.H1(engine_mesh, order=mesh.order, dim=mesh.dim)
    lame = engine_mesh.MaterialCF({k: m.lame_lambda(mesh.dim) for k, m in by_region.items()})
    shear = engine_mesh.MaterialCF({k: m.shear for k, m in by_region.items()})
    u, v = space.TnT()
    strain = 0.5 * (ng.Grad(u) + ng.Grad(u).trans)
    form = ng.BilinearForm(space)
    form += (
        2 * shear * ng.InnerProduct(strain, ng.Grad(v))
        + lame * ng.Trace(ng.Grad(u)) * ng.Trace(ng.Grad(v))
    ) * ng.dx
    form.Assemble()
    values, columns, pointers = (part.NumPy() for part in form.mat.CSR())
    size, d = len(mesh.points) * mesh.dim, mesh.dim
    blocks = values.reshape(-1, d, d).copy()  # the engine's memory dies with the form
    matrix = sparse.bsr_array(
        (blocks, columns.copy(), pointers.astype(np.int32)), shape=(size, size)
    )
    if mesh.order == 1:
        return matrix
    change = sparse.kron(hierarchical_from_nodal(ng, mesh, engine_mesh), np.eye(d), "csr")
    return sparse.bsr_array(change.T @ matrix.tocsr() @ change, blocksize=(d, d))


def _ngsolve() -> Any:
    try:
        import ngsolve
    except ImportError as error:
        raise MissingDependency(
            f"finite elements need the package ngsolve: python -m pip install ngsolve ({error})"
        ) from error
    return ngsolve


def _engine_mesh(mesh: Mesh) -> Any:
    """The NGSolve mesh with the same corners and regions, in the same order."""
    ng = _ngsolve()
    from netgen.meshing import Mesh as NetgenMesh

    out = NetgenMesh(dim=mesh.dim)
    tables = [(block, block.nodes[:, : CELLS[block.kind].corner_count]) for block in mesh.cells]
    points = mesh.points[: 1 + max(int(nodes.max()) for _, nodes in tables)]
    out.AddPoints(np.c_[points, np.zeros(len(points))][:, :3].copy())
    index = {region: out.AddRegion(region, mesh.dim) for region in mesh.regions}
    for block, table in tables:
        nodes = np.ascontiguousarray(table, dtype=np.int32)
        out.AddElements(dim=mesh.dim, index=index[block.region], data=nodes, base=0)
    return ng.Mesh(out)


def body_load(mesh: Mesh, force: Array, region: str | None = None) -> Array:
    """Nodal forces (n, dim) of a force per volume (n, dim) given at the nodes."""
    if region is not None and region not in mesh.regions:
        raise InvalidInput("body force: " + unknown("region", region, mesh.regions))
    load = np.zeros_like(mesh.points)
    for block in mesh.cells:
        if region is not None and block.region != region:
            continue
        cell = CELLS[block.kind]
        coordinates = mesh.points[block.nodes]
        for at, weight in zip(*cell.gauss, strict=True):
            shape = cell.shape(at)
            volume = weight * determinant(cell.jacobians(coordinates, at))
            value = np.einsum("a,kac->kc", shape, force[block.nodes]) * volume[:, None]
            for local, share in enumerate(shape):
                np.add.at(load, block.nodes[:, local], share * value)
    return load


def cell_stress(mesh: Mesh, material: LinearElastic | Materials, displacement: Array) -> Array:
    """Stress at the centre of every cell, (cells, 3, 3), in the order of mesh.cells.

    displacement (n, dim).  In 2D the third row holds the stress across the plane: zero in plane
    stress, poisson (s_xx + s_yy) in plane strain.
    """
    by_region = materials_by_region(mesh, material)
    parts = []
    for block in mesh.cells:
        cell, law = CELLS[block.kind], by_region[block.region]
        slopes = cell.gradient(cell.centre)
        jac = cell.jacobians(mesh.points[block.nodes], cell.centre)
        gradient = np.einsum("kac,ad->kcd", displacement[block.nodes], slopes) @ np.linalg.inv(
            jac
        )
        strain = 0.5 * (gradient + gradient.swapaxes(1, 2))
        trace = np.trace(strain, axis1=1, axis2=2)
        lame = law.lame_lambda(mesh.dim) * trace
        stress = np.zeros((len(strain), 3, 3))
        stress[:, : mesh.dim, : mesh.dim] = 2 * law.shear * strain
        across = 3 if mesh.dim == 3 or law.plane == "strain" else 2
        for k in range(across):
            stress[:, k, k] += lame
        parts.append(stress)
    return np.concatenate(parts)


def von_mises(stress: Array) -> Array:
    """Von Mises equivalent of stresses (k, 3, 3): (k,), unit of stress."""
    pressure = np.trace(stress, axis1=1, axis2=2) / 3
    deviator = stress - pressure[:, None, None] * np.eye(3)
    return np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
