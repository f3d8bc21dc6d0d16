"""The contact problem of a step solved in compiled sweeps, without a problem object.

`pose` forms W and q of a step, and a start from the last impulses; `solved` starts from these,
or from none where they are worse, as after an impact, sweeps (Gauss-Seidel, each contact
exactly) until the judge is content, as the solvers do by default, and lets open contacts carry
nothing.  What a few sweeps do not solve is swept with momentum (`solvers.sweeps.momentum`),
which many contacts of bricks need; what that can not solve either goes to the solvers, from
where it has come, with the same W and q: nothing is formed twice.  `sweeping` says how many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from ...linear.block_kernels import WELL_CONDITIONED
from ...linear.blocks import BlockRows
from ...problem.friction import FrictionProblem
from ...problem.judge.contacts import assess
from ...problem.judge.measures import Measure, natural_error
from ...problem.judge.sharp import sharp_error
from ...problem.law import Coulomb, Law, Tied, joined
from ...problem.law.law import COULOMB, TIED
from ...problem.settling import Settled
from ...problem.solution import Convergence, FrictionSolution, Outcome, Step
from ...solvers.sweeps.kernels import (
    EXACT,
    FIRST_JUDGED,
    Sweep,
    sweep_inplace,
    sweeps_inplace,
)
from ...solvers.sweeps.local_contact import CLOSE
from ...solvers.sweeps.on_bodies import momentum_on_bodies_inplace
from .rows import coupled, fill_blocks, row_velocities, to_global

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SETTLING = 4  # rounds in which open contacts lose what they carry


class Posed(NamedTuple):
    """A step's problem: W in rows of blocks, q (n, 3), and a start r (n, 3)."""

    indptr: Any
    indices: Any
    data: Any
    diagonal: Any
    q: Any
    start: Any

    def problem(self, law: Law) -> FrictionProblem:
        """The same for the solvers."""
        for array in self:
            array.flags.writeable = False
        return FrictionProblem._from_blocks(BlockRows(*self[:4]), self.q, law)


def law_of(contacts: int, joints: int, mu: float) -> Law:
    """Friction at contacts, bonds at joints."""
    if not joints:
        return Coulomb(np.full(contacts, mu))
    bonds = Tied(joints)
    return joined([Coulomb(np.full(contacts, mu)), bonds]) if contacts else bonds


@dataclass(frozen=True, eq=False)
class Found:
    """What sweeps have found; the solution as the solvers tell it when asked for.

    r, u (n, 3); status, sliding (n,); errors unit-free: in the sum, of the weakest contact.
    """

    posed: Posed
    contacts: int
    mu: float
    tolerance: float
    r: Array
    u: Array
    status: NDArray[np.int8]
    sliding: NDArray[np.int8]
    sweeps: int
    error: float
    worst: tuple[float, int]
    seconds: float

    @cached_property
    def solution(self) -> FrictionSolution:
        """With its problem and its record."""
        law = law_of(self.contacts, len(self.r) - self.contacts, self.mu)
        worst, contact = self.worst
        step = Step(self.sweeps, self.error, 0, self.seconds)
        record = Convergence(
            Outcome.CONVERGED, self.sweeps, self.error, self.tolerance, (step,), 0,
            self.seconds, "GaussSeidel", Measure.EXACT, contact_error=worst,
            contact_tolerance=math.inf, weakest=contact if contact >= 0 else None,
        )  # fmt: skip
        kept = Settled(self.r, self.status, self.sliding.view(np.bool_), False)
        return FrictionSolution(
            self.posed.problem(law), self.r, self.u, None, record, settled=kept
        )


