"""Who solves the problems of a step: sweeps first, then solvers, or one that is asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import Interrupted, NotConverged
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution
from ...solvers.asked import Asked
from ...solvers.contract import Iterate, Solver
from ...solvers.driver import drive_as_asked
from .guides import Guides, least_squeezed
from .met import Met
from .quick import Found, Posed
from .rows import Mobility
from .sweeping import Search, found_quickly

Array = NDArray[np.float64]
Solved = Found | FrictionSolution


@dataclass(frozen=True, eq=False)
class Solving:
    """How the steps of a system are solved; check: raise NotConverged where they are not."""

    mu: float
    guides: Guides | None
    asked: Asked
    solver: Solver | None
    check: bool

    def search(
        self, at: Met, mobility: Mobility, posed: Posed, mu: float | None = None
    ) -> Search:
        """For impulses of rows with that mobility; mu: in place of the system's."""
        mu = self.mu if mu is None else mu
        return Search(posed, at.rows, mobility, len(at.keys), mu, self.asked.tolerance)

    def sought(self, search: Search, deadline: Deadline) -> Found | None:
        """What sweeps alone find; None where a solver is asked for, or time counted or over.

        Solvers then start from the best impulses: none where the last ones are worse.
        """
        if self.solver is None and not _timed(deadline):
            return found_quickly(search)[0]
        for start in (search.posed.start, np.zeros_like(search.posed.start)):
            search.offer(start)
        return None

    def solve(
        self, search: Search, what: str, deadline: Deadline, enough: float = 0.0
    ) -> Solved:
        """By sweeps alone where these are enough; what, enough: see `judged`."""
        found = self.sought(search, deadline)
        if found is not None:
            return found
        return self.judged(self.driven(search.problem, search.r, deadline), what, enough)

    def tried(self, search: Search, deadline: Deadline, solvers: bool) -> Solved | None:
        """The same where it need not be solved; solvers: also by those not asked for."""
        found = self.sought(search, deadline)
        if found is not None or not (solvers or self.solver is not None or _timed(deadline)):
            return found
        solution = self.driven(search.problem, search.r, deadline)
        return solution if solution.converged else None

    def driven(self, problem: Problem, start: Array, deadline: Deadline) -> FrictionSolution:
        """What solvers make of a problem from a start (n, d)."""
        asked = self.asked
        asked = asked if deadline is NEVER else replace(asked, time_limit=deadline)
        return drive_as_asked(problem, asked, Iterate(start), self.solver)

    def judged(
        self, solution: FrictionSolution, what: str, enough: float = 0.0
    ) -> FrictionSolution:
        """The solution; raises NotConverged, with `what` it was of, where asked to.

        enough: an error that does where the tolerance is not reached.
        """
        record = solution.convergence
        missed = not solution.converged and (record.by_user or record.error > enough)
        if self.check and missed:
            kind = Interrupted if record.by_user else NotConverged
            raise kind(f"{what}: {record}. {record.advice}", solution)
        return solution

    def unsqueezed(
        self, at: Met, mobility: Mobility, posed: Posed, deadline: Deadline
    ) -> Posed:
        """Started without squeeze between planes; as it is where work is counted or over."""
        nc, mu = len(at.keys), self.mu
        if mu == 0 or self.guides is None or _timed(deadline):
            return posed
        if not self.guides.hold(at.rows, nc, len(mobility[0])):
            return posed
        return least_squeezed(at.rows, mobility, posed, nc, mu, self.asked.tolerance)


def leaves(solved: Solved, tolerance: float) -> float:
    """The error in velocity that a tolerance allows, all of which one contact may have."""
    q = solved.posed.q if isinstance(solved, Found) else np.asarray(solved.problem.q)[:, :3]
    return tolerance * float(np.linalg.norm(q))


def _timed(deadline: Deadline) -> bool:
    """True where work is counted, or time is over."""
    return deadline is not NEVER and (deadline.work is not None or deadline.passed)
