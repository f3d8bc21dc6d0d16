"""Several solutions of a problem at large strains, by Newton's method from many starts.

A finder, not a proof: what it lists are solutions, and nothing tells how many others there are.
Starts are known solutions moved along the softest modes of their tangent, where bodies
buckle, either way, and along random mixtures of them; from there Newton's steps are those of
the problem with the known solutions deflated ([FBF]), F times
m = prod_i (1 + (size / |v - v_i|)^2), in which a known solution is none.  Such a step has the
direction of the plain one, d:

    step = m / (m - dm . d) d.

[FBF] P. E. Farrell, A. Birkisson, S. W. Funke, "Deflation techniques for finding distinct
solutions of nonlinear partial differential equations", SIAM J. Sci. Comput. 37 (2015).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import ArpackError, eigsh

from ...core.arrays import whole
from ...core.clock import Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvertedCells, NotConverged, SingularOperator
from ...core.faces import Told
from ...linear import Direct
from ...mechanics.model.large_deformation import LargeDeformation
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ...solvers.driver import drive, drive_from

Array = NDArray[np.float64]
LARGE_STARTS = 60  # of which each takes Newton steps of the whole model
MODES = 4  # softest ones of a known solution along which starts lie
REACHES = (0.03, 1e-3, 1e-2, 1e-4, 0.1)  # of the size of the bodies, by which starts are moved
APART = 1e-5  # distance of two solutions, over the size of the bodies, that tells them apart
STEPS = 40  # Newton steps from one start
HALVINGS = 10  # of a step that would invert cells
FARTHEST = 0.2  # change of a displacement in one step, over the size of the bodies
CLOSE = 1e-4  # length of a step, over that size, at which the plain method takes over
SOLVED = 1e-10  # error by the judge
REASON = "there is no proof that there are no others"


@dataclass(frozen=True, eq=False, repr=False)
class LargeSolutions(Told):
    """Solutions that were found, the first by load steps; never known to be all.

    starts: from which Newton's method began; failed: from which it found nothing new.  States
    with a corner inside out, or bodies in each other, that the first does not have are none.
    """

    solutions: tuple[FrictionSolution, ...]
    starts: int
    failed: int
    seconds: float
    reason: str
    complete: bool = False

    def __len__(self) -> int:
        return len(self.solutions)

    def __str__(self) -> str:
        count = f"{len(self)} solution" + ("s" if len(self) != 1 else "")
        lines = [f"{s.pattern}  error {s.convergence.error:.1e}" for s in self.solutions]
        told = f"{count} from {self.starts} starts, not complete: {self.reason}"
        return "\n".join([told, *lines])


def large_multistart(
    problem: LargeDeformation, *, starts: int = LARGE_STARTS, seed: int = 0,
    time_limit: TimeLimit = None,
) -> LargeSolutions:  # fmt: skip
    """Solutions of a problem at large strains, 2D or 3D, obstacles and pairs; never complete.

    starts: of Newton's method, after load steps found the first solution; seed: of their random
    choice; time_limit: seconds.  Raises NotConverged where load steps find none.
    """
    starts, seed = whole("starts", starts, least=1), whole("seed", seed, least=0)
    began, deadline = now(), deadline_of(time_limit)
    first = drive(problem, tolerance=SOLVED, time_limit=deadline)
    if not first.converged:
        raise NotConverged(f"multistart: no solution to begin with: {first.convergence}", first)
    search = _Search(problem, np.random.default_rng(seed), [first])
    used, failed = 0, 0
    while used < starts and not deadline.passed:
        found = search.from_start(search.start(used), deadline)
        failed += not found
        used += 1
    late = "" if used == starts else f"out of time after {used} of {starts} starts; "
    reason = late + REASON
    return LargeSolutions(tuple(search.known), used, failed, now() - began, reason)


class _Search:
    """Known solutions, and new ones from starts beside them."""

    def __init__(
        self, problem: LargeDeformation, rng: np.random.Generator, known: list[FrictionSolution]
    ) -> None:
        self.problem, self.rng, self.known = problem, rng, known
        self.size = float(np.ptp(problem.parts.X, axis=0).max())
        self._modes: dict[int, Array] = {}

    def start(self, number: int) -> Array:
        """A state (n,): along each mode both ways, then mixtures, solution by solution."""
        own = number % len(self.known)
        modes = self._modes_of(own)
        each, reach = 2 * modes.shape[1], REACHES[(number // len(self.known)) % len(REACHES)]
        place = number // (len(self.known) * len(REACHES))
        if place < each:
            way = modes[:, place // 2] * (-1.0) ** place
        else:
            way = modes @ self.rng.standard_normal(modes.shape[1])
            way = way / np.abs(way).max()
        return self._state(own) + reach * self.size * way

    def _state(self, number: int) -> Array:
        v = self.known[number].v
        assert v is not None
        return v

    def _modes_of(self, number: int) -> Array:
        """Softest modes (n, k) of the tangent at a known solution, largest entry 1."""
        if number not in self._modes:
            A = self._held(number)
            n = A.shape[0]
            count = min(MODES, n)
            try:
                if n <= 2 * MODES:  # too few for Lanczos' method
                    values, modes = np.linalg.eigh(A.toarray())
                    modes = modes[:, np.argsort(np.abs(values))[:count]]
                else:
                    modes = np.asarray(eigsh(A, count, sigma=0.0, v0=np.ones(n))[1])
            except (ArpackError, RuntimeError):  # singular: no softest mode is to be had
                modes = self.rng.standard_normal((n, count))
            self._modes[number] = modes / np.abs(modes).max(axis=0)
        return self._modes[number]

    def _held(self, number: int) -> sparse.csc_array:
        """The symmetric part of the tangent, with springs where contacts are closed (n, n)."""
        solution = self.known[number]
        tangent = self.problem.linearised(self._state(number))
        M, H = tangent.M, tangent.H
        assert M is not None and H is not None
        stiff = np.where(solution.r[:, 0] > 0, self.problem.rho, 0.0)
        springs = sparse.diags_array(np.repeat(stiff, self.problem.dimension))
        return sparse.csc_array((M + M.T) / 2 + H @ springs @ H.T)

    def from_start(self, v: Array, deadline: Deadline) -> bool:
        """Newton's steps with the known solutions deflated; whether they find another one."""
        problem = self.problem
        try:
            for _ in range(STEPS):
                here = problem.linearisation(v)
                step = Direct().factor(here.matrix).solve(-here.residual)
                near = np.linalg.norm(step, np.inf) <= CLOSE * self.size
                if near and not self._is_known(v + step):
                    break
                v = self._moved(v, self._factor(v, step) * step)
                if deadline.passed:
                    return False
            else:
                return False
            found = drive_from(Iterate(problem.reactions(v), v), problem, tolerance=SOLVED,
                               max_iterations=STEPS, time_limit=deadline)  # fmt: skip
        except (InvertedCells, SingularOperator):
            return False
        if not found.converged or found.v is None or self._is_known(found.v):
            return False
        if problem.astray(found.v, (problem, self._state(0))):  # no body gets there
            return False
        self.known.append(found)
        return True

    def _is_known(self, v: Array) -> bool:
        limit = APART * self.size
        return any(
            np.abs(v - self._state(k)).max() <= limit for k in range(len(self.known))
        )

    def _factor(self, v: Array, step: Array) -> float:
        """m / (m - dm . step) of the deflation."""
        along = 0.0
        for k in range(len(self.known)):
            away = v - self._state(k)
            square = float(away @ away) / (self.size**2 * len(v))
            if square == 0.0:
                continue
            along -= 2 * float(away @ step) / (float(away @ away) * (1 + square))
        return 1.0 / (1.0 - along) if along != 1.0 else 1.0

    def _moved(self, v: Array, step: Array) -> Array:
        """The state after a step, shortened to a part of the size and until no cell inverts."""
        longest = FARTHEST * self.size
        part = min(1.0, longest / max(float(np.abs(step).max()), 1e-300))
        for _ in range(HALVINGS):
            try:
                self.problem.residual(v + part * step)
                return v + part * step
            except InvertedCells:
                part /= 2
        raise InvertedCells("every step leads to inverted cells")
