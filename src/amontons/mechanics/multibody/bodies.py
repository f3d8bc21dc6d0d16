"""Rigid bodies with finite rotations, what they stand on, and joints between them.

A body has its centre of mass at x and its own axes turned by R(Q), Q = (w, x, y, z) a unit
quaternion: a point X of the body, from the centre of mass in its own axes, is at x + R X.  Its
velocity is v + omega x R X; angular velocities are in global axes here, Omega = R^T omega in
those of the body, in which the inertia J does not change.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import finite, number, read_only
from ...core.errors import InvalidInput, dotted, shown
from ...core.locks import KeepsLocks
from ...core.words import helpful
from ..contact.geometry import Plane
from .shapes import Ball, Polyhedron

Array = NDArray[np.float64]
Index = NDArray[np.int64]
GROUND = -1  # the number of what does not move
ROUNDING = float(np.finfo(float).eps)  # of the largest moment of inertia: error of the smallest
TINY = float(np.finfo(float).tiny)  # numbers below have no inverse


@helpful
@dataclass(frozen=True, eq=False)
class RigidBody(KeepsLocks):
    """A body that does not deform, however far it moves and turns.

    shape: Ball, Polyhedron or cuboid(sides); density: mass per volume; position (3,): of the
    centre of mass, by default where the points of a polyhedron have it; orientation (4,):
    quaternion (w, x, y, z) of any length, of the axes of the points; velocity, spin (3,): of
    the centre of mass, and angular, in global axes.
    """

    shape: Ball | Polyhedron
    density: float = 1000.0
    position: ArrayLike | None = None
    orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    velocity: ArrayLike = (0.0, 0.0, 0.0)
    spin: ArrayLike = (0.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Ball | Polyhedron):
            text = f"expected Ball, Polyhedron or cuboid(sides), got {shown(self.shape)}"
            raise InvalidInput(text, ("shape",))
        if not number("density", self.density) > 0:
            raise InvalidInput(f"expected a number > 0, got {self.density!r}", ("density",))
        where = self.shape.centre if self.position is None else self.position
        for key, value, size in (
            ("position", where, 3), ("orientation", self.orientation, 4),
            ("velocity", self.velocity, 3), ("spin", self.spin, 3),
        ):  # fmt: skip
            vector = finite(key, value, 1)
            if vector.shape != (size,):
                raise InvalidInput(f"expected {size} numbers, got {shown(value)}", (key,))
            object.__setattr__(self, key, read_only(vector))
        self._check_inertia()
        length = float(np.linalg.norm(self.orientation))
        if not length > 0:
            raise InvalidInput("expected a quaternion of length > 0", ("orientation",))
        object.__setattr__(
            self, "orientation", read_only(np.asarray(self.orientation) / length)
        )

    def _check_inertia(self) -> None:
        """Raise InvalidInput where mass or moments of inertia are nothing, or too large."""
        inertia = self.inertia
        whole = bool(np.isfinite(inertia).all())
        smallest, _, largest = np.linalg.eigvalsh(inertia) if whole else (0.0, 0.0, np.inf)
        if not smallest > ROUNDING * largest or not TINY < min(self.mass, smallest):
            raise InvalidInput(
                "expected mass and moments of inertia that rounding leaves, got mass "
                f"{self.mass:.3g}, moments from {smallest:.3g} to {largest:.3g}: take a "
                "thicker body or another unit", ("shape",),
            )  # fmt: skip

    @property
    def mass(self) -> float:
        """Unit of mass."""
        return self.density * self.shape.volume

    @property
    def inertia(self) -> Array:
        """About the centre of mass in its own axes, (3, 3)."""
        return self.density * self.shape.inertia


@helpful
@dataclass(frozen=True)
class Joint:
    """A ball joint of two bodies, by number, at a point of the first state, (3,).

    second: GROUND (-1) joins a body to the ground.  Two joints on a line make a hinge, three
    that lie on no line a weld; they say some things twice, which changes no motion.
    """

    first: int
    second: int
    point: Sequence[float]


@helpful
@dataclass(frozen=True, eq=False)
class RigidBodies(KeepsLocks):
    """Bodies, planes that they stand on, friction between all, gravity and joints.

    mu: coefficient of friction of all; restitution: normal velocity after over before an
    impact, from 0 to 1, of all; gravity (3,): acceleration, or a function of time: in axes
    that the ground takes along, less its acceleration.  apart: pairs of bodies that pass
    through each other, such as those with a joint.  rolling, torsion: lengths by which contacts
    resist rolling and spinning, see `RollingFriction`; not together with joints.
    """

    bodies: Sequence[RigidBody]
    planes: Sequence[Plane] = ()
    mu: float = 0.5
    restitution: float = 0.0
    gravity: ArrayLike | Callable[[float], ArrayLike] = (0.0, 0.0, -9.81)
    joints: Sequence[Joint] = ()
    apart: Sequence[tuple[int, int]] = ()
    rolling: float = 0.0
    torsion: float = 0.0

    def __post_init__(self) -> None:
        for key in ("bodies", "planes", "joints", "apart"):
            if not isinstance(getattr(self, key), Sequence | np.ndarray):
                text = f"expected a list, got {shown(getattr(self, key))}"
                raise InvalidInput(text, (key,))
        if not len(self.bodies):
            raise InvalidInput("expected one body at least", ("bodies",))
        for k, body in enumerate(self.bodies):
            if not isinstance(body, RigidBody):
                raise InvalidInput(f"expected RigidBody, got {shown(body)}", ("bodies", k))
        for k, plane in enumerate(self.planes):
            if not isinstance(plane, Plane) or len(plane.normal) != 3:
                raise InvalidInput(f"expected Plane in 3D, got {shown(plane)}", ("planes", k))
        if not number("mu", self.mu) >= 0:
            raise InvalidInput(f"expected a number >= 0, got {self.mu!r}", ("mu",))
        if not 0 <= number("restitution", self.restitution) <= 1:
            text = f"expected a number from 0 to 1, got {self.restitution!r}"
            raise InvalidInput(text, ("restitution",))
        for key in ("rolling", "torsion"):
            if not number(key, getattr(self, key)) >= 0:
                raise InvalidInput(f"expected a length >= 0, got {shown(getattr(self, key))}",
                                   (key,))  # fmt: skip
            if getattr(self, key) > 0 and len(self.joints):
                raise InvalidInput("expected 0 with joints: they have no moments", (key,))
        if callable(self.gravity):
            self.gravity_at(0.0)
        else:
            object.__setattr__(self, "gravity", read_only(_acceleration(self.gravity)))
        for k, joint in enumerate(self.joints):
            self._check_joint(joint, ("joints", k))
        for k, pair in enumerate(self.apart):
            two = isinstance(pair, Sequence | np.ndarray) and len(pair) == 2
            if not two or not all(map(self._is_body, pair)) or pair[0] == pair[1]:
                text = f"expected two of the {len(self.bodies)} bodies, got {shown(pair)}"
                raise InvalidInput(text, ("apart", k))

    def _is_body(self, number: object) -> bool:
        return isinstance(number, int | np.integer) and 0 <= int(number) < len(self.bodies)

    def _check_joint(self, joint: Joint, at: tuple[str, int]) -> None:
        """Raise InvalidInput for a joint of what is no body, or of one with itself."""
        if not isinstance(joint, Joint):
            raise InvalidInput(f"expected Joint, got {shown(joint)}", at)
        good = self._is_body(joint.first) and (
            self._is_body(joint.second) or joint.second == GROUND
        )
        if not good or joint.first == joint.second:
            raise InvalidInput(
                f"expected two of the {len(self.bodies)} bodies, the second {GROUND} for the "
                f"ground, got {joint.first} and {joint.second}", at,
            )  # fmt: skip
        point = finite(f"{dotted(at)}.point", joint.point, 1)
        if point.shape != (3,):
            raise InvalidInput(f"point: expected 3 numbers, got {shown(joint.point)}", at)

    def gravity_at(self, time: float) -> Array:
        """The acceleration (3,) at a time; raises InvalidInput for what is none."""
        if not callable(self.gravity):
            return np.asarray(self.gravity)
        try:
            given = self.gravity(time)
        except Exception as error:  # of the user's function, without a common base
            raise InvalidInput(
                f"gravity(t) failed at t = {time:g}: {type(error).__name__}: {error}",
                ("gravity",),
            ) from error
        return _acceleration(given, f" at t = {time:g}")

    @cached_property
    def packed(self) -> Packed:
        """All shapes in the arrays that kernels take."""
        return _packed(self)

    @property
    def has_moments(self) -> bool:
        """True where contacts resist rolling or spinning."""
        return self.rolling > 0 or self.torsion > 0

    @property
    def size(self) -> float:
        """Radius of the smallest ball around a body, unit of length."""
        return float(self.packed.reach.min())


class Packed(NamedTuple):
    """Shapes of all bodies: vertices, faces, edges one body after another, in own axes.

    Those of body b are first[b] to first[b + 1]; a ball has none.
    """

    radius: Array  # (n,) of balls, 0 of polyhedra
    reach: Array  # (n,) of the ball around
    first_vertex: Index  # (n + 1,)
    vertices: Array  # (v, 3) from the centre of mass
    first_face: Index  # (n + 1,)
    normals: Array  # (f, 3)
    offsets: Array  # (f,)
    first_corner: Index  # (f + 1,)
    corners: Index  # vertices around each face
    first_edge: Index  # (n + 1,)
    edges: Index  # (e, 2)
    first_line: Index  # (n + 1,)
    lines: Index  # (l + 1,) edges of each direction
    planes: Array  # (p, 4) normal and offset
    apart: NDArray[np.bool_]  # (n, n) pairs that do not meet; (0, 0) where there are none


def _acceleration(given: object, when: str = "") -> Array:
    """(3,); raises InvalidInput for what is none."""
    found = finite("gravity", given, 1)
    if found.shape != (3,):
        raise InvalidInput(f"expected 3 numbers{when}, got {shown(given)}", ("gravity",))
    return found


def _packed(system: RigidBodies) -> Packed:
    vertices, normals, offsets, corners, edges, lines = [], [], [], [], [], []
    counts = {"vertex": [0], "face": [0], "edge": [0], "line": [0]}
    around, total = [0], 0
    for body in system.bodies:
        shape = body.shape
        if isinstance(shape, Polyhedron):
            facets, centre = shape.facets, shape.centre
            vertices.append(np.asarray(shape.points) - centre)
            normals.append(facets.normals)
            offsets.append(facets.offsets - facets.normals @ centre)
            for loop in facets.loops:
                corners.append(loop + total)
                around.append(around[-1] + len(loop))
            lines.append(facets.lines + counts["edge"][-1])
            edges.append(facets.edges + total)
            total += len(vertices[-1])
            sizes = len(vertices[-1]), len(normals[-1]), len(edges[-1]), len(lines[-1])
        else:
            sizes = 0, 0, 0, 0
        for key, size in zip(counts, sizes, strict=True):
            counts[key].append(counts[key][-1] + size)
    n = len(system.bodies)
    apart = np.zeros((n, n) if system.apart else (0, 0), dtype=bool)
    for i, j in system.apart:
        apart[i, j] = apart[j, i] = True
    planes = [(*p.normal, float(np.dot(p.normal, p.point))) for p in system.planes]  # type: ignore[arg-type]
    balls = [b.shape.radius if isinstance(b.shape, Ball) else 0.0 for b in system.bodies]
    return Packed(
        np.array(balls), np.array([b.shape.reach for b in system.bodies]),
        np.array(counts["vertex"]), _rows(vertices, 3), np.array(counts["face"]),
        _rows(normals, 3), np.concatenate([np.zeros(0), *offsets]), np.array(around),
        np.concatenate([np.zeros(0, np.int64), *corners]), np.array(counts["edge"]),
        _rows(edges, 2).astype(np.int64), np.array(counts["line"]),
        np.concatenate([*lines, counts["edge"][-1:]]).astype(np.int64),
        np.reshape(np.array(planes, dtype=float), (-1, 4)), apart,
    )  # fmt: skip


def _rows(arrays: list, width: int) -> Array:
    return np.concatenate([np.zeros((0, width)), *arrays])