@njit(cache=True, error_model="numpy")
def pose(rows, contacts, bodies, motion, free, restitution, keys, state):  # noqa: PLR0913
    """The problem of a step, as the arrays of `Posed`.

    rows: see `Rows`; contacts: how many are no joints.  bodies: masses (b,), inverse inertia
    in global axes and R (b, 3, 3); motion: v before the step and W_f, free: v and W_f without
    reactions, W in own axes.  keys (contacts, 3); state: keys and impulses of the last step.
    """
    slave, master, axes, arms, master_arms = rows
    masses, inverse, R = bodies
    n, count = len(slave), len(masses)
    omega = to_global(R, free[1])
    q = row_velocities(slave, master, axes, arms, master_arms, free[0], omega)
    if restitution > 0.0 and contacts > 0:
        before = row_velocities(slave, master, axes, arms, master_arms, motion[0], omega)
        for i in range(contacts):
            q[i, 0] += restitution * before[i, 0]  # also of those that part: see `moving`
    indptr, size = coupled(slave, master, count)
    indices, data = np.empty(size, np.int32), np.empty((size, 3, 3))
    diagonal = np.empty(n, np.int32)
    fill_blocks(
        slave, master, axes, arms, master_arms, masses, inverse, indptr, indices, data, diagonal
    )
    start = np.zeros((n, 3))
    matched(keys, state[0], state[1], start)
    return indptr, indices, data, diagonal, q, start


@njit(cache=True, error_model="numpy")
def matched(keys, old, impulses, start):
    """Give contacts the impulses that the same corners had in the last step.

    Contacts keep their order mostly, so that each is looked for behind the last one first.
    """
    number, place = len(old), 0
    for i in range(len(keys)):
        for k in range(number):
            at = place + k
            if at >= number:
                at -= number
            if (
                old[at, 2] == keys[i, 2] and old[at, 0] == keys[i, 0]
                and old[at, 1] == keys[i, 1]
            ):  # fmt: skip
                for d in range(3):
                    start[i, d] = impulses[at, d]
                place = at + 1
                break


@njit(cache=True, error_model="numpy")
def eliminated_of(data, diagonal):
    """(nc, 17) as `BlockRows.eliminated`, and 1 / |W_ii|_2, (nc,), of symmetric W_ii."""
    out, rho = np.zeros((len(diagonal), 17)), np.zeros(len(diagonal))
    for i in range(len(diagonal)):
        A, e = data[diagonal[i]], out[i]
        size = 0.0
        for a in range(3):
            for b in range(3):
                size = max(size, abs(A[a, b]))
        minor0 = A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1]
        minor1 = A[1, 0] * A[2, 2] - A[1, 2] * A[2, 0]
        minor2 = A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0]
        det = A[0, 0] * minor0 - A[0, 1] * minor1 + A[0, 2] * minor2
        if abs(det) > WELL_CONDITIONED * size**3 and A[0, 0] > 0.0:
            e[0] = 1.0
            e[1], e[4], e[7] = minor0 / det, -minor1 / det, minor2 / det
            e[2] = (A[0, 2] * A[2, 1] - A[0, 1] * A[2, 2]) / det
            e[5] = (A[0, 0] * A[2, 2] - A[0, 2] * A[2, 0]) / det
            e[8] = (A[0, 1] * A[2, 0] - A[0, 0] * A[2, 1]) / det
            e[3] = (A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]) / det
            e[6] = (A[0, 2] * A[1, 0] - A[0, 0] * A[1, 2]) / det
            e[9] = (A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]) / det
        a = A[0, 0] if A[0, 0] > 0.0 else 1.0
        for s in range(2):
            k = A[1 + s, 0] / a
            e[10 + s] = k
            for t in range(2):
                e[12 + 2 * s + t] = A[1 + s, 1 + t] - k * A[0, 1 + t]
        trace = abs(A[0, 0]) + abs(A[1, 1]) + abs(A[2, 2])
        e[16] = trace * trace
        largest = _largest_eigenvalue(A)
        rho[i] = 1.0 / largest if largest > 0.0 else 0.0
    return out, rho


