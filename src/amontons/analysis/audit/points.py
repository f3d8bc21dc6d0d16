"""Gaps at points: every node of both sides against the facet of the other side before it.

The gap between two faceted surfaces is smallest at a node of one of them.  Programs that hold
contact at points, not on average, are fair only to such gaps: where facets do not match they
press at the few places where these touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...mechanics.contact.pairs import KINDS, project
from ...mechanics.meshes.facets import Facets
from ...mechanics.meshes.surfaces import nodal_normals
from ...mechanics.model.supports import locate

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...mechanics.model.parts import Contact

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SMALLER = {  # facets of first order on the nodes of those of second order
    "line3": (("line", ((0, 2), (2, 1))),),
    "tri6": (("tri", ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))),),
    "quad8": (
        ("tri", ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7))), ("quad", ((4, 5, 6, 7),)),
    ),
    "quad9": (("quad", ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))),),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PointGaps:
    """Gaps (n,) around every node of the model, inf where no node of a contact is near.

    now: the smallest of the node, its neighbours on the surface, and the nodes of the other
    side that lie before it; start: of the node itself at zero displacement.
    """

    start: Array
    now: Array


def point_gaps(model: Model, contact: Contact, u: Array) -> PointGaps | None:
    """Gaps of a pair at displacements u (dofs,); None with an obstacle."""
    if contact.master is None:
        return None
    d = model.dimension
    parts = [_side(model, name) for name in (contact.slave, contact.master)]
    points = np.concatenate([body.mesh.points for body in model.bodies])
    moved = u.reshape(-1, d)
    start, now = np.full((2, len(points)), np.inf)
    for (nodes, own, normals), (_, other, _) in (parts, parts[::-1]):
        hit = project(points[nodes], points, other, facing=normals, own=nodes)
        found = hit.found
        of, n = nodes[found], hit.normal[found]
        apart = points[of] - hit.closest[found]
        slip = moved[of] - np.einsum("ka,kac->kc", hit.shape[found], moved[hit.nodes[found]])
        first = np.einsum("kc,kc->k", apart, n)
        second = first + np.einsum("kc,kc->k", slip, n)
        np.minimum.at(start, of, first)
        np.minimum.at(now, of, second)
        for slot in range(hit.nodes.shape[1]):
            on = hit.shape[found][:, slot] > 0
            np.minimum.at(now, hit.nodes[found][on, slot], second[on])
        _spread(now, own)
    return PointGaps(start, now)


def _spread(values: Array, facets: tuple[Facets, ...]) -> None:
    """Give every node the least of the facets around it."""
    least = [values[block.nodes].min(axis=1) for block in facets]
    for block, low in zip(facets, least, strict=True):
        for column in block.nodes.T:
            np.minimum.at(values, column, low)


def _side(model: Model, name: str) -> tuple[Index, tuple[Facets, ...], Array]:
    """Nodes of a surface in the whole model, its facets of first order, outward normals."""
    k, surface = locate(model.bodies, name)
    mesh = model.bodies[k].mesh
    first = int(model.discretisation.offsets[k]) // model.dimension
    given = [f for block in mesh.surface(surface) for f in _smaller(block)]
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in given]))
    normals = nodal_normals(mesh.points, tuple(given))[nodes]
    facets = tuple(Facets(block.kind, first + block.nodes) for block in given)
    return first + nodes, facets, normals


def _smaller(block: Facets) -> list[Facets]:
    """Facets of first order on all nodes of these."""
    if block.kind in KINDS:
        return [block]
    return [
        Facets(kind, np.concatenate([block.nodes[:, list(part)] for part in places]))
        for kind, places in SMALLER[block.kind]
    ]
