"""Where the outsides of parts are near: facets that may meet, how far apart, how much overlap.

Parts are what is connected in a mesh: what is glued does not touch.  Facets of two parts meet
where one lies in front of the other, at most a given distance away, or overlaps it by less than
its size; the parts of facets and their distances are those of mortar contact (`segments`).
What meets is then widened to the smooth faces that it belongs to, as far as twice its own size:
these are the surfaces that somebody would name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.facets import Facets, corner_facets
from ..meshes.mesh import Mesh
from .pairs import DEEP, project
from .segments import Segments, Surface, nearest, segments

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Allowed = Callable[[Index, Index], Mask]  # facets of one and of the other side, (k,) each
SMOOTH = 0.7  # cosine between normals above which facets side by side are of one face
NONE = 1e-6  # of a facet: an overlap below this is rounding
ON_AXIS = 1e-12  # of the largest radius: facets on the axis of a body of revolution


@dataclass(frozen=True)
class Reach:
    """How far apart facets may be that meet: `gap`, or else the larger radius; and `more`."""

    gap: float | None = None
    more: float = 0.0

    def of(self, size: Array) -> Array:
        """The largest distance of facets of some size (k,)."""
        return (size if self.gap is None else np.full(size.shape, self.gap)) + self.more


@dataclass(frozen=True, eq=False)
class Skin:
    """The outer facets of one body in one table: f facets with nodes padded by their last.

    corners (f, 4); centre, normal (f, dim); radius (f,); part (f,): connected part of the mesh;
    block, row (f,): where in `mesh.boundary`.
    """

    mesh: Mesh
    corners: Index
    centre: Array
    normal: Array
    radius: Array
    part: Index
    block: Index
    row: Index

    @classmethod
    def of(cls, mesh: Mesh, part: Index) -> Skin:
        """part (n,): the number of the connected part of each node."""
        rows = [np.flatnonzero(_off_axis(mesh, b)) for b in mesh.boundary]
        facets = tuple(
            Facets(b.kind, b.nodes[k]) for b, k in zip(mesh.boundary, rows, strict=True)
        )
        block = np.concatenate([np.full(len(row), k) for k, row in enumerate(rows)])
        row = np.concatenate(rows)
        whole = Surface.of(mesh.points, facets, "outside")
        return cls(mesh, whole.nodes, whole.centre, whole.normal, whole.radius,
                   part[whole.nodes[:, 0]], block, row)  # fmt: skip

    def facets(self, chosen: Index) -> tuple[Facets, ...]:
        """The chosen ones (k,) as blocks of the mesh, in the order of `in_order`."""
        out = []
        for number, block in enumerate(self.mesh.boundary):
            rows = self.row[chosen[self.block[chosen] == number]]
            if len(rows):
                out.append(Facets(block.kind, block.nodes[rows]))
        return tuple(out)

    def surface(self, chosen: Index) -> Surface:
        """Chosen facets (k,), in order; each smooth face has nodes, so normals, of its own."""
        facets, n = self.facets(chosen), len(self.mesh.points)
        ends = np.cumsum([len(block.nodes) for block in facets])[:-1]
        faces = np.split(self.face[chosen], ends)
        keys = [f[:, None] * n + b.nodes for b, f in zip(facets, faces, strict=True)]
        flat = np.concatenate([k.ravel() for k in keys])
        every, place = np.unique(flat, return_inverse=True)
        places = np.split(place.ravel(), np.cumsum([k.size for k in keys])[:-1])
        blocks = tuple(
            Facets(b.kind, p.reshape(b.nodes.shape))
            for b, p in zip(facets, places, strict=True)
        )
        return Surface.of(self.mesh.points[every % n], blocks, "outside",
                          axisymmetric=self.mesh.axisymmetric)  # fmt: skip

    def holds(self, facets: tuple[Facets, ...]) -> Mask:
        """Which of all outer facets are among some of the mesh, (f,)."""
        n = len(self.mesh.points)
        own = _keys(self.corners, n)
        given = [_keys(corner_facets(b).nodes, n) for b in facets if len(b.nodes)]
        return np.isin(own, np.concatenate(given) if given else [])

    def in_order(self, chosen: Index) -> Index:
        """Chosen facets (k,) in the order in which `facets` has them."""
        return chosen[np.argsort(self.block[chosen], kind="stable")]

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Smallest and largest coordinates of each facet, (f, dim)."""
        x = self.mesh.points[self.corners]
        return x.min(axis=1), x.max(axis=1)

    @cached_property
    def face(self) -> Index:
        """The number of the smooth face of each facet, (f,)."""
        from scipy.sparse import csgraph

        one, other = self._beside
        smooth = np.einsum("kc,kc->k", self.normal[one], self.normal[other]) > SMOOTH
        one, other = one[smooth], other[smooth]
        f = len(self.corners)
        graph = sparse.coo_array((np.ones(len(one)), (one, other)), shape=(f, f))
        return csgraph.connected_components(graph, directed=False)[1]

    @cached_property
    def _beside(self) -> tuple[Index, Index]:
        """Pairs of facets that share a side, in 2D a node."""
        f, n = len(self.corners), len(self.mesh.points)
        if self.mesh.dim == 2:
            side, facet = self.corners[:, :2].ravel(), np.repeat(np.arange(f), 2)
        else:
            after = np.roll(self.corners, -1, axis=1)
            low, high = np.minimum(self.corners, after), np.maximum(self.corners, after)
            real = low != high  # triangles repeat their last node
            side = (low * n + high)[real]
            facet = np.broadcast_to(np.arange(f)[:, None], real.shape)[real]
        order = np.argsort(side, kind="stable")
        side, facet = side[order], facet[order]
        same = np.flatnonzero(side[1:] == side[:-1])
        return facet[same], facet[same + 1]

    def box_of(self, chosen: Index | Mask) -> tuple[Array, Array]:
        """The box around some facets."""
        low, high = self.boxes
        return low[chosen].min(axis=0), high[chosen].max(axis=0)

    def inside(self, low: Array, high: Array) -> Mask:
        """Facets (f,) that reach into a box."""
        least, most = self.boxes
        return np.all((most >= low) & (least <= high), axis=1)


