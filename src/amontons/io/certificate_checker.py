"""Checks a certificate of uniqueness with numpy and h5py alone; run it with c.h5.

What is claimed and why it follows is in docs/certificates.md; here is what is checked.
positive_definite [Rump, BIT 46 (2006)]: if Cholesky's factorisation of a symmetric A of
floating point numbers runs to its end, in any order of its sums, then R^T R = A + E with |E_ij|
<= g |R_i| |R_j|, g = (n + 1) U / (1 - (n + 1) U), U = 2^-53.  So |R_i|^2 <= A_ii / (1 - g),
|E|_2 <= g sum |R_i|^2 <= g / (1 - g) tr A, and no eigenvalue of A is below minus that.  A shift
is taken off before that is larger, also than what rounding did to A.
"""

import hashlib
import sys
from fractions import Fraction

import h5py
import numpy as np

U = 2.0**-53
ALLOWED = {"f": "f", "s": "s", "+": "+", "-": "-", "x": "+-", "c": "s+-", ".": "fs+-"}
exact = np.vectorize(Fraction, otypes=[object])


class Refused(Exception):
    """The certificate proves nothing."""


def need(holds, why):
    """Refuse where it does not hold."""
    if not holds:
        raise Refused(why)


def positive_definite(A, rounding):
    """True only if every symmetric matrix whose entries are within `rounding` of A is."""
    if not (np.isfinite(A).all() and np.isfinite(rounding).all() and (A.diagonal() > 0).all()):
        return False
    s = 2.0 ** -np.round(np.log2(A.diagonal()) / 2)  # exact
    A, rounding = (A + A.T) / 2 * s * s[:, None], (rounding + rounding.T) / 2 * s * s[:, None]
    shift = rounding.sum(axis=1).max() + 4 * (len(A) + 4) * U * (np.trace(A) + len(A))
    try:
        np.linalg.cholesky(A - 1.001 * shift * np.eye(len(A)))
    except np.linalg.LinAlgError:
        return False
    return True


def blocks(tau, sigma, right, below):
    """[[tau, right], [below, sigma I]] of every contact along the diagonal."""
    d = right.shape[1] + 1
    out = np.diag(np.column_stack([tau, *[sigma] * (d - 1)]).ravel())
    for i in range(len(tau)):
        out[i * d, i * d + 1 : (i + 1) * d] = right[i]
        out[i * d + 1 : (i + 1) * d, i * d] = below[i]
    return out


def every_load(W, mu, tau, sigma, alpha, f):
    """Refuse unless these multipliers prove one solution for every load."""
    nc, d = len(mu), len(W) // len(mu)
    need(min(tau.min(), sigma.min(), alpha.min()) > 0, "a multiplier is not positive")
    D, normal = blocks(tau, sigma, 0 * f, f), np.arange(nc * d) % d == 0
    weight = np.where(normal, 0, (mu * sigma / alpha / 2).repeat(d))[:, None]
    own = np.diag(np.where(normal, (mu * sigma * alpha / 2).repeat(d), 0))
    M = D @ W - W.T @ (weight * W) - own
    size = abs(D) @ abs(W) + abs(W).T @ (weight * abs(W)) + own
    need(positive_definite(M, 2 * (nc * d + 16) * U * size), "M is not positive definite")


def about(W, q, mu, r0, letters, tau, sigma, eta, pinned):
    """Bound of |r - r0| for all solutions, by one tau, sigma and eta of every contact."""
    (nc, d), wide, limit = r0.shape, np.longdouble, sigma * mu
    need(min(tau.min(), sigma.min()) > 0, "a multiplier is not positive")
    u = np.asarray(W.astype(wide) @ r0.astype(wide).ravel() + q.ravel(), float).reshape(nc, d)
    off = (abs(W) @ abs(r0).ravel() + abs(q).ravel()).reshape(nc, d)
    off = (nc * d + 4) * float(np.finfo(wide).eps) * off + 2 * U * abs(u)
    z0, moved, t = u.copy(), np.zeros((nc, d)), np.zeros((nc, d - 1))
    for i, status in enumerate(letters):
        bound, speed, shear = mu[i] * r0[i, 0], *np.linalg.norm([u[i, 1:], r0[i, 1:]], axis=1)
        t[i] = u[i, 1:] / (speed or 1)
        if status == "f":
            need(not r0[i].any(), f"contact {i} is not free")
            z0[i, 0] = max(u[i, 0], 0)
        elif status == "s":
            need(shear * (1 + 8 * U) <= bound, f"contact {i} does not stick")
            z0[i], t[i] = 0, -r0[i, 1:] / (bound or 1)
        else:
            need(status == "l" and r0[i, 0] > 0, f"contact {i} does not slip")
            z0[i, 0], moved[i, 1:] = 0, abs(r0[i, 1:] + bound * t[i]) + 16 * U * bound
        if not pinned[i]:
            size, room = np.linalg.norm(eta[i]), limit[i] * speed - eta[i].dot(u[i, 1:])
            need(status == "f" and size <= limit[i] * (1 - 8 * U), f"eta of contact {i}")
            room += 32 * U * (limit[i] + size) * speed
            need(room <= tau[i] * z0[i, 0] * (1 - 8 * U), f"contact {i} can gain")
    off += abs(u - z0) + 2 * (abs(W) @ moved.ravel()).reshape(nc, d)
    E = blocks(tau, sigma, np.where(pinned[:, None], limit[:, None] * t, eta), 0 * eta)
    left = (mu[:, None] > 0).repeat(d, 1).ravel() | (np.arange(nc * d) % d == 0)
    M, size, push = (x[left] for x in (E @ W, abs(E) @ abs(W), abs(E) @ off.ravel()))
    M, size = (M[:, left] + M[:, left].T) / 2, 2 * (nc * d + 40) * U * size[:, left]
    s = 2.0 ** -np.round(np.log2(np.where(M.diagonal() > 0, M.diagonal(), 1)) / 2)
    least = np.linalg.eigvalsh(M * s * s[:, None])[0] / 2 if off.any() else 0.0
    taken, size = np.diag(least / s**2), size + np.diag(4 * U * abs(least) / s**2)
    need(positive_definite(M - taken, size), "the matrix is not definite")
    need(least > 0 or not off.any(), "no distance")
    return float(np.linalg.norm(s * push) / least * s.max() * 1.001) if off.any() else 0.0


