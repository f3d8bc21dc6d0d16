"""Iterative solutions of a single contact, as Gauss-Seidel variants of the literature use them.

The exact solution (`one_contact`) is faster and safer; these exist for comparison.

- Newton (NSGS-AC): Newton steps on Alart and Curnier's function of the one contact, [ABD]
  eq. (8), without line search; the exact solution takes over where they fail.
- Projection (NSGS-FP-VI-UPK): r <- P_K(r - rho û), with rho adapted until it is a contraction:
  rho shrinks while rho |û(r) - û(r')| > 0.9 |r - r'| and grows when the ratio is below 0.3.
  After the last projection the contact is left as it is: a few of them may do, as the sweeps
  come back to it.

Both end at a relative change, the local tolerance, or after a number of steps, and add the
floating point operations that they took to `work` (1,).

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `gauss_seidel`).
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from ...core.compiled import njit
from ...problem.law.one_contact import solve_coulomb

STEPS = 20  # Newton steps before the exact solution takes over
PROJECTIONS = 100
CLOSE = 1e-14  # relative change at which an iteration ends
# Floating point operations, an operation or a root each: tests count them one by one.
ROW_FLOPS, CRAMER_FLOPS = 113.0, 67.0  # of a Newton step: F, its derivative and size; the step
VELOCITY_FLOPS, PROJECTION_FLOPS = 27.0, 64.0  # of a projection: before it, each trial of rho
EXACT_FLOPS = 100.0  # of an exact solution, about: open 0, sticking 21, sliding 150 to 400


class LocalSolver(IntEnum):
    """How Gauss-Seidel solves one contact."""

    EXACT = 0
    NEWTON = 1
    PROJECTION = 2


@njit(cache=True, error_model="numpy")
def _newton_row(A, b0, b1, b2, mu, rho, r0, r1, r2, F, J):  # noqa: PLR0913
    """F of Alart and Curnier at r, (3,), and its derivative in r, (3, 3)."""
    u0 = b0 + A[0, 0] * r0 + A[0, 1] * r1 + A[0, 2] * r2
    u1 = b1 + A[1, 0] * r0 + A[1, 1] * r1 + A[1, 2] * r2
    u2 = b2 + A[2, 0] * r0 + A[2, 1] * r1 + A[2, 2] * r2
    x0, x1, x2 = r0 - rho * u0, r1 - rho * u1, r2 - rho * u2
    closed = x0 > 0.0
    radius = mu * x0 if closed else 0.0
    t = math.sqrt(x1 * x1 + x2 * x2)
    slides = t > radius
    k = radius / t if slides else 1.0
    e1, e2 = (x1 / t, x2 / t) if t > 0.0 else (0.0, 0.0)
    F[0] = r0 - (x0 if closed else 0.0)
    F[1] = r1 - k * x1
    F[2] = r2 - k * x2
    for c in range(3):
        d0 = (1.0 if c == 0 else 0.0) - rho * A[0, c]
        d1 = (1.0 if c == 1 else 0.0) - rho * A[1, c]
        d2 = (1.0 if c == 2 else 0.0) - rho * A[2, c]
        along = e1 * d1 + e2 * d2 if slides else 0.0
        grow = mu * d0 if slides and closed else 0.0
        J[0, c] = (1.0 if c == 0 else 0.0) - (d0 if closed else 0.0)
        J[1, c] = (1.0 if c == 1 else 0.0) - k * (d1 - e1 * along) - grow * e1
        J[2, c] = (1.0 if c == 2 else 0.0) - k * (d2 - e2 * along) - grow * e2


@njit(cache=True, error_model="numpy")
def _determinant(J, column, F):
    """Determinant of J with F in place of a column (1 to 3; 0: of J itself), for Cramer."""
    total = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        a = F[i] if column == 1 else J[i, 0]
        b1, b2 = (F[j], F[k]) if column == 2 else (J[j, 1], J[k, 1])
        c1, c2 = (F[j], F[k]) if column == 3 else (J[j, 2], J[k, 2])
        total += a * (b1 * c2 - b2 * c1)
    return total


@njit(cache=True, error_model="numpy")
def newton_contact(A, b0, b1, b2, mu, r0, r1, r2, close, steps, work):  # noqa: PLR0913
    """(r_N, r_T1, r_T2) by Newton from (r0, r1, r2); exact where Newton does not converge.

    close: relative residual at which it ends; at most `steps` steps.
    """
    g1, g2 = r1, r2
    size = max(abs(A[0, 0]), abs(A[1, 1]), abs(A[2, 2]))
    if size > 0.0:
        rho = 1.0 / size
        F, J = np.empty(3), np.empty((3, 3))
        for k in range(steps):
            _newton_row(A, b0, b1, b2, mu, rho, r0, r1, r2, F, J)
            work[0] += ROW_FLOPS
            scale = abs(r0) + abs(r1) + abs(r2) + rho * (abs(b0) + abs(b1) + abs(b2))
            enough = close if k > 0 else CLOSE  # a step at least: sweeps shall not stand still
            if abs(F[0]) + abs(F[1]) + abs(F[2]) <= enough * scale:
                return r0, r1, r2
            work[0] += CRAMER_FLOPS
            det = _determinant(J, 0, F)
            if not abs(det) > 1e-14:
                break
            r0 -= _determinant(J, 1, F) / det
            r1 -= _determinant(J, 2, F) / det
            r2 -= _determinant(J, 3, F) / det
    work[0] += EXACT_FLOPS
    x0, x1, x2, _ = solve_coulomb(A, b0, b1, b2, mu, g1, g2)
    return x0, x1, x2


@njit(cache=True, error_model="numpy")
def _modified_velocity(A, b0, b1, b2, mu, r0, r1, r2):  # noqa: PLR0913
    """û = u + mu |u_T| n at r."""
    u0 = b0 + A[0, 0] * r0 + A[0, 1] * r1 + A[0, 2] * r2
    u1 = b1 + A[1, 0] * r0 + A[1, 1] * r1 + A[1, 2] * r2
    u2 = b2 + A[2, 0] * r0 + A[2, 1] * r1 + A[2, 2] * r2
    return u0 + mu * math.sqrt(u1 * u1 + u2 * u2), u1, u2


@njit(cache=True, error_model="numpy")
def _projected(x0, x1, x2, mu):
    """Projection onto the cone."""
    t = math.sqrt(x1 * x1 + x2 * x2)
    if mu * t <= -x0:
        return 0.0, 0.0, 0.0
    if t <= mu * x0:
        return x0, x1, x2
    p0 = (x0 + mu * t) / (1.0 + mu * mu)
    k = mu * p0 / t
    return p0, k * x1, k * x2


@njit(cache=True, error_model="numpy")
def projection_contact(A, b0, b1, b2, mu, r0, r1, r2, close, steps, work):  # noqa: PLR0913
    """(r_N, r_T1, r_T2) by projections with an adapted rho from (r0, r1, r2).

    close: relative change at which it ends; at most `steps` projections.
    """
    size = max(abs(A[0, 0]), abs(A[1, 1]), abs(A[2, 2]))
    if size <= 0.0:
        return 0.0, 0.0, 0.0
    rho = 1.0 / size
    for _ in range(steps):
        u0, u1, u2 = _modified_velocity(A, b0, b1, b2, mu, r0, r1, r2)
        ratio = moved = 0.0
        p0, p1, p2 = r0, r1, r2
        work[0] += VELOCITY_FLOPS
        for _ in range(30):
            work[0] += PROJECTION_FLOPS
            p0, p1, p2 = _projected(r0 - rho * u0, r1 - rho * u1, r2 - rho * u2, mu)
            v0, v1, v2 = _modified_velocity(A, b0, b1, b2, mu, p0, p1, p2)
            moved = math.sqrt((p0 - r0) ** 2 + (p1 - r1) ** 2 + (p2 - r2) ** 2)
            if moved == 0.0:
                return r0, r1, r2
            ratio = rho * math.sqrt((u0 - v0) ** 2 + (u1 - v1) ** 2 + (u2 - v2) ** 2) / moved
            if ratio <= 0.9:
                break
            rho *= 2.0 / 3.0 * min(1.0, 1.0 / ratio)
        r0, r1, r2 = p0, p1, p2
        if moved <= close * (abs(r0) + abs(r1) + abs(r2)):
            break
        if ratio < 0.3:
            rho *= 1.5
    return r0, r1, r2
