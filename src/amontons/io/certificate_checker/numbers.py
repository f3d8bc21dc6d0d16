"""Matrices that are positive definite in spite of rounding, and solutions that are near.

[Rump, BIT 46 (2006)]: if Cholesky's factorisation of a symmetric A of floating point numbers
runs to its end, in any order of its sums, then R^T R = A + E with |E_ij| <= g |R_i| |R_j|, g =
(n + 1) U / (1 - (n + 1) U), U = 2^-53.  So |R_i|^2 <= A_ii / (1 - g), |E|_2 <= g sum |R_i|^2 <=
g / (1 - g) tr A, and no eigenvalue of A is below minus that.  A shift is taken off before that
is larger, also than what rounding did to A.
"""

from fractions import Fraction
from math import hypot
from typing import Any

import numpy as np

U = 2.0**-53
TINY = 1e-290  # above what products lose that are too small for floating point numbers
exact = np.vectorize(Fraction, otypes=[object])


class Refused(Exception):
    """The certificate proves nothing."""


def need(holds, why):
    """Refuse where it does not hold."""
    if not holds:
        raise Refused(why)


def upward(x):
    """Two digits that are not below x >= 0."""
    return f"{1.0501 * float(x):.1e}"


def unit_scale(A):
    """Powers of two that bring the diagonal near one."""
    return 2.0 ** -np.round(np.log2(np.where(A.diagonal() > 0, A.diagonal(), 1)) / 2)


def positive_definite(A, rounding):
    """True only if every symmetric matrix whose entries are within `rounding` of A is."""
    if not (np.isfinite(A).all() and np.isfinite(rounding).all() and (A.diagonal() > 0).all()):
        return False
    s = unit_scale(A)
    A, rounding = (A + A.T) / 2 * s * s[:, None], (rounding + rounding.T) / 2 * s * s[:, None]
    shift = rounding.sum(axis=1).max() + 4 * (len(A) + 4) * U * (np.trace(A) + len(A))
    try:
        np.linalg.cholesky(A - 1.001 * shift * np.eye(len(A)))
    except np.linalg.LinAlgError:
        return False
    return True


def reference(W, q, mu, r0, letters):
    """A point of the law next to (r0, W r0 + q): (u, t, moved, off), (nc, d) or (nc, d - 1).

    letters: f r = 0, g r = 0 and u_N = 0, s u = 0; slip, r_T = -mu r_N t: l t = u_T / |u_T|, in
    2D + t = -1, - t = 1.  r0 is within moved of that point, W r + q there within off of u.
    """
    (nc, d), wide = r0.shape, np.longdouble
    given = np.asarray(W.astype(wide) @ r0.astype(wide).ravel() + q.ravel(), float)
    off = (abs(W) @ abs(r0).ravel() + abs(q).ravel()).reshape(nc, d)
    given, u = given.reshape(nc, d), given.reshape(nc, d).copy()
    moved, t = np.zeros((nc, d)), np.zeros((nc, d - 1))
    for i, letter in enumerate(letters):
        bound, speed, shear = mu[i] * r0[i, 0], hypot(*u[i, 1:]), hypot(*r0[i, 1:])
        t[i] = u[i, 1:] / (speed or 1)
        if letter in "fg":
            need(not r0[i].any(), f"contact {i} is not free")
            u[i, 0] = max(u[i, 0], 0) if letter == "f" else 0
        elif letter == "s":
            need(r0[i, 0] >= 0 and shear * (1 + 8 * U) <= bound, f"contact {i} does not stick")
            u[i], t[i] = 0, -r0[i, 1:] / (bound or 1)
        else:
            known = letter in ("l+-" if d == 2 else "l")
            need(known and r0[i, 0] > 0, f"contact {i} does not slip")
            t[i] = t[i] if letter == "l" else {"+": -1, "-": 1}[letter]
            u[i, 1:] = u[i, 1:] if letter == "l" else t[i] * max(t[i] * u[i, 1:], 0)
            u[i, 0], moved[i, 1:] = 0, abs(r0[i, 1:] + bound * t[i]) + 16 * U * bound
    off = (nc * d + 4) * float(np.finfo(wide).eps) * off + 2 * U * abs(given)
    off = r0.any() * off + abs(given - u)  # where nothing reacts, u is q
    return u, t, moved, off + 2 * (abs(W) @ moved.ravel()).reshape(nc, d)


def bound(W, V, size, R, off=None, q=None):
    """Bound of |R y| where sum z V z over contacts is not positive, z = (R y, W R y + e).

    V (nc, 2 d, 2 d), known to 30 U size; |e| <= off (nc, d).  With q (nc, d) V has a row more,
    z = (r, W r + q, 1), and refused is what does not exclude all y.
    """
    nc, d, parts = len(V), V.shape[1] // 2, []
    if not R.shape[1] and q is None:
        return 0.0
    terms: Any = abs(R), abs(W), size, q if q is None else abs(q)
    given: Any = R, W, V, q
    for r, w, v, load in (given, terms):
        Z = np.concatenate([x.reshape(nc, d, R.shape[1]) for x in (r, w @ r)], axis=1)
        if q is not None:
            one = np.concatenate([0 * load, load, np.ones((nc, 1))], axis=1)
            Z = np.concatenate([np.pad(Z, ((0, 0), (0, 1), (0, 0))), one[:, :, None]], axis=2)
        turned = (v + v.transpose(0, 2, 1)) / 2 @ Z
        parts += [Z.reshape(-1, Z.shape[2]).T @ turned.reshape(-1, Z.shape[2]), Z]
    M, _, rounding, terms = parts
    need(M.diagonal().min() > 1e-200, "a matrix is not definite, or too small")
    rounding, s = 2 * (3 * len(W) + 60) * U * rounding, unit_scale(M)
    off = np.zeros((nc, d)) if off is None else off
    sharp = not off.any()
    least = 0.0 if sharp else np.linalg.eigvalsh((M + M.T) / 2 * s * s[:, None])[0] / 2
    rounding += np.diag(4 * U * abs(least) / s**2)
    need(positive_definite(M - np.diag(least / s**2), rounding), "a matrix is not definite")
    if sharp:
        return 0.0
    need(least > 0, "no distance")
    both, e = (size + size.transpose(0, 2, 1)) / 2, np.hstack([0 * off, off])
    push = np.einsum("pab,pb->pa", both, e)
    a, b = (push * e).sum(), np.linalg.norm(s * np.einsum("pan,pa->n", terms, push))
    return float((b + np.sqrt(b * b + least * a)) / least * 1.001 * (abs(R) @ s).max())
