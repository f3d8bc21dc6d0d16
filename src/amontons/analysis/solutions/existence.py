"""Do reactions that nearly solve a problem belong to a solution of it?  Proofs for a few.

A small error alone does not tell: past a fold there is none, however small the error near it.
In 2D the linear piece is examined (`piece_solution`).  In 3D Newton's method converges to a
solution in a ball about r when its first step is small against the curvature of the equations
([Kantorovich]: beta K eta <= 1/2, beta the norm of the inverse Jacobian, eta of the step), and
statuses do not change in that ball.

[Kantorovich] J. Ortega, W. Rheinboldt, "Iterative solution of nonlinear equations in several
variables" (1970), theorem 12.6.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...problem.friction import FrictionProblem
from ..scaled import Scaled
from ..statuses import FREE, FRICTIONLESS, SLIP, STICK, states_of
from ..tolerances import BELONGS, SEGMENT
from .multistart import described, statuses
from .newton_batch import jacobian, polished
from .piece_solution import examined
from .plane_problem import PlaneProblem

Array = NDArray[np.float64]
WORDS = 8  # patterns of one solution that are tried
SAFE = 0.1  # of beta K eta
ROUNDING = 1e-14  # of equations, scaled
WORK = (1e7, 10.0)  # operations of a proof, and per cube of the reactions
LITTLE = 5e8  # operations that are always done: some ten milliseconds


def exist(
    problem: FrictionProblem | Scaled, reactions: Sequence[Array], deadline: Deadline = NEVER
) -> bool:
    """True where each of some reactions (nc, d) surely belongs to a solution nearby.

    Also where they all are solutions within rounding, and everything between them.  False too
    where a proof would take longer than there is time; small ones are always looked at.
    """
    scaled = Scaled.of(problem)
    if takes_too_long(scaled, len(reactions), deadline):
        return False
    deadline.spend(_work(scaled, len(reactions)))
    pairs = [(reactions[0], r) for r in reactions[1:]]
    if pairs and all(_on_segment(scaled, *pair) for pair in pairs):
        return True
    if scaled.shape[1] == 3:
        return all(_newton_converges(scaled, r / scaled.to_r) for r in reactions)
    plane = PlaneProblem(scaled)
    return all(_on_its_piece(plane, r / scaled.to_r) for r in reactions)


def takes_too_long(local: Scaled, count: int, deadline: Deadline) -> bool:
    """True where there is no time to prove that so many reactions belong to solutions."""
    work = _work(local, count)
    return work > LITTLE and not deadline.affords(work)


def _work(local: Scaled, count: int) -> float:
    return count * (WORK[0] + WORK[1] * float(local.q.size) ** 3)


def _on_segment(scaled: Scaled, r: Array, other: Array) -> bool:
    points = (r + t * (other - r) for t in (0.0, 0.25, 0.5, 0.75, 1.0))
    return all(scaled.problem.certain_error(point) <= SEGMENT for point in points)


def _on_its_piece(plane: PlaneProblem, r: Array) -> bool:
    """2D: the solution of a pattern that r has is inside of the piece."""
    entry, mu = described(plane.scaled, r), plane.mu
    for word in (entry.pattern, *entry.touching)[:WORDS]:
        states = states_of(word)
        states[(mu == 0) & (states != FREE)] = FRICTIONLESS
        answer = examined(plane, states)
        near = np.abs(answer.r - r.ravel()).max() <= BELONGS * (1 + np.abs(r).max())
        if near and (answer.exists or answer.freedom):
            return True
    return False


def _newton_converges(scaled: Scaled, r: Array) -> bool:
    """3D: the condition of Kantorovich, with statuses that do not change in the ball."""
    start = r
    r, step = polished(scaled, start)
    if np.abs(r - start).max(initial=0.0) > BELONGS * (1 + np.abs(start).max(initial=0.0)):
        return False
    u, size = scaled.velocity(r[None])[0], 1 + float(np.abs(r).max(initial=0.0))
    values = np.linalg.svd(jacobian(scaled, r), compute_uv=False)
    if not len(values) or values[-1] == 0:
        return False
    beta = np.sqrt(len(values)) / values[-1]
    eta = step + beta * ROUNDING * size * (1 + np.abs(scaled.W).sum(axis=1).max())
    states, mu = statuses(scaled, r)[0], scaled.mu
    grows = 2 * (1 + np.abs(scaled.W).sum(axis=1).max()) * (1 + mu)
    margin = np.where(states == FREE, u[:, 0], np.inf)
    stick = mu * r[:, 0] - np.linalg.norm(r[:, 1:], axis=1)
    margin = np.where(states == STICK, np.minimum(stick, r[:, 0]), margin)
    slides = np.where(mu > 0, np.linalg.norm(u[:, 1:], axis=1), np.inf)
    margin = np.where(states == SLIP, np.minimum(r[:, 0], slides), margin)
    if (margin <= 4 * grows * eta).any():
        return False
    slip = (states == SLIP) & (mu > 0)
    reach = np.linalg.norm(r[slip, 1:] - u[slip, 1:], axis=1)
    curvature = float((8 * grows[slip] ** 2 / reach).max(initial=0.0))
    return bool(beta * curvature * eta <= SAFE)
