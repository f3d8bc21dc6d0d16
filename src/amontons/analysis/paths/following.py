"""Following a solution curve both ways, to its ends or until it meets itself or another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, TimeUp
from .continuation import Continuation
from .friction_path import FrictionPath
from .meeting import PassedEvents, PassedLines
from .path import (
    Branch,
    Event,
    EventKind,
    PathProblem,
    Point,
    Stop,
    joined,
    name_of,
    timed,
    weight_of,
)
from .starting import polished
from .tangents import FirstOrder, Tangent
from .ways import ByEvents, Steps, Stepwise, Way, is_straight

Array = NDArray[np.float64]
Callback = Callable[[Point, Event | None], bool | None]
NOTHING = 1e-12  # weighted length that counts as none


class Method(Enum):
    """How a curve is followed."""

    EVENTS = "events"
    GENERAL = "general"


@dataclass(frozen=True)
class Limits:
    """Where to end: the interval of the parameter, points per direction, seconds, a callback.

    time_limit: for all that these limits are given to, from now on: `deadline`.
    callback(point, event) is called at every point; True stops.
    """

    interval: tuple[float, float]
    max_points: int = 100_000
    time_limit: TimeLimit = None
    callback: Callback | None = None
    deadline: Deadline = field(default=NEVER, init=False)

    def __post_init__(self) -> None:
        low, high = self.interval
        if not (np.isfinite([low, high]).all() and low < high):
            raise InvalidInput(f"interval: expected two numbers a < b, got {self.interval}")
        if self.max_points < 2:
            raise InvalidInput(f"max_points: expected at least 2, got {self.max_points}")
        object.__setattr__(self, "deadline", deadline_of(self.time_limit))


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
    return _both(path, y, p, limits, ByEvents(), known, tangent)


def continue_both(
    problem: PathProblem, y: Array, p: float, limits: Limits,
    options: Continuation | None = None, *,
    known: Sequence[Branch] = (), tangent: Tangent | None = None,
) -> Branch:  # fmt: skip
    """The branch through a solution of any path problem by continuation, both ways.

    Only along `tangent` where it is given.  known: other branches; this one ends at the first
    event of theirs that it meets.
    """
    return _both(problem, y, p, limits, Stepwise(options or Continuation()), known, tangent)


def _both(
    problem: PathProblem, y: Array, p: float, limits: Limits, way: Way,
    known: Sequence[Branch], tangent: Tangent | None,
) -> Branch:  # fmt: skip
    began, problem = now(), timed(problem, limits.deadline)
    seen = way.seen(problem, len(y), known)
    forth, back, extra = tangent, None, False
    system = FirstOrder(())
    if tangent is None:
        try:
            system = way.leaving(problem, y, p)
        except TimeUp:
            return _start_alone(problem, y, p, began)
        forth, back, extra = _both_ways(system.tangents, weight_of(problem, len(y)))
    halves: list[Half] = []
    for one in (forth, back):
        if halves and halves[0].stop is Stop.CLOSED:
            halves.append(Half([], [], Stop.CLOSED))
        elif one is None:
            halves.append(Half([], [], Stop.NOT_STARTED if tangent else Stop.DEAD_END))
        else:
            start = Point(p, y, one.direction, one.rate, one.piece, problem=problem)
            steps = way.steps(problem, y, p, one, limits.interval)
            halves.append(_collected(steps, limits, seen.begin(start), start))
            seen.keep(halves[-1].points, halves[-1].events)
    branch = _branch(problem, halves[0], halves[1], began, extra)
    return _with_branch_point(branch, y, p, system if extra or system.sets else FirstOrder(()))


def _both_ways(
    tangents: tuple[Tangent, ...], weight: float
) -> tuple[Tangent, Tangent | None, bool]:
    """(forth, back, are there others?): the fastest growing parameter, and most opposite."""
    forth = max(tangents, key=lambda t: t.rate)

    def along(t: Tangent) -> float:
        return weight * float(t.direction @ forth.direction) + t.rate * forth.rate

    rest = sorted((t for t in tangents if t is not forth), key=along)
    return forth, (rest[0] if rest else None), len(rest) > 1


def _collected(
    steps: Steps, limits: Limits, passed: PassedLines | PassedEvents, start: Point
) -> Half:
    """The points of one direction until it ends, meets what is known, or a limit stops it."""
    points: list[Point] = []
    events: list[Event] = []
    for point, event in _until_time_is_up(steps):
        points.append(point)
        if event is not None:
            events.append(event)
        if event is not None and event.stop is not None:
            if len(points) > 1 and point.arclength - points[-2].arclength <= NOTHING:
                points.pop()  # it began at the end
            return Half(points, events, event.stop)
        stop = passed(point, event)
        if stop is None:
            stop = _limited(point, event, limits, len(points))
        if stop is not None:
            return Half(points, [*events, _ended(point, stop)], stop)
    points = points or [start]
    return Half(points, [*events, _ended(points[-1], Stop.TIME_LIMIT)], Stop.TIME_LIMIT)


def _start_alone(problem: PathProblem, y: Array, p: float, began: float) -> Branch:
    """The branch of one point where time is up before its tangent is known, which is zero."""
    piece = name_of(problem.piece(y, p))
    start = Point(p, y, np.zeros_like(y), 0.0, piece, problem=problem)
    half = Half([start], [_ended(start, Stop.TIME_LIMIT)], Stop.TIME_LIMIT)
    return _branch(problem, half, Half([], [], Stop.TIME_LIMIT), began, False)


def _until_time_is_up(steps: Steps) -> Steps:
    """The same, without an end where time is up in the middle of a step."""
    with suppress(TimeUp):
        yield from steps
        raise AssertionError("a walk ends with an event")  # track and Continuation promise it


def _limited(
    point: Point, event: Event | None, limits: Limits, count: int
) -> Stop | None:
    """The limit that is reached, if any."""
    if limits.callback is not None and limits.callback(point, event):
        return Stop.STOPPED
    if count >= limits.max_points:
        return Stop.MAX_POINTS
    if limits.deadline.passed:
        return Stop.TIME_LIMIT
    return None


def _ended(point: Point, stop: Stop) -> Event:
    return Event(EventKind.END, point.parameter, point.state, point.arclength,
                 before=point.piece, stop=stop, problem=point.problem)  # fmt: skip


def _branch(
    problem: PathProblem, forth: Half, back: Half, began: float, branches: bool
) -> Branch:
    """Both halves as one branch; branches: others leave the start, too."""
    if not forth.points:
        forth, back = back, forth
    events = [*_at_start(forth, back, branches), *forth.events]
    return joined(
        timed(problem, NEVER), (back.points, back.events, back.stop),
        (forth.points, events, forth.stop),
        linear=isinstance(problem, FrictionPath) and problem.straight,
        seconds=now() - began, closed=forth.stop is Stop.CLOSED,
        name=getattr(problem, "name", "parameter"),
    )  # fmt: skip


def _at_start(forth: Half, back: Half, branches: bool) -> list[Event]:
    """A fold, or a change of status, at the very start belongs to neither half."""
    if not (forth.points and back.points):
        return []
    one, other = forth.points[0], back.points[0]
    turns = one.rate * other.rate > 0
    changes = one.piece != other.piece and min(len(forth.points), len(back.points)) > 1
    if not turns and (branches or not changes):
        return []
    kind = EventKind.FOLD if turns else EventKind.STATUS
    return [Event(kind, one.parameter, one.state, before=other.piece, after=one.piece,
                  problem=one.problem)]  # fmt: skip


def _with_branch_point(
    branch: Branch, y: Array, p: float, system: FirstOrder
) -> Branch:
    """The branch with an event at its start, from which other branches leave too."""
    if not system.tangents:
        return branch
    rows = np.array([np.append(t.direction, t.rate) for t in system.tangents])
    event = Event(EventKind.BRANCH, p, y, directions=rows, detail=system.reason,
                  problem=branch.problem)  # fmt: skip
    events = sorted([*branch.events, event], key=lambda e: e.arclength)
    return replace(branch, events=tuple(events))


def follow_along(
    problem: PathProblem, y: Array, p: float, limits: Limits, tangent: Tangent,
    options: Continuation | None = None,
) -> Branch:  # fmt: skip
    """The branch from an exact solution along one tangent, as far as `follow_path` does."""
    if is_straight(problem):
        return track_both(problem, y, p, limits, tangent=tangent)  # type: ignore[arg-type]
    return continue_both(problem, y, p, limits, options, tangent=tangent)


def follow_path(
    problem: PathProblem, y: Array, p: float, limits: Limits, *,
    method: Method | None = None, options: Continuation | None = None,
    known: Sequence[Branch] = (),
) -> Branch:  # fmt: skip
    """The branch through a solution: by event tracking where it is straight, else generally.

    The state is corrected first; raises InvalidInput where it is far from a solution.
    """
    if method is None:
        method = Method.EVENTS if is_straight(problem) and options is None else Method.GENERAL
    y = polished(problem, np.asarray(y, dtype=float), p)
    if method is Method.GENERAL:
        return continue_both(problem, y, p, limits, options, known=known)
    if not isinstance(problem, FrictionPath):
        raise InvalidInput("method: event tracking follows friction problems only")
    return track_both(problem, y, p, limits, known=known)
