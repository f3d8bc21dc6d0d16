"""The linear system of an interior-point step: tr A_i X A_j S^-1, formed and factorised.

Its entry for two entries of W comes from Z X Z^T and Z S^-1 Z^T at O(1), or all of them from
all A_i where sets share few unknowns.  Extras are eliminated in their own set.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.compiled import njit
from .program import Blocks, Program

Array = NDArray[np.float64]


class Normal:
    """The matrix tr A_i X A_j S^-1, factorised: calling it solves."""

    def __init__(self, program: Program, X: Blocks, inverse: Blocks) -> None:
        p = self.program = program
        H = np.zeros((p.entries + 1, p.entries + 1))
        spread = p.spread
        if p.few is not None:
            flat = p.few.reshape(p.entries, -1)
            H[:-1, :-1] = (X[0][0] @ p.few @ inverse[0][0]).reshape(p.entries, -1) @ flat.T
        else:
            P, Q = (p.Z @ B[0][0] @ p.Z.T for B in (X, inverse))
            _normal_inplace(
                H, P, Q, p.a, p.b, p.factor, spread.indptr, spread.indices, spread.data
            )
        product = p.Z @ (X[0][0] @ inverse[0][0])
        cross = np.empty(len(p.a))
        for i in range(0, len(p.a), 1024):
            a, b = p.a[i : i + 1024], p.b[i : i + 1024]
            cross[i : i + 1024] = np.einsum("ij,ij->i", product[a], p.Z[b])
            cross[i : i + 1024] += np.einsum("ij,ij->i", product[b], p.Z[a])
        H[-1, :-1] = -(spread.T @ (p.factor * cross))
        H[-1, -1] = float(np.einsum("ij,ji->", X[0][0], inverse[0][0]))
        self._eliminate_inplace(H, self._curvature(X, inverse))

    def _curvature(self, X: Blocks, inverse: Blocks) -> list[Array]:
        """Matrix (sets, m + extras, m + extras) that the slacks make, for every family."""
        out = [
            np.zeros((len(f.rows), f.entries + f.extras, f.entries + f.extras))
            for f in self.program.families
        ]
        for (k, s), own, other in zip(self.program.slacks(), X[1:], inverse[1:], strict=True):
            left, right = np.linalg.cholesky(own), np.linalg.cholesky(other)
            turned = np.swapaxes(left, 1, 2)[:, None] @ s.tensor @ right[:, None]
            flat = turned.reshape(*turned.shape[:2], -1)
            np.add.at(out[k], s.owner, flat @ np.swapaxes(flat, 1, 2))
        return out

    def _eliminate_inplace(self, H: Array, curvature: list[Array]) -> None:
        """Extras out, slacks in, then factorise."""
        p = self.program
        self.inner, self.to_extras, blocks = [], [], []
        for f, C in zip(p.families, curvature, strict=True):
            k = f.entries
            inner = np.linalg.inv(C[:, k:, k:])
            self.inner.append(inner)
            self.to_extras.append(inner @ C[:, k:, :k])
            B = C[:, :k, :k] - C[:, :k, k:] @ self.to_extras[-1]
            blocks.append(sparse.bsr_array((B, np.arange(len(B)), np.arange(len(B) + 1))))
        whole = p.spread.T @ sparse.block_diag(blocks, format="csr") @ p.spread
        whole = sparse.coo_array(whole)
        H[whole.row, whole.col] += whole.data
        self.scale = 1 / np.sqrt(np.maximum(np.diagonal(H), np.finfo(float).tiny))
        with np.errstate(over="ignore", invalid="ignore"):
            H *= self.scale[:, None]
            H *= self.scale
        if not np.isfinite(H).all():
            raise np.linalg.LinAlgError("the matrix of the interior-point step is not finite")
        self.factor = _factorised(H)

    def __call__(self, right: Array) -> Array:
        """Solve for the columns of `right` (unknowns, k)."""
        p = self.program
        small = np.array(right[np.r_[0 : p.entries, p.unknowns - 1]])
        own = [
            right[extra].reshape(len(f.rows), f.extras, right.shape[1])
            for f, extra in zip(p.families, p.extra_parts, strict=True)
        ]
        change = [
            (np.swapaxes(to, 1, 2) @ r).reshape(-1, right.shape[1])
            for to, r in zip(self.to_extras, own, strict=True)
        ]
        small[:-1] -= p.spread.T @ np.concatenate(change)
        small = self.scale[:, None] * linalg.cho_solve(
            (self.factor, False), self.scale[:, None] * small, check_finite=False
        )
        out = np.empty_like(right)
        out[: p.entries], out[-1] = small[:-1], small[-1]
        entries = p.spread @ small[:-1]
        for f, part, extra, inner, to, r in zip(
            p.families, p.parts, p.extra_parts, self.inner, self.to_extras, own, strict=True
        ):
            known = entries[part].reshape(len(f.rows), f.entries, right.shape[1])
            out[extra] = (inner @ r - to @ known).reshape(-1, right.shape[1])
        return out


def _factorised(H: Array) -> Array:
    """Upper Cholesky factor from the lower triangle of H, with a ridge where rounding asks."""
    for ridge in (0.0, 1e-14, 1e-12, 1e-10, 1e-8):
        matrix = np.array(H.T, order="F")
        matrix[np.diag_indices(len(H))] += ridge
        try:
            return linalg.cholesky(matrix, lower=False, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            continue
    raise np.linalg.LinAlgError("the matrix of the interior-point step is not definite")


@njit(cache=True)
def _normal_inplace(H, P, Q, a, b, factor, indptr, indices, weights):  # noqa: PLR0913
    """Add tr(B_i P B_j Q) for all entries i, j of W, lower triangle of their unknowns."""
    for i in range(len(a)):
        for j in range(i + 1):
            h = P[b[i], a[j]] * Q[a[i], b[j]] + P[b[i], b[j]] * Q[a[i], a[j]]
            h += P[a[i], a[j]] * Q[b[i], b[j]] + P[a[i], b[j]] * Q[b[i], a[j]]
            h *= factor[i] * factor[j]
            for p in range(indptr[i], indptr[i + 1]):
                for q in range(indptr[j], indptr[j + 1]):
                    row, column = indices[p], indices[q]
                    value = weights[p] * weights[q] * h
                    if i != j and row == column:
                        value *= 2.0
                    if i != j and row < column:
                        row, column = column, row
                    if row >= column:
                        H[row, column] += value
