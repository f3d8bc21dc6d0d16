"""Exact solution of a single 3D contact, compiled: u = A r + b with Coulomb or Tresca friction.

Coulomb, with e = u_T / |u_T| = (cos t, sin t) while slipping:

    open   r = 0                       if b_N >= 0
    stick  r = -A^-1 b                 if |r_T| <= mu r_N
    slip   u_N = 0:  r_N = -b_N / (A_NN - mu A_NT.e) > 0,  r_T = -mu r_N e,  u_T = s e, s >= 0.

Multiplied by the denominator, u_T x e = 0 is a trigonometric polynomial of degree two,

    g(t) = (p + Q e) . e_perp = 0,   s ~ (p + Q e) . e,
    p = A_NN b_T - b_N A_TN,   Q = mu (b_N A_TT - b_T A_NT),

with at most four roots.  A Newton iteration from the last sliding direction finds the root in
nearly all calls; otherwise every sign change on a fine circle is refined by bisection.  Tresca
friction has the same equation with another p and Q.  When A has no admissible solution (A
singular, or mu beyond existence) the best point of a projection iteration is returned with
state STICK or SLIP by its own law: the judge sees such a contact.

Where several states fit (large mu) the first in the order open, stick, slip is taken.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

OPEN, SLIP, STICK = 0, 1, 2
NEWTON_STEPS = 12
ANGLES = 64  # points of the circle searched when Newton fails: roots are at most four


@njit(cache=True)
def _slip_angle(p1, p2, q11, q12, q21, q22, d0, d1, d2, c, s):  # noqa: PLR0913
    """Direction (cos, sin) with (p + Q e) x e = 0, (p + Q e).e >= 0, d0 - d1 c - d2 s > 0.

    (c, s) is the first guess; the last returned flag is False when there is no such direction.
    """
    size = math.hypot(p1, p2) + abs(q11) + abs(q12) + abs(q21) + abs(q22)
    if size == 0.0:
        return c, s, True
    for _ in range(NEWTON_STEPS):
        v1 = p1 + q11 * c + q12 * s
        v2 = p2 + q21 * c + q22 * s
        g = c * v2 - s * v1
        along = c * v1 + s * v2
        # e_perp . Q e_perp - e . (p + Q e)
        slope = s * s * q11 - s * c * (q12 + q21) + c * c * q22 - along
        if abs(g) <= 4e-16 * size:
            if along >= 0.0 and d0 - d1 * c - d2 * s > 0.0 and slope <= 0.0:
                return c, s, True
            break
        if slope >= 0.0:
            break
        step = max(min(-g / slope, 0.7), -0.7)
        c, s = c * math.cos(step) - s * math.sin(step), s * math.cos(step) + c * math.sin(step)
        length = math.hypot(c, s)
        c, s = c / length, s / length
        if abs(step) < 1e-15:
            v1 = p1 + q11 * c + q12 * s
            v2 = p2 + q21 * c + q22 * s
            if c * v1 + s * v2 >= 0.0 and d0 - d1 * c - d2 * s > 0.0:
                return c, s, True
            break
    return _scan_angles(p1, p2, q11, q12, q21, q22, d0, d1, d2, size, c, s)


@njit(cache=True)
def _scan_angles(p1, p2, q11, q12, q21, q22, d0, d1, d2, size, near_c, near_s):  # noqa: PLR0913
    """The admissible root nearest to a direction, by bisection of every sign change."""
    best, best_c, best_s = -2.0, near_c, near_s
    width = 2.0 * math.pi / ANGLES
    for k in range(ANGLES):
        a = width * (k - 0.5)
        b = a + width
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        ga = ca * (p2 + q21 * ca + q22 * sa) - sa * (p1 + q11 * ca + q12 * sa)
        gb = cb * (p2 + q21 * cb + q22 * sb) - sb * (p1 + q11 * cb + q12 * sb)
        if (ga > 0.0) == (gb > 0.0) and min(abs(ga), abs(gb)) > 1e-14 * size:
            continue
        for _ in range(60):
            m = 0.5 * (a + b)
            cm, sm = math.cos(m), math.sin(m)
            gm = cm * (p2 + q21 * cm + q22 * sm) - sm * (p1 + q11 * cm + q12 * sm)
            if (gm > 0.0) == (ga > 0.0):
                a = m
            else:
                b = m
        m = 0.5 * (a + b)
        cm, sm = math.cos(m), math.sin(m)
        v1 = p1 + q11 * cm + q12 * sm
        v2 = p2 + q21 * cm + q22 * sm
        along, across = cm * v1 + sm * v2, cm * v2 - sm * v1
        admissible = along >= -1e-14 * size and abs(across) <= 1e-12 * size
        if admissible and d0 - d1 * cm - d2 * sm > 0.0:
            closeness = cm * near_c + sm * near_s
            if closeness > best:
                best, best_c, best_s = closeness, cm, sm
    return best_c, best_s, best > -2.0


@njit(cache=True)
def _solve3(A, b0, b1, b2):
    """-A^-1 b by cofactors, and whether A is regular to rounding."""
    c00 = A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1]
    c01 = A[1, 2] * A[2, 0] - A[1, 0] * A[2, 2]
    c02 = A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0]
    det = A[0, 0] * c00 + A[0, 1] * c01 + A[0, 2] * c02
    size = abs(A[0, 0] * A[1, 1] * A[2, 2])
    if not abs(det) > 1e-13 * size:
        return 0.0, 0.0, 0.0, False
    c10 = A[0, 2] * A[2, 1] - A[0, 1] * A[2, 2]
    c11 = A[0, 0] * A[2, 2] - A[0, 2] * A[2, 0]
    c12 = A[0, 1] * A[2, 0] - A[0, 0] * A[2, 1]
    c20 = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    c21 = A[0, 2] * A[1, 0] - A[0, 0] * A[1, 2]
    c22 = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    x0 = -(c00 * b0 + c10 * b1 + c20 * b2) / det
    x1 = -(c01 * b0 + c11 * b1 + c21 * b2) / det
    x2 = -(c02 * b0 + c12 * b1 + c22 * b2) / det
    return x0, x1, x2, True


@njit(cache=True)
def solve_coulomb(A, b0, b1, b2, mu, g1, g2):
    """(r_N, r_T1, r_T2, state) of one contact under Coulomb friction; (g1, g2) guesses r_T."""
    if b0 >= 0.0 or A[0, 0] <= 0.0:
        return 0.0, 0.0, 0.0, OPEN
    if mu == 0.0:
        return -b0 / A[0, 0], 0.0, 0.0, SLIP
    x0, x1, x2, regular = _solve3(A, b0, b1, b2)
    if regular and x0 > 0.0 and x1 * x1 + x2 * x2 <= mu * mu * x0 * x0:
        return x0, x1, x2, STICK
    length = math.hypot(g1, g2)
    if length == 0.0:
        g1, g2 = (x1, x2) if regular else (-b1, -b2)
        length = math.hypot(g1, g2)
    c, s = (-g1 / length, -g2 / length) if length > 0.0 else (1.0, 0.0)
    d1, d2 = mu * A[0, 1], mu * A[0, 2]
    c, s, found = _slip_angle(
        A[0, 0] * b1 - b0 * A[1, 0], A[0, 0] * b2 - b0 * A[2, 0],
        mu * (b0 * A[1, 1] - b1 * A[0, 1]), mu * (b0 * A[1, 2] - b1 * A[0, 2]),
        mu * (b0 * A[2, 1] - b2 * A[0, 1]), mu * (b0 * A[2, 2] - b2 * A[0, 2]),
        A[0, 0], d1, d2, c, s,
    )
    if found:
        r = -b0 / (A[0, 0] - d1 * c - d2 * s)
        return r, -mu * r * c, -mu * r * s, SLIP
    return _project_until_still(A, b0, b1, b2, mu)


@njit(cache=True)
def _project_until_still(A, b0, b1, b2, mu):
    """Fixed point r <- P_K(r - rho û): the safe way out for singular or overly coupled blocks."""
    size = 0.0
    for k in range(3):
        size = max(size, abs(A[k, 0]) + abs(A[k, 1]) + abs(A[k, 2]))
    rho = 1.0 / size
    r0, r1, r2, state = max(-b0 * rho, 0.0), 0.0, 0.0, STICK
    for _ in range(500):
        u0 = b0 + A[0, 0] * r0 + A[0, 1] * r1 + A[0, 2] * r2
        u1 = b1 + A[1, 0] * r0 + A[1, 1] * r1 + A[1, 2] * r2
        u2 = b2 + A[2, 0] * r0 + A[2, 1] * r1 + A[2, 2] * r2
        x0 = r0 - rho * (u0 + mu * math.hypot(u1, u2))
        x1, x2 = r1 - rho * u1, r2 - rho * u2
        t = math.hypot(x1, x2)
        if mu * t <= -x0:
            p0, p1, p2, state = 0.0, 0.0, 0.0, OPEN
        elif t <= mu * x0:
            p0, p1, p2, state = x0, x1, x2, STICK
        else:
            p0 = (x0 + mu * t) / (1.0 + mu * mu)
            p1, p2, state = mu * p0 * x1 / t, mu * p0 * x2 / t, SLIP
        move = abs(p0 - r0) + abs(p1 - r1) + abs(p2 - r2)
        r0, r1, r2 = p0, p1, p2
        if move <= 1e-15 * (abs(r0) + abs(r1) + abs(r2)):
            break
    return r0, r1, r2, state


@njit(cache=True)
def _disk(a11, a12, a21, a22, b1, b2, bound, g1, g2):  # noqa: PLR0913
    """r_T of u_T = A r_T + b with |r_T| <= bound, and whether it sticks."""
    det = a11 * a22 - a12 * a21
    if det > 0.0:
        x1 = -(a22 * b1 - a12 * b2) / det
        x2 = -(a11 * b2 - a21 * b1) / det
        if x1 * x1 + x2 * x2 <= bound * bound:
            return x1, x2, STICK
    length = math.hypot(g1, g2)
    if length == 0.0:
        g1, g2 = -b1, -b2
        length = math.hypot(g1, g2)
    c, s = (-g1 / length, -g2 / length) if length > 0.0 else (1.0, 0.0)
    c, s, _ = _slip_angle(
        b1, b2, -bound * a11, -bound * a12, -bound * a21, -bound * a22, 1.0, 0.0, 0.0, c, s
    )
    return -bound * c, -bound * s, SLIP


@njit(cache=True)
def solve_tresca(A, b0, b1, b2, bound, g1, g2):
    """(r_N, r_T1, r_T2, state) of one contact under Tresca friction; open contacts may slide."""
    r1, r2, slides = _disk(
        A[1, 1], A[1, 2], A[2, 1], A[2, 2], b1, b2, bound, g1, g2
    )
    if b0 + A[0, 1] * r1 + A[0, 2] * r2 >= 0.0 or A[0, 0] <= 0.0:
        return 0.0, r1, r2, OPEN
    k1, k2 = A[1, 0] / A[0, 0], A[2, 0] / A[0, 0]
    r1, r2, slides = _disk(
        A[1, 1] - k1 * A[0, 1], A[1, 2] - k1 * A[0, 2],
        A[2, 1] - k2 * A[0, 1], A[2, 2] - k2 * A[0, 2],
        b1 - k1 * b0, b2 - k2 * b0, bound, r1, r2,
    )
    return max(-(b0 + A[0, 1] * r1 + A[0, 2] * r2) / A[0, 0], 0.0), r1, r2, slides


@njit(cache=True)
def solve_contact(A, b0, b1, b2, coefficient, tresca, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2, state) of one contact under either law."""
    if tresca:
        return solve_tresca(A, b0, b1, b2, coefficient, g1, g2)
    return solve_coulomb(A, b0, b1, b2, coefficient, g1, g2)