def covered(patterns, mu):
    """True when every choice of statuses is in one of the patterns."""
    if not patterns or any(set(p) <= {"."} for p in patterns):
        return bool(patterns)
    i = next(k for k in range(len(mu)) if any(p[k] != "." for p in patterns))
    return all(covered([p[:i] + "." + p[i + 1 :] for p in patterns if s in ALLOWED[p[i]]], mu)
               for s in ("f+" if mu[i] == 0 else "fs+-"))  # fmt: skip


def on_the_law(W, q, mu, r0):
    """(z0 (nc, 4), a rational point of the law near r0; |(r0, W r0 + q) - z0|, rounded up)."""
    r, m = exact(r0), exact(mu)
    known = np.column_stack([r, (exact(W).dot(r.ravel()) + exact(q).ravel()).reshape(r.shape)])
    z, small = known.copy(), Fraction(float(abs(q).max())) / 10**8
    for i, (normal, tangent, _, slide) in enumerate(known):
        need(normal >= 0 and (normal > 0 or tangent == 0), "r0 is outside of the cone")
        z[i, 2] = 0 if normal > 0 or z[i, 2] <= small else z[i, 2]
        if normal > 0 and abs(slide) <= small and m[i] > 0:
            edge = abs(tangent) >= m[i] * normal * (1 - Fraction(1, 10**9))
            z[i, 1] = (m[i] * normal if edge else abs(tangent)) * (1 if tangent > 0 else -1)
            z[i, 3] = 0
        elif normal > 0:
            z[i, 1] = m[i] * normal * (-1 if slide > 0 else 1)
    return z, np.nextafter(abs((known - z).astype(float)), np.inf) * (known != z)


def generators(status, mu):
    """(lines, rays) of a status in (r_N, r_T, u_N, u_T)."""
    if status == "f" or mu == 0:
        return [[0, 0, 0, 1]], [[0, 0, 1, 0] if status == "f" else [1, 0, 0, 0]]
    sign = 1 if status == "+" else -1
    stick = status == "s"
    return [], [[1, sign * mu, 0, 0], [1, mu, 0, 0] if stick else [0, 0, 0, -sign]]


def copositive(B, lines=0):
    """x B x >= 0 where the first `lines` entries of x have any sign, the others are >= 0."""
    for _ in range(lines):
        if B[0, 0] < 0 or (B[0, 0] == 0 and any(B[0, 1:])):
            return False
        B = B[1:, 1:] - (np.outer(B[1:, 0], B[0, 1:]) / B[0, 0] if B[0, 0] else 0)
    n = len(B)
    if n <= 1:
        return all(B.ravel() >= 0)
    minors = [np.delete(np.delete(B, i, 0), i, 1) for i in range(n)]
    if not all(copositive(part) for part in minors):
        return False
    if n == 2:
        return B[0, 1] >= 0 or B[0, 1] ** 2 <= B[0, 0] * B[1, 1]
    k = (np.arange(3)[:, None] + [[1, 2]]) % 3  # n = 3: K.-P. Hadeler (1983)
    adjugate = [B[a, c] * B[b, e] - B[a, e] * B[b, c] for a, b in k for c, e in k]
    return B[0].dot(adjugate[:3]) >= 0 or min(adjugate) < 0


