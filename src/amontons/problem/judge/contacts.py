"""All that is asked of reactions that may have converged, in one pass over W.

Their motion, the error in the sum and of the weakest contact (`judge`), what rounding may hide
in it, the status of every contact and reactions that keep to it (`settling`).  Each alone forms
W r + q again, which for a problem of a few hundred contacts is most of what judging costs.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.block_kernels import velocity_of_rows_inplace
from ..law.law import BOUND, MU, TIED, TRESCA, given
from ..law.states import OPEN, SLIP, STICK
from .measures import EPSILON, PENETRATION, Weakest, contact_residual, hidden_square, ratio

Array = NDArray[np.float64]
LARGER = 1.0 + 4.0 * EPSILON  # than its bound, more than rounding explains


@njit(cache=True, error_model="numpy", inline="always")
def settled_contact(r0, r1, r2, u0, u1, u2, rho, kind, p):  # noqa: PLR0913
    """(status, does the law let it slide?, share of r_N and of r_T that it keeps) of a contact.

    A closed or tied one keeps all, an open one nothing; under Tresca's law the shear up to its
    bound.
    """
    if kind == TIED:
        return STICK, False, 1.0, 1.0
    slip = math.sqrt(u1 * u1 + u2 * u2)
    x1, x2 = r1 - rho * u1, r2 - rho * u2
    x, shear = math.sqrt(x1 * x1 + x2 * x2), math.sqrt(r1 * r1 + r2 * r2)
    if given(kind, p, r0):
        closed = r0 - rho * u0 > 0.0
        slides = x > p[BOUND]
        if kind != TRESCA:
            slides = slides and closed
    else:
        coefficient = p[MU]
        normal = r0 - rho * (u0 + coefficient * slip)
        closed = coefficient * x > -normal
        slides = closed and not (x <= coefficient * normal and coefficient > 0.0)
    if closed and r0 > 0.0:
        return (SLIP if slides else STICK), slides, 1.0, 1.0
    bound = p[BOUND] if kind == TRESCA else 0.0
    return OPEN, slides, 0.0, (bound / shear if shear > bound * LARGER else 1.0)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _pushes(indptr, indices, data, r, i):
    """sum_j |W_ij r_j|, unit of u: only of contacts that may be the weakest, for its roots."""
    total = 0.0
    if data.shape[2] > 3:
        for j in range(len(r)):
            r0, r1, r2, c = r[j, 0], r[j, 1], r[j, 2], 3 * j
            d0 = data[i, 0, c] * r0 + data[i, 0, c + 1] * r1 + data[i, 0, c + 2] * r2
            d1 = data[i, 1, c] * r0 + data[i, 1, c + 1] * r1 + data[i, 1, c + 2] * r2
            d2 = data[i, 2, c] * r0 + data[i, 2, c + 1] * r1 + data[i, 2, c + 2] * r2
            total += math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        return total
    for k in range(uint64(indptr[i]), uint64(indptr[i + 1])):
        j = uint64(indices[k])
        r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
        d0 = data[k, 0, 0] * r0 + data[k, 0, 1] * r1 + data[k, 0, 2] * r2
        d1 = data[k, 1, 0] * r0 + data[k, 1, 1] * r1 + data[k, 1, 2] * r2
        d2 = data[k, 2, 0] * r0 + data[k, 2, 1] * r1 + data[k, 2, 2] * r2
        total += math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    return total


@njit(cache=True, error_model="numpy", inline="always")
def _size(r0, r1, r2, u0, u1, u2, rho, kind, p):  # noqa: PLR0913
    """How far a contact is from its law, unit of u: its natural map, half its penetration."""
    if rho > 0.0:
        e0, e1, e2 = contact_residual(r0, r1, r2, u0, u1, u2, rho, kind, p)
        return max(math.sqrt(e0 * e0 + e1 * e1 + e2 * e2), -PENETRATION * u0)
    if r0 != 0.0 or r1 != 0.0 or r2 != 0.0:
        return math.inf
    return math.sqrt(u0 * u0 + u1 * u1 + u2 * u2) if kind == TIED else max(-u0, 0.0)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def weak_contact(  # noqa: PLR0913
    indptr, indices, data, q, kind, parameters, rho, r, floor, u, first, most
):
    """A contact whose error on its own scale is above `most`, -1 without; `first` comes first.

    Arguments as of `assess`; u (nc, 3) is memory.
    """
    nc = len(kind)
    for k in range(nc):
        i = first + k if first + k < nc else first + k - nc
        velocity_of_rows_inplace(i, i + 1, indptr, indices, data, q, r, u)
        scale = floor[i] + math.sqrt(q[i, 0] ** 2 + q[i, 1] ** 2 + q[i, 2] ** 2)
        size = _size(
            r[i, 0], r[i, 1], r[i, 2], u[i, 0], u[i, 1], u[i, 2], rho[i], kind[i], parameters[i]
        )
        if not size <= most * scale:
            scale += _pushes(indptr, indices, data, r, i)
            if not size <= most * scale:
                return i
    return -1


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def assess(  # noqa: PLR0913
    indptr, indices, data, q, kind, parameters, rho, r, floor, u, kept, status, sliding
):
    """(error, largest contactwise error, its contact or -1, hidden, changed).

    Arguments and error as of `measures.natural_error`; floor (nc,): unit of u, added to the
    scale of each contact.  hidden: as `measures.rounding_error`.  Fills u, kept (nc, 3), the
    reactions that keep to the status, status (nc,) and sliding (nc,), 0 or 1; changed: kept is
    not r.
    """
    total, worst, contact, hidden, changed = 0.0, 0.0, -1, 0.0, False
    velocity_of_rows_inplace(0, len(kind), indptr, indices, data, q, r, u)
    for i in range(len(kind)):
        scale = floor[i] + math.sqrt(q[i, 0] ** 2 + q[i, 1] ** 2 + q[i, 2] ** 2)
        u0, u1, u2, p = u[i, 0], u[i, 1], u[i, 2], parameters[i]
        r0, r1, r2 = r[i, 0], r[i, 1], r[i, 2]
        size = _size(r0, r1, r2, u0, u1, u2, rho[i], kind[i], p)
        if rho[i] > 0.0:
            fixed = given(kind[i], p, r0)
            hidden += hidden_square(r0, r1, r2, rho[i], 0.0 if fixed else p[MU])
        total += size * size
        if not size <= worst * scale:  # also where it is not a number
            scale += _pushes(indptr, indices, data, r, i)
            if not size <= worst * scale:
                worst, contact = (size / scale if scale > 0.0 else math.inf), i
        state, slides, normal, shear = settled_contact(
            r0, r1, r2, u0, u1, u2, rho[i], kind[i], p
        )
        status[i], sliding[i] = state, slides
        kept[i, 0], kept[i, 1], kept[i, 2] = normal * r0, shear * r1, shear * r2
        changed = changed or kept[i, 0] != r0 or kept[i, 1] != r1 or kept[i, 2] != r2
    if worst != worst or hidden != hidden:
        worst = hidden = math.inf
    error = math.sqrt(total) if math.isfinite(total) else math.inf
    return error, worst, contact, EPSILON * math.sqrt(hidden), changed


class Assessed(NamedTuple):
    """What `assess` finds: errors unit-free, u and kept (nc, 3)."""

    error: float
    weakest: Weakest
    u: Array
    kept: Array
    status: NDArray[np.int8]
    sliding: NDArray[np.bool_]
    changed: bool


def assessed(data: tuple[Any, ...], r: Array, floor: Array, scale: float) -> Assessed:
    """`assess` with the data that kernels take and r (nc, 3); scale: size of q, unit of u."""
    u, kept = np.empty((2, len(r), 3))
    status, sliding = np.empty((2, len(r)), np.int8)
    error, worst, contact, hidden, changed = assess(*data, r, floor, u, kept, status, sliding)
    weakest = Weakest(worst, contact if contact >= 0 else None, ratio(hidden, scale))
    return Assessed(
        ratio(error, scale), weakest, u, kept, status, sliding.view(np.bool_), changed
    )


__all__ = ["Assessed", "assess", "assessed", "settled_contact", "weak_contact"]
