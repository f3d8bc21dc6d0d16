"""A tree of regions that together are everything a problem allows: closed, or divided.

A region gives every contact the statuses it may have, and in 3D an arc for its direction of
slip; in 2D that has two directions, the disc has dimension one.  A contact is decided: free or
closed, stick or slip, then slip + or -, or halves of the arc.  A tree says how a region is
looked at.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.onlookers import say
from ..scaled import Scaled
from .discs.sets import Region, Regions

Array = NDArray[np.float64]

FINDING = 0.2  # share of the time left that goes into looking for another solution


class RegionTree(ABC):
    """The regions that are not closed yet, the next one last, and what was found on the way.

    examined: regions looked at.  undecided: those that could be neither closed nor divided.
    stopped: by the clock, or because there are too many contacts.
    """

    unresolved = False  # is it that solutions can not be told apart?
    # operations of looking at a region, besides what its multipliers and starts count
    # themselves: always, of every contact, and per cube of the reactions
    LOOK = (1.5e7, 1.5e6, 50.0)

    def __init__(self, scaled: Scaled, deadline: Deadline) -> None:
        self.scaled, self.deadline = scaled, deadline
        # every contact undecided; those that can not react are free
        root = tuple(Region() if able else Region("f") for able in scaled.reacts)
        self.queue: list[Regions] = [root]
        self.examined = self.undecided = 0
        self.stopped = False

    @abstractmethod
    def _look_at(self, regions: Regions, /) -> list[Regions]:
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
        fixed, each, cube = self.LOOK
        return fixed + each * len(self.scaled.mu) + cube * float(self.scaled.q.size) ** 3

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

    # ------------------------------------------------------------------ to divide
    def _parts_of(
        self, regions: Regions, scores: Array, inside: Sequence[Array] = ()
    ) -> list[Regions]:
        """The parts of a region by the most promising contact; undecided where there are none.

        inside: solutions that are known in it.
        """
        for p in self._order(regions, scores):
            parts = self._divided(regions, p, inside)
            if parts:
                return parts
        self.undecided += 1
        return []

    def _order(self, regions: Regions, scores: Array) -> Iterator[int]:
        """Contacts to divide, the most promising first."""
        width = [2 * np.pi if own.letter in ".c" else own.half * (own.letter == "l")
                 for own in regions]  # fmt: skip
        yield from sorted(range(len(regions)), key=lambda p: (-scores[p], -width[p]))

    def _divided(self, regions: Regions, p: int, inside: Sequence[Array]) -> list[Regions]:
        """The parts of regions by contact p, [] where it is decided to the last."""
        own = regions[p]
        if own.letter == ".":
            parts = [Region("f"), Region("c")]
        elif self.scaled.mu[p] == 0:
            return []
        elif own.letter == "c":
            parts = [Region("s"), replace(own, letter="l")]
        elif own.letter == "l":
            parts = self._slip_divided(own, p, inside)
        else:
            return []
        return [(*regions[:p], part, *regions[p + 1 :]) for part in parts]

    def _slip_divided(self, own: Region, p: int, inside: Sequence[Array]) -> list[Region]:
        """Parts of the directions of slip of contact p: in 2D there are two."""
        return [Region("+"), Region("-")]
