"""The first iterate: what a user gives as a start, checked, or none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.arrays import real
from ..core.errors import InvalidInput
from ..problem.friction import Form, FrictionProblem
from ..problem.judge.measures import Measure
from ..problem.nitsche import NitscheProblem
from .contract import Iterate

Array = NDArray[np.float64]


def no_reactions(problem: FrictionProblem) -> Array:
    """r = 0, (nc, d)."""
    return np.zeros((problem.contacts, problem.dimension))


def first_iterate(problem: FrictionProblem | NitscheProblem, start: Any) -> Iterate:
    """Zero reactions, or a copy of r and v of what the user gives: an Iterate or a solution."""
    if start is None:
        if isinstance(problem, NitscheProblem):
            return _start_of_nitsche(problem, None)
        return Iterate(no_reactions(problem), None, 0)
    if not hasattr(start, "r") or not hasattr(start, "v"):
        raise InvalidInput(
            f"start: expected a solution or an Iterate, got {type(start).__name__}"
        )
    if isinstance(problem, NitscheProblem):
        return _start_of_nitsche(problem, start.v)
    r = real("start: r", start.r)
    if r.shape != (problem.contacts, problem.dimension):
        raise InvalidInput(
            f"start: expected r of shape {(problem.contacts, problem.dimension)}, got {r.shape}"
        )
    if not np.isfinite(r).all():
        raise InvalidInput("start: r holds a number that is not finite")
    if start.v is None or problem.form is not Form.GLOBAL:
        return Iterate(r, None, 0)
    return Iterate(r, _motion(start.v, problem.unknowns), 0)


def _start_of_nitsche(problem: NitscheProblem, v: Array | None) -> Iterate:
    """The displacements v (n,) of a start; its reactions may be those of another method."""
    v = problem.guess if v is None else _motion(v, problem.unknowns)
    return Iterate(problem.reaction(v), v, 0)


def _motion(v: ArrayLike, n: int) -> Array:
    """A copy of v, (n,), of a start."""
    v = real("start: v", v)
    if v.shape != (n,):
        raise InvalidInput(f"start: expected v of {n} entries, got {v.size}")
    if not np.isfinite(v).all():
        raise InvalidInput("start: v holds a number that is not finite")
    return v


def with_motion(problem: FrictionProblem | NitscheProblem, start: Iterate) -> Iterate:
    """The start with some v where finding that of its r would cost a linear solve."""
    if start.v is not None or problem.measure is Measure.EXACT:
        return start
    guess = problem.guess  # also of the problems of large deformations
    return replace(start, v=guess if guess is not None else np.zeros(problem.unknowns))


def own_motion(problem: FrictionProblem | NitscheProblem, iterate: Iterate) -> Iterate:
    """The iterate without its v where the motion of its r costs little: that one is taken."""
    if iterate.v is None or problem.measure is not Measure.EXACT:
        return iterate
    return replace(iterate, v=None)


def as_it_is(problem: FrictionProblem | NitscheProblem, iterate: Iterate) -> Iterate:
    """The iterate with the v that it has."""
    return iterate
