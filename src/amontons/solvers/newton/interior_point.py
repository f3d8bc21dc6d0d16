"""Interior point on the convex relaxation, with the sliding velocities frozen.

With x = (mu r_N, r_T), S = diag(1/mu, 1, 1) and frozen s = |u_T|, Coulomb's law becomes

    y = S (W r + q) + s e_N,   x and y in the Lorentz cone,   x . y = 0:

a second-order cone program when W is symmetric, which has a solution whenever the relaxation is
feasible, and which Mehrotra's predictor-corrector method solves in 5 to 20 steps, however
degenerate it is: piles at rest with more reactions than balances are where every other method
crawls.  With the Nesterov-Todd scaling D x = y, D = F F, lambda = F x, a step solves

    (W + S^-1 D S^-1) dr = S^-1 (F p + R),   p = lambda^-1 o (sigma m e - lambda o lambda - c),

R = y - S u - s e_N the residual, m = x . y / nc, c the corrector: W plus 3x3 blocks again, the
matrix of `block_lu`, or by the faces that contacts of rigid bodies share (`faces`,
`face_steps`).  Then s = |u_T| of the result, and so on [C, AANS]; accelerated sweeps
from each result often end it at once, as most contacts of a pile stick and s = 0 was right.

A contact with mu = 0 has the half line x_N >= 0 in place of the cone.

[M] S. Mehrotra, "On the implementation of a primal-dual interior point method", SIAM J. Optim.
2 (1992); [NT] Y. Nesterov, M. Todd, "Primal-dual interior-point methods for self-scaled
cones", SIAM J. Optim. 8 (1998); [C] F. Cadoux, doctoral thesis, Grenoble 2009; [AANS] V. Acary,
P. Armand, H. M. Nguyen, M. Shpakovych, "Second-order cone programming for frictional contact
mechanics using interior point algorithm", Optim. Methods Softw. 39 (2024).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.compiled import njit
from ...core.options import check_options
from ...linear.block_kernels import velocity_of_rows_inplace
from ...problem.friction import Form, FrictionProblem
from ...problem.judge.measures import error_of_motion
from ...problem.law.law import MU
from ..contract import Iterate, Target, check_at_least, check_positive
from ..sweeps.kernels import Acceleration, SweepOrder, sweep_data, watch_for
from .block_lu import factorise_inplace, solve_inplace
from .cone_steps import (
    FIRST_REACTION,
    FIRST_VELOCITY,
    advance_inplace,
    changes_inplace,
    gap_left,
    nesterov_todd_inplace,
    part_of_way,
    residual_inplace,
    right_side_inplace,
    room,
    scaled_blocks_inplace,
)
from .face_steps import face_memory, factorise_faces_inplace, step_by_faces_inplace
from .faces import NONE
from .smoothing import IDLE, PINNED, Workspace

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STALLED = 5  # steps below SHORT in a row, after which the relaxation is left
SHORT = 0.02
ENOUGH = 0.02  # error of the relaxation, relative to that of the frozen s, which is then larger
STAGE = "interior point"
DEPTH = 10  # past sweeps that the acceleration combines


@njit(cache=True, error_model="numpy")
def _newton_block(x, y, mu, shift, i, beta, w, lam, extra):
    """Scaling (beta, w) and lambda of contact i, and its block S^-1 D S^-1 plus the shift."""
    k, d = nesterov_todd_inplace(x, y, i, beta, w, lam), extra[i]
    for a in range(3):
        for b in range(3):
            d[a, b] = 2.0 * k * w[i, a] * w[i, b]
        d[a, a] += -k if a == 0 else k
    if mu == 0.0:
        d[1, 1] = d[2, 2] = PINNED * shift
    else:
        for a in range(3):
            d[0, a] *= mu
            d[a, 0] *= mu
    for a in range(3):
        d[a, a] += shift


@njit(cache=True, error_model="numpy")
def _scalings_inplace(faces, x, y, mu, rho, shift, scaling, extra, turned):  # noqa: PLR0913
    """Scaling of every contact and its block E in extra; E^-1 of those on faces in turned."""
    beta, w, lam = scaling
    sharing = len(faces.first) > 1
    for i in range(len(mu)):
        if rho[i] <= 0.0:
            for a in range(3):
                extra[i, a, a] = IDLE
        elif sharing and faces.face[i] >= 0:
            scaled_blocks_inplace(x, y, mu[i], shift / rho[i], i, beta, w, lam, extra, turned)
        else:
            _newton_block(x, y, mu[i], shift / rho[i], i, beta, w, lam, extra)


@njit(cache=True, error_model="numpy")
def _factorised_inplace(W, faces, extra, turned, symbolic, factor):
    """False at a singular pivot; factor: U, L, pivots, work and the memory of faces."""
    U, L, pivots, work, memory = factor
    if len(faces.first) > 1:
        return factorise_faces_inplace(faces, extra, turned, symbolic, U, L, memory)
    order, upper_start, upper, lower_start, lower = symbolic
    return factorise_inplace(
        W[0], W[1], W[2], extra, order, upper_start, upper, lower_start, lower, U, L, pivots,
        work,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _solved_inplace(W, faces, extra, turned, symbolic, factor, f, solutions, dr, du):  # noqa: PLR0913
    """dr (nc, 3) = (W + E)^-1 f and du = W dr; False where they are not finite.

    solutions: by faces with one factor, those after the first mend the rest.
    """
    U, L, pivots, _, memory = factor
    if len(faces.first) > 1:
        step_by_faces_inplace(
            W, faces, extra, turned, symbolic, U, L, memory, f, solutions, dr, du
        )
    else:
        order, upper_start, upper, lower_start, lower = symbolic
        solve_inplace(order, upper_start, upper, lower_start, lower, U, L, pivots, f, dr)
        velocity_of_rows_inplace(0, len(f), W[0], W[1], W[2], np.zeros(f.shape), dr, du)
    return math.isfinite(np.sum(du))


@njit(cache=True, error_model="numpy")
def relaxation_memory(contacts, rows, fill, faces):
    """Arrays of `relax_inplace`, kept from one call to the next: first the factor's.

    rows, fill: of the factor, in blocks; faces: `faces.Faces`.
    """
    factor = (
        np.empty((fill, 3, 3)), np.empty((fill, 3, 3)), np.empty((rows, 3, 3)),
        np.zeros((rows, 3, 3)), face_memory(faces),
    )  # fmt: skip
    blocks = np.zeros((contacts, 3, 3)), np.zeros((len(faces.face), 3, 3))
    return factor, blocks, np.zeros((8, contacts, 3)), np.empty(contacts)


@njit(cache=True, error_model="numpy")
def relax_inplace(  # noqa: PLR0913
    indptr, indices, data, q, kind, parameters, rho, order, upper_start, upper, lower_start,
    lower, faces, r, x, y, s, shift, goal, steps, short, memory,
):  # fmt: skip
    """Predictor-corrector steps on (r, x, y) with s frozen; x and y inside the cones on entry.

    order to lower: a factor's symbols, of W, or of X where faces (`faces.Faces`) has some.
    short (1,): short steps in a row so far, with which a call goes on where the last one ended.
    shift: added to the diagonal, relative to |W_ii|; goal: error, unit of u, at which to stop.
    memory: of `relaxation_memory`.
    Returns steps done, -1 less those where no step helps; r is the last iterate, and finite.
    """
    mu, W = parameters[:, MU].copy(), (indptr, indices, data)
    symbolic = order, upper_start, upper, lower_start, lower
    factor, (extra, turned), vectors, beta = memory
    u, du, rhs, dr = vectors[0], vectors[1], vectors[2], vectors[3]
    dx, dy, residual, lam = vectors[4], vectors[5], vectors[6], vectors[7]
    w = np.empty_like(lam)
    for count in range(steps):
        velocity_of_rows_inplace(0, len(q), indptr, indices, data, q, r, u)
        left, total, able = residual_inplace(x, y, u, s, mu, rho, rho, residual)
        error = error_of_motion(kind, parameters, rho, r, u)
        if error <= goal or math.sqrt(left) <= max(ENOUGH * error, 0.1 * goal):
            return count
        _scalings_inplace(faces, x, y, mu, rho, shift, (beta, w, lam), extra, turned)
        mean = total / max(able, 1)
        if not _factorised_inplace(W, faces, extra, turned, symbolic, factor):
            return -1 - count
        sigma, length, part = 0.0, 0.0, 1.0
        for phase in range(2):
            right_side_inplace(phase, sigma, mean, mu, rho, lam, beta, w, dx, dy, residual, rhs)
            if not _solved_inplace(
                W, faces, extra, turned, symbolic, factor, rhs, 1 + phase, dr, du
            ):
                return -1 - count
            changes_inplace(1.0 - sigma, mu, rho, residual, dr, du, dx, dy)
            length = min(room(x, dx, rho), room(y, dy, rho))
            if not length > 0.0:
                return -1 - count
            length = min(1.0, length * part)
            if phase == 0:
                gap = gap_left(x, y, dx, dy, rho, length, total)
                sigma, part = gap**3, part_of_way(gap)
        short[0] = short[0] + 1 if length < SHORT else 0
        if short[0] > STALLED:
            return -1 - count
        advance_inplace(x, y, r, dx, dy, mu, rho, length)
    return steps


@dataclass(frozen=True)
class InteriorPoint:
    """Interior point on the convex relaxation, then sweeps; for piles at rest (Coulomb).

    An iterate is a relaxation solved for the s of the best reaction so far, or accelerated
    Gauss-Seidel sweeps from there.
    """

    form: ClassVar[Form] = Form.DELASSUS
    needs_cone: ClassVar[bool] = True
    steps: int = 60  # of one relaxation at most
    shift: float = 1e-10  # added to the Newton matrix, relative to |W_ii|: W is often singular
    sweeps: int = 200  # after each relaxation; 0: none

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, steps=self.steps)
        check_at_least(0, sweeps=self.sweeps)
        check_positive(shift=self.shift)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Relaxations and sweeps in turn, for ever; UnsupportedLaw unless it is Coulomb's."""
        slip = np.zeros(problem.contacts)
        if start.r.any():
            slip = sliding_speed(problem, start.r)
        yield from self.relaxations(Workspace.of(problem), slip, target)

    def relaxations(self, work: Workspace, slip: Array, target: Target) -> Iterator[Iterate]:
        """The same from frozen |u_T|, (nc,), with the symbolic factor at hand."""
        problem = work.problem
        d, goal = problem.dimension, target.tolerance * problem.q_norm
        data = sweep_data(problem, order=SweepOrder.APPROACH)
        while True:
            count, r = self.relax(work, slip, goal, target.deadline)
            yield Iterate(r[:, :d].copy(), iterations=count, stage=STAGE)
            slip = sliding_speed(problem, r[:, :d])
            if self.sweeps:
                memory = Acceleration(data, r, DEPTH)
                count, _ = memory.sweep(self.sweeps, watch_for(goal))
                yield Iterate(
                    memory.r[:, :d].copy(), iterations=count, stage=f"sweeps after {STAGE}"
                )

    def relax(
        self, work: Workspace, slip: Array, goal: float, deadline: Deadline = NEVER
    ) -> tuple[int, Array]:
        """(steps, r) of the relaxation with frozen |u_T|, (nc,); goal: error, unit of u."""
        relaxation, done = Relaxation.of(work, slip, self.shift), 0
        while done < self.steps and not relaxation.ended:
            products = work.sharing.products if relaxation.shares else None
            done += relaxation.advance(
                goal, work.affordable(self.steps - done, deadline, products)
            )
            if deadline.passed:
                break
        return max(done, 1), relaxation.r


