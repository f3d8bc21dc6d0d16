"""What may be found out beside a solve that nobody asked for: a fifth of its operations."""

from __future__ import annotations

from ..core.clock import RATE, Deadline
from ..problem.friction import FrictionProblem
from ..problem.solution import Convergence

SHARE = 0.2  # of the operations of a solve
QUICK = 400  # rows of W up to which more is allowed always: some ten milliseconds
BOUND_WORK = 7.0  # operations of the cheapest bound on friction per cube of the rows
QUICK_SECONDS = 1.0  # whose work questions about so few rows may take


def operations_of(record: Convergence) -> float:
    """Of a solve: counted, or as many as its seconds are good for."""
    return record.flops if record.flops is not None else record.seconds * RATE


def rows_of(problem: FrictionProblem) -> int:
    """Of W."""
    return problem.contacts * problem.dimension


def allowed(problem: FrictionProblem, spent: float) -> float:
    """Operations that may be spent beside a solve that took `spent`."""
    return max(SHARE * spent, BOUND_WORK * float(min(rows_of(problem), QUICK)) ** 3)


def quick_deadline(problem: FrictionProblem, spent: float) -> Deadline:
    """When these have been spent."""
    least = QUICK_SECONDS if rows_of(problem) <= QUICK else 0.0
    return Deadline.counted(max(least, allowed(problem, spent) / RATE))
