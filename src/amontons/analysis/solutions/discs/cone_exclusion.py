"""That statuses and slip directions have no solution at any load between two, in 3D.

    u = W r + q,   q = (1 - s) q_a + s q_b,   0 <= s <= 1,

with every (r_i, u_i) in a convex cone of its state (`statuses`):

    free    r = 0, u_N >= 0             stick   |r_T| <= mu r_N, u = 0
    any     |r_T| <= mu r_N, u_N >= 0   slip    r_T = -rho r_N e, u_N = 0, u_T = s e, s >= 0
    closed  |r_T| <= mu r_N, u_N = 0            with e on an arc, rho between least and most mu

There is none where some y has y u <= 0 for all of these u and y (W r + q) > 0 for all of
these r and q with sum r_N <= R: a separating hyperplane [HUL].  The best y is what is left of
the least-squares problem

    min |(q_a, 1) l_a + (q_b, 1) l_b + sum x_j (c_j, 0) - (0, 1)|,   x, l >= 0,

over the rays c_j of the cones, W r or -u; [LH] takes them up one by one, here the one that is
violated most of all rays that a cone has, so that discs and arcs are exact.  A further row
holds sum r_N <= R; rows of u_T that may be anything are left out.  That y proves anything is
checked with a bound of all rounding.

[LH] C. Lawson, R. Hanson, "Solving least squares problems" (1974), chapter 23, NNLS.
[HUL] J.-B. Hiriart-Urruty, C. Lemaréchal, "Fundamentals of convex analysis" (2001), A.4.
"""

from __future__ import annotations

import math

import numpy as np

from ....core.compiled import njit
from ....core.copies import copy_inplace
from ...statuses import ANY, FREE, FRICTIONLESS, SLIP, STICK

EPSILON = float(np.finfo(float).eps)
ENTERS = 1e-9  # violation of a ray, relative to its length, from which it is taken up
STEPS = 60  # rays taken up, after which nothing is known
DEPENDENT = 1e-12  # pivot of Cholesky's factor, relative, of rays that depend on each other
ALIKE = 1e-3  # loads, or rays of one arc, that are no further apart are tried as one
HALF_CIRCLE = math.pi / 2  # half an arc from which u_T may point anywhere


@njit(cache=True)
def _on_arc(angle, arcs, i):
    """The angle on the arc of a contact that is nearest to another, or its middle."""
    middle, half = arcs[0, i], arcs[1, i] if arcs[1, i] > ALIKE else 0.0
    off = angle - middle
    off -= 2 * math.pi * np.round(off / (2 * math.pi))
    return middle + min(max(off, -half), half)


@njit(cache=True)
def _most_on_arc(a, b, middle, half):
    """Upper bound of a cos x + b sin x for |x - middle| <= half."""
    length = math.hypot(a, b)
    if length == 0.0:
        return 0.0
    off = math.atan2(b, a) - middle
    off = abs(off - 2 * math.pi * np.round(off / (2 * math.pi)))
    return length * (math.cos(max(off - half, 0.0)) + 16 * EPSILON)


@njit(cache=True)
def _admissible_inplace(y, states, arcs):
    """Turn y so that y u <= 0 holds for what u may be, but for slip on arcs."""
    for i in range(len(states)):
        state = states[i]
        if state == FREE or state == ANY:
            y[3 * i] = min(y[3 * i], 0.0)
        if state != STICK and (state != SLIP or arcs[1, i] >= HALF_CIRCLE):
            y[3 * i + 1] = y[3 * i + 2] = 0.0


@njit(cache=True)
def _deficits(W, y, states, arcs, mus, fastest):
    """(largest d with y W r >= -d sum r_N, bound of y u), rounding included."""
    nc = len(states)
    lack = motion = 0.0
    for i in range(nc):
        state = states[i]
        if state == SLIP and arcs[1, i] < HALF_CIRCLE:
            most = _most_on_arc(y[3 * i + 1], y[3 * i + 2], arcs[0, i], arcs[1, i])
            motion += max(most, 0.0) * fastest[i]
        if state == FREE:
            continue
        g, size = np.zeros(3), np.zeros(3)
        for k in range(3 * nc):
            for j in range(3):
                term = W[k, 3 * i + j] * y[k]
                g[j] += term
                size[j] += abs(term)
        for part in range(2):
            mu = mus[part, i]
            if state == FRICTIONLESS or mu == 0.0:
                pushed = 0.0
            elif state == SLIP:
                pushed = mu * _most_on_arc(g[1], g[2], arcs[0, i], arcs[1, i])
            else:
                pushed = mu * math.hypot(g[1], g[2])
            error = 4 * EPSILON * (3 * nc + 8) * (size[0] + mu * (size[1] + size[2]))
            lack = max(lack, pushed - g[0] + error)
    return lack, motion


