"""The problem of a step whose contacts resist rolling, and what that gives to bodies.

Rows of each contact: three of its point, as always, and the angular velocity of the slave
relative to the master about the normal and both tangents, W = G G^T with the levers G of all
six on both bodies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...problem.law.rolling import RollingFriction
from ...problem.rolling import RollingProblem
from .quick import Posed
from .rows import Mobility, Rows, levers_of

if TYPE_CHECKING:
    from .bodies import RigidBodies

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def _blocks_of(slave, master, levers, indptr, indices):
    """G G^T (nb, 6, 6) of levers (n, 2, 6, 6), in rows of blocks."""
    data = np.zeros((len(indices), 6, 6))
    for i in range(len(slave)):
        for place in range(indptr[i], indptr[i + 1]):
            j = indices[place]
            for p in range(2):
                b = slave[i] if p == 0 else master[i]
                for s in range(2):
                    if b < 0 or b != (slave[j] if s == 0 else master[j]):
                        continue
                    for a in range(6):
                        for c in range(6):
                            for k in range(6):
                                data[place, a, c] += levers[i, p, a, k] * levers[j, s, c, k]
    return data


def rolling_problem(
    system: RigidBodies, rows: Rows, mobility: Mobility, posed: Posed, omega: Array,
) -> RollingProblem:  # fmt: skip
    """Of contacts posed without moments; omega (b, 3): free, in global axes."""
    masses, inverse = mobility
    nc = len(posed.q)
    levers = np.zeros((nc, 2, 6, 6))
    levers[:, :, :3] = levers_of(*rows, masses, inverse)
    C = np.linalg.cholesky(inverse)
    turning = np.zeros((nc, 3))
    for side, (body, sign) in enumerate(((rows.slave, 1.0), (rows.master, -1.0))):
        has = body >= 0
        axes = rows.axes[has]
        levers[has, side, 3:, 3:] = sign * axes @ C[body[has]]
        turning[has] += sign * np.einsum("cij,cj->ci", axes, omega[body[has]])
    pattern = posed.indptr, posed.indices
    lengths = system.mu, system.rolling, system.torsion
    law = RollingFriction(*(np.full(nc, value) for value in lengths))
    blocks = *pattern, _blocks_of(rows.slave, rows.master, levers, *pattern)
    return RollingProblem._from_blocks(blocks, np.hstack([posed.q, turning]), law)


def couples(rows: Rows, moments: Array, bodies: int) -> Array:
    """Angular impulses (b, 3) in global axes of moments (nc, 3) in the frames of contacts."""
    out: Any = np.zeros((bodies, 3))
    turned = np.einsum("cij,ci->cj", rows.axes[: len(moments)], moments)
    for body, sign in ((rows.slave, 1.0), (rows.master, -1.0)):
        own = body[: len(moments)]
        np.add.at(out, own[own >= 0], sign * turned[own >= 0])
    return out
