"""Which facets of two deforming surfaces face each other where they are now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..meshes.facets import Facets
from .segments import feet

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
TWICE = 1e-6  # coverage above 1 by less is rounding
THROUGH = 0.5  # part of the extent of closed surfaces by which they may overlap
AWAY = -0.3  # cosine to the mean normal below which a facet closes a surface around a body


@dataclass(frozen=True, eq=False)
class Skin:
    """Facets of first order in one table: nodes (f, a), padded by the last; corners (f,)."""

    nodes: Index
    corners: Index

    @classmethod
    def of(cls, facets: tuple[Facets, ...], offset: int) -> Skin:
        """The facets of a body whose nodes begin at `offset` in the model."""
        parts = [block.nodes + offset for block in facets if len(block.nodes)]
        width = max(part.shape[1] for part in parts)
        padded = [
            np.concatenate([p, np.repeat(p[:, -1:], width - p.shape[1], axis=1)], axis=1)
            for p in parts
        ]
        corners = [np.full(len(p), p.shape[1], dtype=np.int64) for p in parts]
        return cls(np.concatenate(padded).astype(np.int64), np.concatenate(corners))

    @property
    def real(self) -> Mask:
        """Which slots of nodes are real, (f, a)."""
        return np.arange(self.nodes.shape[1]) < self.corners[:, None]

    @property
    def all(self) -> Index:
        """Its nodes, ascending."""
        return np.unique(self.nodes)

    def areas(self, x: Array) -> Array:
        """Outward normals times area at positions x (nodes, d), (f, d)."""
        p = x[self.nodes]
        if x.shape[1] == 2:
            edge = p[:, 1] - p[:, 0]
            return np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        return 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, -1] - p[:, 1])

    def area_slopes(self, x: Array) -> Array:
        """Derivatives of these by the nodes, (f, d, a, d)."""
        f, a = self.nodes.shape
        d = x.shape[1]
        out = np.zeros((f, d, a, d))
        if d == 2:
            turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
            out[:, :, 0], out[:, :, 1] = -turn, turn
            return out
        p = x[self.nodes]
        by_first = -0.5 * _crossing(p[:, -1] - p[:, 1])
        by_second = 0.5 * _crossing(p[:, 2] - p[:, 0])
        out[:, :, 2] += by_first
        out[:, :, 0] -= by_first
        out[:, :, -1] += by_second
        out[:, :, 1] -= by_second
        return out


def _crossing(v: Array) -> Array:
    """Matrices (k, 3, 3) of v x ., v (k, 3)."""
    out = np.zeros((len(v), 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[:, k, j], out[:, j, k] = v[:, i], -v[:, i]
    return out


def candidates(slave: Skin, master: Skin, x: Array) -> tuple[Index, Index]:
    """Facets (k,) and (k,) of both that may share something, at positions x (nodes, d).

    A tree of the master's nodes tells how far away the other side is from each slave facet,
    a tree of its facets which ones lie around there.
    """
    from scipy.spatial import cKDTree

    (centre, normal, radius), (there, facing, size) = (_shapes(s, x) for s in (slave, master))
    nodes = master.all
    normals = np.zeros(x.shape)
    for slot in range(master.nodes.shape[1]):
        np.add.at(normals, master.nodes[:, slot], facing)
    tree = cKDTree(x[nodes])
    foot, beside = feet(centre, normal, tree, normals[nodes])
    reach = 2 * radius + beside
    label = np.floor(np.log2(size))
    of, other = [], []
    for value in np.unique(label):
        members = np.flatnonzero(label == value)
        lists = cKDTree(there[members]).query_ball_point(
            foot, reach + size[members].max(), return_sorted=True
        )
        of.append(np.repeat(np.arange(len(foot)), [len(one) for one in lists]))
        other += [members[np.asarray(one, dtype=np.int64)] for one in lists]
    first, second = np.concatenate(of), np.concatenate(other)
    towards = (normal[first] * facing[second]).sum(axis=1) < 0
    joined = (slave.nodes[first][:, :, None] == master.nodes[second][:, None]).any(axis=(1, 2))
    depth = ((there[second] - centre[first]) * normal[first]).sum(axis=1)
    through = np.zeros(len(depth), dtype=bool)
    if all(_is_closed(side) for side in (normal, facing)):  # far sides face each other, too
        extents = [np.linalg.norm(np.ptp(x[side.all], axis=0)) for side in (slave, master)]
        through = depth < -THROUGH * min(extents)
    kept = towards & ~joined & ~through
    return first[kept], second[kept]


def _shapes(side: Skin, x: Array) -> tuple[Array, Array, Array]:
    """Centres, unit normals (f, d) and radii (f,) of facets."""
    p, real = x[side.nodes], side.real[:, :, None]
    centre = (p * real).sum(axis=1) / side.corners[:, None]
    normal = side.areas(x)
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    return centre, normal, np.linalg.norm(p - centre[:, None], axis=2).max(axis=1)


def _is_closed(normals: Array) -> bool:
    """Whether a surface with unit normals (f, d) goes around a body."""
    mean = normals.sum(axis=0)
    return bool((normals @ mean < AWAY * np.linalg.norm(mean)).any()) or not mean.any()


def nearest(of: Index, area: Array, gap: Array, whole: Array) -> Mask:
    """Pairs (k,) that are not behind others: the nearest that cover each facet once.

    of (k,): slave facets; area, gap (k,) of what they share; whole: areas of slave facets.
    """
    order = np.lexsort((np.abs(gap), of))
    covered = np.cumsum(area[order])
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.diff(of[order]) > 0
    before = np.maximum.accumulate(np.where(first, covered - area[order], 0.0))
    out = np.zeros(len(of), dtype=bool)
    out[order] = covered - before <= (1 + TWICE) * whole[of[order]]
    return out
