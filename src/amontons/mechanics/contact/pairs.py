"""Contact between two surfaces: every slave node meets the closest point of a master facet.

Node to facet: with the shape functions N_a of the facet at the closest point,

    u = R (v_slave - sum_a N_a v_a) + [gap, 0, 0],   R rows n, t1(, t2),

n being the facet's outward normal there, from master to slave.  Small strains: pairs, gaps and
normals are taken once, in the reference configuration.

Meshes that match pass the patch test exactly, others up to the size of the facets; see `mortar`
for what does better.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..meshes.facets import Facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_normals, nodal_normals
from .geometry import frames
from .nodal import ContactRows, check_exterior, contact_columns, contact_nodes
from .overlap import check_different, inside, not_facing

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
BESIDE = 1e-3  # a projection may lie this far beside its facet, relative to the facet's size
EDGEWISE = (
    0.1  # cosine of the angle between normals below which surfaces do not face each other
)
DEEP = 1.0  # an overlap deeper than this part of the facet is the far side of a body
NEWTON = 20  # steps to the closest point of a warped quadrilateral; a flat one takes few
ON_EDGE = 1e-9  # shape functions below this vanish: the closest point lies on an edge
KINDS = ("line", "tri", "quad")
MAX_NODES = 4  # of a facet
AROUND = 16  # closest nodes among which one must lie on a facet that counts


@dataclass(frozen=True, eq=False)
class Projection:
    """Closest facet of every point: found (k,); the rest (k, …) holds where found.

    facet (k,): counted through the blocks; nodes (k, 4) and shape (k, 4): nodes of the facet
    and their shape functions, padded with weight zero; closest (k, dim); normal (k, dim), unit,
    outwards; size (k,) of the facet; beside (k,): how far beside it the point is; deep (k,):
    some facet lies too far in front of the point, see `project`.
    """

    found: Mask
    facet: Index
    nodes: Index
    shape: Array
    closest: Array
    normal: Array
    size: Array
    beside: Array
    deep: Mask


def pair_contact(
    slave: Mesh,
    surface: str,
    master: Mesh,
    master_surface: str,
    *,
    search: float = np.inf,
) -> tuple[ContactRows, sparse.csc_array, Mask]:
    """Contacts of slave nodes with a master surface: rows, their part on the master, and found.

    rows.H is in the dofs of the slave mesh, the second matrix (n_master, nc d) in those of the
    master; H is their sum on the whole.  found, (slave nodes,): nodes with a facet in front of
    them, not farther away than `search`; only these have rows.  Nodes inside the master body
    have one however deep they are.  Raises InvalidInput when the surfaces do not face each
    other, and when they share facets.  Cost linear in the nodes.
    """
    nodes, weights, hit = meeting(slave, surface, master, master_surface, search)
    points = slave.points[nodes]
    found = hit.found
    if not found.any():
        raise not_facing(slave, surface, master, master_surface)
    points, normal = points[found], hit.normal[found]
    gap = np.einsum("ic,ic->i", points - hit.closest[found], normal)
    axes = frames(normal)
    rows = ContactRows(
        nodes[found], points, weights[found], gap, axes,
        contact_columns(nodes[found], axes, slave.points.size),
    )  # fmt: skip
    return rows, _master_columns(hit, axes, master.points.size), found


def meeting(
    slave: Mesh, surface: str, master: Mesh, master_surface: str, search: float = np.inf
) -> tuple[Index, Array, Projection]:
    """Slave nodes (k,), their weights (k,), and the master facets that they meet, checked."""
    check_exterior(slave, surface)
    check_exterior(master, master_surface, "master")
    check_different(slave, surface, master, master_surface)
    nodes, weights = contact_nodes(slave, surface)
    facets = master.surface(master_surface)
    if other := {block.kind for block in facets} - set(KINDS):
        raise InvalidInput(
            f"expected facets of first order for nodal contact, got {other.pop()!r}; take "
            'method="mortar" or "nitsche"', ("master",), f"master {master_surface!r}",
        )  # fmt: skip
    points = slave.points[nodes]
    normals = nodal_normals(slave.points, slave.surface(surface))[nodes]
    own = nodes if slave is master else None
    hit = project(points, master.points, facets, facing=normals, search=search, own=own)
    if hit.deep.any():
        overlap = np.zeros(len(slave.points), dtype=bool)
        for node, ahead in _ahead(slave, surface, nodes[hit.deep]):
            np.logical_or.at(overlap, node, inside(master, ahead))
        hit = project(points, master.points, facets, facing=normals, search=search, own=own,
                      free=overlap[nodes])  # fmt: skip
    return nodes, weights, hit


def _ahead(mesh: Mesh, surface: str, nodes: Index) -> Iterator[tuple[Index, Array]]:
    """Some of these nodes, and points a little in front of a facet of each, off its sides."""
    wanted = np.zeros(len(mesh.points), dtype=bool)
    wanted[nodes] = True
    for block in mesh.surface(surface):
        x = mesh.points[block.nodes]
        inwards = x.mean(axis=1, keepdims=True) - x
        ahead = _unit(facet_normals(mesh.points, block))[:, None]
        ahead = x + BESIDE * (inwards + np.linalg.norm(inwards, axis=2)[:, :, None] * ahead)
        for slot, node in enumerate(block.nodes.T):
            yield node[wanted[node]], ahead[wanted[node], slot]


def _master_columns(hit: Projection, axes: Array, size: int) -> sparse.csc_array:
    """Minus the motion of the closest points, in the columns of their contacts."""
    out = sparse.csc_array((size, axes.shape[0] * axes.shape[1]))
    for a in range(MAX_NODES):
        weight = hit.shape[hit.found, a]
        part = contact_columns(hit.nodes[hit.found, a], -weight[:, None, None] * axes, size)
        part.eliminate_zeros()
        out = out + part
    return out


def project(
    points: Array,
    coordinates: Array,
    surface: tuple[Facets, ...],
    *,
    facing: Array | None = None,
    search: float = np.inf,
    own: Index | None = None,
    free: Mask | None = None,
) -> Projection:
    """Closest points of a surface whose nodes have the given coordinates, (n, dim).

    facing, (k, dim): outward normals at the points; only facets that look at them count, and
    points behind a facet by more than its size see none.
    own, (k,): nodes that are the points themselves; their facets do not count.
    free, (k,): points that may be behind facets by any distance.
    """
    k, dim = points.shape
    best, facet_of = np.full(k, np.inf), np.zeros(k, dtype=np.int64)
    nodes = np.zeros((k, MAX_NODES), dtype=np.int64)
    shape = np.zeros((k, MAX_NODES))
    closest, normal = np.zeros((k, dim)), np.zeros((k, dim))
    length, beside = np.ones(k), np.full(k, np.inf)
    deep, free = np.zeros(k, dtype=bool), np.zeros(k, dtype=bool) if free is None else free
    reach = _reach(points, coordinates, surface, facing, own)
    for facets, members, size in _by_size(coordinates, surface):
        point, facet = _candidates(points, coordinates, facets, reach + size)
        if own is not None:
            keep = (facets.nodes[facet] != own[point, None]).all(axis=1)
            point, facet = point[keep], facet[keep]
        if not point.size:
            continue
        x = coordinates[facets.nodes[facet]]
        at, n = _closest(points[point], x, facets.kind)
        value = shapes(facets.kind, at)
        foot = np.einsum("ka,kac->kc", value, x)
        across = points[point] - foot
        distance = np.linalg.norm(across, axis=1)
        if facing is not None:
            distance[np.einsum("kc,kc->k", n, facing[point]) > -EDGEWISE] = np.inf
        behind = np.einsum("kc,kc->k", across, n) < -DEEP * size
        deep[point[behind & np.isfinite(distance)]] = True
        distance[behind & ~free[point]] = np.inf
        chosen = _first_of_smallest(point, distance)
        chosen = chosen[distance[chosen] < best[point[chosen]]]
        to, count = point[chosen], value.shape[1]
        best[to], facet_of[to] = distance[chosen], members[facet[chosen]]
        nodes[to], shape[to] = 0, 0.0
        nodes[to, :count], shape[to, :count] = facets.nodes[facet[chosen]], value[chosen]
        closest[to], normal[to] = foot[chosen], n[chosen]
        along = across - np.einsum("kc,kc->k", across, n)[:, None] * n
        length[to], beside[to] = size, np.linalg.norm(along[chosen], axis=1)
    found = (
        np.isfinite(best)
        & (best <= search)
        & ~((beside > BESIDE * length) & _on_rim(surface, nodes, shape))
    )
    return Projection(found, facet_of, nodes, shape, closest, normal, length, beside, deep)


def _on_rim(surface: tuple[Facets, ...], nodes: Index, shape: Array) -> Mask:
    """Points (k,) whose closest point lies on the rim of the surface, not on an inner ridge."""
    on = shape > ON_EDGE
    if all(block.kind == "line" for block in surface):
        ends, times = np.unique(_joined(surface, 1), return_counts=True)
        return (on.sum(axis=1) == 1) & np.isin((nodes * on).sum(axis=1), ends[times == 1])
    edges = _joined(surface, 2)
    first = int(edges.max()) + 1  # (low, high) as one number
    keys, times = np.unique(edges.min(axis=1) * first + edges.max(axis=1), return_counts=True)
    rim = keys[times == 1]
    low = np.where(on, nodes, first).min(axis=1)
    high = np.where(on, nodes, -1).max(axis=1)
    corner = (on.sum(axis=1) == 1) & np.isin(low, np.concatenate([rim // first, rim % first]))
    return corner | ((on.sum(axis=1) == 2) & np.isin(low * first + high, rim))


def _joined(surface: tuple[Facets, ...], count: int) -> Index:
    """All nodes of lines (count 1), or all edges of triangles and quadrilaterals (count 2)."""
    if count == 1:
        return np.concatenate([block.nodes.ravel() for block in surface])
    loops = [np.stack([b.nodes, np.roll(b.nodes, -1, axis=1)], axis=2) for b in surface]
    return np.concatenate([loop.reshape(-1, 2) for loop in loops])


def _reach(
    points: Array,
    coordinates: Array,
    surface: tuple[Facets, ...],
    facing: Array | None,
    own: Index | None,
) -> Array:
    """Distance to the closest node that counts, (k,): an upper bound of that to the surface.

    Among the AROUND closest; where none of them counts, the distance to the last of them.
    """
    from scipy.spatial import cKDTree

    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in surface]))
    distance, which = cKDTree(coordinates[nodes]).query(points, k=min(AROUND, len(nodes)))
    distance, near = distance.reshape(len(points), -1), nodes[which].reshape(len(points), -1)
    counts = np.ones(near.shape, dtype=bool)
    if facing is not None:
        normals = nodal_normals(coordinates, surface)
        counts &= np.einsum("kjc,kc->kj", normals[near], facing) < -EDGEWISE
    if own is not None:
        counts &= near != own[:, None]
    least = np.where(counts, distance, np.inf).min(axis=1)
    return np.where(np.isfinite(least), least, distance[:, -1])


def _by_size(
    coordinates: Array, surface: tuple[Facets, ...]
) -> Iterator[tuple[Facets, Index, float]]:
    """Facets in classes of kind and size, their numbers, the largest distance to the centre.

    One class spans a factor two, so that a few large facets do not widen every search.
    """
    before = 0
    for block in surface:
        if not len(block.nodes):
            continue
        x = coordinates[block.nodes]
        radius = np.linalg.norm(x - x.mean(axis=1, keepdims=True), axis=2).max(axis=1)
        label = np.floor(np.log2(radius))
        for value in np.unique(label):
            members = np.flatnonzero(label == value)
            inside = Facets(block.kind, block.nodes[members])
            yield inside, before + members, float(radius[members].max())
        before += len(block.nodes)


def _candidates(
    points: Array, coordinates: Array, facets: Facets, reach: Array
) -> tuple[Index, Index]:
    """Pairs (point, facet) with the facet's centre within reach."""
    from scipy.spatial import cKDTree

    tree = cKDTree(coordinates[facets.nodes].mean(axis=1))
    lists = tree.query_ball_point(points, reach * (1 + 1e-9), return_sorted=True)
    counts = np.array([len(found) for found in lists], dtype=np.int64)
    facet = np.concatenate([np.asarray(f, dtype=np.int64) for f in lists if f] or [[]])
    return np.repeat(np.arange(len(points)), counts), facet.astype(np.int64)


