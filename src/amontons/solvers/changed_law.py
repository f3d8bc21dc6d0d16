"""Laws that are changes of variables (`problem.law.changed`): solved in s, told in r."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..problem.friction import FrictionProblem
from ..problem.plain import plain_motion
from ..problem.protocol import Problem
from ..problem.solution import FrictionSolution
from .asked import Asked, Callback
from .contract import Iterate
from .first_iterate import first_iterate

Array = NDArray[np.float64]
Solve = Callable[[Any, Any, Any], FrictionSolution]  # problem, options, start


def changed_law(problem: Problem, given: Asked, start: Any, solve: Solve) -> FrictionSolution:
    """The solution of a problem whose `plain` one is another; given: options of the driver."""
    asked = replace(given, callback=_released_callback(problem, given.callback))
    found = solve(problem.plain, asked, _pressed(problem, start))
    return _released(problem, found)


def _pressed(problem: Problem, start: Any) -> Iterate | None:
    """What a user gives as a start, for `problem.plain`."""
    if start is None:
        return None
    given = first_iterate(problem, start)
    v = given.v
    if isinstance(problem, FrictionProblem):
        v = plain_motion(problem, given.r, v)
    return replace(given, r=problem.law.pressed(given.r), v=v)


def _released_callback(problem: Problem, callback: Callback | None) -> Callback | None:
    """A callback of `problem.plain` that hands the iterates of the problem on."""
    if not callable(callback):  # what is wrong is refused by the driver
        return callback
    return lambda step, iterate: callback(step, replace(
        iterate, r=problem.law.released(iterate.r), v=_own(problem, iterate.v)
    ))  # fmt: skip


def _released(problem: Problem, found: FrictionSolution) -> FrictionSolution:
    """The solution of a problem from that of its `plain` one."""
    r = problem.law.released(found.r)
    told = None if found.settled is None else found.settled._replace(r=r)
    u = problem.law.unstretched(found.u, r)
    return replace(
        found, problem=problem, r=r, u=u, v=_own(problem, found.v), settled=told
    )


def _own(problem: Problem, v: Array | None) -> Array | None:
    """v of a problem from that of its `plain` one, which may have springs of contacts."""
    return v[: problem.unknowns] if v is not None and problem.has_v else None
