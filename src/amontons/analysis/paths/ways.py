"""The two ways to follow a curve: exactly from event to event, or by continuation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from .continuation import Continuation
from .event_tracking import track
from .friction_path import FrictionPath
from .meeting import EventsSeen, LinesSeen
from .path import Branch, Event, PathProblem, Point, weight_of
from .straight import check_straight, leaving
from .tangents import FirstOrder, Tangent

Array = NDArray[np.float64]
Steps = Iterator[tuple[Point, Event | None]]


class Way(Protocol):
    """What both offer."""

    def leaving(self, problem: Any, y: Array, p: float) -> FirstOrder:
        """All one-sided tangents at a solution; SingularOperator with the reason if none."""
        ...

    def steps(
        self, problem: Any, y: Array, p: float, tangent: Tangent, interval: tuple[float, float]
    ) -> Steps:
        """Points and events along a tangent; ends with an event END."""
        ...

    def seen(self, problem: Any, n: int, known: Sequence[Branch]) -> LinesSeen | EventsSeen:
        """A memory of what was followed before, of problems with n unknowns."""
        ...


@dataclass(frozen=True)
class ByEvents:
    """Event tracking, for friction problems whose pieces are straight lines."""

    def leaving(self, problem: FrictionPath, y: Array, p: float) -> FirstOrder:
        """See `Way`."""
        system = leaving(problem, y, p)
        if not system.tangents:
            raise SingularOperator(
                "start: no solution curve leaves it; the solutions are not isolated there, "
                f"or do not depend on the parameter ({system.reason or 'first-order system'})"
            )
        return system

    def steps(
        self, problem: FrictionPath, y: Array, p: float, tangent: Tangent,
        interval: tuple[float, float],
    ) -> Steps:  # fmt: skip
        """See `Way`."""
        return track(problem, y, p, tangent, interval)

    def seen(self, problem: FrictionPath, n: int, known: Sequence[Branch]) -> LinesSeen:
        """See `Way`."""
        check_straight(problem)
        return LinesSeen(known)


@dataclass(frozen=True)
class Stepwise:
    """Continuation, for any path problem."""

    options: Continuation = Continuation()

    def leaving(self, problem: PathProblem, y: Array, p: float) -> FirstOrder:
        """See `Way`."""
        return self.options.start(problem, y, p)

    def steps(
        self, problem: PathProblem, y: Array, p: float, tangent: Tangent,
        interval: tuple[float, float],
    ) -> Steps:  # fmt: skip
        """See `Way`."""
        return self.options.walk(problem, y, p, tangent, interval)

    def seen(self, problem: PathProblem, n: int, known: Sequence[Branch]) -> EventsSeen:
        """See `Way`."""
        return EventsSeen(known, weight_of(problem, n))


def is_straight(problem: PathProblem) -> bool:
    """True where event tracking follows a problem."""
    return isinstance(problem, FrictionPath) and problem.straight and not problem.tresca


def way_of(problem: PathProblem, options: Continuation) -> Way:
    """Event tracking where it can, else continuation with these options."""
    return ByEvents() if is_straight(problem) else Stepwise(options)
