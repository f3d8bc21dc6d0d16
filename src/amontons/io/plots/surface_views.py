"""How a contact surface in 3D is laid flat: seen along its mean normal, or unrolled.

A surface whose normals turn far around one axis (a pin in its bore, a ring on a cone) is
unrolled: the arc about the axis to the right, at the mean radius of the contacts, the place
along the axis upwards.  All others are projected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FLAT = 0.8  # mean of unit normals from which a surface is seen along it: an arc of 130 degrees
AROUND = 0.1  # what normals may leave the plane normal to the axis, or a cone, by
RADIAL = 0.8  # least cosine between a normal and the radius


@dataclass(frozen=True, eq=False)
class Projection:
    """Seen along a direction: `axes` (2, 3) are orthonormal, the coordinates of the plane."""

    origin: Array
    axes: Array
    names: tuple[str, str]

    def laid(self, points: Array) -> Array:
        """Points (..., 3) in the plane, (..., 2)."""
        return (points - self.origin) @ self.axes.T

    def turned(self, points: Array, vectors: Array) -> Array:
        """Vectors (n, 3) at points (n, 3) in the plane, (n, 2)."""
        return vectors @ self.axes.T


@dataclass(frozen=True, eq=False)
class Unrolled:
    """Unrolled about an axis: `axes` (3, 3) are orthonormal, the last along it.

    The cut is opposite the first of `axes`, where the angle is `start`.
    """

    centre: Array
    axes: Array
    radius: float
    start: float
    names: tuple[str, str]

    def laid(self, points: Array) -> Array:
        """Points (..., k, 3) of patches in the plane, none of them cut in two."""
        local = (points - self.centre) @ self.axes.T
        middle = local.mean(axis=-2, keepdims=True)
        about = np.arctan2(middle[..., 1], middle[..., 0])
        cos, sin = np.cos(about), np.sin(about)
        ahead = local[..., 1] * cos - local[..., 0] * sin
        outwards = local[..., 0] * cos + local[..., 1] * sin
        angle = self.start + about + np.arctan2(ahead, outwards)
        along = self.centre @ self.axes[2] + local[..., 2]
        return np.stack([self.radius * angle, along], axis=-1)

    def turned(self, points: Array, vectors: Array) -> Array:
        """Vectors (n, 3) at points (n, 3) in the plane, (n, 2): along the arc and the axis."""
        radial = (points - self.centre) @ self.axes[:2].T
        radial /= np.linalg.norm(radial, axis=1, keepdims=True)
        local = vectors @ self.axes.T
        return np.column_stack([local[:, 1] * radial[:, 0] - local[:, 0] * radial[:, 1],
                                local[:, 2]])  # fmt: skip


def view_of(points: Array, normals: Array) -> Projection | Unrolled:
    """The view of contacts at `points` (n, 3) with unit `normals` (n, 3)."""
    mean = normals.mean(axis=0)
    if len(points) > 3 and np.linalg.norm(mean) < FLAT:
        view = _unrolled(points, normals)
        if view is not None:
            return view
    spread = np.ptp(points, axis=0)
    flat = int(np.argmin(spread))
    if spread[flat] <= 0.5 * np.sort(spread)[1]:
        kept = [k for k in range(3) if k != flat]
        return Projection(np.zeros(3), np.eye(3)[kept], ("xyz"[kept[0]], "xyz"[kept[1]]))
    origin = points.mean(axis=0)
    axes = np.linalg.svd(points - origin, full_matrices=False)[2][:2]
    return Projection(origin, axes, ("first principal direction", "second principal direction"))


def _unrolled(points: Array, normals: Array) -> Unrolled | None:
    """About the axis that the normals turn around; None where there is no such axis."""
    offset = normals - normals.mean(axis=0)
    _, size, directions = np.linalg.svd(offset, full_matrices=False)
    if size[2] > AROUND * size[1]:
        return None
    axis: Array = directions[2] * np.sign(directions[2, np.abs(directions[2]).argmax()])
    across = normals - np.outer(normals @ axis, axis)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    if (length < RADIAL * np.sqrt(0.5)).any():  # flatter than a cone of 55 degrees
        return None
    across /= length
    beside = np.eye(3) - across[:, :, None] * across[:, None, :]  # off the line of a normal
    flat = np.eye(3) - np.outer(axis, axis)
    moments = np.einsum("ncd,nd->c", beside, points @ flat)
    centre: Array = flat @ np.linalg.pinv(flat @ beside.sum(axis=0) @ flat) @ flat @ moments
    radial = points @ flat - centre
    radius = np.linalg.norm(radial, axis=1)
    cosine = np.einsum("nc,nc->n", radial, across)
    if (np.abs(cosine) < RADIAL * radius).any() or not radius.min() > 0:
        return None
    first = _middle(radial / radius[:, None], axis)
    axes = np.stack([first, np.cross(axis, first), axis])
    start, names = 0.0, ("arc around the axis", "along the axis")
    k = int(axis.argmax())
    if axis[k] > 1 - 1e-6:  # a global axis: arcs begin at the next one, x, y, z, x, ...
        zero, ahead = (k + 1) % 3, (k + 2) % 3
        start = float(np.arctan2(first[ahead], first[zero]))
        names = (f"arc around {'xyz'[k]} from {'xyz'[zero]}", "xyz"[k])
    return Unrolled(centre, axes, float(radius.mean()), start, names)


def _middle(radial: Array, axis: Array) -> Array:
    """The direction from which the cut is farthest: opposite the middle of the widest gap."""
    one = radial[0]
    other = np.cross(axis, one)
    angles = np.sort(np.arctan2(radial @ other, radial @ one))
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    widest = int(gaps.argmax())
    middle = angles[widest] + 0.5 * gaps[widest] + np.pi
    return np.cos(middle) * one + np.sin(middle) * other
