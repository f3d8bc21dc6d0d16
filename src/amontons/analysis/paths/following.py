"""Following a solution curve both ways, to its ends or until it meets itself or another."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...errors import InvalidInput, SingularOperator
from ...problem import FrictionProblem
from .continuation import Continuation
from .event_tracking import check_straight, leaving, track
from .first_order import Tangent
from .friction_path import FrictionPath
from .path import (
    Branch,
    Event,
    EventKind,
    PathProblem,
    Point,
    Stop,
    corrected,
    joined,
    same,
    weight_of,
)

Array = NDArray[np.float64]
Steps = Iterator[tuple[Point, Event | None]]
Passed = Callable[[Point, Event | None], Stop | None]
Callback = Callable[[Point, Event | None], bool | None]
SOLVED = 1e-9  # scaled residual of a state that counts as a solution
PLACE = 1e-7  # relative distance of two located events that count as one
NOTHING = 1e-12  # weighted length that counts as none
CHORD = 0.1  # distance of a chord to the start, in its length, at which it passes through


class Method(Enum):
    """How a curve is followed."""

    EVENTS = "events"
    GENERAL = "general"


@dataclass(frozen=True)
class Limits:
    """Where to end: the interval of the parameter, points per direction, seconds, a callback.

    callback(point, event) is called at every point; True stops.
    """

    interval: tuple[float, float]
    max_points: int = 100_000
    time_limit: float | None = None
    callback: Callback | None = None

    def __post_init__(self) -> None:
        low, high = self.interval
        if not (np.isfinite([low, high]).all() and low < high):
            raise InvalidInput(f"interval: expected two numbers a < b, got {self.interval}")
        if self.max_points < 2:
            raise InvalidInput(f"max_points: expected at least 2, got {self.max_points}")
        if self.time_limit is not None and not self.time_limit > 0:
            raise InvalidInput(f"time_limit: expected seconds > 0, got {self.time_limit!r}")


@dataclass(frozen=True, eq=False)
class Half:
    """One direction of a branch."""

    points: list[Point]
    events: list[Event]
    stop: Stop


def track_both(
    path: FrictionPath, y: Array, p: float, limits: Limits, *,
    known: Sequence[Branch] = (), tangent: Tangent | None = None,
) -> Branch:  # fmt: skip
    """The exact branch through a solution, both ways; only along `tangent` where it is given.

    known: other branches; this one ends where it meets a line of theirs, every line being part
    of one branch only.
    """
    began = time.perf_counter()
    check_straight(path)
    system = leaving(path, y, p)
    if tangent is None:
        forth, back, extra = _both_ways(system.tangents, weight_of(path, len(y)))
    else:
        forth, back, extra = tangent, None, ()
    if forth is None and back is None:
        raise SingularOperator(
            "start: no solution curve leaves it; the solutions are not isolated there, "
            f"or do not depend on the parameter ({system.reason or 'first-order system'})"
        )
    halves: list[Half] = []
    seen = {str(point.piece) for branch in known for point in branch.points}
    for one in (forth, back):
        if one is None:
            halves.append(Half([], [], Stop.NOT_STARTED if tangent else Stop.DEAD_END))
            continue
        if halves and halves[0].stop is Stop.CLOSED:
            halves.append(Half([], [], Stop.CLOSED))
            continue
        walk = track(path, y, p, one, limits.interval)
        half = _collected(walk, limits, PassedLines(str(one.piece), seen))
        halves.append(half)
        seen |= {str(point.piece) for point in half.points}
    branch = _branch(path, halves[0], halves[1], began)
    return _with_branch_point(branch, y, p, system.tangents if extra else ())


def _both_ways(
    tangents: tuple[Tangent, ...], weight: float
) -> tuple[Tangent | None, Tangent | None, tuple[Tangent, ...]]:
    """(forth, back, others): forth is where the parameter grows fastest, back most opposite."""
    if not tangents:
        return None, None, ()
    forth = max(tangents, key=lambda t: t.rate)

    def along(t: Tangent) -> float:
        return weight * float(t.direction @ forth.direction) + t.rate * forth.rate

    rest = sorted((t for t in tangents if t is not forth), key=along)
    return forth, (rest[0] if rest else None), tuple(rest[1:])


def _collected(steps: Steps, limits: Limits, passed: Passed) -> Half:
    """The points of one direction until it ends, meets what is known, or a limit stops it."""
    began = time.perf_counter()
    points: list[Point] = []
    events: list[Event] = []
    for point, event in steps:
        points.append(point)
        if event is not None:
            events.append(event)
        if event is not None and event.stop is not None:
            if len(points) > 1 and point.arclength - points[-2].arclength <= NOTHING:
                points.pop()  # it began at the end
            return Half(points, events, event.stop)
        stop = passed(point, event)
        if stop is None:
            stop = _limited(point, event, limits, len(points), began)
        if stop is not None:
            return Half(points, [*events, _ended(point, stop)], stop)
    raise AssertionError("a walk ends with an event")  # track and Continuation promise it


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
            if any(_same_place(event, other) for other in self.own):
                return Stop.CLOSED
            if any(_same_place(event, other) for other in self.known):
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


def _same_place(a: Event, b: Event) -> bool:
    near = abs(a.parameter - b.parameter) <= PLACE * max(1.0, abs(b.parameter))
    return near and same(a.state, b.state, PLACE)


def _limited(
    point: Point, event: Event | None, limits: Limits, count: int, began: float
) -> Stop | None:
    """The limit that is reached, if any."""
    if limits.callback is not None and limits.callback(point, event):
        return Stop.STOPPED
    if count >= limits.max_points:
        return Stop.MAX_POINTS
    if limits.time_limit is not None and time.perf_counter() - began > limits.time_limit:
        return Stop.TIME_LIMIT
    return None


def _ended(point: Point, stop: Stop) -> Event:
    return Event(EventKind.END, point.parameter, point.state, point.arclength,
                 before=point.piece, stop=stop)  # fmt: skip


def _branch(problem: PathProblem, forth: Half, back: Half, began: float) -> Branch:
    """Both halves as one branch; a fold at the very start belongs to neither and is added."""
    if not forth.points:
        forth, back = back, forth
    events = list(forth.events)
    if back.points and forth.points and forth.points[0].rate * back.points[0].rate > 0:
        start = forth.points[0]
        events.insert(0, Event(EventKind.FOLD, start.parameter, start.state,
                               before=back.points[0].piece, after=start.piece))  # fmt: skip
    return joined(
        problem, (back.points, back.events, back.stop), (forth.points, events, forth.stop),
        linear=isinstance(problem, FrictionPath) and problem.straight,
        seconds=time.perf_counter() - began, closed=forth.stop is Stop.CLOSED,
        name=getattr(problem, "name", "parameter"),
    )  # fmt: skip


# ----------------------------------------------------------- the way that suits a problem
def is_exact(problem: PathProblem) -> bool:
    """True where event tracking follows a problem."""
    return isinstance(problem, FrictionPath) and problem.straight and not problem.tresca


def leaving_from(
    problem: PathProblem, y: Array, p: float, options: Continuation
) -> tuple[Tangent, ...]:
    """All one-sided tangents at a solution.

    Raises SingularOperator with the reason where none could be found.
    """
    if not is_exact(problem):
        return options.start(problem, y, p)
    system = leaving(problem, y, p)  # type: ignore[arg-type]
    if not system.tangents:
        raise SingularOperator(system.reason or "solutions are not isolated there")
    return system.tangents


def steps_from(
    problem: PathProblem, y: Array, p: float, tangent: Tangent,
    interval: tuple[float, float], options: Continuation,
) -> Steps:  # fmt: skip
    """The points and events along a tangent, by event tracking or continuation."""
    if is_exact(problem):
        return track(problem, y, p, tangent, interval)  # type: ignore[arg-type]
    return options.walk(problem, y, p, tangent, interval)


# ---------------------------------------------------------------------- where to begin
def exact_state(path: FrictionPath, p: float) -> Array:
    """One exact solution at a parameter, by event tracking from a state without contact.

    All contacts are lifted off and let down again.  Raises SingularOperator where that path
    ends before it comes down (W is not positive definite).
    """
    problem = path.at(p).condensed()
    q = np.asarray(problem.q)
    size = float(np.abs(path.free(p)).max(initial=0)) or 1.0
    lift = np.zeros_like(q)
    lift[:, 0] = (2 * size * path.to_u.reshape(q.shape))[:, 0]
    lifted = FrictionProblem.from_delassus(problem.W, q + lift, problem.mu)
    down = FrictionPath(lifted, FrictionProblem.from_delassus(problem.W, q, problem.mu))
    tangent = next(t for t in leaving(down, np.zeros(q.size), 0.0).tangents if t.rate > 0)
    *_, (point, event) = track(down, np.zeros(q.size), 0.0, tangent, (-1.0, 1.0))
    assert event is not None
    if event.stop is not Stop.INTERVAL or point.parameter < 1:
        raise SingularOperator(
            f"start: no solution was found at {p:g}: {event.stop.advice if event.stop else ''}"
        )
    return path.state((point.state * down.to_r).reshape(q.shape))


def polished(path: PathProblem, y: Array, p: float) -> Array:
    """The exact solution next to an approximate one, by Newton steps at fixed parameter.

    At a fold these do not converge: there a state is taken as it is if its residual is small.
    Raises InvalidInput where the state is no solution to within some per mille.
    """
    found = corrected(path, y, p)
    if found is None and np.abs(path.residual(y, p)).max(initial=0) <= SOLVED:
        return y
    if found is None or np.abs(found - y).max(initial=0) > 1e-3 * max(1.0, np.abs(y).max()):
        rest = float(np.abs(path.residual(y, p)).max(initial=0))
        raise InvalidInput(
            f"start: expected a solution at {p:g}, got a state with residual {rest:.1e}"
        )
    return found


def continue_both(
    problem: PathProblem, y: Array, p: float, limits: Limits,
    options: Continuation | None = None, *,
    known: Sequence[Branch] = (), tangent: Tangent | None = None,
) -> Branch:  # fmt: skip
    """The branch through a solution of any path problem by continuation, both ways.

    Only along `tangent` where it is given.  known: other branches; this one ends at the first
    event of theirs that it meets.
    """
    began = time.perf_counter()
    options = options or Continuation()
    weight = weight_of(problem, len(y))
    if tangent is None:
        tangents = options.start(problem, y, p)
        forth, back, extra = _both_ways(tangents, weight)
    else:
        tangents, forth, back, extra = (tangent,), tangent, None, ()
    met = [event for branch in known for event in branch.events]
    halves: list[Half] = []
    for one in (forth, back):
        if one is None or (halves and halves[0].stop is Stop.CLOSED):
            closed = bool(halves) and halves[0].stop is Stop.CLOSED
            halves.append(Half([], [], Stop.CLOSED if closed else Stop.NOT_STARTED))
            continue
        walk = options.walk(problem, y, p, one, limits.interval)
        start = Point(p, y, one.direction, one.rate, one.piece)
        half = _collected(walk, limits, PassedEvents(start, met, weight))
        halves.append(half)
        met += half.events
    branch = _branch(problem, halves[0], halves[1], began)
    return _with_branch_point(branch, y, p, tangents if extra else ())


def _with_branch_point(
    branch: Branch, y: Array, p: float, tangents: Sequence[Tangent]
) -> Branch:
    """The branch with an event at its start, from which other branches leave too."""
    if not tangents:
        return branch
    rows = np.array([np.append(t.direction, t.rate) for t in tangents])
    event = Event(EventKind.BRANCH, p, y, directions=rows)
    events = sorted([*branch.events, event], key=lambda e: e.arclength)
    return replace(branch, events=tuple(events))


def follow_path(
    problem: PathProblem, y: Array, p: float, limits: Limits, *,
    method: Method | None = None, options: Continuation | None = None,
    known: Sequence[Branch] = (),
) -> Branch:  # fmt: skip
    """The branch through a solution: by event tracking where it is straight, else generally.

    The state is corrected first; raises InvalidInput where it is far from a solution.
    """
    if method is None:
        method = Method.EVENTS if is_exact(problem) and options is None else Method.GENERAL
    y = polished(problem, np.asarray(y, dtype=float), p)
    if method is Method.GENERAL:
        return continue_both(problem, y, p, limits, options, known=known)
    if not isinstance(problem, FrictionPath):
        raise InvalidInput("method: event tracking follows friction problems only")
    return track_both(problem, y, p, limits, known=known)
