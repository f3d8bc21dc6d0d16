"""One run of an active set method, and what the paper counts of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import amontons as am

C = 100.0  # c_n and c_tau of the paper, with nodal forces as multipliers
NEVER = 1e-300  # tolerance of the driver: the paper stops by the change of u instead


@dataclass(frozen=True, eq=False)
class Run:
    """The steps k = 1, 2, … of a run that ended when the change of u fell below a tolerance.

    The paper does not name the norm; ours is the Euclidean one over the contact nodes (between
    two bodies: of relative displacements, the unknowns of the paper's basis).

    normal, tangential: numbers of active nodes |A_n|, |A_tau|; settled: K_l, the first step
    with the final sets, which are then kept; cycles: multigrid steps; finished: the change got
    there.
    """

    solution: am.FrictionSolution
    normal: list[int]
    tangential: list[int]
    settled: int
    cycles: int
    changes: list[float]
    errors: list[float]
    finished: bool
    iterates: list

    @property
    def steps(self) -> int:
        """k_max."""
        return len(self.normal)

    def record(self) -> dict:
        """The numbers, for a file."""
        return {
            "normal": self.normal, "tangential": self.tangential, "K": self.settled,
            "steps": self.steps, "cycles": self.cycles, "finished": self.finished,
            "changes": self.changes, "errors": self.errors,
        }  # fmt: skip


def run(
    problem: am.FrictionProblem, solver: am.ActiveSet, change: float, *,
    start: object = None, limit: int = 120,
) -> Run:  # fmt: skip
    """Steps until |u^k - u^k-1| / |u^k| is below `change`, at most `limit`."""
    seen: list = []
    errors: list[float] = []
    changes: list[float] = []
    v = None if start is None else start.v
    last = problem.H.T @ (np.zeros(problem.unknowns) if v is None else v)

    def note(step, iterate) -> bool:
        nonlocal last
        now = problem.H.T @ iterate.v
        size = max(float(np.linalg.norm(now)), np.finfo(float).tiny)
        changes.append(float(np.linalg.norm(now - last)) / size)
        last = now
        seen.append(iterate)
        errors.append(step.error)
        return len(seen) > 1 and changes[-1] < change  # k > k_f: not in the first step

    solution = am.drive(
        problem, solver, tolerance=NEVER, max_iterations=limit, start=start, callback=note
    )
    sets = [np.concatenate([it.normal, it.tangential]) for it in seen]
    settled = len(sets)
    while settled > 1 and np.array_equal(sets[settled - 2], sets[-1]):
        settled -= 1
    return Run(
        solution, [int(it.normal.sum()) for it in seen],
        [int(it.tangential.sum()) for it in seen], settled,
        sum(it.linear_iterations for it in seen), changes, errors,
        bool(seen) and changes[-1] < change, seen,
    )  # fmt: skip


def fixed_point(**options) -> am.ActiveSet:
    """Algorithms 1 and 2 with the W-cycle of the paper: exact unless `cycles` are given."""
    given = dict(
        bound=am.FrictionBound.FIXED_POINT, c_normal=C, c_tangential=C,
        multigrid=am.MultigridCycle(),
    )  # fmt: skip
    return am.ActiveSet(**(given | options))


INEXACT = {"cycles": 1}  # m = 1
NESTED = {"cycles": 1, "nested": True}