def _first_of_smallest(group: Index, value: Array) -> Index:
    """For every group the position of its smallest value, the first among equal ones."""
    order = np.lexsort((np.arange(len(group)), value, group))
    first = np.concatenate([[True], np.diff(group[order]) > 0])
    return order[first]


def shapes(kind: str, at: Array) -> Array:
    """Shape functions at one reference point per facet, (k, nodes)."""
    if kind == "line":
        return np.concatenate([1 - at, at], axis=1)
    a, b = at[:, 0], at[:, 1]
    if kind == "tri":
        return np.stack([1 - a - b, a, b], axis=1)
    return np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)


def _closest(points: Array, x: Array, kind: str) -> tuple[Array, Array]:
    """Reference coordinates of the closest points of facets x (k, nodes, dim), and normals."""
    if kind == "line":
        edge = x[:, 1] - x[:, 0]
        at = np.einsum("kc,kc->k", points - x[:, 0], edge) / np.einsum("kc,kc->k", edge, edge)
        normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        return np.clip(at, 0, 1)[:, None], _unit(normal)
    if kind == "tri":
        at = _on_triangle(points, x)
        return at, _unit(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))
    at = _on_quadrilateral(points, x)
    a, b = _slopes(x, at)
    return at, _unit(np.cross(a, b))


