"""A friction below which every load has one solution, for the price of one eigenvalue problem.

Let d be the difference of two solutions of the same load, d_u = W d_r.  Normals obey
d_rN d_uN <= 0 and tangents d_rT d_uT <= mu |d_rN| |d_uT|, also with friction discs.  So

    d_r W d_r <= sum mu |d_rN| |d_uT| <= sum mu/2 (alpha d_rN^2 + d_uT^2 / alpha),

one alpha per contact, and d = 0 where W - mu/2 (N' alpha N + (TW)' (TW) / alpha) is positive
definite.  Tried are alpha in proportion to powers of |W_ii|.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ...core.clock import NEVER, Deadline
from .contact_proof import ContactMultipliers, holds

Array = NDArray[np.float64]
POWERS = (0.0, 0.5, 1.0)  # of |W_ii|, to which alpha is proportional
SYMMETRIC = 1e-12  # relative: what is estimated does not see less
EXACT = 400  # rows up to which norms come from all singular values
NEAR = 1e-7  # relative, of an estimate: what is proved is less by more
ESTIMATED = 1.0  # operations of the estimate per cube of the rows, without its norms
PROVED = 1.0  # the same of a proof


def energy_bound(
    W: Array, shape: Array, deadline: Deadline = NEVER
) -> tuple[float, Array]:
    """(t, alpha (k,)): at friction t shape every load has one solution; t = 0 is no bound.

    W (k d, k d), shape (k,).  Proved in spite of rounding, for W as given.  Contacts that can
    not react, with W_ii = 0, are left out; their alpha is 1.  Takes some len(W)^3 operations;
    raises TimeUp where the deadline is nearer than that.
    """
    k = len(shape)
    d = len(W) // max(k, 1)
    own = np.arange(k)
    size = np.linalg.norm(W.reshape(k, d, k, d)[own, :, own], axis=(1, 2))
    able = size > 0
    if not able.any():
        return np.inf, np.ones(k)
    rows = np.flatnonzero(np.repeat(able, d))
    W, shape, size = W[np.ix_(rows, rows)], shape[able], size[able]
    deadline.pay(ESTIMATED * len(W) ** 3)
    try:
        root = cholesky((W + W.T) / 2, lower=True)
    except LinAlgError:
        return 0.0, np.ones(k)
    normal, tangent = _directions(W, shape)
    forces = np.zeros((len(W), len(shape)), order="F")
    forces[normal, np.arange(len(shape))] = 1.0
    A = solve_triangular(root, forces, lower=True, overwrite_b=True)
    if np.abs(W - W.T).max() <= SYMMETRIC * np.abs(W).max():
        B = root[tangent]
    else:
        B = solve_triangular(root, W[tangent].T, lower=True).T
    best, chosen = 0.0, np.ones(len(size))
    for power in POWERS:
        t, alpha = _estimate(A, B, shape, (size / size.max()) ** power)
        if t > best:
            best, chosen = t, alpha
    whole = np.ones(k)
    whole[able] = chosen
    one = np.ones(len(size))
    by = ContactMultipliers(best, one, one, chosen, np.zeros((len(size), d - 1)))
    for room in (1e-9, 1e-6, 1e-3, 1e-1) if best > 0 else ():
        deadline.pay(PROVED * len(W) ** 3)
        if holds(W, shape, best * (1 - room), by):
            return best * (1 - room), whole
    return 0.0, whole


def _estimate(A: Array, B: Array, shape: Array, relative: Array) -> tuple[float, Array]:
    """(t, alpha) with alpha in the given proportions, not proved.

    A^T, B: r_N and u_T in the coordinates y = L^T r of the Cholesky factor L of W, where W = 1.
    """
    A = A * np.sqrt(shape * relative)
    B = B * np.repeat(np.sqrt(shape / relative), len(B) // len(shape))[:, None]
    size_a, size_b = _norm(A) ** 2, _norm(B) ** 2
    if not (size_a > 0 and size_b > 0):
        return 0.0, relative
    alpha = float(np.sqrt(size_b / size_a))
    largest = _norm(np.vstack([A.T * np.sqrt(alpha), B / np.sqrt(alpha)]))
    return 2 / largest**2, alpha * relative


def _norm(A: Array) -> float:
    """|A|_2, of a large matrix by Lanczos' method; where that fails an upper bound."""
    if min(A.shape) <= EXACT:
        return float(np.linalg.norm(A, 2))
    n = A.shape[1]
    square = LinearOperator((n, n), matvec=lambda x: A.T @ (A @ x), dtype=float)
    start = np.cos(np.arange(n) + 0.5)
    try:
        found = eigsh(
            square, 1, v0=start, return_eigenvectors=False,
            tol=NEAR,  # pyright: ignore[reportArgumentType]
        )
        return float(np.sqrt(found[0]))
    except ArpackNoConvergence:
        return float(np.linalg.norm(A))


def _directions(W: Array, shape: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of normals and of tangents."""
    d = len(W) // len(shape)
    normal = np.arange(len(shape)) * d
    return normal, np.setdiff1d(np.arange(len(W)), normal)
