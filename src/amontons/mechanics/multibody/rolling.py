"""The problem of a step whose contacts resist rolling, and what that gives to bodies.

Rows of each contact: three of its point, as always, and the angular velocity of the slave
relative to the master about the normal and both tangents, W = G G^T with the levers G of all
six on both bodies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...problem.law.rolling import RollingFriction
from ...problem.rolling import RollingProblem
from .rows import Rows, levers_of

if TYPE_CHECKING:
    from .bodies import RigidBodies

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def lever_matrix(levers: Array, sides: Index, bodies: int) -> Any:
    """Sparse G (k n, 6 bodies) of levers (n, 2, k, 6) on the bodies sides (n, 2), < 0 none."""
    n, _, k, _ = levers.shape
    contact, side = np.nonzero(sides >= 0)
    shape = len(contact), k, 6
    row = np.broadcast_to((k * contact[:, None] + np.arange(k))[:, :, None], shape)
    column = 6 * sides[contact, side][:, None] + np.arange(6)
    column = np.broadcast_to(column[:, None, :], shape)
    values = levers[contact, side].ravel()
    size = k * n, 6 * bodies
    return sparse.coo_array((values, (row.ravel(), column.ravel())), size).tocsr()


def rolling_problem(
    system: RigidBodies, rows: Rows, R: Array, bodies: tuple[Array, Array, Array], q: Array,
    spin: Array,
) -> RollingProblem:  # fmt: skip
    """Of contacts with free velocities q (nc, 3); spin (b, 3): the free one in own axes."""
    masses, _, own = bodies
    inverse = R @ own @ R.swapaxes(1, 2)
    nc, count = len(q), len(masses)
    levers = np.zeros((nc, 2, 6, 6))
    levers[:, :, :3] = levers_of(*rows, masses, inverse)
    C = np.linalg.cholesky(inverse)
    omega = np.einsum("bij,bj->bi", R, spin)
    turning = np.zeros((nc, 3))
    for side, (body, sign) in enumerate(((rows.slave, 1.0), (rows.master, -1.0))):
        has = body >= 0
        axes = rows.axes[has]
        levers[has, side, 3:, 3:] = sign * axes @ C[body[has]]
        turning[has] += sign * np.einsum("cij,cj->ci", axes, omega[body[has]])
    G = lever_matrix(levers, np.stack([rows.slave, rows.master], axis=1), count)
    lengths = system.mu, system.rolling, system.torsion
    law = RollingFriction(*(np.full(nc, value) for value in lengths))
    return RollingProblem(G @ G.T, np.hstack([q, turning]), law)


def couples(rows: Rows, moments: Array, bodies: int) -> Array:
    """Angular impulses (b, 3) in global axes of moments (nc, 3) in the frames of contacts."""
    out: Any = np.zeros((bodies, 3))
    turned = np.einsum("cij,ci->cj", rows.axes[: len(moments)], moments)
    for body, sign in ((rows.slave, 1.0), (rows.master, -1.0)):
        own = body[: len(moments)]
        np.add.at(out, own[own >= 0], sign * turned[own >= 0])
    return out
