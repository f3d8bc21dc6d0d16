"""Primal-dual interior-point steps for the matrix inequality of `multiplier_lmi`.

With x = (unknowns of W, extras, t), S(x) = diag(M - t I, S_1, S_2, ...) = sum_i x_i A_i and
n_i = trace A_i it is the pair of semidefinite programs

    max t,          S(x) >= 0,  n x = theta,
    min lam theta,  X >= 0,     tr A_i X = lam n_i - [i is t],

theta the number of rows of S; lam theta - t = tr X S >= 0, so lam theta bounds t from above.
The direction is that of [HRVW] and [KSH], with Mehrotra's corrector; its matrix tr A_i X A_j
S^-1 has an entry for two entries of W from Z X Z^T and Z S^-1 Z^T at O(1), or comes from all
A_i where sets share few unknowns.  Extras of a set enter only the slacks of that set and are
eliminated there.

[HRVW] C. Helmberg, F. Rendl, R. Vanderbei, H. Wolkowicz, SIAM J. Optim. 6 (1996).
[KSH] M. Kojima, S. Shindoh, S. Hara, SIAM J. Optim. 7 (1997).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import linalg, sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Blocks = list[Array]  # first the (1, N, N) of M, then the (J, s, s) of all slacks in order
FEW = 2e7  # entries of all derivatives of M that are kept where unknowns are few
ROOM = 0.95  # part of the way to the boundary that a step takes at most


@dataclass(frozen=True, eq=False)
class Slacks:
    """Small matrices S_j = sum_i x_i tensor[j, i] of the sets owner[j]."""

    owner: Index  # (J,)
    tensor: Array  # (J, m + extras, s, s)

    def at(self, sets: Array) -> Array:
        """S (J, s, s) for the unknowns (sets, m + extras) of every set."""
        J, m, s, _ = self.tensor.shape
        flat = self.tensor.reshape(J, m, s * s)
        return (sets[self.owner][:, None] @ flat).reshape(J, s, s)


@dataclass(frozen=True, eq=False)
class Family:
    """Sets of equal size, see `multiplier_lmi`."""

    rows: Index  # (sets, k): rows of Z
    slacks: tuple[Slacks, ...]
    feasible: Array  # (sets, extras) or (extras,), empty where there are none
    share: sparse.csr_array | None = None  # (sets, K)

    @property
    def size(self) -> int:
        """Rows of W_c."""
        return self.rows.shape[1]

    @property
    def entries(self) -> int:
        """m: different entries of W_c."""
        return self.size * (self.size + 1) // 2

    @property
    def extras(self) -> int:
        """Further unknowns of a set."""
        return np.shape(self.feasible)[-1]


@dataclass(frozen=True, eq=False)
class Point:
    """x with S(x), X and lam; both matrices positive definite."""

    x: Array
    S: Blocks
    X: Blocks
    lam: float

    @property
    def t(self) -> float:
        """The last unknown."""
        return float(self.x[-1])


class Program:
    """The pair of semidefinite programs of some families."""

    def __init__(self, Z: Array, families: tuple[Family, ...]) -> None:
        self.Z, self.families, self.N = Z, families, Z.shape[1]
        a, b, spread = [], [], []
        for f in families:
            low, high = np.triu_indices(f.size)
            a.append(f.rows[:, low].ravel())
            b.append(f.rows[:, high].ravel())
            share = sparse.eye_array(len(f.rows)) if f.share is None else f.share
            spread.append(sparse.kron(share, sparse.eye_array(f.entries)))
        self.a, self.b = np.concatenate(a), np.concatenate(b)
        self.factor = np.where(self.a == self.b, 0.5, 1.0)  # B = factor (e_a e_b' + e_b e_a')
        self.spread = sparse.csr_array(sparse.block_diag(spread, format="csr"))
        self.parts = _slices([len(part) for part in a])  # of the entries of all sets
        self.entries = self.spread.shape[1]  # unknowns in W
        self.extra_parts = _slices([len(f.rows) * f.extras for f in families], self.entries)
        self.unknowns = self.extra_parts[-1].stop + 1
        self.identity = [np.eye(self.N)[None]] + [
            np.broadcast_to(np.eye(s.tensor.shape[2]), s.tensor[:, 0].shape)
            for _, s in self._slacks()
        ]
        self.theta = float(sum(len(B) * B.shape[1] for B in self.identity))
        self.traces = self.adjoint(self.identity)
        self.few = self._few()

    def _few(self) -> Array | None:
        """dM / dx of every unknown of W, where that is less work than all entries of all W."""
        N, k = self.N, self.entries
        pairs = 4.0 * len(self.Z) ** 2 * N + 15.0 * len(self.a) ** 2
        if 4.0 * k * N**3 + 2.0 * (k * N) ** 2 > pairs or k * N**2 > FEW:
            return None
        columns = sparse.csc_array(self.spread)
        out = np.empty((k, N, N))
        for j in range(k):
            part = slice(columns.indptr[j], columns.indptr[j + 1])
            i = columns.indices[part]
            weights = columns.data[part] * self.factor[i]
            half = (self.Z[self.a[i]].T * weights) @ self.Z[self.b[i]]
            out[j] = half + half.T
        return out

    def _slacks(self) -> Iterator[tuple[int, Slacks]]:
        """(number of the family, slacks) in the order of blocks."""
        for k, f in enumerate(self.families):
            for s in f.slacks:
                yield k, s

    # ------------------------------------------------------------------ the linear map
    def sets(self, x: Array) -> list[Array]:
        """(sets, m + extras) of every family."""
        entries = self.spread @ x[: self.entries]
        out = []
        for f, part, extra in zip(self.families, self.parts, self.extra_parts, strict=True):
            n = len(f.rows)
            out.append(np.hstack([entries[part].reshape(n, -1), x[extra].reshape(n, f.extras)]))
        return out

    def blocks(self, x: Array) -> Blocks:
        """S(x)."""
        sets = self.sets(x)
        M = self.matrix(x)
        M[np.diag_indices(self.N)] -= x[-1]
        return [M[None]] + [s.at(sets[k]) for k, s in self._slacks()]

    def matrix(self, x: Array) -> Array:
        """M = sum_c Z_c^T W_c Z_c, (N, N)."""
        shape = (len(self.Z), len(self.Z))
        entries = self.factor * (self.spread @ x[: self.entries])
        half = self.Z.T @ (sparse.csr_array((entries, (self.a, self.b)), shape=shape) @ self.Z)
        return half + half.T

    def adjoint(self, R: Blocks) -> Array:
        """tr A_i R for all i, R symmetric or not."""
        local = [np.zeros((len(f.rows), f.entries + f.extras)) for f in self.families]
        for (k, s), block in zip(self._slacks(), R[1:], strict=True):
            flat = s.tensor.reshape(*s.tensor.shape[:2], -1)
            np.add.at(local[k], s.owner, (flat @ block.reshape(len(block), -1, 1))[:, :, 0])
        ZR = self.Z @ (R[0][0] + R[0][0].T)
        for f, own in zip(self.families, local, strict=True):
            for i, (low, high) in enumerate(zip(*np.triu_indices(f.size), strict=True)):
                both = np.einsum("cn,cn->c", ZR[f.rows[:, low]], self.Z[f.rows[:, high]])
                own[:, i] += (0.5 if low == high else 1.0) * both
        return np.append(self._gathered(local), -np.trace(R[0][0]))

    def _gathered(self, local: list[Array]) -> Array:
        """Derivatives by the unknowns of every set -> by x without t."""
        pairs = list(zip(self.families, local, strict=True))
        entries = np.concatenate([own[:, : f.entries].ravel() for f, own in pairs])
        return np.concatenate(
            [self.spread.T @ entries, *(own[:, f.entries :].ravel() for f, own in pairs)]
        )

    # ------------------------------------------------------------------ the beginning
    def start(self) -> Point:
        """W = -I with extras so small that all slacks are positive definite, X = lam I + D."""
        identity = [-np.tile(_identity(f.size), _unknown_sets(f)) for f in self.families]
        x = np.concatenate([*identity, np.zeros(self.unknowns - self.entries)])
        for f, own, part in zip(self.families, self.sets(x), self.extra_parts, strict=True):
            x[part] = _small_extras(f, own).ravel()
        least = np.linalg.eigvalsh(self.matrix(x))[0]
        x[-1] = least - 0.5 * abs(least)
        x *= self.theta / (self.traces @ x)
        objective = np.zeros((self.unknowns, 1))
        objective[-1] = -1.0
        solve = Normal(self, self.identity, self.identity)
        D = self.blocks(solve(objective)[:, 0])  # tr A_i D = -[i is t]
        lam = 2 * max(-float(np.linalg.eigvalsh(B).min(initial=0.0)) for B in D)
        X = [lam * one + B for one, B in zip(self.identity, D, strict=True)]
        return Point(x, self.blocks(x), X, lam)


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
        for (k, s), own, other in zip(self.program._slacks(), X[1:], inverse[1:], strict=True):
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
        H *= self.scale[:, None]
        H *= self.scale
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


# --------------------------------------------------------------------------- one step
def advance(program: Program, point: Point) -> tuple[Point, float] | None:
    """(next point, shorter one of its two step lengths), None where rounding forbids."""
    inverse = [_inverse(B) for B in point.S]
    try:
        normal = Normal(program, point.X, inverse)
    except np.linalg.LinAlgError:
        return None
    objective = np.zeros(program.unknowns)
    objective[-1] = 1.0
    gradient = program.adjoint(inverse)
    steps = normal(np.stack([objective, gradient, program.traces], axis=1))
    mu = _inner(point.X, point.S) / program.theta
    path = _Path(program, point, inverse, steps)
    dx, dS, dX, _ = path(steps[:, 0], 0.0)
    primal, dual = _length(point.X, dX), _length(point.S, dS)
    after = [(X + primal * d, S + dual * e)
             for X, d, S, e in zip(point.X, dX, point.S, dS, strict=True)]  # fmt: skip
    left = sum(float(np.einsum("jab,jab->", X, S)) for X, S in after) / program.theta / mu
    sigma = min(1.0, max(left, 0.0) ** 2 if min(primal, dual) > 0.1 else 0.5)
    second = [d @ e @ i for d, e, i in zip(dX, dS, inverse, strict=True)]
    corrected = normal((objective - program.adjoint(second))[:, None])[:, 0]
    dx, dS, dX, lam = path(corrected, sigma * mu, second)
    primal, dual = ROOM * _length(point.X, dX), ROOM * _length(point.S, dS)
    primal, dual = min(primal, 1.0), min(dual, 1.0)
    X = [B + primal * d for B, d in zip(point.X, dX, strict=True)]
    x = point.x + dual * dx
    x *= program.theta / (program.traces @ x)
    new = Point(x, program.blocks(x), X, point.lam + primal * (lam - point.lam))
    if not all(_definite(B) for B in new.S) or not all(_definite(B) for B in new.X):
        return None
    return new, min(primal, dual)


class _Path:
    """Steps towards X S = sigma mu I, minus a second-order term, that keep the traces."""

    def __init__(self, program: Program, point: Point, inverse: Blocks, steps: Array) -> None:
        self.program, self.point, self.inverse, self.steps = program, point, inverse, steps

    def __call__(
        self, first: Array, target: float, second: Blocks | None = None
    ) -> tuple[Array, Blocks, Blocks, float]:
        """(dx, dS, dX, new lam) with `first` the solution for the objective and `second`."""
        traces = self.program.traces
        dx = first + target * self.steps[:, 1]
        lam = float((traces @ dx) / (traces @ self.steps[:, 2]))
        dx = dx - lam * self.steps[:, 2]
        dS, dX = self.program.blocks(dx), []
        for k, (X, inverse) in enumerate(zip(self.point.X, self.inverse, strict=True)):
            rest = X @ dS[k] @ inverse + (second[k] if second else 0.0)
            dX.append(target * inverse - X - (rest + np.swapaxes(rest, 1, 2)) / 2)
        return dx, dS, dX, lam


# --------------------------------------------------------------------------- helpers
def _slices(counts: list[int], first: int = 0) -> list[slice]:
    ends = np.cumsum([first, *counts])
    return [slice(int(i), int(j)) for i, j in zip(ends[:-1], ends[1:], strict=True)]


def _identity(k: int) -> Array:
    low, high = np.triu_indices(k)
    return np.where(low == high, 1.0, 0.0)


def _unknown_sets(family: Family) -> int:
    return len(family.rows) if family.share is None else family.share.shape[1]


def _small_extras(family: Family, sets: Array) -> Array:
    """(sets, extras): `feasible` times a power of 1/4 with which all slacks are positive."""
    size = np.ones((len(sets), 1))
    for _ in range(40):
        sets[:, family.entries :] = size * family.feasible
        bad = np.zeros(len(sets), dtype=bool)
        for slacks in family.slacks:
            bad[slacks.owner[np.linalg.eigvalsh(slacks.at(sets))[:, 0] <= 0]] = True
        if not bad.any():
            return sets[:, family.entries :] * 0.5
        size[bad] /= 4
    raise ValueError("feasible: with W = -I and small extras not all slacks are positive")


def _inverse(B: Array) -> Array:
    root = np.linalg.inv(np.linalg.cholesky(B))
    return np.swapaxes(root, 1, 2) @ root


def _inner(X: Blocks, S: Blocks) -> float:
    return sum(float(np.einsum("jab,jab->", A, B)) for A, B in zip(X, S, strict=True))


def _definite(B: Array) -> bool:
    if B.shape[1] == 1:
        return bool((B > 0).all())
    try:
        np.linalg.cholesky(B)
    except np.linalg.LinAlgError:
        return False
    return True


def _length(blocks: Blocks, change: Blocks) -> float:
    """Step at which the first block is no longer positive definite, 1 / ROOM at most."""
    fastest = ROOM
    for B, d in zip(blocks, change, strict=True):
        if B.shape[1] == 1:
            rate = -d / B
            fastest = max(fastest, float(rate.max(initial=0.0)))
            continue
        root = np.linalg.inv(np.linalg.cholesky(B))
        turned = root @ d @ np.swapaxes(root, 1, 2)
        if len(B) == 1:
            low = linalg.eigvalsh(turned[0], subset_by_index=[0, 0], check_finite=False)
        else:
            low = np.linalg.eigvalsh(turned)
        fastest = max(fastest, -float(low.min(initial=0.0)))
    return 1 / fastest


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