@njit(cache=True)
def classify_contacts(A, u, r, coefficient, tresca, status, sliding):  # noqa: PLR0913
    """Fill status and sliding, (nc,), by one exact local solve per contact about (r, u)."""
    for i in range(len(coefficient)):
        a = A[i]
        b0 = u[i, 0] - a[0, 0] * r[i, 0] - a[0, 1] * r[i, 1] - a[0, 2] * r[i, 2]
        b1 = u[i, 1] - a[1, 0] * r[i, 0] - a[1, 1] * r[i, 1] - a[1, 2] * r[i, 2]
        b2 = u[i, 2] - a[2, 0] * r[i, 0] - a[2, 1] * r[i, 1] - a[2, 2] * r[i, 2]
        x0, x1, x2, state = solve_contact(
            a, b0, b1, b2, coefficient[i], tresca, r[i, 1], r[i, 2]
        )
        status[i] = state
        if state == OPEN and tresca:
            det = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
            y1 = a[1, 2] * b2 - a[2, 2] * b1
            y2 = a[2, 1] * b1 - a[1, 1] * b2
            sliding[i] = not (det > 0.0 and math.hypot(y1, y2) <= coefficient[i] * det)
        else:
            sliding[i] = state != STICK


def solve_one(A, b, coefficient: float, tresca: bool = False):
    """(r, u, state) of one contact given as arrays A (3, 3), b (3,); for tests and teaching."""
    A, b = np.ascontiguousarray(A, dtype=float), np.asarray(b, dtype=float)
    *r, state = solve_contact(A, b[0], b[1], b[2], float(coefficient), tresca, 0.0, 0.0)
    r = np.array(r)
    return r, A @ r + b, state