def _keys(corners: Index, n: int) -> Index:
    """A number for each facet: of its two smallest corners and the largest one."""
    ranked = np.sort(corners, axis=1)
    return (ranked[:, 0] * n + _second(ranked)) * n + ranked[:, -1]


def _second(ranked: Index) -> Index:
    """The smallest corner above the first, of sorted rows; facets share no three corners."""
    return np.where(ranked > ranked[:, :1], ranked, ranked[:, -1:]).min(axis=1)


def _off_axis(mesh: Mesh, block: Facets) -> Mask:
    """Facets that have an area where the mesh goes around an axis."""
    if not mesh.axisymmetric:
        return np.ones(len(block.nodes), dtype=bool)
    x = mesh.points[block.nodes, 0]
    return x.max(axis=1) > ON_AXIS * mesh.points[:, 0].max()


def meetings_within(skin: Skin, part: int, reach: Reach, allowed: Allowed) -> list[Meeting]:
    """Where a part meets itself: one meeting for each two smooth faces, or halves of one.

    Facets that share a node do not meet, nor do those that see each other through the body.
    """
    rows = skin.in_order(np.flatnonzero(skin.part == part))
    side = Surface.of(skin.mesh.points, skin.facets(rows), "outside",
                      axisymmetric=skin.mesh.axisymmetric)  # fmt: skip
    found = segments(side, side, joined=True, within=reach.of(side.radius))
    counts = _counts(side, side, found, reach) & ~_through(side, found, distances(side, found))
    counts &= allowed(rows[found.slave], rows[found.master])
    found = nearest(side, found.at(counts))
    if not len(found.slave):
        return []
    apart = distances(side, found)
    half = _halves(skin, rows, found)
    out = []
    both = np.stack([half[found.slave], half[found.master]], axis=1)
    for a, b in np.unique(np.sort(both, axis=1), axis=0):
        chosen = (both[:, 0] == a) & (both[:, 1] == b)
        if not chosen.any():
            continue
        met = (rows[np.unique(found.slave[chosen])], rows[np.unique(found.master[chosen])])
        least = float(apart[chosen].min())
        out.append(Meeting(met, met, float(found.area[chosen].sum()), max(least, 0.0),
                           max(-least, 0.0)))  # fmt: skip
    return out


