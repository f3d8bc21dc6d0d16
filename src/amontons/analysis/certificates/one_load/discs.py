"""Is a solution of a 3D Coulomb problem the only one for its load?  A certificate, or another.

The whole problem is one region about the given solution first: multipliers on friction discs
(`discs.multipliers`) that leave no other.  Where there are none, Newton's method looks for
another solution from many starts, and then the regions are divided (`discs.search`) until one
is found or all are closed.  Solutions within 1e-10 (scaled) of each other count as one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline, TimeLimit, deadline_of, now
from ....core.errors import InvalidInput, TimeUp
from ....problem.friction import FrictionProblem
from ....problem.solution import FrictionSolution
from ...solutions.discs.search import DiscSearch
from ...solutions.discs.sets import ON
from ...solutions.enumerate import PieceSolution
from ...solutions.multistart import Finder, described
from ...solutions.newton_batch import Stack
from .answer import (
    SECONDS,
    LoadCertificate,
    LoadOutcome,
    proved_on,
    reactions_of,
    refuted,
    stopped,
    without_search,
)
from .known import not_a_solution

Array = NDArray[np.float64]
TOLERANCE = 1e-8  # error by the judge of a solution
POLISHED = 10.0  # operations of refining the solution per cube of the reactions
FINDING = 0.2  # share of the time left that may go into looking for another solution


def certify_load_discs(
    problem: FrictionProblem, solution: FrictionSolution | PieceSolution, *,
    time_limit: TimeLimit = None,
) -> LoadCertificate:  # fmt: skip
    """Certificate that a 3D Coulomb problem has no solution but the given one, or another one.

    time_limit: seconds, after which the answer is undecided; without it operations are counted,
    as many as take about SECONDS.  The branches of the certificate are of the type `DiscBox`.
     The global form is condensed.  Raises UnsupportedForm under
    Tresca's law, InvalidInput where `solution` does not solve the problem.
    """
    deadline, began = deadline_of(time_limit, SECONDS), now()
    r = reactions_of(problem, solution)
    try:
        local = problem.condensed(deadline)
    except TimeUp as reason:
        return stopped(r, reason, began)
    return _Certification(local, r, deadline, began).run()


class _Certification:
    """The search of one certificate."""

    def __init__(
        self, local: FrictionProblem, r: Array, deadline: Deadline, began: float
    ) -> None:
        self.began, self.deadline, self.local, self.r = began, deadline, local, r
        self.examined = 0
        self.search: DiscSearch | None = None

    def run(self) -> LoadCertificate:
        """Root, other solutions, regions, as far as time allows."""
        try:
            return self._run()
        except TimeUp as reason:
            return self._answer(LoadOutcome.UNDECIDED, str(reason))

    def _run(self) -> LoadCertificate:
        if at_once := without_search(self.local):
            return self._answer(*at_once)
        self.deadline.pay(POLISHED * (3.0 * self.local.contacts) ** 3)
        stack = Stack.of(self.local)
        r, _ = stack.polished(self.r / stack.to_r)
        finder = Finder(stack, np.random.default_rng(0), TOLERANCE)
        near = np.abs(r - self.r / stack.to_r).max() <= 1e-4 * (1 + np.abs(r).max())
        if not near or not finder.add(r):
            raise not_a_solution(self.local, self.r)
        search = self.search = DiscSearch(stack, finder, self.deadline)
        self.r = r * stack.to_r
        if not search.queue:
            raise InvalidInput("solution: a contact that can not react penetrates")
        if search.affords_step:
            search.step()
        if not search.complete:
            search.begin(self.deadline.share(FINDING))
            search.run(most_solutions=2)
        others = [other for other in finder.found if np.abs(other - finder.found[0]).max() > ON]
        if others:
            other = described(stack, others[0])
            outcome, reason = refuted(self.local, self.r, other, self.deadline)
            return self._answer(
                outcome, reason, other if outcome is LoadOutcome.REFUTED else None
            )
        if search.complete:
            reason = proved_on(len(search.proofs) + len(search.linear))
            return self._answer(LoadOutcome.CERTIFIED, reason)
        return self._answer(LoadOutcome.UNDECIDED, search.reason)

    def _answer(
        self, outcome: LoadOutcome, reason: str, other: PieceSolution | None = None
    ) -> LoadCertificate:
        certified = outcome is LoadOutcome.CERTIFIED
        proof = self.search.proof() if self.search is not None and certified else None
        examined = 0 if self.search is None else self.search.examined
        distance = np.inf
        if certified:
            distance = ON if self.search is None else self.search.resolution
        return LoadCertificate(
            outcome, other, () if proof is None else proof.boxes, self.r, distance, examined,
            reason, now() - self.began,
        )  # fmt: skip
