"""How much of a Newton step of `NonlinearNewton` is taken, and where that leads nowhere.

By |F|: halving until it falls below the largest of the last few values.  By the natural
monotonicity test of [D], section 3.3, where problems give a `shortest` length: halving until
the step that the same matrix asks for at the new state is shorter,

    |A^-1 F(v + t dv)| <= (1 - NATURAL t) |dv|,                                             (1)

which does not change with the units of rows, while |F| hears most of the stiffest nodes.
Where no length does, the best one is told.  States with inverted cells are never taken.

[D] P. Deuflhard, "Newton methods for nonlinear problems", Springer (2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells
from ...linear.base import Factor
from .states import States

if TYPE_CHECKING:
    from .nonlinear import NonlinearProblem

Array = NDArray[np.float64]
MEMORY = 5  # values of |F| of which the largest counts in the line search
ENOUGH = 1e-4  # least relative decrease of |F| over a full step
NATURAL = 0.25  # of (1)


class Failed(Exception):
    """Newton's method does not converge at this load."""


def by_residual(
    states: States, w: Array, step: Array, sizes: Sequence[float], halvings: int
) -> float:
    """The part of a step to take; sizes: |F| of all states so far, that of w last."""
    allowed = max(sizes[-MEMORY:])
    best, found, reason = np.inf, 0.0, ""
    for k in range(halvings + 1):
        length = 0.5**k
        try:
            size = float(np.linalg.norm(states.residual(w + length * step)))
        except InvertedCells as why:
            reason = str(why)
            continue
        if size <= (1 - ENOUGH * length) * allowed:
            return length
        if size < best:
            best, found = size, length
    if not np.isfinite(best):
        raise Failed(f"every step leads to where {reason}")
    return found


def by_natural_test(
    problem: NonlinearProblem, states: States, w: Array, step: Array, factor: Factor,
    halvings: int,
) -> tuple[float, bool]:  # fmt: skip
    """(the part of a step to take, whether (1) holds), no shorter than `problem.shortest`."""
    size = float(np.linalg.norm(states.v(w + step) - states.v(w)))
    best, found, reason = np.inf, 0.0, ""
    for k in range(halvings + 1):
        length = 0.5**k
        if length < problem.shortest and np.isfinite(best):
            break
        try:
            F = states.missing(w + length * step)
        except InvertedCells as why:
            reason = str(why)
            continue
        again = float(np.linalg.norm(factor.solve(-F)))
        if again <= (1 - NATURAL * length) * size:
            return length, True
        if again < best:
            best, found = again, length
    if not np.isfinite(best):
        raise Failed(f"every step leads to where {reason}")
    return found, False
