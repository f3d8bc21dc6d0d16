"""How a step comes about: along the path of solutions from the last state, or not.

From one step to the next loads, prescribed displacements and the memory of the last motion
change together,

    load (1 - p) load_0 + p load_1,   s = x - x_0 + (1 - p) V,   V = (t_1 - t_0) x'_0,       (1)

so that the last state solves the problem at p = 0, with its contacts slipping as they did, and
a solution at p = 1 is one of the step ([LR] section 2, and section 3 for contact).  Where the
path turns back the load has a greatest value up to which the body follows it steadily: there
it jumps.  The step takes the solution at which the path first arrives at p = 1.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import NotConverged, SingularOperator
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.contract import Breakdown, Iterate
from ..model.large_deformation import LargeDeformation

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Arrival:
    """Where a path first arrives: r (nc, d), v (n,), and the shares p at which it turned."""

    r: Array
    v: Array | None
    folds: tuple[float, ...]
    branch: Any = None  # the whole path, a Branch, where it was asked for


class Crossing(Protocol):
    """Follows paths from one step to the next; `amontons.PathCrossing` is one.

    Both raise Breakdown with the reason where the path does not lead to p = 1.
    """

    def between(
        self, before: FrictionProblem, step: FrictionProblem, r: Array, deadline: Deadline
    ) -> Arrival:
        """From reactions r of the problem at p = 0 to the step."""
        ...

    def along(self, step: LargeDeformation, drift: Array, deadline: Deadline) -> Arrival:
        """From `step.known` to the step; drift (nc, d): V."""
        ...


@dataclass(frozen=True)
class Passage:
    """The path of one step.

    folds: times at which it turned; arrived: False where the path does not lead to the step,
    whose solution then comes from a solver alone, and may be another one.  branch: the whole
    path where the crossing was to go on beyond the step: `branch.at(1)` are all solutions of
    the step on it.
    """

    folds: tuple[float, ...]
    arrived: bool
    reason: str = ""
    branch: Any = None

    @property
    def jumped(self) -> bool:
        """True where the path turned: no steady motion leads on from the last state."""
        return bool(self.folds)

    def __str__(self) -> str:
        if not self.arrived:
            return f"no path leads from the last step to this one: {self.reason}"
        if not self.folds:
            return "followed the path, without a fold"
        times = ", ".join(f"{t:.6g}" for t in self.folds)
        return f"jumped at t = {self.folds[0]:.6g}: the path has folds at t = {times}"

    def told(self, solution: FrictionSolution) -> FrictionSolution:
        """The solution with these words in its record."""
        record = solution.convergence
        detail = f"{record.detail}; {self}" if record.detail else str(self)
        return replace(solution, convergence=replace(record, detail=detail))


def taken(
    solve: Callable[[Iterate], FrictionSolution], arrive: Callable[[], Arrival] | None,
    r: Array, times: tuple[float, float],
) -> tuple[FrictionSolution, Passage | None]:  # fmt: skip
    """The solution of a step between two times, begun where its path arrives if any.

    r (nc, d): reactions of the last state; solve(start) finds the solution.  NotConverged says
    what became of the path, too.
    """
    if arrive is None:
        return solve(Iterate(r)), None
    start, passage = _passed(arrive, r, times)
    try:
        return passage.told(solve(start)), passage
    except NotConverged as failure:
        raise type(failure)(f"{failure} ({passage})", failure.solution) from failure


def _passed(
    arrive: Callable[[], Arrival], r: Array, times: tuple[float, float]
) -> tuple[Iterate, Passage]:
    try:
        found = arrive()
    except (Breakdown, SingularOperator) as reason:
        return Iterate(r), Passage((), False, str(reason))
    before, after = times
    folds = tuple(before + share * (after - before) for share in found.folds)
    return Iterate(found.r, found.v), Passage(folds, True, branch=found.branch)
