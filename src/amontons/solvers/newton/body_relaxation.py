"""The relaxation of `interior_point` for rigid bodies, and Coulomb's law itself, on the bodies.

With the levers G of `sweeps.on_bodies`, W = G G^T, a step (W + E) dr = f, E = S^-1 D S^-1, is

    (1 + G^T E^-1 G) w = G^T E^-1 f,   dr = E^-1 (f - G w),

six unknowns for each body where there are three for each contact: on a wall of bricks, which
has some eight contacts for each of them, 2 ms in place of 100.  The matrix is positive definite
whatever the contacts, so nothing is added to W where it is singular, and with the scaling point
w, D = k (2 w w^T - J), J = diag(1, -1, -1),

    D^-1 = (2 (J w) (J w)^T - J) / k

has no cancellation.  Bonds (joints) have E = SOFT / rho and no cone.  dr is refined once.

Where s is not frozen but |u_T| at each step, with the part c of its slope known to the step,

    dy = S du + c (t . du_T) e_N = S M du,   M = 1 + e_N T^T,   T = c mu t,   t = u_T / |u_T|,

only E becomes M^-1 E and f M^-1 f: what remains is a step as above, of a matrix that is not
symmetric.  It solves Coulomb's law, no convex program, in as few steps as one relaxation takes,
where it converges; with a little less than the whole slope it comes to a halt less often.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...problem.judge.measures import natural_error
from ...problem.law.law import MU, TIED
from ..sweeps.on_bodies import GROUND, driven_inplace, felt_inplace
from .block_lu import Symbolic, analyse_doubled, factorise_inplace, found, solve_inplace
from .cone_steps import (
    LEFT,
    advance_inplace,
    changes_inplace,
    gap_left,
    residual_inplace,
    right_side_inplace,
    room,
    scaled_blocks_inplace,
)
from .interior_point import ENOUGH, SHORT, STALLED

Array = NDArray[np.float64]
SOFT = 1e-12  # of bonds, relative: E of a row that has none


class BodyMatrix(NamedTuple):
    """Pattern of 1 + G^T E^-1 G in 3x3 blocks, two for each body, and its symbolic factor."""

    indptr: Any  # (2 bodies + 1,)
    indices: Any
    symbolic: Symbolic

    @property
    def products(self) -> int:
        """Products of 3x3 blocks in one factorisation."""
        return self.symbolic.products


def body_matrix(sides: NDArray[np.int64], bodies: int) -> BodyMatrix:
    """Of contacts between sides (n, 2) of so many bodies, GROUND for none."""
    indptr, indices = _graph(sides, bodies)
    return BodyMatrix(*_rows_in_halves(indptr, indices), analyse_doubled(indptr, indices))


@njit(cache=True, error_model="numpy")
def _graph(sides, bodies):
    """Bodies that each body meets, itself too, ascending: (indptr, indices)."""
    count = np.ones(bodies + 1, np.int64)
    count[0] = 0
    for i in range(len(sides)):
        if sides[i, 1] != GROUND:
            count[sides[i, 0] + 1] += 1
            count[sides[i, 1] + 1] += 1
    for b in range(bodies):
        count[b + 1] += count[b]
    place, all_of = count[:-1].copy(), np.empty(count[-1], np.int64)
    for b in range(bodies):
        all_of[place[b]] = b
        place[b] += 1
    for i in range(len(sides)):
        if sides[i, 1] != GROUND:
            for p in range(2):
                b = sides[i, p]
                all_of[place[b]] = sides[i, 1 - p]
                place[b] += 1
    indptr, indices = np.zeros(bodies + 1, np.int32), np.empty(count[-1], np.int32)
    kept = 0
    for b in range(bodies):
        own = np.sort(all_of[count[b] : count[b + 1]])
        for k in range(len(own)):
            if k == 0 or own[k] != own[k - 1]:
                indices[kept] = own[k]
                kept += 1
        indptr[b + 1] = kept
    return indptr, indices[:kept].copy()


@njit(cache=True, error_model="numpy")
def _rows_in_halves(indptr, indices):
    """The pattern with every row and column twice."""
    n = len(indptr) - 1
    starts, columns = np.zeros(2 * n + 1, np.int32), np.empty(4 * len(indices), np.int32)
    at = 0
    for b in range(n):
        for half in range(2):
            for k in range(indptr[b], indptr[b + 1]):
                columns[at], columns[at + 1] = 2 * indices[k], 2 * indices[k] + 1
                at += 2
            starts[2 * b + half + 1] = at
    return starts, columns


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _assemble(levers, sides, inverse, indptr, indices, data):
    """1 + G^T E^-1 G into blocks (., 3, 3)."""
    data[:] = 0.0
    for b in range(len(indptr) - 1):
        place = found(indptr, indices, b, b)
        for a in range(3):
            data[place, a, a] = 1.0
    product = np.empty((3, 6))
    for i in range(len(sides)):
        F = inverse[i]
        for p in range(2):
            b = sides[i, p]
            if b == GROUND:
                continue
            G = levers[i, p]
            for a in range(3):
                for e in range(6):
                    product[a, e] = F[a, 0] * G[0, e] + F[a, 1] * G[1, e] + F[a, 2] * G[2, e]
            for o in range(2):
                c = sides[i, o]
                if c == GROUND:
                    continue
                T = levers[i, o]
                for upper in range(2):
                    at = found(indptr, indices, 2 * c + upper, 2 * b)
                    for right in range(2):
                        block = data[at + right]
                        for k in range(3):
                            f = 3 * upper + k
                            for m in range(3):
                                e = 3 * right + m
                                block[k, m] += (
                                    T[0, f] * product[0, e] + T[1, f] * product[1, e]
                                    + T[2, f] * product[2, e]
                                )  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _multiplied(blocks, v, out):
    """out_i = blocks_i v_i."""
    for i in range(len(v)):
        B = blocks[i]
        v0, v1, v2 = v[i, 0], v[i, 1], v[i, 2]
        for a in range(3):
            out[i, a] = B[a, 0] * v0 + B[a, 1] * v1 + B[a, 2] * v2


@njit(cache=True, error_model="numpy")
def _solved(levers, sides, E, inverse, factor, f, dr, du):  # noqa: PLR0913
    """dr (n, 3) of (W + E) dr = f by the factor on the bodies, refined once, and du = W dr."""
    order, upper_start, upper, lower_start, lower, U, L, pivots = factor
    n, halves = len(f), len(order)
    rest, part = np.empty((n, 3)), np.empty((n, 3))
    turned, moved = np.empty((halves // 2, 6)), np.empty((halves, 3))
    dr[:, :] = 0.0
    du[:, :] = 0.0
    for _ in range(2):
        _multiplied(E, dr, rest)
        for i in range(n):
            for a in range(3):
                rest[i, a] = f[i, a] - du[i, a] - rest[i, a]
        _multiplied(inverse, rest, part)
        driven_inplace(levers, sides, part, turned)
        solve_inplace(
            order, upper_start, upper, lower_start, lower, U, L, pivots,
            turned.reshape((halves, 3)), moved,
        )  # fmt: skip
        felt_inplace(levers, sides, moved.reshape((halves // 2, 6)), du)
        for i in range(n):
            for a in range(3):
                rest[i, a] -= du[i, a]
        _multiplied(inverse, rest, part)
        for i in range(n):
            for a in range(3):
                dr[i, a] += part[i, a]
        driven_inplace(levers, sides, dr, turned)
        felt_inplace(levers, sides, turned, du)


@njit(cache=True, error_model="numpy")
def _follow_inplace(u, mu, part, s, T):
    """s = |u_T| (n,), and T (n, 2), with that part of its slope, where there is friction."""
    for i in range(len(s)):
        s[i] = math.sqrt(u[i, 1] ** 2 + u[i, 2] ** 2) if mu[i] > 0.0 else 0.0
        for a in range(2):
            T[i, a] = part * mu[i] * u[i, 1 + a] / s[i] if s[i] > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _lean_inplace(T, E, inverse):
    """E becomes M^-1 E, and E^-1 E^-1 M."""
    for i in range(len(T)):
        for a in range(3):
            E[i, 0, a] -= T[i, 0] * E[i, 1, a] + T[i, 1] * E[i, 2, a]
            for b in range(2):
                inverse[i, a, 1 + b] += inverse[i, a, 0] * T[i, b]


@njit(cache=True, error_model="numpy")
def _add_along_inplace(T, sign, v):
    """v_N += sign T . v_T, v (n, 3): M v, or M^-1 v."""
    for i in range(len(T)):
        v[i, 0] += sign * (T[i, 0] * v[i, 1] + T[i, 1] * v[i, 2])


@njit(cache=True, error_model="numpy")
def relax_on_bodies_inplace(  # noqa: PLR0913
    levers, sides, pattern, symbolic, blocks, q, law, rho, r, x, y, s, part, goal, steps,
):  # fmt: skip
    """Predictor-corrector steps on (r, x, y), which are inside of the cones on entry.

    levers (n, 2, 3, 6), sides (n, 2); pattern: see `BodyMatrix`; blocks: W in rows, for the
    error; law: kind (n,) and parameters (n, 2); s (n,): |u_T|, frozen where part, of its slope,
    is 0; goal: error, unit of u, at which to stop.
    Returns steps done; r is the last iterate, and finite.
    """
    indptr, indices = pattern
    order, upper_start, upper, lower_start, lower = symbolic
    kind, n, bodies = law[0], len(q), (len(indptr) - 1) // 2
    mu, able = law[1][:, MU].copy(), rho.copy()
    for i in range(n):
        if kind[i] == TIED:
            able[i] = 0.0
    data, none = np.empty((len(indices), 3, 3)), np.zeros((2 * bodies, 3, 3))
    U, L = np.empty((len(upper), 3, 3)), np.empty((len(upper), 3, 3))
    pivots, work = np.empty((2 * bodies, 3, 3)), np.zeros((2 * bodies, 3, 3))
    E, inverse = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    lam, w, beta = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    residual, f, dr = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    dx, dy, du, u = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.empty((n, 3))
    turned, T = np.empty((bodies, 6)), np.zeros((n, 2))
    short = 0
    for i in range(n):
        if kind[i] == TIED and rho[i] > 0.0:
            for a in range(3):
                E[i, a, a], inverse[i, a, a] = SOFT / rho[i], rho[i] / SOFT
    for count in range(steps):
        driven_inplace(levers, sides, r, turned)
        felt_inplace(levers, sides, turned, u)
        u += q
        if part > 0.0:
            _follow_inplace(u, mu, part, s, T)
        left, total, free = residual_inplace(x, y, u, s, mu, able, rho, residual)
        for i in range(n):
            if kind[i] == TIED:
                for a in range(3):
                    residual[i, a] = -u[i, a]
                    left += u[i, a] ** 2
        error = natural_error(blocks[0], blocks[1], blocks[2], q, kind, law[1], rho, r)
        if error <= goal or math.sqrt(left) <= max(ENOUGH * error, 0.1 * goal):
            return count
        for i in range(n):
            if able[i] > 0.0:
                scaled_blocks_inplace(x, y, mu[i], 0.0, i, beta, w, lam, E, inverse)
        _lean_inplace(T, E, inverse)
        mean = total / max(free, 1)
        factor = order, upper_start, upper, lower_start, lower, U, L, pivots
        _assemble(levers, sides, inverse, indptr, indices, data)
        if not factorise_inplace(
            indptr, indices, data, none, order, upper_start, upper, lower_start, lower,
            U, L, pivots, work,
        ):  # fmt: skip
            return count
        sigma = length = 0.0
        for phase in range(2):
            right_side_inplace(phase, sigma, mean, mu, able, lam, beta, w, dx, dy, residual, f)
            _add_along_inplace(T, -1.0, f)
            _solved(levers, sides, E, inverse, factor, f, dr, du)
            _add_along_inplace(T, 1.0, du)
            changes_inplace(1.0 - sigma, mu, able, residual, dr, du, dx, dy)
            length = min(room(x, dx, able), room(y, dy, able))
            if not length > 0.0:
                return count
            length = min(1.0, length * (1.0 if phase == 0 else 1.0 - LEFT))
            if phase == 0:
                sigma = gap_left(x, y, dx, dy, able, length, total) ** 3
        short = short + 1 if length < SHORT else 0
        if short > STALLED:
            return count
        advance_inplace(x, y, r, dx, dy, mu, able, length)
        for i in range(n):
            if kind[i] == TIED:
                for a in range(3):
                    r[i, a] += length * dr[i, a]
    return steps


def relaxed(  # noqa: PLR0913
    levers: Array, sides: NDArray[np.int64], matrix: BodyMatrix, blocks: Any, q: Array,
    law: Any, rho: Array, slip: Array, part: float, goal: float, steps: int,
) -> tuple[Array, int]:  # fmt: skip
    """(r (n, 3), steps) from inside of the cones, of the relaxation with frozen |u_T|, (n,).

    Where part is above 0, of Coulomb's law, with that part of the slope of |u_T|.
    """
    mu = law[1][:, MU]
    size = float(np.linalg.norm(q)) / math.sqrt(max(len(q), 1))
    x, y = np.zeros_like(q), np.zeros_like(q)
    x[:, 0], y[:, 0] = size * rho, size
    r = x / np.where(mu > 0, mu, 1.0)[:, None]
    r[law[0] == TIED] = 0.0
    done = relax_on_bodies_inplace(
        levers, sides, (matrix.indptr, matrix.indices), matrix.symbolic.arrays, blocks, q, law,
        rho, r, x, y, np.where(mu > 0, slip, 0.0), part, goal, steps,
    )  # fmt: skip
    return r, done


__all__ = ["BodyMatrix", "body_matrix", "relaxed"]
