"""What multipliers prove about one load, rounding included.

About a known solution z0, with d = z - z0 for another solution z of a branch, d_u = W d_r:

    d_p^T W_p d_p <= 0 in cone(C_s - z0_p) for all contacts p and statuses s,
    M = sum_p Z_p^T W_p Z_p >= tau I   on all d_r                    =>  d = 0.

z0 obeys balance only up to `off`: d + e lies in the cones with |e_u| <= off, so

    tau |d|^2 <= sum_p (2 |d_p^T W_p e_p| + |e_p^T W_p e_p|) <= 2 beta |d| + alpha,

and every solution of the branch is within rho = (beta + sqrt(beta^2 + tau alpha)) / tau of z0.
Without a known solution the same with (z, 1), which leaves no solution at all.

Velocities that vanish in a branch, u_k = 0, add rho_k u_k^2 to W_p: nothing on the cones, but
M need not be positive beside them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ..multipliers.rounding import gamma, is_positive_definite, unit_scale
from ..scaled import Scaled
from ..statuses import States
from .branches import Index, reactions, zeros

Array = NDArray[np.float64]
PENALTIES = 10.0 ** np.arange(0, 9, 2)  # of velocities that vanish, times |W_p|
SHARE = 0.5  # of the smallest eigenvalue of M that is proved


@dataclass(frozen=True, eq=False)
class BranchProof:
    """Scaled multipliers (nc, k, k) of a branch; k = 2 d + 1 where no solution is left.

    distance: bound of |r - r0| in scaled reactions, for every solution of the branch.
    """

    branch: States
    multipliers: Array
    distance: float


def prove(
    scaled: Scaled, branch: States, multipliers: Array, off: Array | None, *,
    all_reactions: bool = False,
) -> BranchProof | None:  # fmt: skip
    """The proof, None where rounding could spoil it; slacks are not looked at.

    off (nc d,): of the known solution, None where there is none.  all_reactions: M is positive
    for reactions outside of the branch too, by penalties.
    """
    rows = zeros(scaled, branch, all_reactions=all_reactions)
    whole: Any = sparse.eye_array(len(scaled.W), format="csr")
    R = whole if all_reactions else reactions(scaled, branch)
    motion, size = _motions(scaled, R, apex=off is None)
    for penalty in PENALTIES if len(rows[0]) else (0.0,):
        W = _penalised(multipliers, rows, penalty)
        M = motion.sum(W)
        error = gamma(2 * scaled.shape[1] * len(W) + 24) * size.sum(np.abs(W))
        scale = unit_scale(M)
        M, error = (A * scale[:, None] * scale for A in (M, error))
        exact = off is None or not off.any()
        tau = 0.0 if exact else SHARE * smallest_eigenvalue(M)
        M[np.diag_indices(len(M))] -= tau
        if not is_positive_definite(M, error):
            continue
        if off is None or exact:
            return BranchProof(branch, W, 0.0)
        return BranchProof(branch, W, _distance(W, size, scale, tau, off))
    return None


@dataclass(frozen=True, eq=False)
class _Motion:
    """r = R y and u = U y for coordinates y, the last one 1 where there is an apex."""

    R: sparse.csr_array
    U: Array

    def sum(self, W: Array) -> Array:
        """sum_p Z_p^T W_p Z_p, z_p = Z_p y; only one product takes time."""
        rr, ru, uu = diagonal_parts(W)
        mixed = self.R.T @ (ru @ self.U)
        M = self.U.T @ (uu @ self.U) + mixed + mixed.T + (self.R.T @ rr @ self.R).toarray()
        if W.shape[1] % 2:
            d = W.shape[1] // 2
            last = self.R.T @ W[:, :d, -1].ravel() + self.U.T @ W[:, d:-1, -1].ravel()
            M[:, -1] += last
            M[-1] += last
            M[-1, -1] += W[:, -1, -1].sum()
        return (M + M.T) / 2


def diagonal_parts(W: Array) -> tuple[sparse.csr_array, ...]:
    """The parts r r, r u and u u of multipliers (nc, k, k), as (nc d, nc d) each."""
    nc, d = len(W), W.shape[1] // 2
    each, pointer = np.arange(nc), np.arange(nc + 1)
    return tuple(
        sparse.csr_array(sparse.bsr_array((np.ascontiguousarray(part), each, pointer),
                                          shape=(d * nc, d * nc)))
        for part in (W[:, :d, :d], W[:, :d, d : 2 * d], W[:, d : 2 * d, d : 2 * d])
    )  # fmt: skip


def _motions(scaled: Scaled, R: sparse.csr_array, *, apex: bool) -> tuple[_Motion, _Motion]:
    """Of the variables, and of the sizes of the terms that they are sums of."""
    load, out = scaled.q.ravel(), []
    r: Any
    for r, W, q in ((R, scaled.W, load), (abs(R), np.abs(scaled.W), np.abs(load))):
        U = np.asarray((r.T @ W.T).T)
        if apex:
            U = np.column_stack([U, q])
            r = sparse.hstack([r, sparse.csr_array((r.shape[0], 1))], format="csr")
        out.append(_Motion(r, U))
    return out[0], out[1]


def _penalised(multipliers: Array, rows: tuple[Index, Index], penalty: float) -> Array:
    """Multipliers with the squares of what vanishes added."""
    W, (contact, component) = multipliers.copy(), rows
    size = np.abs(W).max(axis=(1, 2), initial=0.0)[contact]
    size = np.maximum(size, 1e-3 * size.max(initial=1.0))
    W[contact, component, component] += penalty * size
    return W


def smallest_eigenvalue(M: Array) -> float:
    """An estimate, by inverse iteration; 0 where M is not positive definite, or overflows."""
    try:
        factor = linalg.cho_factor(M, check_finite=False)
    except linalg.LinAlgError:
        return 0.0
    x = np.cos(np.arange(len(M)) + 0.5)  # any vector that is not special
    length = 1.0
    for _ in range(20):
        x = linalg.cho_solve(factor, x / np.linalg.norm(x), check_finite=False)
        length = float(np.linalg.norm(x))
        if length == 0:
            return 0.0
    return 1 / length


def _distance(W: Array, size: _Motion, scale: Array, tau: float, off: Array) -> float:
    """Bound of the largest scaled reaction by which another solution can differ."""
    if tau <= 0:
        return np.inf
    d = W.shape[1] // 2
    e = np.zeros((len(W), 2 * d))
    e[:, d:] = off.reshape(-1, d)
    push = np.einsum("pab,pb->pa", np.abs(W), e)
    alpha = float(np.einsum("pa,pa->", push, e)) * (1 + 1e-9)
    along = size.R.T @ push[:, :d].ravel() + size.U.T @ push[:, d:].ravel()
    beta = float(np.linalg.norm(scale * along)) * (1 + 1e-9)
    reach = (beta + np.sqrt(beta**2 + tau * alpha)) / tau * (1 + 1e-9)
    return float(reach * np.max(size.R @ scale, initial=0.0))
