"""Contacts of two bodies that slide far, as they are in the undeformed state.

Every slave node that can carry a force has one, also where it does not face the master yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..meshes.facets import corner_facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import nodal_weights
from .current_mortar import MortarPair, folded
from .facing import Skin
from .geometry import frames
from .mortar import coupled_columns
from .nodal import ContactRows, check_exterior
from .overlap import check_different, is_itself, not_facing

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FREE = 1e-9  # free part of a normal up to which supports hold it


def current_contact(
    slave: Mesh, surface: str, masters: Sequence[tuple[Mesh, str]], held: Mask, *,
    tied: bool = False,
) -> tuple[ContactRows, list[sparse.csc_array], Mask]:  # fmt: skip
    """Rows, their part on each of the masters, and found, as `mortar_contact` has them.

    held (n, dim): components of the slave that supports prescribe; nodes that can not move
    along their normal have no row.  tied: nodes that face nothing have none, either.
    """
    check_exterior(slave, surface)
    itself = len(masters) == 1 and is_itself(slave, surface, *masters[0])
    for mesh, name in masters:
        check_exterior(mesh, name, "master")
        if not itself:
            check_different(slave, surface, mesh, name)
    corners = tuple(corner_facets(block) for block in slave.surface(surface))
    weights = nodal_weights(slave.points, corners)
    nodes = np.flatnonzero(weights > 0)
    weights = weights[nodes]
    meshes = list(dict.fromkeys([slave, *(mesh for mesh, _ in masters)]))
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    points = np.concatenate([mesh.points for mesh in meshes])
    over = Skin.of(slave.surface(surface), 0)
    under = Skin.joined([
        Skin.of(mesh.surface(name), int(starts[meshes.index(mesh)])) for mesh, name in masters
    ])  # fmt: skip
    free = ~held[nodes]
    whole = MortarPair(nodes, over, under, np.ones_like(free)).at(points).normals
    found = np.linalg.norm(whole * free, axis=1) > FREE
    if tied and itself:
        raise InvalidInput(
            "a tie is between two surfaces; name its sides as separate surfaces", ("master",),
            f"contact of {surface!r} with itself",
        )
    if tied:
        meeting = MortarPair(nodes[found], over, under, free[found]).at(points)
        weights[found] = meeting.weights
        found[found] = meeting.met
        if not found.any():
            raise not_facing(slave, surface, *masters[0])
    chosen = nodes[found]
    if itself:
        meeting = folded(chosen, over, free[found], points).at(points)
    else:
        meeting = MortarPair(chosen, over, under, free[found]).at(points)
    axes = frames(meeting.normals)
    columns = coupled_columns(
        meeting.references, axes, np.zeros(axes.shape[:2], dtype=bool)
    ).tocsr()
    parts = [sparse.csc_array(columns[slice(*ends)]) for ends in pairwise(starts * slave.dim)]
    rows = ContactRows(
        chosen, slave.points[chosen], weights[found], meeting.gap, axes, parts[0]
    )
    on_masters, told = [], {0}
    for mesh, _ in masters:
        k = meshes.index(mesh)
        nothing = sparse.csc_array((mesh.points.size, columns.shape[1]))
        on_masters.append(nothing if k in told else parts[k])
        told.add(k)
    return rows, on_masters, found
