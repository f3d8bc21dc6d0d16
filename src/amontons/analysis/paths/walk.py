"""A walk along a solution curve: steps inside of a piece, and what lies between two points.

Algorithm 1 of [LR] takes the steps; the end of the interval, smooth folds, where p' changes
sign, and branch points, where the determinant of the bordered matrix does, are located between
them.  `walk_by_pieces` and `walk_by_switch` know how a kink is passed.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .branch_point import branch_point
from .corrector import Curve, Spot
from .crossing import Crossing, crossing
from .path import Event, EventKind, PathProblem, Point, Stop
from .tangents import Tangent

if TYPE_CHECKING:
    from .continuation import Continuation

Array = NDArray[np.float64]
Found = list[tuple[Point, Event | None]]
MOST_KINKS = 20  # passed at one point before the walk ends


class Walk(ABC):
    """Where the continuation is, and one step of it; how kinks are passed is left open."""

    def __init__(
        self, options: Continuation, problem: PathProblem, y: Array, p: float,
        tangent: Tangent, interval: tuple[float, float], step: float,
    ) -> None:  # fmt: skip
        self.options, self.problem, self.interval = options, problem, interval
        self.cosine = options.cosine(problem)
        self.piece: Any = tangent.piece
        self.curve = self._curve(len(y))
        ty, tp = self.curve.unit(tangent.direction, tangent.rate)
        self.spot = Spot(y, p, ty, tp)
        self.step = min(max(step, options.min_step), options.max_step)
        self.travelled = 0.0
        self.stop: Stop | None = None
        self.turn = self._sense(tp)
        self.sign = 0  # of the bordered determinant on this piece, 0 unknown
        self._asked: tuple[Spot, tuple[Spot | None, Crossing | None]] | None = None
        self.kinks_here = 0  # kinks passed without getting on

    def here(self) -> Point:
        """The present point."""
        s = self.spot
        return Point(s.p, s.y, s.ty, s.tp, self.piece, self.travelled, self.step,
                     self.problem)  # fmt: skip

    def advance(self) -> Found:
        """One accepted step: points and events on the way; a kink at most."""
        reduced = False
        while True:
            new = self._corrected(self.step)
            jumps = found = None
            if new is not None and not self._leaves(new[0]):
                jumps = self._jumps(new[0])
                if not jumps:
                    return self._accept(*new, reduced)
            if not jumps:
                found = self._over_border(self.step, None if new is None else new[0])
            if found is not None:
                return found
            if self.step <= self.options.min_step:
                return self._at_gap() if jumps else self._stuck()
            self.step = max(self.step * self.options.shrink, self.options.min_step)
            reduced = True

    def _corrected(self, step: float) -> tuple[Spot, int] | None:
        """Algorithm 1, steps 3 to 8: predict, correct, compare the tangents."""
        s, o = self.spot, self.options
        found = self.curve.correct(*s.ahead(step), s.ty, s.tp, o.tolerances)
        if found is None:
            return None
        new = found[0]
        if self.curve.product(new.ty, new.tp, s.ty, s.tp) < self.cosine:
            return None
        return found

    def _at_gap(self) -> Found:
        """The end where curves pass by each other too closely for the smallest step."""
        detail = "a determinant changes its sign ahead, but no branch point was found"
        return [(self.here(), self._ended(Stop.SINGULAR, detail))]

    # ---------------------------------------------------------------- inside of a piece
    def _accept(self, spot: Spot, count: int, reduced: bool) -> Found:
        """Step 8, and what lies between the old point and the new one."""
        out = self._between(spot)
        if self.stop is not None:
            return out
        self._move(spot)
        if count <= self.options.quick and not reduced:
            self.step = min(self.step * self.options.grow, self.options.max_step)
        return [*out, (self.here(), None)]

    def _between(self, spot: Spot) -> Found:
        """Smooth folds, branch points and the end of the interval on the way to a point."""
        out: Found = []
        sign = spot.sign
        if self.sign and sign and sign != self.sign:
            out += self._branch_point(spot)
        self.sign = sign or self.sign
        sense = self._sense(spot.tp)
        if sense and self.turn and sense != self.turn:
            out += self._smooth_fold(spot)
        self.turn = sense or self.turn
        low, high = self.interval
        if not low <= spot.p <= high:
            out += self._end_of_interval(spot)
        return out

    def _move(self, spot: Spot) -> None:
        old = self.spot
        if spot is not old:
            self.kinks_here = 0
        self.travelled += self.curve.length(spot.y - old.y, spot.p - old.p)
        self.spot = spot

    def _smooth_fold(self, spot: Spot) -> Found:
        """The point between the present one and `spot` where p' = 0."""
        fold = self._zero(spot, lambda s: s.tp * self.turn)
        if fold is None or not self.interval[0] <= fold.p <= self.interval[1]:
            return []
        self._move(fold)
        event = self._event(EventKind.FOLD, self.piece, smooth=True)
        return [(self.here(), event)]

    def _branch_point(self, spot: Spot) -> Found:
        """The point where the bordered determinant changes its sign, and the other line."""
        found = self._crossed(spot)[1]
        if found is None:
            return []  # a curve on the border of two pieces takes its derivatives in turns
        own, other = found.lines
        way = self.curve.length(found.y - self.spot.y, found.p - self.spot.p)
        event = Event(EventKind.BRANCH, found.p, found.y, self.travelled + way, self.piece,
                      self.piece, directions=np.array([own, -own, other, -other]),
                      detail="other lines to first order", problem=self.problem)  # fmt: skip
        return [(replace(self.here(), parameter=event.parameter, state=event.state,
                         arclength=event.arclength), event)]  # fmt: skip

    def _jumps(self, spot: Spot) -> bool:
        """True for a point of another curve.

        On the way to it the determinant changes its sign, but there is no branch point.
        """
        if not (self.sign and spot.sign and spot.sign != self.sign):
            return False
        located, found = self._crossed(spot)
        return located is not None and found is None

    def _crossed(self, spot: Spot) -> tuple[Spot | None, Crossing | None]:
        """Where the determinant vanishes on the way to a point, and the curves that cross."""
        if self._asked is None or self._asked[0] is not spot:
            tolerances = self.options.tolerances
            located = branch_point(self.curve, self.spot, spot, tolerances)
            reach = self.curve.length(spot.y - self.spot.y, spot.p - self.spot.p)
            found = crossing(self.curve, located or spot, reach, tolerances)
            self._asked = spot, (located, found)
        return self._asked[1]

    def _zero(self, spot: Spot, test: Any) -> Spot | None:
        """Where a test function, positive here and negative at `spot`, vanishes."""
        from scipy.optimize import brentq

        def at(step: float) -> Spot | None:
            if step == 0:
                return replace(self.spot, sign=self.sign)
            found = self.curve.correct(*self.spot.ahead(step), self.spot.ty, self.spot.tp,
                                       self.options.tolerances)  # fmt: skip
            return None if found is None else found[0]

        # the corrector moves at right angles to the tangent, so this step leads to spot
        whole = self.curve.product(spot.y - self.spot.y, spot.p - self.spot.p,
                                   self.spot.ty, self.spot.tp)  # fmt: skip

        known: list[Spot] = []

        def value(step: float) -> float:
            found = at(step)
            if found is None:
                raise ArithmeticError
            known.append(found)
            return float(test(found))

        try:
            if value(0.0) <= 0:
                return self.spot
            if value(whole) >= 0:
                return None
            zero: Any = brentq(value, 0.0, whole, xtol=1e-14, rtol=np.float64(1e-14))
            return at(float(zero))
        except ArithmeticError:  # no tangent there, as where bodies alike give way together
            return min(known, key=lambda s: abs(test(s)), default=None)

    def _end_of_interval(self, spot: Spot) -> Found:
        """The point at the end of the interval, corrected at fixed parameter."""
        bound = self.interval[int(spot.p > self.interval[1])]
        s = self.spot
        share = 1.0 if spot.p == s.p else (bound - s.p) / (spot.p - s.p)
        y = s.y + np.clip(share, 0.0, 1.0) * (spot.y - s.y)
        y_end = self.curve.at_parameter(y, bound, self.options.tolerances)
        if y_end is None:
            return [(self.here(), self._ended(Stop.STEP_TOO_SMALL, "at the end"))]
        try:
            ty, tp = self.curve.tangent(y_end, bound, s.ty, s.tp)
        except np.linalg.LinAlgError:
            ty, tp = s.ty, s.tp
        last = Spot(y_end, bound, ty, tp)
        self._move(last)
        return [(self.here(), self._ended(Stop.INTERVAL))]

    # ---------------------------------------------------------------- kinks
    @abstractmethod
    def _curve(self, n: int) -> Curve:
        """The curve that the corrector follows."""

    @abstractmethod
    def _leaves(self, spot: Spot) -> bool:
        """True where a point lies outside of the piece."""

    @abstractmethod
    def _over_border(self, step: float, spot: Spot | None) -> Found | None:
        """Over the border before the spot a step ahead; None where it can not be located.

        spot: None where the corrector failed.
        """

    @abstractmethod
    def _stuck(self) -> Found:
        """What is left where the corrector fails at the smallest step."""

    def _without_end(self) -> Event | None:
        """The event END after one more kink at this point, where there have been too many."""
        self.kinks_here += 1
        if self.kinks_here <= MOST_KINKS:
            return None
        return self._ended(Stop.SINGULAR, "kinks without end")

    def _enter(self, tangent: Tangent) -> None:
        """Go on into another piece."""
        self.piece = tangent.piece
        self.curve = self._curve(len(self.spot.y))
        ty, tp = self.curve.unit(tangent.direction, tangent.rate)
        old = self.spot
        self.spot, self.sign = Spot(old.y, old.p, ty, tp, old.sign), 0

    # ---------------------------------------------------------------- events
    def _sense(self, rate: float) -> int:
        return int(np.sign(rate)) if abs(rate) > 1e-11 else 0

    def _note_turn(self) -> bool:
        """Remember the sense of the parameter; True where it turned."""
        sense = self._sense(self.spot.tp)
        turned = sense != 0 and self.turn != 0 and sense != self.turn
        self.turn = sense or self.turn
        return turned

    def _event(self, kind: EventKind, before: Any, **more: Any) -> Event:
        return Event(kind, self.spot.p, self.spot.y, self.travelled, before, self.piece,
                     problem=self.problem, **more)  # fmt: skip

    def _ended(self, stop: Stop, detail: str = "") -> Event:
        self.stop = stop
        return Event(EventKind.END, self.spot.p, self.spot.y, self.travelled, self.piece,
                     stop=stop, detail=detail, problem=self.problem)  # fmt: skip
