"""Points inside a mesh: the winding number of its boundary around them.

The solid angle of a triangle is that of [OS]; in 2D the angle of an edge.

[OS] A. van Oosterom, J. Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed.
Engrg. 30 (1983) 125-126.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fem.mesh import Mesh

Array = NDArray[np.float64]


def winding_number(mesh: Mesh, point: Array) -> float:
    """How many times the boundary of a mesh of first order winds around a point (dim,).

    1 inside a body, 0 outside; the sum where pieces of the mesh overlap.
    """
    total = 0.0
    for block in mesh.boundary:
        x = mesh.points[block.nodes] - point
        if mesh.dim == 2:
            total += _angles(x) / (2 * np.pi)
        else:
            for second in range(1, x.shape[1] - 1):
                total += _solid_angles(x[:, [0, second, second + 1]]) / (4 * np.pi)
    return total


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
