"""Obstacles as nodes see them that supports hold in some directions.

Forces and motions of such nodes have free components alone, see `current`, and so must their
normals, as those between bodies do (`faced_normals`): along a normal that leaves them a
frictionless force would have a tangential part, and no state would fulfil the law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
HELD = 1e-9  # free part of a normal below which supports hold the node in it


@dataclass(frozen=True, eq=False)
class FreeNormals:
    """An obstacle with normals at nc nodes that lie in their free components, free (nc, d).

    Gaps are those of the obstacle.  Nodes that are held along its normal keep it.
    """

    obstacle: Any
    free: NDArray[np.bool_]

    def gap(self, points: Array) -> Array:
        """(nc,)."""
        return np.asarray(self.obstacle.gap(points))

    def gap_slopes(self, points: Array) -> Array:
        """(nc, d)."""
        return np.asarray(self.obstacle.gap_slopes(points))

    def _cut(self, points: Array) -> tuple[Array, Array, Array]:
        """Unit normals (nc, d), the length (nc, 1) of what was cut, and components (nc, d)."""
        normals = self.obstacle.normals(points)
        length = np.linalg.norm(normals * self.free, axis=1, keepdims=True)
        kept = self.free | (length < HELD)
        normals = normals * kept
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return normals / length, length, kept

    def normals(self, points: Array) -> Array:
        """(nc, d)."""
        return self._cut(points)[0]

    def normal_slopes(self, points: Array) -> Array:
        """(nc, d, d)."""
        n, length, kept = self._cut(points)
        slopes = self.obstacle.normal_slopes(points) * kept[:, :, None]
        along = np.einsum("pi,pij->pj", n, slopes)
        return np.asarray((slopes - n[:, :, None] * along[:, None, :]) / length[:, :, None])
