"""Contacts of two bodies that slide far, as they are in the undeformed state.

Every slave node that can carry a force has one, also where it does not face the master yet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.facets import corner_facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import nodal_weights
from .current_mortar import MortarPair, folded
from .facing import Skin
from .geometry import frames
from .mortar import coupled_columns
from .nodal import ContactRows, check_exterior
from .overlap import check_different, is_itself

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FREE = 1e-9  # free part of a normal up to which supports hold it


def current_contact(
    slave: Mesh, surface: str, master: Mesh, master_surface: str, held: Mask
) -> tuple[ContactRows, sparse.csc_array, Mask]:
    """Rows, their part on the master, and found, as `mortar_contact` has them.

    held (n, dim): components of the slave that supports prescribe; nodes that can not move
    along their normal have no row.
    """
    check_exterior(slave, surface)
    check_exterior(master, master_surface, "master")
    itself = is_itself(slave, surface, master, master_surface)
    if not itself:
        check_different(slave, surface, master, master_surface)
    corners = tuple(corner_facets(block) for block in slave.surface(surface))
    weights = nodal_weights(slave.points, corners)
    nodes = np.flatnonzero(weights > 0)
    weights = weights[nodes]
    joined = slave is master
    points = slave.points if joined else np.concatenate([slave.points, master.points])
    over = Skin.of(slave.surface(surface), 0)
    under = Skin.of(master.surface(master_surface), 0 if joined else len(slave.points))
    free = ~held[nodes]
    whole = MortarPair(nodes, over, under, np.ones_like(free)).at(points).normals
    found = np.linalg.norm(whole * free, axis=1) > FREE
    chosen = nodes[found]
    if itself:
        meeting = folded(chosen, over, free[found], points).at(points)
    else:
        meeting = MortarPair(chosen, over, under, free[found]).at(points)
    axes = frames(meeting.normals)
    columns = coupled_columns(
        meeting.references, axes, np.zeros(axes.shape[:2], dtype=bool)
    ).tocsr()
    size = slave.points.size
    rows = ContactRows(
        chosen, slave.points[chosen], weights[found], meeting.gap, axes,
        sparse.csc_array(columns[:size]),
    )  # fmt: skip
    on_master = sparse.csc_array((master.points.size, axes.shape[0] * axes.shape[1]))
    if not joined:
        on_master = sparse.csc_array(columns[size:])
    return rows, on_master, found
