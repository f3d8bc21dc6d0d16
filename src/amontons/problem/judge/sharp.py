"""The exact measure in twice the digits, where huge reactions or friction let rounding hide it.

u = W r + q is summed with the rounding errors of its products and sums carried along ([ORR],
algorithm 5.3), so that a slip of rounding size is known to its last digit; where a contact
sticks its residual is û itself, without the r - (r - rho û) that loses it.  What is left are
roundings of r / rho where contacts slip.

[ORR] T. Ogita, S. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26
(2005).
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit
from ..law.law import BOUND, MU, TIED, given
from .measures import EPSILON, PENETRATION, contact_residual

SPLIT = 134217729.0  # 2^27 + 1: halves a double into two numbers of 26 bits


@njit(cache=True, error_model="numpy", inline="always")
def _sum(a, b):
    """a + b and its rounding error."""
    s = a + b
    rest = s - a
    return s, (a - (s - rest)) + (b - rest)


@njit(cache=True, error_model="numpy", inline="always")
def _product(a, b):
    """Product a b and its rounding error."""
    p = a * b
    c = SPLIT * a
    a1 = c - (c - a)
    a2 = a - a1
    c = SPLIT * b
    b1 = c - (c - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


@njit(cache=True, error_model="numpy")
def sharp_error(indptr, indices, data, q, kind, parameters, rho, r):
    """`measures.natural_error`, and what rounding may still hide in it, unit of u.

    Infinite where products overflow.
    """
    total = hidden = 0.0
    u, lost = np.empty(3), np.empty(3)
    for i in range(len(kind)):
        for a in range(3):
            u[a], lost[a] = q[i, a], 0.0
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for a in range(3):
                for b in range(3):
                    p, error = _product(data[k, a, b], r[j, b])
                    u[a], rest = _sum(u[a], p)
                    lost[a] += rest + error
        for a in range(3):
            u[a] += lost[a]
        if rho[i] <= 0.0:
            if r[i, 0] != 0.0 or r[i, 1] != 0.0 or r[i, 2] != 0.0:
                return math.inf, 0.0
            if kind[i] == TIED:
                total += u[0] ** 2 + u[1] ** 2 + u[2] ** 2
            else:
                total += min(u[0], 0.0) ** 2
            continue
        slip = math.sqrt(u[1] ** 2 + u[2] ** 2)
        fixed, p = given(kind[i], parameters[i], r[i, 0]), parameters[i]
        normal = u[0] if fixed else u[0] + p[MU] * slip
        x0, x1, x2 = r[i, 0] - rho[i] * normal, r[i, 1] - rho[i] * u[1], r[i, 2] - rho[i] * u[2]
        bound = p[BOUND] if fixed else p[MU] * x0
        if kind[i] == TIED or (x0 > 0.0 and math.sqrt(x1 * x1 + x2 * x2) < bound):
            size = normal * normal + u[1] ** 2 + u[2] ** 2
        else:
            e0, e1, e2 = contact_residual(
                r[i, 0], r[i, 1], r[i, 2], u[0], u[1], u[2], rho[i], kind[i], p
            )
            size = e0 * e0 + e1 * e1 + e2 * e2
            hidden += (r[i, 0] ** 2 + r[i, 1] ** 2 + r[i, 2] ** 2) / rho[i] ** 2
        total += max(size, (PENETRATION * min(u[0], 0.0)) ** 2)
    if not math.isfinite(total):
        return math.inf, 0.0
    return math.sqrt(total), EPSILON * math.sqrt(hidden)