@njit(cache=True)
def excludes(W, y, states, arcs, mus, loads, most, fastest):
    """True where y proves that there is no solution; most: R, fastest (nc,): bound of |u_T|."""
    lack, motion = _deficits(W, y, states, arcs, mus, fastest)
    least, size = np.inf, 0.0
    for side in range(2):
        value = total = 0.0
        for k in range(len(y)):
            value += y[k] * loads[side, k]
            total += abs(y[k] * loads[side, k])
        least, size = min(least, value), max(size, total)
    return least > (lack * most + motion + 4 * EPSILON * (len(y) + 8) * size) * (1 + 1e-12)


# ------------------------------------------------------------------ the best multipliers
@njit(cache=True)
def _enter_inplace(W, i, ray, most, column):
    """The column of a reaction of contact i."""
    m = len(W)
    for k in range(m):
        column[k] = (W[k, 3 * i] * ray[0] + W[k, 3 * i + 1] * ray[1]
                     + W[k, 3 * i + 2] * ray[2])  # fmt: skip
    column[m], column[m + 1] = ray[0] / most, 0.0


@njit(cache=True)
def _masked_inplace(column, states, arcs):
    """Leave out the rows of u_T that may be anything."""
    for i in range(len(states)):
        if states[i] != STICK and (states[i] != SLIP or arcs[1, i] >= HALF_CIRCLE):
            column[3 * i + 1] = column[3 * i + 2] = 0.0


@njit(cache=True)
def _along(column, left):
    """Product of a column of length 1 with what is left."""
    value = size = 0.0
    for k in range(len(left)):
        value += column[k] * left[k]
        size += column[k] ** 2
    return value / math.sqrt(size) if size > 0 else 0.0


@njit(cache=True)
def _most_violated_inplace(W, left, states, arcs, mus, loads, most, column, ray):  # noqa: PLR0913
    """Fill in the column with the largest product with what is left; (product, its kind).

    Kinds: contact i for r, nc + i for u, 2 nc for none of either; ray (3,): r or u.
    """
    nc, m = len(states), len(W)
    best, kind = 0.0, -1
    trial, own = np.zeros(m + 2), np.zeros(3)
    for i in range(nc):
        state = states[i]
        for part in range(3):  # reaction with the least and the largest mu, velocity
            if part < 2:
                few = state != SLIP or mus[1, i] - mus[0, i] <= ALIKE * mus[1, i]
                if state == FREE or (part == 0 and few):
                    continue
                a = b = 0.0
                for k in range(m):
                    a += W[k, 3 * i + 1] * left[k]
                    b += W[k, 3 * i + 2] * left[k]
                mu = 0.0 if state == FRICTIONLESS else mus[part, i]
                angle = math.atan2(b, a)
                if state == SLIP:
                    angle = _on_arc(angle + math.pi, arcs, i) + math.pi
                own[0], own[1], own[2] = 1.0, mu * math.cos(angle), mu * math.sin(angle)
                _enter_inplace(W, i, own, most, trial)
            elif state == FREE or state == ANY:
                own[0], own[1], own[2] = 1.0, 0.0, 0.0
                trial[:] = 0.0
                trial[3 * i] = -1.0
            elif state == SLIP and arcs[1, i] < HALF_CIRCLE:
                angle = math.atan2(-left[3 * i + 2], -left[3 * i + 1])
                angle = _on_arc(angle, arcs, i)
                own[0], own[1], own[2] = 0.0, math.cos(angle), math.sin(angle)
                trial[:] = 0.0
                trial[3 * i + 1], trial[3 * i + 2] = -own[1], -own[2]
            else:
                continue
            _masked_inplace(trial, states, arcs)
            value = _along(trial, left)
            if value > best:
                best, kind = value, i + (nc if part == 2 else 0)
                copy_inplace(trial, column)
                copy_inplace(own, ray)
    apart = size = 0.0
    for k in range(m):
        apart += (loads[1, k] - loads[0, k]) ** 2
        size += loads[0, k] ** 2
    alike = apart <= ALIKE**2 * size
    for part in range(1 if alike else 0, 3):  # both loads, or their mean; what is left of R
        trial[:] = 0.0
        if part < 2:
            for k in range(m):
                trial[k] = (loads[0, k] + loads[1, k]) / 2 if alike else loads[part, k]
            trial[m], trial[m + 1] = -1.0, 1.0
        else:
            trial[m] = 1.0
        _masked_inplace(trial, states, arcs)
        value = _along(trial, left)
        if value > best:
            best, kind = value, 2 * nc
            copy_inplace(trial, column)
    return best, kind


