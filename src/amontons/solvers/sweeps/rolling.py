"""Gauss-Seidel sweeps with momentum for contacts with moments (`RollingProblem`).

A contact given all others is solved by Newton's method on

    r_N = (z_N)_+,   r_k = P(z_k; a_k (z_N)_+),   z = r - rho (W_ii r + b),   k = T, S, R,

P the projection onto a disk, or a segment, of that radius; where that does not converge by
projections onto the cone, with rho adapted until they contract (`local_contact`).  Momentum and
its restart are those of `momentum`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.compiled import njit
from ...core.copies import copy_inplace
from ...core.options import check_options
from ...problem.law.rolling import all_missed, missed_inplace, projected_inplace, sizes_of
from ...problem.law.rolling import velocities_inplace as moved_inplace
from ...problem.protocol import Form, Problem
from ...problem.rolling import RollingProblem
from ..contract import Iterate, Target, check_at_least

STEPS = 25  # of Newton's method on one contact
PROJECTIONS = 60  # where that fails
CLOSE = 1e-14  # relative residual at which they end
ASKED = 10  # sweeps from one judgement to the next


@njit(cache=True, error_model="numpy")
def _newton_rows(A, b, a, rho, r, F, J):
    """F (6,) of the module at r (6,), and its derivative J (6, 6)."""
    z0 = r[0]
    for k in range(6):
        z0 -= rho * A[0, k] * r[k]
    z0 -= rho * b[0]
    closed = z0 > 0.0
    F[0] = r[0] - (z0 if closed else 0.0)
    for c in range(6):
        J[0, c] = rho * A[0, c] if closed else 0.0
    if not closed:
        J[0, 0] = 1.0
    z = np.empty(6)
    for k in range(1, 6):
        z[k] = r[k] - rho * b[k]
        for c in range(6):
            z[k] -= rho * A[k, c] * r[c]
    sizes = sizes_of(z)
    for part in range(3):
        first, last = (1, 3) if part == 0 else ((3, 4) if part == 1 else (4, 6))
        radius = a[part] * z0 if closed else 0.0
        size = sizes[part]
        if size <= radius:
            for k in range(first, last):
                F[k] = r[k] - z[k]
                for c in range(6):
                    J[k, c] = rho * A[k, c]
            continue
        share = radius / size
        for k in range(first, last):
            n = z[k] / size
            F[k] = r[k] - share * z[k]
            for c in range(6):
                own = (1.0 if k == c else 0.0) - rho * A[k, c]
                along = 0.0
                for m in range(first, last):
                    along += z[m] / size * ((1.0 if m == c else 0.0) - rho * A[m, c])
                J[k, c] = (1.0 if k == c else 0.0) - share * (own - n * along)
                if closed:
                    J[k, c] -= a[part] * n * ((1.0 if c == 0 else 0.0) - rho * A[0, c])


@njit(cache=True, error_model="numpy")
def _eliminated(J, F):
    """Solve J x = F in place, x in F; False at a pivot that is none."""
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(J[i, k]) > abs(J[best, k]):
                best = i
        if not abs(J[best, k]) > 1e-14:
            return False
        if best != k:
            for c in range(6):
                J[k, c], J[best, c] = J[best, c], J[k, c]
            F[k], F[best] = F[best], F[k]
        for i in range(k + 1, 6):
            t = J[i, k] / J[k, k]
            if t != 0.0:
                for c in range(k, 6):
                    J[i, c] -= t * J[k, c]
                F[i] -= t * F[k]
    for k in range(5, -1, -1):
        for c in range(k + 1, 6):
            F[k] -= J[k, c] * F[c]
        F[k] /= J[k, k]
    return True


@njit(cache=True, error_model="numpy")
def _missed(A, b, a, rho, r, u, z, e):
    """|r - P_K(r - rho u_hat)| / rho of one contact."""
    for k in range(6):
        u[k] = b[k]
        for c in range(6):
            u[k] += A[k, c] * r[c]
    missed_inplace(r, u, a, rho, z, e)
    total = 0.0
    for k in range(6):
        total += e[k] * e[k]
    return math.sqrt(total)


@njit(cache=True, error_model="numpy")
def _by_projections(A, b, a, rho, r):
    """r <- P_K(r - rho u_hat(r)) from r (6,), rho adapted."""
    u, z, p, v = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for _ in range(PROJECTIONS):
        moved = 0.0
        for _ in range(30):
            for k in range(6):
                u[k] = b[k]
                for c in range(6):
                    u[k] += A[k, c] * r[c]
            s = sizes_of(u)
            u[0] += a[0] * s[0] + a[1] * s[1] + a[2] * s[2]
            for k in range(6):
                z[k] = r[k] - rho * u[k]
            projected_inplace(z, a, p)
            for k in range(6):
                v[k] = b[k]
                for c in range(6):
                    v[k] += A[k, c] * p[c]
            s = sizes_of(v)
            v[0] += a[0] * s[0] + a[1] * s[1] + a[2] * s[2]
            moved = change = 0.0
            for k in range(6):
                moved += (p[k] - r[k]) ** 2
                change += (v[k] - u[k]) ** 2
            if moved == 0.0:
                return
            ratio = rho * math.sqrt(change / moved)
            if ratio <= 0.9:
                break
            rho *= 2.0 / 3.0 * min(1.0, 1.0 / ratio)
        size = 0.0
        for k in range(6):
            r[k] = p[k]
            size += p[k] * p[k]
        if moved <= (CLOSE * CLOSE) * size:
            return


@njit(cache=True, error_model="numpy")
def solve_rolling(A, b, a, rho, r):
    """r (6,) becomes the reaction of one contact, u = A r + b; from r."""
    if b[0] >= 0.0:
        r[:] = 0.0
        return
    F, J, u = np.empty(6), np.empty((6, 6)), np.empty(6)
    z, e, start = np.empty(6), np.empty(6), r.copy()
    load = 0.0
    for k in range(6):
        load += b[k] * b[k]
    load = math.sqrt(load)
    if not r[0] > 0.0:
        r[0] = -b[0] / A[0, 0] if A[0, 0] > 0.0 else 0.0
    before = _missed(A, b, a, rho, start, u, z, e)
    for _ in range(STEPS):
        _newton_rows(A, b, a, rho, r, F, J)
        size = 0.0
        for k in range(6):
            size += F[k] * F[k]
        if math.sqrt(size) <= CLOSE * rho * load:
            break
        if not _eliminated(J, F):
            break
        for k in range(6):
            r[k] -= F[k]
    after = _missed(A, b, a, rho, r, u, z, e)
    if after <= 1e-10 * load:
        return
    other = start.copy()
    if after < before:
        copy_inplace(r, other)
    _by_projections(A, b, a, rho, other)
    if not after <= _missed(A, b, a, rho, other, u, z, e):
        copy_inplace(other, r)


@njit(cache=True, error_model="numpy")
def rolling_sweeps_inplace(indptr, indices, data, q, coefficients, rho, diagonal, r, old, pace,
                           sweeps, goal):  # fmt: skip
    """Up to `sweeps` sweeps with momentum on r (nc, 6), until the error is below the goal.

    old (nc, 6), pace (2,): as in `momentum_inplace`.  Returns sweeps done.
    """
    b, own, u = np.empty(6), np.empty(6), np.empty_like(q)
    for sweep in range(sweeps):
        t = pace[0]
        after = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))
        w = (t - 1.0) / after
        for i in range(len(q)):
            closed = r[i, 0] + w * (r[i, 0] - old[i, 0]) > 0.0
            for k in range(6):
                now = r[i, k]
                r[i, k] = now + w * (now - old[i, k]) if closed else 0.0
                old[i, k] = now
        change = 0.0
        for i in range(len(q)):
            if rho[i] <= 0.0:
                r[i, :] = 0.0
                continue
            for k in range(6):
                b[k] = q[i, k]
            for place in range(indptr[i], indptr[i + 1]):
                j = indices[place]
                if j != i:
                    for k in range(6):
                        for c in range(6):
                            b[k] += data[place, k, c] * r[j, c]
            copy_inplace(r[i], own)
            solve_rolling(data[diagonal[i]], b, coefficients[i], rho[i], own)
            for k in range(6):
                change += ((own[k] - r[i, k]) / rho[i]) ** 2
                r[i, k] = own[k]
        change = math.sqrt(change)
        pace[0] = 1.0 if change > pace[1] else after
        pace[1] = change
        if change == 0.0 or sweep % ASKED == ASKED - 1:
            moved_inplace(indptr, indices, data, q, r, u)
            if math.sqrt((all_missed(r, u, coefficients, rho)[0] ** 2).sum()) <= goal:
                return sweep + 1
    return sweeps


@dataclass(frozen=True)
class RollingSweeps:
    """Gauss-Seidel with momentum for `RollingProblem`; an iterate is a batch of sweeps."""

    solves: ClassVar[tuple[type, ...]] = (RollingProblem,)
    form: ClassVar[Form] = Form.DELASSUS
    changes_method: ClassVar[bool] = True  # sweeps with momentum may come back on their way
    batch: int = 200

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, batch=self.batch)

    def iterates(self, problem: Problem, start: Iterate, target: Target) -> Iterator[Iterate]:
        """Batches, for ever; short ones first, as most problems of a step are easy."""
        assert isinstance(problem, RollingProblem)
        data = problem.kernel_data
        r = problem.six(start.r)
        old, pace = r.copy(), np.array([1.0, np.inf])
        goal, batch = target.tolerance * float(np.linalg.norm(data.q)), min(ASKED, self.batch)
        while True:
            done = rolling_sweeps_inplace(*data, r, old, pace, batch, goal)
            yield Iterate(problem.given_back(r), iterations=done)
            batch = min(2 * batch, self.batch)


__all__ = ["RollingSweeps", "solve_rolling"]