@dataclass(eq=False)
class Relaxation:
    """The convex program of one frozen slip, and how far its solution has come; r (nc, 3)."""

    work: Workspace
    slip: Array
    shift: float
    x: Array
    y: Array
    r: Array
    short: Index = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    shares: bool = True  # steps by faces, where there are; no more once none of them helps
    ended: bool = False
    memory: tuple[Any, ...] | None = None  # of `relaxation_memory`, from the first step on

    @classmethod
    def of(cls, work: Workspace, slip: Array, shift: float) -> Relaxation:
        """At its start, for frozen |u_T|, (nc,)."""
        q, mu, rho = work.problem.kernel_data[3], work.problem.mu, work.problem.kernel_data[6]
        size = work.problem.q_norm / math.sqrt(max(work.problem.contacts, 1))
        x, y = np.zeros_like(q), np.zeros_like(q)
        x[:, 0], y[:, 0] = FIRST_REACTION * size * rho, FIRST_VELOCITY * size
        r = x / np.where(mu > 0, mu, 1.0)[:, None]
        return cls(work, np.where(mu > 0, slip, 0.0), shift, x, y, r)

    def advance(self, goal: float, steps: int) -> int:
        """Steps done of some, fewer where its way changes or ends; goal: error, unit of u.

        The factor of the whole, which loses fewer digits, goes on where that by faces has come
        to its last.
        """
        sharing = self.work.sharing
        self.shares = self.shares and len(sharing.faces.first) > 1
        arrays = sharing.arrays if self.shares else (*self.work.symbolic.arrays, NONE)
        if self.memory is None:
            order, _, upper, _, _, faces = arrays
            self.memory = relaxation_memory(len(self.r), len(order), len(upper), faces)
        done = relax_inplace(
            *self.work.problem.kernel_data, *arrays, self.r, self.x, self.y, self.slip,
            self.shift, goal, steps, self.short, self.memory,
        )  # fmt: skip
        if done < 0 and self.shares:
            self.shares, self.short[0], self.memory = False, 0, None
            return -1 - done
        self.ended = done < steps
        return done if done >= 0 else -1 - done


def sliding_speed(problem: FrictionProblem, r: Array) -> Array:
    """|u_T|, (nc,), of reactions (nc, d)."""
    return np.linalg.norm(problem.velocity(r)[0][:, 1:], axis=1)


__all__ = ["InteriorPoint", "relax_inplace", "sliding_speed"]
