"""Solutions different from a known one, by Newton's method from many starts."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from ..solutions.enumerate import PieceSolution
from ..solutions.multistart import Finder, certain_error, described
from ..solutions.newton_batch import Stack
from .load_inequality import Failure
from .load_known import Known
from .load_problem import LoadProblem

Array = NDArray[np.float64]
STARTS = 60  # of Newton's method once the first inequality has no multipliers
STEP_WORK, RATE = 30.0, 1e10  # operations of a start per (2 nc)^3, and per second
TOLERANCE = 1e-8  # error by the judge of another solution
EXACT = 1e-12  # error of solutions that fill a segment
DISTINCT = 1e-6  # scaled distance of two solutions that count as different


class OtherSolutions:
    """Looks for solutions different from a known one."""

    def __init__(self, local: LoadProblem, known: Known) -> None:
        self.problem, self.known = local.problem, known.r.reshape(-1, 2)
        self.stack = Stack.of(local.problem)
        self.random = np.random.default_rng(0)
        self.size = DISTINCT * (1 + np.abs(self.known).max(initial=0.0))

    @property
    def seconds(self) -> float:
        """Of Newton's method from one start, at most and roughly."""
        return STEP_WORK * self.stack.W.shape[0] ** 3 / RATE

    def near(self, failure: Failure, seconds: float) -> PieceSolution | None:
        """From where an inequality fails: along d, or at z / tau."""
        z = failure.direction
        if 4 * self.seconds > seconds or not z.any():
            return None
        if z.shape[1] == 5:
            tau = z[0, 4]
            starts = z[None, :, :2] / (tau if tau else 1.0)
        else:
            length = np.abs(z[:, :2]).max(initial=0.0)
            steps = np.array([-3.0, -0.3, 0.3, 3.0])[:, None, None]
            starts = self.known + steps * z[:, :2] / (length or 1.0)
        return self._first(self.stack.newton(starts, self.random))

    def far(self, seconds: float) -> PieceSolution | None:
        """From many starts."""
        began, finder = time.perf_counter(), Finder(self.stack, self.random, TOLERANCE)
        finder.add(self.known)
        if 2 * self.seconds > seconds:
            return None
        each = int(np.clip(0.2 / self.seconds, 2, STARTS))
        for _ in range(0, STARTS, each):
            finder.search(each)
            found = self._first(np.array(finder.found).reshape(-1, *self.known.shape))
            if found or time.perf_counter() - began > seconds:
                return found
        return None

    def _first(self, reached: Array) -> PieceSolution | None:
        for r in reached:
            if np.abs(r - self.known).max() > self.size and self._solves(r):
                return described(self.stack, r)
        return None

    def _solves(self, r: Array) -> bool:
        """True where r is a solution, and not only because all between the two nearly are."""
        error = self._error(r)
        between = self._error((r + self.known) / 2)
        return error <= TOLERANCE and (between > 100 * error or between <= EXACT)

    def _error(self, r: Array) -> float:
        return certain_error(self.problem, r * self.stack.to_r)
