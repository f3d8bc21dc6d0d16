"""Distances between the curved surfaces for which facets stand, along normals of the slave's.

A point of a slave facet and the one of a master facet in front of it, along the normal n_f of
the slave's, are raised to their surfaces: by the nodes between the corners, by heights
(`curvature`), and to the sphere, cone or cylinder on which the nodes lie (`primitives`).  From
the raised slave's point the distance goes along n_f to the master's surface, not to its raised
point, which lies aside by its height times the angle between the facets: where bodies overlap
by less than facets cut off, that alone would be a wrong pressure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.surfaces import outward
from .curvature import heights
from .cuts import SIDES, Cuts, functions
from .pairs import KINDS

if TYPE_CHECKING:
    from .segments import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEEPEST = 0.05  # cosine between normals of the two sides below which facets are taken as flat


def raised(side: Surface, facet: Index, at: Array) -> tuple[Array, Array]:
    """Points (t, q, dim) on the surface behind facets (t,) of one kind, and unit normals there.

    at (t, q, dim - 1): reference coordinates.
    """
    t, q, e = at.shape
    cell = CELLS[SIDES[int(side.kind[facet].max(initial=0))]]
    flat = KINDS[cell.corner_count - 2]
    phi, away = functions(flat, at), side.normal[facet][:, None]
    if side.curved:
        rows = side.points[side.all[np.repeat(facet, q), : cell.nodes]]
        normal = outward(cell.jacobians(rows, at.reshape(-1, e))).reshape(t, q, e + 1)
        normal = normal / np.linalg.norm(normal, axis=2, keepdims=True)
        x = functions(cell.kind, at) @ side.points[side.all[facet, : cell.nodes]]
    else:
        corners = side.points[side.nodes[facet, : cell.corner_count]]
        slope = side.slopes[facet, : cell.corner_count]
        x = phi @ corners + heights(phi, slope, corners)[:, :, None] * away
        normal = away - phi @ slope
        normal = normal / np.linalg.norm(normal, axis=2, keepdims=True)
    for number, shape in enumerate(side.shapes.every):
        mine = np.flatnonzero(side.shapes.of[facet] == number)
        if not len(mine):
            continue
        direction = normal[mine] if side.curved else np.broadcast_to(away[mine], x[mine].shape)
        off = side.shapes.off[side.nodes[facet[mine], : cell.corner_count]]
        far = shape.along(x[mine], direction, np.einsum("tqa,ta->tq", phi[mine], off))
        x[mine] += far[:, :, None] * direction
        normal[mine] = shape.distance(x[mine])[1]
    return x, normal


def distances(slave: Surface, master: Surface, of: Index, facet: Index, parts: Cuts) -> Array:
    """Distances (t, q) at the points of cuts of pairs (of, facet), < 0 where bodies overlap."""
    one, other = of[parts.pair], facet[parts.pair]
    x, _ = raised(slave, one, parts.at)
    y, normal = raised(master, other, parts.opposite)
    return along(slave.normal[one][:, None], x, y, normal, master, other)


def distances_at(
    slave: Surface, master: Surface, first: tuple[Index, Array], second: tuple[Index, Array]
) -> Array:
    """The same (q,) at points: facets (q,) and reference coordinates (q, dim - 1) on both."""
    (one, at), (other, opposite) = first, second
    out = np.zeros(len(one))
    for kind in np.unique(slave.kind[one]):
        for facing in np.unique(master.kind[other]):
            mine = np.flatnonzero((slave.kind[one] == kind) & (master.kind[other] == facing))
            x, _ = raised(slave, one[mine], at[mine, None])
            y, normal = raised(master, other[mine], opposite[mine, None])
            direction = slave.normal[one[mine]][:, None]
            out[mine] = along(direction, x, y, normal, master, other[mine])[:, 0]
    return out


def along(
    direction: Array, x: Array, y: Array, normal: Array, master: Surface, facet: Index
) -> Array:
    """Distances (t, q) from points x along unit directions to the master's surface.

    y, normal (t, q, dim): points of facets (t,) of the master about there, and normals.
    """
    flat = np.broadcast_to(master.normal[facet][:, None], normal.shape)
    facing = np.einsum("tqc,tqc->tq", normal, np.broadcast_to(direction, normal.shape))
    normal = np.where((facing < -STEEPEST)[:, :, None], normal, flat)
    facing = np.einsum("tqc,tqc->tq", normal, np.broadcast_to(direction, normal.shape))
    far = np.einsum("tqc,tqc->tq", y - x, normal) / np.where(facing < 0, facing, -1.0)
    for number, shape in enumerate(master.shapes.every):
        mine = np.flatnonzero(master.shapes.of[facet] == number)
        if len(mine):
            ahead = np.broadcast_to(direction, normal.shape)[mine]
            near = x[mine] + far[mine][:, :, None] * ahead
            far[mine] += shape.along(near, ahead, shape.distance(y[mine])[0])
    return far
