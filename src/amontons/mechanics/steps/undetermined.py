"""Reactions that nothing determines: where supports hold both sides, shear stays as it was.

Where no free dof feels a tangential reaction, and its component does not slip in a step, every
value within the law's bound is a solution, and solvers return any, often zero.  Of a body that
is held while it is pressed on that would say that its friction has gone.  In truth what holds
both sides is a little elastic, and does not move: the shear is that of the last step, as far
as the bound allows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...problem.friction import FrictionProblem
from ...problem.solution import ContactStatus, FrictionSolution

Array = NDArray[np.float64]


def carried_on(found: FrictionSolution, before: Array) -> FrictionSolution:
    """The solution whose undetermined reactions are those of before, (nc, d)."""
    problem = found.problem
    if not isinstance(problem, FrictionProblem) or problem.H is None:
        return found
    felt = np.asarray(abs(problem.H).sum(axis=0)).reshape(found.r.shape) > 0
    if problem.law.give is not None:  # the springs of a contact feel it
        felt |= problem.law.give[:, : felt.shape[1]] > 0
    free = ~felt[:, 1:] & (found.u[:, 1:] == 0)
    free &= (found.status == ContactStatus.STICK)[:, None]
    if not (free & (before[:, 1:] != 0)).any():
        return found
    shear = np.where(free, 0.0, found.r[:, 1:])
    wanted = np.where(free, before[:, 1:], 0.0)
    bound = problem.law.bound(found.r * np.eye(found.r.shape[1])[0])  # in all directions
    room = np.sqrt(np.maximum(bound**2 - (shear**2).sum(axis=1), 0.0))
    size = np.linalg.norm(wanted, axis=1)
    share = np.minimum(1.0, room / np.where(size > 0, size, 1.0))
    r = np.column_stack([found.r[:, 0], shear + share[:, None] * wanted])
    return replace(found, r=r)
