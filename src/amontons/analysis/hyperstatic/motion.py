"""What is known about other motions where W is singular or missing.

All solutions lie in one ball.  A solution obeys r.u <= 0, so with w_T = 0 <= w_N (gaps)

    v^T M v <= f.v,       and for any normal reactions p >= 0 with M v_p = f + H_N p
    f.v = v_p^T M v - p.(u_N - w_N) <= v_p^T M v + p.w_N,

hence |v - v_p / 2|_M^2 <= |v_p|_M^2 / 4 + p.w_N.  Best is the p of the problem without friction
(then p.w_N vanishes with u_N): no solution with friction has more energy than the one without,
and where that rests, by frictionless balance, rest is the only motion.  Any p gives a bound.
In the Delassus form W = L L^T stands for H^T M^-1 H with M = 1, and q = L f + w is needed.
Where bodies of a static model are held by contact alone (M semidefinite) there is no ball.

Other motions are looked for from random reactions in the cones.  One counts when both solve the
problem to SOLVED, asked for POLISHED, and they differ by more than FAR times that: the judge's
error is relative to the free velocity as the difference is.  That is no proof, nor could there
be one: any rounding of a singular W makes it another problem.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers import GaussSeidel
from ...solvers.contract import Iterate
from ...solvers.driver import drive
from .face import rank_factor

Array = NDArray[np.float64]
# of random starts: size, times a typical one; tangents one way, the other, or any; sweeps
STARTS = ((1.0, 0, True), (3.0, 1, True), (3.0, -1, True), (1.0, 0, False), (0.3, 1, False))
SUSPECT, FAR = 30.0, 1e3  # differences of motions, in their errors: looked at again; counted
SOLVED, POLISHED = 1e-9, 1e-11  # error by the judge that both need, and are asked for
NO_MORE = 1e-6  # distance of any other motion, relative, that counts as none
FITS = 1e-9  # part of q outside of the range of W that counts as rounding
GAP = 1e-12  # negative gap or tangential w, relative to the velocities, that counts as none


@dataclass(frozen=True, eq=False)
class MotionBound:
    """Every solution's motion is within `distance` of the found one, in the norm of energy.

    distance: relative to the free motion, without reactions.  energy: the largest energy of a
    solution, relative to that of the free motion.
    """

    distance: float
    energy: float


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """Another motion of the same load: solution, how far it is, and the errors of both.

    distance: |du|, relative to the free velocity or, without one, to the largest of both u.
    """

    solution: FrictionSolution
    distance: float
    errors: tuple[float, float]


# --------------------------------------------------------------------------- the ball
def motion_bound(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> MotionBound | None:
    """The ball of the module docstring about a solution, None where it can not be had."""
    if not problem.has_v:
        in_energy = _in_coordinates_of_energy(problem, deadline)
        if in_energy is None:
            return None
        problem = in_energy
    if problem.loose_modes.shape[1] or not _has_plain_gaps(problem):
        return None
    bare = drive(problem.with_mu(0.0), time_limit=deadline)
    if not np.isfinite(bare.convergence.error):
        return None
    p = np.zeros_like(bare.r)
    p[:, 0] = np.maximum(bare.r[:, 0], 0.0)
    with_p, with_r = (problem.velocity(r)[1] for r in (p, solution.r))
    assert with_p is not None and with_r is not None and problem.f is not None
    free = problem.solve_M(problem.f)
    M, w = problem.assembled().M, np.maximum(problem.w[:, 0], 0.0)  # type: ignore[index]

    def size(v: Array) -> float:
        return float(np.sqrt(max(v @ (M @ v), 0.0)))

    scale = size(free)
    if scale == 0.0:
        return None
    radius = np.sqrt(size(with_p) ** 2 / 4 + float(p[:, 0] @ w))
    distance = size(with_p / 2 - with_r) + radius
    return MotionBound(distance / scale, ((size(with_p) / 2 + radius) / scale) ** 2)


def _in_coordinates_of_energy(
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


def _has_plain_gaps(problem: FrictionProblem) -> bool:
    """Whether w is only open gaps."""
    w = problem.w
    assert w is not None
    size = GAP * max(float(np.abs(w).max(initial=0.0)), _speed(problem))
    return bool((w[:, 0] >= -size).all() and (np.abs(w[:, 1:]) <= size).all())


def _speed(problem: FrictionProblem) -> float:
    """|q|, 0 where there is none."""
    try:
        return float(np.linalg.norm(problem.free_velocity))
    except SingularOperator:
        return 0.0


# --------------------------------------------------------------------- second starts
def other_motion(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> tuple[OtherMotion | None, int]:
    """(another motion or None, solutions that were compared with the given one)."""
    speed, compared = _speed(problem), 0
    for found in _others(problem, solution, deadline):
        compared += found.convergence.error <= 1e-6
        first, distance = solution, _distance(solution, found, speed)
        if distance <= SUSPECT * _errors(first, found):
            continue
        say("another motion")
        share = deadline.share(0.5)
        first = drive(problem, start=solution, tolerance=POLISHED, time_limit=share)
        found = drive(problem, start=found, tolerance=POLISHED, time_limit=deadline.share(0.5))
        distance = _distance(first, found, speed)
        good = max(first.convergence.error, found.convergence.error) <= SOLVED
        if good and distance > FAR * _errors(first, found):
            errors = first.convergence.error, found.convergence.error
            return OtherMotion(found, distance, errors), compared
    return None, compared


def _errors(*solutions: FrictionSolution) -> float:
    return sum(one.convergence.error for one in solutions)


def _distance(a: FrictionSolution, b: FrictionSolution, speed: float) -> float:
    """|du| relative to the free velocity or the larger of both."""
    size = speed or max(float(np.linalg.norm(one.u)) for one in (a, b)) or 1.0
    return float(np.linalg.norm(a.u - b.u)) / size


def _others(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> Iterator[FrictionSolution]:
    """Solutions from random reactions in the cones, each with its share of the time."""
    random, r = np.random.default_rng(0), solution.r
    local = problem
    try:
        local = problem.condensed(deadline)
    except (SingularOperator, InvalidInput, TimeUp):
        pass  # then in displacements
    closed = r[r[:, 0] > 0, 0]
    typical = float(np.median(closed)) if len(closed) else 0.0
    if not typical and not local.has_v:  # nothing closed: what the free motion would ask for
        typical = float(np.median(np.linalg.norm(local.free_velocity, axis=1) * local.rho))
    for k, (size, way, sweeps) in enumerate(STARTS):
        if deadline.passed or not typical:
            return
        say(f"other motions, start {k + 1} of {len(STARTS)}")
        normal = size * typical * random.exponential(2.0, len(r))
        turn = random.standard_normal((len(r), r.shape[1] - 1))
        turn = way * np.abs(turn) if way else turn
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        tangent = (problem.mu * normal * random.uniform(0, 1, len(r)))[:, None] * turn
        start = Iterate(np.column_stack([normal, tangent]))
        share = deadline.share(1 / (len(STARTS) + 1 - k))
        solver = GaussSeidel() if sweeps and not local.has_v else None
        found = drive(local, solver, start=start, time_limit=share)
        if np.isfinite(found.u).all():
            yield found
