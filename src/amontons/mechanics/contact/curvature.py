"""How far a curved surface lies in front of its facets, from the normals at their nodes.

A facet cuts off the curved surface that it stands for; where facets of two meshes do not match,
that alone would press them into each other.  With the slopes of the surface over the facet at
its nodes, s_a, and linear or bilinear shape functions,

    height(x) = 1/2 sum_a phi_a(x) s_a . (x - x_a)

exactly for every surface of second order.  On those, slopes and heights z match on every side,
z_b - z_a = (s_a + s_b) . (x_b - x_a) / 2; facets beside an edge do not, and are taken as flat.
Only gaps see heights: weights and forces stay those of the facets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..meshes.facets import Facets
from ..meshes.surfaces import nodal_normals

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
STEEP = np.tan(np.radians(20))  # slope at a node above which facets meet at an edge
UNEVEN = (
    0.6  # mismatch along a side, relative to the slope, that shows an edge beside the facet
)
STRAIGHT = -0.7  # cosine between two sides on the rim above which they meet in a corner
DETERMINED = 1e-2  # sides at a smaller angle (squared) do not tell the normal across them


def slopes(
    points: Array, blocks: tuple[Facets, ...], nodes: Index, real: Mask, normal: Array
) -> Array:
    """Slopes of the curved surface over its facets at their nodes, (f, a, dim); 0 if flat.

    nodes, real (f, a), normal (f, dim), unit: the facets of all blocks in one table.
    """
    at_nodes = surface_normals(points, blocks)[nodes]
    along = np.einsum("fac,fc->fa", at_nodes, normal)
    inside = at_nodes - along[:, :, None] * normal[:, None]
    out = -inside / np.where(along > 0, along, 1.0)[:, :, None] * real[:, :, None]
    steepest = np.linalg.norm(out, axis=2).max(axis=1)
    sharp = (np.where(real, along, 1.0) <= 0).any(axis=1) | (steepest > STEEP)
    out[sharp | (_mismatch(points[nodes], out, real, normal) > UNEVEN * steepest)] = 0.0
    return out


def _mismatch(x: Array, slope: Array, real: Mask, normal: Array) -> Array:
    """Largest mismatch of slopes and heights along a side, over half its length, (f,)."""
    count = real.sum(axis=1)
    slot = np.arange(x.shape[1])
    after = np.where(slot + 1 < count[:, None], slot + 1, 0)[:, :, None]
    side = np.take_along_axis(x, after, axis=1) - x
    both = slope + np.take_along_axis(slope, after, axis=1)
    rise = np.einsum("fac,fac->fa", both / 2 - normal[:, None], side)
    length = np.linalg.norm(side, axis=2)
    return (2 * np.abs(rise) / np.where(length > 0, length, 1.0) * real).max(axis=1)


def heights(phi: Array, slope: Array, x: Array) -> Array:
    """Heights (t, q) at points with shape functions phi (t, q, a) on facets x (t, a, dim)."""
    where = phi @ x
    towards = phi @ slope
    offset = np.einsum("tac,tac->ta", slope, x)
    return (np.einsum("tqc,tqc->tq", towards, where) - (phi @ offset[:, :, None])[..., 0]) / 2


def surface_normals(points: Array, blocks: tuple[Facets, ...]) -> Array:
    """Normals at the nodes, (n, dim): averages; on the rim continued from the inside.

    There the mean of the normals at both ends of a side is to be perpendicular to it, as on
    every circle.  Corners of the rim follow after the other nodes of the rim.
    """
    normals = nodal_normals(points, blocks)
    sides, rim = _sides(blocks)
    on_rim, corner = np.zeros((2, len(points)), dtype=bool)
    on_rim[rim] = True
    corner[_corners(points, rim) if rim.ndim == 2 else rim] = True
    both = np.concatenate([sides, sides[:, ::-1]])
    first, second = both.T
    for chosen in (on_rim[first] & ~corner[first] & ~on_rim[second], corner[first]):
        normals = _continued(points, normals, both[chosen])
    return normals


def _corners(points: Array, rim: Index) -> Index:
    """Nodes where the rim, sides (k, 2), turns."""
    both = np.concatenate([rim, rim[:, ::-1]])
    along = points[both[:, 1]] - points[both[:, 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    total, times = np.zeros(points.shape), np.bincount(both[:, 0], minlength=len(points))
    np.add.at(total, both[:, 0], along)
    cosine = (total**2).sum(axis=1) / 2 - 1  # of two unit vectors, from their sum
    return np.flatnonzero((times > 0) & ((times != 2) | (cosine > STRAIGHT)))


def _continued(points: Array, normals: Array, sides: Index) -> Array:
    """Normals whose first ends of sides (k, 2) are corrected."""
    if not len(sides):
        return normals
    nodes, of = np.unique(sides[:, 0], return_inverse=True)
    e = points[sides[:, 1]] - points[sides[:, 0]]
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    off = np.einsum("kc,kc->k", normals[sides].sum(axis=1), e)
    dim = points.shape[1]
    matrix, right = np.zeros((len(nodes), dim, dim)), np.zeros((len(nodes), dim))
    np.add.at(matrix, of, e[:, :, None] * e[:, None, :])
    np.add.at(right, of, -off[:, None] * e)
    inverse = np.linalg.pinv(matrix, rcond=DETERMINED, hermitian=True)
    out = normals.copy()
    out[nodes] += np.einsum("kij,kj->ki", inverse, right)
    length = np.linalg.norm(out[nodes], axis=1, keepdims=True)
    out[nodes] /= np.where(length > 0, length, 1.0)  # zero: an edge, flat facets on both sides
    return out


def _sides(blocks: tuple[Facets, ...]) -> tuple[Index, Index]:
    """Sides of facets, each once, (k, 2); and the rim: its sides (l, 2), in 2D its nodes."""
    if blocks[0].kind == "line":
        sides = np.concatenate([block.nodes for block in blocks])
        ends, times = np.unique(sides, return_counts=True)
        return sides, ends[times == 1]
    loops = [np.stack([b.nodes, np.roll(b.nodes, -1, axis=1)], axis=2) for b in blocks]
    every = np.sort(np.concatenate([loop.reshape(-1, 2) for loop in loops]), axis=1)
    sides, times = np.unique(every, axis=0, return_counts=True)
    return sides, sides[times == 1]
