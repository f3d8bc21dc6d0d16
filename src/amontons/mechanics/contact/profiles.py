"""Rigid obstacles made of a profile in the plane: as it is, extruded, revolved; and cylinders.

A profile is a chain of straight lines and arcs.  Its material lies to the right of the way
along it, and points to the left of it have a gap > 0.  Behind its ends there is nothing: points
beyond them see the end point, at a positive distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite, number
from ...core.errors import InvalidInput, shown
from ...core.words import helpful

Array = NDArray[np.float64]
Index = NDArray[np.int64]
CLOSED = 1e-9  # of its size: ends of a profile that are nearer are one point
ROUND = 1e-6  # relative: radii at both ends of an arc that differ by less are one
NEAR = 1e-12  # of the size: points nearer to the profile are on it
Step = tuple[Sequence[float], Sequence[float] | None]


@helpful
@dataclass(frozen=True, eq=False)
class Profile:
    """A chain of lines and arcs in the plane, an obstacle of 2D and axisymmetric models.

    start (2,); steps: the end of each piece (2,), or (end, center) of an arc of less than 180
    degrees.  The material is to the right of the way; `turned` has it to the left.
    """

    start: Sequence[float]
    steps: Sequence[Sequence[float] | Step]
    pieces: tuple[_Piece, ...] = field(default=(), init=False, repr=False)

    def __post_init__(self) -> None:
        at = _pair("start", self.start)
        object.__setattr__(self, "start", tuple(at.tolist()))
        if isinstance(self.steps, str) or not len(self.steps):
            raise InvalidInput("expected at least one end of a line or arc", ("steps",))
        pieces, kept = [], []
        for k, step in enumerate(self.steps):
            end, center = _step(k, step)
            pieces.append(_Piece.of(k, at, end, center))
            about = None if center is None else tuple(center.tolist())
            kept.append((tuple(end.tolist()), about))
            at = end
        object.__setattr__(self, "steps", tuple(kept))
        object.__setattr__(self, "pieces", tuple(pieces))

    @property
    def turned(self) -> Profile:
        """The same chain with its material on the other side."""
        ends = [self.start, *(end for end, _ in self.steps)]  # type: ignore[misc]
        centers = [center for _, center in self.steps]  # type: ignore[misc]
        back = zip(ends[-2::-1], centers[::-1], strict=True)
        return Profile(ends[-1], [(end, center) for end, center in back])  # type: ignore[misc]

    def gap(self, points: Array) -> Array:
        """Signed distance of points (n, 2), (n,)."""
        return self._nearest(points)[0]

    def normals(self, points: Array) -> Array:
        """Unit normals out of the material, (n, 2)."""
        return self._nearest(points)[1]

    def _nearest(self, points: Array) -> tuple[Array, Array]:
        """Gap (n,) and normal (n, 2) of the nearest place of the chain."""
        if points.shape[1] != 2:
            raise InvalidInput(f"profile: is in 2D, the mesh in {points.shape[1]}D; extrude it")
        feet, normals, ends = zip(*(p.closest(points) for p in self.pieces), strict=True)
        apart = np.stack([np.linalg.norm(points - foot, axis=1) for foot in feet])
        best = apart.argmin(axis=0)
        rows = np.arange(len(points))
        foot, normal = np.stack(feet)[best, rows], np.stack(normals)[best, rows]
        end = np.stack(ends)[best, rows]  # -1, 1: at the beginning or end of the piece
        normal = self._at_corners(best, end, normal)
        across = points - foot
        distance = np.linalg.norm(across, axis=1)
        sign = np.where(np.einsum("nc,nc->n", across, normal) < 0, -1.0, 1.0)
        sign[self._beyond(best, end)] = 1.0
        on = distance <= NEAR * self._size
        way = (sign / np.where(on, 1.0, distance))[:, None] * across
        return sign * distance, np.where(on[:, None], normal, way)

    @property
    def _size(self) -> float:
        ends = np.array([p.start for p in self.pieces] + [self.pieces[-1].end])
        return float(np.ptp(ends, axis=0).max()) or 1.0

    @property
    def _is_closed(self) -> bool:
        apart = np.linalg.norm(self.pieces[0].start - self.pieces[-1].end)
        return bool(apart <= CLOSED * self._size)

    def _beyond(self, best: Index, end: Index) -> NDArray[np.bool_]:
        """Points (n,) whose nearest place is one of the two ends of the chain."""
        if self._is_closed:
            return np.zeros(len(best), dtype=bool)
        last = len(self.pieces) - 1
        return ((best == 0) & (end < 0)) | ((best == last) & (end > 0))

    def _at_corners(self, best: Index, end: Index, normal: Array) -> Array:
        """Where two pieces meet the mean of their normals, which tells the side there."""
        count = len(self.pieces)
        out = normal.copy()
        for k in range(count):
            for way in (-1, 1):
                here = (best == k) & (end == way)
                if not here.any() or (not self._is_closed and not 0 <= k + way < count):
                    continue
                other = self.pieces[(k + way) % count]
                mean = normal[here] + other.normal_at(end=way < 0)
                length = np.linalg.norm(mean, axis=1, keepdims=True)
                out[here] = mean / np.where(length > 0, length, 1.0)
        return out


@dataclass(frozen=True, eq=False)
class _Piece:
    """A line or an arc: radius 0 of a line; turn 1 counter-clockwise, -1 clockwise."""

    start: Array
    end: Array
    center: Array
    radius: float
    turn: float

    @classmethod
    def of(cls, k: int, start: Array, end: Array, center: Array | None) -> _Piece:
        """Raises InvalidInput for pieces without length and arcs that are none."""
        at = ("steps", k)
        if not np.linalg.norm(end - start) > 0:
            raise InvalidInput("expected a line or an arc, its end is its beginning", at)
        if center is None:
            return cls(start, end, start, 0.0, 0.0)
        a, b = start - center, end - center
        radius, other = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        if not abs(radius - other) <= ROUND * max(radius, other):
            text = f"expected an arc, its ends are {radius:g} and {other:g} from its center"
            raise InvalidInput(text, at)
        cross = float(a[0] * b[1] - a[1] * b[0])
        if abs(cross) <= NEAR * radius**2:
            raise InvalidInput("expected an arc of less than 180 degrees; divide it", at)
        return cls(start, end, center, radius, float(np.sign(cross)))

    def closest(self, points: Array) -> tuple[Array, Array, Index]:
        """Nearest places (n, 2), normals there, and -1 at the start, 1 at the end, else 0."""
        if not self.radius:
            way = self.end - self.start
            share = (points - self.start) @ way / (way @ way)
            foot = self.start + np.clip(share, 0, 1)[:, None] * way
            normal = np.broadcast_to(self.normal_at(), foot.shape)
            return foot, normal, np.where(share <= 0, -1, np.where(share >= 1, 1, 0))
        out = points - self.center
        length = np.linalg.norm(out, axis=1, keepdims=True)
        ray = np.where(length > 0, out / np.where(length > 0, length, 1.0), self._middle)
        before = self.turn * _cross(self.start - self.center, ray) < 0
        after = self.turn * _cross(ray, self.end - self.center) < 0
        nearer = np.linalg.norm(points - self.start, axis=1) <= np.linalg.norm(
            points - self.end, axis=1
        )
        outside = before | after
        ends = np.where(nearer[:, None], self.start, self.end)
        foot = np.where(outside[:, None], ends, self.center + self.radius * ray)
        normal = -self.turn * (foot - self.center) / self.radius
        return foot, normal, np.where(outside, np.where(nearer, -1, 1), 0)

    @property
    def _middle(self) -> Array:
        """A unit vector from the center to the arc."""
        way = (self.start + self.end) / 2 - self.center
        return way / np.linalg.norm(way)

    def normal_at(self, *, end: bool = False) -> Array:
        """The unit normal to the left of the way, at the start or the end."""
        if not self.radius:
            way = self.end - self.start
            return np.array([-way[1], way[0]]) / np.linalg.norm(way)
        at = self.end if end else self.start
        return -self.turn * (at - self.center) / self.radius


@helpful
@dataclass(frozen=True, eq=False)
class Extrusion:
    """A profile extruded along an axis, an obstacle in 3D, without ends.

    origin: of the plane of the profile; x_axis, y_axis: its axes, made perpendicular in turn.
    """

    profile: Profile
    origin: Sequence[float]
    x_axis: Sequence[float]
    y_axis: Sequence[float]
    axes: Array = field(default=None, init=False, repr=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", tuple(_triple("origin", self.origin).tolist()))
        x, y = _triple("x_axis", self.x_axis), _triple("y_axis", self.y_axis)
        x = x / _length("x_axis", x)
        y = y - (y @ x) * x
        object.__setattr__(self, "axes", np.stack([x, y / _length("y_axis", y)]))

    def gap(self, points: Array) -> Array:
        """Signed distance of points (n, 3), (n,)."""
        return self.profile.gap(self._inside(points))

    def normals(self, points: Array) -> Array:
        """Unit normals out of the obstacle, (n, 3)."""
        return self.profile.normals(self._inside(points)) @ self.axes

    @property
    def turned(self) -> Extrusion:
        """The same surface with its material on the other side."""
        return Extrusion(self.profile.turned, self.origin, self.x_axis, self.y_axis)

    def _inside(self, points: Array) -> Array:
        return (_solid("extrusion", points) - np.asarray(self.origin)) @ self.axes.T


@helpful
@dataclass(frozen=True, eq=False)
class Revolution:
    """A profile (r, z) revolved about an axis through a point, an obstacle in 3D."""

    profile: Profile
    point: Sequence[float]
    axis: Sequence[float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", tuple(_triple("point", self.point).tolist()))
        axis = _triple("axis", self.axis)
        axis = axis / _length("axis", axis)
        object.__setattr__(self, "axis", tuple(axis.tolist()))

    def gap(self, points: Array) -> Array:
        """Signed distance of points (n, 3), (n,)."""
        return self.profile.gap(self._inside(points)[0])

    def normals(self, points: Array) -> Array:
        """Unit normals out of the obstacle, (n, 3)."""
        inside, outward = self._inside(points)
        n = self.profile.normals(inside)
        return n[:, :1] * outward + n[:, 1:] * np.asarray(self.axis)

    @property
    def turned(self) -> Revolution:
        """The same surface with its material on the other side."""
        return Revolution(self.profile.turned, self.point, self.axis)

    def _inside(self, points: Array) -> tuple[Array, Array]:
        """Coordinates (n, 2) along the radius and the axis, and the way outwards (n, 3)."""
        axis = np.asarray(self.axis)
        off = _solid("revolution", points) - np.asarray(self.point)
        z = off @ axis
        out = off - z[:, None] * axis
        r = np.linalg.norm(out, axis=1)
        some = np.eye(3)[int(np.abs(axis).argmin())]
        some = some - (some @ axis) * axis
        on_axis = r <= NEAR * (np.abs(off).max(initial=0.0) or 1.0)
        way = np.where(on_axis[:, None], some / np.linalg.norm(some),
                       out / np.where(on_axis, 1.0, r)[:, None])  # fmt: skip
        return np.stack([r, z], axis=1), way


@helpful
@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder without ends about an axis through a point, radius > 0; in 3D.

    hollow: the material is outside of it, and bodies lie inside.
    """

    point: Sequence[float]
    axis: Sequence[float]
    radius: float
    hollow: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", tuple(_triple("point", self.point).tolist()))
        axis = _triple("axis", self.axis)
        axis = axis / _length("axis", axis)
        object.__setattr__(self, "axis", tuple(axis.tolist()))
        object.__setattr__(self, "radius", number("radius", self.radius))
        if not self.radius > 0:
            raise InvalidInput(f"expected a length > 0, got {self.radius!r}", ("radius",))

    def gap(self, points: Array) -> Array:
        """Distance to the axis less the radius, (n,); the opposite where hollow."""
        return self._sign * (np.linalg.norm(self._out(points), axis=1) - self.radius)

    def normals(self, points: Array) -> Array:
        """Unit vectors away from the axis, (n, 3); towards it where hollow."""
        out = self._out(points)
        length = np.linalg.norm(out, axis=1)
        if (length == 0).any():
            bad = points[np.flatnonzero(length == 0)[0]]
            raise InvalidInput(f"cylinder: no normal at {bad}, on its axis")
        return self._sign * out / length[:, None]

    @property
    def _sign(self) -> float:
        return -1.0 if self.hollow else 1.0

    def _out(self, points: Array) -> Array:
        axis = np.asarray(self.axis)
        off = _solid("cylinder", points) - np.asarray(self.point)
        return off - (off @ axis)[:, None] * axis


def _solid(what: str, points: Array) -> Array:
    if points.shape[1] != 3:
        raise InvalidInput(f"{what}: is in 3D, the mesh in {points.shape[1]}D")
    return points


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _pair(name: str, values: object) -> Array:
    return _sized(name, values, 2)


def _triple(name: str, values: object) -> Array:
    return _sized(name, values, 3)


def _sized(name: str, values: object, size: int) -> Array:
    found = finite(name, values, 1)
    if found.shape != (size,):
        raise InvalidInput(f"expected {size} numbers, got {shown(values)}", (name,))
    return found


def _length(name: str, vector: Array) -> float:
    length = float(np.linalg.norm(vector))
    if not length > 0:
        raise InvalidInput("expected a vector that is not zero nor along the other", (name,))
    return length


def _step(k: int, step: object) -> tuple[Array, Array | None]:
    """End and center of a piece."""
    given = step if isinstance(step, Sequence | np.ndarray) else ()
    if len(given) == 2 and isinstance(given[0], Sequence | np.ndarray):
        center = None if given[1] is None else _pair(f"steps[{k}]", given[1])
        return _pair(f"steps[{k}]", given[0]), center
    return _pair(f"steps[{k}]", step), None