def _on_triangle(points: Array, x: Array) -> Array:
    """The closest point: inside, or on the nearest edge."""
    a, b, from_corner = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], points - x[:, 0]
    aa, ab, bb = (np.einsum("kc,kc->k", p, q) for p, q in ((a, a), (a, b), (b, b)))
    pa, pb = np.einsum("kc,kc->k", from_corner, a), np.einsum("kc,kc->k", from_corner, b)
    det = aa * bb - ab**2
    s, t = (pa * bb - pb * ab) / det, (pb * aa - pa * ab) / det
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    edges = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = x[:, j] - x[:, i]
        share = np.einsum("kc,kc->k", points - x[:, i], edge)
        share = np.clip(share / np.einsum("kc,kc->k", edge, edge), 0, 1)
        weights = np.zeros((len(x), 3))
        weights[:, i], weights[:, j] = 1 - share, share
        edges.append(weights)
    weights = np.stack(edges, axis=1)  # (k, edge, node)
    distance = np.linalg.norm(np.einsum("kea,kac->kec", weights, x) - points[:, None], axis=2)
    nearest = weights[np.arange(len(x)), distance.argmin(axis=1)]
    return np.where(inside[:, None], np.stack([s, t], axis=1), nearest[:, 1:])


def _on_quadrilateral(points: Array, x: Array) -> Array:
    """The closest point by Gauss-Newton steps inside [0, 1]^2, started on the two triangles."""
    halves = [_on_triangle(points, x[:, [0, 1, 2]]), _on_triangle(points, x[:, [0, 2, 3]])]
    starts = [np.stack([h[:, 0] + h[:, 1], h[:, 1]], axis=1) for h in halves[:1]]
    starts.append(np.stack([halves[1][:, 0], halves[1].sum(axis=1)], axis=1))
    feet = [np.einsum("ka,kac->kc", shapes("quad", s), x) - points for s in starts]
    nearer = np.linalg.norm(feet[0], axis=1) <= np.linalg.norm(feet[1], axis=1)
    at = np.clip(np.where(nearer[:, None], *starts), 0, 1)
    for _ in range(NEWTON):
        a, b = _slopes(x, at)
        rest = points - np.einsum("ka,kac->kc", shapes("quad", at), x)
        new = _box_step(a, b, rest, at)
        moved = np.abs(new - at).max(initial=0.0)
        at = new
        if moved < 1e-14:
            break
    return at


