"""Newton's method for problems whose linearisation is a whole problem of contact.

Each step solves the tangent problem at the last state, with the law of contact as it is, by
whatever method that takes.  Where steps lead nowhere the load grows in parts from a state that
is known.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...core.options import check_options
from ...problem.friction import FrictionProblem
from ...problem.protocol import Problem
from ..contract import Breakdown, Iterate, Patience, Target, check_at_least, check_positive

Array = NDArray[np.float64]
INNER = 0.1  # tolerance of tangent problems, relative to that of the whole
LOOSE = 1e-5  # error at which a part of the load is good enough to go on
WILL_DO = 1e-4  # error up to which a tangent problem that is not solved is of use
EASY = 8  # steps up to which the next part of the load may be larger


class TangentProblem(Problem):
    """What the method asks for besides `Problem`."""

    def tangent(self, v: Array) -> FrictionProblem:
        """The linear problem with contact at a state v (n,)."""
        raise NotImplementedError

    def towards(self, goal: Any, v: Array) -> FrictionProblem:
        """The linear problem at a state v of this problem, under the load of another."""
        raise NotImplementedError

    def at_share(self, share: float) -> Any:
        """The problem at a share of the load between the known state and the whole load."""
        raise NotImplementedError

    @property
    def known_state(self) -> Array:
        """The state at share 0."""
        raise NotImplementedError


@dataclass(frozen=True)
class TangentNewton:
    """The method for bodies that yield."""

    patience: int = 8  # steps without halving the error before the part of the load is cut
    smallest_share: float = 1e-3  # of the load in one part

    solves: ClassVar[tuple[type, ...]] = (TangentProblem,)
    matrix_free: ClassVar[bool] = True
    changes_method: ClassVar[bool] = True  # a state that comes back is not the end

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, patience=self.patience)
        check_positive(smallest_share=self.smallest_share)

    def iterates(
        self, problem: TangentProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Steps at the whole load, else at growing parts of it from the known state.

        Those at parts are not shown to the driver.
        """
        r, v = start.r, problem.known_state if start.v is None else start.v
        r_new, v_new = r, v
        known = np.zeros_like(r), problem.known_state
        share, step, reason, hidden, given = 0.0, 1.0, "", 0, start.v is not None
        while True:
            if step < self.smallest_share:
                raise Breakdown(
                    f"no equilibrium found beyond {share:.4g} of the load: {reason}"
                )
            goal = min(1.0, share + step)
            now = problem if goal == 1.0 else problem.at_share(goal)
            count = 0
            try:
                if not given:  # what supports move would yield alone
                    r, v = solved(problem.at_share(share).towards(now, v), r, target)
                for r_new, v_new, error in self._steps(now, r, v, target):
                    count += 1
                    if goal == 1.0:
                        yield Iterate(r_new, v_new, iterations=1 + hidden)
                        hidden = 0
                    elif error <= LOOSE:
                        break
            except (_Failed, SingularOperator) as failure:
                reason, step = str(failure), step / (4 if share == 0 and step == 1.0 else 2)
                (r, v), given = known, False
                continue
            known = r, v = r_new, v_new
            share, hidden = goal, hidden + count
            step *= 2 if count <= EASY else 1

    def _steps(
        self, problem: TangentProblem, r: Array, v: Array, target: Target
    ) -> Iterator[tuple[Array, Array, float]]:
        """(r, v, error) of Newton steps without end; _Failed when they lead nowhere."""
        patience = Patience(self.patience)
        while not target.deadline.passed:
            r, v = solved(problem.tangent(v), r, target)
            error = problem.error(r, v)
            if not np.isfinite(error) or patience.over(error):
                raise _Failed("Newton's steps no longer reduce the error")
            yield r, v, error
        raise Breakdown("out of time between two steps")


def solved(tangent: FrictionProblem, r: Array, target: Target) -> tuple[Array, Array]:
    """(r, v) of a tangent problem, from reactions r (nc, d); _Failed where it is not solved."""
    from ..driver import drive  # which takes this method, too

    tolerance = INNER * target.tolerance
    found = drive(tangent, tolerance=tolerance, start=Iterate(r), time_limit=_seconds(target))
    if not found.convergence.error <= max(WILL_DO, tolerance):
        raise _Failed(f"a tangent problem was not solved ({found.convergence.outcome.value})")
    v = found.v if found.v is not None else tangent.velocity(found.r)[1]
    assert v is not None
    return found.r, v


def _seconds(target: Target) -> float | None:
    left = target.seconds_left
    return None if left == np.inf else max(left, 1e-9)


class _Failed(Exception):
    """The Newton steps of one part of the load lead nowhere."""
