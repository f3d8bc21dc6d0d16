"""A friction below which every load has one solution, for the price of one eigenvalue problem.

Let d be the difference of two solutions of the same load, d_u = W d_r.  Normals obey
d_rN d_uN <= 0 and tangents d_rT d_uT <= mu |d_rN| |d_uT|, also with friction discs.  So

    d_r W d_r <= sum mu |d_rN| |d_uT| <= sum mu/2 (alpha d_rN^2 + d_uT^2 / alpha),

and d = 0 where W - mu/2 (alpha N'N + (TW)'(TW) / alpha) is positive definite.  With
lambda_A = |N W^-1 N'|, lambda_B = |T W T'| that is so below 1 / sqrt(lambda_A lambda_B).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from .rounding import EPSILON, is_positive_definite

Array = NDArray[np.float64]


def energy_bound(W: Array, shape: Array) -> tuple[float, float]:
    """(t, alpha): at friction t shape every load has exactly one solution; t = 0 is no bound.

    W (k d, k d), shape (k,).  Proved in spite of rounding, for W as given.
    """
    k = len(shape)
    d = len(W) // max(k, 1)
    if not k:
        return np.inf, 1.0
    symmetric = (W + W.T) / 2
    normal = np.arange(k) * d
    tangent = np.setdiff1d(np.arange(k * d), normal)
    weight = np.sqrt(shape)
    try:
        root = cholesky(symmetric, lower=True)
    except LinAlgError:
        return 0.0, 1.0
    to_energy = solve_triangular(root, np.eye(k * d), lower=True)
    A = to_energy[:, normal] * weight  # |A y|^2 = sum shape r_N^2, W = 1 in these coordinates
    B = (W[tangent] @ to_energy.T) * np.repeat(weight, d - 1)[:, None]
    size_a, size_b = np.linalg.norm(A, 2) ** 2, np.linalg.norm(B, 2) ** 2
    if not (size_a > 0 and size_b > 0):
        return 0.0, 1.0
    alpha = float(np.sqrt(size_b / size_a))
    largest = float(np.linalg.norm(np.vstack([A.T * np.sqrt(alpha), B / np.sqrt(alpha)]), 2))
    for room in (1e-9, 1e-6, 1e-3, 1e-1):
        t = 2 / largest**2 * (1 - room)
        if _holds(W, shape, t, alpha):
            return t, alpha
    return 0.0, alpha


def _holds(W: Array, shape: Array, t: float, alpha: float) -> bool:
    """True when the matrix of the module docstring is positive definite, proved."""
    k = len(shape)
    d = len(W) // k
    normal = np.arange(k) * d
    tangent = np.setdiff1d(np.arange(k * d), normal)
    half = 0.5 * t * shape
    rows = W[tangent]
    weight = np.repeat(half, d - 1)[:, None] / alpha
    M = (W + W.T) / 2 - rows.T @ (weight * rows)
    M[normal, normal] -= half * alpha
    size = np.abs(W + W.T) / 2 + np.abs(rows.T) @ (weight * np.abs(rows))
    size[normal, normal] += half * alpha
    return is_positive_definite((M + M.T) / 2, (k * d + 8) * EPSILON * size)