def _box_step(a: Array, b: Array, rest: Array, at: Array) -> Array:
    """Minimum of |rest - a ds - b dt| over the unit square: inside or on a side."""
    aa, ab, bb = (np.einsum("kc,kc->k", p, q) for p, q in ((a, a), (a, b), (b, b)))
    ra, rb = np.einsum("kc,kc->k", rest, a), np.einsum("kc,kc->k", rest, b)
    det = aa * bb - ab**2
    s, t = at[:, 0], at[:, 1]
    free = (s + (ra * bb - rb * ab) / det, t + (rb * aa - ra * ab) / det)
    tries = [free]
    for end in (0.0, 1.0):
        tries.append((np.full_like(s, end), np.clip(t + (rb - ab * (end - s)) / bb, 0, 1)))
        tries.append((np.clip(s + (ra - ab * (end - t)) / aa, 0, 1), np.full_like(t, end)))
    out, least = at, np.full(len(s), np.inf)
    for s_new, t_new in tries:
        ds, dt = s_new - s, t_new - t
        value = aa * ds**2 + 2 * ab * ds * dt + bb * dt**2 - 2 * (ra * ds + rb * dt)
        ok = (s_new >= 0) & (s_new <= 1) & (t_new >= 0) & (t_new <= 1) & (value < least)
        out = np.where(ok[:, None], np.stack([s_new, t_new], axis=1), out)
        least = np.where(ok, value, least)
    return out


def _slopes(x: Array, at: Array) -> tuple[Array, Array]:
    """dx/ds and dx/dt of quadrilaterals, each (k, 3)."""
    s, t = at[:, :1], at[:, 1:]
    return (
        (1 - t) * (x[:, 1] - x[:, 0]) + t * (x[:, 2] - x[:, 3]),
        (1 - s) * (x[:, 3] - x[:, 0]) + s * (x[:, 2] - x[:, 1]),
    )


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
