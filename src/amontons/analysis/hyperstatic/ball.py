"""The ball that holds the motions of all solutions of a load.

A solution obeys r.u <= 0, so with w_T = 0 <= w_N (gaps)

    v^T M v <= f.v,       and for any normal reactions p >= 0 with M v_p = f + H_N p
    f.v = v_p^T M v - p.(u_N - w_N) <= v_p^T M v + p.w_N,

hence |v - v_p / 2|_M^2 <= |v_p|_M^2 / 4 + p.w_N.  Best is the p of the problem without friction
(then p.w_N vanishes with u_N): no solution with friction has more energy than the one without,
and where that rests, by frictionless balance, rest is the only motion.  Any p gives a bound.
In the Delassus form W = L L^T stands for H^T M^-1 H with M = 1, and q = L f + w is needed.
Where contact alone holds bodies M is semidefinite, and |.|_M is the energy of strains: the ball
bounds deformations and stresses, and of the bodies' motions as wholes nothing.  There must be
an equilibrium without friction then, which is known to BALANCED of the load.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import SingularOperator
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.driver import drive
from ...solvers.newton.frictionless import without_friction
from .face import rank_factor

Array = NDArray[np.float64]
FITS = 1e-9  # part of q outside of the range of W that counts as rounding
GAP = 1e-12  # negative gap or tangential w, relative to the velocities, that counts as none
BALANCED = 1e-8  # of the load, that pressures may leave where M is singular


@dataclass(frozen=True, eq=False)
class MotionBound:
    """Every solution's motion is within `distance` of the found one, in the norm of energy.

    distance: relative to the free motion, without reactions, or, with `strains`, to the found
    one: then bodies are held by contact alone, and it is about their strains only.  energy: the
    largest energy of a solution, relative likewise.
    """

    distance: float
    energy: float
    strains: bool = False


@dataclass(frozen=True, eq=False)
class Ball:
    """|v - centre|_M <= radius for all solutions; problem: in global form, M as there.

    p (nc, d): the normal reactions that it is made of.
    """

    problem: FrictionProblem
    M: Any
    centre: Array
    radius: float
    p: Array

    def size(self, v: Array) -> float:
        """|v|_M."""
        return float(np.sqrt(max(v @ (self.M @ v), 0.0)))

    def most(self, y: Array) -> float:
        """The largest y . (M v - f) = r . H^T y of a solution."""
        assert self.problem.f is not None
        return float(y @ (self.M @ self.centre - self.problem.f)) + self.size(y) * self.radius

    def bound(self, solution: FrictionSolution) -> MotionBound | None:
        """How far all solutions are from a given one, None without a scale."""
        strains = self.problem.loose_modes.shape[1] > 0
        v = solution.v if strains else self.problem.velocity(solution.r)[1]
        if v is None:
            return None
        assert self.problem.f is not None
        scale = self.size(v if strains else self.problem.solve_M(self.problem.f))
        if scale == 0.0:
            return None
        distance = self.size(self.centre - v) + self.radius
        energy = self.size(self.centre) + self.radius
        return MotionBound(distance / scale, (energy / scale) ** 2, strains)


def ball_of(problem: FrictionProblem, deadline: Deadline) -> Ball | None:
    """The ball of the module docstring, None where it can not be had; may raise TimeUp."""
    if not problem.has_v:
        in_energy = in_coordinates_of_energy(problem, deadline)
        if in_energy is None:
            return None
        problem = in_energy
    if not has_plain_gaps(problem):
        return None
    p, v_p = np.zeros((problem.contacts, problem.dimension)), None
    if problem.loose_modes.shape[1]:
        bare = without_friction(problem, deadline)
        if bare is None or bare.balance > BALANCED:
            return None
        p[:, 0], v_p = bare.p, bare.v
    else:
        found = drive(problem.with_mu(0.0), time_limit=deadline)
        if not np.isfinite(found.convergence.error):
            return None
        p[:, 0] = np.maximum(found.r[:, 0], 0.0)
        v_p = problem.velocity(p)[1]
    if v_p is None:
        return None
    M, w = problem.assembled().M, np.maximum(problem.w[:, 0], 0.0)  # type: ignore[index]
    size = float(np.sqrt(max(v_p @ (M @ v_p), 0.0)))
    return Ball(problem, M, v_p / 2, float(np.sqrt(size**2 / 4 + float(p[:, 0] @ w))), p)


def motion_bound(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> MotionBound | None:
    """The bound of the ball about a solution, None where it can not be had."""
    ball = ball_of(problem, deadline)
    return None if ball is None else ball.bound(solution)


def in_coordinates_of_energy(
    problem: FrictionProblem, deadline: Deadline
) -> FrictionProblem | None:
    """The Delassus form as M = 1, H = L^T with W = L L^T; None where q does not fit."""
    deadline.pay(5.0 * float(problem.q_norm > 0) * problem.free_velocity.size ** 3)
    L, q = problem.kept(rank_factor), problem.free_velocity
    if not L.shape[1]:
        return None
    f = np.linalg.lstsq(L, q.ravel())[0]
    w = q - (L @ f).reshape(q.shape)
    w[np.abs(w) <= FITS * float(np.abs(q).max(initial=0.0))] = 0.0
    return FrictionProblem.from_global(sparse.eye_array(L.shape[1]).tocsc(),
                                       sparse.csc_array(L.T), f, w, problem.law)  # fmt: skip


def has_plain_gaps(problem: FrictionProblem) -> bool:
    """Whether w is only open gaps."""
    w = problem.w
    assert w is not None
    size = GAP * max(float(np.abs(w).max(initial=0.0)), free_speed(problem))
    return bool((w[:, 0] >= -size).all() and (np.abs(w[:, 1:]) <= size).all())


def free_speed(problem: FrictionProblem) -> float:
    """|q|, 0 where there is none."""
    try:
        return float(np.linalg.norm(problem.free_velocity))
    except SingularOperator:
        return 0.0