def branch(W, q, mu, z0, off, pattern, V):
    """Bound of |r - r0| for all solutions whose statuses the pattern allows."""
    nc, apex, columns = len(mu), V.shape[1] == 5, []
    for i, letter in enumerate(pattern):
        for status in set(ALLOWED[letter]) & set("fs+-" if mu[i] else "f+"):
            lines, rays = generators(status, Fraction(mu[i]))
            G = [v + [0] * apex for v in lines + rays] + [[0] * 4 + [1] if apex else -z0[i]]
            G = np.array([list(v) for v in G], dtype=object)
            B = G.dot(-exact((V[i] + V[i].T) / 2)).dot(G.T)
            need(copositive(B, len(lines)), f"contact {i} can gain in status {status}")
        if letter in "+-" or mu[i] == 0:
            columns += [(i, 1, -mu[i] if letter == "-" else mu[i])] * (letter != "f")
        elif letter != "f":
            columns += [(i, 1, 0), (i, 0, 1)]
    R, load = np.zeros((2, 2 * nc, len(columns) + apex))
    for k, (i, normal, tangent) in enumerate(columns):
        R[2 * i : 2 * i + 2, k] = normal, tangent
    if not R.shape[1]:
        return 0.0
    if apex:
        load[:, -1] = q.ravel()
    last, n, out = np.broadcast_to(np.eye(R.shape[1])[-1:], (nc, 1, R.shape[1])), R.shape[1], []
    for r, w, given, v in ((R, W, load, V), (abs(R), abs(W), abs(load), abs(V))):
        Z = [r.reshape(nc, 2, n), (w @ r + given).reshape(nc, 2, n)] + [last] * apex
        Z = np.concatenate(Z, axis=1)
        out += [Z, Z.reshape(-1, n).T @ ((v + v.transpose(0, 2, 1)) / 2 @ Z).reshape(-1, n)]
    _, M, size, terms = out
    s = 2.0 ** -np.round(np.log2(np.where(M.diagonal() > 0, M.diagonal(), 1)) / 2)
    sharp = apex or not off.any()
    tau = 0.0 if sharp else np.linalg.eigvalsh((M + M.T) / 2 * s * s[:, None])[0] / 2
    rounding = 2 * (6 * nc + 40) * U * terms + np.diag(4 * U * abs(tau) / s**2)
    need(positive_definite(M - np.diag(tau / s**2), rounding), f"{pattern}: M is not definite")
    if sharp:
        return 0.0
    need(tau > 0, "no distance")
    push = np.einsum("pab,pb->pa", abs(V), off)
    a, b = (push * off).sum(), np.linalg.norm(s * np.einsum("pan,pa->n", size, push))
    return float((b + np.sqrt(b * b + tau * a)) / tau * 1.001 * (abs(R) @ s).max())


def digest(file):
    """SHA-256 of all that the claim depends on."""
    parts = [str(sorted((k, str(v)) for k, v in file.attrs.items() if k != "sha256"))]
    for name in sorted(file):
        data = np.asarray(file[name])
        parts += [name, str(data.dtype), str(data.shape), data.tobytes().hex()]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def check(path):
    """What a file claims, in a sentence; raises Refused where it does not prove that."""
    with h5py.File(path, "r") as file:
        need(file.attrs.get("sha256") == digest(file), "the file was changed: another SHA-256")
        claim, data = str(file.attrs["claim"]), {k: np.asarray(file[k]) for k in file}
    W, q, mu = data["W"], data["q"], data["mu"]
    nc, d = q.shape
    need(W.shape == (nc * d, nc * d) and mu.shape == (nc,) and d in (2, 3), "shapes differ")
    need(all(np.isfinite(x).all() for x in (W, q, mu)) and (mu >= 0).all(), "bad numbers")
    if claim == "every load":
        every_load(W, mu, *(data[k] for k in ("tau", "sigma", "alpha", "f")))
        return f"{nc} contacts: every load has exactly one solution."
    need(claim == "this load", f"unknown claim {claim!r}")
    if "tau" in data:
        letters = [bytes(x).decode() for x in data["statuses"]]
        given = [data[k] for k in ("tau", "sigma", "eta", "pinned")]
        far = about(W, q, mu, data["r0"], letters, *given)
        need(far <= data["distance"], f"solutions are only within {far:.1e} of r0")
        return f"{nc} contacts: every solution of this load is within {far:.1e} of r0."
    need(d == 2, "a tree in 3D")
    patterns = [bytes(p).decode() for p in data["patterns"]]
    need(all(len(p) == nc for p in patterns) and covered(patterns, mu), "patterns are missing")
    z0, off = on_the_law(W, q, mu, data["r0"])
    far = max(branch(W, q, mu, z0, off, p, data[f"V{k}"]) for k, p in enumerate(patterns))
    need(far <= data["distance"], f"solutions are only within {far:.1e} of r0")
    return f"{nc} contacts: every solution of this load is within {far:.1e} of r0."


if __name__ == "__main__":
    try:
        print(check(sys.argv[1]))
    except Exception as reason:  # whatever is wrong with a file, it proves nothing
        sys.exit(f"refused: {reason}")
