"""Crossing a jump: where load steps end at a fold, the solution path leads on to the load.

[LR] section 3: the steps of an evolution are joined by a path of solutions, also where the next
solution is far away.  The rule is to take the solution at which the path first arrives: what
lies behind a fold belongs to falling loads and is no state that the body passes slowly, so the
jump says where, and not how, it lands.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput
from ...core.options import check_options
from ...mechanics.model.large_deformation import LargeDeformation
from ...mechanics.steps.passage import Arrival
from ...problem.friction import FrictionProblem
from ...solvers.contract import Breakdown, Target
from .continuation import Continuation
from .following import Limits, follow_along
from .friction_path import FrictionPath
from .load_path import LoadPath
from .path import Branch
from .starting import polished
from .tangents import Tangent
from .ways import way_of

Array = NDArray[np.float64]
BEFORE = (1e-4, 1e-3, 1e-2, 0.1)  # shares before the one at which load steps ended


@dataclass(frozen=True)
class PathCrossing:
    """Follows the path of a step over its folds to the state at which it first arrives.

    As `QuasiStatic(step, crossing=...)` it does so in every step, with the memory of the last
    motion; as `NonlinearNewton(crossing=...)` where load steps end.

    options: those of steps along paths that are not straight; max_points of a path; back: how
    far it may lead back, in steps: small steps meet the second fold of a jump far behind;
    ahead: how far beyond the step, in steps, it is followed for all solutions of the step that
    it reaches: then `Arrival.branch` and `Passage.branch` are that path, `branch.at(1)` these.
    """

    options: Continuation = Continuation()
    max_points: int = 2000
    back: float = 1000.0
    ahead: float = 0.0

    def __post_init__(self) -> None:
        check_options(self)
        if self.max_points < 2:
            raise InvalidInput(f"max_points: expected at least 2, got {self.max_points}")
        if not 0 < self.back < np.inf:
            raise InvalidInput(f"back: expected a number of steps > 0, got {self.back}")
        if not 0 <= self.ahead < np.inf:
            raise InvalidInput(f"ahead: expected a number of steps >= 0, got {self.ahead}")

    def between(
        self, before: FrictionProblem, step: FrictionProblem, r: Array,
        deadline: Deadline = NEVER,
    ) -> Arrival:  # fmt: skip
        """From reactions r (nc, d) of the problem at p = 0 to the step at p = 1.

        Raises Breakdown with the reason where the path does not lead there.
        """
        path = FrictionPath(before, step)
        y, folds, branch = self._reached(path, _start(path, path.state(r)), deadline)
        found = (y * path.to_r).reshape(r.shape)
        return Arrival(found, step.velocity(found)[1], folds, branch)

    def along(
        self, step: LargeDeformation, drift: Array, deadline: Deadline = NEVER
    ) -> Arrival:
        """From the state that a step knows to the step; drift (nc, d): V of the memory.

        Raises Breakdown like `between`, UnsupportedLaw under Tresca's law.
        """
        load, prescribed, v = step.known  # type: ignore[misc]
        path = LoadPath(step, load, prescribed, drift)
        y, folds, branch = self._reached(path, _start(path, v), deadline)
        return Arrival(path.step.reactions(y), y, folds, branch)

    def across(
        self, problem: LargeDeformation, share: float, v: Array, target: Target
    ) -> tuple[Array, str]:
        """(state at the whole load, what was passed) from a state at a share of the load.

        Raises Breakdown with the reason where the path does not lead there.
        """
        nothing = (0.0 * problem.load, np.zeros_like(problem.prescribed))
        load, prescribed = nothing if problem.known is None else problem.known[:2]
        path = LoadPath(problem, load, prescribed)
        limit = NEVER.within(target.seconds_left)
        y, folds = self._arrived(path, *_on_path(path, v, share), limit)
        return y, _told(folds)

    def _reached(
        self, path: FrictionPath | LoadPath, y: Array, deadline: Deadline
    ) -> tuple[Array, tuple[float, ...], Branch | None]:
        """(state where the path first arrives, folds on the way, the path beyond or None)."""
        if self.ahead == 0:
            return *self._arrived(path, y, 0.0, deadline), None
        left = deadline.left if np.isfinite(deadline.moment) else None
        limits = Limits((-self.back, 1.0 + self.ahead), self.max_points, left)
        onward = self._onward(path, y, 0.0)
        branch = follow_along(path, y, 0.0, limits, onward, self.options)
        found = branch.at(1.0)
        if not found:
            reason = branch.stops[1].advice
            raise Breakdown(f"the path of the load does not lead to its end: {reason}")
        first = next(
            a for a, b in pairwise(branch) if (a.parameter - 1) * (b.parameter - 1) <= 0
        )
        folds = (e.parameter for e in branch.folds if e.arclength <= first.arclength)
        return found[0], tuple(folds), branch

    def _onward(self, path: FrictionPath | LoadPath, y: Array, share: float) -> Tangent:
        """The tangent along which the load grows; raises Breakdown where there is none."""
        system = way_of(path, self.options).leaving(path, y, share)
        onward = [t for t in system.tangents if t.rate > 0]
        if not onward:
            raise Breakdown(f"from {share:.6g} of the load none leads on")
        return onward[0]

    def _arrived(
        self, path: FrictionPath | LoadPath, y: Array, share: float,
        deadline: Deadline,
    ) -> tuple[Array, tuple[float, ...]]:  # fmt: skip
        """(state at share 1, folds on the way) along the path from a solution."""
        way, onward = way_of(path, self.options), self._onward(path, y, share)
        folds: list[float] = []
        followed = share
        walk = way.steps(path, y, share, onward, (-self.back, 1.0))
        for count, (point, event) in enumerate(walk):
            if event is not None and event.is_fold:
                folds.append(event.parameter)
            if event is not None and event.stop is not None:
                if point.parameter == 1.0:
                    return point.state, tuple(folds)
                raise Breakdown(
                    f"the path of the load ends at {point.parameter:.4g} of it: "
                    f"{event.stop.advice}"
                )
            followed = point.parameter
            if count >= self.max_points or deadline.passed:
                break
        raise Breakdown(f"the path of the load was followed to {followed:.4g} of it only")


def _start(path: FrictionPath | LoadPath, y: Array) -> Array:
    """The exact solution beside the last state."""
    try:
        return polished(path, y, 0.0)
    except InvalidInput as reason:
        raise Breakdown(f"the last state does not begin a path: {reason}") from reason


def _on_path(path: LoadPath, v: Array, share: float) -> tuple[Array, float]:
    """A solution at or just before a share: load steps end loosely, maybe behind the fold."""
    reason: InvalidInput | None = None
    for back in (0.0, *BEFORE):
        try:
            return polished(path, v, share - back), share - back
        except InvalidInput as error:
            reason = error
    raise Breakdown(f"the path of the load: {reason}") from reason


def _told(folds: tuple[float, ...]) -> str:
    shares = ", ".join(f"{fold:.6g}" for fold in folds)
    way = f"over folds at {shares} of the load: a jump" if folds else "without a fold"
    return f"followed the path {way}"
