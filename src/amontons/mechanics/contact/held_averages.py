"""What supports leave to averages over a surface: held nodes, components held on both sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.mesh import Mesh
from .segments import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
NO_MOTION = 0.1  # free part of an averaged normal below which supports hold the node in it
SAME = 1e-12  # prescribed values that differ by less, relative to the largest, agree
IN_PLANE = 1e-6  # of the surface's, or a facet's, size: how far a plane's nodes lie from it


def lasting_values(lasting: Array | None, mesh: Mesh) -> Array:
    """Values (n, dim) that supports prescribe at all times, NaN where there are none."""
    return np.full(mesh.points.shape, np.nan) if lasting is None else lasting


def held_along(normals: Array, held: Mask | None, threshold: float) -> Mask:
    """Nodes (n,) that supports hold in the direction of their normal; held (n, dim)."""
    free = np.ones(normals.shape, dtype=bool) if held is None else ~held
    return np.linalg.norm(normals * free, axis=1) < threshold


def held_together(
    nodes: Index, across: sparse.csr_array, slave: tuple[Array, Array],
    master: tuple[Array, Array], ends: Mask,
) -> Mask:  # fmt: skip
    """Components (nc, d) held for good to one value at the slave and at what lies opposite.

    slave, master: points and lasting values, (n, d) each.  All nodes opposite are held so, or
    those on the plane at which the slave ends (ends (n, d)) and which stays a plane, as one
    of symmetry: there the mirror image of the others brings their average to the same value.
    """
    contact, node = across.tocoo().coords
    own, (x, values), (y, others) = nodes[contact], slave, master
    size = np.nanmax(np.abs(np.concatenate([values, others, np.zeros_like(others[:1])])))
    with np.errstate(invalid="ignore"):
        agree = np.abs(values[own] - others[node]) <= SAME * size
    near = IN_PLANE * float(np.ptp(x[nodes], axis=0).max())
    in_plane = np.abs(x[own] - y[node]) <= near
    every = np.ones((len(nodes), x.shape[1]), dtype=bool)
    some, beside = np.zeros_like(every), np.zeros_like(every)
    np.logical_and.at(every, contact, agree)
    np.logical_or.at(some, contact, agree)
    np.logical_or.at(beside, contact, agree & in_plane)
    mirror = beside & ends[nodes]
    for k in range(x.shape[1]):
        for first in _planes(x[nodes[mirror[:, k]], k], near):
            on = np.abs(x[:, k] - first) <= near
            if np.nanmax(values[on, k]) - np.nanmin(values[on, k]) > SAME * size:
                mirror[on[nodes], k] = False
    return some & (every | mirror)


def _planes(coordinates: Array, near: float) -> Array:
    """One coordinate of each group of them that are as near."""
    ordered = np.unique(coordinates)
    return ordered[np.diff(ordered, prepend=-np.inf) > near]


def at_end(side: Surface) -> Mask:
    """Components (n, d) in which all facets of a node lie on one side of it."""
    x = side.points[side.nodes]  # padded by the last: minima and maxima stay
    low, high = np.full(side.points.shape, np.inf), np.full(side.points.shape, -np.inf)
    np.minimum.at(low, side.nodes, np.broadcast_to(x.min(axis=1, keepdims=True), x.shape))
    np.maximum.at(high, side.nodes, np.broadcast_to(x.max(axis=1, keepdims=True), x.shape))
    near = IN_PLANE * np.maximum(high - low, 0.0).max(axis=1, keepdims=True)
    return (side.points <= low + near) | (side.points >= high - near)


def within_free(normals: Array, fixed: Mask) -> Array:
    """Unit normals without their fixed components (nc, d), where something is left of them."""
    inside = normals * ~fixed
    length = np.linalg.norm(inside, axis=1)
    able = length > NO_MOTION
    return np.where(able[:, None], inside / np.where(able, length, 1.0)[:, None], normals)
