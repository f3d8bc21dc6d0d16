"""One region of statuses, in 2D or 3D: multipliers that leave no (other) solution in it.

About a reference z0 that lies in the region, or in the whole problem, symmetric V_p (2 d, 2 d)
of every contact with V <= 0 on all z - z0 that law and region allow (`sets`) and

    sum_p x_p^T V_p x_p > 0   for all x_u = W x_r != 0

leave no other solution in the region.  Without a reference z = (r, u, 1), V_p has a row more,
and there is no solution at all.  What the region fixes (r = 0, u = 0, u_N = 0) is taken out by
a basis before the search (`multipliers.lmi`), and comes back as a large weight on its square.
The proof itself (`branch_proof`) uses V_p, W and q alone and accounts for rounding.

In 2D the reference obeys the law exactly and misses the balance by `Known.off`, which makes the
distance of the proof; few generators are turned to be orthonormal.  In 3D it obeys the balance
and misses the law by an error that the signs of forms leave room for; the arcs of slip are
sampled, and proved between the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ....core.clock import NEVER, Deadline, TimeLimit, deadline_of
from ...multipliers.lmi import SMALLEST, find_multipliers, slacks_are_positive
from ...scaled import Scaled
from ...tolerances import REFERENCE, SUMMED
from ..branch_proof import prove
from ..branches import coordinates, energy_basis
from ..groups import Form, Group, group_of, whole
from .known import Known
from .plane_sets import PlaneLaw
from .reduction import shared_multipliers
from .sets import Law, Region, forms_of, negative_on_arc, states_of_regions

Array = NDArray[np.float64]
Parts = tuple[Array, ...]
HOPELESS = 1e-6  # 2D: eigenvalue of M, of mean 1, below which a region is divided instead
LARGEST = 600  # 2D: contacts up to which each can have a multiplier of its own: memory
LARGE = 150  # 2D: contacts from which few different multipliers are tried first
ROUNDS = 4  # of further directions of slip
# how much a form that is positive between samples is lowered, in parts of what all V may be
SHIFTS = (0.0, 0.01, 0.09, 0.4, 1.5, 6.0)
TRIES = 3  # multipliers of one search that are looked at
PROOF = (3e7, 20.0)  # operations of a proof, and per cube of the reactions


@dataclass(frozen=True, eq=False)
class BoxProof:
    """Multipliers of one region, and the reference that they are about.

    regions: of every contact.  r (nc, d): the solution that is the only one within `distance`,
    None where there is none.  V (nc, 2 d, 2 d), or a row more without r.  All in scaled
    variables.
    """

    regions: tuple[Region, ...]
    r: Array | None
    V: Array
    distance: float


@dataclass(frozen=True, eq=False)
class BoxAnswer:
    """A proof or None; scores (nc,): how much deciding a contact may help.

    direction (nc, k): the z in which the inequality fails most.
    """

    proof: BoxProof | None
    scores: Array
    direction: Array


def too_many(scaled: Scaled) -> str:
    """Why contacts of a 2D problem can not have a multiplier each, empty where they can."""
    if scaled.contacts <= LARGEST:
        return ""
    return f"no shared multipliers, and more than {LARGEST} contacts for own ones"


class BoxProblem:
    """The matrix inequality of one region."""

    def __init__(
        self, scaled: Scaled, regions: Sequence[Region], r: Array | None, *,
        error: float = REFERENCE, known: Known | None = None, laws: Sequence[PlaneLaw] = (),
    ) -> None:  # fmt: skip
        """r lies in the closed region; error: bound of its error, relative to 1 + |r|.

        Of 2D known: r with all that is to be known about it; laws: about it, or about nothing.
        """
        self.scaled, self.regions, self.r = scaled, tuple(regions), r
        self.deadline: Deadline = NEVER
        self.error = 0.0 if r is None else error * (1 + float(np.abs(r).max(initial=0.0)))
        nc, d = scaled.shape
        self.laws, self.plane_laws = [], laws
        if d == 3:
            z0: list[Array | None] = [None] * nc
            if r is not None:
                z0 = list(np.hstack([r, scaled.velocity(r[None])[0]]))
            self.laws = [Law(float(mu), z) for mu, z in zip(scaled.mu, z0, strict=True)]
        self.off = None if r is None else np.zeros(nc * d) if known is None else known.off
        self.branch = states_of_regions(self.regions)
        left = coordinates(scaled, self.branch)
        self.rows = [self._rows(*own) for own in zip(self.regions, left, strict=True)]
        self.Z = energy_basis(scaled, self.branch, r is None)
        self.size = 2 * d + (r is None)

    def _rows(self, region: Region, left: tuple[int, ...]) -> list[int]:
        """Rows of z that V of a contact sees: what is left of them where that can help."""
        apex = [] if self.r is not None else [2 * self.scaled.dimension]
        if self.scaled.dimension == 3 and region.letter == "f":
            return [3, *apex] if apex else []
        if self.scaled.dimension == 3 and region.letter == "s" and not apex:
            return []
        return [*left, *apex]

    @property
    def _divisible(self) -> bool:
        return any(region.letter in ".cl" for region in self.regions)

    @property
    def _is_large(self) -> bool:
        """Where few different multipliers are worth a try first."""
        whole = all(region.letter == "." for region in self.regions)
        return whole and self.r is not None and self.scaled.contacts >= LARGE

    def solve(self, time_limit: TimeLimit = None, near: float = np.inf) -> BoxAnswer:
        """Look for multipliers whose proof has a distance <= near.

        In 3D with more directions of slip where a proof fails between two.
        """
        self.deadline, nc = deadline_of(time_limit), len(self.regions)
        extra: list[tuple[float, ...]] = [()] * nc
        if self.Z.shape[1] == 0:  # every r is fixed: a reference is the only one
            V = np.zeros((nc, self.size, self.size))
            return self._answer(self._proved(V, near))
        if self.scaled.dimension == 2:
            return self._solve_in_plane(near)
        for _ in range(ROUNDS):
            groups = self._groups(extra)
            refused: list[list[tuple[int, float]]] = []
            proofs: list[BoxProof] = []
            accept = partial(self._accept, groups, proofs, refused)
            families = [group.turned for group in groups]
            found = find_multipliers(self.Z, families, accept=accept, time_limit=self.deadline)
            if proofs:
                return self._answer(proofs[0])
            if not refused or not refused[-1]:
                return self._answer(None, found.lowest, self._whole(groups, found.W))
            for p, angle in refused[-1]:
                extra[p] = (*extra[p], angle)
        return self._answer(None)

    def _solve_in_plane(self, near: float) -> BoxAnswer:
        """The same in 2D; many contacts share multipliers first."""
        groups = self._groups([()] * len(self.regions))
        plain, proofs = [group.family for group in groups], list[BoxProof]()

        def accept(W: Parts, extras: Parts) -> bool:
            own = tuple(e * g.factors for e, g in zip(extras, groups, strict=True))
            proof = None
            if slacks_are_positive(plain, W, own):
                proof = self._proved(self._whole(groups, W), near)
            proofs.extend([] if proof is None else [proof])
            return proof is not None

        alone = too_many(self.scaled)
        share = self.deadline if alone else self.deadline.share(0.5)
        if self._is_large and shared_multipliers(
            self.scaled, self.branch, groups, accept, deadline=share
        ):
            return self._answer(proofs[-1])
        if alone:
            return self._answer(None)
        found = find_multipliers(
            self.Z, [group.turned for group in groups], accept=accept,
            time_limit=self.deadline,
            smallest=HOPELESS if self._divisible else SMALLEST,
        )  # fmt: skip
        if proofs:
            return self._answer(proofs[-1])
        return self._answer(None, found.lowest, self._whole(groups, found.W))

    def _answer(
        self, proof: BoxProof | None, lowest: Array | None = None, V: Array | None = None
    ) -> BoxAnswer:
        """The proof, or where the inequality fails: lowest (N,), multipliers V."""
        nc, size = len(self.regions), self.size
        if lowest is None or V is None:
            return BoxAnswer(proof, np.zeros(nc), np.zeros((nc, size)))
        z = (self.Z @ lowest)[: nc * (size - size % 2)].reshape(nc, -1)
        if self.r is None:
            z = np.column_stack([z, np.full(nc, self.Z[-1] @ lowest)])
        scores = np.einsum("pa,pab,pb->p", z, V, z)
        return BoxAnswer(proof, scores if self.plane_laws else np.maximum(scores, 0.0), z)

    def _whole(self, groups: list[Group], W: Sequence[Array]) -> Array:
        return whole(groups, W, len(self.regions), self.size)

    def _accept(
        self, groups: list[Group], proofs: list[BoxProof],
        refused: list[list[tuple[int, float]]], W: Sequence[Array], extras: Sequence[Array],
    ) -> bool:  # fmt: skip
        """Prove what was found in 3D; True also when it was refused often enough."""
        V, failures = self._shifted(self._whole(groups, W))
        if not failures and self._slacks_hold(groups, W, extras):
            proof = self._proved(V)
            if proof is not None:
                proofs.append(proof)
                return True
        refused.append(failures)
        return len(refused) >= TRIES

    def _groups(self, extra: list[tuple[float, ...]]) -> list[Group]:
        """Contacts with inequalities of equal shape together.

        In 3D they are not turned: generators of neighbouring directions may be parallel.
        """
        alike: dict[tuple, list[tuple[int, list[Form]]]] = {}
        for p, rows in enumerate(self.rows):
            if rows:
                own = self._forms(p, rows, extra[p])
                key = (tuple(rows), *(form.key for form in own))
                alike.setdefault(key, []).append((p, own))
        out = []
        for (rows, *_), members in alike.items():
            index = np.array([p for p, _ in members])
            forms = [replace(same[0], G=np.array([form.G for form in same]))
                     for same in zip(*(own for _, own in members), strict=True)]  # fmt: skip
            turn = self.scaled.dimension == 2
            out.append(group_of(index, rows, forms, self.scaled.shape, turn=turn))
        return out

    def _forms(self, p: int, rows: list[int], extra: tuple[float, ...]) -> list[Form]:
        if self.plane_laws:
            return self.plane_laws[p].forms(self.regions[p].letter, rows)
        return forms_of(self.laws[p], self.regions[p], rows, extra)

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
                angle = negative_on_arc(law, region, V[p], error, self.deadline)
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

    def _proved(self, V: Array, near: float = np.inf) -> BoxProof | None:
        """The proof with weights on what is fixed, None when M is not surely definite."""
        self.deadline.spend(PROOF[0] + PROOF[1] * float(self.scaled.q.size) ** 3)
        proof = prove(self.scaled, self.branch, V, self.off,
                      all_reactions=self.scaled.dimension == 3)  # fmt: skip
        if proof is None or proof.distance > near:
            return None
        return BoxProof(self.regions, self.r, proof.multipliers, proof.distance)
