"""The relaxed least load of `relaxation`, contacts and faces decided one by one, best first.

A program whose motion slips both ways at a face, or opens a contact that presses, is replaced
by two in which that is decided.  What all that are left have for least bound is a bound; those
with none below the best state that is known are dropped.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import TimeUp
from ...core.onlookers import say
from .relaxation import Bounded, Decided, Decision, Relaxation

Array = NDArray[np.float64]
BOTH = 1e-6  # of the larger one, that a program may have of what excludes the other
Node = tuple[float, int, tuple[Decision, ...], Bounded]


class Branching:
    """Programs that are not decided yet; `motions` decides them.

    lower: no state below it, residual: what multipliers of its programs leave at most.
    """

    def __init__(self, relaxed: Relaxation, most: float, deadline: Deadline) -> None:
        self.relaxed, self.most, self.deadline = relaxed, most, deadline
        self.nodes: list[Node] = []
        self.settled = np.inf  # least bound of programs that are not on the list any more
        self.lower = self.residual = 0.0
        self.programs = 0

    def motions(self) -> Iterator[Array]:
        """The motion of every program, as long as there is time and something to decide."""
        try:
            yield from self._solved((), 0.0)
            while self.nodes:
                parent = value, _, decided, answer = self.nodes[0]
                self.lower = min(value, self.settled, self.most)
                if self.lower >= min(self.most, self.settled):
                    return
                choice = self._choice(answer)
                if choice is None:
                    self.settled = min(self.settled, value)
                    heapq.heappop(self.nodes)
                    continue
                pair = [(*decided, one) for one in choice]
                found = [list(self._solved(both, value)) for both in pair]
                self.nodes.remove(parent)  # not before: time may end while its parts are solved
                heapq.heapify(self.nodes)
                yield from (w for motions in found for w in motions)
            self.lower = min(self.most, self.settled)
        except TimeUp:
            return

    def lower_cut(self, upper: float) -> None:
        """States at `upper` are known: others are looked for below it only."""
        self.most = min(self.most, upper)
        self.nodes = [node for node in self.nodes if node[0] < self.most]
        heapq.heapify(self.nodes)
        self.lower = min([self.most, self.settled, *(node[0] for node in self.nodes[:1])])

    def _solved(self, decided: tuple[Decision, ...], least: float) -> Iterator[Array]:
        """Put the program of some decisions on the list, and its motion out."""
        say(f"load at which motions begin: {self.programs} programs, from {self.lower:.4g}")
        answer = self.relaxed.bound(self.most, self.deadline, decided)
        self.programs += 1
        self.residual = max(self.residual, answer.residual)
        value = max(least, answer.value)  # what failed is no worse than what it came from
        if answer.motion is None and answer.value > 0:
            self.settled = min(self.settled, value)  # nothing below `most`, as far as proved
            return
        heapq.heappush(self.nodes, (value, self.programs, decided, answer))
        if answer.motion is not None:
            yield answer.motion

    def _choice(self, answer: Bounded) -> tuple[Decision, Decision] | None:
        """What to decide next, None where nothing is left or the program failed."""
        if answer.slip is None or answer.normal is None or answer.opening is None:
            return None
        both = answer.slip.min(axis=1) / max(float(answer.slip.max(initial=0.0)), 1e-300)
        apart = np.minimum(*(x / max(float(x.max(initial=0.0)), 1e-300)
                             for x in (answer.normal, answer.opening)))  # fmt: skip
        f, i = int(both.argmax()), int(apart.argmax())
        if max(both[f], apart[i]) <= BOTH:
            return None
        if both[f] >= apart[i]:
            return (Decided.FORWARD, f), (Decided.BACKWARD, f)
        return (Decided.CLOSED, i), (Decided.OPEN, i)
