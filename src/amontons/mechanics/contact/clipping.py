"""Intersections of convex polygons and quadrature on them, many pairs at once.

Sutherland-Hodgman: the subject is cut by one side of the window after the other.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..meshes.gauss import roots_jacobi, roots_legendre

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ON_SIDE = 1e-13  # corners nearer to a side, relative to the window's size, lie on it


def clip(subject: Array, window: Array) -> tuple[Array, Index]:
    """Intersections of k pairs of convex polygons: corners (k, n + m, 2), and how many (k,).

    subject (k, n, 2), window (k, m, 2), both counter-clockwise, as the result is.
    """
    k, n, _ = subject.shape
    m = window.shape[1]
    corners = np.concatenate([subject, np.zeros((k, m, 2))], axis=1)
    count = np.full(k, n)
    size = np.ptp(window, axis=1).max(axis=1, initial=0.0)
    for side in range(m):
        start, end = window[:, side], window[:, (side + 1) % m]
        corners, count = _cut(corners, count, start, end, ON_SIDE * size)
    return corners, count


def _cut(
    corners: Array, count: Index, start: Array, end: Array, snap: Array
) -> tuple[Array, Index]:
    """What lies to the left of the lines start -> end, (k, 2) each."""
    k, room, _ = corners.shape
    slot = np.arange(room)
    valid = slot < count[:, None]
    along = end - start
    length = np.linalg.norm(along, axis=1)
    off = corners - start[:, None]
    height = along[:, None, 0] * off[:, :, 1] - along[:, None, 1] * off[:, :, 0]
    height /= np.where(length > 0, length, 1.0)[:, None]
    height[np.abs(height) <= snap[:, None]] = 0.0
    after = np.where(slot + 1 < count[:, None], slot + 1, 0)
    height_after = np.take_along_axis(height, after, axis=1)
    crosses = valid & (height * height_after < 0)
    share = height / np.where(crosses, height - height_after, 1.0)
    following = np.take_along_axis(corners, after[:, :, None], axis=1)
    met = corners + share[:, :, None] * (following - corners)
    both = np.stack([corners, met], axis=2).reshape(k, 2 * room, 2)
    keep = np.stack([valid & (height >= 0), crosses], axis=2).reshape(k, 2 * room)
    order = np.argsort(~keep, axis=1, kind="stable")[:, :room]
    return np.take_along_axis(both, order[:, :, None], axis=1), keep.sum(axis=1)


def quadrature(corners: Array, count: Index, points: int) -> tuple[Index, Array, Array]:
    """Polygon (t,), points (t, q, 2) and weights (t, q) of t triangles that fill the polygons.

    points^2 = q per triangle, exact for polynomials of degree 2 points - 1.
    """
    room = corners.shape[1]
    at, weight = triangle_rule(points)
    second, third = corners[:, 1 : room - 1], corners[:, 2:]
    edges = np.stack([second - corners[:, :1], third - corners[:, :1]], axis=3)
    double = edges[..., 0, 0] * edges[..., 1, 1] - edges[..., 1, 0] * edges[..., 0, 1]
    polygon, fan = np.nonzero((np.arange(room - 2) < count[:, None] - 2) & (double > 0))
    where = np.einsum("tcj,qj->tqc", edges[polygon, fan], at) + corners[polygon, None, 0]
    return polygon, where, double[polygon, fan, None] * weight


@cache
def triangle_rule(points: int) -> tuple[Array, Array]:
    """Points (q, 2) and weights (q,) on the unit triangle: Gauss rules folded to its corner."""
    along, first = roots_legendre(points)
    across, second = roots_jacobi(points, 1)
    s, t = np.meshgrid((1 + along) / 2, (1 + across) / 2, indexing="ij")
    at = np.stack([s * (1 - t), t], axis=-1).reshape(-1, 2)
    return at, (first[:, None] * second).ravel() / 8


@cache
def line_rule(points: int) -> tuple[Array, Array]:
    """Gauss points (q, 1) and weights (q,) on [0, 1]."""
    at, weight = roots_legendre(points)
    return (1 + at[:, None]) / 2, weight / 2


@cache
def square_rule(points: int) -> tuple[Array, Array]:
    """Gauss points (q, 2) and weights (q,) on [0, 1]^2."""
    at, weight = line_rule(points)
    s, t = np.meshgrid(at[:, 0], at[:, 0], indexing="ij")
    return np.stack([s, t], axis=-1).reshape(-1, 2), np.outer(weight, weight).ravel()
