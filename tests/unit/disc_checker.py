"""Checks proofs about 3D problems with friction discs; nothing from the package.

A box of a proof: letters, arcs, a reference r or None, and a matrix V per contact.
"""

from fractions import Fraction

import numpy as np

STATUSES = {".": "fsl", "c": "sl", "f": "f", "s": "s", "l": "l"}


def positive_definite(M):
    """Symmetric M of Fractions by elimination, exactly."""
    M = [row[:] for row in M]
    for k in range(len(M)):
        if M[k][k] <= 0:
            return False
        for i in range(k + 1, len(M)):
            factor = M[i][k] / M[k][k]
            for j in range(k, len(M)):
                M[i][j] -= factor * M[k][j]
    return True


def balance_is_positive(W, q, box):
    """sum_p z_p V_p z_p > 0 for all z = (r, W r), or (r, W r + q, 1), exactly."""
    nc, size = box.V.shape[:2]
    N = 3 * nc + (size == 7)
    Z = np.zeros((nc, size, N), dtype=object)
    for p in range(nc):
        for i in range(3):
            Z[p, i, 3 * p + i] = Fraction(1)
            Z[p, 3 + i, : 3 * nc] = [Fraction(x) for x in W[3 * p + i]]
            if size == 7:
                Z[p, 3 + i, -1] = Fraction(q[p, i])
        if size == 7:
            Z[p, 6, -1] = Fraction(1)
    M = np.zeros((N, N), dtype=object) + Fraction(0)
    for p in range(nc):
        V = np.array([[Fraction(x) for x in row] for row in box.V[p]], dtype=object)
        M = M + Z[p].T.dot((V + V.T) / 2).dot(Z[p])
    return positive_definite(M.tolist())


def law_samples(random, mu, statuses, arc, count):
    """(count, 6) points (r, u) of the law of one contact in each status."""
    out = []
    size = random.exponential(1.0, (count, 1)) * random.choice([0, 1e-3, 1, 30], (count, 1))
    other = random.exponential(1.0, (count, 1)) * random.choice([0, 1e-3, 1, 30], (count, 1))
    turn = random.uniform(-np.pi, np.pi, count)
    along = np.column_stack([np.cos(turn), np.sin(turn)])
    zero = np.zeros((count, 3))
    if "f" in statuses:
        out.append(np.hstack([zero, size, other * along]))
    if "s" in statuses:
        radius = np.minimum(1.0, random.uniform(0, 1.3, (count, 1)))
        out.append(np.hstack([size, mu * radius * size * along, zero]))
    if "l" in statuses:
        angle = arc[0] + arc[1] * np.clip(random.uniform(-1.1, 1.1, count), -1, 1)
        e = np.column_stack([np.cos(angle), np.sin(angle)])
        out.append(np.hstack([size, -mu * size * e, 0 * size, other * e]))
    return np.concatenate(out)


def law_is_negative(W, q, mu, box, *, count=2000, seed=0):
    """d V d <= 0 at many differences between the law and the reference, of every contact."""
    random = np.random.default_rng(seed)
    nc = len(mu)
    for p in range(nc):
        V, statuses = box.V[p], STATUSES[box.letters[p]]
        c = law_samples(random, mu[p], statuses, box.arcs[p], count)
        a = random.exponential(1.0, len(c)) * random.choice([0, 1e-2, 1, 10], len(c))
        if box.r is None:
            d = np.column_stack([c, a])
        else:
            u = (W @ box.r.ravel()).reshape(nc, 3) + q
            z0 = np.concatenate([box.r[p], u[p]])
            c = np.concatenate([c, law_near(random, mu[p], statuses, box.arcs[p], z0)])
            a = np.concatenate([a, np.ones(len(c) - len(a))])
            d = c - a[:, None] * z0
        value = np.einsum("ji,ik,jk->j", d, V, d)
        size = np.einsum("ji,ik,jk->j", np.abs(d), np.abs(V), np.abs(d))
        if (value > 1e-9 * size + 1e-13 * np.abs(V).max()).any():
            return False
    return True


def law_near(random, mu, statuses, arc, z0, count=500):
    """Points of the law near a reference that slips, to be compared with it."""
    if "l" not in statuses or z0[0] <= 0 or abs(z0[3]) > 1e-9:
        return np.zeros((0, 6))
    base = np.arctan2(z0[5], z0[4])
    angle = base + random.standard_normal(count) * 10.0 ** random.uniform(-4, 0, count)
    apart = (angle - arc[0] + np.pi) % (2 * np.pi) - np.pi
    angle = angle[np.abs(apart) <= arc[1]]
    r = z0[0] * np.exp(random.standard_normal(len(angle)) * 0.1)[:, None]
    s = np.hypot(z0[4], z0[5]) * np.exp(random.standard_normal(len(angle)) * 0.1)[:, None]
    e = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.hstack([r, -mu * r * e, 0 * r, s * e])


def covers(proof, nc, *, count=3000, seed=0):
    """Random patterns, each with directions of slip, lie in a box or are a linear pattern."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        pattern = "".join(random.choice(list("fsl"), nc))
        angle = random.uniform(-np.pi, np.pi, nc)
        if pattern in proof.linear:
            continue
        if not any(_inside(box, pattern, angle) for box in proof.boxes):
            return False
    return True


def _inside(box, pattern, angle):
    for letter, own, (middle, half), t in zip(
        pattern, box.letters, box.arcs, angle, strict=True
    ):
        if letter not in STATUSES[own]:
            return False
        if own == "l" and abs((t - middle + np.pi) % (2 * np.pi) - np.pi) > half + 1e-12:
            return False
    return True


def linear_solution(W, q, mu, pattern):
    """r (nc, 3) of a pattern without slip, None where it breaks the law."""
    nc = len(mu)
    closed = np.repeat([letter == "s" for letter in pattern], 3)
    r = np.zeros(3 * nc)
    r[closed] = np.linalg.solve(W[np.ix_(closed, closed)], -q.ravel()[closed])
    u = (W @ r + q.ravel()).reshape(nc, 3)
    r = r.reshape(nc, 3)
    for letter, own_r, own_u, coefficient in zip(pattern, r, u, mu, strict=True):
        if letter == "f" and own_u[0] < 0:
            return None
        if letter == "s" and np.hypot(*own_r[1:]) > coefficient * own_r[0]:
            return None
    return r


def breaks_the_law(W, q, mu, r):
    """True for reactions outside of the cone or with penetration, clearly."""
    u = (W @ r.ravel()).reshape(r.shape) + q
    excess = np.hypot(r[:, 1], r[:, 2]) - mu * r[:, 0]
    return bool((excess > 1e-8).any() or (u[:, 0] < -1e-8).any())


def accepted(W, q, mu, proof, solutions):
    """True when the proof leaves no other solutions, (nc, 3) each, than those given."""

    def listed(r):
        return any(np.abs(r - s).max() <= 1e-6 * (1 + np.abs(r).max()) for s in solutions)

    if not covers(proof, len(mu)):
        return False
    for pattern in proof.linear:
        r = linear_solution(W, q, mu, pattern)
        if r is not None and not listed(r):
            return False
    return all(
        (box.r is None or listed(box.r) or breaks_the_law(W, q, mu, box.r))
        and balance_is_positive(W, q, box)
        and law_is_negative(W, q, mu, box)
        for box in proof.boxes
    )
