"""Contacts whose tangent supports hold, as on a plane of symmetry: friction moves nothing.

Row and column of such a tangent t in W vanish, and u_t = q_t.  Where q_t = 0 put a compliance
W_tt > 0 in their place.  Then u_t = W_tt r_t, and as no law lets a contact push itself along
(stick has u_t = 0, slip r_t = -c u_t with c >= 0), every solution of that `relaxed` problem has
r_t = u_t = 0.  Its solutions are those of the given problem with r_t = 0, and each motion of
the given problem has one of them: without r_t, u_t = 0 stays, |r_T| only falls, and what slips
has r_t = 0 anyway.  So what is proved of the relaxed problem, whose W may be definite, is true
of the motions of the given one and of all other reactions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...linear.dense import dense
from ...problem.friction import FrictionProblem
from ..scaled import COPIES

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def held_tangents(W: Array, q: Array) -> Mask:
    """(nc, d) True at tangents of reacting contacts at rest, row and column of W zero."""
    nc, d = q.shape
    moved = ((W != 0).any(axis=1) | (W != 0).any(axis=0)).reshape(nc, d)
    held = ~moved & moved.any(axis=1)[:, None] & (q == 0)
    held[:, 0] = False
    return held


def relaxed(
    problem: FrictionProblem, deadline: Deadline
) -> tuple[FrictionProblem, Mask] | None:
    """(the problem with compliances at held tangents, which these are); None without any.

    Raises SingularOperator, InvalidInput and TimeUp where W can not be had.
    """
    local = problem.condensed(deadline)
    q = local.free_velocity
    W = dense(local.W, COPIES)
    held = held_tangents(W, q)
    if not held.any():
        return None
    nc, d = q.shape
    own = np.arange(nc)
    size = np.abs(W.reshape(nc, d, nc, d)[own, :, own]).max(axis=(1, 2))
    W = W.copy()
    rows = np.flatnonzero(held.ravel())
    W[rows, rows] = np.exp2(np.round(np.log2(size[rows // d])))
    return FrictionProblem.from_delassus(W, q, problem.law), held
