"""The one error measure that decides whether a reaction solves a problem.

It is formed from r and, where it is given, v, never from a solver's own residual,
and does not change with units.  With û = u + mu |u_T| n (Coulomb) or u (Tresca):

*exact*:     rho_i = 1 / |W_ii|_2, u = W r + q formed again from r,
             error = |(r_i - P(r_i - rho_i û_i)) / rho_i| / |q|; of a v that is given with r
             also |M v - H r - f| / |load|, what is beyond FLOOR roundings of its terms.
*residual*:  rho_i = 1 / |H_i^T D^-1 H_i|_2 with D the block diagonal of M, u = H^T v + w,
             error = max(|M v - H r - f| / |load|,
                         |(r_i - P(r_i - rho_i û_i)) / rho_i| / |u_ref|).
             With rigid modes R of bodies that contact alone holds, R^T M = 0, it is at least
             |R_k^T (H r + f)| / (|R_k^T f| + |R_k^T H| |r|): no large load elsewhere hides
             a body that is out of balance.
*nitsche*:   where v alone is unknown, see `nitsche`.

These are sums over all contacts, in which a contact with a small load is lost beside one with a
large: q_N = (-1, 1e8) is solved to 1e-8 by r = 0.  So the worst contact is measured too, on its
own scale, which a change of the units of any one contact leaves as it is:

*contactwise*: error = max_i z_i / s_i, z_i = max(|natural map|_i / rho_i, penetration_i / 2),
             s_i = |q_i| + sum_j |W_ij r_j|, to which FLOOR eps (|w_i| + |H_i|^T |M^-1 f|) is
             added where q_i was made of these and may be what rounding left of them.
             Without W: s_i = |q_i| + |u_i - q_i| + |r_i| / rho_i, no larger but for q_i, which
             is the local velocity of the problem with its contacts open, to some per cent.

A reaction has converged when the first error is below its tolerance and the second below its
own, by default the square root of the first.

At r = 0 the map of a penetrating contact is |u_N| / sqrt(1 + mu^2) only, and would vanish for
"glued" contacts with a huge mu; each contact counts at least half its penetration, which
changes nothing up to mu = 1.7.  A contact with W_ii = 0 can not react: r_i = 0 and u_N >= 0
are checked instead.
`natural_error` is compiled because a whole solve of a small problem takes 0.1 ms; its NumPy
twin is `Law.natural_map`, and the tests compare the two.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.block_kernels import velocity_of_rows_inplace
from ..law.law import BOUND, MU, TIED, Law, given

Array = NDArray[np.float64]
EPSILON = float(np.finfo(float).eps)
PENETRATION = 0.5  # share of a penetration that counts at least, whatever mu
FLOOR = 16.0  # roundings that may be what is left of a q_i whose parts cancel
STUCK = 1.0 - 1e-9  # |r_T| below this part of mu r_N: a contact that sticks


class Measure(Enum):
    """Which form of the error decides."""

    EXACT = "exact"
    RESIDUAL = "residual"
    NITSCHE = "nitsche"
    NATURAL = "natural"


class Criterion(Enum):
    """What a tolerance is for; the value is its name on the command line.

    JUDGE: the unit-free errors of this module.  NATURAL: |F_nat(r)| / |q| with rho = 1, [ABD]
    eq. (13), of the problem in its own units: to compare with publications.
    """

    JUDGE = "judge"
    NATURAL = "natural"


class Weakest(NamedTuple):
    """The contact that is farthest from its law on its own scale.

    error: unit-free; contact: its index, None where all contacts obey their law exactly.
    hidden: error in the sum over all contacts that rounding may hide, unit-free.
    """

    error: float
    contact: int | None
    hidden: float = 0.0


@njit(cache=True, error_model="numpy", inline="always")
def contact_residual(r0, r1, r2, u0, u1, u2, rho, kind, p):  # noqa: PLR0913
    """(r - P(r - rho û)) / rho of one 3D contact of a kind with parameters p, unit of u."""
    fixed = given(kind, p, r0)
    coefficient = p[BOUND] if fixed else p[MU]
    slip = math.sqrt(u1 * u1 + u2 * u2)
    x0 = r0 - rho * (u0 if fixed else u0 + coefficient * slip)
    x1 = r1 - rho * u1
    x2 = r2 - rho * u2
    t = math.sqrt(x1 * x1 + x2 * x2)
    if fixed:
        p0 = x0 if kind == TIED else max(x0, 0.0)
        scale = 1.0 if t <= coefficient else coefficient / t
    elif coefficient * t <= -x0:
        p0, scale = 0.0, 0.0
    elif t <= coefficient * x0:
        p0, scale = x0, 1.0
    else:
        p0 = (x0 + coefficient * t) / (1.0 + coefficient * coefficient)
        scale = min(coefficient * p0 / t, 1.0) if t > 0.0 else 0.0
    return (r0 - p0) / rho, (r1 - scale * x1) / rho, (r2 - scale * x2) / rho


@njit(cache=True, error_model="numpy")
def _all_zero(r):
    for i in range(len(r)):
        if r[i, 0] != 0.0 or r[i, 1] != 0.0 or r[i, 2] != 0.0:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _error_at_rest(q, kind, parameters, rho):
    """`natural_error` of r = 0, where every cold start is judged: no product with W."""
    total = 0.0
    for i in range(len(q)):
        e0 = e1 = e2 = 0.0
        if rho[i] > 0.0:
            e0, e1, e2 = contact_residual(
                0.0, 0.0, 0.0, q[i, 0], q[i, 1], q[i, 2], rho[i], kind[i], parameters[i]
            )
        elif kind[i] == TIED:
            e0, e1, e2 = q[i, 0], q[i, 1], q[i, 2]
        scale = PENETRATION if rho[i] > 0.0 else 1.0
        total += max(e0 * e0 + e1 * e1 + e2 * e2, (scale * min(q[i, 0], 0.0)) ** 2)
    return math.sqrt(total) if math.isfinite(total) else math.inf


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def natural_error(indptr, indices, data, q, kind, parameters, rho, r):
    """Euclidean norm of the scaled natural map, unit of u, with u = W r + q formed here.

    Rows of 3x3 blocks, or in their place `BlockRows.rows`; q, r (nc, 3); kind and parameters of
    the law (`law.law`); rho (nc,), 0 where a contact can not react.  Not a number in r gives
    infinity, never a small error.
    """
    if _all_zero(r):
        return _error_at_rest(q, kind, parameters, rho)
    u = np.empty_like(q)
    velocity_of_rows_inplace(0, len(kind), indptr, indices, data, q, r, u)
    return error_of_motion(kind, parameters, rho, r, u)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def error_of_motion(kind, parameters, rho, r, u):
    """`natural_error` where u = W r + q (nc, 3) is there already."""
    total = 0.0
    for i in range(len(kind)):
        u0, u1, u2 = u[i, 0], u[i, 1], u[i, 2]
        if rho[i] > 0.0:
            e0, e1, e2 = contact_residual(
                r[i, 0], r[i, 1], r[i, 2], u0, u1, u2, rho[i], kind[i], parameters[i]
            )
            total += max(e0 * e0 + e1 * e1 + e2 * e2, (PENETRATION * min(u0, 0.0)) ** 2)
        elif kind[i] == TIED:
            total += u0 * u0 + u1 * u1 + u2 * u2
        elif u0 < 0.0:
            total += u0 * u0
        if rho[i] <= 0.0 and (r[i, 0] != 0.0 or r[i, 1] != 0.0 or r[i, 2] != 0.0):
            return math.inf
    return math.sqrt(total) if math.isfinite(total) else math.inf


@njit(cache=True, error_model="numpy", inline="always")
def hidden_square(r0, r1, r2, rho, mu):  # noqa: PLR0913
    """|r / rho|^2 of a contact, times mu^2 where it sticks with mu > 1; unit of u squared.

    mu = 0 where its bound does not follow r_N.
    """
    tangential = r1 * r1 + r2 * r2
    size = (r0 * r0 + tangential) / (rho * rho)
    if mu > 1.0:
        if math.sqrt(tangential) < STUCK * mu * r0:
            size *= mu * mu
    return size


@njit(cache=True, error_model="numpy")
def rounding_error(kind, parameters, rho, r):
    """What rounding may hide in the velocities that reactions make, unit of u.

    eps |r / rho|: huge reactions that cancel, as of a body between two closing walls, swallow
    q, and with it any error.  With large friction the rounding of the slip of a contact that
    sticks counts mu times, as the slip does.  r (nc, 3), rho as in `natural_error`.
    """
    total = 0.0
    for i in range(len(rho)):
        if rho[i] > 0.0:
            fixed = given(kind[i], parameters[i], r[i, 0])
            mu = 0.0 if fixed else parameters[i, MU]
            total += hidden_square(r[i, 0], r[i, 1], r[i, 2], rho[i], mu)
    return EPSILON * math.sqrt(total)


def weakest_of(r: Array, u: Array, law: Law, rho: Array, scale: Array) -> Weakest:
    """NumPy form of the contactwise error with u and the scales (nc,) given."""
    if len(r) == 0:
        return Weakest(0.0, None)
    size = residual_sizes(r, u, law, rho)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(size > 0, size / scale, 0.0)
    contact = int(np.argmax(error))
    worst = float(error[contact])
    return Weakest(worst, contact) if worst > 0 else Weakest(0.0, None)


def scaled_residual(r: Array, u: Array, law: Law, rho: Array) -> float:
    """NumPy form of `natural_error` with u given; unit of u."""
    if not (np.isfinite(r).all() and np.isfinite(u).all()):
        return math.inf
    return float(np.linalg.norm(residual_sizes(r, u, law, rho)))


def residual_sizes(r: Array, u: Array, law: Law, rho: Array) -> Array:
    """The scaled natural map of each contact, (nc,), unit of u; infinite as `natural_error`."""
    index = np.flatnonzero(rho > 0)
    inner = law.at(index).natural_map(r[index], u[index], rho[index]) / rho[index, None]
    size = np.maximum(-law.stretched(u, r)[:, 0], 0.0)
    size[index] = np.maximum(np.linalg.norm(inner, axis=1), PENETRATION * size[index])
    rigid = (rho <= 0) & law.tied
    size[rigid] = np.linalg.norm(law.stretched(u, r)[rigid], axis=1)
    size[(rho <= 0) & r.any(axis=1)] = math.inf
    return size


def published_fclib_error(r: Array, u: Array, q: Array, law: Law) -> float:
    """|r - P_K(r - û)| / max(|q|, |r|, |u|), as FCLib and Siconos print it.

    It adds newtons to metres: reported for comparison with publications, never used to decide.
    """
    residual = law.natural_map(r, u, np.ones(len(r)))
    scale = max(np.linalg.norm(q), np.linalg.norm(r), np.linalg.norm(u))
    return float(np.linalg.norm(residual) / scale) if scale > 0 else 0.0


def published_natural_error(r: Array, u: Array, q: Array, law: Law) -> float:
    """|F_nat(r)| / |q| with F_nat = r - P_K(r - û), [ABD] eq. (13) with rho = 1.

    The stopping criterion of that comparison; 0 where r = 0 solves a problem with q = 0, else
    infinite there.  It adds newtons to metres as the FCLib error does, and decides only where
    it is asked to (Criterion.NATURAL).

    [ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017.
    """
    residual = float(np.linalg.norm(law.natural_map(r, u, np.ones(len(r)))))
    scale = float(np.linalg.norm(q))
    return ratio(residual, scale)


def ratio(size: float, scale: float) -> float:
    """size / scale, with 0 / 0 = 0."""
    return size / scale if scale > 0 else (0.0 if size == 0 else math.inf)


def max_penetration(u: Array) -> float:
    """Largest -u_N, unit of u; 0 when nothing penetrates."""
    return float(max(-u[:, 0].min(initial=0.0), 0.0))


def max_cone_violation(r: Array, law: Law) -> float:
    """Largest excess of |r_T| over its bound, or of tension -r_N over cohesion; unit of r."""
    return float(law.excess(r).max(initial=0.0))


__all__ = [
    "Criterion",
    "Measure",
    "Weakest",
    "contact_residual",
    "error_of_motion",
    "max_cone_violation",
    "max_penetration",
    "natural_error",
    "published_fclib_error",
    "published_natural_error",
    "ratio",
    "residual_sizes",
    "rounding_error",
    "scaled_residual",
    "weakest_of",
]
