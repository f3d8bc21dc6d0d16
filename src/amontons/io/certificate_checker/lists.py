"""All solutions in 2D, for one load or for all between two: each pattern excluded or solved.

r_N = a + b, r_T = mu (a - b).  A solution dissipates, r W r + q r <= 0, which bounds a, b, u_N
and u_T: g r <= b where [[k W, (k q - g) / 2], [., b]] is positive definite for some k > 0, for
loads between two by the larger b.  For every y it has y.u - (W^T y).r = y.q.  A pattern that
fixes or signs a, b and u is excluded by a y for which the left side can not reach the right
one.  The patterns that are left are linear systems, solved in rational numbers: r is linear in
the load, and so are the numbers that the law wants not to be negative.
"""

from fractions import Fraction

import numpy as np

from .numbers import TINY, Refused, U, exact, need, positive_definite
from .patterns import covered

ANY = np.inf
RANGES = {  # of a, b, u_N, u_T; 0 slips without friction
    ".": ((0, 0, 0, -ANY), (ANY, ANY, ANY, ANY)), "c": ((0, 0, 0, -ANY), (ANY, ANY, 0, ANY)),
    "f": ((0, 0, 0, -ANY), (0, 0, ANY, ANY)), "s": ((0, 0, 0, 0), (ANY, ANY, 0, 0)),
    "+": ((0, 0, 0, -ANY), (ANY, 0, 0, 0)), "-": ((0, 0, 0, 0), (0, ANY, 0, ANY)),
    "0": ((0, 0, 0, -ANY), (ANY, 0, 0, ANY)),
}  # fmt: skip


def lines(W, q, mu, patterns, y, left, r, distance, end=None, **_):
    """All solutions in words; end (nc, 2): the other load, r (k, nc, 2): middles of lines."""
    words, rest = ([bytes(x).decode() for x in given] for given in (patterns, left))
    need(q.shape[1] == 2 and all(len(x) == len(mu) for x in words + rest), "patterns in 3D")
    need(covered(words + rest, mu), "patterns are missing")
    loads = np.stack([x.ravel() for x in (q, q if end is None else end)])
    need(not words or excludes(W, loads, mu, words, y).all(), "a pattern is not excluded")
    found = [one for word in sorted(set(rest)) for one in solved(exact(W), loads, mu, word)]
    spans = {tuple(ends): (word, low, high) for word, low, high, ends in found
             if end is None or low < high}  # fmt: skip
    touched = {x for one in spans for x in one}
    need(all(x in touched for *_, ends in found for x in ends), "a solution at one load alone")
    near = [[abs(np.array(one[0][1:]) + np.array(one[1][1:]) - 2 * exact(x).ravel()).max()
             for x in r] for one in spans]  # fmt: skip
    need(len(r) == len(spans) and all(min(x) <= 2 * distance for x in near), "another list")
    names = f"{len(spans)}: {', '.join(sorted(word for word, *_ in spans.values()))}"
    one = "this load: the number of solutions is exactly"
    return f"{one if end is None else 'all loads between two: solutions are on lines,'} {names}"


def reach(W, q, g):
    """Bound of g r for all r W r + q r <= 0."""
    if not g.any():
        return 0.0
    by_g, by_q = np.linalg.solve(W, np.vstack([g, q]).T).T
    squares = g @ by_g, q @ by_q
    need(min(squares) > 0, "W is not definite, or there is no load")
    size, load = np.sqrt(squares)
    most = size * load / 2 - g @ by_q / 2
    for room in (1e-6, 1e-3, 1.0):
        b, k = most + room * size * load, size / load
        A = np.block([[k * W, (k * q - g)[:, None] / 2], [(k * q - g) / 2, b]])
        terms = (k * abs(q) + abs(g)) / 2
        sizes = np.block([[k * abs(W), terms[:, None]], [terms, abs(b)]])
        if positive_definite(A, 8 * U * sizes):
            return b
    raise Refused("W is not definite: reactions are not bounded")


