"""A known solution of one load: refined, and put on the law, so that contacts have a status."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....core.errors import InvalidInput
from ....problem.friction import FrictionProblem
from ...scaled import Scaled
from ...statuses import FREE, MINUS, PLUS, STICK
from ...tolerances import REFINED, SLACK
from ..branches import reactions, zero_velocities
from ..newton_batch import newton

Array = NDArray[np.float64]
NEAR = 1e-6  # of the size of reactions: what is known less well proves nothing of use
GOOD = 1e-12  # by which a solution in scaled variables may miss the law


@dataclass(frozen=True, eq=False)
class Known:
    """A solution: reactions r (2 nc,), the nearest z (nc, 4) that obeys the law, and how near.

    off (2 nc,): bound of |W r + q - u| with u from z, rounding included; r is that of z but for
    one rounding of a slipping r_T.  touches (nc, 4): statuses whose cone holds z.
    """

    r: Array
    z: Array
    off: Array
    touches: NDArray[np.bool_]

    @property
    def valid(self) -> bool:
        """True where every contact has a status."""
        return bool(self.touches.any(axis=1).all())


def known_solution(local: Scaled, r: Array) -> Known:
    """Scaled reactions (2 nc,) put on the law: what misses a border by SLACK lies on it."""
    mu = local.mu
    normal, tangent = r.reshape(-1, 2).T.copy()
    u = (local.W @ r).reshape(-1, 2) + local.q
    closed = (normal > SLACK) & local.reacts
    bound = mu * normal
    slip = closed & ((np.abs(u[:, 1]) > SLACK) | (mu == 0))
    border = closed & (np.abs(tangent) >= bound - SLACK)
    slope = np.where(slip, -np.sign(u[:, 1]), np.sign(tangent))
    tangent = np.where(slip | border, slope * bound, tangent)
    r = np.where(closed, np.stack([normal, tangent]), 0.0).T.ravel()
    u, rounding = velocity_and_rounding(local, r)
    z = np.hstack([r.reshape(-1, 2), u.reshape(-1, 2)])
    z[:, 2] = np.where(closed | (z[:, 2] <= SLACK), 0.0, z[:, 2])
    z[closed & ~slip, 3] = 0.0
    off = np.abs(u - z[:, 2:].ravel()) + rounding
    return Known(r, z, off, _touches(local, z))


def velocity_and_rounding(local: Scaled, r: Array) -> tuple[Array, Array]:
    """(W r + q, bound of its error): summed in extended precision where the machine has one."""
    q = local.q.ravel()
    if not r.any():
        return q.copy(), np.zeros(len(r))
    wide = np.longdouble
    u = np.asarray(local.W.astype(wide) @ r.astype(wide) + q, dtype=float)
    size = np.abs(local.W) @ np.abs(r) + np.abs(q)
    rounding = (len(r) + 4) * float(np.finfo(wide).eps) * size + np.finfo(float).eps * np.abs(u)
    return u, rounding


def _touches(local: Scaled, z: Array) -> NDArray[np.bool_]:
    """(nc, 4): statuses whose cone holds the rows of z, which obey the law exactly."""
    mu, none = local.mu, (z[:, :2] == 0).all(axis=1)
    still = (z[:, 2:] == 0).all(axis=1)
    out = np.zeros((len(z), 4), dtype=bool)
    out[:, FREE] = none
    out[:, STICK] = still & (mu > 0) & local.reacts
    contact = (z[:, 2] == 0) & local.reacts
    out[:, PLUS] = contact & (z[:, 1] == mu * z[:, 0]) & ((z[:, 3] <= 0) | (mu == 0))
    out[:, MINUS] = contact & (z[:, 1] == -mu * z[:, 0]) & (z[:, 3] >= 0) & (mu > 0)
    return out


def refined(local: Scaled, r: Array) -> Known:
    """The solution next to scaled reactions (2 nc,), on its piece or by Newton's method.

    Raises InvalidInput where there is none.
    """
    best = known_solution(local, r)
    for improve in (_on_piece, _by_newton):
        if best.valid and best.off.max(initial=0.0) <= GOOD:
            return best
        for other in improve(local, best.r if best.valid else r):
            known = known_solution(local, other)
            near = np.abs(known.r - r).max() <= REFINED * (1 + np.abs(r).max())
            better = not best.valid or known.off.max() < best.off.max()
            if near and known.valid and better:
                best = known
    if not best.valid or best.off.max(initial=0.0) > NEAR:
        raise not_a_solution(local.problem, r.reshape(-1, 2) * local.to_r)
    return best


def _on_piece(local: Scaled, r: Array) -> list[Array]:
    """The reactions that the statuses of a solution determine."""
    known = known_solution(local, r)
    order = np.array([FREE, STICK, PLUS, MINUS])
    branch = order[np.argmax(known.touches[:, order], axis=1)]
    R, rows = reactions(local, branch), zero_velocities(local, branch)
    if not known.valid or not len(rows):
        return []
    try:
        y = np.linalg.solve((R.T @ local.W[rows].T).T, -local.q.ravel()[rows])
    except np.linalg.LinAlgError:
        return []
    return [np.asarray(R @ y)]


def _by_newton(local: Scaled, r: Array) -> list[Array]:
    """Where semismooth Newton steps lead."""
    reached = newton(local, r.reshape(1, -1, 2), np.random.default_rng(0))
    return [found.ravel() for found in reached]


def not_a_solution(problem: FrictionProblem, r: Array) -> InvalidInput:
    """The complaint about reactions (nc, d) that do not solve a problem."""
    return InvalidInput(
        f"solution: expected a solution of the problem, got one with error "
        f"{problem.error(r):.1e}; solve again with a smaller tolerance"
    )
