"""What computed numbers prove about matrices: signs of determinants, definiteness.

[Higham] N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed. (2002).
[Rump] S. M. Rump, "Verification of positive definiteness", BIT 46 (2006), 433-452.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, lu, solve_triangular

Array = NDArray[np.float64]
EPSILON = float(np.finfo(float).eps)


def is_positive_definite(matrix: Array, rounding: Array | float = 0.0) -> bool:
    """True only when every symmetric A + d with |d| <= rounding is positive definite.

    A Cholesky factorisation that succeeds is exact for a matrix within (k + 1) eps tr A
    ([Rump]); so it is done for A - shift, the shift covering that and the norm of d.
    """
    k = len(matrix)
    if not k:
        return True
    if not np.isfinite(matrix).all():
        return False
    spread = np.broadcast_to(rounding, (k, k)).sum(axis=1).max()
    shift = (spread + 2 * (k + 3) * EPSILON * np.abs(np.diag(matrix)).sum()) * (1 + 1e-9)
    try:
        cholesky(matrix - shift * np.eye(k), lower=True, check_finite=False)
    except LinAlgError:
        return False
    return True


def gamma(operations: int) -> float:
    """Relative rounding error of so many operations on one number, itself rounded up."""
    half = EPSILON / 2
    return 1.01 * operations * half / (1 - operations * half)


def unit_scale(matrix: Array) -> Array:
    """Powers of two s with which s_i s_j A_ij has a diagonal near 1: exact, and unit-free.

    Ones where the diagonal is not positive.
    """
    diagonal = np.diag(matrix)
    able = np.isfinite(diagonal) & (diagonal > 0)
    return np.exp2(-np.round(np.log2(np.where(able, diagonal, 1.0)) / 2))


def congruence(G: Array, W: Array) -> tuple[Array, Array]:
    """(G^T W G, bound of the error of its entries) for stacks G (..., k, s), W (..., k, k).

    G may itself be off by three roundings per entry, as after a normalisation.
    """
    turned = np.swapaxes(G, -1, -2)
    size = np.abs(turned) @ np.abs(W) @ np.abs(G)
    return turned @ W @ G, gamma(2 * W.shape[-1] + 10) * size


def are_positive_definite(stack: Array, error: Array) -> bool:
    """`is_positive_definite` of every matrix of a stack (J, s, s), error of the same shape."""
    size = stack.shape[1]
    diagonal = np.diagonal(stack, axis1=1, axis2=2)
    if not (np.isfinite(stack).all() and np.isfinite(error).all() and (diagonal > 0).all()):
        return False
    scale = np.exp2(-np.round(np.log2(diagonal) / 2))
    scale = scale[:, :, None] * scale[:, None, :]
    spread = (error * scale).sum(axis=2).max(axis=1, initial=0.0)
    trace = (diagonal * np.diagonal(scale, axis1=1, axis2=2)).sum(axis=1)
    shift = (spread + 2 * (size + 3) * EPSILON * trace) * (1 + 1e-9)
    try:
        np.linalg.cholesky(stack * scale - shift[:, None, None] * np.eye(size))
    except LinAlgError:
        return False
    return True


def determinant_sign(matrix: Array, rounding: Array | float = 0.0) -> int:
    """Sign of det (A + d) for every |d| <= rounding, proved; 0 where it is not.

    With X = U^-1 L^-1 P as computed, |I - X (A + d)| < 1 means that sign det A = sign det X.
    """
    k = len(matrix)
    if not k:
        return 1
    order, lower, upper = lu(matrix, p_indices=True)  # type: ignore[misc]  # 2 with permute_l
    p = np.argsort(order)  # matrix[p] = lower upper
    if not (np.isfinite(upper).all() and (np.diag(upper) != 0).all()):
        return 0
    left = solve_triangular(lower, np.eye(k), lower=True, unit_diagonal=True)
    right = solve_triangular(upper, np.eye(k))
    size = np.abs(right) @ (np.abs(left) @ np.abs(matrix[p]))
    spread = np.abs(right) @ (np.abs(left) @ np.broadcast_to(rounding, (k, k))[p])
    off = np.abs(np.eye(k) - right @ (left @ matrix[p])) + 4 * k * EPSILON * size + spread
    if not off.sum(axis=1).max() * (1 + 1e-9) < 1:
        return 0
    odd = (k - _cycles(p)) % 2
    negative = np.count_nonzero(np.diag(right) < 0) + odd
    return -1 if negative % 2 else 1


def _cycles(p: NDArray[np.int64]) -> int:
    """Number of cycles of a permutation."""
    seen = np.zeros(len(p), dtype=bool)
    count = 0
    for start in range(len(p)):
        count += not seen[start]
        while not seen[start]:
            seen[start] = True
            start = p[start]
    return count
