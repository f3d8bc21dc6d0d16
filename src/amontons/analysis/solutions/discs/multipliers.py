"""One region of the statuses of a 3D problem: multipliers that leave no (other) solution in it.

About a reference z0 that lies in the region, or in the whole problem, symmetric V_p (6, 6) of
every contact with d^T V_p d < 0 for all d = z - z0 that law and region allow (`sets`) and

    sum_p d_p^T V_p d_p > 0   for all d_u = W d_r != 0

leave no other solution in the region.  Without a reference z = (r, u, 1), V_p is (7, 7), and
there is no solution at all.  What the region fixes (r = 0, u = 0, u_N = 0) is taken out by a
basis before the search (`multipliers.lmi`), and comes back as a large weight on its square.
The proof itself, `_proved`, uses V_p, W and q alone and accounts for rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ....core.clock import TimeLimit
from ...multipliers.lmi import Family, LmiOutcome, Slacks, find_multipliers
from ...multipliers.rounding import gamma, is_positive_definite
from ..newton_batch import Stack
from .sets import ON, Inequalities, Law, Region, inequalities, negative_on_arc

Array = NDArray[np.float64]
EXACT = 1e-13  # error of a reference relative to its size, scaled, as Newton's method ends
ROUNDING = 1e-13  # of a slack relative to its terms
ROUNDS = 4  # of further directions of slip
# how much a form that is positive between samples is lowered, in parts of what all V may be
SHIFTS = (0.0, 0.01, 0.09, 0.4, 1.5, 6.0)
TRIES = 3  # multipliers of one search that are looked at


@dataclass(frozen=True, eq=False)
class BoxProof:
    """Multipliers of one region, and the reference that they are about.

    regions: of every contact.  r (nc, 3): the solution that is the only one, None where there
    is none.  V (nc, 6, 6), or (nc, 7, 7) without r.  All in scaled variables.
    """

    regions: tuple[Region, ...]
    r: Array | None
    V: Array


@dataclass(frozen=True, eq=False)
class BoxAnswer:
    """A proof, or None with the reason; scores (nc,): how much deciding a contact may help."""

    proof: BoxProof | None
    outcome: LmiOutcome
    scores: Array


class BoxProblem:
    """The matrix inequality of one region."""

    def __init__(
        self, stack: Stack, regions: Sequence[Region], r: Array | None, *, error: float = EXACT
    ) -> None:
        """error: bound of that of r, relative to 1 + the largest |r|."""
        self.stack, self.regions, self.r = stack, tuple(regions), r
        self.error = 0.0 if r is None else error * (1 + float(np.abs(r).max(initial=0.0)))
        nc = len(self.regions)
        z0: list[Array | None] = [None] * nc
        if r is not None:
            z0 = list(np.hstack([r, stack.velocity(r[None])[0]]))
        self.laws = [Law(float(mu), z) for mu, z in zip(stack.mu, z0, strict=True)]
        self.size = 6 if r is not None else 7
        self.Z = self._variables()
        fixed = [self._fixed(p) for p in range(nc)]
        self.fixed = fixed
        self.rows = [[i for i in range(self.size) if i not in fixed[p]] for p in range(nc)]
        for p, (region, rows) in enumerate(zip(self.regions, self.rows, strict=True)):
            if region.letter == "f" and r is None:
                self.rows[p] = [3, 6]
            elif not set(rows) - {6} or (region.letter in "fs" and fixed[p] and r is not None):
                self.rows[p] = []

    def _variables(self) -> Array:
        """Z (nc, size, N): r, u (and 1) of every contact as functions of r (and 1)."""
        nc, d = self.stack.shape
        n = nc * d
        Z = np.zeros((nc, self.size, n + self.size - 6))
        Z[:, :3, :n] = np.eye(n).reshape(nc, d, n)
        Z[:, 3:6, :n] = self.stack.W.reshape(nc, d, n)
        if self.size == 7:
            Z[:, 3:6, n], Z[:, 6, n] = self.stack.c, 1.0
        return Z

    def _fixed(self, p: int) -> list[int]:
        """Components of d that are zero in the region."""
        letter, tangents = self.regions[p].letter, [1, 2] if self.stack.mu[p] == 0 else []
        if not contains(self.laws[p], self.regions[p]):
            return tangents
        return {"f": [0, 1, 2], "s": [3, 4, 5]}.get(
            letter, tangents + ([3] if letter in "cl" else [])
        )

    def solve(self, time_limit: TimeLimit = None) -> BoxAnswer:
        """Look for multipliers; more directions of slip where a proof fails between two."""
        extra: list[tuple[float, ...]] = [()] * len(self.regions)
        basis = self.basis
        scores = np.zeros(len(self.regions))
        if basis.shape[1] == 0:
            return self._without_freedom()
        outcome = LmiOutcome.STALLED
        for _ in range(ROUNDS):
            families, owners = self._families(extra)
            Z = (self.Z @ basis).reshape(-1, basis.shape[1])
            refused: list[list[tuple[int, float]]] = []
            proofs: list[BoxProof] = []
            accept = partial(self._accept, families, owners, proofs, refused)
            found = find_multipliers(Z, families, accept=accept, time_limit=time_limit)
            outcome = found.outcome
            if proofs:
                return BoxAnswer(proofs[0], LmiOutcome.FOUND, scores)
            if not refused or not refused[-1]:
                for f, index, W in zip(families, owners, found.W, strict=True):
                    d = Z[f.rows] @ found.lowest
                    scores[index] = np.einsum("pi,pij,pj->p", d, W, d)
                break
            for p, angle in refused[-1]:
                extra[p] = (*extra[p], angle)
        if outcome is LmiOutcome.FOUND:
            outcome = LmiOutcome.STALLED
        return BoxAnswer(None, outcome, scores)

    def _accept(
        self, families: list[Family], owners: list[NDArray[np.int64]], proofs: list[BoxProof],
        refused: list[list[tuple[int, float]]], W: Sequence[Array], extras: Sequence[Array],
    ) -> bool:  # fmt: skip
        """Prove what was found; True also when it was refused often enough."""
        V, failures = self._shifted(self._whole(W, owners))
        if not failures and self._slacks_hold(families, owners, W, extras):
            proof = self._proved(V)
            if proof is not None:
                proofs.append(proof)
                return True
        refused.append(failures)
        return len(refused) >= TRIES

    def _without_freedom(self) -> BoxAnswer:
        """Every r is fixed: with a reference it is the only one."""
        scores = np.zeros(len(self.regions))
        V = np.zeros((len(self.regions), self.size, self.size))
        proof = self._proved(V)
        outcome = LmiOutcome.FOUND if proof is not None else LmiOutcome.STALLED
        return BoxAnswer(proof, outcome, scores)

    # ---------------------------------------------------------------- assembly
    def _fixed_rows(self) -> Array:
        """Rows of Z that vanish in the region, (k, N)."""
        rows = [self.Z[p, i] for p, fixed in enumerate(self.fixed) for i in fixed]
        return np.array(rows).reshape(len(rows), self.Z.shape[2])

    @cached_property
    def basis(self) -> Array:
        """Columns span what the region leaves, orthonormal in the energy."""
        n = self.stack.W.shape[0]
        fixed = self._fixed_rows()
        N = self.Z.shape[2]
        basis = linalg.null_space(fixed, rcond=1e-12) if len(fixed) else np.eye(N)
        energy = np.eye(N)
        energy[:n, :n] = (self.stack.W + self.stack.W.T) / 2 + 1e-9 * np.eye(n)
        if not basis.size:
            return basis
        try:
            L = np.linalg.cholesky(basis.T @ energy @ basis)
        except np.linalg.LinAlgError:
            return basis
        return linalg.solve_triangular(L, basis.T, lower=True).T

    def _families(
        self, extra: list[tuple[float, ...]]
    ) -> tuple[list[Family], list[NDArray[np.int64]]]:
        """Contacts with inequalities of equal shape together, and which they are."""
        groups: dict[tuple, list[tuple[int, Inequalities]]] = {}
        for p, rows in enumerate(self.rows):
            if not rows:
                continue
            own = inequalities(self.laws[p], self.regions[p], rows, extra[p])
            key = (tuple(rows), tuple(m.shape for m in own.matrices))
            groups.setdefault(key, []).append((p, own))
        families, owners = [], []
        for (rows, shapes), members in groups.items():
            index = np.array([p for p, _ in members])
            slacks = []
            for size in sorted({shape[-1] for shape in shapes}):
                which = [k for k, shape in enumerate(shapes) if shape[-1] == size]
                tensor = np.array([own.matrices[k] for _, own in members for k in which])
                slacks.append(Slacks(np.repeat(np.arange(len(members)), len(which)), tensor))
            feasible = np.array([own.feasible for _, own in members])
            where = index[:, None] * self.size + np.array(rows)
            families.append(Family(where, tuple(slacks), feasible))
            owners.append(index)
        return families, owners

    # ---------------------------------------------------------------- proof
    def _whole(self, W: Sequence[Array], owners: Sequence[NDArray[np.int64]]) -> Array:
        """V of all contacts from the blocks that were searched."""
        V = np.zeros((len(self.regions), self.size, self.size))
        for block, index in zip(W, owners, strict=True):
            for p, own in zip(index, block, strict=True):
                V[np.ix_([p], self.rows[p], self.rows[p])] = own
        return V

    def _slacks_hold(
        self, families: list[Family], owners: Sequence[NDArray[np.int64]],
        W: Sequence[Array], extras: Sequence[Array],
    ) -> bool:  # fmt: skip
        """True when all slacks are positive by more than rounding and the error of z0."""
        for f, index, own, more in zip(families, owners, W, extras, strict=True):
            low, high = np.triu_indices(f.size)
            x = np.hstack([own[:, low, high], more])
            error = np.array([self.laws[p].relative(self.error) for p in index])
            square = 5 + 2 * self.stack.mu[index] ** 2  # of the norm of generators, at least
            margin = np.linalg.norm(own, axis=(1, 2)) * square * (ROUNDING + 2 * error)
            for slacks in f.slacks:
                if slacks.tensor.shape[2] == 1:
                    if (slacks.at(x) <= 0).any():
                        return False
                    continue
                values = np.linalg.eigvalsh(slacks.at(x))[:, 0]
                if (values <= margin[slacks.owner]).any():
                    return False
        return True

    def _shifted(self, V: Array) -> tuple[Array, list[tuple[int, float]]]:
        """V more negative where an arc needs it, and the arcs where that was not enough."""
        V, failures, room = V.copy(), [], self._room(V)
        for p, (law, region) in enumerate(zip(self.laws, self.regions, strict=True)):
            if "l" not in region.statuses or law.mu == 0 or not self.rows[p]:
                continue
            error = law.relative(self.error)
            own, one = np.ix_([p], self.rows[p], self.rows[p]), np.eye(len(self.rows[p]))
            for share in SHIFTS:
                V[own] -= share * room * one
                angle = negative_on_arc(law, region, V[p], error)
                if angle is None:
                    break
            if angle is not None:
                failures.append((p, angle))
        return V, failures

    def _room(self, V: Array) -> float:
        """How much can be taken from the diagonal of all V before M is singular."""
        Z = (self.Z @ self.basis).reshape(-1, self.basis.shape[1])
        M = Z.T @ (V @ Z.reshape(len(V), self.size, -1)).reshape(Z.shape)
        try:
            least = linalg.eigh(M, Z.T @ Z, eigvals_only=True, subset_by_index=[0, 0])[0]
        except np.linalg.LinAlgError:
            return 0.0
        return max(0.0, float(least))

    def _proved(self, V: Array) -> BoxProof | None:
        """The proof with weights on what is fixed, None when M is not surely definite.

        M is looked at in coordinates T in which it is nearly diagonal: any T will do, since
        T^T M T > 0 makes M > 0 on its range, and T is square.
        """
        basis, fixed = self.basis, self._fixed_rows()
        N = self.Z.shape[2]
        Z = self.Z.reshape(-1, N)
        whole, T = V, basis
        if len(fixed):
            VZ = (V @ self.Z).reshape(Z.shape)
            rest = linalg.orth(fixed.T, rcond=1e-12)
            if basis.shape[1] + rest.shape[1] != N:
                return None
            ZB, ZR = Z @ basis, Z @ rest
            core, cross = basis.T @ (Z.T @ (VZ @ basis)), ZB.T @ (VZ @ rest)
            X = np.linalg.lstsq(core, cross, rcond=1e-15)[0] if basis.size else cross
            left = ZR.T @ (VZ @ rest) - cross.T @ X
            strength = np.linalg.eigvalsh((fixed @ rest).T @ (fixed @ rest))[0]
            lowest = np.linalg.eigvalsh((left + left.T) / 2)[0]
            weight = 4 * (1 + max(0.0, -float(lowest))) / strength
            whole = V.copy()
            for p, rows in enumerate(self.fixed):
                whole[p, rows, rows] += weight
            T = np.hstack([basis, (rest - basis @ X) / np.sqrt(weight)])
        ZT = Z @ T
        size = gamma(N + 2) * (np.abs(Z) @ np.abs(T))  # rounding of ZT itself
        part = (-1, self.size, T.shape[1])
        VZT = (whole @ ZT.reshape(part)).reshape(ZT.shape)
        bound, off = ((np.abs(whole) @ np.reshape(x, part)).reshape(ZT.shape)
                      for x in (np.abs(ZT), size))  # fmt: skip
        rounding = gamma(2 * len(Z) + 20) * (np.abs(ZT).T @ bound)
        rounding += 2.5 * (size.T @ bound + np.abs(ZT).T @ off)
        M = ZT.T @ VZT
        if is_positive_definite((M + M.T) / 2, (rounding + rounding.T) / 2):
            return BoxProof(self.regions, self.r, whole)
        return None


def contains(law: Law, region: Region) -> bool:
    """True where the reference of a law lies in a closed region; also where there is none."""
    if law.z0 is None or region.letter == ".":
        return True
    r, u = law.z0[:3], law.z0[3:]
    closed = abs(u[0]) <= ON
    if region.letter in "fs":
        return law.holds(region.letter)
    if law.mu == 0 or region.letter == "c":
        return bool(closed)
    if law.direction is None:
        return False
    if np.abs(r).max() <= ON and np.abs(u).max() <= ON:
        return True
    apart = abs((law.direction - region.middle + np.pi) % (2 * np.pi) - np.pi)
    return bool(apart <= region.half + ON)