def _through(side: Surface, found: Segments, apart: Array) -> Mask:
    """Segments (k,) whose sides overlap: back to back through the body, not in front of it."""
    return apart < -NONE * side.radius[found.slave]


def _halves(skin: Skin, rows: Index, found: Segments) -> Index:
    """A number for each of the facets rows (k,): even ones and odd ones face each other.

    Smooth faces are coloured one after another; where two facets of one face meet, that face
    falls into two halves: facets side by side are of one, facets opposite of different ones.
    """
    face = skin.face[rows]
    own = face[found.slave] == face[found.master]
    place = np.full(len(skin.corners), -1)
    place[rows] = np.arange(len(rows))
    met = np.zeros(len(rows), dtype=bool)
    met[found.slave[own]] = met[found.master[own]] = True
    one, other = (place[x] for x in skin._beside)
    beside = (one >= 0) & (other >= 0) & met[one] & met[other]
    beside &= face[one] == face[other]
    links: dict[int, list[tuple[int, int]]] = {}
    for a, b, way in (
        *((int(a), int(b), 0) for a, b in zip(one[beside], other[beside], strict=True)),
        *((int(a), int(b), 1) for a, b in
          zip(found.slave[own], found.master[own], strict=True)),
    ):  # fmt: skip
        links.setdefault(a, []).append((b, way))
        links.setdefault(b, []).append((a, way))
    colour = np.full(len(rows), -1)
    for first in np.flatnonzero(met):
        if colour[first] >= 0:
            continue
        colour[first], todo = 0, [int(first)]
        while todo:
            here = todo.pop()
            for there, way in sorted(links.get(here, ()), key=lambda link: -link[1]):
                if colour[there] < 0:
                    colour[there] = colour[here] ^ way
                    todo.append(there)
    return 2 * face + np.maximum(colour, 0)


@dataclass(frozen=True, eq=False)
class Meeting:
    """Where two parts meet: facets of both sides (k,), and what lies between them.

    near: those that lie in front of one another; faces: with the smooth faces around them.
    area: of what lies opposite; gap, overlap: the smallest distance and the largest depth >= 0,
    averages over pieces of facets.
    """

    near: tuple[Index, Index]
    faces: tuple[Index, Index]
    area: float
    gap: float
    overlap: float


def close_parts(skins: list[Skin], reach: Reach) -> Iterator[tuple[int, int, int, int]]:
    """(body, part, body, part) whose boxes are within reach of each other."""
    every = [(k, int(p)) for k, skin in enumerate(skins) for p in np.unique(skin.part)]
    boxes, sizes = [], []
    for k, p in every:
        own = skins[k].part == p
        boxes.append(np.stack(skins[k].box_of(own)))
        sizes.append(skins[k].radius[own].max())
    low, high = np.stack(boxes).swapaxes(0, 1)
    far = reach.of(np.array(sizes))
    for i in range(len(every)):
        more = np.maximum(far[i], far[i + 1 :])[:, None]
        apart = (low[i + 1 :] - high[i] > more) | (low[i] - high[i + 1 :] > more)
        for j in np.flatnonzero(~apart.any(axis=1)):
            yield (*every[i], *every[i + 1 + j])