def box(W, loads, mu):
    """Ranges (nc, 4) of a, b, u_N and u_T in all solutions.

    What bounds them at a load is convex in it: between two loads it is below the larger one.
    """
    S, low, high = (W + W.T) / 2, *np.zeros((2, len(loads), len(mu), 4))
    for i, (normal, tangent) in enumerate(np.eye(len(W)).reshape(-1, 2, len(W))):
        slope = tangent / mu[i] if mu[i] > 0 else normal
        for j, g in enumerate([normal + slope, normal - slope, 2 * W[2 * i], 2 * W[2 * i + 1]]):
            low[:, i, j] = [-reach(S, q, -g / 2) for q in loads]
            high[:, i, j] = [reach(S, q, g / 2) for q in loads]
    for x in (low, high):
        x[..., 2:] += loads.reshape(len(loads), -1, 2)
    room = 8 * U * (abs(low) + abs(high) + abs(loads).max())
    return (low - room).min(axis=0), (high + room).max(axis=0)


def excludes(W, loads, mu, words, y):
    """Which patterns the multipliers y exclude at all loads, rounding included."""
    kinds = (["0" if m == 0 and x == "+" else x for x, m in zip(p, mu, strict=True)]
             for p in words)  # fmt: skip
    signs = np.array([[RANGES[x] for x in kind] for kind in kinds], dtype=float)
    low, high = box(W, loads, mu)
    low, high = np.maximum(low, signs[:, :, 0]), np.minimum(high, signs[:, :, 1])
    y, weights = y.reshape(len(words), -1), []
    for own, w, sign in ((y, -W, 1), (abs(y), abs(W), -1)):  # weights of a, b, u; their terms
        (normal, tangent), direct = ((x.reshape(len(y), -1, 2).T) for x in (own @ w, own))
        slope = mu[:, None] * tangent
        weights += [np.stack([normal + slope, normal - sign * slope, *direct]).T]
    weight, size = weights
    ends = np.stack([weight * low, weight * high])
    most, least = ends.max(axis=0).sum((1, 2)), ends.min(axis=0).sum((1, 2))
    right, margin = y @ loads.T, (abs(y) @ abs(loads).T).max(axis=1)
    margin += (size * np.maximum(abs(low), abs(high))).sum((1, 2))
    margin *= 4 * U * (len(W) + 20)
    margin += TINY * (1 + (1 + mu.max()) * np.maximum(abs(low), abs(high)).sum((1, 2)))
    out = (right.min(axis=1) > most + margin) | (right.max(axis=1) < least - margin)
    return out | (low > high).any(axis=(1, 2))


def solved(W, loads, mu, word):
    """[(pattern, low, high, ends)] of solutions, ends (t, r) at low and high; [] for none."""
    one, sign, rows, columns = exact(np.eye(len(W))), {"+": 1, "-": -1, "s": 0}, [], []
    for i in (i for i in range(len(mu)) if word[i] != "f"):
        rows += [2 * i, 2 * i + 1][: 1 + (word[i] == "s")]
        columns += [one[2 * i] + sign[word[i]] * Fraction(mu[i]) * one[2 * i + 1]]
        columns += [one[2 * i + 1]] * (word[i] == "s")
    q, r = exact(loads).T, exact(np.zeros((len(W), 2)))
    if rows:
        R = np.array(columns).T
        r = R.dot(eliminated(W.dot(R)[rows], -q[rows]))
    u, slacks = W.dot(r) + q, []
    for i, letter in enumerate(word):
        (normal, tangent), (gap, slide) = r[2 * i : 2 * i + 2], u[2 * i : 2 * i + 2]
        if letter == "s":
            slacks += [Fraction(mu[i]) * normal - tangent, Fraction(mu[i]) * normal + tangent]
        else:
            slacks += [gap if letter == "f" else normal]
        if letter in "+-" and mu[i] > 0:
            slacks += [-sign[letter] * slide]
    low, high = Fraction(0), Fraction(1)
    for first, last in slacks:
        if first < 0 and last < 0:
            return []
        low = max(low, first / (first - last)) if first < 0 else low
        high = min(high, first / (first - last)) if last < 0 else high
    ends = [(t, *(r[:, 0] + t * (r[:, 1] - r[:, 0]))) for t in (low, high)]
    return [(word, low, high, ends)] if low <= high else []


def eliminated(A, B):
    """A^-1 B, exactly."""
    A = np.hstack([A, B])
    for k in range(len(A)):
        pivot = next((i for i in range(k, len(A)) if A[i, k]), None)
        need(pivot is not None, "a pattern is singular")
        A[[k, pivot]] = A[[pivot, k]]
        A[k] = A[k] / A[k, k]
        for i in range(len(A)):
            if i != k and A[i, k]:
                A[i] = A[i] - A[i, k] * A[k]
    return A[:, len(A) :]
