"""Where a walk meets what was followed before: its own start, or another branch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .path import Branch, Event, EventKind, Point, Stop, same

PLACE = 1e-7  # relative distance of two located events that count as one
CHORD = 0.1  # distance of a chord to the start, in its length, at which it passes through


class LinesSeen:
    """The straight lines of other branches and of this one: every one is part of one branch."""

    def __init__(self, known: Sequence[Branch]) -> None:
        self.pieces = {str(point.piece) for branch in known for point in branch.points}

    def begin(self, start: Point) -> PassedLines:
        """What to ask on the way from a start."""
        return PassedLines(str(start.piece), self.pieces)

    def keep(self, points: Sequence[Point], events: Sequence[Event]) -> None:
        """Remember one direction."""
        self.pieces |= {str(point.piece) for point in points}


class EventsSeen:
    """The events of other branches and of this one."""

    def __init__(self, known: Sequence[Branch], weight: float) -> None:
        self.events = [event for branch in known for event in branch.events]
        self.weight = weight

    def begin(self, start: Point) -> PassedEvents:
        """What to ask on the way from a start."""
        return PassedEvents(start, self.events, self.weight)

    def keep(self, points: Sequence[Point], events: Sequence[Event]) -> None:
        """Remember one direction."""
        self.events += events


class PassedLines:
    """Tells when a line is entered for the second time: a pattern has one line only."""

    def __init__(self, first: str, known: set[str]) -> None:
        self.own, self.known = {first}, known

    def __call__(self, point: Point, event: Event | None) -> Stop | None:
        """CLOSED, JOINED, or None where the line is new."""
        if event is None:
            return None
        piece = str(point.piece)
        if piece in self.own or piece in self.known:
            return Stop.CLOSED if piece in self.own else Stop.JOINED
        self.own.add(piece)
        return None


class PassedEvents:
    """Tells when an event is met for the second time, or the start; events lie precisely."""

    def __init__(self, start: Point, known: Sequence[Event], weight: float) -> None:
        self.start, self.weight = start, weight
        self.known = [e for e in known if e.kind in (EventKind.FOLD, EventKind.STATUS)]
        self.own: list[Event] = []
        self.before = start

    def __call__(self, point: Point, event: Event | None) -> Stop | None:
        """CLOSED, JOINED, or None where all is new."""
        before, self.before = self.before, point
        if event is not None and event.kind in (EventKind.FOLD, EventKind.STATUS):
            if any(_same_event(event, other) for other in self.own):
                return Stop.CLOSED
            if any(_same_event(event, other) for other in self.known):
                return Stop.JOINED
            self.own.append(event)
        return Stop.CLOSED if self._through_start(before, point) else None

    def _through_start(self, a: Point, b: Point) -> bool:
        """True where the chord from a to b passes the start in the sense in which it began."""
        s = self.start
        if a is s or b.arclength == 0:
            return False
        along = [
            self.weight * float((x.state - s.state) @ s.direction)
            + (x.parameter - s.parameter) * s.rate
            for x in (a, b)
        ]
        if not along[0] < 0 <= along[1]:
            return False
        t = along[0] / (along[0] - along[1])
        off = a.state + t * (b.state - a.state) - s.state
        off_p = a.parameter + t * (b.parameter - a.parameter) - s.parameter
        length = np.sqrt(self.weight * off @ off + off_p**2)
        return bool(length <= CHORD * (b.arclength - a.arclength))


def _same_event(a: Event, b: Event) -> bool:
    """True for one place between the same two pieces; others may follow closely."""
    if {a.before, a.after} != {b.before, b.after}:
        return False
    near = abs(a.parameter - b.parameter) <= PLACE * max(1.0, abs(b.parameter))
    return near and same(a.state, b.state, PLACE)