@njit(cache=True)
def _least_squares_inplace(A, count, right, L, s):
    """s of min |A s - (0, .., 0, right)| over `count` rows of A; False where they depend."""
    m = A.shape[1]
    own = 0.0
    for i in range(count):
        for j in range(i + 1):
            value = 0.0
            for k in range(m):
                value += A[i, k] * A[j, k]
            if i == j:
                own = value
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                if value <= DEPENDENT * own:
                    return False
                L[i, i] = math.sqrt(value)
            else:
                L[i, j] = value / L[j, j]
    for i in range(count):
        value = A[i, m - 1] * right
        for k in range(i):
            value -= L[i, k] * s[k]
        s[i] = value / L[i, i]
    for i in range(count - 1, -1, -1):
        value = s[i]
        for k in range(i + 1, count):
            value -= L[k, i] * s[k]
        s[i] = value / L[i, i]
    return True


@njit(cache=True)
def _all_positive(s, count):
    for j in range(count):
        if s[j] <= 0.0:
            return False
    return True


@njit(cache=True)
def _shortened_inplace(A, x, s, count, kinds, rays):
    """Go from x towards s until a number vanishes, and drop it; the new count."""
    part = 1.0
    for j in range(count):
        if s[j] <= 0.0:
            part = min(part, x[j] / (x[j] - s[j]) if x[j] > s[j] else 0.0)
    kept = 0
    for j in range(count):
        value = x[j] + part * (s[j] - x[j])
        if s[j] <= 0.0 and value <= 1e-14:
            continue
        x[kept], kinds[kept] = value, kinds[j]
        copy_inplace(A[j], A[kept])
        copy_inplace(rays[j], rays[kept])
        kept += 1
    return kept


@njit(cache=True)
def exclude(W, states, arcs, mus, loads, most, fastest, y, guess):  # noqa: PLR0913
    """True where there is surely no solution; y (3 nc,): why.

    arcs (2, nc): middle and half, mus (2, nc): least and most, loads (2, 3 nc).
    guess (nc, 6): else (r, u) near which one may be.
    """
    nc, m = len(states), len(W)
    A, L = np.zeros((m + 4, m + 2)), np.zeros((m + 4, m + 4))
    x, s, rays = np.zeros(m + 4), np.zeros(m + 4), np.zeros((m + 4, 3))
    kinds = np.zeros(m + 4, dtype=np.int64)
    left, column, ray = np.zeros(m + 2), np.zeros(m + 2), np.zeros(3)
    count = 0
    for _ in range(STEPS):
        left[:] = 0.0
        left[m + 1] = 1.0
        for j in range(count):
            for k in range(m + 2):
                left[k] -= x[j] * A[j, k]
        for k in range(m):
            y[k] = -left[k]
        _admissible_inplace(y, states, arcs)
        if count and excludes(W, y, states, arcs, mus, loads, most, fastest):
            return True
        value, kind = _most_violated_inplace(
            W, left, states, arcs, mus, loads, most, column, ray
        )
        if value <= ENTERS or count == m + 4:
            break
        copy_inplace(column, A[count])
        copy_inplace(ray, rays[count])
        kinds[count], x[count] = kind, 0.0
        count += 1
        fine = False
        while count:
            fine = _least_squares_inplace(A, count, 1.0, L, s)
            if not fine or _all_positive(s, count):
                break
            before, fine = count, False
            count = _shortened_inplace(A, x, s, count, kinds, rays)
            if count == before:
                break
        if not fine:
            break
        for j in range(count):
            x[j] = s[j]
    guess[:] = 0.0
    for j in range(count):
        kind = kinds[j]
        if kind < 2 * nc:
            for k in range(3):
                guess[kind % nc, k + 3 * (kind // nc)] += x[j] * rays[j, k]
    return False
