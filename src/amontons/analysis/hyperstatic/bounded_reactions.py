"""One solution where W is singular: multipliers about a known one, and bounded reactions.

Let z0 = (r0, u0) be a solution, z another one of the same load, d = z - z0, d_u = W d_r, as in
`certificates.load_multipliers`: with tau = sigma = 1 the sum over the contacts of d_r . d_u +
d_rN eta . d_uT, eta = mu t, is not positive, but where W is singular it vanishes on the kernel
of W, and its matrix is not definite.  Inequalities (1) and (2) of that module give something
away there.  Where z0 slips with u0_T = s0 t, let y = d_rT + mu d_rN t = r_T + mu r_N t.
If z slips along t',

    y . d_uT = -mu r_N (|u_T| + s0) (1 - t . t') = -(|u_T| + s0) |y|^2 / (2 mu r_N),

if z sticks, y . d_uT = -s0 y . t, and |y|^2 <= 2 mu r_N y . t, as |r_T| <= mu r_N; so always

    y . d_uT <= -s0 |y|^2 / (2 mu r_N).                                                  (1)

A contact that is open in z0 with the gap g has d_rN d_uN = -g r_N <= -g |r|^2 / (1 + mu^2) /
r_N, less what its eta needs.  If no solution has a normal reaction above R, then with

    M = sym(E W) + sum of s0 / (2 mu R) Y^T Y  (slip)  + g / ((1 + mu^2) R)  (open)      (2)

d_r M d_r <= 0, and where M is positive definite z0 is the only solution.  M can be definite
exactly if no reactions but those of z0 keep its motion: what the kernel of W leaves is then
either open or off the ray of slip somewhere.  The price is R.  Without a bound, what M proves
is that any other solution has a normal reaction above R somewhere.

R is bounded by a motion y, in coordinates with M v = H r + f, that opens all contacts
faster than friction holds them, (H^T y)_N >= mu |(H^T y)_T| + 1: then

    sum r_N <= r . H^T y = y . (M v - f) <= y . (M v_p / 2 - f) + radius |y|_M           (3)

for all v of the ball of `ball`.  There is such a y exactly if no reactions
in the cones hold each other; its components are those of a linear program, with the discs
inside of polygons, and (3) is evaluated for it as it came out.  (Derived here.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ..certificates.load_multipliers import Reference, proved_distance
from ..scaled import Scaled
from ..solutions.discs.known import NEAR
from ..solutions.newton_batch import polished
from ..tolerances import REFINED
from .ball import Ball

Array = NDArray[np.float64]
TIMES = (1.001, 3.0, 10.0, 30.0, 100.0, 1000.0)  # bounds tried, of the largest reaction
INSIDE = 1 - 1e-9  # of what (1) and (2) give, for rounding
SIDES = 16  # of polygons around discs
PROOF = 3.0  # operations of a proof per cube of the rows
FACTOR = 1e5  # operations of the linear program per entry


@dataclass(frozen=True, eq=False)
class Confined:
    """No other solution has all normal reactions below `within`; inf: there is no other.

    distance: of the largest reaction, to which this is meant.  bound: no solution at all has a
    normal reaction above it, inf where that is not known; both in the unit of reactions.
    """

    within: float
    bound: float
    distance: float

    @property
    def everywhere(self) -> bool:
        """Whether no other solution is left."""
        return self.within == np.inf


def confined(
    problem: FrictionProblem, solution: FrictionSolution, ball: Ball | None, deadline: Deadline
) -> Confined | None:
    """What (2) proves about a solution whose motion leaves its reactions no choice.

    None where nothing is; raises TimeUp, InvalidInput where W does not fit into memory.
    """
    rows = problem.contacts * problem.dimension
    deadline.pay(PROOF * float(rows) ** 3)
    scaled = Scaled.of(problem, deadline)
    known = solution.r / scaled.to_r
    better, _ = polished(scaled, known)
    size = 1 + float(np.abs(known).max(initial=0.0))
    if np.abs(better - known).max(initial=0.0) <= REFINED * size:
        known = better
    z0 = Reference.of(scaled, known)
    largest = float((z0.r * scaled.to_r)[:, 0].max(initial=0.0))
    if not scaled.resolves(z0.r) or not largest > 0:
        return None
    bound = np.inf if ball is None else reaction_bound(ball, solution, deadline)
    found: Confined | None = None
    if np.isfinite(bound):
        distance = _proved(scaled, z0, bound, deadline)
        if distance is not None and distance <= NEAR * size:
            return Confined(np.inf, bound, scaled.relative(distance, known))
    for times in TIMES:
        distance = _proved(scaled, z0, times * largest, deadline)
        if distance is None or distance > NEAR * size:
            break
        found = Confined(times * largest, bound, scaled.relative(distance, known))
    if found is not None and found.within >= found.bound:
        return replace(found, within=np.inf)
    return found


def _proved(scaled: Scaled, z0: Reference, most: float, deadline: Deadline) -> float | None:
    """The distance of `proved_distance` where no normal reaction is above `most`."""
    rows = z0.r.size
    if not deadline.affords(PROOF * float(rows) ** 3):
        return None
    deadline.spend(PROOF * float(rows) ** 3)
    one = np.ones(scaled.contacts)
    pinned = ~z0.is_open | (z0.gap < scaled.mu * z0.speed * (1 + 1e-6))
    eta = np.zeros((scaled.contacts, scaled.dimension - 1))
    held = _held(scaled, z0, pinned, most / scaled.to_r[:, 0])
    return proved_distance(scaled, z0, one, one, eta, pinned, held=held)


def _held(scaled: Scaled, z0: Reference, pinned: NDArray[np.bool_], R: Array) -> Array:
    """Blocks of (2), (nc, d, d), with tau = sigma = 1, eta = mu t of pinned contacts, or 0."""
    nc, d = scaled.shape
    mu, s0 = scaled.mu, z0.speed
    Y = np.zeros((nc, d - 1, d))
    Y[:, :, 0] = mu[:, None] * z0.t
    Y[:, np.arange(d - 1), np.arange(1, d)] = 1.0
    rubs = pinned & (mu > 0) & (s0 > 0)
    slip = np.divide(s0, 2 * mu * R, out=np.zeros(nc), where=rubs)
    blocks = slip[:, None, None] * (Y.swapaxes(1, 2) @ Y)
    needed = np.where(pinned, 0.0, mu * s0)
    gap = np.maximum(z0.gap - needed * INSIDE**-2, 0.0) / (1 + mu**2) / R
    each = np.arange(d)
    blocks[:, each, each] += np.where(z0.is_open, gap, 0.0)[:, None]
    return INSIDE * blocks


def reaction_bound(ball: Ball, solution: FrictionSolution, deadline: Deadline) -> float:
    """R of (3), inf where no motion opens all contacts or there was no time."""
    from scipy.optimize import linprog

    problem = ball.problem
    nc, d = problem.contacts, problem.dimension
    H = sparse.csr_array(sparse.csr_array(problem.H).T)
    turns = np.array([[1.0], [-1.0]])
    if d == 3:
        angle = 2 * np.pi * np.arange(SIDES) / SIDES
        turns = np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / SIDES)
    many = len(turns)
    blocks = np.empty((nc, many, d))
    blocks[:, :, 0] = -1.0
    blocks[:, :, 1:] = problem.mu[:, None, None] * turns
    each = sparse.bsr_array((blocks, np.arange(nc), np.arange(nc + 1)),
                            shape=(nc * many, nc * d))  # fmt: skip
    rows = sparse.csr_array(sparse.csr_array(each) @ H)
    if not deadline.affords(FACTOR * rows.nnz):
        return np.inf
    deadline.spend(FACTOR * rows.nnz)
    force = np.asarray(problem.H @ solution.r.ravel())
    size = float(np.abs(force).max(initial=0.0)) or 1.0
    found = linprog(force / size, rows, -np.ones(len(rows.indptr) - 1), bounds=(None, None),
                    method="highs-ipm")  # fmt: skip
    if found.status != 0:
        return np.inf
    y = np.asarray(found.x)
    u = np.asarray(H @ y).reshape(nc, d)
    least = float((u[:, 0] - problem.mu * np.linalg.norm(u[:, 1:], axis=1)).min(initial=np.inf))
    if not least > 1e-6 * float(np.abs(u).max()):
        return np.inf
    return max(ball.most(y), 0.0) / least * (1 + 1e-6)
