"""A doubt about where bodies are put: sides of a contact that overlap by a part of a facet.

A press fit overlaps by far less than its facets are wide, or says by how much (`clearance`).
What overlaps by more was mostly put into the wrong place, or given in other units; static or in
time, contact pushes it out, which strains bodies or throws them.  Of sides that touch along a
curved surface the chords of facets overlap, by h / 8 R of a facet as long as h on a radius R:
facets count by their longest extent there, the larger one of both sides.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ..meshes.facets import corner_facets
from ..meshes.mesh import Mesh
from .fields import ContactFields
from .matching import pairs_of
from .supports import locate

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
DEEP = 0.1  # of the facets there


def overlap_at_start(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Pairs of surfaces that overlap as they are given by more than DEEP of a facet."""
    out = []
    for contact, placed, numbers in pairs_of(model):
        depth = -placed.rows.gap
        over = np.flatnonzero(depth > 0)
        if contact.master is None or contact.clearance is not None or not len(over):
            continue
        sites = model.discretisation.sites.points[numbers]
        located = [locate(model.bodies, s) for s in (contact.slave, *contact.masters)]
        sides = [(model.bodies[k].mesh, name) for k, name in located]
        wide = np.maximum(
            *(_extents(some, sites[over]) for some in (sides[:1], sides[1:]))
        )
        deep = over[depth[over] > DEEP * wide]
        if not len(deep):
            continue
        worst = deep[depth[deep].argmax()]
        text = (
            f"contact on {contact.slave!r} with {', '.join(map(repr, contact.masters))}: the "
            f"bodies overlap at the start by {depth[worst]:.3g} at "
            f"({', '.join(f'{x:.4g}' for x in sites[worst])}), which contact pushes out at "
            "once; give positions without overlap, or say that it is meant, as in a press fit, "
            "by clearance="
        )
        out.append(ResultWarning("overlap-at-start", text, tuple(numbers[deep].tolist())))
    return out


def _extents(surfaces: Iterable[tuple[Mesh, str]], points: Array) -> Array:
    """Longest extent of the facets around the node of the surfaces nearest to points (k,)."""
    from scipy.spatial import cKDTree

    nodes, extents = [], []
    for mesh, name in surfaces:
        extent = np.zeros(len(mesh.points))
        for block in mesh.surface(name):
            corners = corner_facets(block).nodes
            x = mesh.points[corners]
            length = np.linalg.norm(x[:, :, None] - x[:, None], axis=3).max(axis=(1, 2))
            np.maximum.at(extent, corners, length[:, None])
        used = np.flatnonzero(extent)
        nodes.append(mesh.points[used])
        extents.append(extent[used])
    nearest = cKDTree(np.concatenate(nodes)).query(points)[1]
    return np.concatenate(extents)[nearest]
