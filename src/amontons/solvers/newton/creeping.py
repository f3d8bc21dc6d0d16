"""Over a jump: bodies that creep to the next equilibrium where the last one has gone.

A surface that slips off a corner, or an arm that folds, has no equilibrium near the last one:
Newton's steps go to and fro around the place where it was.  With viscosity bodies move on,
slowly.  With the stiffness K_0 of bodies at rest as viscosity, an implicit Euler step is

    F(v) = 0   with   f_int + c K_0 (u - u_k)   in the place of f_int,                      (1)

c the viscosity over the time step, u_k the displacements of the last solution: the contact
hears the viscous forces, too.  Where u comes to rest F = 0 without them, so that nothing of c
is in the result but which equilibrium it is, one to which the bodies come by themselves.  This
is the pseudo-transient continuation of [KK], and the proximal point method of `nitsche`.

c begins with FIRMNESS, the bodies themselves having 1.  It falls with every solution, and with
|F|, but not where |F| rises; and is multiplied by STIFFER where Newton's method does not solve
(1): on the way down (1) has no solution either where c is less than what the tangent lacks.
Below WEAK Newton's method goes on without.  It begins where Newton's steps at the whole load
step lead nowhere, far from the last equilibrium, where |F| is large: from one just past it the
first steps are as short as the way off it is flat.

[KK] C. T. Kelley, D. E. Keyes, "Convergence analysis of pseudo-transient continuation", SIAM J.
Numer. Anal. 35 (1998).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells, SingularOperator
from ..contract import Target
from .linear_steps import LinearSteps, newton_step
from .step_lengths import Failed, by_natural_test

if TYPE_CHECKING:
    from .nonlinear import NonlinearProblem

Array = NDArray[np.float64]
FIRMNESS, WEAK, STIFFEST = 1.0, 0.01, 100.0  # c: the first, where it is none, the largest
STIFFER, SOFTER = 4.0, 0.7
RISES = 1.1  # |F| over the last one above which c stays: bodies move ever faster
LEAST = 0.1  # of c in the next step, where |F| falls by more
INNER, INNER_STEPS = 0.5, 8  # |F| of (1) that will do, over the first one; Newton steps
DAMPED = 2  # of them cut to less than half, after which c is too small
MOST = 60  # Newton steps of all


def creeping(
    problem: NonlinearProblem, v: Array, halvings: int, linear: LinearSteps, target: Target
) -> Iterator[Array]:
    """One state (n,) per Newton step; from the last one on Newton's method may go on.

    Ends at the deadline.  Raises Failed where bodies do not come to rest.
    """
    firmness, steps, size = FIRMNESS, 0, np.linalg.norm(problem.residual(v))
    while firmness >= WEAK and not target.deadline.passed:
        held = problem.held(v, firmness)
        found, count = yield from _slowed(held, v, halvings, linear, target)
        steps += count
        if found is None:
            firmness *= STIFFER
        else:
            v, last, size = found, size, np.linalg.norm(problem.residual(found))
            if size <= RISES * last:
                falls = float(size / last) if last > 0 else LEAST
                firmness *= SOFTER * min(max(falls, LEAST), 1.0)
        if firmness > STIFFEST or (steps > MOST and firmness >= WEAK):
            raise Failed("bodies that creep do not come to rest")


def _slowed(
    held: NonlinearProblem, v: Array, halvings: int, linear: LinearSteps, target: Target
) -> Generator[Array, None, tuple[Array | None, int]]:
    """(a solution of (1) to INNER, or None, also at the deadline; Newton steps)."""
    states, damped, count = held.states(v), 0, 0
    w = states.start
    goal = INNER * np.linalg.norm(states.residual(w))
    for count in range(1, INNER_STEPS + 1):
        v = states.v(w)
        try:
            here = states.linearisation(w)
            moved, factor = newton_step(held, v, here, here.residual, linear)
            step = states.whole(w, moved)
            length, _ = by_natural_test(held, states, w, step, factor, halvings)
            w = w + length * step
            size = np.linalg.norm(states.residual(w))
        except (Failed, InvertedCells, SingularOperator):
            yield v  # a step, too
            return None, count
        yield states.v(w)
        damped += length < 0.5
        if size <= goal:
            return states.v(w), count
        if damped >= DAMPED or target.deadline.passed:
            break
    return None, count
