"""Which facets of two deforming surfaces face each other where they are now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from ..meshes.cells import CELLS
from ..meshes.facets import Facets, corner_facets
from .segments import feet

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
TWICE = 1e-6  # coverage above 1 by less is rounding
THROUGH = 0.5  # part of the extent of closed surfaces by which they may overlap
AWAY = -0.3  # cosine to the mean normal below which a facet closes a surface around a body


@dataclass(frozen=True, eq=False)
class Skin:
    """Facets in one table: nodes (f, a) at corners, padded by the last; corners (f,).

    Facets of second order have `bent` (f,) nodes beside them, middles (f, e), padded by the
    first corner, with parts (f, e, a) of the corners that each lies between.  The surface is
    that through the corners, and at every middle it is moved by the bulge: from the mean of
    its corners to the node.
    """

    nodes: Index
    corners: Index
    middles: Index
    parts: Array
    bent: Index

    @classmethod
    def of(cls, facets: tuple[Facets, ...], offset: int) -> Skin:
        """The facets of a body whose nodes begin at `offset` in the model."""
        blocks = [block for block in facets if len(block.nodes)]
        firsts = [corner_facets(block).nodes + offset for block in blocks]
        rests = [
            block.nodes[:, first.shape[1] :] + offset
            for block, first in zip(blocks, firsts, strict=True)
        ]
        width = max(part.shape[1] for part in firsts)
        room = max(part.shape[1] for part in rests)
        padded = [
            _wider(p, width, p[:, -1:]) for p in firsts
        ]
        beside = [
            _wider(p, room, c[:, :1]) for p, c in zip(rests, firsts, strict=True)
        ]
        parts = []
        for block in blocks:
            part = np.zeros((room, width))
            part[:, 0] = 1.0  # of the padding
            for k, parents in enumerate(CELLS[block.kind].parents):
                part[k] = 0.0
                part[k, list(parents)] = 1 / len(parents)
            parts.append(np.broadcast_to(part, (len(block.nodes), room, width)))
        corners, bent = (
            np.concatenate([np.full(len(p), p.shape[1], dtype=np.int64) for p in every])
            for every in (firsts, rests)
        )
        nodes, middles = (np.concatenate(p).astype(np.int64) for p in (padded, beside))
        return cls(nodes, corners, middles, np.concatenate(parts), bent)

    @classmethod
    def joined(cls, skins: Sequence[Skin]) -> Skin:
        """The facets of several surfaces, one after another, as one."""
        width, room = (max(getattr(s, name).shape[1] for s in skins)
                       for name in ("nodes", "middles"))  # fmt: skip
        nodes = [_wider(s.nodes, width, s.nodes[:, -1:]) for s in skins]
        middles = [_wider(s.middles, room, s.nodes[:, :1]) for s in skins]
        parts = []
        for s in skins:
            part = np.zeros((len(s.nodes), room, width))
            part[:, :, 0] = 1.0  # of the padding
            part[:, : s.middles.shape[1], : s.nodes.shape[1]] = s.parts
            parts.append(part)
        corners, bent = (np.concatenate([getattr(s, name) for s in skins])
                         for name in ("corners", "bent"))  # fmt: skip
        return cls(np.concatenate(nodes), corners, np.concatenate(middles),
                   np.concatenate(parts), bent)  # fmt: skip

    def part(self, chosen: Index) -> Skin:
        """Some of the facets, (k,)."""
        return Skin(*(getattr(self, one.name)[chosen] for one in fields(self)))

    @property
    def real(self) -> Mask:
        """Which slots of nodes are real, (f, a)."""
        return np.arange(self.nodes.shape[1]) < self.corners[:, None]

    @property
    def all(self) -> Index:
        """Its nodes at corners, ascending."""
        return np.unique(self.nodes)

    @cached_property
    def every(self) -> Index:
        """All its nodes, ascending."""
        return np.unique(np.concatenate([self.nodes.ravel(), self.middles.ravel()]))

    @cached_property
    def pieces(self) -> Index:
        """Which surface that hangs together by its corners each facet is of, (f,)."""
        f, a = self.nodes.shape
        entries = np.ones(f * a), (np.repeat(np.arange(f), a), self.nodes.ravel())
        by_node = sparse.csr_array(entries, shape=(f, int(self.nodes.max()) + 1))
        label = csgraph.connected_components(by_node @ by_node.T, directed=False)[1]
        return np.asarray(label, dtype=np.int64)

    @cached_property
    def rim(self) -> Index:
        """Corners (k,) where the surface ends: at sides of one facet alone; ascending."""
        if self.nodes.shape[1] == 2:
            sides = self.nodes.reshape(-1, 1)
        else:
            after = np.roll(self.nodes, -1, axis=1)
            after[np.arange(len(after)), self.corners - 1] = self.nodes[:, 0]
            sides = np.stack([self.nodes, after], axis=2)[self.real]
        found, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
        return np.unique(found[count == 1])

    @cached_property
    def means(self) -> tuple[Index, Index, Array]:
        """Middle, corner it lies between, and part of it, (k,) each, every pair once."""
        real = np.arange(self.middles.shape[1]) < self.bent[:, None]
        held = (self.parts > 0) & real[:, :, None]
        f, m, c = np.nonzero(held)
        pairs = np.stack([self.middles[f, m], self.nodes[f, c]])
        pairs, first = np.unique(pairs, axis=1, return_index=True)
        return pairs[0], pairs[1], self.parts[f, m, c][first]

    def bulges(self, n: int) -> sparse.csr_array:
        """Bulge of every middle of positions of n nodes, (n, n), without rows of others."""
        middle, corner, part = self.means
        own = np.unique(middle)
        entries = np.concatenate([np.ones(len(own)), -part])
        rows = np.concatenate([own, middle])
        columns = np.concatenate([own, corner])
        return sparse.coo_array((entries, (rows, columns)), shape=(n, n)).tocsr()

    def values(self, x: Array) -> Array:
        """Positions of corners and bulges of middles at positions x, (f, a + e, d)."""
        corners = x[self.nodes]
        return np.concatenate([corners, x[self.middles] - self.parts @ corners], axis=1)

    def areas(self, x: Array) -> Array:
        """Outward normals times area at positions x (nodes, d), (f, d)."""
        p = x[self.nodes]
        if x.shape[1] == 2:
            edge = p[:, 1] - p[:, 0]
            return np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        a, b = (p[:, 2] - p[:, 0]).T, 0.5 * (p[:, -1] - p[:, 1]).T
        return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]], axis=1)  # fmt: skip

    def gradients(self, x: Array, chosen: Index) -> Array:
        """Surface gradients of the functions of corners at the centres of facets, (k, a, d).

        chosen (k,): which facets.
        """
        a, d = self.nodes.shape[1], x.shape[1]
        by = np.zeros((len(chosen), d - 1, a))  # by the coordinates of the reference facet
        if d == 2:
            by[:, 0, :2] = -1.0, 1.0
        else:
            by[:, 0, :3], by[:, 1, :3] = (-1.0, 1.0, 0.0), (-1.0, 0.0, 1.0)
            four = self.corners[chosen] == 4
            if a == 4:
                by[four, 0], by[four, 1] = (-0.5, 0.5, 0.5, -0.5), (-0.5, -0.5, 0.5, 0.5)
        tangents = by @ x[self.nodes[chosen]]  # (k, d - 1, d)
        metric = tangents @ tangents.swapaxes(1, 2)
        return by.swapaxes(1, 2) @ (np.linalg.inv(metric) @ tangents)

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

    def size_slopes(self, x: Array, chosen: Index) -> Array:
        """Derivatives of areas of chosen facets (k,) by their nodes, (k, a d); 0 of points."""
        some = self.part(chosen)
        areas = some.areas(x)
        size = np.linalg.norm(areas, axis=1)[:, None]
        n = areas / np.where(size > 0, size, 1.0)
        slopes = np.einsum("kd,kdac->kac", n, some.area_slopes(x))
        return slopes.reshape(len(areas), slopes.shape[1] * slopes.shape[2])

    def normal_slopes(self, x: Array, chosen: Index) -> Array:
        """Derivatives of the unit normals of chosen facets (k,) by their nodes, (k, d, a d)."""
        some = self.part(chosen)
        areas, d = some.areas(x), x.shape[1]
        size = np.linalg.norm(areas, axis=1)[:, None]
        size = np.where(size > 0, size, 1.0)
        n = areas / size
        across = (np.eye(d) - n[:, :, None] * n[:, None, :]) / size[:, :, None]
        return across @ some.area_slopes(x).reshape(len(areas), d, d * some.nodes.shape[1])


def dofs_of(nodes: Index, d: int) -> Index:
    """Dofs (k, a d) of nodes (k, a)."""
    return (nodes[:, :, None] * d + np.arange(d)).reshape(len(nodes), nodes.shape[1] * d)


def _wider(table: Index, width: int, last: Index) -> Index:
    """A table (f, a) with `last` (f, 1) again and again, up to a width."""
    return np.concatenate([table, np.repeat(last, width - table.shape[1], axis=1)], axis=1)


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

    (centre, normal, radius), (there, facing, size) = (shapes(s, x) for s in (slave, master))
    nodes = master.all
    normals = np.zeros(x.shape)
    for slot in range(master.nodes.shape[1]):
        np.add.at(normals, master.nodes[:, slot], facing)
    tree = cKDTree(x[nodes])
    foot, beside = feet(centre, normal, tree, normals[nodes])
    reach = 2 * radius + beside
    label = np.floor(np.log2(np.maximum(size, np.finfo(float).tiny)))
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


def shapes(side: Skin, x: Array) -> tuple[Array, Array, Array]:
    """Centres, unit normals (f, d) and radii (f,) of facets; no normal of a mere point."""
    p, real = x[side.nodes], side.real[:, :, None]
    centre = (p * real).sum(axis=1) / side.corners[:, None]
    normal = side.areas(x)
    size = np.linalg.norm(normal, axis=1)[:, None]
    normal = normal / np.where(size > 0, size, 1.0)
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


def seen_through(other: Index, gap: Array, length: Array) -> Mask:
    """Pairs (k,) that a slave sees through its own body, which no force joins.

    other (k,): master facets, gap (k,) from the slave's; length: of master facets.  Sides of
    one surface that stand on each other, as top and side of a block, both face a master that
    is tilted: the side, edge-on, from behind.  What is behind a facet of the slave by more than
    behind any other one is farther off by at most its own length where it faces all of them
    within 45 degrees; else the other one lies between.
    """
    behind = np.full(len(length), -np.inf)
    np.maximum.at(behind, other, gap)
    return gap < np.minimum(behind[other], 0.0) - length[other]


def aside(slave: Skin, master: Skin, x: Array, of: Index, other: Index) -> Mask:
    """Pairs (k,) that share nothing as the master sees them, along its own normal.

    of, other (k,): facets of both.  A facet is a disc around its centre here, of radius r:
    seen along the master's normal N the slave's, of normal n, reaches r sqrt(1 - (n . e)^2)
    along e, the way between both centres, and the master's its own radius.  What touches is
    opposite both ways; a side of a slave that a master passes edge-on, far away, is not.
    """
    (centre, n, reach), (there, N, radius) = (shapes(one, x) for one in (slave, master))
    way = centre[of] - there[other]
    way -= (way * N[other]).sum(axis=1)[:, None] * N[other]
    length = np.linalg.norm(way, axis=1)
    e = way / np.where(length > 0, length, 1.0)[:, None]
    flat = np.sqrt(np.maximum(1 - (n[of] * e).sum(axis=1) ** 2, 0.0))
    return np.asarray(length > radius[other] + reach[of] * flat)
