"""Is a solution of a 2D Coulomb problem the only one for its load?  A certificate, or another.

Another solution z differs from the found one z0 by d with d_u = W d_r.  In status s contact p
has d_p in the cone K_ps = cone(C_s - z0_p).  Symmetric matrices W_p with d_p^T W_p d_p <= 0 on
all K_ps and sum_p d_p^T W_p d_p > 0 for all d with d_u = W d_r leave d = 0 only.  They solve a
linear matrix inequality (`multipliers.lmi`): -G^T W_p G = positive semidefinite + nonnegative,
G the generators of K_ps, which in up to four dimensions is all that copositivity asks for.

Where none exist, contacts are divided: free or closed, stick or slip, slip + or -.  Branches
with z0 are treated alike, without the velocities and reactions that vanish there; branches
without z0 must be shown to hold no solution, by multipliers of (z, 1).  Other solutions are
looked for with Newton's method, from many starts and from where an inequality fails.

What CERTIFIED means, in floating point with all rounding accounted for (`proof`): every
solution of the problem, with W, q and mu as given, is within `distance` of the one found; where
no contact of it is nearer than that to another status, it is the only one.

P. Parrilo, "Structured semidefinite programs and semialgebraic geometry methods in robustness
and optimization", thesis, Caltech (2000), chapter 5 (copositive matrices).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline, TimeLimit, deadline_of, now
from ....core.errors import TimeUp
from ....problem.friction import FrictionProblem
from ....problem.solution import FrictionSolution
from ...solutions.enumerate import PieceSolution
from .answer import (
    SECONDS,
    LoadBranch,
    LoadCertificate,
    LoadOutcome,
    proved_on,
    reactions_of,
    refuted,
    stopped,
    without_search,
)
from .discs import certify_load_discs
from .inequality import Failure, Inequality, too_many
from .known import NEAR, contains, refined
from .others import OtherSolutions
from .problem import LoadProblem, States, word
from .proof import BranchProof

Array = NDArray[np.float64]
PREPARED = 20.0  # operations of preparing an inequality per cube of the reactions
FINDING = 0.2  # share of the time left that goes into looking for another solution


def certify_load(
    problem: FrictionProblem, solution: FrictionSolution | PieceSolution, *,
    time_limit: TimeLimit = None,
) -> LoadCertificate:  # fmt: skip
    """Certificate that a Coulomb problem has no solution but the given one, or another one.

    time_limit: seconds, after which the answer is undecided; without it operations are counted,
    as many as take about SECONDS.  The global form is condensed.  In 3D see
    `one_load.discs`.  Raises UnsupportedForm under Tresca's law, InvalidInput where
    `solution` does not solve the problem.
    """
    if problem.dimension == 3:
        return certify_load_discs(problem, solution, time_limit=time_limit)
    deadline, began = deadline_of(time_limit, SECONDS), now()
    r = reactions_of(problem, solution)
    try:
        local = LoadProblem.of(problem, deadline)
    except TimeUp as reason:
        return stopped(r, reason, began)
    return _Search(local, r, deadline, began).run()


class _Search:
    """Branches that are not proved yet, and what was found on the way."""

    def __init__(
        self, local: LoadProblem, r: Array, deadline: Deadline, began: float
    ) -> None:
        self.local, self.began, self.deadline = local, began, deadline
        self.known = refined(local, r.ravel() / local.to_r)
        self.size = max(1.0, float(np.abs(self.known.r).max(initial=0.0)))
        self.proofs: list[BranchProof] = []
        self.examined = 0

    def run(self) -> LoadCertificate:
        """Root, other solutions, branches, as far as time allows."""
        try:
            return self._run()
        except TimeUp as reason:
            return self._answer(LoadOutcome.UNDECIDED, str(reason))

    def _run(self) -> LoadCertificate:
        if at_once := without_search(self.local.problem):
            return self._answer(*at_once)
        failure = self._prove(self.local.root_branch)
        if failure is None:
            return self._certified()
        self.other = OtherSolutions(self.local, self.known)
        found = self.other.near(failure, self.deadline) or self.other.far(
            self.deadline.share(FINDING)
        )
        if found:
            return self._refuted(found)
        if reason := too_many(self.local):
            return self._answer(LoadOutcome.UNDECIDED, reason)
        return self._divide(failure)

    def _divide(self, failure: Failure) -> LoadCertificate:
        """Branch until all is proved, another solution is found, or the time is over."""
        stack, undecided = [failure], 0
        while stack:
            failure = stack.pop()
            contact = failure.contact(self.local)
            if contact < 0:
                undecided += 1
                continue
            for child in self.local.children(failure.branch, contact):
                if self.deadline.passed:
                    left = f"{len(stack) + 1} branches left"
                    reason = f"stopped after {self.deadline} with {left}"
                    return self._answer(LoadOutcome.UNDECIDED, reason)
                following = self._prove(child)
                if following is None:
                    continue
                found = self.other.near(following, self.deadline)
                if found:
                    return self._refuted(found)
                stack.append(following)
        if undecided:
            reason = f"{undecided} patterns could neither be excluded nor solved"
            return self._answer(LoadOutcome.UNDECIDED, reason)
        return self._certified()

    def _prove(self, branch: States) -> Failure | None:
        """None where a branch is proved, which is kept."""
        self.deadline.pay(PREPARED * (2.0 * self.local.contacts) ** 3)
        self.examined += 1
        known = self.known if contains(self.local, branch, self.known) else None
        inequality = Inequality(self.local, branch, known)
        proof = inequality.solve(NEAR * self.size, self.deadline)
        if isinstance(proof, Failure):
            return proof
        self.proofs.append(proof)
        return None

    # ------------------------------------------------------------------ answers
    def _certified(self) -> LoadCertificate:
        return self._answer(LoadOutcome.CERTIFIED, proved_on(len(self.proofs)))

    def _refuted(self, other: PieceSolution) -> LoadCertificate:
        r0 = (self.known.r * self.local.to_r).reshape(-1, 2)
        outcome, reason = refuted(self.local.problem, r0, other, self.deadline)
        return self._answer(outcome, reason, other if outcome is LoadOutcome.REFUTED else None)

    def _answer(
        self, outcome: LoadOutcome, reason: str, other: PieceSolution | None = None
    ) -> LoadCertificate:
        certified = outcome is LoadOutcome.CERTIFIED
        branches = tuple(self._branch(proof) for proof in self.proofs) if certified else ()
        distance = max((proof.distance for proof in self.proofs), default=0.0) / self.size
        r0 = (self.known.r * self.local.to_r).reshape(-1, 2)
        return LoadCertificate(
            outcome, other, branches, r0, distance if certified else np.inf, self.examined,
            reason, now() - self.began,
        )  # fmt: skip

    def _branch(self, proof: BranchProof) -> LoadBranch:
        """The multipliers in the units of the problem: exact, units are powers of two."""
        unit = np.ones((self.local.contacts, proof.multipliers.shape[1]))
        unit[:, :2] = 1 / self.local.to_r.reshape(-1, 2)
        unit[:, 2:4] = 1 / self.local.to_u.reshape(-1, 2)
        W = proof.multipliers * unit[:, :, None] * unit[:, None, :]
        return LoadBranch(word(proof.branch), W)
