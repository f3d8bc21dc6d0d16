"""The first iterate: what a user gives as a start, checked, or none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..core.errors import InvalidInput
from ..problem.judge.measures import Measure
from ..problem.protocol import Problem
from .contract import Iterate


def first_iterate(problem: Problem, start: Any) -> Iterate:
    """What a problem begins with, or a copy of r and v of an Iterate or a solution.

    Without load no reactions are a solution, and errors, relative to it, of all others
    infinite: solvers can not go down from these.
    """
    if start is not None and not (hasattr(start, "r") and hasattr(start, "v")):
        raise InvalidInput(
            f"expected a solution or an Iterate, got {type(start).__name__}", ("start",)
        )
    r, v = problem.start(start)
    q = getattr(problem, "q", None)
    if q is not None and not np.any(q):
        r[:] = 0.0
    return Iterate(r, v, 0)


def with_motion(problem: Problem, start: Iterate) -> Iterate:
    """The start with some v where finding that of its r would cost a linear solve."""
    if start.v is not None or problem.measure is Measure.EXACT:
        return start
    guess = problem.guess
    return replace(start, v=guess if guess is not None else np.zeros(problem.unknowns))


def own_motion(problem: Problem, iterate: Iterate) -> Iterate:
    """The iterate without its v where the motion of its r costs little: that one is taken."""
    if iterate.v is None or problem.measure is not Measure.EXACT:
        return iterate
    return replace(iterate, v=None)


def as_it_is(problem: Problem, iterate: Iterate) -> Iterate:
    """The iterate with the v that it has."""
    return iterate
