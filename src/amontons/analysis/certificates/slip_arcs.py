"""The compiled search over directions for the criteria of critical friction in 3D.

A criterion fails at friction mu where, for some angles, a matrix M has rho >= 0, not zero, with

    rho_p = 0  or  (M rho)_p <= 0    for every contact p,

that is, where M is not strictly semimonotone [Cottle].  With u_T = rho n, n = (cos theta,
sin theta), t = n turned by 90 degrees, and r = A u (`disc_criteria`), the rows of M rho are

    n . r_T - mu (cos psi r_N + sin psi t . r_T)

A box gives each contact an interval of theta and one of psi.  What lowers entries of M only
lets it fail earlier, so the least of each entry over the box decides for all of the box; on an
interval of psi of half width h, cos psi r_N + sin psi t . r_T <= e / cos h with e its value in
the middle of the interval for the largest of all psi, so that mu / cos h there is enough.

[Cottle] R. W. Cottle, J.-S. Pang, R. E. Stone, "The linear complementarity problem" (2009),
section 3.9.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.copies import copy_inplace

Array = NDArray[np.float64]

PROVED, FAILED, SMALL, STOPPED = 1, -1, 0, 2
TINY = 1e-12  # of the size of a matrix, within which an entry counts as zero
LEAST = 1e-6  # rad: half of the smallest interval
BISECTIONS = 50


@njit(cache=True)
def _least(a, b, middle, half):
    """Least value of a cos x + b sin x for |x - middle| <= half."""
    far = middle - math.atan2(b, a) - math.pi
    far = abs(far - 2 * math.pi * np.round(far / (2 * math.pi)))  # from where it is least
    return -math.hypot(a, b) * math.cos(max(far - half, 0.0))


@njit(cache=True)
def _least_product(g11, g12, g21, g22, p, hp, q, hq, same):
    """Least n(x)' g n(y) for x in p +- hp, y in q +- hq; same: x - y = p - q throughout."""
    across = 0.0 if same else hp + hq
    value = _least((g11 + g22) / 2, (g12 - g21) / 2, q - p, across)
    return value + _least((g11 - g22) / 2, (g12 + g21) / 2, q + p, hp + hq)


@njit(cache=True)
def fill_inplace(A, mu, middle, half, M):
    """The least of every entry of M (k, k) over a box.

    A (3 k, 3 k), rows (N, T1, T2) of each contact.  mu (k,).  middle, half (2 k,): theta of all
    contacts, then psi.
    """
    k = len(mu)
    for p in range(k):
        across = mu[p] / math.cos(half[k + p])
        normal, turned = across * math.cos(middle[k + p]), across * math.sin(middle[k + p])
        long = math.hypot(1.0, turned)  # n - turned t = long n(theta - angle)
        angle = math.atan2(turned, 1.0)
        for q in range(k):
            M[p, q] = long * _least_product(
                A[3 * p + 1, 3 * q + 1], A[3 * p + 1, 3 * q + 2], A[3 * p + 2, 3 * q + 1],
                A[3 * p + 2, 3 * q + 2], middle[p] - angle, half[p], middle[q], half[q], p == q,
            ) + _least(-normal * A[3 * p, 3 * q + 1], -normal * A[3 * p, 3 * q + 2],
                       middle[q], half[q])  # fmt: skip


@njit(cache=True)
def _is_definite(M, L):
    """True where the symmetric part of M has a Cholesky factor: then M passes."""
    for i in range(len(M)):
        for j in range(i + 1):
            value = (M[i, j] + M[j, i]) / 2
            for m in range(j):
                value -= L[i, m] * L[j, m]
            if i == j:
                if value <= TINY * abs(M[i, i]):
                    return False
                L[i, i] = math.sqrt(value)
            else:
                L[i, j] = value / L[j, j]
    return True


@njit(cache=True)
def _passes(M, rows, count, X):
    """Whether M on some rows has no z > 0 with M z <= 0, given that all parts of it pass.

    Then only a nonsingular M with no positive entry in its inverse, or a singular one, has z:
    for M x >= 0 the part x - c z on the rim of the positive cone would contradict what passes.
    """
    for a in range(count):
        least = 0.0
        for b in range(count):
            least = min(least, M[rows[a], rows[b]])
        if least >= 0.0:  # and the diagonal is positive
            return True
    for a in range(count):
        for b in range(count):
            X[a, b] = M[rows[a], rows[b]]
            X[a, count + b] = 1.0 if a == b else 0.0
    size = np.abs(X[:count, :count]).max()
    for a in range(count):
        best = a
        for b in range(a + 1, count):
            if abs(X[b, a]) > abs(X[best, a]):
                best = b
        if abs(X[best, a]) <= TINY * size:
            return False
        for c in range(2 * count):
            X[a, c], X[best, c] = X[best, c], X[a, c]
        pivot = X[a, a]
        for c in range(2 * count):
            X[a, c] /= pivot
        for b in range(count):
            if b != a and X[b, a] != 0.0:
                f = X[b, a]
                for c in range(2 * count):
                    X[b, c] -= f * X[a, c]
    inverse = X[:count, count : 2 * count]
    return inverse.max() > TINY * np.abs(inverse).max()


