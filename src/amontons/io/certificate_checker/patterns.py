"""All solutions of a 2D load are near one: by patterns of statuses, with a form per contact.

z = (r_N, r_T, u_N, u_T) of a status lies in a cone.  Copositive: K.-P. Hadeler, Linear Algebra
Appl. 49 (1983): where all smaller principal parts are, B is not only if det B < 0 and no entry
of its adjugate is negative.
"""

from fractions import Fraction
from itertools import combinations

import numpy as np

from .numbers import bound, exact, need, reference

ALLOWED = {"f": "f", "s": "s", "+": "+", "-": "-", "x": "+-", "c": "s+-", ".": "fs+-"}


def covered(patterns, mu):
    """True when every choice of statuses is in one of the patterns."""
    if not patterns or any(set(p) <= {"."} for p in patterns):
        return bool(patterns)
    i = next(k for k in range(len(mu)) if any(p[k] != "." for p in patterns))
    return all(covered([p[:i] + "." + p[i + 1 :] for p in patterns if s in ALLOWED[p[i]]], mu)
               for s in ("f+" if mu[i] == 0 else "fs+-"))  # fmt: skip


def rays(status, mu):
    """Generators of the cone of a status."""
    if status == "f" or mu == 0:
        first = [0, 0, 1, 0] if status == "f" else [1, 0, 0, 0]
        return [first, [0, 0, 0, 1], [0, 0, 0, -1]]
    sign = 1 if status == "+" else -1
    last = [1, mu, 0, 0] if status == "s" else [0, 0, 0, -sign]
    return [[1, sign * mu, 0, 0], last]


def determinant(B):
    """Of a few rows, exactly."""
    if not len(B):
        return 1
    minors = (determinant(np.delete(B[1:], j, 1)) for j in range(len(B)))
    return sum((-1) ** j * B[0, j] * minor for j, minor in enumerate(minors))


def copositive(B):
    """x B x >= 0 for all x >= 0."""
    for n in range(1, len(B) + 1):
        for part in combinations(range(len(B)), n):
            A = B[np.ix_(part, part)]
            if determinant(A) < 0 and all(
                (-1) ** (i + j) * determinant(np.delete(np.delete(A, i, 0), j, 1)) >= 0
                for i in range(n) for j in range(i + 1)
            ):  # fmt: skip
                return False
    return True


def tree(W, q, mu, r0, statuses, patterns, **data):
    """Bound of |r - r0| for all solutions; the forms V0, V1, ... are those of the patterns."""
    need(q.shape[1] == 2, "patterns in 3D")
    letters = [bytes(x).decode() for x in statuses]
    words = [bytes(p).decode() for p in patterns]
    need(all(len(p) == len(mu) for p in words) and covered(words, mu), "patterns are missing")
    u, t, moved, off = reference(W, q, mu, r0, letters)
    z0 = np.hstack([exact(r0), exact(u)])
    for i in np.flatnonzero(moved[:, 1]):
        z0[i, 1] = -Fraction(mu[i]) * z0[i, 0] * int(t[i, 0])
    far = max(branch(W, q, mu, z0, off, p, data[f"V{k}"]) for k, p in enumerate(words))
    return far + float(moved.max(initial=0.0))


def branch(W, q, mu, z0, off, pattern, V):
    """Bound of |r - r0| for all solutions whose statuses the pattern allows."""
    apex, columns = V.shape[1] == 5, []
    for i, letter in enumerate(pattern):
        for status in set(ALLOWED[letter]) & set("fs+-" if mu[i] else "f+"):
            G = [v + [0] * apex for v in rays(status, Fraction(mu[i]))]
            G = np.array([*G, [0] * 4 + [1] if apex else list(-z0[i])], dtype=object)
            B = G.dot(-exact((V[i] + V[i].T) / 2)).dot(G.T)
            need(copositive(B), f"contact {i} can gain in status {status}")
        slope = Fraction(mu[i]) * (-1 if letter == "-" else 1)
        if letter in "+-" or mu[i] == 0:
            columns += [(i, 1, float(slope))] * (letter != "f")
            inside = z0[i, 1] == slope * z0[i, 0]
        else:
            columns += [(i, 1, 0), (i, 0, 1)] * (letter != "f")
            inside = letter != "f" or not any(z0[i, :2])
        need(apex or inside, f"r0 is not in {pattern}")  # d_r is not in the range of R
    R = np.zeros((2 * len(mu), len(columns)))
    for k, (i, normal, tangent) in enumerate(columns):
        R[2 * i : 2 * i + 2, k] = normal, tangent
    return bound(W, V, abs(V), R, None if apex else off, q if apex else None)
