"""Checks certificates of one load again, from W, q, mu and the multipliers alone.

Exact in rational numbers up to EXACT contacts; beyond, only the positive definiteness of the
one large matrix is left to floating point.  Numpy only, nothing of the package is used.

The claim: every solution z = (r_N, r_T, u_N, u_T), u = W r + q, is as near to r0 as `distance`
says.  Why: for e small, z - z0 + e lies in cone(C_s - z0) for one of the statuses s that a
branch allows; its multipliers make sum d^T W d <= 0 there, and >= tau |d|^2 by balance.
"""

from fractions import Fraction

import numpy as np

EXACT = 4
ALLOWED = {"f": "f", "s": "s", "+": "+", "-": "-", "x": "+-", "c": "s+-", ".": "fs+-"}
rational = np.vectorize(Fraction, otypes=[object])


def check_load(W, q, mu, r0, branches):
    """Bound of |r - r0| per unit of |r0| or |q| / |W|; AssertionError where a proof is none."""
    W, q, mu, r0 = (np.asarray(a, dtype=float) for a in (W, q, mu, r0))
    patterns = [pattern for pattern, _ in branches]
    assert covered(patterns, ["f+" if m == 0 else "fs+-" for m in mu]), "a pattern is left out"
    z0, off = on_the_law(W, q, mu, r0)
    return max(check_branch(W, q, mu, z0, off, *branch) for branch in branches)


def covered(patterns, statuses):
    """True when every choice of statuses is in one of the patterns."""
    if any(set(p) <= {"."} for p in patterns):
        return True
    if not patterns:
        return False
    # divide by the first contact that some pattern restricts
    i = next(k for k in range(len(statuses)) if any(p[k] != "." for p in patterns))
    return all(
        covered(
            [p[:i] + "." + p[i + 1 :] for p in patterns if letter in ALLOWED[p[i]]], statuses
        )
        for letter in statuses[i]
    )


def on_the_law(W, q, mu, r0):
    """(z0 (nc, 4) rational that obeys the law, by how much r0 and W r0 + q miss it)."""
    r, m = rational(r0), rational(mu)
    u = (rational(W) @ r.ravel() + rational(q).ravel()).reshape(r.shape)
    size = np.abs(q).max()
    z0 = np.column_stack([r, u])
    for i, (n, t, _, slide) in enumerate(z0):
        assert n >= 0
        if n == 0:
            assert t == 0
            z0[i, 2] = max(z0[i, 2], Fraction(0))
            z0[i, 2] = z0[i, 2] if z0[i, 2] > 1e-8 * size else Fraction(0)
            continue
        z0[i, 2] = Fraction(0)
        bound = m[i] * n
        if abs(slide) <= 1e-8 * size and m[i] > 0:
            z0[i, 3] = Fraction(0)
            z0[i, 1] = max(-bound, min(bound, t))
            if abs(t) >= bound * (1 - Fraction(1, 10**9)):
                z0[i, 1] = bound if t > 0 else -bound
        else:
            z0[i, 1] = -bound if slide > 0 else bound
    return z0, np.abs(np.asarray(np.column_stack([r, u]) - z0, dtype=float))


def check_branch(W, q, mu, z0, off, pattern, multipliers):
    """Bound of |r - r0| for the solutions of one branch."""
    apex = multipliers.shape[1] == 5
    for i, letter in enumerate(pattern):
        A = -rational(multipliers[i])
        for status in ALLOWED[letter]:
            if mu[i] == 0 and status in "s-":
                continue
            line, rays = generators(status, Fraction(mu[i]))
            if apex:
                line, rays = [[*v, 0] for v in line], [[*v, 0] for v in rays]
                rays.append([0, 0, 0, 0, 1])
            else:
                rays.append([-a for a in z0[i]])
            assert copositive(A, line, rays), (pattern, i, status)
    y = [(i, column) for i, letter in enumerate(pattern) for column in free(letter, mu[i])]
    R = np.zeros((2 * len(mu), len(y)))
    for k, (i, column) in enumerate(y):
        R[2 * i : 2 * i + 2, k] = column
    return bound_of_distance(W, q, off, multipliers, R, apex)


def generators(status, mu):
    """(lines, rays) of a cone in (r_N, r_T, u_N, u_T)."""
    if status == "f":
        return [[0, 0, 0, 1]], [[0, 0, 1, 0]]
    if mu == 0:
        return [[0, 0, 0, 1]], [[1, 0, 0, 0]]
    if status == "s":
        return [], [[1, mu, 0, 0], [1, -mu, 0, 0]]
    sign = 1 if status == "+" else -1
    return [], [[1, sign * mu, 0, 0], [0, 0, 0, -sign]]


