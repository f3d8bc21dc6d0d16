"""Shapes of rigid bodies: balls and convex polyhedra, with volume, centre and inertia.

A polyhedron is cut into tetrahedra between its centre and triangles of its faces.  For one with
vertices 0, a, b, c and volume V = det(a, b, c) / 6,

    integral of x = V (a + b + c) / 4,
    integral of x x^T = V / 20 (s s^T + a a^T + b b^T + c c^T),    s = a + b + c
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import finite, number
from ...core.errors import InvalidInput, shown

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FLAT = 1e-9  # volume, relative to that of the box around it, below which points lie in a plane
PARALLEL = 1e-8  # sine below which edges have one direction
# Relative to the size, from the plane of a face, as of coordinates in six digits: so much do
# bodies overlap, too.  Halves of a face that are taken for two faces carry on one half alone.
EVEN = 1e-5
ALIKE = 0.5  # cosine of normals of one face at least: thin sides are no part of it


class Facets(NamedTuple):
    """Faces of a polyhedron: outward normals and offsets, normal . x = offset; loops."""

    normals: Array  # (k, 3)
    offsets: Array  # (k,)
    loops: tuple[Index, ...]  # vertices of each, anticlockwise as seen from outside
    edges: Index  # (e, 2), each once, parallel ones one after another
    lines: Index  # (k,) where the edges of each direction begin


@dataclass(frozen=True)
class Ball:
    """A ball around its centre of mass; radius in the unit of length."""

    radius: float

    def __post_init__(self) -> None:
        if not number("radius", self.radius) > 0:
            raise InvalidInput(f"expected a number > 0, got {self.radius!r}", ("radius",))

    @property
    def volume(self) -> float:
        """Unit of length cubed."""
        return 4 / 3 * np.pi * self.radius**3

    @property
    def centre(self) -> Array:
        """The origin, (3,)."""
        return np.zeros(3)

    @property
    def inertia(self) -> Array:
        """About the centre of mass for a density of one, (3, 3)."""
        return 0.4 * self.volume * self.radius**2 * np.eye(3)

    @property
    def reach(self) -> float:
        """Radius of the ball around the centre of mass that holds it."""
        return self.radius


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """The convex hull of points, (n, 3), in the unit of length and in axes of its own.

    Raises InvalidInput where the points lie in a plane.
    """

    points: ArrayLike
    _triangles: tuple[Index, Array] = field(init=False, repr=False)  # and their planes

    def __post_init__(self) -> None:
        from scipy.spatial import ConvexHull, QhullError

        points = finite("points", self.points, 2)
        if points.shape[1:] != (3,) or len(points) < 4:
            raise InvalidInput(
                f"expected four points or more in 3D, got shape {points.shape}", ("points",)
            )
        try:
            hull = ConvexHull(points)
        except QhullError:
            hull = None
        with np.errstate(over="ignore", under="ignore"):  # volumes that are no numbers, or none
            around = np.prod(np.ptp(points, axis=0))
        if hull is None or not FLAT * around < hull.volume < np.inf:
            raise InvalidInput("expected points that do not lie in a plane", ("points",))
        corners = np.unique(hull.simplices)
        object.__setattr__(self, "points", points[corners])
        number_of = np.searchsorted(corners, hull.simplices)
        object.__setattr__(self, "_triangles", (number_of, hull.equations))

    @cached_property
    def facets(self) -> Facets:
        """Faces and edges: triangles of the hull in one plane are one face.

        Its normal is that of the sum of their areas, its offset that of its outermost point.
        """
        triangles, equations = self._triangles
        points = np.asarray(self.points)
        even = EVEN * np.ptp(points, axis=0).max()
        a, b, c = (points[triangles[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        left, normals, offsets, loops = np.arange(len(triangles)), [], [], []
        while len(left):
            seed = left[np.argmax(area[left] >= 0.5 * area[left].max())]  # no thin one
            normal, offset = equations[seed, :3], equations[seed, 3]
            off = np.abs(points[triangles[left]] @ normal + offset).max(axis=1)
            same = (off <= even) & (equations[left, :3] @ normal >= ALIKE)
            same[left == seed] = True
            normal = area[left[same]] @ equations[left[same], :3]
            normal /= np.linalg.norm(normal)
            normals.append(normal)
            offsets.append((points @ normal).max())
            loops.append(_around(points, normal, np.unique(triangles[left[same]])))
            left = left[~same]
        pairs = [np.column_stack([loop, np.roll(loop, -1)]) for loop in loops]
        edges = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
        return Facets(np.array(normals), np.array(offsets), tuple(loops),
                      *_by_direction(points, edges))  # fmt: skip

    @cached_property
    def _moments(self) -> tuple[float, Array, Array]:
        """Volume, centre and the integral of x x^T about the centre."""
        triangles, equations = self._triangles
        points = np.asarray(self.points)
        origin = points.mean(axis=0)
        a, b, c = (points[triangles[:, k]] - origin for k in range(3))
        volumes = np.abs(np.linalg.det(np.stack([a, b, c], axis=1))) / 6
        s = a + b + c
        volume = float(volumes.sum())
        centre = (volumes[:, None] * s).sum(axis=0) / (4 * volume)
        second = sum(np.einsum("t,ti,tj->ij", volumes, x, x) for x in (s, a, b, c)) / 20
        return volume, origin + centre, second - volume * np.outer(centre, centre)

    @property
    def volume(self) -> float:
        """Unit of length cubed."""
        return self._moments[0]

    @property
    def centre(self) -> Array:
        """Centre of mass in the axes of the points, (3,)."""
        return self._moments[1]

    @property
    def inertia(self) -> Array:
        """About the centre of mass for a density of one, (3, 3), in the axes of the points."""
        second = self._moments[2]
        return np.trace(second) * np.eye(3) - second

    @property
    def reach(self) -> float:
        """Radius of the ball around the centre of mass that holds it."""
        return float(np.linalg.norm(np.asarray(self.points) - self.centre, axis=1).max())


def cuboid(sides: ArrayLike) -> Polyhedron:
    """A box with three sides in the unit of length, its centre at the origin."""
    lengths = finite("sides", sides, 1)
    if lengths.shape != (3,) or not (lengths > 0).all():
        raise InvalidInput(f"expected three lengths > 0, got {shown(sides)}", ("sides",))
    corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij")).reshape(3, -1).T
    return Polyhedron(corners * lengths)


def _by_direction(points: Array, edges: Index) -> tuple[Index, Index]:
    """Edges (e, 2) with parallel ones one after another, and where each direction begins."""
    along = points[edges[:, 1]] - points[edges[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    left, order, lines = np.arange(len(edges)), [], []
    while len(left):
        sine = np.linalg.norm(np.cross(along[left], along[left[0]]), axis=1)
        lines.append(sum(map(len, order)))
        order.append(left[sine <= PARALLEL])
        left = left[sine > PARALLEL]
    return edges[np.concatenate(order)], np.array(lines)


def _around(points: Array, normal: Array, corners: Index) -> Index:
    """Corners of a face in order, anticlockwise about its normal.

    Without those within it or its sides, which uneven coordinates leave.
    """
    from scipy.spatial import ConvexHull

    centred = points[corners] - points[corners].mean(axis=0)
    first = centred[np.linalg.norm(centred, axis=1).argmax()]
    second = np.cross(normal, first)
    flat = np.column_stack([centred @ first, centred @ second])
    if len(corners) > 3:
        outer = np.sort(ConvexHull(flat).vertices)
        corners, flat = corners[outer], flat[outer]
    return corners[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]