def meeting(
    one: Skin, other: Skin, parts: tuple[int, int], reach: Reach, allowed: Allowed
) -> Meeting | None:
    """Where part parts[0] of one meets part parts[1] of other, None where they do not.

    allowed: which pairs of facets may meet.
    """
    near = _candidates((one, other), parts, reach)
    if not all(len(chosen) for chosen in near):
        return None
    over, under = (
        skin.surface(chosen) for skin, chosen in zip((one, other), near, strict=True)
    )
    found = segments(over, under)
    counts = _counts(over, under, found, reach)
    counts &= allowed(near[0][found.slave], near[1][found.master])
    found = nearest(over, found.at(counts))
    if not len(found.slave):
        return None
    apart = distances(over, found)
    met = (near[0][np.unique(found.slave)], near[1][np.unique(found.master)])
    return Meeting(
        met, _widened((one, other), met, allowed), float(found.area.sum()),
        max(float(apart.min()), 0.0), max(float(-apart.min()), 0.0),
    )  # fmt: skip


def distances(slave: Surface, found: Segments) -> Array:
    """Mean distance of the curved sides of each segment, (k,), < 0 where they overlap."""
    apart = found.apart.sum(axis=1) / found.area
    apart[np.abs(apart) < NONE * slave.radius[found.slave]] = 0.0
    return apart


def _candidates(
    skins: tuple[Skin, Skin], parts: tuple[int, int], reach: Reach
) -> tuple[Index, Index]:
    """Facets of both parts that may be near one another."""
    from scipy.spatial import cKDTree

    own = [np.flatnonzero(skin.part == p) for skin, p in zip(skins, parts, strict=True)]
    sizes = [skin.radius[rows].max() for skin, rows in zip(skins, own, strict=True)]
    far = float(max(*reach.of(np.array(sizes)), *(DEEP * size for size in sizes)))
    boxes = [skin.box_of(rows) for skin, rows in zip(skins, own, strict=True)]
    low = np.max([low for low, _ in boxes], axis=0) - far
    high = np.min([high for _, high in boxes], axis=0) + far
    chosen = [rows[skin.inside(low, high)[rows]] for skin, rows in zip(skins, own, strict=True)]
    if not (len(chosen[0]) and len(chosen[1])):
        return chosen[0], chosen[1]
    out = []
    for k, skin in enumerate(skins):
        mine, theirs = chosen[k], chosen[1 - k]
        distance, _ = cKDTree(skins[1 - k].centre[theirs]).query(skin.centre[mine])
        out.append(skin.in_order(mine[distance <= skin.radius[mine] + sizes[1 - k] + far]))
    return out[0], out[1]


def _counts(slave: Surface, master: Surface, found: Segments, reach: Reach) -> Mask:
    """Segments (k,) near enough, and not through a body."""
    size = np.maximum(slave.radius[found.slave], master.radius[found.master])
    apart = distances(slave, found)
    counts = (apart <= reach.of(size) + NONE * size) & (apart >= -DEEP * size)
    below = np.flatnonzero(counts & (apart < 0))
    if len(below):
        on_slave = np.einsum(
            "ka,kac->kc", found.own[below].sum(axis=1),
            slave.points[slave.all[found.slave[below]]],
        ) / found.area[below, None]  # fmt: skip
        hit = project(on_slave, master.points, master.blocks)
        behind = np.einsum("kc,kc->k", on_slave - hit.closest, hit.normal) < NONE * size[below]
        counts[below] = behind  # in front of what is closest: seen through a thin body
    return counts


def _widened(
    skins: tuple[Skin, Skin], met: tuple[Index, Index], allowed: Allowed
) -> tuple[Index, Index]:
    """What meets, and the smooth faces around it as far as its own size."""
    boxes = [skin.box_of(chosen) for skin, chosen in zip(skins, met, strict=True)]
    low = np.min([low for low, _ in boxes], axis=0)
    high = np.max([high for _, high in boxes], axis=0)
    far = float(np.linalg.norm(high - low))
    out = []
    for k, (skin, chosen) in enumerate(zip(skins, met, strict=True)):
        own = np.isin(skin.face, np.unique(skin.face[chosen]))
        own &= (skin.part == skin.part[chosen[0]]) & skin.inside(low - far, high + far)
        rows = np.flatnonzero(own)
        opposite = np.full(len(rows), met[1 - k][0])
        rows = rows[allowed(*((rows, opposite) if k == 0 else (opposite, rows)))]
        out.append(np.union1d(rows, chosen))
    return out[0], out[1]
