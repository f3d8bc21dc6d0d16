"""Where a surface has a ridge: facets turn there more than its curvature explains.

With unit normals n_f and areas a_f of the facets around a node p, r_f corners each,

    n_p = sum_f a_f n_f / r_f / | |,    S_p = sum_f a_f (n_f - n_p) (n_f - n_p)^T / r_f / sum,

tell how far normals scatter along a direction t of the surface, by S_tt.  Of a curved surface
the nodes beside have as much, wherever the mesh is of one width; over a ridge they have less on
both sides of it.  So, over the nodes q of the same facets, in front and behind along t,

    r_p = max_t (1 - TWICE max_q S_q,tt / S_p,tt)+ (1 - S_p,tt / EDGE)+ w(S_p,tt),         (1)

w = S / (S + EVEN): 0 on a surface without ridges, at a kink that begins a curved part, and at
an edge, whose sides are contacts of their own.  Where the surface ends along t there are facets
on one side alone: no ridge, and nothing to learn for nodes beside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .facing import Skin
from .slave_normals import AROUND

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
EVEN = 1e-4  # square of an angle (half a degree) by which facets scatter that counts as none
TWICE = 4.0  # half the kink beside, and it is none of a ridge: squares of angles
EDGE = 0.5 * (1 - AROUND)  # of two facets that turn so far as to lie around an edge
FAN = 8  # directions that are tried in space
ALONG = 0.5  # cosine to a direction from which a neighbour lies along it


def ridges(skin: Skin, nodes: Index, x: Array) -> Array:
    """r of nodes (nc,) of a surface at positions x (n, d), from 0 to 1."""
    facing, scatter = _scatter(skin, x)
    here, there = _neighbours(skin)
    way = x[there] - x[here]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    axes = _fan(facing)
    size = np.einsum("ndt,nde,net->nt", axes, scatter, axes)
    along = np.einsum("kd,kdt->kt", way, axes[here])
    beside = np.einsum("kdt,kde,ket->kt", axes[here], scatter[there], axes[here])
    known = _goes_on(skin.rim, here, there, way)[:, None]
    most = np.zeros(size.shape)
    seen, sides = np.zeros(size.shape, dtype=bool), np.ones(size.shape, dtype=bool)
    for ahead in (along > ALONG, along < -ALONG):
        np.maximum.at(most, here, np.where(ahead & known, beside, 0.0))
        np.logical_or.at(seen, here, ahead & known)
        one = np.zeros(size.shape, dtype=bool)
        np.logical_or.at(one, here, ahead)
        sides &= one
    least = np.where(size > 0, size, 1.0)
    more = np.where(seen & sides, np.maximum(1 - TWICE * most / least, 0.0), 0.0)
    more *= np.maximum(1 - size / EDGE, 0.0)
    found = (more * size / (size + EVEN)).max(axis=1)
    return np.asarray(found[nodes], dtype=np.float64)


def _goes_on(rim: Index, here: Index, there: Index, way: Array) -> Mask:
    """Of pairs (k,): the surface goes on behind the second node; way (k, d) to that one."""
    ends = np.flatnonzero(np.isin(there, rim))
    out = np.ones(len(here), dtype=bool)
    first = np.searchsorted(here, there[ends])
    count = np.searchsorted(here, there[ends], side="right") - first
    of = np.repeat(np.arange(len(ends)), count)
    after = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[of]
    on = (way[ends[of]] * way[after]).sum(axis=1) > ALONG
    out[ends] = np.bincount(of, on, minlength=len(ends)) > 0
    return out


def _fan(facing: Array) -> Array:
    """Directions (n, d, t) of the surfaces that have normals (n, d)."""
    n, d = facing.shape
    if d == 2:
        return np.stack([facing[:, 1], -facing[:, 0]], axis=1)[:, :, None]
    first = np.eye(3)[np.abs(facing).argmin(axis=1)]
    first -= (first * facing).sum(axis=1, keepdims=True) * facing
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(facing, first)
    angle = np.pi * np.arange(FAN) / FAN
    return first[:, :, None] * np.cos(angle) + second[:, :, None] * np.sin(angle)


def _scatter(skin: Skin, x: Array) -> tuple[Array, Array]:
    """n (n, d) and S (n, d, d), zero of nodes that are not of the surface."""
    areas = skin.areas(x)
    size = np.linalg.norm(areas, axis=1, keepdims=True)
    facing = areas / np.where(size > 0, size, 1.0)
    slots = skin.nodes[skin.real]
    share = np.repeat(size[:, 0] / skin.corners, skin.corners)
    of = np.repeat(np.arange(len(skin.nodes)), skin.corners)
    n, d = x.shape
    total, mean = np.zeros(n), np.zeros((n, d))
    np.add.at(total, slots, share)
    np.add.at(mean, slots, share[:, None] * facing[of])
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    mean /= np.where(length > 0, length, 1.0)
    off = facing[of] - mean[slots]
    out = np.zeros((n, d, d))
    np.add.at(out, slots, share[:, None, None] * off[:, :, None] * off[:, None, :])
    return mean, out / np.where(total > 0, total, 1.0)[:, None, None]


def _neighbours(skin: Skin) -> tuple[Index, Index]:
    """Pairs (k,) of different nodes of a facet, both ways."""
    a = skin.nodes.shape[1]
    one, other = np.nonzero(~np.eye(a, dtype=bool))
    pairs = np.stack([skin.nodes[:, one].ravel(), skin.nodes[:, other].ravel()])
    pairs = np.unique(pairs[:, pairs[0] != pairs[1]], axis=1)
    return pairs[0], pairs[1]
