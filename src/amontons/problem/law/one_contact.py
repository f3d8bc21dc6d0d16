"""Exact solution of a single 3D contact, compiled: u = A r + b with Coulomb or Tresca friction.

Coulomb, with e = u_T / |u_T| = (cos t, sin t) while slipping:

    open   r = 0                       if b_N >= 0
    stick  r = -A^-1 b                 if |r_T| <= mu r_N
    slip   u_N = 0:  r_N = -b_N / (A_NN - mu A_NT.e) > 0,  r_T = -mu r_N e,  u_T = s e, s >= 0.

Multiplied by the denominator, u_T x e = 0 is a trigonometric polynomial of degree two,

    g(t) = (p + Q e) . e_perp = 0,   s ~ (p + Q e) . e,
    p = A_NN b_T - b_N A_TN,   Q = mu (b_N A_TT - b_T A_NT),

with at most four roots.  A Newton iteration from the last sliding direction finds the root in
nearly all calls; otherwise every sign change on the circle is refined by bisection.  Tresca
friction has the same equation with another p and Q.  When A has no admissible solution (A
singular, or mu beyond existence) the best point of a projection iteration is returned with
the state of that projection: the judge sees such a contact.

Where several states fit (large mu) the first in the order open, stick, slip is taken.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit
from .states import OPEN, SLIP, STICK

NEWTON_STEPS = 12
NEAR_STEPS = 8  # from the last direction of a sweep, before the careful search
NEAR = 1e-5  # step of that direction after which it is taken: its error is about the square
ANGLES = 16  # intervals of the circle searched when Newton fails: roots are at most four
PROJECTIONS = 500  # of the last resort
BISECTIONS = 55  # of such an interval: to the last bit
CANCELLED = 1e-15  # of an entry of A: what may be left of it where A is singular
ROUNDING = 1e-13  # relative size of what counts as zero at the edge between stick and slip


@njit(cache=True, error_model="numpy")
def _slip_direction(p1, p2, q11, q12, q21, q22, d0, d1, d2, size, c, s):  # noqa: PLR0913
    """Direction e = (cos, sin) with (p + Q e) x e = 0, (p + Q e).e >= 0, d0 - d.e > 0.

    (c, s) is the first guess, `size` the magnitude of p and Q before cancellation; the last
    value returned is False when there is no such direction.  Newton's method where the root
    attracts the flow t' = g(t), one step of that flow elsewhere.
    """
    step = 1.0
    for _ in range(NEWTON_STEPS):
        v1 = p1 + q11 * c + q12 * s
        v2 = p2 + q21 * c + q22 * s
        g = c * v2 - s * v1
        along = c * v1 + s * v2
        if abs(g) <= 4e-16 * size or abs(step) < 1e-15:
            if along >= -ROUNDING * size and d0 - d1 * c - d2 * s > 0.0:
                return c, s, True
            break
        slope = s * s * q11 - s * c * (q12 + q21) + c * c * q22 - along
        if slope < 0.0:
            step = max(min(-g / slope, 1.0), -1.0)
        else:
            step = 1.0 if g > 0.0 else -1.0
        c, s = c - s * step, s + c * step  # turns by atan(step)
        length = math.sqrt(c * c + s * s)
        c, s = c / length, s / length
    return _search_circle(p1, p2, q11, q12, q21, q22, d0, d1, d2, size, c, s)


@njit(cache=True, error_model="numpy")
def _search_circle(p1, p2, q11, q12, q21, q22, d0, d1, d2, size, near_c, near_s):  # noqa: PLR0913
    """Return the admissible root nearest to a direction, of all roots of g on the circle.

    Each interval is split where g'' and g' change sign, so that roots close together are found.
    """
    best, best_c, best_s = -2.0, near_c, near_s
    # g = a0 + a1 cos t + b1 sin t + a2 cos 2t + b2 sin 2t
    a0, a1, b1 = 0.5 * (q21 - q12), p2, -p1
    a2, b2 = 0.5 * (q21 + q12), 0.5 * (q22 - q11)
    width = 2.0 * math.pi / ANGLES
    cuts = np.empty(5)
    for k in range(ANGLES):
        cuts[0], cuts[4] = width * (k - 0.5), width * (k + 0.5)
        cuts[2] = _sign_change(0.0, -a1, -b1, -4.0 * a2, -4.0 * b2, cuts[0], cuts[4])
        cuts[1] = _sign_change(0.0, b1, -a1, 2.0 * b2, -2.0 * a2, cuts[0], cuts[2])
        cuts[3] = _sign_change(0.0, b1, -a1, 2.0 * b2, -2.0 * a2, cuts[2], cuts[4])
        for j in range(4):
            t = _sign_change(a0, a1, b1, a2, b2, cuts[j], cuts[j + 1])
            c, s = math.cos(t), math.sin(t)
            v1 = p1 + q11 * c + q12 * s
            v2 = p2 + q21 * c + q22 * s
            closeness = c * near_c + s * near_s
            if (
                closeness > best
                and abs(c * v2 - s * v1) <= ROUNDING * size
                and c * v1 + s * v2 >= -ROUNDING * size
                and d0 - d1 * c - d2 * s > 0.0
            ):
                best, best_c, best_s = closeness, c, s
    return best_c, best_s, best > -2.0


@njit(cache=True, error_model="numpy")
def _trigonometric(a0, a1, b1, a2, b2, t):  # noqa: PLR0913
    c, s = math.cos(t), math.sin(t)
    return a0 + a1 * c + b1 * s + a2 * (c * c - s * s) + 2.0 * b2 * s * c


@njit(cache=True, error_model="numpy")
def _sign_change(a0, a1, b1, a2, b2, left, right):  # noqa: PLR0913
    """Where the polynomial changes sign, by bisection; `right` when it does not."""
    positive = _trigonometric(a0, a1, b1, a2, b2, left) > 0.0
    if (_trigonometric(a0, a1, b1, a2, b2, right) > 0.0) == positive:
        return right
    for _ in range(BISECTIONS):
        middle = 0.5 * (left + right)
        if (_trigonometric(a0, a1, b1, a2, b2, middle) > 0.0) == positive:
            left = middle
        else:
            right = middle
    return 0.5 * (left + right)


@njit(cache=True, error_model="numpy")
def _stick(s11, s12, s21, s22, y1, y2):  # noqa: PLR0913
    """-S^-1 y of a 2x2 S by elimination with a pivot, and whether S is regular to rounding.

    A tangent that a support holds already (no compliance, no motion) takes no reaction.
    """
    if s12 == 0.0 and s21 == 0.0:
        if s22 == 0.0 and y2 == 0.0 and s11 > 0.0:
            return -y1 / s11, 0.0, True
        if s11 == 0.0 and y1 == 0.0 and s22 > 0.0:
            return 0.0, -y2 / s22, True
    if abs(s21) > abs(s11):
        s11, s12, y1, s21, s22, y2 = s21, s22, y2, s11, s12, y1
    if s11 == 0.0:
        return 0.0, 0.0, False
    k = s21 / s11
    last = s22 - k * s12
    if not abs(last) > 1e-15 * (abs(s22) + abs(k * s12)):
        return 0.0, 0.0, False
    x2 = (k * y1 - y2) / last
    return -(y1 + s12 * x2) / s11, x2, True


@njit(cache=True, error_model="numpy")
def solve_coulomb(A, b0, b1, b2, mu, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2, state) of one contact under Coulomb friction; (g1, g2) guesses r_T."""
    a = A[0, 0]
    if b0 >= 0.0 or a <= 0.0:
        return 0.0, 0.0, 0.0, OPEN
    if mu == 0.0:
        return -b0 / a, 0.0, 0.0, SLIP
    # closed: u_N = 0 leaves u_T = S r_T + y
    k1, k2 = A[1, 0] / a, A[2, 0] / a
    y1, y2 = b1 - k1 * b0, b2 - k2 * b0
    s11, s12 = A[1, 1] - k1 * A[0, 1], A[1, 2] - k1 * A[0, 2]
    s21, s22 = A[2, 1] - k2 * A[0, 1], A[2, 2] - k2 * A[0, 2]
    if abs(s11) <= CANCELLED * abs(A[1, 1]) and abs(s22) <= CANCELLED * abs(A[2, 2]):
        s11 = s12 = s21 = s22 = 0.0  # W of rank 1: what is left is rounding
    elif s12 == 0.0 and s21 == 0.0:
        s11 = 0.0 if abs(s11) <= CANCELLED * abs(A[1, 1]) else s11
        s22 = 0.0 if abs(s22) <= CANCELLED * abs(A[2, 2]) else s22
    x1, x2, regular = _stick(s11, s12, s21, s22, y1, y2)
    x0 = -(b0 + A[0, 1] * x1 + A[0, 2] * x2) / a
    if regular and x0 > 0.0 and x1 * x1 + x2 * x2 <= mu * mu * x0 * x0:
        return x0, x1, x2, STICK
    d1, d2 = mu * A[0, 1], mu * A[0, 2]
    p1, p2 = a * y1, a * y2
    q11, q12 = mu * b0 * s11 - d1 * y1, mu * b0 * s12 - d2 * y1
    q21, q22 = mu * b0 * s21 - d1 * y2, mu * b0 * s22 - d2 * y2
    size = a * (abs(b1) + abs(b2)) - b0 * (abs(A[1, 0]) + abs(A[2, 0]))
    size += (abs(d1) + abs(d2)) * (abs(b1) + abs(b2))
    size -= mu * b0 * (abs(A[1, 1]) + abs(A[2, 2]) + abs(A[1, 2]) + abs(A[2, 1]))
    if abs(p1) + abs(p2) + abs(q11) + abs(q12) + abs(q21) + abs(q22) <= 1e-15 * size:
        return -b0 / a, 0.0, 0.0, STICK  # u_T = 0 whatever r_T
    if g1 == 0.0 and g2 == 0.0:
        g1, g2 = (x1, x2) if regular else (-y1, -y2)
    length = math.sqrt(g1 * g1 + g2 * g2)
    c, s = (-g1 / length, -g2 / length) if length > 0.0 else (1.0, 0.0)
    c, s, found = _slip_direction(p1, p2, q11, q12, q21, q22, a, d1, d2, size, c, s)
    coupling = a - d1 * c - d2 * s
    if found and coupling > ROUNDING * (a + abs(d1) + abs(d2)):
        r = -b0 / coupling
        return r, -mu * r * c, -mu * r * s, SLIP
    return _project_until_still(A, b0, b1, b2, mu)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def _slip_near(e, W, i, k, b0, b1, b2, mu, g1, g2):  # noqa: PLR0913
    """(found, r_N, r_T1, r_T2): slip by Newton's method from the direction of (g1, g2)."""
    length = math.sqrt(g1 * g1 + g2 * g2)
    if length == 0.0:
        return False, 0.0, 0.0, 0.0
    a, y1, y2 = W[k, 0, 0], b1 - e[i, 10] * b0, b2 - e[i, 11] * b0
    d1, d2, load = mu * W[k, 0, 1], mu * W[k, 0, 2], mu * b0
    p1, p2 = a * y1, a * y2
    q11, q12 = load * e[i, 12] - d1 * y1, load * e[i, 13] - d2 * y1
    q21, q22 = load * e[i, 14] - d1 * y2, load * e[i, 15] - d2 * y2
    c, s = -g1 / length, -g2 / length
    for _ in range(NEAR_STEPS):
        v1 = p1 + q11 * c + q12 * s
        v2 = p2 + q21 * c + q22 * s
        g = c * v2 - s * v1
        along = c * v1 + s * v2
        slope = s * s * q11 - s * c * (q12 + q21) + c * c * q22 - along
        if not slope < 0.0 or abs(g) > -slope:
            break
        step = -g / slope
        if abs(step) > NEAR:
            turn = 1.0 / math.sqrt(1.0 + step * step)
            c, s = (c - s * step) * turn, (s + c * step) * turn
            continue
        turn = 1.0 - 0.5 * step * step
        c, s = (c - s * step) * turn, (s + c * step) * turn
        coupling = a - d1 * c - d2 * s
        if along < 0.0 or coupling <= ROUNDING * (a + abs(d1) + abs(d2)):
            break
        r = -b0 / coupling
        return True, r, -mu * r * c, -mu * r * s
    return False, 0.0, 0.0, 0.0


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def solve_eliminated(e, W, i, k, b0, b1, b2, mu, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2) under Coulomb friction, as `solve_coulomb` but quicker.

    A = W[k] of the blocks W and row i of e, which is `BlockRows.eliminated`; what that does not
    settle goes to `solve_coulomb`.  Inlined, and without views of arrays, whose counts of
    references took a third of a sweep.
    """
    if b0 >= 0.0:
        return 0.0, 0.0, 0.0
    if e[i, 0] > 0.0:
        x0 = -(e[i, 1] * b0 + e[i, 2] * b1 + e[i, 3] * b2)
        x1 = -(e[i, 4] * b0 + e[i, 5] * b1 + e[i, 6] * b2)
        x2 = -(e[i, 7] * b0 + e[i, 8] * b1 + e[i, 9] * b2)
        bound = mu * x0
        if x0 > 0.0 and x1 * x1 + x2 * x2 <= bound * bound:
            return x0, x1, x2
        if g1 == 0.0 and g2 == 0.0:  # open before: it slides as it would be held
            g1, g2 = x1, x2
        found, x0, x1, x2 = _slip_near(e, W, i, k, b0, b1, b2, mu, g1, g2)
        if found:
            return x0, x1, x2
    x0, x1, x2, _ = solve_coulomb(W[k], b0, b1, b2, mu, g1, g2)
    return x0, x1, x2


@njit(cache=True, error_model="numpy")
def _project_until_still(A, b0, b1, b2, mu):
    """Best point of r <- P_K(r - rho û): the way out for singular or overly coupled blocks."""
    size = 0.0
    for k in range(3):
        size = max(size, abs(A[k, 0]) + abs(A[k, 1]) + abs(A[k, 2]))
    rho = 1.0 / size
    r0, r1, r2, state = max(-b0 * rho, 0.0), 0.0, 0.0, STICK
    best0, best1, best2, best_state, least = r0, r1, r2, state, math.inf
    for _ in range(PROJECTIONS):
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
        if move < least:
            best0, best1, best2, best_state, least = r0, r1, r2, state, move
        if move <= 1e-15 * (abs(r0) + abs(r1) + abs(r2)):
            break
    return best0, best1, best2, best_state


@njit(cache=True, error_model="numpy")
def _disk(s11, s12, s21, s22, y1, y2, bound, g1, g2):  # noqa: PLR0913
    """r_T of u_T = S r_T + y with |r_T| <= bound, and its state; (g1, g2) guesses r_T."""
    if y1 == 0.0 and y2 == 0.0:
        return 0.0, 0.0, STICK
    x1, x2, regular = _stick(s11, s12, s21, s22, y1, y2)
    if regular and x1 * x1 + x2 * x2 <= bound * bound:
        return x1, x2, STICK
    if g1 == 0.0 and g2 == 0.0:
        g1, g2 = -y1, -y2
    length = math.sqrt(g1 * g1 + g2 * g2)
    c, s = (-g1 / length, -g2 / length) if length > 0.0 else (1.0, 0.0)
    size = abs(y1) + abs(y2) + bound * (abs(s11) + abs(s12) + abs(s21) + abs(s22))
    q11, q12, q21, q22 = -bound * s11, -bound * s12, -bound * s21, -bound * s22
    c, s, _ = _slip_direction(y1, y2, q11, q12, q21, q22, 1.0, 0.0, 0.0, size, c, s)
    return -bound * c, -bound * s, SLIP


@njit(cache=True, error_model="numpy")
def solve_tresca(A, b0, b1, b2, bound, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2, state) of one contact under Tresca friction; open ones may slide."""
    a = A[0, 0]
    r1, r2, state = _disk(A[1, 1], A[1, 2], A[2, 1], A[2, 2], b1, b2, bound, g1, g2)
    if b0 + A[0, 1] * r1 + A[0, 2] * r2 >= 0.0 or a <= 0.0:
        return 0.0, r1, r2, OPEN
    k1, k2 = A[1, 0] / a, A[2, 0] / a
    r1, r2, state = _disk(
        A[1, 1] - k1 * A[0, 1], A[1, 2] - k1 * A[0, 2],
        A[2, 1] - k2 * A[0, 1], A[2, 2] - k2 * A[0, 2],
        b1 - k1 * b0, b2 - k2 * b0, bound, r1, r2,
    )  # fmt: skip
    return max(-(b0 + A[0, 1] * r1 + A[0, 2] * r2) / a, 0.0), r1, r2, state
