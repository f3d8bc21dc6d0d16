"""Anderson's mixing of the last sweeps, in blocks of the vectors that threads share.

The next point to sweep from is r - sum_a w_a s_a: s_a are the last differences of the sweep
G(x) = r, and the weights w make r - x less their differences of G(x) - x least.  Vectors are
read once to store what is new and to form all sums, and once to mix; sums are those of blocks
of fixed length, added in order.  All that is stored is in arrays of the caller:

history (2, depth + 1, m): differences of G(x), and of f = G(x) - x; the last row of each has
the values themselves.  gram (depth + 1, depth): products of the differences of f, and with f in
the last row.  count (2,): how many differences were stored, and whether there are values.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ...core.threads import BLOCK

SHIFT = 1e-13  # of the least-squares equations, relative
SIZE, OLD_SIZE, OWN, WITH = 0, 1, 2, 3  # columns of the sums: f.f, its last, new.new, all.f
DROPPED = 4.0  # growth of f.f with which the memory begins anew


@njit(cache=True, error_model="numpy")
def sums_of(history):
    """Room for the sums of all blocks, (blocks, depth + 3)."""
    blocks = -(-history.shape[2] // BLOCK)
    return np.empty((blocks, history.shape[1] - 1 + WITH))


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def record(begin, end, r, x, history, count, sums):  # noqa: PLR0913
    """Store the differences that the sweep from x to r, flat, makes; the sums of its blocks."""
    depth, known = history.shape[1] - 1, count[1] != 0
    slot, used = count[0] % depth, min(count[0] + 1, depth) if known else 0
    for first in range(begin, end, BLOCK):
        last, total = min(first + BLOCK, end), sums[first // BLOCK]
        g, before = r[first:last], x[first:last]
        image, residual = history[0, depth, first:last], history[1, depth, first:last]
        step, slope = history[0, slot, first:last], history[1, slot, first:last]
        size = old_size = own = 0.0
        for i in range(len(g)):
            f = g[i] - before[i]
            size += f * f
            if known:
                old_size += residual[i] * residual[i]
                step[i], slope[i] = g[i] - image[i], f - residual[i]
                own += slope[i] * slope[i]
            image[i], residual[i] = g[i], f
        total[SIZE], total[OLD_SIZE], total[OWN] = size, old_size, own
        for a in range(used):
            other, product = history[1, a, first:last], 0.0
            for i in range(len(residual)):
                product += other[i] * residual[i]
            total[WITH + a] = product


@njit(cache=True, error_model="numpy")
def choose(gram, count, sums, weights):
    """The weights (depth,) of the differences by the sums of all blocks; how many there are."""
    depth = gram.shape[1]
    target, slot = gram[depth], count[0] % depth
    size = old_size = own = 0.0
    for k in range(len(sums)):
        size += sums[k, SIZE]
        old_size += sums[k, OLD_SIZE]
        own += sums[k, OWN]
    if count[1] == 0 or size > DROPPED * old_size:
        count[0], count[1] = 0, 1
        return 0
    count[0] += 1
    filled = min(count[0], depth)
    for a in range(filled):
        product = 0.0
        for k in range(len(sums)):
            product += sums[k, WITH + a]
        # slope = f - f_old: its products are differences of those with f
        gram[a, slot] = gram[slot, a] = product - target[a]
        target[a] = product
    gram[slot, slot] = own
    return filled if _least_squares(gram, target, filled, weights) else 0


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def combine(begin, end, r, x, into, history, weights, filled):  # noqa: PLR0913
    """x, and `into` with it, become the next point; all flat, `into` may be x or r."""
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        g, point, same = r[first:last], x[first:last], into[first:last]
        for i in range(len(g)):
            point[i] = g[i]
        for a in range(filled):
            w, step = weights[a], history[0, a, first:last]
            for i in range(len(step)):
                point[i] -= w * step[i]
        for i in range(len(point)):
            same[i] = point[i]


@njit(cache=True, error_model="numpy")
def mix_inplace(r, x, history, gram, count):
    """x becomes the next point to sweep from, r being the sweep from x."""
    sums, weights = sums_of(history), np.zeros(gram.shape[1])
    g, point = r.reshape(r.size), x.reshape(x.size)
    record(0, len(g), g, point, history, count, sums)
    filled = choose(gram, count, sums, weights)
    combine(0, len(g), g, point, point, history, weights, filled)


@njit(cache=True, error_model="numpy")
def _least_squares(gram, target, k, weights):
    """Solve (gram + tiny I) w = target for the leading k unknowns by L D L^T.

    A direction that depends on earlier ones gets the weight zero.  Returns False when all of
    gram is zero.
    """
    largest, factor = 0.0, np.empty((k, k))
    for i in range(k):
        largest = max(largest, gram[i, i])
    for i in range(k):
        for j in range(i):
            t = gram[i, j]
            for l in range(j):
                t -= factor[i, l] * factor[j, l] * factor[l, l]
            factor[i, j] = t / factor[j, j]
        pivot = gram[i, i] + SHIFT * largest
        for l in range(i):
            pivot -= factor[i, l] * factor[i, l] * factor[l, l]
        factor[i, i] = pivot if pivot > 0.01 * SHIFT * largest else 1e300
    for i in range(k):
        t = target[i]
        for l in range(i):
            t -= factor[i, l] * weights[l]
        weights[i] = t
    for i in range(k - 1, -1, -1):
        t = weights[i] / factor[i, i]
        for l in range(i + 1, k):
            t -= factor[l, i] * weights[l]
        weights[i] = t
    return largest > 0.0
