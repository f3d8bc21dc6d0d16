"""A tree of regions that together are everything a problem allows: closed, or divided.

In 2D a region is a state of every contact, in 3D an arc of slip directions besides; a region
with two directions is a disc of dimension one.  A kind of region says how one is looked at.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from ...core.clock import Deadline
from ...core.onlookers import say
from ..scaled import Scaled

FINDING = 0.2  # share of the time left that goes into looking for another solution


class RegionTree(ABC):
    """The regions that are not closed yet, the next one last, and what was found on the way.

    examined: regions looked at.  undecided: those that could be neither closed nor divided.
    stopped: by the clock, or because there are too many contacts.
    """

    unresolved = False  # is it that solutions can not be told apart?
    LOOK = 50.0  # operations of looking at a region per cube of the reactions, at least

    def __init__(self, scaled: Scaled, deadline: Deadline, queue: list[Any]) -> None:
        self.scaled, self.deadline, self.queue = scaled, deadline, queue
        self.examined = self.undecided = 0
        self.stopped = False

    @abstractmethod
    def _look_at(self, region: Any, /) -> list[Any]:
        """Regions that remain of one; none where it is closed or has to be given up."""

    @property
    @abstractmethod
    def several(self) -> bool:
        """True where more than one solution is known."""

    @abstractmethod
    def _look_elsewhere(self, deadline: Deadline) -> None:
        """Look for solutions from many starts."""

    @property
    def complete(self) -> bool:
        """True when every region was closed."""
        return not self.queue and not self.undecided

    @property
    def affords_step(self) -> bool:
        """True where there is time to look at a region."""
        return not self.deadline.passed and self.deadline.affords(self._work)

    @property
    def _work(self) -> float:
        return self.LOOK * float(self.scaled.q.size) ** 3

    def step(self) -> None:
        """Close or divide the region that is next."""
        self.deadline.spend(self._work)
        self.examined += 1
        say(f"this load: region {self.examined}, {len(self.queue)} to be looked at")
        self.queue += reversed(self._look_at(self.queue.pop()))

    def run(self, *, until_several: bool = False) -> None:
        """Divide until all is closed, the clock runs out, or two solutions are known."""
        while self.queue and not (until_several and self.several):
            if not self.affords_step:
                self.stopped = True
                return
            self.step()

    def close(self) -> None:
        """The whole, then other solutions, then its parts, as far as time allows."""
        if self.affords_step:
            self.step()
        if not (self.complete or self.several):
            self._look_elsewhere(self.deadline.share(FINDING))
            self.run(until_several=True)
