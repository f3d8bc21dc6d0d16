"""What is answered about other solutions for the same load, in 2D and 3D, and when at once."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline, now
from ....core.errors import InvalidInput, TimeUp
from ....problem.friction import FrictionProblem
from ....problem.solution import FrictionSolution
from ...solutions.enumerate import PieceSolution
from ...solutions.existence import exist, takes_too_long

Array = NDArray[np.float64]
SECONDS = 60.0  # whose work a certificate without a time limit may take


class LoadOutcome(Enum):
    """What is known about other solutions for the same load."""

    CERTIFIED = "certified"  # there is no other
    REFUTED = "refuted"  # here is another
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class LoadBranch:
    """One part of a certificate: no other solution has statuses of this pattern.

    pattern: per contact f free, s stick, + or - slip, x slip, c closed, . anything.
    multipliers: (nc, 4, 4) for z - z0, or (nc, 5, 5) for (z, 1), z = (r_N, r_T, u_N, u_T), in
    the units of the problem.
    """

    pattern: str
    multipliers: Array


@dataclass(frozen=True, eq=False)
class LoadCertificate:
    """The answer of `certify_load`.

    other: a second solution where REFUTED.  branches: what proves CERTIFIED; together they have
    all patterns.  distance: bound of the difference of reactions to r0 (nc, 2), relative to
    the largest reaction or, if that is larger, to what the load can make.  examined:
    inequalities that were solved.
    """

    outcome: LoadOutcome
    other: PieceSolution | None
    branches: tuple[LoadBranch, ...]
    r0: Array
    distance: float
    examined: int
    reason: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.outcome.value}: {self.reason}"


def reactions_of(
    problem: FrictionProblem, solution: FrictionSolution | PieceSolution
) -> Array:
    """Reactions (nc, d) of a solution under Coulomb's law; raises for what can not be meant."""
    _ = problem.mu
    r, shape = np.asarray(solution.r), (problem.contacts, problem.dimension)
    if r.shape != shape:
        raise InvalidInput(f"solution: expected reactions {shape}, got {r.shape}")
    return r


def stopped(r: Array, reason: TimeUp, began: float) -> LoadCertificate:
    """The answer where time was up before the search began."""
    return LoadCertificate(LoadOutcome.UNDECIDED, None, (), r, np.inf, 0, str(reason),
                           now() - began)  # fmt: skip


def without_search(local: FrictionProblem) -> tuple[LoadOutcome, str] | None:
    """The answer and its reason where there is nothing to search, or no scale to measure by."""
    if not local.contacts:
        return LoadOutcome.CERTIFIED, "there is no contact"
    if local.q_norm == 0:
        return LoadOutcome.UNDECIDED, "q is zero: nothing sets a scale"
    return None


def proved_on(parts: int) -> str:
    """The reason of a certificate that has so many parts."""
    return "multipliers exclude all others" + (f" on {parts} parts" if parts > 1 else "")


def refuted(
    problem: FrictionProblem, r0: Array, other: PieceSolution, deadline: Deadline
) -> tuple[LoadOutcome, str]:
    """The answer where another solution was found, and its reason.

    REFUTED only if both are proved to exist (`existence`): a small error alone is none.
    """
    if takes_too_long(problem, 2, deadline):
        reason = f"there was no time to prove that {other.pattern} is another solution"
        return LoadOutcome.UNDECIDED, reason
    if not exist(problem, [r0, other.r], deadline):
        reason = f"rounding of W, q and mu decides whether {other.pattern} is another solution"
        return LoadOutcome.UNDECIDED, reason
    return LoadOutcome.REFUTED, f"another solution is {other.pattern}"
