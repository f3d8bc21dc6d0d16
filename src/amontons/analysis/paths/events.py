"""Points and events of a solution curve, and why a curve ends."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .index_sets import IndexSets, told_rates, told_sets

if TYPE_CHECKING:
    from .contact_rates import ContactRates

Array = NDArray[np.float64]


class EventKind(Enum):
    """What happens at a point of a branch; the names in lower case are those in JSON."""

    FOLD = "The parameter turns back."
    STATUS = "The branch enters another piece."
    BRANCH = "More than two one-sided branches meet here."
    END = "The branch stops here, for the reason given."


class Stop(Enum):
    """Why a branch ends; the value is one sentence for the user."""

    INTERVAL = "The end of the interval was reached."
    CLOSED = "The branch closed: it came back to where it began."
    JOINED = "The branch ran into one that had been followed before."
    UNBOUNDED = "The solutions run to infinity at one value of the parameter."
    DEAD_END = "No other one-sided branch leaves this point."
    BRANCHES = "Several branches leave this point; they are listed in the event."
    SINGULAR = "The tangent is not unique here and the first-order system did not help."
    STEP_TOO_SMALL = (
        "The corrector fails at the smallest step: allow a smaller one, or looser tolerances."
    )
    LOST = "The corrector fails here and no tangent switch leads on."
    MAX_POINTS = "The number of points allowed is used up; go on from the last one."
    TIME_LIMIT = "The time allowed is used up; go on from the last point."
    STOPPED = "Stopped on request; go on from the last point."
    NOT_STARTED = "This direction was not followed."

    @property
    def advice(self) -> str:
        """What it means, and what can be done."""
        return self.value


class _OnPath:
    """What the problem tells of a point of its path."""

    problem: Any
    state: Array
    parameter: float

    @property
    def sets(self) -> IndexSets | None:
        """The index sets of the contacts there; None for problems that do not tell."""
        return told_sets(self.problem, self.state, self.parameter)

    @property
    def rates(self) -> ContactRates | None:
        """What [LR] (35) says of tangents there; None for problems that do not tell."""
        return told_rates(self.problem, self.state, self.parameter)


@dataclass(frozen=True, eq=False)
class Event(_OnPath):
    """Something that happens on a branch, at a precisely located point.

    before, after: names of the pieces on the two sides, in the sense of the branch.  smooth:
    True for a fold inside of a piece.  turns: True for a branch point where the parameter
    turns back.  directions, (k, n + 1), rows (y', p'): all one-sided tangents at a branch
    point.  stop: for the kind END.
    """

    kind: EventKind
    parameter: float
    state: Array
    arclength: float = 0.0
    before: Hashable = None
    after: Hashable = None
    smooth: bool = False
    turns: bool = False
    directions: Array | None = None
    stop: Stop | None = None
    detail: str = ""
    problem: Any = field(default=None, repr=False)

    @property
    def is_fold(self) -> bool:
        """True where the parameter turns back, at a branch point too."""
        return self.kind is EventKind.FOLD or self.turns

    def record(self) -> dict[str, Any]:
        """What the JSON file holds."""
        out: dict[str, Any] = {
            "kind": self.kind.name.lower(),
            "parameter": self.parameter,
            "arclength": self.arclength,
        }
        if self.kind is EventKind.FOLD:
            out["smooth"] = self.smooth
        elif self.turns:
            out["turns"] = True
        for name in ("before", "after"):
            value = getattr(self, name)
            if isinstance(value, str):
                out[name] = value
        if self.directions is not None:
            out["branches"] = len(self.directions)
        if self.stop is not None:
            out["stop"] = self.stop.name.lower()
        if self.detail:
            out["detail"] = self.detail
        sets = self.sets
        if sets is not None:
            out["sets"] = sets.record()
        return out


@dataclass(frozen=True, eq=False)
class Point(_OnPath):
    """One point of a branch, with all that is needed to go on from there.

    direction, rate: the tangent (y', p') in the sense of travel, of weighted length 1;
    step: the length of the next step, 0 where there is none.
    """

    parameter: float
    state: Array
    direction: Array
    rate: float
    piece: Hashable
    arclength: float = 0.0
    step: float = 0.0
    problem: Any = field(default=None, repr=False)

    def reversed(self) -> Point:
        """The same point, to go the other way."""
        return replace(self, direction=-self.direction, rate=-self.rate,
                       arclength=-self.arclength)  # fmt: skip
