"""Segments: the parts of slave facets that face one master facet each, and integrals on them.

The parts and the points on them are those of `cuts`; the cost of the search for pairs of facets
grows with their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..meshes.cells import CELLS
from ..meshes.check import is_straight
from ..meshes.facets import Facets, corner_facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_areas, facet_normals, nodal_normals
from .curvature import heights, slopes
from .cuts import SIDES, Cuts, cuts, functions
from .distances import distances
from .overlap import inside
from .pairs import AROUND, BESIDE, DEEP, EDGEWISE, KINDS, MAX_NODES
from .primitives import Shapes, shapes_of

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
FLAT_FACET = 1e-12  # area, relative to the square of the longest side, of a degenerate facet
ROUNDING = 1e-9  # of a size, below which facets lie on each other
SLIVER = 1e-8  # part of a facet; biorthogonal functions on less are lost in rounding
TWICE = 1e-6  # coverage above 1 by less is rounding
TWICE_CURVED = 1e-2  # the same where areas are no polynomials
CHUNK = 2000  # slave facets at a time, for memory


@dataclass(frozen=True, eq=False)
class Surface:
    """Facets of all kinds of a surface in one table, with nodes (f, 4) padded by the last.

    corners (f,): how many are real; centre, normal (f, dim), outward; radius, area (f,);
    slopes (f, 4, dim): of the curved surface that the facets stand for, see `curvature`.
    Of second order these are the facets between corners, and all (f, w) their nodes with those
    in between, else the corners again; kind (f,): place in SIDES.  curved: nodes in between
    lie elsewhere than in the middle, they tell the surface, and slopes are zero.  axisymmetric:
    areas go around the axis.  shapes: spheres, cones and cylinders on which nodes lie.
    """

    points: Array
    nodes: Index
    corners: Index
    centre: Array
    normal: Array
    radius: Array
    area: Array
    slopes: Array
    blocks: tuple[Facets, ...]
    all: Index
    kind: Index
    shapes: Shapes
    curved: bool = False
    axisymmetric: bool = False

    @classmethod
    def of(
        cls, points: Array, facets: tuple[Facets, ...], name: str, *, axisymmetric: bool = False
    ) -> Surface:
        """The table; raises InvalidInput for facets without area."""
        given = tuple(block for block in facets if len(block.nodes))
        blocks = tuple(corner_facets(block) for block in given)
        nodes = np.concatenate([_padded(block.nodes, MAX_NODES) for block in blocks])
        corners = np.concatenate([np.full(len(b.nodes), b.nodes.shape[1]) for b in blocks])
        normal = np.concatenate([facet_normals(points, block) for block in blocks])
        length = np.linalg.norm(normal, axis=1)
        x = points[nodes]
        real = np.arange(MAX_NODES) < corners[:, None]
        centre = np.einsum("fa,fac->fc", real / corners[:, None], x)
        radius = np.linalg.norm(x - centre[:, None], axis=2).max(axis=1)
        area = np.concatenate([facet_areas(points, block) for block in blocks])
        _check_areas(name, (nodes, corners, centre), np.minimum(area, length), radius)
        normal = normal / length[:, None]
        curved = not all(is_straight(CELLS[b.kind], points[b.nodes]) for b in given)
        bent = np.zeros((*nodes.shape, points.shape[1]))
        if not curved:
            bent = slopes(points, blocks, nodes, real, normal)
        if curved or axisymmetric:
            area = np.concatenate(
                [facet_areas(points, b, axisymmetric=axisymmetric) for b in given]
            )
        width = max(MAX_NODES, *(b.nodes.shape[1] for b in given))
        return cls(
            points, nodes, corners, centre, normal, radius, area, bent, blocks,
            np.concatenate([_padded(b.nodes, width) for b in given]),
            np.concatenate([np.full(len(b.nodes), SIDES.index(b.kind)) for b in given]),
            shapes_of(points, nodes, corners, normal), curved, axisymmetric,
        )  # fmt: skip

    @classmethod
    def on(cls, mesh: Mesh, name: str) -> Surface:
        """The same of a named surface of a mesh."""
        return cls.of(
            mesh.points, mesh.surface(name), name, axisymmetric=mesh.axisymmetric
        )

    @property
    def real(self) -> Mask:
        """Which slots of nodes are real, (f, 4)."""
        return np.arange(MAX_NODES) < self.corners[:, None]

    @property
    def is_second(self) -> bool:
        """Whether displacements have nodes between the corners."""
        return bool(self.kind.max(initial=0) >= len(KINDS))


def _check_areas(
    name: str, table: tuple[Index, Index, Array], area: Array, radius: Array
) -> None:
    """Raise InvalidInput where facets, table: nodes, corners and centre, have no area (f,)."""
    nodes, corners, centre = table
    bad = np.flatnonzero(area <= FLAT_FACET * radius ** (centre.shape[1] - 1))
    if bad.size:
        where = nodes[bad[0], : corners[bad[0]]]
        raise InvalidInput(
            f"surface {name!r}: the facet with nodes {where.tolist()} near "
            f"{centre[bad[0]].tolist()} has no area; {bad.size} such facets, expected none"
        )


@dataclass(frozen=True, eq=False)
class Segments:
    """Integrals on k segments: facets slave, master (k,); a, b are slots of their nodes.

    mass (k, a, b): int phi_a phi_b of the corners; own (k, a, w): int phi_a N_b with the shape
    functions N of the slave's displacement, of first order phi; cross (k, a, w): the same of
    the master's; apart (k, a): int phi_a times the distance of the curved surfaces along the
    normal of the slave's facet (`distances`), < 0 where they overlap; area (k,); gap (k,): mean
    distance of the facets themselves; between (k, 2): the least and the largest distance of the
    curved surfaces, of slaves of second order, else infinite.
    """

    slave: Index
    master: Index
    mass: Array
    own: Array
    cross: Array
    apart: Array
    area: Array
    gap: Array
    between: Array

    def at(self, chosen: Index | Mask) -> Segments:
        """A selection of these segments."""
        return Segments(*(getattr(self, one.name)[chosen] for one in fields(self)))


def segments(
    slave: Surface, master: Surface, *, joined: bool = False, within: Array | None = None
) -> Segments:
    """All segments of two surfaces that face each other.

    joined: both are in one mesh, with common numbers; facets that share a node are a pair at
    the tip of a slot, but not around an edge, where the body is between them.
    within (f,): distances in which to look around slave facets; by default around the closest
    node of the master that faces a facet, which may lie behind it, through a thin body.
    """
    found = []
    for chunk, facet in _candidates(slave, master, within):
        if joined:
            same = slave.nodes[chunk][:, :, None] == master.nodes[facet][:, None, :]
            way = master.centre[facet] - slave.centre[chunk]
            ahead = np.einsum("kc,kc->k", way, slave.normal[chunk])
            counts = ~same.any(axis=(1, 2)) | (ahead > -ROUNDING * slave.radius[chunk])
            chunk, facet = chunk[counts], facet[counts]
        for of, opposite, parts in cuts(slave, master, chunk, facet):
            found.append(_summed(slave, master, of, opposite, parts))
    every = _joined(found, slave, master)
    reached = np.bincount(every.slave, every.area, minlength=len(slave.nodes))
    return every.at((reached > SLIVER * slave.area)[every.slave])


def in_front(over: Surface, under: Surface, master: Mesh, *, joined: bool) -> Segments:
    """Segments that count: the nearest, and deep ones only where the bodies really overlap."""
    every = segments(over, under, joined=joined)
    deep = is_deep(over, under, every)
    facets = np.unique(every.slave[deep])
    beside = over.centre[facets] + BESIDE * over.radius[facets, None] * over.normal[facets]
    counts = ~deep | np.isin(every.slave, facets[inside(master, beside)])
    return nearest(over, every.at(counts))


def is_deep(slave: Surface, master: Surface, every: Segments) -> Mask:
    """Segments (k,) that overlap by more than the larger facet: perhaps through the body."""
    size = np.maximum(slave.radius[every.slave], master.radius[every.master])
    return every.gap < -DEEP * size


def nearest(slave: Surface, every: Segments) -> Segments:
    """Without the parts behind others: the nearest segments that cover each facet once."""
    order = np.lexsort((np.abs(every.gap), every.slave))
    area = every.area[order]
    covered = np.cumsum(area)
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.diff(every.slave[order]) > 0
    before = np.maximum.accumulate(np.where(first, covered - area, 0.0))
    spare = TWICE_CURVED if slave.curved else TWICE
    kept = covered - before <= (1 + spare) * slave.area[every.slave[order]]
    return every.at(np.sort(order[kept]))


def _padded(nodes: Index, width: int) -> Index:
    missing = width - nodes.shape[1]
    return np.concatenate([nodes, np.repeat(nodes[:, -1:], missing, axis=1)], axis=1)


def _joined(parts: list[Segments], slave: Surface, master: Surface) -> Segments:
    none = np.zeros(0, dtype=np.int64)
    square, own, cross = (
        np.zeros((0, MAX_NODES, w))
        for w in (MAX_NODES, slave.all.shape[1], master.all.shape[1])
    )
    empty = Segments(
        none, none, square, own, cross, np.zeros((0, MAX_NODES)), np.zeros(0), np.zeros(0),
        np.zeros((0, 2)),
    )  # fmt: skip
    every = [empty, *parts]
    return Segments(
        *(np.concatenate([getattr(part, one.name) for part in every]) for one in fields(empty))
    )


# -------------------------------------------------------------------- search
def _candidates(
    slave: Surface, master: Surface, within: Array | None
) -> Iterator[tuple[Index, Index]]:
    """Pairs of facets that may face each other, a chunk of slave facets at a time."""
    from scipy.spatial import cKDTree

    nodes = np.unique(master.nodes)
    normals = nodal_normals(master.points, master.blocks)[nodes]
    tree = cKDTree(master.points[nodes])
    label = np.floor(np.log2(master.radius))
    classes = [np.flatnonzero(label == value) for value in np.unique(label)]
    trees = [(cKDTree(master.centre[c]), c, master.radius[c].max()) for c in classes]
    for start in range(0, len(slave.nodes), CHUNK):
        chunk = np.arange(start, min(start + CHUNK, len(slave.nodes)))
        foot, beside = slave.centre[chunk], np.zeros(0)
        if within is None:
            foot, beside = feet(foot, slave.normal[chunk], tree, normals)
        reach = 2 * slave.radius[chunk] + (beside if within is None else within[chunk])
        for centres, members, size in trees:
            lists = centres.query_ball_point(foot, reach + size, return_sorted=True)
            counts = np.array([len(one) for one in lists])
            if not counts.any():
                continue
            facet = members[np.concatenate([np.asarray(f, dtype=np.int64) for f in lists if f])]
            of = np.repeat(chunk, counts)
            cosine = np.einsum("kc,kc->k", slave.normal[of], master.normal[facet])
            facing = cosine < -EDGEWISE
            yield of[facing], facet[facing]


def feet(centre: Array, normal: Array, tree: cKDTree, normals: Array) -> tuple[Array, Array]:
    """Points (k, dim) in front of the facets about where the other side is; by how much beside.

    The closest node that faces the facet gives the depth, then the one closest to that point.
    """
    foot, beside = centre, np.zeros(len(centre))
    for _ in range(2):
        distance, near = tree.query(foot, k=min(AROUND, tree.n))
        distance, near = distance.reshape(len(foot), -1), near.reshape(len(foot), -1)
        faces = np.einsum("kjc,kc->kj", normals[near], normal) < 0
        first = np.where(faces.any(axis=1), faces.argmax(axis=1), faces.shape[1] - 1)
        node = tree.data[near[np.arange(len(near)), first]]
        depth = np.einsum("kc,kc->k", node - centre, normal)
        foot = centre + depth[:, None] * normal
        beside = np.linalg.norm(node - foot, axis=1)
    return foot, beside


# -------------------------------------------------------------------- integrals
def _summed(
    slave: Surface, master: Surface, of: Index, facet: Index, parts: Cuts
) -> Segments:
    """Integrals of the pairs that have a segment."""
    pair, weight = parts.pair, parts.weight
    phi, psi = (
        functions(KINDS[side.corners[which].max(initial=2) - 2], at)
        for side, which, at in ((slave, of, parts.at), (master, facet, parts.opposite))
    )
    k, n = len(of), phi.shape[2]
    mass = np.zeros((k, MAX_NODES, MAX_NODES))
    apart = np.zeros((k, MAX_NODES))
    weighted = np.swapaxes(weight[:, :, None] * phi, 1, 2)
    np.add.at(mass[:, :n, :n], pair, weighted @ phi)
    own = _with(slave, of, pair, weighted, phi, parts.at) if slave.is_second else mass
    cross = _with(master, facet, pair, weighted, psi, parts.opposite)
    far = distances(slave, master, of, facet, parts)
    np.add.at(apart[:, :n], pair, (weighted @ far[:, :, None])[..., 0])
    area = mass.sum(axis=(1, 2))
    on_slave = np.einsum("ka,kac->kc", own.sum(axis=1), slave.points[slave.all[of]])
    on_master = np.einsum("kb,kbc->kc", cross.sum(axis=1), master.points[master.all[facet]])
    gap = np.einsum("kc,kc->k", on_master - on_slave, slave.normal[of])
    gap /= np.where(area > 0, area, 1.0)
    between = np.broadcast_to([-np.inf, np.inf], (k, 2))
    if slave.is_second and len(pair):
        between = np.stack([np.full(k, np.inf), np.full(k, -np.inf)], axis=1)
        np.minimum.at(between[:, 0], pair, far.min(axis=1))
        np.maximum.at(between[:, 1], pair, far.max(axis=1))
    return Segments(of, facet, mass, own, cross, apart, area, gap, between).at(area > 0)


def _with(
    side: Surface, facets: Index, pair: Index, weighted: Array, phi: Array, at: Array
) -> Array:
    """Sums (k, 4, w) of weighted (t, n, q) with the displacement's functions of facets (k,).

    phi (t, q, a): functions of first order there, at (t, q, dim - 1).
    """
    out = np.zeros((len(facets), MAX_NODES, side.all.shape[1]))
    kind = SIDES[int(side.kind[facets].max(initial=0))] if len(facets) else "line"
    values = phi if kind in KINDS else functions(kind, at)
    np.add.at(out[:, : weighted.shape[1], : values.shape[2]], pair, weighted @ values)
    return out


def _outside(side: Surface, facets: Index, values: Array) -> Array:
    """Vectors (t, q, dim) from facets (t,) to the curved surface; values (t, q, a): phi."""
    n = values.shape[2]
    x, slope = side.points[side.nodes[facets, :n]], side.slopes[facets, :n]
    return heights(values, slope, x)[:, :, None] * side.normal[facets, None]


def bulge(side: Surface, facet: Index, shape: Array) -> Array:
    """Vectors (q, dim) from points of facets (q,) to the curved surface; shape (q, 4): phi.

    They are zero where nodes between the corners tell the surface.
    """
    out = np.zeros((len(facet), side.points.shape[1]))
    for n in np.unique(side.corners[facet]):
        mine = side.corners[facet] == n
        out[mine] = _outside(side, facet[mine], shape[mine, None, :n])[:, 0]
    return out
