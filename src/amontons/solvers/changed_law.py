"""Laws that are changes of variables (`problem.law.changed`): solved in s, told in r."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..problem.protocol import Problem
from ..problem.solution import FrictionSolution
from .contract import Iterate
from .first_iterate import first_iterate

Callback = Callable[[Any, Iterate], bool | None]


def pressed_start(problem: Problem, start: Any) -> Iterate | None:
    """What a user gives as a start, for `problem.plain`."""
    if start is None:
        return None
    given = first_iterate(problem, start)
    v = given.v if problem.plain.has_v else None
    return replace(given, r=problem.law.pressed(given.r), v=v)


def released_callback(problem: Problem, callback: Callback | None) -> Callback | None:
    """A callback of `problem.plain` that hands the iterates of the problem on."""
    if not callable(callback):  # what is wrong is refused by the driver
        return callback
    return lambda step, iterate: callback(
        step, replace(iterate, r=problem.law.released(iterate.r))
    )


def released(problem: Problem, found: FrictionSolution) -> FrictionSolution:
    """The solution of a problem from that of its `plain` one."""
    r = problem.law.released(found.r)
    told = None if found.settled is None else found.settled._replace(r=r)
    if found.problem.has_v is not problem.has_v:  # a compliance needs the Delassus form
        of, u, v = problem.recover(r)
        return replace(found, problem=of, r=r, u=u, v=v, settled=told)
    u = problem.law.unstretched(found.u, r)
    return replace(found, problem=problem, r=r, u=u, settled=told)
