"""Thermal strains: a change of temperature T makes a body that nothing holds grow by alpha T.

The stress is that of the strain without alpha T; in nodal forces, those of the stress C alpha T
are added to the loads.  Linear elastic laws alone have an `expansion` alpha.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..meshes.cells import CELLS
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_matrices import components, gradient_rows, in_parts, rule_of, volume_rows
from .elasticity import held_stress, materials_by_region
from .hybrid import is_hybrid, volume_modes, volume_modulus

Array = NDArray[np.float64]


MEAN = {"quad", "hex"}  # cells that CalculiX and Abaqus give one temperature


def thermal_load(mesh: Mesh, material: Any, change: Array, *, mean: bool = False) -> Array:
    """Nodal forces (n, dim) of a change of temperature (n,) given at the nodes.

    mean: fully integrated quad and hex cells take the mean of their nodes.
    """
    laws: Mapping[str, Any] = materials_by_region(mesh, material)
    load = np.zeros_like(mesh.points)
    pairs = components(mesh.dim, axisymmetric=mesh.axisymmetric)
    for cells in mesh.cells:
        law = laws[cells.region]
        stress = held_stress(law, mesh.dim, axisymmetric=mesh.axisymmetric)
        if not stress.any():
            continue
        if cells.integration == "incompatible":
            raise InvalidInput(
                f"temperature: {cells.kind} cells with incompatible modes have no thermal "
                "strains; take full integration"
            )
        if is_hybrid(mesh, cells, law):
            bulk = 3 * law.expansion * volume_modulus(law)
            _add_volume_load(load, mesh, cells, bulk * change[cells.nodes])
            stress = stress - bulk * np.eye(3)
        cell, rows = CELLS[cells.kind], np.array([stress[i, k] for i, k in pairs])
        averaged = mean and cells.kind in MEAN and cells.integration in ("full", "auto")
        for nodes in in_parts(cells):
            for at, weight in zip(*rule_of(mesh, cells), strict=True):
                B, volume = gradient_rows(mesh, cells.kind, nodes, at)
                shares = cell.shape(cell.centre if averaged else at)
                here = change[nodes] @ shares * weight * volume
                force = np.einsum("s,ksa,k->ka", rows, B, here)
                np.add.at(load, nodes, force.reshape(*nodes.shape, mesh.dim))
    return load


def _add_volume_load(load: Array, mesh: Mesh, cells: Cells, pressure: Array) -> None:
    """Add the forces of a pressure (k, a), given at the nodes, in hybrid cells."""
    rule = rule_of(mesh, cells)
    here = pressure @ CELLS[cells.kind].shape(rule[0]).T
    modes, volumes = volume_modes(mesh, cells, rule)
    kept = np.einsum("kmq,kq->km", modes, volumes * here)
    force = np.einsum("km,kma->ka", kept, volume_rows(mesh, cells, rule))
    np.add.at(load, cells.nodes, force.reshape(*cells.nodes.shape, mesh.dim))