def free(letter, mu):
    """Independent reactions of a contact."""
    if letter == "f":
        return []
    if letter in "+-" or mu == 0:
        return [(1, mu if letter != "-" else -mu)]
    return [(1, 0), (0, 1)]


def copositive(A, lines, rays):
    """True when x A x >= 0 for all sums of multiples of lines and nonnegative ones of rays."""
    G = np.array([*lines, *rays], dtype=object)
    B = G @ A @ G.T
    for _ in lines:
        if B[0, 0] < 0 or (B[0, 0] == 0 and any(B[0, 1:])):
            return False
        if B[0, 0] > 0:
            B = B[1:, 1:] - np.outer(B[1:, 0], B[0, 1:]) / B[0, 0]
        else:
            B = B[1:, 1:]
    return nonnegative_on_orthant(B)


def nonnegative_on_orthant(B):
    """Copositivity up to 3 x 3, K.-P. Hadeler, Linear Algebra Appl. 49 (1983)."""
    n = len(B)
    if n == 0:
        return True
    if n == 1:
        return B[0, 0] >= 0
    for k in range(n):
        keep = [i for i in range(n) if i != k]
        if not nonnegative_on_orthant(B[np.ix_(keep, keep)]):
            return False
    if n == 2:
        return B[0, 1] >= 0 or B[0, 1] ** 2 <= B[0, 0] * B[1, 1]
    # minors copositive: B is not, only if det B < 0 and adj B >= 0
    adjugate = [
        B[(i + 1) % 3, (j + 1) % 3] * B[(i + 2) % 3, (j + 2) % 3]
        - B[(i + 1) % 3, (j + 2) % 3] * B[(i + 2) % 3, (j + 1) % 3]
        for i in range(3)
        for j in range(3)
    ]
    determinant = sum(B[0, j] * adjugate[j] for j in range(3))
    return determinant >= 0 or min(adjugate) < 0


def bound_of_distance(W, q, off, multipliers, R, apex):
    """Largest |r - r0| that sum d^T W d <= small and M >= tau leave."""
    nc = len(multipliers)
    exact = nc <= EXACT
    number = rational if exact else np.asarray
    zero = number(np.zeros((nc, 1)))
    r, u = number(R), number(W) @ number(R)
    Z = np.concatenate([r.reshape(nc, 2, -1), u.reshape(nc, 2, -1)], axis=1)
    if apex:
        last = np.concatenate(
            [number(np.zeros((nc, 2))), number(q).reshape(nc, 2), zero + 1], 1
        )
        Z = np.concatenate([Z, np.zeros_like(Z[:, :1])], axis=1)
        Z = np.concatenate([Z, last[:, :, None]], axis=2)
    if Z.shape[2] == 0:
        return 0.0
    M = sum(z.T @ number(w) @ z for z, w in zip(Z, multipliers, strict=True))
    diagonal = np.diag(np.asarray(M, dtype=float))
    assert (diagonal > 0).all()
    scale = 2.0 ** -np.round(np.log2(diagonal) / 2)
    M = M * number(scale)[:, None] * number(scale)
    rough = np.asarray(M, dtype=float)
    least = np.linalg.eigvalsh((rough + rough.T) / 2)[0]
    tau = max(least, 0) / 2 if off.any() and not apex else 0.0
    if exact:
        assert definite(M - rational(tau * np.eye(len(M))))
    else:
        size = sum(abs(z).T @ abs(w) @ abs(z) for z, w in zip(Z, multipliers, strict=True))
        size = (size * scale[:, None] * scale).sum(axis=1).max()
        assert least > 1.2e-16 * (4 * nc + 16) * size
    if apex or not off.any():
        return 0.0
    size = np.abs(np.asarray(Z, dtype=float))
    push = np.einsum("pab,pb->pa", np.abs(multipliers), off)
    alpha = float((push * off).sum())
    beta = float(np.linalg.norm(scale * np.einsum("pan,pa->n", size, push)))
    reach = (beta + np.sqrt(beta**2 + tau * alpha)) / tau
    return reach * float((np.abs(R) @ scale).max())


def definite(A):
    """Elimination without rounding."""
    A = A.copy()
    for k in range(len(A)):
        if not A[k, k] > 0:
            return False
        A[k + 1 :, k + 1 :] -= np.outer(A[k + 1 :, k], A[k, k + 1 :]) / A[k, k]
    return True
