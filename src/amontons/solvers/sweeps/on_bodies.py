"""Sweeps with momentum over contacts of rigid bodies, by the velocities of the bodies.

With the levers G (n, 2, 3, 6) of each contact on its two bodies, in the metric of their masses,
and w = G^T r, the velocities that reactions give to the bodies,

    u = q + G w,   W = G G^T,

so that a contact reads and writes the twelve numbers of its two bodies, where a row of W has a
block for each contact of both: 20 to 60 of them in a wall of bricks, where such a sweep takes a
fifth of the time of one by W.  w is summed anew in each sweep, before rounding tells.  Momentum
as in `momentum`, visits in the stored order.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit
from ...problem.law.law import COULOMB, MU
from ...problem.law.one_contact import solve_eliminated
from ...problem.law.single import solve_contact
from .kernels import content
from .momentum import push_inplace

GROUND = -1  # in place of a second body


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def driven_inplace(levers, sides, r, w):
    """w = G^T r (bodies, 6) of reactions r (n, 3); sides (n, 2): bodies, GROUND for none."""
    w[:, :] = 0.0
    for i in range(len(sides)):
        for p in range(2):
            if sides[i, p] != GROUND:
                G, own = levers[i, p], w[sides[i, p]]
                for e in range(6):
                    own[e] += G[0, e] * r[i, 0] + G[1, e] * r[i, 1] + G[2, e] * r[i, 2]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def felt_inplace(levers, sides, w, u):
    """u = G w (n, 3) of velocities w (bodies, 6) in the metric of the masses."""
    for i in range(len(sides)):
        u0 = u1 = u2 = 0.0
        for p in range(2):
            if sides[i, p] != GROUND:
                G, own = levers[i, p], w[sides[i, p]]
                for e in range(6):
                    u0 += G[0, e] * own[e]
                    u1 += G[1, e] * own[e]
                    u2 += G[2, e] * own[e]
        u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def sweep_bodies_inplace(s, levers, sides, r, w):
    """One sweep over all contacts on r (n, 3) and w = G^T r; returns the change, unit of u."""
    change = 0.0
    for i in range(len(sides)):
        b0, b1, b2 = s.q[i, 0], s.q[i, 1], s.q[i, 2]
        for p in range(2):
            if sides[i, p] != GROUND:
                G, own = levers[i, p], w[sides[i, p]]
                for e in range(6):
                    b0 += G[0, e] * own[e]
                    b1 += G[1, e] * own[e]
                    b2 += G[2, e] * own[e]
        A, e = s.data[s.diagonal[i]], s.eliminated[i]
        r0, r1, r2 = r[i, 0], r[i, 1], r[i, 2]
        b0 -= A[0, 0] * r0 + A[0, 1] * r1 + A[0, 2] * r2
        b1 -= A[1, 0] * r0 + A[1, 1] * r1 + A[1, 2] * r2
        b2 -= A[2, 0] * r0 + A[2, 1] * r1 + A[2, 2] * r2
        if s.kind[i] == COULOMB:
            x0, x1, x2 = solve_eliminated(
                s.eliminated, s.data, i, s.diagonal[i], b0, b1, b2, s.parameters[i, MU], r1, r2
            )
        else:
            x0, x1, x2, _ = solve_contact(A, b0, b1, b2, s.kind[i], s.parameters[i], r1, r2)
        d0, d1, d2 = x0 - r0, x1 - r1, x2 - r2
        if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
            continue
        r[i, 0], r[i, 1], r[i, 2] = x0, x1, x2
        change += e[16] * (d0 * d0 + d1 * d1 + d2 * d2)
        for p in range(2):
            if sides[i, p] != GROUND:
                G, own = levers[i, p], w[sides[i, p]]
                for k in range(6):
                    own[k] += G[0, k] * d0 + G[1, k] * d1 + G[2, k] * d2
    return math.sqrt(change)


@njit(cache=True, error_model="numpy")
def momentum_on_bodies_inplace(s, levers, sides, bodies, r, sweeps, watch):  # noqa: PLR0913
    """Up to `sweeps` of them on r (n, 3), fewer when the judge is content; returns how many."""
    old, w = r.copy(), np.empty((bodies, 6))
    t, before = 1.0, math.inf
    for k in range(sweeps):
        t = push_inplace(s.kind, r, old, t)
        driven_inplace(levers, sides, r, w)
        change = sweep_bodies_inplace(s, levers, sides, r, w)
        t = 1.0 if change > before else t
        before = change
        if content(s, r, change, watch):
            return k + 1
    return sweeps


__all__ = ["GROUND", "driven_inplace", "felt_inplace", "momentum_on_bodies_inplace"]
