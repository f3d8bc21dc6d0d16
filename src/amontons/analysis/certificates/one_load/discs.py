"""The regions of a 3D problem about a known solution, divided until there is no other.

The whole problem is one region first: multipliers on friction discs (`discs.multipliers`) that
leave no other solution.  Where there are none, Newton's method looks for one from many starts,
and then the regions are divided (`discs.search`) until one is found or all are closed.
Solutions within 1e-10 (scaled) of each other count as one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline
from ....core.errors import InvalidInput
from ...scaled import Scaled
from ...solutions.discs.proof import DiscBox
from ...solutions.discs.search import DiscSearch
from ...solutions.enumerate import PieceSolution
from ...solutions.multistart import Finder, described
from ...solutions.newton_batch import polished
from ...tolerances import ON, REFINED, SOLVED
from .known import not_a_solution

Array = NDArray[np.float64]
POLISHED = 10.0  # operations of refining the solution per cube of the reactions


class DiscTree(DiscSearch):
    """Regions that are not closed yet; known (nc, 3): the solution, refined and scaled."""

    def __init__(self, scaled: Scaled, r: Array, deadline: Deadline) -> None:
        deadline.pay(POLISHED * float(scaled.q.size) ** 3)
        self.known, _ = polished(scaled, r / scaled.to_r)
        super().__init__(scaled, Finder(scaled, np.random.default_rng(0), SOLVED), deadline)
        apart = np.abs(self.known - r / scaled.to_r).max()
        if apart > REFINED * (1 + np.abs(self.known).max()) or not self.finder.add(self.known):
            raise not_a_solution(scaled.problem, r)
        if not self.queue:
            raise InvalidInput("solution: a contact that can not react penetrates")

    @property
    def other(self) -> PieceSolution | None:
        """Another solution, where one was found."""
        first, *rest = self.finder.found
        others = [r for r in rest if np.abs(r - first).max() > ON]
        return described(self.scaled, others[0]) if others else None

    @property
    def parts(self) -> int:
        """Regions that were closed."""
        return len(self.proofs) + len(self.linear)

    @property
    def branches(self) -> tuple[DiscBox, ...]:
        """What closed the regions, in the units of the problem."""
        return self.proof().boxes
