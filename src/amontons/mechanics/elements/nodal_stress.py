"""Stress at nodes: what the cells around say of it there, averaged by volume."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells
from ..meshes.cells import CELLS, ReferenceCell
from ..meshes.check import determinant, parts_of
from .cell_loops import nodal_gradients_inplace
from .elasticity import (
    cell_stress,
    geometry_of,
    materials_by_region,
    shape_held,
    volume_stress,
    with_hoop,
)
from .hybrid import is_hybrid
from .hyperelasticity import cauchy_stress, is_hyperelastic

if TYPE_CHECKING:
    from ..meshes.facets import Cells
    from ..meshes.mesh import Mesh

Array = NDArray[np.float64]
ASIDE = 1e-3  # how far from the apex of a pyramid its gradients are taken: there are none at it


def stress_of(
    mesh: Mesh, material: Any, displacement: Array, warming: Array | None = None
) -> tuple[Array, Array]:
    """Stress at the centres of the cells, (cells, 3, 3), and at the nodes, (nodes, 3, 3).

    material: of a body that deforms; displacement (nodes, dim).  Cauchy stress of hyperelastic
    laws, see `cell_stress` for the others.  Regions keep their laws: a node between them has
    the mean of their stresses.  warming (nodes,): change of temperature.  Raises InvertedCells
    where the centre of a cell is.
    """
    if is_hyperelastic(material):
        at_centres = cauchy_stress(mesh, material, displacement)
    else:
        at_centres = cell_stress(mesh, material, displacement, warming)
    return at_centres, _at_nodes(mesh, material, displacement, at_centres, warming)


def _at_nodes(
    mesh: Mesh, material: Any, displacement: Array, at_centres: Array, warming: Array | None
) -> Array:
    laws = materials_by_region(mesh, material)
    u = np.ascontiguousarray(displacement, dtype=float)
    n, dim = u.shape
    unit = (1.0,) * dim
    total, weight = np.zeros((n, 3, 3)), np.zeros(n)
    for law, hybrid in _groups(mesh, laws):
        gradient, volume, pressure = np.zeros((n, dim, dim)), np.zeros(n), np.zeros(n)
        for cells in mesh.cells:
            if laws[cells.region] is law and is_hybrid(mesh, cells, law) == hybrid:
                cell = CELLS[cells.kind]
                rule = (_places(cell), np.ones(cell.nodes))
                points, nodes, slopes, _ = geometry_of(mesh, cells, rule)
                nodal_gradients_inplace(u, points, nodes, slopes, gradient, volume, unit)
                if hybrid:
                    p = volume_stress(mesh, cells, law, u, rule[0], warming)
                    np.add.at(pressure, nodes, p * _corner_volumes(mesh, cells, rule[0]))
        for at in parts_of(np.flatnonzero(volume)):
            mean = gradient[at] / volume[at, None, None]
            if mesh.axisymmetric:
                mean = with_hoop(mean, mesh.points[at, 0], u[at, 0])
            try:
                stress = law.shape_stress(mean) if hybrid else law.stress(mean)
            except InvertedCells:  # at corners, though no cell is at its centre
                return mean_of_centres(mesh, at_centres)
            if hybrid:
                stress = stress + (pressure[at] / volume[at])[:, None, None] * np.eye(3)
            if warming is not None:
                held = shape_held(law, mesh, hybrid=hybrid)
                stress = stress - warming[at, None, None] * held
            total[at] += volume[at, None, None] * stress
        weight += volume
    missing = weight == 0
    total /= np.where(missing, 1.0, weight)[:, None, None]
    if missing.any():
        total[missing] = mean_of_centres(mesh, at_centres)[missing]
    return total


def _groups(mesh: Mesh, laws: Mapping[str, Any]) -> list[tuple[Any, bool]]:
    """The laws of a mesh, each with whether its cells are hybrid; both where some are."""
    found = {}
    for cells in mesh.cells:
        law = laws[cells.region]
        hybrid = is_hybrid(mesh, cells, law)
        found[id(law), hybrid] = (law, hybrid)
    return list(found.values())


def _corner_volumes(mesh: Mesh, cells: Cells, places: Array) -> Array:
    """Weights (k, nodes) of the cells at their nodes, as in `nodal_gradients_inplace`."""
    cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
    return np.stack([np.maximum(determinant(cell.jacobians(x, at)), 0) for at in places], 1)


def _places(cell: ReferenceCell) -> Array:
    """Where gradients at the nodes are taken, (nodes, dim)."""
    if cell.kind != "pyramid":
        return cell.corners
    return (1 - ASIDE) * cell.corners + ASIDE * cell.centre


def mean_of_centres(mesh: Mesh, at_centres: Array) -> Array:
    """Mean of the stresses of the cells around every node, (nodes, 3, 3)."""
    total, count = np.zeros((len(mesh.points), 3, 3)), np.zeros(len(mesh.points))
    first = 0
    for cells in mesh.cells:
        own = at_centres[first : first + len(cells.nodes)]
        for column in cells.nodes.T:
            np.add.at(total, column, own)
            np.add.at(count, column, 1)
        first += len(cells.nodes)
    return total / count[:, None, None]
