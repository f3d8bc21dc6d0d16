"""From where a model is seen: a parallel projection of its bodies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TURN, LIFT = 30.0, 24.0  # degrees aside from the thinnest direction, and above the horizon


@dataclass(frozen=True, eq=False)
class Camera:
    """Rows of `plane` (2, dim): to the right and up; toward (dim,): to the viewer, 3D only."""

    plane: Array
    toward: Array | None = None

    @classmethod
    def at(cls, azimuth: float, elevation: float) -> Camera:
        """Seen from above by `elevation`, from the y axis turned by `azimuth`; degrees.

        (0, 0) has x to the right and z up; (90, 0) y to the right; (0, 90) is a plan.
        """
        a, e = math.radians(azimuth), math.radians(elevation)
        toward = np.array([math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)])
        right = np.array([math.cos(a), math.sin(a), 0.0])
        return cls(np.stack([right, np.cross(toward, right)]), toward)

    @classmethod
    def of(cls, points: Array) -> Camera:
        """The usual view of points (n, dim): in 3D from where they are broad."""
        if points.shape[1] == 2:
            return cls(np.eye(2))
        x, y, _ = np.ptp(points, axis=0)
        return cls.at(TURN if x >= y * (1 - 1e-9) else 90.0 - TURN, LIFT)

    def project(self, vectors: Array) -> Array:
        """Coordinates in the plane of the picture, (..., 2)."""
        return vectors @ self.plane.T

    def depth(self, points: Array) -> Array:
        """How near points are to the viewer, (...); 0 in 2D."""
        return np.zeros(points.shape[:-1]) if self.toward is None else points @ self.toward
