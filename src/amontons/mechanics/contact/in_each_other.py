"""How deep two bodies lie in each other: where their boundaries cross, and what is behind.

Edges of one boundary are cut by the facets of the other, flat parts between all nodes: lines in
2D, triangles in 3D.  A node lies inside where the first cut of an edge from it leads out, and
what hangs together with it by edges without a cut does so, too.  A boundary without any cut
lies inside as a whole, or not.  The depth of a point inside is its distance from the boundary
around it; points are the nodes, and the middles of what of an edge is inside: bars that cross
have no node in each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..meshes.facets import Facets, linear_parts
from ..meshes.mesh import Mesh
from .overlap import winding_of
from .pairs import project

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
FEW = 1 << 14  # pairs of edges and parts up to which all boxes are compared


@dataclass(frozen=True, eq=False)
class Boundary:
    """Of a body: parts (k, d), lines or triangles between nodes of the model, outwards.

    span: how long facets are over their parts, 2 of second order.
    """

    parts: Index
    span: float = 1.0

    @classmethod
    def of(cls, mesh: Mesh, offset: int) -> Boundary:
        """The boundary of a mesh whose nodes begin at `offset`."""
        return cls(offset + np.concatenate([
            part for block in linear_parts(mesh.boundary)
            for part in ([block.nodes] if block.kind != "quad"
                         else [block.nodes[:, [0, 1, 2]], block.nodes[:, [0, 2, 3]]])
        ]), mesh.order)  # fmt: skip

    @cached_property
    def edges(self) -> Index:
        """Pairs of nodes (e, 2), every one once; in 2D the parts."""
        if self.parts.shape[1] == 2:
            return self.parts
        loops = np.stack([self.parts, np.roll(self.parts, -1, axis=1)], axis=2)
        return np.unique(np.sort(loops.reshape(-1, 2), axis=1), axis=0)

    @cached_property
    def nodes(self) -> Index:
        """Its nodes, ascending."""
        return np.unique(self.parts)


@dataclass(frozen=True)
class Depth:
    """The worst place (d,), the depth there, and its share of the longer facet there."""

    share: float = 0.0
    depth: float = 0.0
    place: tuple[float, ...] = ()


def deepest(one: Boundary, other: Boundary, x: Array, least: float) -> Depth:
    """The point of either boundary that lies deepest in the other body at x (nodes, d).

    By shares of facets above `least`; a share of 0 where there is none.
    """
    low, high = _common_box(one, other, x)
    if not (high > low).all():
        return Depth()
    edges = [_within(side.edges, x, low, high) for side in (one, other)]
    parts = [_within(side.parts, x, low, high) for side in (one, other)]
    there = _cuts(edges[0], parts[1], x)
    back = there.seen_back() if x.shape[1] == 2 else _cuts(edges[1], parts[0], x)
    found = [
        _deepest_in(a, b, x, _inside(table, cuts, a, b, x, (low, high), least), least)
        for a, b, table, cuts in ((one, other, edges[0], there), (other, one, edges[1], back))
    ]
    return max(found, key=lambda depth: depth.share)


def _common_box(one: Boundary, other: Boundary, x: Array) -> tuple[Array, Array]:
    """Where the boxes around both boundaries overlap, (d,) and (d,)."""
    a, b = x[one.nodes], x[other.nodes]
    low = np.maximum(a.min(axis=0), b.min(axis=0))
    return low, np.minimum(a.max(axis=0), b.max(axis=0))


def _within(table: Index, x: Array, low: Array, high: Array) -> Index:
    """Rows of a table of nodes (k, a) whose boxes meet a box."""
    p = x[table]
    return table[((p.min(axis=1) <= high) & (p.max(axis=1) >= low)).all(axis=1)]


@dataclass(frozen=True, eq=False)
class _Cuts:
    """Of edges by parts, edge after edge and along each of them.

    edge, part (c,): which; t, s (c,): shares of edge and part, s in 2D alone; enters (c,): the
    edge goes in there.
    """

    edge: Index
    part: Index
    t: Array
    s: Array
    enters: Mask

    def seen_back(self) -> _Cuts:
        """In 2D: the parts as edges, cut by these edges."""
        order = np.lexsort((self.s, self.part))
        return _Cuts(self.part[order], self.edge[order], self.s[order], self.t[order],
                     ~self.enters[order])  # fmt: skip


def _cuts(edges: Index, parts: Index, x: Array) -> _Cuts:
    """All cuts of edges (e, 2) by parts (f, d) at x (nodes, d)."""
    of, at = _near(x[edges], x[parts])
    one, other = x[edges[of]], x[parts[at]]
    t, s, enters, hit = (_of_lines if x.shape[1] == 2 else _of_triangles)(one, other)
    order = np.flatnonzero(hit)
    order = order[np.lexsort((t[order], of[order]))]
    return _Cuts(of[order], at[order], t[order], s[order], enters[order])


def _of_lines(edges: Array, lines: Array) -> tuple[Array, Array, Mask, Mask]:
    """t, s and enters of `_Cuts`, and whether there is a cut: edges, lines (k, 2, 2).

    By sides of points, the same whatever shares a point: none is cut twice where they meet.
    """
    there, own = (_sides(lines, edges), _sides(edges, lines))
    first, start = there[0] >= 0, own[0] >= 0
    hit = (first != (there[1] >= 0)) & (start != (own[1] >= 0))
    t, s = (a[0] / np.where(hit, a[0] - a[1], 1.0) for a in (there, own))
    return t, s, ~first, hit


def _sides(lines: Array, points: Array) -> tuple[Array, Array]:
    """On which side of lines (k, 2, 2) both points (k, 2, 2) are: > 0 inside, to the left."""
    start, way = lines[:, 0], lines[:, 1] - lines[:, 0]
    off = points - start[:, None]
    found = way[:, None, 0] * off[:, :, 1] - way[:, None, 1] * off[:, :, 0]
    return found[:, 0], found[:, 1]


def _of_triangles(edges: Array, triangles: Array) -> tuple[Array, Array, Mask, Mask]:
    """The same of edges (k, 2, 3) and triangles (k, 3, 3); s means nothing."""
    first, start = edges[:, 0], triangles[:, 0]
    sides = first - edges[:, 1], triangles[:, 1] - start, triangles[:, 2] - start
    A = np.stack(sides, axis=2)
    volume = np.linalg.det(A)
    A[volume == 0] = np.eye(3)  # parallel: no cut
    share: Array = np.linalg.solve(A, (first - start)[:, :, None])[:, :, 0].astype(np.float64)
    t, inner = share[:, 0], share[:, 1:]
    hit = (volume != 0) & (t >= 0) & (t < 1) & (inner >= 0).all(axis=1)
    hit &= inner.sum(axis=1) <= 1
    return t, inner[:, 0], volume > 0, hit  # det A > 0: against the normal of the triangle


def _near(edges: Array, parts: Array) -> tuple[Index, Index]:
    """Edges (k,) and parts (k,), of corners (e, 2, d) and (f, d, d), whose boxes overlap."""
    low, high = edges.min(axis=1), edges.max(axis=1)
    least, most = parts.min(axis=1), parts.max(axis=1)
    if len(edges) * len(parts) <= FEW:
        of, at = np.nonzero(
            ((low[:, None] <= most) & (high[:, None] >= least)).all(axis=2)
        )
        return of, at
    from scipy.spatial import cKDTree

    radius, reach = (np.linalg.norm(b - a, axis=1) / 2
                     for a, b in ((low, high), (least, most)))  # fmt: skip
    label = np.floor(np.log2(np.maximum(reach, np.finfo(float).tiny)))
    of, at = [], []
    for value in np.unique(label):
        members = np.flatnonzero(label == value)
        lists = cKDTree((least + most)[members] / 2).query_ball_point(
            (low + high) / 2, radius + reach[members].max()
        )
        of.append(np.repeat(np.arange(len(edges)), [len(one) for one in lists]))
        at += [members[np.asarray(one, dtype=np.int64)] for one in lists]
    first, second = np.concatenate(of), np.concatenate(at)
    kept = (low[first] <= most[second]) & (high[first] >= least[second])
    kept = kept.all(axis=1)
    return first[kept], second[kept]


@dataclass(frozen=True, eq=False)
class _Inside:
    """Points (k, d) of edges inside the other body.

    size (k,): lengths of these edges; bound (k,): of their depths.
    """

    points: Array
    size: Array
    bound: Array


def _inside(
    edges: Index, cuts: _Cuts, one: Boundary, other: Boundary, x: Array,
    box: tuple[Array, Array], least: float,
) -> _Inside:  # fmt: skip
    """Of edges (e, 2) of boundary `one`, as they are cut; box of both; depths above `least`."""
    low, high = box
    if not len(cuts.edge):
        return _nested(one, other, x, low, high)
    ends = np.diff(cuts.edge) > 0
    first, last = np.append(True, ends), np.append(ends, True)
    long = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
    votes, bound = np.zeros((2, len(x))), np.full(len(x), np.inf)
    for end, chosen, side, way in ((0, first, ~cuts.enters, cuts.t),
                                   (1, last, cuts.enters, 1 - cuts.t)):  # fmt: skip
        edge, behind = cuts.edge[chosen], side[chosen]
        node = edges[edge, end]
        votes[behind.astype(np.int64), node] = 1
        np.minimum.at(bound, node[behind], (way[chosen] * long[edge])[behind])
    size = np.zeros(len(x))
    np.maximum.at(size, edges, long[:, None])
    for k in np.flatnonzero(votes.all(axis=0) & (bound > least * size)):  # cut at nodes
        votes[:, k] = np.arange(2) == (winding_of(x[other.parts] - x[k]) > 0.5)
    inside = votes[1] > votes[0]
    known = np.asarray(votes.any(axis=0) | ((x < low) | (x > high)).any(axis=1))
    nodes = np.flatnonzero(_spread(edges, cuts, inside, known))
    pair = np.flatnonzero(~last & cuts.enters)  # cut again behind: bars that cross
    pair = pair[~cuts.enters[pair + 1]]
    edge, t, then = cuts.edge[pair], cuts.t[pair], cuts.t[pair + 1]
    middle = (t + then)[:, None] / 2
    between = (1 - middle) * x[edges[edge, 0]] + middle * x[edges[edge, 1]]
    return _Inside(np.concatenate([x[nodes], between]),
                   np.concatenate([size[nodes], long[edge]]),
                   np.concatenate([bound[nodes], (then - t) / 2 * long[edge]]))  # fmt: skip


def _nested(one: Boundary, other: Boundary, x: Array, low: Array, high: Array) -> _Inside:
    """The same without cuts: all nodes, or none."""
    p, d = x[one.nodes], x.shape[1]
    if ((p < low) | (p > high)).any() or winding_of(x[other.parts] - p[0]) < 0.5:
        return _Inside(np.zeros((0, d)), np.zeros(0), np.zeros(0))
    long = np.linalg.norm(x[one.edges[:, 1]] - x[one.edges[:, 0]], axis=1)
    return _Inside(p, np.full(len(p), long.max()), np.full(len(p), np.inf))


def _spread(edges: Index, cuts: _Cuts, inside: Mask, known: Mask) -> Mask:
    """Nodes that lie inside, (nodes,), from those that are known, by edges without a cut."""
    whole = np.ones(len(edges), dtype=bool)
    whole[cuts.edge] = False
    ways = np.concatenate([edges[whole], edges[whole][:, ::-1]])
    while True:
        reached = ways[inside[ways[:, 0]] & ~known[ways[:, 1]], 1]
        if not len(reached):
            return inside
        inside[reached] = known[reached] = True


def _deepest_in(
    one: Boundary, other: Boundary, x: Array, inside: _Inside, least: float
) -> Depth:
    """The deepest of points of boundary `one` inside the other body."""
    size = one.span * inside.size
    some = inside.bound > least * size
    if not some.any():
        return Depth()
    points, size = inside.points[some], size[some]
    depth, length = _distances(points, other, x)
    share = depth / np.maximum(size, other.span * length)
    for k in np.argsort(-share, kind="stable"):
        if share[k] <= least:
            break
        if winding_of(x[other.parts] - points[k]) > 0.5:  # cuts at nodes may count twice
            return Depth(float(share[k]), float(depth[k]), tuple(points[k].tolist()))
    return Depth()


def _distances(points: Array, boundary: Boundary, x: Array) -> tuple[Array, Array]:
    """Distances (k,) of points from a boundary at x, and lengths (k,) of parts there."""
    kind = "line" if x.shape[1] == 2 else "tri"
    if len(points) * len(boundary.parts) > FEW or kind == "tri":
        every = np.ones(len(points), dtype=bool)
        hit = project(points, x, (Facets(kind, boundary.parts),), free=every)
        off = points - hit.closest
        return np.sqrt((off * off).sum(axis=1)), hit.size
    start = x[boundary.parts[:, 0]]
    way = x[boundary.parts[:, 1]] - start
    squares = (way * way).sum(axis=1)
    off = points[:, None] - start
    t = np.clip((off * way).sum(axis=2) / np.where(squares > 0, squares, 1.0), 0, 1)
    off -= t[:, :, None] * way
    found = (off * off).sum(axis=2)
    k = found.argmin(axis=1)
    return np.sqrt(found[np.arange(len(k)), k]), np.sqrt(squares[k])
