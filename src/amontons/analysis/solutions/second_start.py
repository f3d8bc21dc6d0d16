"""A second start: the cheap hint that another solution is near.

A method that comes from elsewhere may end in another solution, if there is one.  An iterate
that is only nearly a solution may be far from the one that it will come to, many times its
error; so what is compared are solutions: where the motions of two differ, both are solved
again to a hundredth of the tolerance, and count as two where the difference stays.  No proof,
neither of several (`all_solutions`, `existence` prove), nor of one where nothing is found
(`uniqueness`).  Only motions are compared: what the motion of the solution leaves open of its
reactions is said beside, by a rank (`hyperstatic.freedom`), where that fits into a fifth of
the solve.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import whole
from ...core.errors import InvalidInput, shown
from ...problem.friction import FrictionProblem
from ...problem.law import Coulomb
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ...solvers.driver import drive
from ...solvers.sweeps.gauss_seidel import GaussSeidel
from ..hyperstatic.face import size_of_motion
from ..hyperstatic.freedom import Freedom, freedom_of
from ..quick import operations_of, quick_deadline

Array = NDArray[np.float64]
SWEEPS = GaussSeidel(batch=20, momentum=True)
LEAST = 1000  # sweeps of a start at most, or EFFORT times the iterations of the solution
EFFORT = 10
FAR = 100.0  # tolerances that two motions differ by at least: then they are looked at
POLISHED = 1e-2  # tolerance of both then, relative
STAYS = 0.5  # of the difference that is left where they are two


class Other(NamedTuple):
    """Another solution: distance |u - u'| / |u| of the motions, contacts of another status."""

    solution: FrictionSolution
    distance: float
    contacts: int


class Others(tuple[Other, ...]):
    """Other solutions; reactions: what the given motion leaves open, None under other laws.

    A tuple, which str() puts in words.
    """

    reactions: Freedom | None

    def __new__(cls, found: Iterable[Other] = (), reactions: Freedom | None = None) -> Self:
        """Of what was found."""
        one = super().__new__(cls, found)
        one.reactions = reactions
        return one

    def __str__(self) -> str:
        told = "No other motion was found."
        if self:
            count = "Another motion was" if len(self) == 1 else f"{len(self)} motions were"
            far = ", ".join(f"{one.distance:.2g}" for one in self)
            told = f"{count} found, {far} of its size away."
        return told if self.reactions is None else f"{told} {self.reactions}"


def maybe_others(
    solution: FrictionSolution, *, starts: int = 3, seed: int = 0
) -> Others:
    """Other solutions of the problem of a converged solution, found from some starts.

    The first start is no reaction at all, the others are random reactions in the cones, by
    `seed`; sweeps with momentum go on from each, at most about ten times the iterations of the
    solution.  () says only that these starts have found no other.  Each costs about as much as
    a solve, often less.  `reactions` of the answer says whether reactions of the solution's
    motion are unique, and of how many contacts they are not.  Raises InvalidInput for a
    solution that has not converged, or of no FrictionProblem.
    """
    problem = getattr(solution, "problem", None)
    if not isinstance(problem, FrictionProblem) or not solution.converged:
        raise InvalidInput(
            f"expected a converged solution of a FrictionProblem, got {shown(str(solution))}",
            ("solution",),
        )
    starts, seed = whole("starts", starts, least=1), whole("seed", seed, least=0)
    tolerance = solution.convergence.tolerance
    most = max(LEAST, EFFORT * solution.convergence.iterations)
    random, known = np.random.default_rng(seed), [solution]
    others: list[Other] = []
    for k in range(starts):
        r = np.zeros_like(solution.r) if k == 0 else _in_the_cones(solution, random)
        found = drive(
            problem, SWEEPS, tolerance=tolerance, max_iterations=most, start=Iterate(r),
            condense=True,
        )  # fmt: skip
        if not found.converged or not all(_are_two(found, one) for one in known):
            continue
        known.append(found)
        differs = int((found.status != solution.status).sum())
        others.append(Other(found, distance(solution, found), differs))
    reactions = None
    if isinstance(problem.law, Coulomb):
        spent = operations_of(solution.convergence)
        reactions = freedom_of(problem, solution, quick_deadline(problem, spent))
    return Others(others, reactions)


def distance(one: FrictionSolution, other: FrictionSolution) -> float:
    """|u - u'| / |u|, of the larger of both motions; 0 where nothing moves."""
    size = max(float(np.linalg.norm(x.u)) for x in (one, other))
    return float(np.linalg.norm(one.u - other.u)) / size if size > 0 else 0.0


def _are_two(found: FrictionSolution, one: FrictionSolution) -> bool:
    """True where the motions of two solutions differ, and go on to when both are solved on."""
    tolerance = one.convergence.tolerance
    before = distance(found, one)
    if not before > FAR * tolerance or _both_rest(found, one, FAR * tolerance):
        return False
    polished = [
        drive(x.problem, tolerance=POLISHED * tolerance, start=x, condense=True)
        for x in (found, one)
    ]
    return all(x.converged for x in polished) and distance(*polished) > STAYS * before


def _both_rest(found: FrictionSolution, one: FrictionSolution, part: float) -> bool:
    """Whether both motions are so small that they may be what rounding leaves of rest."""
    assert isinstance(one.problem, FrictionProblem)
    nothing = part * size_of_motion(one.problem, one)
    return max(float(np.linalg.norm(x.u)) for x in (found, one)) <= nothing


def _in_the_cones(solution: FrictionSolution, random: np.random.Generator) -> Array:
    """Random reactions, as large as would hold each contact alone, or as the largest found."""
    problem = solution.problem
    size = problem.rho * np.linalg.norm(problem.free_velocity, axis=1)
    size = np.maximum(size, np.abs(solution.r).max(initial=0.0))
    r = random.uniform(-1.0, 1.0, solution.r.shape) * size[:, None]
    r[:, 0] = np.abs(r[:, 0])
    bound = problem.law.bound(r)
    shear = np.linalg.norm(r[:, 1:], axis=1)
    r[:, 1:] *= np.minimum(1.0, bound / np.where(shear > 0, shear, 1.0))[:, None]
    return r
