"""Other motions where W is singular or missing: rest, by a linear program, and second starts.

Rest is a solution exactly if reactions in the cones balance the load: a convex question, which
a linear program decides (polygons in the place of discs leave 2 % of mu open).  Then starts:
from those reactions, from the problem without friction, from random reactions in the cones.
One counts when both solve the problem to SOLVED, asked for POLISHED, and they differ by more
than FAR times that: the judge's error is relative to the free velocity as the difference is.
That is no proof, nor could there be one: any rounding of a singular W makes it another problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
from .ball import free_speed, has_plain_gaps, in_coordinates_of_energy
from .face import cone_rows, lp_work

Array = NDArray[np.float64]
# of random starts: size, times a typical one; tangents one way, the other, or any; sweeps
STARTS = ((1.0, 0, True), (3.0, 1, True), (3.0, -1, True), (1.0, 0, False), (0.3, 1, False))
SUSPECT, FAR = 30.0, 1e3  # differences of motions, in their errors: looked at again; counted
SOLVED, POLISHED = 1e-9, 1e-11  # error by the judge that both need, and are asked for
NO_MORE = 1e-6  # distance of any other motion, relative, that counts as none
ROUNDING = 1e-14  # the least error that is believed
SIDES = 16  # of polygons in the place of discs
NEAR = 0.2  # part of the time for a start from rest, or without friction
CAP = 0.1  # margin to the border of a cone that is wanted at rest, of the largest load


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """Another motion of the same load: solution, how far it is, and the errors of both.

    distance: |du|, relative to the free velocity or, without one, to the largest of both u.
    """

    solution: FrictionSolution
    distance: float
    errors: tuple[float, float]


# ------------------------------------------------------------------------------ rest
@dataclass(frozen=True, eq=False)
class Rest:
    """Whether rest is a solution: reactions (nc, d) that balance the load, or None.

    excluded: there are none, not even in the polygons around the discs.
    """

    r: Array | None
    excluded: bool


def rest(problem: FrictionProblem, deadline: Deadline) -> Rest:
    """By a linear program; neither where that does not say, or loads are not plain."""
    from scipy.optimize import linprog

    nothing = Rest(None, False)
    given = problem if problem.has_v else in_coordinates_of_energy(problem, deadline)
    if given is None or given.loose_modes.shape[1] or not has_plain_gaps(given):
        return nothing
    H, f, w = sparse.csr_array(given.H), given.f, given.w
    assert f is not None and w is not None
    reached = np.diff(H.indptr) > 0
    M = sparse.csr_array(given.assembled().M)
    if M[reached][:, ~reached].nnz:
        return nothing  # what no contact reaches moves those that one does
    nc, d = w.shape
    closed = w[:, 0] <= 0
    columns = (d * np.flatnonzero(closed)[:, None] + np.arange(d)).ravel()
    A, load = sparse.csr_array(H[reached][:, columns]), f[reached]
    size, mu, k = float(np.abs(load).max(initial=0.0)) or 1.0, given.mu[closed], len(columns)
    for outside in (False, True):
        G = cone_rows(mu, d, SIDES, outside=outside)
        apart = sparse.kron(sparse.eye_array(len(mu)), np.ones((G.shape[0] // len(mu), 1)))
        left = sparse.csr_array(sparse.hstack([G, apart]))
        equal = sparse.csr_array(sparse.hstack([A, sparse.csr_array((A.shape[0], len(mu)))]))
        deadline.pay(lp_work(left, equal))
        bounds = [(0.0, None), *[(None, None)] * (d - 1)] * len(mu) + [(0.0, CAP)] * len(mu)
        cost = np.concatenate([np.zeros(k), -np.ones(len(mu))])
        found = linprog(cost, left, np.zeros(left.shape[0]), equal, -load / size, bounds,
                        method="highs-ipm")  # fmt: skip
        if found.status == 0 and not outside:
            r = np.zeros((nc, d))
            r[closed] = size * np.asarray(found.x[:k]).reshape(-1, d)
            return Rest(r, False)
        if found.status != 2:
            return nothing
    return Rest(None, True)


# --------------------------------------------------------------------- second starts
def other_motion(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline,
    starts: Sequence[Array] = (),
) -> tuple[OtherMotion | None, int]:  # fmt: skip
    """(another motion or None, solutions that were compared with the given one).

    starts: reactions (nc, d) from where to start first.
    """
    speed, compared = free_speed(problem), 0
    for found in _others(problem, solution, deadline, starts):
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
    return sum(max(one.convergence.error, ROUNDING) for one in solutions)


def _distance(a: FrictionSolution, b: FrictionSolution, speed: float) -> float:
    """|du| relative to the free velocity or the larger of both."""
    size = speed or max(float(np.linalg.norm(one.u)) for one in (a, b)) or 1.0
    return float(np.linalg.norm(a.u - b.u)) / size


def _others(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline,
    starts: Sequence[Array],
) -> Iterator[FrictionSolution]:  # fmt: skip
    """Solutions from given starts and from random reactions in the cones, each in its time."""
    random, r = np.random.default_rng(0), solution.r
    local = problem
    try:
        local = problem.condensed(deadline)
    except (SingularOperator, InvalidInput, TimeUp):
        pass  # then in displacements
    for begin in starts:
        if deadline.passed:
            return
        say("other motions, from rest and without friction")
        share = deadline.share(NEAR)
        yield from _finite(drive(local, start=Iterate(begin), time_limit=share))
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
        yield from _finite(drive(local, solver, start=start, time_limit=share))


def _finite(found: FrictionSolution) -> Iterator[FrictionSolution]:
    """What is a number."""
    if np.isfinite(found.u).all():
        yield found
