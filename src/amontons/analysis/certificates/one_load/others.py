"""Solutions different from a known one, by Newton's method from many starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import RATE, Deadline
from ...scaled import Scaled
from ...solutions.enumerate import PieceSolution
from ...solutions.multistart import Finder, described
from ...solutions.newton_batch import newton
from ...tolerances import BELONGS, SEGMENT, SOLVED
from .inequality import Failure
from .known import Known

Array = NDArray[np.float64]
STARTS = 60  # of Newton's method once the first inequality has no multipliers
STEP_WORK = 30.0  # operations of a start per (2 nc)^3


class OtherSolutions:
    """Looks for solutions different from a known one."""

    def __init__(self, scaled: Scaled, known: Known) -> None:
        self.scaled, self.known = scaled, known.r.reshape(-1, 2)
        self.random = np.random.default_rng(0)
        self.size = BELONGS * (1 + np.abs(self.known).max(initial=0.0))

    @property
    def work(self) -> float:
        """Operations of Newton's method from one start, at most and roughly."""
        return STEP_WORK * self.scaled.W.shape[0] ** 3

    def near(self, failure: Failure, deadline: Deadline) -> PieceSolution | None:
        """From where an inequality fails: along d, or at z / tau."""
        z = failure.direction
        if not deadline.affords(4 * self.work) or not z.any():
            return None
        if z.shape[1] == 5:
            tau = z[0, 4]
            starts = z[None, :, :2] / (tau if tau else 1.0)
        else:
            length = np.abs(z[:, :2]).max(initial=0.0)
            steps = np.array([-3.0, -0.3, 0.3, 3.0])[:, None, None]
            starts = self.known + steps * z[:, :2] / (length or 1.0)
        return self._first(newton(self.scaled, starts, self.random, deadline=deadline))

    def far(self, deadline: Deadline) -> PieceSolution | None:
        """From many starts."""
        if not deadline.affords(2 * self.work):
            return None
        finder = Finder(self.scaled, self.random, SOLVED)
        finder.add(self.known)
        each = int(np.clip(0.2 * RATE / self.work, 2, STARTS))
        for _ in range(0, STARTS, each):
            finder.search(each, deadline)
            found = self._first(np.array(finder.found).reshape(-1, *self.known.shape))
            if found or deadline.passed:
                return found
        return None

    def _first(self, reached: Array) -> PieceSolution | None:
        for r in reached:
            if np.abs(r - self.known).max() > self.size and self._solves(r):
                return described(self.scaled, r)
        return None

    def _solves(self, r: Array) -> bool:
        """True where r is a solution, and not only because all between the two nearly are."""
        error = self._error(r)
        between = self._error((r + self.known) / 2)
        return error <= SOLVED and (between > 100 * error or between <= SEGMENT)

    def _error(self, r: Array) -> float:
        return self.scaled.problem.certain_error(r * self.scaled.to_r)
