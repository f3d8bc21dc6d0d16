"""The contact problem of rigid bodies in compiled passes: W, free velocities, impulses.

A row k of contact c has the axis a_k, its normal or a tangent, and the arms s, m from the
centres of mass of slave and master, so that

    u_k = a_k . (v + omega x s)_slave - a_k . (v + omega x m)_master
    W_ij = sum over the bodies b of both, s_i s_j (A_i A_j^T / m_b + B_i I_b^-1 B_j^T)

with the rows A of axes and B of arm x axis, and the inertia I_b = R J R^T in global axes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from .apart import cross

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Rows(NamedTuple):
    """Contacts and joints: bodies (n,), axes (n, 3, 3) by rows, arms (n, 3)."""

    slave: Index
    master: Index
    axes: Array
    arms: Array  # of the slave
    master_arms: Array


def delassus(rows: Rows, masses: Array, inverse: Array) -> tuple[Any, Any, Array, Any]:
    """W as the arrays of `BlockRows`; inverse (n, 3, 3) of the inertia in global axes."""
    indptr, count = coupled(rows.slave, rows.master, len(masses))
    indices, data = np.empty(count, np.int32), np.empty((count, 3, 3))
    diagonal = np.empty(len(rows.slave), np.int32)
    fill_blocks(*rows, masses, inverse, indptr, indices, data, diagonal)
    return indptr, indices, data, diagonal


def velocities(rows: Rows, v: Array, omega: Array) -> Array:
    """u (n, 3) of bodies that move with v and omega, (b, 3), in global axes."""
    return row_velocities(*rows, v, omega)


def impulses(rows: Rows, r: Array, bodies: int) -> tuple[Array, Array]:
    """Impulse and angular impulse about its centre of mass of each body, (b, 3)."""
    return row_impulses(*rows, r, bodies)


@njit(cache=True, error_model="numpy")
def frames_of(normals):
    """Normal and two tangents, (n, 3, 3) by rows, right-handed."""
    out, helper = np.empty((len(normals), 3, 3)), np.empty(3)
    for i in range(len(normals)):
        n, first, second = normals[i], out[i, 1], out[i, 2]
        least = 0
        for k in range(1, 3):
            if abs(n[k]) < abs(n[least]):
                least = k
        for k in range(3):
            out[i, 0, k], helper[k] = n[k], 1.0 if k == least else 0.0
        first[0], first[1], first[2] = cross(n, helper)
        length = np.sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2])
        for k in range(3):
            first[k] /= length
        second[0], second[1], second[2] = cross(n, first)
    return out


@njit(cache=True, error_model="numpy")
def rows_at(slave, master, feature, points, normals, gaps, x):  # noqa: PLR0913
    """(keys, axes, arms, arms of masters, deepest overlap >= 0) of contacts of bodies at x.

    keys (n, 3): slave, master, feature.  The ground has arms that are not read.
    """
    n = len(slave)
    keys, arms, others = np.empty((n, 3), np.int64), np.empty((n, 3)), np.zeros((n, 3))
    deepest = 0.0
    for c in range(n):
        keys[c, 0], keys[c, 1], keys[c, 2] = slave[c], master[c], feature[c]
        deepest = max(deepest, -gaps[c])
        for k in range(3):
            arms[c, k] = points[c, k] - x[slave[c], k]
            if master[c] >= 0:
                others[c, k] = points[c, k] - x[master[c], k]
    return keys, frames_of(normals), arms, others, deepest


@njit(cache=True, error_model="numpy")
def _of_bodies(slave, master, bodies):
    """Contacts of each body: first (b + 1,), contacts in order."""
    first = np.zeros(bodies + 1, np.int64)
    for c in range(len(slave)):
        first[slave[c] + 1] += 1
        if master[c] >= 0:
            first[master[c] + 1] += 1
    for b in range(bodies):
        first[b + 1] += first[b]
    place, members = first.copy(), np.empty(first[bodies], np.int64)
    for c in range(len(slave)):
        members[place[slave[c]]] = c
        place[slave[c]] += 1
        if master[c] >= 0:
            members[place[master[c]]] = c
            place[master[c]] += 1
    return first, members


@njit(cache=True, error_model="numpy")
def coupled(slave, master, bodies):
    """indptr (n + 1,) of the contacts that share a body, and how many blocks there are."""
    first, members = _of_bodies(slave, master, bodies)
    n = len(slave)
    seen, indptr = np.full(n, -1, np.int64), np.zeros(n + 1, np.int32)
    count = 0
    for i in range(n):
        for side in range(2):
            b = slave[i] if side == 0 else master[i]
            if b >= 0:
                for k in range(first[b], first[b + 1]):
                    j = members[k]
                    if seen[j] != i:
                        seen[j] = i
                        count += 1
        indptr[i + 1] = count
    return indptr, count


@njit(cache=True, error_model="numpy")
def fill_blocks(  # noqa: PLR0913
    slave, master, axes, arms, master_arms, masses, inverse, indptr, indices, data, diagonal
):
    """Fill the columns of each row in ascending order, and its blocks."""
    n = len(slave)
    first, members = _of_bodies(slave, master, len(masses))
    turning = np.zeros((2, n, 3, 3))  # arm x axis of slave and of master
    spun = np.zeros((2, n, 3, 3))  # the angular velocities that it makes
    for c in range(n):
        _turned_axes(arms[c], axes[c], inverse[slave[c]], turning[0, c], spun[0, c])
        if master[c] >= 0:
            b = master[c]
            _turned_axes(master_arms[c], axes[c], inverse[b], turning[1, c], spun[1, c])
    seen = np.full(n, -1, np.int64)
    for i in range(n):
        at = indptr[i]
        for side in range(2):
            b = slave[i] if side == 0 else master[i]
            if b < 0:
                continue
            for m in range(first[b], first[b + 1]):
                j = members[m]
                if seen[j] != i:
                    seen[j] = i
                    indices[at] = j
                    at += 1
        _sort_inplace(indices, indptr[i], at)
        for place in range(indptr[i], at):
            j = indices[place]
            block = data[place]
            block[:] = 0.0
            if i == j:
                diagonal[i] = place
            for p in range(2):
                b = slave[i] if p == 0 else master[i]
                if b < 0:
                    continue
                for s in range(2):
                    other = slave[j] if s == 0 else master[j]
                    if other != b:
                        continue
                    sign = 1.0 if p == s else -1.0
                    own, its, mobility = turning[p, i], spun[s, j], sign / masses[b]
                    for k in range(3):
                        for e in range(3):
                            moved = turned = 0.0
                            for d in range(3):
                                moved += axes[i, k, d] * axes[j, e, d]
                                turned += own[k, d] * its[e, d]
                            block[k, e] += mobility * moved + sign * turned


@njit(cache=True, error_model="numpy")
def _turned_axes(arm, axes, inverse, turning, spun):
    """arm x axis, and that times the inverse inertia, of three axes by rows."""
    for k in range(3):
        a = axes[k]
        turning[k, 0] = arm[1] * a[2] - arm[2] * a[1]
        turning[k, 1] = arm[2] * a[0] - arm[0] * a[2]
        turning[k, 2] = arm[0] * a[1] - arm[1] * a[0]
        for d in range(3):
            spun[k, d] = 0.0
            for f in range(3):
                spun[k, d] += inverse[d, f] * turning[k, f]


@njit(cache=True, error_model="numpy")
def _sort_inplace(numbers, begin, end):
    """A short part that is nearly in order."""
    for a in range(begin + 1, end):
        number, b = numbers[a], a
        while b > begin and numbers[b - 1] > number:
            numbers[b] = numbers[b - 1]
            b -= 1
        numbers[b] = number


@njit(cache=True, error_model="numpy")
def row_velocities(slave, master, axes, arms, master_arms, v, omega):  # noqa: PLR0913
    """`velocities`, for kernels."""
    u = np.empty((len(slave), 3))
    for c in range(len(slave)):
        b = slave[c]
        x, y, z = cross(omega[b], arms[c])
        x, y, z = v[b, 0] + x, v[b, 1] + y, v[b, 2] + z
        if master[c] >= 0:
            b = master[c]
            e, f, g = cross(omega[b], master_arms[c])
            x, y, z = x - v[b, 0] - e, y - v[b, 1] - f, z - v[b, 2] - g
        for k in range(3):
            u[c, k] = axes[c, k, 0] * x + axes[c, k, 1] * y + axes[c, k, 2] * z
    return u


@njit(cache=True, error_model="numpy")
def row_impulses(slave, master, axes, arms, master_arms, r, bodies):  # noqa: PLR0913
    """`impulses`, for kernels."""
    push, turn = np.zeros((bodies, 3)), np.zeros((bodies, 3))
    p = np.empty(3)
    for c in range(len(slave)):
        for d in range(3):
            p[d] = r[c, 0] * axes[c, 0, d] + r[c, 1] * axes[c, 1, d] + r[c, 2] * axes[c, 2, d]
        for side in range(2):
            b, arm = (slave[c], arms[c]) if side == 0 else (master[c], master_arms[c])
            if b < 0:
                continue
            sign, torque = 1.0 if side == 0 else -1.0, cross(arm, p)
            for d in range(3):
                push[b, d] += sign * p[d]
                turn[b, d] += sign * torque[d]
    return push, turn


@njit(cache=True, error_model="numpy")
def turned(orientation, angle):
    """Quaternions (b, 4) times those of rotations by angle (b, 3), in own axes."""
    out = orientation.copy()
    for b in range(len(out)):
        turned_by_inplace(out[b], angle[b])
    return out


@njit(cache=True, error_model="numpy")
def turned_by_inplace(orientation, angle):
    """A quaternion (4,) times that of a rotation (3,), in own axes."""
    size = np.sqrt(angle[0] ** 2 + angle[1] ** 2 + angle[2] ** 2)
    half = 0.5 * size
    factor = np.sin(half) / size if size > 1e-8 else 0.5 - size * size / 48
    w, x, y, z = orientation
    c, i, j, k = np.cos(half), factor * angle[0], factor * angle[1], factor * angle[2]
    q0, q1 = w * c - x * i - y * j - z * k, w * i + x * c + y * k - z * j
    q2, q3 = w * j - x * k + y * c + z * i, w * k + x * j - y * i + z * c
    length = np.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    orientation[0], orientation[1] = q0 / length, q1 / length
    orientation[2], orientation[3] = q2 / length, q3 / length


@njit(cache=True, error_model="numpy")
def rotations(orientation):
    """Rotation matrices (b, 3, 3) of unit quaternions (b, 4)."""
    out = np.empty((len(orientation), 3, 3))
    for b in range(len(orientation)):
        w, x, y, z = orientation[b]
        out[b, 0, 0] = 1 - 2 * (y * y + z * z)
        out[b, 0, 1] = 2 * (x * y - w * z)
        out[b, 0, 2] = 2 * (x * z + w * y)
        out[b, 1, 0] = 2 * (x * y + w * z)
        out[b, 1, 1] = 1 - 2 * (x * x + z * z)
        out[b, 1, 2] = 2 * (y * z - w * x)
        out[b, 2, 0] = 2 * (x * z - w * y)
        out[b, 2, 1] = 2 * (y * z + w * x)
        out[b, 2, 2] = 1 - 2 * (x * x + y * y)
    return out


@njit(cache=True, error_model="numpy")
def levers_of(slave, master, axes, arms, master_arms, masses, inverse):  # noqa: PLR0913
    """G (n, 2, 3, 6) with W = G G^T: rows on slave and master in the metric of the masses.

    A row is (±a / sqrt(m), ±(arm x a) C) with C C^T = I^-1, `inverse` (b, 3, 3) in global axes.
    """
    n, bodies = len(slave), len(masses)
    levers, C = np.zeros((n, 2, 3, 6)), np.zeros((bodies, 3, 3))
    for b in range(bodies):
        for d in range(3):
            for e in range(d + 1):
                left = inverse[b, d, e]
                for k in range(e):
                    left -= C[b, d, k] * C[b, e, k]
                if d == e and not left > 0.0:
                    raise np.linalg.LinAlgError("the inertia of a body is not definite")
                C[b, d, e] = np.sqrt(left) if d == e else left / C[b, e, e]
    for i in range(n):
        for p in range(2):
            b, arm = (slave[i], arms[i]) if p == 0 else (master[i], master_arms[i])
            if b < 0:
                continue
            sign = 1.0 if p == 0 else -1.0
            light = sign / np.sqrt(masses[b])
            for k in range(3):
                a, row = axes[i, k], levers[i, p, k]
                turning = cross(arm, a)
                for d in range(3):
                    row[d] = light * a[d]
                    for e in range(d, 3):  # C is lower triangular
                        row[3 + d] += sign * turning[e] * C[b, e, d]
    return levers
