"""One region of the statuses of a 3D problem: multipliers that leave no (other) solution in it.

About a reference z0 that lies in the region, or in the whole problem, symmetric V_p (6, 6) of
every contact with d^T V d < 0 for all d = z - z0 that law and region allow (`sets`) and

    sum_p d_p^T V_p d_p > 0   for all d_u = W d_r != 0

leave no other solution in the region.  Without a reference z = (r, u, 1), V_p is (7, 7), and
there is no solution at all.  What the region fixes (r = 0, u = 0, u_N = 0) is taken out by a
basis before the search (`multipliers.lmi`), and comes back as a large weight on its square.
The proof itself (`branch_proof`) uses V_p, W and q alone and accounts for rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ....core.clock import TimeLimit
from ...multipliers.lmi import find_multipliers
from ...scaled import Scaled
from ...tolerances import REFERENCE, SUMMED
from ..branch_proof import prove
from ..branches import coordinates, energy_basis
from ..groups import Form, Group, group_of, whole
from .sets import Law, Region, forms_of, negative_on_arc, states_of_regions

Array = NDArray[np.float64]
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
    """A proof or None; scores (nc,): how much deciding a contact may help."""

    proof: BoxProof | None
    scores: Array


class BoxProblem:
    """The matrix inequality of one region."""

    def __init__(
        self, scaled: Scaled, regions: Sequence[Region], r: Array | None, *,
        error: float = REFERENCE,
    ) -> None:  # fmt: skip
        """r lies in the closed region; error: bound of its error, relative to 1 + |r|."""
        self.scaled, self.regions, self.r = scaled, tuple(regions), r
        self.error = 0.0 if r is None else error * (1 + float(np.abs(r).max(initial=0.0)))
        nc = len(self.regions)
        z0: list[Array | None] = [None] * nc
        if r is not None:
            z0 = list(np.hstack([r, scaled.velocity(r[None])[0]]))
        self.laws = [Law(float(mu), z) for mu, z in zip(scaled.mu, z0, strict=True)]
        self.branch = states_of_regions(self.regions)
        left = coordinates(scaled, self.branch)
        self.rows = [self._rows(*own) for own in zip(self.regions, left, strict=True)]
        self.Z = energy_basis(scaled, self.branch, r is None)
        self.size = 6 if r is not None else 7

    def _rows(self, region: Region, left: tuple[int, ...]) -> list[int]:
        """Rows of z that V of a contact sees: what is left of them where that can help."""
        if self.r is None:
            return [3, 6] if region.letter == "f" else [*left, 6]
        return [] if region.letter in "fs" else list(left)

    def solve(self, time_limit: TimeLimit = None) -> BoxAnswer:
        """Look for multipliers; more directions of slip where a proof fails between two."""
        extra: list[tuple[float, ...]] = [()] * len(self.regions)
        scores = np.zeros(len(self.regions))
        if self.Z.shape[1] == 0:  # every r is fixed: a reference is the only one
            V = np.zeros((len(self.regions), self.size, self.size))
            return BoxAnswer(self._proved(V), scores)
        for _ in range(ROUNDS):
            groups = self._groups(extra)
            refused: list[list[tuple[int, float]]] = []
            proofs: list[BoxProof] = []
            accept = partial(self._accept, groups, proofs, refused)
            families = [group.turned for group in groups]
            found = find_multipliers(self.Z, families, accept=accept, time_limit=time_limit)
            if proofs:
                return BoxAnswer(proofs[0], scores)
            if not refused or not refused[-1]:
                for f, group, W in zip(families, groups, found.W, strict=True):
                    d = self.Z[f.rows] @ found.lowest
                    scores[group.contacts] = np.einsum("pi,pij,pj->p", d, W, d)
                break
            for p, angle in refused[-1]:
                extra[p] = (*extra[p], angle)
        return BoxAnswer(None, scores)

    def _accept(
        self, groups: list[Group], proofs: list[BoxProof],
        refused: list[list[tuple[int, float]]], W: Sequence[Array], extras: Sequence[Array],
    ) -> bool:  # fmt: skip
        """Prove what was found; True also when it was refused often enough."""
        V, failures = self._shifted(whole(groups, W, len(self.regions), self.size))
        if not failures and self._slacks_hold(groups, W, extras):
            proof = self._proved(V)
            if proof is not None:
                proofs.append(proof)
                return True
        refused.append(failures)
        return len(refused) >= TRIES

    def _groups(self, extra: list[tuple[float, ...]]) -> list[Group]:
        """Contacts with inequalities of equal shape together.

        They are not turned: generators of neighbouring directions may be parallel.
        """
        alike: dict[tuple, list[tuple[int, list[Form]]]] = {}
        for p, rows in enumerate(self.rows):
            if rows:
                own = forms_of(self.laws[p], self.regions[p], rows, extra[p])
                key = (tuple(rows), *(form.key for form in own))
                alike.setdefault(key, []).append((p, own))
        out = []
        for (rows, *_), members in alike.items():
            index = np.array([p for p, _ in members])
            forms = [replace(same[0], G=np.array([form.G for form in same]))
                     for same in zip(*(own for _, own in members), strict=True)]  # fmt: skip
            out.append(group_of(index, rows, forms, self.scaled.shape, turn=False))
        return out

    # ---------------------------------------------------------------- proof
    def _slacks_hold(
        self, groups: list[Group], W: Sequence[Array], extras: Sequence[Array]
    ) -> bool:
        """True when all slacks are positive by more than rounding and the error of z0."""
        for group, own, more in zip(groups, W, extras, strict=True):
            f, index = group.family, group.contacts
            low, high = np.triu_indices(f.size)
            x = np.hstack([own[:, low, high], more])
            error = np.array([self.laws[p].relative(self.error) for p in index])
            square = 5 + 2 * self.scaled.mu[index] ** 2  # of the norm of generators, at least
            margin = np.linalg.norm(own, axis=(1, 2)) * square * (SUMMED + 2 * error)
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
            angle = None
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
        nc, N = len(V), self.Z.shape[1]
        Z = self.Z[: 6 * nc].reshape(nc, 6, N)
        if self.size == 7:
            Z = np.concatenate([Z, np.broadcast_to(self.Z[-1], (nc, 1, N))], axis=1)
        VZ, Z = (V @ Z).reshape(-1, N), Z.reshape(-1, N)
        M = Z.T @ VZ
        try:
            least = linalg.eigh(M, Z.T @ Z, eigvals_only=True, subset_by_index=[0, 0])[0]
        except np.linalg.LinAlgError:
            return 0.0
        return max(0.0, float(least))

    def _proved(self, V: Array) -> BoxProof | None:
        """The proof with weights on what is fixed, None when M is not surely definite."""
        off = None if self.r is None else np.zeros(self.scaled.q.size)
        proof = prove(self.scaled, self.branch, V, off, all_reactions=True)
        return BoxProof(self.regions, self.r, proof.multipliers) if proof else None
