"""Bodies that turn freely: W and the orientation after a time h without torque.

J W' = J W x W, Q' = Q W / 2, with W in own axes.  W by Gauss' method with three stages, which
keeps energy and the size of the moment of momentum as it stands, then Q by Magnus' expansion
from the stages [B], both of order six; Q is turned by what is left so that the moment of
momentum, R J W, stays where it was.  Turns of more than `LONGEST` are taken in parts.

[B] S. Blanes, F. Casas, J. Ros, "Improved high order integrators based on the Magnus
expansion", BIT 40 (2000), equation (32), for products from the other side.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from .apart import cross, dot
from .rows import turned_by_inplace

STEPS = 60  # iterations for the stages at most
CLOSE = 1e-16  # of the angular velocity, the change at which they end
LONGEST = 0.25  # radians in a part: its error is below 1e-9
MOST = 1 << 20  # parts: a body that turns more often in a step is left to its rounding
ROOT = np.sqrt(15.0)
STAGES = (
    (5 / 36, 2 / 9 - ROOT / 15, 5 / 36 - ROOT / 30),
    (5 / 36 + ROOT / 24, 2 / 9, 5 / 36 - ROOT / 24),
    (5 / 36 + ROOT / 30, 2 / 9 + ROOT / 15, 5 / 36),
)
WEIGHTS = (5 / 18, 4 / 9, 5 / 18)


@njit(cache=True, error_model="numpy")
def turned_freely(inertia, inverse, orientation, spin, h):
    """Quaternions (b, 4) and angular velocities (b, 3) in own axes after h, from those given.

    inertia, its inverse (b, 3, 3) in own axes.  Raises LinAlgError where they are no numbers.
    """
    Q, W = orientation.copy(), spin.copy()
    stages, slopes, angle = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for b in range(len(spin)):
        size = np.sqrt(dot(W[b], W[b]))
        if not np.isfinite(size):
            raise np.linalg.LinAlgError("the turning of a body is not finite")
        parts = min(max(int(np.ceil(size * h / LONGEST)), 1), MOST)
        for _ in range(parts):
            _part_inplace(inertia[b], inverse[b], Q[b], W[b], h / parts, stages, slopes, angle)
    return Q, W


@njit(cache=True, error_model="numpy")
def _part_inplace(J, inverse, Q, W, h, stages, slopes, angle):  # noqa: PLR0913
    """Q (4,) and W (3,) after h; the rest is room."""
    size = max(abs(W[0]), abs(W[1]), abs(W[2]))
    for i in range(3):
        _slope(J, inverse, W, slopes[i])
    for _ in range(STEPS):
        change = 0.0
        for i in range(3):
            for d in range(3):
                stages[i, d] = W[d]
                for j in range(3):
                    stages[i, d] += h * STAGES[i][j] * slopes[j, d]
            before = slopes[i, 0], slopes[i, 1], slopes[i, 2]
            _slope(J, inverse, stages[i], slopes[i])
            for d in range(3):
                change = max(change, abs(slopes[i, d] - before[d]))
        if not h * change > CLOSE * size:
            break
    moment = _times(J, W)
    for d in range(3):
        for j in range(3):
            W[d] += h * WEIGHTS[j] * slopes[j, d]
    _angle_inplace(stages, h, angle)
    own = np.empty(3)
    ended = _times(J, W)
    own[0], own[1], own[2] = ended
    back = _turned(own, angle)  # where the moment of momentum has come to, in the first axes
    length = moment[0] ** 2 + moment[1] ** 2 + moment[2] ** 2
    if length > 0.0:
        left = cross(back, moment)
        for d in range(3):
            own[d] = left[d] / length
        turned_by_inplace(Q, own)
    turned_by_inplace(Q, angle)


@njit(cache=True, error_model="numpy")
def twice_energy(J, W):
    """W J W of a body that turns with W (3,)."""
    return dot(W, _times(J, W))


@njit(cache=True, error_model="numpy")
def _times(J, w):
    return (
        J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2],
        J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2],
        J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2],
    )


@njit(cache=True, error_model="numpy")
def _slope(J, inverse, w, out):
    """W' of W."""
    out[0], out[1], out[2] = _times(inverse, cross(_times(J, w), w))


@njit(cache=True, error_model="numpy")
def _angle_inplace(W, h, angle):
    """Rotation (3,) of a part with angular velocities W (3, 3) at its stages."""
    a, b, c, d, e = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        a[k] = h * W[1, k]
        b[k] = h * ROOT / 3 * (W[2, k] - W[0, k])
        c[k] = h * 10 / 3 * (W[2, k] - 2 * W[1, k] + W[0, k])
    first = cross(b, a)
    for k in range(3):
        d[k] = 2 * c[k] + first[k]
    second = cross(a, d)
    for k in range(3):
        d[k] = -20 * a[k] - c[k] + first[k]
        e[k] = b[k] + second[k] / 60
    third = cross(e, d)
    for k in range(3):
        angle[k] = a[k] + c[k] / 12 + third[k] / 240


@njit(cache=True, error_model="numpy")
def _turned(vector, angle):
    """A vector (3,) turned by a rotation (3,), Rodrigues' formula."""
    size = np.sqrt(dot(angle, angle))
    one = np.sin(size) / size if size > 1e-8 else 1.0 - size * size / 6
    half = np.sin(0.5 * size) / (0.5 * size) if size > 1e-8 else 1.0 - size * size / 24
    first = cross(angle, vector)
    second = cross(angle, first)
    two = 0.5 * half * half
    return (
        vector[0] + one * first[0] + two * second[0],
        vector[1] + one * first[1] + two * second[1],
        vector[2] + one * first[2] + two * second[2],
    )
