"""How far two convex polyhedra are apart along normals of faces and of pairs of edges.

Edges that are parallel share their common normals with those of the other body, so that only
directions are paired; along each, the outermost edge of a direction counts.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ...core.copies import copy_inplace

PARALLEL = 1e-6  # sine below which two edges have no common normal


@njit(cache=True, error_model="numpy")
def dot(a, b):
    """Of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def cross(a, b):
    """a x b, three numbers; written out, as numpy's takes seconds to compile."""
    return (
        a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def face_apart(first_face, n, o, i, first_vertex, v, j):  # noqa: PLR0913
    """(distance, face) of the face of i from which j is farthest."""
    best, face = -np.inf, -1
    for f in range(first_face[i], first_face[i + 1]):
        lowest = np.inf
        for k in range(first_vertex[j], first_vertex[j + 1]):
            lowest = min(lowest, dot(n[f], v[k]))
        if lowest - o[f] > best:
            best, face = lowest - o[f], f
    return best, face


@njit(cache=True, error_model="numpy")
def boxes_apart(first, second, margin):
    """True where boxes (2, 3), lower and upper corner, are apart by more than a margin."""
    for k in range(3):
        if first[0, k] > second[1, k] + margin or second[0, k] > first[1, k] + margin:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _outermost(m, edges, begin, end, v, sign):
    """(sign m . v, edge) of the parallel edges begin .. end that lies farthest that way."""
    best, edge = -np.inf, -1
    for a in range(begin, end):
        height = sign * dot(m, v[edges[a, 0]])
        if height > best:
            best, edge = height, a
    return best, edge


@njit(cache=True, error_model="numpy")
def _beyond(m, first, last, v, sign, height):
    """True where a vertex lies higher than that."""
    for k in range(first, last):
        if sign * dot(m, v[k]) > height:
            return True
    return False


@njit(cache=True, error_model="numpy")
def edges_apart(i, j, first_vertex, v, edges, first_line, lines, x):  # noqa: PLR0913
    """(distance, edge of i, edge of j, normal from i to j) of the two farthest apart."""
    best, one, two, normal = -np.inf, -1, -1, np.zeros(3)
    between = x[j] - x[i]
    size = 1e-9 * np.sqrt(dot(between, between))
    m = np.empty(3)
    for c in range(first_line[i], first_line[i + 1]):
        a = lines[c]
        p0, p1 = v[edges[a, 0]], v[edges[a, 1]]
        px, py, pz = p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]
        for d in range(first_line[j], first_line[j + 1]):
            b = lines[d]
            q0, q1 = v[edges[b, 0]], v[edges[b, 1]]
            qx, qy, qz = q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]
            m[0], m[1], m[2] = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
            length = np.sqrt(dot(m, m))
            square = (px * px + py * py + pz * pz) * (qx * qx + qy * qy + qz * qz)
            if length < PARALLEL * np.sqrt(square):
                continue
            if dot(m, between) < 0:
                length = -length
            for k in range(3):
                m[k] /= length
            # the two must be the outermost of their bodies along m
            top, a = _outermost(m, edges, lines[c], lines[c + 1], v, 1.0)
            bottom, b = _outermost(m, edges, lines[d], lines[d + 1], v, -1.0)
            if -bottom - top <= best:
                continue
            if _beyond(m, first_vertex[i], first_vertex[i + 1], v, 1.0, top + size):
                continue
            if not _beyond(m, first_vertex[j], first_vertex[j + 1], v, -1.0, bottom + size):
                best, one, two = -bottom - top, a, b
                copy_inplace(m, normal)
    return best, one, two, normal
