"""Small motions of points as one rigid body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rigid_modes(points: Array, chosen: NDArray[np.bool_] | None = None) -> Array:
    """Translations, then rotations about the centre scaled to size 1: (n dim, 3 or 6).

    points (n, dim); chosen (n,): only these rows, of the same motions.
    """
    centre, size = centre_and_size(points)
    return modes_about((points if chosen is None else points[chosen]) - centre, size)


def centre_and_size(points: Array) -> tuple[Array, float]:
    """About which points (n, dim) turn, and what their rotations are scaled with."""
    centre = points.mean(axis=0)
    size = np.abs([points.max(axis=0) - centre, points.min(axis=0) - centre]).max()
    return centre, float(size) if size > 0 else 1.0


def modes_about(arms: Array, size: float | Array) -> Array:
    """The same of arms (n, dim) from the centre; size: of all, or of each (n, 1)."""
    x = arms / size
    n, dim = x.shape
    out = np.zeros((n, dim, 3 if dim == 2 else 6))
    out[:, range(dim), range(dim)] = 1.0
    if dim == 2:
        out[:, 0, 2], out[:, 1, 2] = -x[:, 1], x[:, 0]
    else:
        for k in range(3):  # e_k x (x, y, z)
            i, j = (k + 1) % 3, (k + 2) % 3
            out[:, i, 3 + k], out[:, j, 3 + k] = -x[:, j], x[:, i]
    return out.reshape(n * dim, out.shape[2])