@njit(cache=True)
def first_failing(M, L, X, rows):
    """0 where M is strictly semimonotone, else the first part of it (bits) that is not."""
    size = len(M)
    if _is_definite(M, L):
        return 0
    for part in range(1, 1 << size):
        count = 0
        for i in range(size):
            if part >> i & 1:
                rows[count] = i
                count += 1
        if count == 1:
            if M[rows[0], rows[0]] <= 0.0:
                return part
        elif not _passes(M, rows, count, X):
            return part
    return 0


@njit(cache=True)
def search_inplace(A, mu, middle, half, top, budget):
    """Go on with the proof that the criterion holds; (status, boxes left, boxes seen).

    middle, half (room, 2 k): a stack of `top` boxes.  FAILED: at the middle of the box on top.
    SMALL: the box on top is too small to be divided.  STOPPED: budget is spent, call again.
    """
    k = len(mu)
    M, L, X = np.zeros((k, k)), np.zeros((k, k)), np.zeros((k, 2 * k))
    rows = np.zeros(k, dtype=np.int64)
    point = np.zeros(2 * k)
    seen = 0
    while top > 0:
        if seen >= budget:
            return STOPPED, top, seen
        seen += 1
        here, width = middle[top - 1], half[top - 1]
        fill_inplace(A, mu, here, width, M)
        if first_failing(M, L, X, rows) == 0:
            top -= 1
            continue
        fill_inplace(A, mu, here, point, M)
        if first_failing(M, L, X, rows) != 0:
            return FAILED, top, seen
        widest, most = 0, -1.0
        for i in range(2 * k):
            loss = width[i] if i < k else width[i] ** 2 / 2  # of friction, by that interval
            if loss > most:
                widest, most = i, loss
        if width[widest] < LEAST or top == len(middle):
            return SMALL, top, seen
        copy_inplace(width, half[top])
        copy_inplace(here, middle[top])
        for row in (top - 1, top):
            half[row, widest] /= 2
        middle[top - 1, widest] -= half[top, widest]
        middle[top, widest] += half[top, widest]
        top += 1
    return PROVED, 0, seen


@njit(cache=True)
def _first_failing_friction(A, shape, angles, largest, M):
    """(t, part): the least t up to the largest with which a part (bits) of M fails; inf, 0.

    M (k, k) becomes the matrix of t.
    """
    k = len(shape)
    L, X = np.zeros((k, k)), np.zeros((k, 2 * k))
    rows, point = np.zeros(k, dtype=np.int64), np.zeros(2 * k)
    fill_inplace(A, largest * shape, angles, point, M)
    if first_failing(M, L, X, rows) == 0:
        return np.inf, 0
    low, high = 1e-12 * largest, largest
    for _ in range(BISECTIONS):
        t = math.sqrt(low * high)
        fill_inplace(A, t * shape, angles, point, M)
        if first_failing(M, L, X, rows) == 0:
            low = t
        else:
            high = t
    fill_inplace(A, high * shape, angles, point, M)
    return high, first_failing(M, L, X, rows)


def point_threshold(
    A: Array, shape: Array, angles: Array, largest: float
) -> tuple[float, Array]:
    """(t, rho (k,)): the friction t shape from which on the criterion fails at these angles.

    rho >= 0 has M rho <= 0 on its entries that are not zero.  t is inf, and rho zero, where it
    does not fail up to the largest.
    """
    k = len(shape)
    M, rho = np.zeros((k, k)), np.zeros(k)
    t, part = _first_failing_friction(A, shape, angles, largest, M)
    chosen = [i for i in range(k) if part >> i & 1]
    if len(chosen) == 1:
        rho[chosen] = 1.0
    elif chosen:
        values = _opposed(M[np.ix_(chosen, chosen)])
        rho[chosen] = values / values.max()
    return t, rho


def _opposed(M: Array) -> Array:
    """rho >= 0 with M rho <= 0, of a least part M that fails, to rounding.

    All smaller parts pass, so that the inverse has no entry > 0, or the kernel is of one sign.
    """
    try:
        return np.abs(np.linalg.inv(M)).sum(axis=1)
    except np.linalg.LinAlgError:  # at the threshold itself
        return np.abs(np.linalg.svd(M)[2][-1])