@njit(cache=True, error_model="numpy")
def _largest_eigenvalue(A):
    """Of a symmetric 3x3 matrix, by the cosines of its characteristic cubic."""
    mean = (A[0, 0] + A[1, 1] + A[2, 2]) / 3.0
    b0, b1, b2 = A[0, 0] - mean, A[1, 1] - mean, A[2, 2] - mean
    c01 = 0.5 * (A[0, 1] + A[1, 0])
    c02 = 0.5 * (A[0, 2] + A[2, 0])
    c12 = 0.5 * (A[1, 2] + A[2, 1])
    spread = b0 * b0 + b1 * b1 + b2 * b2 + 2.0 * (c01 * c01 + c02 * c02 + c12 * c12)
    if spread == 0.0:
        return mean
    p = math.sqrt(spread / 6.0)
    det = (
        b0 * (b1 * b2 - c12 * c12) - c01 * (c01 * b2 - c12 * c02) + c02 * (c01 * c12 - b1 * c02)
    )
    cosine = min(max(0.5 * det / (p * p * p), -1.0), 1.0)
    return mean + 2.0 * p * math.cos(math.acos(cosine) / 3.0)


@njit(cache=True, error_model="numpy")
def solved(  # noqa: PLR0913
    indptr, indices, data, diagonal, q, start, contacts, mu, tolerance, blur, sweeps, more,
    levers, sides, bodies,
):  # fmt: skip
    """(r, (u, status, sliding), sweeps done or -1, error, contactwise error, its contact).

    sweeps: plain ones at most; more: with momentum, on so many bodies, by `levers_of` them.
    """
    n = len(q)
    kind, parameters = np.empty(n, np.int8), np.empty((n, 2))
    for i in range(n):
        free = i < contacts
        kind[i] = COULOMB if free else TIED
        parameters[i, 0], parameters[i, 1] = mu if free else 0.0, np.inf
    eliminated, rho = eliminated_of(data, diagonal)
    r, u, kept = start.copy(), np.empty((n, 3)), np.empty((n, 3))
    status, sliding = np.empty(n, np.int8), np.empty(n, np.int8)
    told = (u, status, sliding)
    size = math.sqrt((q * q).sum())
    if not size > 0.0 or not math.isfinite(size):
        return r, told, -1, math.inf, math.inf, -1
    goal, done = tolerance * size, 0
    problem = indptr, indices, data, q, kind, parameters, rho
    error = natural_error(*problem, r)
    at_rest = natural_error(*problem, np.zeros((n, 3)))
    if at_rest < error:
        r[:, :], error = 0.0, at_rest
    s = Sweep(
        indptr, indices, data, data, q, kind, parameters, rho, diagonal, eliminated,
        np.arange(n), EXACT, 1.0, CLOSE, 0, np.zeros(1),
    )  # fmt: skip
    if error <= goal and sweeps + more > 0:  # errors of one sign, step after step, add up
        kept[:, :] = r
        sweep_inplace(s, False, r)
        done += 1
        if not natural_error(*problem, r) < error:
            r[:, :] = kept
    elif not error <= goal:
        watch = np.array([goal, FIRST_JUDGED * goal, math.inf])
        done = sweeps_inplace(s, r, sweeps, watch)
        if not watch[2] <= goal and more > 0:
            watch[1] = FIRST_JUDGED * goal
            done += momentum_on_bodies_inplace(s, levers, sides, bodies, r, more, watch)
        if not watch[2] <= goal:
            return r, told, -1, math.inf, math.inf, -1
    floor = np.zeros(n)
    for _ in range(SETTLING):
        error, worst, contact, hidden, changed = assess(
            indptr, indices, data, q, kind, parameters, rho, r, floor, u, kept, status, sliding
        )
        if not changed:
            if hidden > max(blur * size, error):
                found, left = sharp_error(indptr, indices, data, q, kind, parameters, rho, r)
                error = max(found, left)
            if error <= goal:
                return r, told, done, error / size, worst, contact
            break
        copy_rows_inplace(kept, r)
    return r, told, -1, math.inf, math.inf, -1
