"""How two surfaces lie: points inside a mesh, shared facets, surfaces that do not meet.

Inside is where the winding number of the boundary is not zero.

The solid angle of a triangle is that of [OS]; in 2D the angle of an edge.

[OS] A. van Oosterom, J. Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed.
Engrg. 30 (1983) 125-126.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..meshes.facets import corner_facets
from ..meshes.mesh import Mesh

Array = NDArray[np.float64]


def inside(mesh: Mesh, points: Array) -> NDArray[np.bool_]:
    """Which points (k, dim) lie inside a mesh, (k,); k times its facets."""
    low, high = mesh.bounding_box()
    out = np.all((points > low) & (points < high), axis=1)
    for k in np.flatnonzero(out):
        out[k] = winding_number(mesh, points[k]) > 0.5
    return out


def is_itself(slave: Mesh, surface: str, master: Mesh, master_surface: str) -> bool:
    """Whether two surfaces are one."""
    if slave is not master:
        return False
    one, other = (_facets(slave, name) for name in (surface, master_surface))
    return one == other


def _facets(mesh: Mesh, name: str) -> set[tuple[int, ...]]:
    return {tuple(sorted(f)) for block in mesh.surface(name) for f in block.nodes.tolist()}


def check_different(slave: Mesh, surface: str, master: Mesh, master_surface: str) -> None:
    """Raise InvalidInput when two surfaces share facets."""
    if slave is not master:
        return
    one, other = (_facets(slave, name) for name in (surface, master_surface))
    if both := len(one & other):
        raise InvalidInput(
            f"{both} facets are on both sides; name the two sides as separate surfaces, or let "
            "find_contacts(..., itself=True) find them where they lie opposite; a surface that "
            "is its own master is so as a whole, and with kinematics='finite'", ("master",),
            f"contact of {surface!r} with {master_surface!r}",
        )  # fmt: skip


def not_facing(
    slave: Mesh, surface: str, master: Mesh, master_surface: str
) -> InvalidInput:
    """What to tell the user when nothing of one surface lies in front of the other."""
    where = [
        f"{name!r} reaches from {_shown(x.min(axis=0))} to {_shown(x.max(axis=0))}"
        for mesh, name in ((slave, surface), (master, master_surface))
        for x in (mesh.points[mesh.surface_nodes(name)],)
    ]
    return InvalidInput(
        "no part of the slave has a master facet in front of it, along its outward normal; "
        f"{', '.join(where)}: check the positions, the units and which sides are named, or "
        "leave this contact out", ("master",),
        f"contact of {surface!r} with {master_surface!r}",
    )  # fmt: skip


def _shown(point: Array) -> str:
    return "(" + ", ".join(f"{c:.4g}" for c in point) + ")"


def winding_number(mesh: Mesh, point: Array) -> float:
    """How many times the boundary of a mesh winds around a point (dim,).

    1 inside a body, 0 outside; the sum where pieces of the mesh overlap.
    """
    total = 0.0
    for block in mesh.boundary:
        x = mesh.points[corner_facets(block).nodes] - point
        for second in range(1, max(x.shape[1] - 1, 2)):
            some = [0, second, second + 1] if mesh.dim == 3 else [0, 1]
            total += winding_of(x[:, some])
    return total


def winding_of(x: Array) -> float:
    """How many times lines (k, 2, 2) or triangles (k, 3, 3) wind around the origin."""
    return _angles(x) / (2 * np.pi) if x.shape[2] == 2 else _solid_angles(x) / (4 * np.pi)


def _angles(x: Array) -> float:
    """Angles of edges (k, 2, 2) seen from the origin, summed; > 0 around it."""
    a, b = x[:, 0], x[:, 1]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return float(np.arctan2(cross, np.einsum("kc,kc->k", a, b)).sum())


def _solid_angles(x: Array) -> float:
    """Solid angles of triangles (k, 3, 3) seen from the origin, summed; > 0 around it."""
    a, b, c = x[:, 0], x[:, 1], x[:, 2]
    na, nb, nc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    ab, bc, ca = (np.einsum("kc,kc->k", *pair) for pair in ((a, b), (b, c), (c, a)))
    volume = np.einsum("kc,kc->k", a, np.cross(b, c))
    return float(2 * np.arctan2(volume, na * nb * nc + ab * nc + bc * na + ca * nb).sum())
