"""Tangents that a surface carries along: axes of friction, and of springs along the surface.

With a_p1, a_p2 tangents of the undeformed surface at its node p, N_b the shape functions of the
facets f around p, A_f their areas, grad the gradient along the surface, all undeformed, and
d_pk vectors in the tangent plane,

    E_pk = sum_b c_pkb x_b,    c_pkb = sum_f A_f d_pk . grad N_b(p),    sum_b c_pkb = 0     (1)

are what the surface has made of them where its nodes are at x; d_pk are such that E_pk = a_pk,
but for a part along the normal, where x = X.  On n, the normal of contact where the bodies are,

    t1 = D / |D|,    D = (I - n n^T) E_1 - n x E_2,    t2 = n x t1                          (2)

is the frame [n, t1, t2] of the contact: a_p1 and a_p2 turned by the rotation R of the polar
decomposition F = R U of the surface's motion in its plane, as R is along F + cof F there.
Which tangents were taken is no matter: others would be turned alike.  x -> Q x + b turns the
frame by Q: what is told in it, two coefficients of friction or how far a spring is drawn, does
not depend on who looks.  A motion of x turns it by the spin w, delta t = w x t,

    w = n x dn + n (t2 . dE_1 - t1 . dE_2 - ((n . E_1) t2 + E_2 x t2) . dn) / |D|.          (3)

In 2D n alone is the frame: w = -t . dn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.cells import CELLS
from ..meshes.facets import Facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_areas, outward
from .geometry import frames

Array = NDArray[np.float64]
Index = NDArray[np.int64]
UPRIGHT = 1e-6  # part of E in the tangent plane below which they tell no direction there


@dataclass(frozen=True, eq=False)
class SurfaceAxes:
    """Frames (k, 3, 3) of nodes of an undeformed surface, n into the body, and c of t1, t2.

    rows: c (2 k, points of the mesh), two for every node.
    """

    frames: Array
    rows: sparse.csr_array

    @classmethod
    def of(cls, mesh: Mesh, surface: str, nodes: Index) -> SurfaceAxes:
        """Those of some nodes (k,) of a surface in 3D, whose facets do not cancel there."""
        row = np.full(len(mesh.points), -1)
        row[nodes] = np.arange(len(nodes))
        around = [part for facets in mesh.surface(surface)
                  for part in _slots(mesh.points, facets, row)]  # fmt: skip
        normals = np.zeros((len(nodes), 3))
        seen = np.zeros((len(nodes), 3, 3))  # sum of A_f (I - n_f n_f^T)
        for part in around:
            np.add.at(normals, part.row, part.area[:, None] * part.normal)
            flat = np.eye(3) - part.normal[:, :, None] * part.normal[:, None, :]
            np.add.at(seen, part.row, part.area[:, None, None] * flat)
        axes = frames(-normals / np.linalg.norm(normals, axis=1)[:, None])
        plane = axes[:, 1:]
        inner = plane @ seen @ plane.swapaxes(1, 2)
        d = np.linalg.inv(inner) @ plane
        rows = sparse.csr_array((2 * len(nodes), len(mesh.points)))
        for part in around:
            values = part.area[:, None, None] * d[part.row] @ part.slopes.swapaxes(1, 2)
            to = 2 * part.row[:, None, None] + np.arange(2)[:, None]
            row, column = np.broadcast_arrays(to, part.nodes[:, None])
            entries = values.ravel(), (row.ravel(), column.ravel())
            rows = rows + sparse.coo_array(entries, shape=rows.shape).tocsr()
        return cls(axes, sparse.csr_array(rows))


@dataclass(frozen=True, eq=False)
class _Slot:
    """k facets at one of their nodes: its row, area, normal, nodes (k, b), grad N (k, b, 3)."""

    row: Index
    area: Array
    normal: Array
    nodes: Index
    slopes: Array


def _slots(points: Array, facets: Facets, row: Index) -> list[_Slot]:
    """Facets of one kind at each of their nodes that has a row."""
    cell, area, out = CELLS[facets.kind], facet_areas(points, facets), []
    for slot, at in enumerate(cell.corners):
        own = row[facets.nodes[:, slot]]
        kept = own >= 0
        nodes = facets.nodes[kept]
        jacobians = cell.jacobians(points[nodes], at)
        normal = outward(jacobians)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        slopes = cell.gradient(at) @ np.linalg.pinv(jacobians)
        out.append(_Slot(own[kept], area[kept], normal, nodes, slopes))
    return out


def carried_frames(normals: Array, along: Array) -> Array:
    """Frames (2), (nc, 3, 3), of normals (nc, 3) and E (nc, 2, 3); `frames` where E is none."""
    out = frames(normals)
    t, length = _in_plane(normals, along)
    told = length > 0
    out[told, 1] = t[told] / length[told, None]
    out[told, 2] = np.cross(normals[told], out[told, 1])
    return out


def twist(normals: Array, along: Array, axes: Array) -> tuple[Array, Array]:
    """n . w of (3) per change of n, (nc, 3), and of E, (nc, 2, 3); axes: the frames."""
    length = _in_plane(normals, along)[1]
    scale = np.where(length > 0, 1 / np.where(length > 0, length, 1.0), 0.0)
    tilted = (normals * along[:, 0]).sum(axis=1)[:, None] * axes[:, 2]
    by_normal = -(tilted + np.cross(along[:, 1], axes[:, 2])) * scale[:, None]
    return by_normal, np.stack([axes[:, 2], -axes[:, 1]], axis=1) * scale[:, None, None]


def _in_plane(normals: Array, along: Array) -> tuple[Array, Array]:
    """D of (2), (nc, 3), and its length (nc,), zero where that tells no direction."""
    one, two = along.swapaxes(0, 1)
    D = one - normals * (normals * one).sum(axis=1)[:, None] - np.cross(normals, two)
    length = np.linalg.norm(D, axis=1)
    return D, np.where(length > UPRIGHT * np.linalg.norm(along, axis=(1, 2)), length, 0.0)


def still_drawn(drawn: Array, axes: Array, free: NDArray[np.bool_]) -> Array:
    """How far springs are drawn along t1(, t2), (nc, d-1), without what supports hold.

    axes (nc, d, d): the frames; free (nc, d): components without a support.
    """
    if free.all():
        return drawn
    across = axes[:, 1:]
    left = np.einsum("pk,pkc->pc", drawn, across) * free
    return np.einsum("pkc,pc->pk", across, left)
