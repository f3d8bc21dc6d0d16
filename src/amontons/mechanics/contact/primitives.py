"""Spheres, cones and cylinders (in 2D circles) on which the nodes of a surface lie.

Averaged normals tell a curved surface to fourth order in the size of its facets, and only to
second where facets are uneven; an overlap of a press fit may be a hundredth of what facets cut
off.  Where all nodes of a smooth part of a surface lie on one such shape, the surface is taken
to be that shape.  Cones hold cylinders; planes need none.

A shape is believed where no node is farther from it than NODES of what the largest facet cuts
off.  Nodes stay where they are: the surface is the shape moved by what the nodes of a facet
miss.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .geometry import frames

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SMOOTH = np.cos(np.radians(30))  # between normals of facets above which a surface goes on
NODES = 5e-3  # how far nodes may lie off, relative to what the largest facet cuts off
FLAT = 1e-9  # relative to its size: a part that lies closer to a plane is one
FEWEST = {2: 5, 3: 9}  # nodes of a part, by dimension: more than a shape has numbers
SAME = 1e-6  # angles around an axis that differ by less are one: three never tell a circle
SAMPLE = 2000  # nodes that a fit looks at; all are compared with it
STEPS = 30  # of Gauss-Newton
CONVERGED = 1e-14
NEWTON = 4  # steps along a line to a shape close by


@dataclass(frozen=True, eq=False)
class Shape:
    """A circle, sphere or cone; `side` is 1 where it bulges out of the body, else -1.

    point (dim,): its centre, or a point of the axis; axis (3,), unit, or None; radius at the
    point; taper: growth of the radius along the axis.
    """

    point: Array
    axis: Array | None
    radius: float
    taper: float = 0.0
    side: float = 1.0

    def distance(self, x: Array) -> tuple[Array, Array]:
        """Signed distance of points (..., dim), > 0 outside of the body; its slopes, unit."""
        out = x - self.point
        if self.axis is None:
            length = np.linalg.norm(out, axis=-1)
            slopes = out / np.where(length > 0, length, 1.0)[..., None]
            return self.side * (length - self.radius), self.side * slopes
        along = out @ self.axis
        out = out - along[..., None] * self.axis
        length = np.linalg.norm(out, axis=-1)
        slopes = out / np.where(length > 0, length, 1.0)[..., None] - self.taper * self.axis
        scale = self.side / np.sqrt(1 + self.taper**2)
        return scale * (length - self.radius - self.taper * along), scale * slopes

    def along(self, x: Array, direction: Array, to: Array) -> Array:
        """How far from points along unit vectors, both (..., dim), distances `to` (...) are."""
        far = np.zeros(x.shape[:-1])
        for _ in range(NEWTON):
            off, slopes = self.distance(x + far[..., None] * direction)
            rate = np.einsum("...c,...c->...", slopes, direction)
            far = far - (off - to) / np.where(np.abs(rate) > 0.05, rate, np.copysign(1.0, rate))
        return far


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shapes of a surface: of (f,), the one of each facet or -1; off (n,): of its nodes."""

    every: tuple[Shape, ...]
    of: Index
    off: Array


def shapes_of(points: Array, nodes: Index, corners: Index, normal: Array) -> Shapes:
    """The shapes of a surface with facets nodes (f, a), corners (f,), unit normals (f, dim)."""
    part = _parts(nodes, corners, normal)
    of, off, found = np.full(len(nodes), -1), np.zeros(len(points)), []
    real = np.arange(nodes.shape[1]) < corners[:, None]
    order = np.argsort(part, kind="stable")
    for facets in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        on = np.unique(nodes[facets])
        if len(on) < FEWEST[points.shape[1]] or _is_flat(points[on], normal[facets]):
            continue
        share = real[facets] / corners[facets][:, None]
        centre = np.einsum("fa,fac->fc", share, points[nodes[facets]])
        shape = _best(points[on], centre, normal[facets])
        if shape is None:
            continue
        of[facets] = len(found)
        found.append(shape)
        off[on] = shape.distance(points[on])[0]
    return Shapes(tuple(found), of, off)


def _parts(nodes: Index, corners: Index, normal: Array) -> Index:
    """Parts (f,) of facets that meet without an edge."""
    slot = np.arange(nodes.shape[1])
    if corners.max(initial=2) == 2:
        sides = nodes[:, :2].reshape(-1, 1)
        of = np.repeat(np.arange(len(nodes)), 2)
    else:
        after = np.where(slot + 1 < corners[:, None], slot + 1, 0)
        both = np.stack([nodes, np.take_along_axis(nodes, after, axis=1)], axis=2)
        real = slot < corners[:, None]
        sides, of = np.sort(both[real], axis=1), np.nonzero(real)[0]
    order = np.lexsort(sides.T)
    same = (sides[order][1:] == sides[order][:-1]).all(axis=1)
    first, second = of[order][:-1][same], of[order][1:][same]
    smooth = np.einsum("kc,kc->k", normal[first], normal[second]) > SMOOTH
    links = (np.ones(int(smooth.sum())), (first[smooth], second[smooth]))
    graph = sparse.coo_array(links, shape=(len(nodes), len(nodes)))
    return connected_components(graph, directed=False)[1]


