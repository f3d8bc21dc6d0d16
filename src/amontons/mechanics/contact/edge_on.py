"""How far a warped facet may be projected: it fades before its outline crosses itself.

Seen along the normal n of a slave facet, the corners of a quadrilateral of the master have

    sigma_c = n . a_c / n . a,    a_c = (x_c+1 - x_c) x (x_c-1 - x_c),    sum_c a_c = 4 a,  (1)

a its area vector, of which 1 is the mean.  Where all are positive the outline is convex, and
Newton's method (`plane_shapes.reference`) finds the reference point of every point in it.  A
plane facet has sigma_c = tau_c = a . a_c / a . a from wherever it is seen.  One that is warped,
however little, loses a corner before it is seen edge-on, and its outline crosses itself:
integrals over that are of no use.  So they, and all that follows, are taken times

    w = prod_c S(q_c),   q_c = (sigma_c tau_c + LEAST^2) / (tau_c^2 + LEAST^2),             (2)

S rising from 0 at GONE to 1 at WHOLE, t^3 (10 - 15 t + 6 t^2), with two continuous derivatives.
q is the part of a corner's area that the warp leaves; where warps turn normals by an angle v it
is 1 - v tan(b) as seen from b off the normal: facets of a fine mesh are whole until they are
seen all but edge-on, when hardly any of them faces anybody.  LEAST leaves corners alone that
have no area of their own, as where nodes coincide.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = NDArray[Any]  # real, or complex in the search for derivatives
GONE, WHOLE = 0.1, 0.4
LEAST = 1e-3
STEP = 1e-100


def rising(t: Values) -> Values:
    """S of (2) with 0 as GONE and 1 as WHOLE."""
    t = np.where(t.real < 1, np.where(t.real > 0, t, 0.0), 1.0)
    return np.asarray(t**3 * (10 - 15 * t + 6 * t * t))


def visible(slave: Values, master: Values) -> Values:
    """w of (2), (k,), of quadrilaterals master (k, 4, 3) seen from facets slave (k, a, 3)."""
    normal = np.cross(slave[:, 2] - slave[:, 0], slave[:, -1] - slave[:, 1])
    ahead = np.roll(master, -1, axis=1) - master
    corners = np.cross(ahead, -np.roll(ahead, 1, axis=1))
    area = corners.sum(axis=1) / 4
    facing = (area * normal).sum(axis=1)
    size = (area * area).sum(axis=1)
    ok = (facing.real < 0) & (size.real > 0)
    facing, size = np.where(ok, facing, 1.0), np.where(ok, size, 1.0)
    sigma = (corners * normal[:, None]).sum(axis=2) / facing[:, None]
    tau = (corners * area[:, None]).sum(axis=2) / size[:, None]
    q = (sigma * tau + LEAST**2) / (tau * tau + LEAST**2)
    return np.where(ok, np.prod(rising((q - GONE) / (WHOLE - GONE)), axis=1), 0.0)


def visible_slopes(slave: Array, master: Array) -> Array:
    """Derivatives of w by the coordinates of all corners, (k, (a + 4) 3), by complex steps."""
    (k, a, d), both = slave.shape, np.concatenate([slave, master], axis=1)
    ways = both[0].size
    moved = both.reshape(k, 1, ways) + 1j * STEP * np.eye(ways)
    moved = moved.reshape(k * ways, -1, d)
    return np.asarray(visible(moved[:, :a], moved[:, a:]).imag / STEP).reshape(k, ways)
