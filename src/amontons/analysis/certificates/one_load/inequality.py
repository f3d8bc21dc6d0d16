"""The matrix inequality of one branch: its proof, or the direction in which it fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline
from ...multipliers.lmi import SMALLEST, LmiOutcome, find_multipliers, slacks_are_positive
from ...scaled import Scaled
from ...solutions.branch_proof import BranchProof, prove
from ...solutions.branches import coordinates, energy_basis
from ...solutions.groups import whole
from ...statuses import ANY, CLOSED, FREE, MINUS, PLUS, SLIP, STICK, States
from .cones import cones_about, cones_with_apex, groups
from .known import Known
from .reduction import shared_multipliers

Array = NDArray[np.float64]
HOPELESS = 1e-6  # eigenvalue of M, of mean 1, below which a branch is divided instead
LARGEST = 600  # contacts up to which each can have a multiplier of its own: memory
LARGE = 150  # contacts from which few different multipliers are tried first


def too_many(local: Scaled) -> str:
    """Why contacts can not have a multiplier each, empty where they can."""
    if local.contacts <= LARGEST:
        return ""
    return f"no shared multipliers, and more than {LARGEST} contacts for own ones"


def children(mu: Array, branch: States, contact: int) -> tuple[States, ...]:
    """The branches into which one contact divides a branch, none when it is decided."""
    parts = {ANY: (FREE, CLOSED), CLOSED: (STICK, SLIP), SLIP: (PLUS, MINUS)}
    if mu[contact] == 0:
        parts = {ANY: (FREE, PLUS)}
    out = []
    for state in parts.get(int(branch[contact]), ()):
        child = branch.copy()
        child[contact] = state
        out.append(child)
    return tuple(out)


@dataclass(frozen=True, eq=False)
class Failure:
    """A branch without multipliers, and the z (nc, k) in which the inequality fails most."""

    branch: States
    direction: Array
    score: Array  # (nc,): z^T W z of the best multipliers

    def contact(self, local: Scaled) -> int:
        """The contact to be divided: undecided, and with the largest score; -1 for none."""
        for p in np.argsort(-self.score):
            if children(local.mu, self.branch, int(p)):
                return int(p)
        return -1


class Inequality:
    """The matrix inequality of a branch, about a known solution in it or without one."""

    def __init__(self, local: Scaled, branch: States, known: Known | None) -> None:
        self.local, self.branch, self.known = local, branch, known
        apex = known is None
        if known is None:
            self.cones = cones_with_apex(local, branch)
        else:
            self.cones = cones_about(local, branch, known)
        self.groups = groups(self.cones, coordinates(local, branch))
        self.off = None if known is None else known.off
        self.Z = energy_basis(local, branch, apex)

    @property
    def divisible(self) -> bool:
        """True where some contact is not decided yet."""
        return bool((self.branch >= SLIP).any())

    @property
    def large(self) -> bool:
        """Where few different multipliers are worth a try first."""
        return (
            self.local.contacts >= LARGE
            and self.known is not None
            and bool((self.branch == ANY).all())
        )

    def solve(self, near: float, deadline: Deadline) -> BranchProof | Failure:
        """Its proof with a distance <= near, or where it fails."""
        if not self.Z.shape[1]:  # nothing moves: any multipliers will do
            W = self._whole_identity()
            proof = prove(self.local, self.branch, W, self.off)
            able = proof is not None and proof.distance <= near
            return proof if able and proof else self._failure(np.zeros(0), W)
        proofs: list[BranchProof] = []

        def accept(W: tuple[Array, ...], extras: tuple[Array, ...]) -> bool:
            own = tuple(e * g.factors for e, g in zip(extras, self.groups, strict=True))
            if not slacks_are_positive([g.family for g in self.groups], W, own):
                return False
            proof = prove(self.local, self.branch, self._whole(W), self.off)
            if proof is None or proof.distance > near:
                return False
            proofs.append(proof)
            return True

        share = deadline if too_many(self.local) else deadline.share(0.5)
        if self.large and shared_multipliers(
            self.local, self.branch, self.groups, accept, deadline=share
        ):
            return proofs[-1]
        if too_many(self.local):
            return self._failure(np.zeros(self.Z.shape[1]), self._whole_identity())
        answer = find_multipliers(
            self.Z, [g.turned for g in self.groups], accept=accept, time_limit=deadline,
            smallest=HOPELESS if self.divisible else SMALLEST,
        )  # fmt: skip
        if answer.outcome is LmiOutcome.FOUND:
            return proofs[-1]
        return self._failure(answer.lowest, self._whole(answer.W))

    def _whole(self, parts: tuple[Array, ...]) -> Array:
        return whole(self.groups, parts, self.local.contacts, self.cones.G.shape[2])

    def _whole_identity(self) -> Array:
        """W = -I, which is never positive on the cones."""
        return -np.tile(np.eye(self.cones.G.shape[2]), (self.local.contacts, 1, 1))

    def _failure(self, lowest: Array, W: Array) -> Failure:
        nc = self.local.contacts
        z = (self.Z[: 4 * nc] @ lowest).reshape(nc, 4)
        if self.known is None:
            z = np.column_stack([z, np.full(nc, self.Z[-1] @ lowest)])
        return Failure(self.branch, z, np.einsum("pa,pab,pb->p", z, W, z))
