"""Mass matrices from the densities of the materials: consistent, or lumped at the nodes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..meshes.cells import CELLS
from ..meshes.check import around, determinant
from ..meshes.mesh import Mesh
from .elasticity import LinearElastic, materials_by_region
from .given import GivenMatrices

Array = NDArray[np.float64]


def mass(
    mesh: Mesh, material: LinearElastic | GivenMatrices | Mapping[str, LinearElastic]
) -> sparse.csr_array:
    """Consistent mass matrix (n dim, n dim): integrals of density N_a N_b, or the given one."""
    if isinstance(material, GivenMatrices):
        if material.mass is None:
            raise InvalidInput("mass: dynamics need it, give Body.from_matrix(..., mass=M)")
        return material.mass
    blocks: list[NDArray] = [np.zeros((3, 0))]
    for region, kind, nodes in ((b.region, b.kind, b.nodes) for b in mesh.cells):
        density = _density(materials_by_region(mesh, material)[region], region)
        cell = CELLS[kind]
        local = np.zeros((len(nodes), nodes.shape[1], nodes.shape[1]))
        for at, weight in zip(*cell.gauss, strict=True):
            shape = cell.shape(at)
            volume = weight * determinant(cell.jacobians(mesh.points[nodes], at))
            where = np.einsum("a,kac->kc", shape, mesh.points[nodes])
            volume = volume * around(where, axisymmetric=mesh.axisymmetric)
            local += density * volume[:, None, None] * np.outer(shape, shape)
        rows = np.broadcast_to(nodes[:, :, None], local.shape)
        columns = np.broadcast_to(nodes[:, None, :], local.shape)
        blocks.append(np.stack([local.ravel(), rows.ravel(), columns.ravel()]))
    data, rows, columns = np.concatenate(blocks, axis=1)
    n = len(mesh.points)
    entries = (data, (rows.astype(np.int64), columns.astype(np.int64)))
    scalar = sparse.coo_array(entries, shape=(n, n)).tocsr()
    return sparse.csr_array(sparse.kron(scalar, sparse.eye_array(mesh.dim), format="csr"))


def lumped(consistent: sparse.csr_array) -> sparse.csr_array:
    """The diagonal matrix with the row sums; raises InvalidInput where one is not positive."""
    sums = np.asarray(consistent.sum(axis=1)).ravel()
    if not (sums > 0).all():
        raise InvalidInput(
            "lumped: the mesh gives nodes without mass (second order?), use the consistent mass"
        )
    return sparse.csr_array(sparse.diags_array(sums))


def _density(material: LinearElastic, region: str) -> float:
    if material.density is None:
        raise InvalidInput(
            f"material of region {region!r}: dynamics need its density, such as "
            "LinearElastic(..., density=7.8e-9) in N, mm, s"
        )
    return material.density
