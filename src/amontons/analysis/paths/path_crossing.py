"""Crossing a jump: where load steps end at a fold, the solution path leads on to the load.

[LR] section 3: the steps of an evolution are joined by a path of solutions, also where the next
solution is far away.  The rule is to take the solution at which the path first arrives: what
lies behind a fold belongs to falling loads and is no state that the body passes slowly, so the
jump says where, and not how, it lands.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InvalidInput
from ...model.large_deformation import LargeDeformation
from ...solvers.base import Breakdown, Target
from .continuation import Continuation
from .following import polished
from .load_path import LoadPath
from .path import EventKind

Array = NDArray[np.float64]
BEFORE = (1e-4, 1e-3, 1e-2, 0.1)  # shares before the one at which load steps ended
BACK = -1.0  # share of the load down to which a path may lead back


@dataclass(frozen=True)
class PathCrossing:
    """Follows the path of a load step over its folds: a field of `NonlinearNewton`."""

    options: Continuation = Continuation()
    max_points: int = 2000

    def across(
        self, problem: LargeDeformation, share: float, v: Array, target: Target
    ) -> tuple[Array, str]:
        """(state at the whole load, what was passed) from a state at a share of the load.

        Raises Breakdown with the reason where the path does not lead there.
        """
        nothing = (np.zeros_like(problem.load), np.zeros_like(problem.prescribed))
        load, prescribed = nothing if problem.known is None else problem.known[:2]
        path = LoadPath(problem, load, prescribed)
        y, share = _on_path(path, v, share)
        tangents = [t for t in self.options.start(path, y, share) if t.rate > 0]
        if not tangents:
            raise Breakdown(f"no path leads on from {share:.6g} of the load")
        folds: list[float] = []
        walk = self.options.walk(path, y, share, tangents[0], (BACK, 1.0))
        for count, (point, event) in enumerate(walk):
            if event is not None and event.kind is EventKind.FOLD:
                folds.append(event.parameter)
            if event is not None and event.stop is not None:
                if point.parameter == 1.0:
                    return point.state, _told(folds)
                raise Breakdown(
                    f"the path of the load ends at {point.parameter:.4g} of it: "
                    f"{event.stop.advice}"
                )
            if count >= self.max_points or target.seconds_left <= 0:
                break
        raise Breakdown(
            f"the path of the load was followed to {point.parameter:.4g} of it only"
        )


def _on_path(path: LoadPath, v: Array, share: float) -> tuple[Array, float]:
    """A solution at or just before a share: load steps end loosely, maybe behind the fold."""
    for back in (0.0, *BEFORE):
        try:
            return polished(path, v, share - back), share - back
        except InvalidInput as error:
            reason = error
    raise Breakdown(f"the path of the load: {reason}") from reason


def _told(folds: list[float]) -> str:
    shares = ", ".join(f"{fold:.6g}" for fold in folds)
    way = f"over folds at {shares} of the load: a jump" if folds else "without a fold"
    return f"followed the path {way}"
