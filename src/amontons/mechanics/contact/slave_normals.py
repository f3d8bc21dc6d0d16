"""Normals at the nodes of a slave whose facets face the other side, of small strains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.facets import Facets
from ..meshes.surfaces import nodal_normals, outward
from .cuts import SIDES
from .segments import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
AROUND = 0.7  # cosine between normals below which a facet lies around an edge


def slave_normals(slave: Surface, facets: Index) -> Array:
    """Normals at the nodes, (n, dim), averages without facets around an edge from `facets`.

    Those that face the other side (f,) count, and all that turn from them by less than AROUND.
    """
    facing = np.zeros(len(slave.nodes), dtype=bool)
    facing[facets] = True
    first = np.zeros(slave.points.shape)
    share = (slave.area / slave.corners)[facets, None, None] * slave.normal[facets, None]
    np.add.at(first, slave.nodes[facets], share * slave.real[facets, :, None])
    length = np.linalg.norm(first, axis=1)
    along = np.einsum("fac,fc->fa", first[slave.nodes], slave.normal)
    around = ((along < AROUND * length[slave.nodes]) & slave.real).any(axis=1) & ~facing
    if slave.curved:
        return _of_shapes(slave, _curved_normals(slave, ~around), around)
    blocks = np.split(around, np.cumsum([len(b.nodes) for b in slave.blocks])[:-1])
    kept = [Facets(b.kind, b.nodes[~out]) for b, out in zip(slave.blocks, blocks, strict=True)]
    return _of_shapes(slave, nodal_normals(slave.points, tuple(kept)), around)


def _of_shapes(slave: Surface, normals: Array, turned: Mask) -> Array:
    """Normals (n, dim); those of a sphere, cone or cylinder where nothing else is around."""
    of = slave.shapes.of
    for number, shape in enumerate(slave.shapes.every):
        on = np.unique(slave.nodes[(of == number) & ~turned])
        mine = on[~np.isin(on, slave.nodes[(of != number) & ~turned])]
        normals[mine] = shape.distance(slave.points[mine])[1]
    return normals


def _curved_normals(slave: Surface, counts: Mask) -> Array:
    """Unit normals at corners, (n, dim), means of those of the curved facets that count (f,).

    At the corners themselves: averages with shape functions of second order are none.
    """
    total = np.zeros(slave.points.shape)
    for number in np.unique(slave.kind):
        cell = CELLS[SIDES[number]]
        nodes = slave.all[(slave.kind == number) & counts, : cell.nodes]
        for k, at in enumerate(cell.corners[: cell.corner_count]):
            np.add.at(total, nodes[:, k], outward(cell.jacobians(slave.points[nodes], at)))
    length = np.linalg.norm(total, axis=1)
    return total / np.where(length > 0, length, 1.0)[:, None]
