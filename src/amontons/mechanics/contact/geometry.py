"""Rigid obstacles: gap and normal at points, and local frames.

gap >= 0 outside the obstacle; normals point from the obstacle into the body.  Small-strain
theory: both are taken once, in the reference configuration, and a node then moves along the
tangent plane of its obstacle.  Large deformations take both where the node is, and need the
slopes of both: `gap_slopes`, `normal_slopes`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import LARGEST, number, real
from ...core.errors import InvalidInput, shown
from ...core.words import helpful

Array = NDArray[np.float64]


class Obstacle(Protocol):
    """A rigid body that slave nodes must not enter."""

    def gap(self, points: Array) -> Array:
        """Signed distance of points (n, dim) to the obstacle, (n,), unit of length."""
        ...

    def normals(self, points: Array) -> Array:
        """Unit normals out of the obstacle at points (n, dim), (n, dim)."""
        ...


@helpful
@dataclass(frozen=True)
class Plane:
    """The half-space behind a plane through `point`; `normal` points into the body.

    normal: 2 or 3 components, of any length; point: zero by default.
    """

    normal: Sequence[float]
    point: Sequence[float] | None = None

    def __post_init__(self) -> None:
        normal = _vector("normal", self.normal)
        if not np.linalg.norm(normal) > 0:
            text = f"expected a vector of length > 0, got {self.normal!r}"
            raise InvalidInput(text, ("normal",))
        point = np.zeros(len(normal)) if self.point is None else _vector("point", self.point)
        if len(point) == 3 and len(normal) == 2 and point[2] == 0:
            point = point[:2]
        if point.shape != normal.shape:
            text = f"expected {len(normal)} numbers, got {self.point!r}"
            raise InvalidInput(text, ("point",))
        object.__setattr__(self, "normal", tuple((normal / np.linalg.norm(normal)).tolist()))
        object.__setattr__(self, "point", tuple(point.tolist()))

    def gap(self, points: Array) -> Array:
        """Distance in front of the plane, (n,)."""
        _same_dimension("plane", len(self.normal), points)
        return (points - np.asarray(self.point)) @ np.asarray(self.normal)

    def normals(self, points: Array) -> Array:
        """The normal, once per point, (n, dim)."""
        _same_dimension("plane", len(self.normal), points)
        return np.tile(np.asarray(self.normal), (len(points), 1))

    def gap_slopes(self, points: Array) -> Array:
        """Gradient of the gap, (n, dim): the normal."""
        return self.normals(points)

    def normal_slopes(self, points: Array) -> Array:
        """Derivative of the normal by position, (n, dim, dim): zero."""
        return np.zeros((*points.shape, points.shape[1]))


@helpful
@dataclass(frozen=True)
class Sphere:
    """A ball (a disc in 2D) with `center`, 2 or 3 coordinates, and `radius` > 0."""

    center: Sequence[float]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", tuple(_vector("center", self.center).tolist()))
        object.__setattr__(self, "radius", number("radius", self.radius))
        if not self.radius > 0:
            text = f"expected a finite length > 0, got {self.radius!r}"
            raise InvalidInput(text, ("radius",))

    def gap(self, points: Array) -> Array:
        """Distance to the centre less the radius, (n,)."""
        _same_dimension("sphere", len(self.center), points)
        return np.linalg.norm(points - self.center, axis=1) - self.radius

    def normals(self, points: Array) -> Array:
        """Unit vectors away from the centre, (n, dim)."""
        _same_dimension("sphere", len(self.center), points)
        return _unit("sphere", points - np.asarray(self.center), points)

    def gap_slopes(self, points: Array) -> Array:
        """Gradient of the gap, (n, dim): the normal."""
        return self.normals(points)

    def normal_slopes(self, points: Array) -> Array:
        """Derivative of the normal by position, (n, dim, dim): (I - n n^T) / distance."""
        n = self.normals(points)
        distance = self.gap(points) + self.radius
        return _tangential(n) / distance[:, None, None]


@dataclass(frozen=True)
class LevelSet:
    """The obstacle where `function` < 0; function and gradient take points (n, dim).

    function returns (n,), unit of length or any smooth multiple of it: the gap is
    function / |gradient|, exact to first order near the surface.  gradient returns (n, dim),
    hessian (n, dim, dim), which large deformations need; central differences by default.
    """

    function: Callable[[Array], Array]
    gradient: Callable[[Array], Array] | None = None
    hessian: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        for name in ("function", "gradient", "hessian"):
            given = getattr(self, name)
            if not (callable(given) or (given is None and name != "function")):
                raise InvalidInput(f"{name}: expected a callable of points, got {given!r}")

    def gap(self, points: Array) -> Array:
        """Value over slope, (n,): the distance to first order."""
        slope = np.linalg.norm(self._slopes(points), axis=1)
        return self._values(points) / slope

    def normals(self, points: Array) -> Array:
        """Unit vectors uphill, (n, dim)."""
        return _unit("level set", self._slopes(points), points)

    def gap_slopes(self, points: Array) -> Array:
        """Gradient of the gap, (n, dim): n - (value / slope^2) second n."""
        slopes, second = self._slopes(points), self._second(points)
        length = np.linalg.norm(slopes, axis=1)
        n = slopes / length[:, None]
        bent = np.einsum("pij,pj->pi", second, n)
        return n - (self._values(points) / length**2)[:, None] * bent

    def normal_slopes(self, points: Array) -> Array:
        """Derivative of the normal by position, (n, dim, dim): (I - n n^T) second / slope."""
        slopes = self._slopes(points)
        length = np.linalg.norm(slopes, axis=1)
        n = slopes / length[:, None]
        return _tangential(n) @ self._second(points) / length[:, None, None]

    def _second(self, points: Array) -> Array:
        """Second derivatives, (n, dim, dim), symmetric."""
        if self.hessian is not None:
            second = real("hessian", self.hessian(points))
            wanted = (*points.shape, points.shape[1])
            if second.shape != wanted:
                raise InvalidInput(f"hessian: expected shape {wanted}, got {second.shape}")
        elif self.gradient is not None:
            second = self._central(self._slopes, points, 1 / 3)
        else:  # differences of differences: a longer step keeps half of the digits
            second = self._central(
                lambda x: self._central(self._values, x, 1 / 4), points, 1 / 4
            )
        _finite("hessian of the level set", second, points)
        return (second + second.swapaxes(1, 2)) / 2

    def _values(self, points: Array) -> Array:
        values = real("level set", self.function(points))
        if values.shape != (len(points),):
            raise InvalidInput(
                f"level set: expected values of shape ({len(points)},) for points of shape "
                f"{points.shape}, got {values.shape}; x[:, 0] is the first coordinate"
            )
        return _finite("level set", values, points)

    def _slopes(self, points: Array) -> Array:
        if self.gradient is not None:
            slopes = real("gradient", self.gradient(points))
            if slopes.shape != points.shape:
                raise InvalidInput(
                    f"gradient: expected shape {points.shape}, got {slopes.shape}"
                )
        else:
            slopes = self._central(self._values, points, 1 / 3)
        _finite("gradient of the level set", slopes, points)
        flat = np.flatnonzero(np.linalg.norm(slopes, axis=1) == 0)
        if flat.size:
            raise InvalidInput(
                f"level set: its gradient is zero at {points[flat[0]]}, no normal"
            )
        return slopes

    @staticmethod
    def _central(what: Callable[[Array], Array], points: Array, power: float) -> Array:
        """Central differences in a new last axis; step eps^power of the size of the points.

        Power 1/3 balances truncation and rounding of values, 1/4 of first differences.
        """
        size = max(float(np.abs(points).max(initial=0.0)), float(np.ptp(points, axis=0).max()))
        step = np.finfo(float).eps ** power * (size if size > 0 else 1.0)
        columns = []
        for axis in range(points.shape[1]):
            shift = np.zeros(points.shape[1])
            shift[axis] = step
            columns.append((what(points + shift) - what(points - shift)) / (2 * step))
        return np.stack(columns, axis=-1)


def frames(normals: Array) -> Array:
    """Local frames (nc, d, d) with rows n, t1(, t2), right-handed, from unit normals (nc, d).

    3D: t1 is the projection of the x axis (of the y axis where n is nearly along x), so that
    n = +z gives x, y.  2D: n = +y gives t = +x.
    """
    normals = np.asarray(normals, dtype=float)
    if normals.shape[1] == 2:
        return np.stack([normals, np.stack([normals[:, 1], -normals[:, 0]], axis=1)], axis=1)
    along_x = np.abs(normals[:, 0]) > 0.9
    axis = np.where(along_x[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    first: Array = axis - (axis * normals).sum(axis=1, keepdims=True) * normals
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def _vector(name: str, values: Sequence[float]) -> Array:
    array = real(name, values)
    if array.shape not in ((2,), (3,)) or not (np.abs(array) <= LARGEST).all():
        raise InvalidInput(f"{name}: expected 2 or 3 finite numbers, got {shown(values)}")
    return array


def _same_dimension(what: str, dim: int, points: Array) -> None:
    if points.shape[1] != dim:
        raise InvalidInput(f"{what}: is in {dim}D, the mesh in {points.shape[1]}D")


def _finite(what: str, values: Array, points: Array) -> Array:
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        raise InvalidInput(
            f"{what}: expected finite numbers, got {values[tuple(bad[0])]} "
            f"at {points[bad[0][0]]}"
        )
    return values


def _tangential(n: Array) -> Array:
    """I - n n^T per unit normal, (n, dim, dim)."""
    return np.eye(n.shape[1]) - n[:, :, None] * n[:, None, :]


def _unit(what: str, vectors: Array, points: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1)
    if (length == 0).any():
        raise InvalidInput(f"{what}: no normal at {points[np.flatnonzero(length == 0)[0]]}")
    return vectors / length[:, None]