def _is_flat(x: Array, normal: Array) -> bool:
    size = float(np.ptp(x, axis=0).max())
    heights = x @ normal[0]
    return float(np.ptp(heights)) <= FLAT * size


def _best(x: Array, centre: Array, normal: Array) -> Shape | None:
    """The shape on which nodes x (k, dim) lie; centre, normal (f, dim) of its facets.

    Cones first: two rings of nodes also lie on a sphere, but the sides between them do not.
    """
    size, middle = float(np.ptp(x, axis=0).max()), x.mean(axis=0)
    seen = (x - middle) / size
    seen = seen[:: max(1, len(x) // SAMPLE)]
    tries = []
    if x.shape[1] == 3:
        spread = normal - normal.mean(axis=0)
        for one in (normal, spread):
            tries.append(_cone(seen, np.linalg.eigh(one.T @ one)[1][:, 0]))
    for shape in (*tries, _round(seen)):
        if shape is None:
            continue
        slopes = shape.distance((centre - middle) / size)[1]
        side = np.sign(np.einsum("fc,fc->f", slopes, normal).sum())
        true = replace(shape, point=middle + size * shape.point, radius=size * shape.radius,
                       side=float(side))  # fmt: skip
        cut = np.abs(true.distance(centre)[0]).max()
        if side and np.abs(true.distance(x)[0]).max() <= NODES * cut:
            return true
    return None


def _round(x: Array) -> Shape | None:
    """The sphere or circle closest to points (k, dim), to first order."""
    matrix = np.column_stack([2 * x, np.ones(len(x))])
    found, *_ = np.linalg.lstsq(matrix, (x**2).sum(axis=1), rcond=None)
    square = found[-1] + found[:-1] @ found[:-1]
    return Shape(found[:-1], None, float(np.sqrt(square))) if square > 0 else None


def _cone(x: Array, axis: Array) -> Shape | None:
    """The cone closest to points (k, 3), from a first guess of its axis, by Gauss-Newton."""
    e = frames(axis[None])[0, 1:]
    (a, b), z = (x @ e.T).T, x @ axis
    matrix = np.column_stack([2 * a, 2 * b, np.ones(len(x)), z, z**2])
    found, *_ = np.linalg.lstsq(matrix, a**2 + b**2, rcond=1e-10)
    square = found[2] + found[:2] @ found[:2]
    if not square > 0:
        return None
    radius = float(np.sqrt(square))
    shape = Shape(found[:2] @ e, axis, radius, float(found[3]) / (2 * radius))
    for _ in range(STEPS):
        step, shape = _closer(x, shape)
        if step < CONVERGED:
            break
    sound = np.isfinite(shape.radius) and shape.radius > 0
    return shape if sound and _around(x, shape) >= FEWEST[2] else None


def _closer(x: Array, shape: Shape) -> tuple[float, Shape]:
    """One step of Gauss-Newton: its length, and the new cone."""
    assert shape.axis is not None
    axis, e = shape.axis, frames(shape.axis[None])[0, 1:]
    out = x - shape.point
    z, across = out @ axis, out @ e.T
    length = np.linalg.norm(across, axis=1)
    length = np.where(length > 0, length, 1.0)
    tilt = -(z / length + shape.taper)[:, None] * across
    matrix = np.column_stack([tilt, -across / length[:, None], -np.ones(len(x)), -z])
    rest = length - shape.radius - shape.taper * z
    step, *_ = np.linalg.lstsq(matrix, -rest, rcond=1e-12)
    size = float(np.abs(step).max())
    if size > 1:  # far from any cone
        step = step / size
    turned = axis + step[:2] @ e
    return size, Shape(
        shape.point + step[2:4] @ e, turned / np.linalg.norm(turned),
        shape.radius + float(step[4]), shape.taper + float(step[5]),
    )  # fmt: skip


def _around(x: Array, shape: Shape) -> int:
    """At how many angles around the axis of a cone points (k, 3) lie."""
    assert shape.axis is not None
    a, b = ((x - shape.point) @ frames(shape.axis[None])[0, 1:].T).T
    angle = np.sort(np.arctan2(b, a))
    return 1 + int((np.diff(angle) > SAME).sum())
