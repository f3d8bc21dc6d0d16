"""The statuses of a 2D problem, divided until no other solution is left, or one is found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline
from ...scaled import Scaled
from ...solutions.branch_proof import BranchProof
from ...solutions.enumerate import PieceSolution
from ...solutions.region_tree import RegionTree
from ...statuses import ANY, BOTH_WAYS, FREE, LETTERS, SLIP, States, word
from .answer import LoadBranch
from .cones import allowed
from .inequality import Inequality, children, too_many
from .known import NEAR, refined
from .others import OtherSolutions

Array = NDArray[np.float64]


class StatusTree(RegionTree):
    """Branches that are not proved yet; known (nc, 2): the solution, refined and scaled."""

    LOOK = 20.0

    def __init__(self, scaled: Scaled, r: Array, deadline: Deadline) -> None:
        root = np.where(scaled.reacts, ANY, FREE).astype(np.int8)
        super().__init__(scaled, deadline, [root])
        self.solution = refined(scaled, (r / scaled.to_r).ravel())
        self.known = self.solution.r.reshape(-1, 2)
        self.size = max(1.0, float(np.abs(self.known).max(initial=0.0)))
        self.elsewhere = OtherSolutions(scaled, self.solution)
        self.proofs: list[BranchProof] = []
        self.other: PieceSolution | None = None

    def _look_at(self, branch: States) -> list[States]:
        """Prove a branch, or look for another solution where that fails, and divide it."""
        inside = allowed(self.scaled.mu, branch) & self.solution.touches
        known = self.solution if inside.any(axis=1).all() else None
        answer = Inequality(self.scaled, branch, known).solve(NEAR * self.size, self.deadline)
        if isinstance(answer, BranchProof):
            self.proofs.append(answer)
            return []
        self.other = self.elsewhere.near(answer, self.deadline)
        contact = answer.contact(self.scaled)
        if contact < 0:
            self.undecided += 1
            return []
        return list(children(self.scaled.mu, branch, contact))

    def _look_elsewhere(self, deadline: Deadline) -> None:
        """Look for another solution from many starts."""
        self.other = self.elsewhere.far(deadline)

    @property
    def several(self) -> bool:
        """True where another solution is known."""
        return self.other is not None

    @property
    def affords_step(self) -> bool:
        """True where there are time and memory to prove a branch; the whole is tried anyway."""
        few = not self.examined or not too_many(self.scaled)
        return few and super().affords_step

    @property
    def reason(self) -> str:
        """Why the branches are not complete."""
        if not self.stopped:
            return f"{self.undecided} patterns could neither be excluded nor solved"
        left = f"stopped after {self.deadline} with {len(self.queue)} branches left"
        return too_many(self.scaled) or left

    # ------------------------------------------------------------------ what is proved
    @property
    def parts(self) -> int:
        """Branches that were proved."""
        return len(self.proofs)

    @property
    def resolution(self) -> float:
        """Bound of the difference of reactions to those known, relative to the largest."""
        return max((proof.distance for proof in self.proofs), default=0.0) / self.size

    @property
    def branches(self) -> tuple[LoadBranch, ...]:
        """The multipliers in the units of the problem: exact, units are powers of two."""
        out = []
        for proof in self.proofs:
            unit = np.ones((self.scaled.contacts, proof.multipliers.shape[1]))
            unit[:, :2], unit[:, 2:4] = 1 / self.scaled.to_r, 1 / self.scaled.to_u
            W = proof.multipliers * unit[:, :, None] * unit[:, None, :]
            pattern = word(proof.branch).replace(LETTERS[SLIP], BOTH_WAYS)
            out.append(LoadBranch(pattern, W))
        return tuple(out)
