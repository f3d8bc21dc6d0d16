"""One run of an active set method, and what the paper counts of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
    """Steps until k > k_f and |u^k - u^kc| / |u^k| is below `change`, at most `limit`."""
    seen: list = []

    def note(step, iterate) -> None:
        seen.append((step, iterate))

    solution = am.drive(
        problem, replace(solver, change=change), tolerance=NEVER, max_iterations=limit,
        start=start, callback=note,
    )  # fmt: skip
    steps, iterates = zip(*seen, strict=True)
    sets = [step.sets for step in steps]
    return Run(
        solution, [s.normal for s in sets], [s.tangential for s in sets],
        solution.convergence.sets_settled, sum(it.linear_iterations for it in iterates),
        [s.change for s in sets], [step.error for step in steps], bool(iterates[-1].ends),
        list(iterates),
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
