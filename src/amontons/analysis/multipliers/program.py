"""The semidefinite programs of the matrix inequality of `multipliers.lmi`.

With x = (unknowns of W, extras, t), S(x) = diag(M - t I, S_1, S_2, ...) = sum_i x_i A_i and
n_i = trace A_i it is the pair

    max t,          S(x) >= 0,  n x = theta,
    min lam theta,  X >= 0,     tr A_i X = lam n_i - [i is t],

theta the number of rows of S; lam theta - t = tr X S >= 0, so lam theta bounds t from above.
Extras of a set enter only the slacks of that set.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Blocks = list[Array]  # first the (1, N, N) of M, then the (J, s, s) of all slacks in order
FEW = 2e7  # entries of all derivatives of M that are kept where unknowns are few


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
    """Sets of equal size, see `multipliers.lmi`."""

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
            for _, s in self.slacks()
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

    def slacks(self) -> Iterator[tuple[int, Slacks]]:
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
        return [M[None]] + [s.at(sets[k]) for k, s in self.slacks()]

    def matrix(self, x: Array) -> Array:
        """M = sum_c Z_c^T W_c Z_c, (N, N)."""
        shape = (len(self.Z), len(self.Z))
        entries = self.factor * (self.spread @ x[: self.entries])
        half = self.Z.T @ (sparse.csr_array((entries, (self.a, self.b)), shape=shape) @ self.Z)
        return half + half.T

    def adjoint(self, R: Blocks) -> Array:
        """tr A_i R for all i, R symmetric or not."""
        local = [np.zeros((len(f.rows), f.entries + f.extras)) for f in self.families]
        for (k, s), block in zip(self.slacks(), R[1:], strict=True):
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


def _slices(counts: list[int], first: int = 0) -> list[slice]:
    ends = np.cumsum([first, *counts])
    return [slice(int(i), int(j)) for i, j in zip(ends[:-1], ends[1:], strict=True)]
