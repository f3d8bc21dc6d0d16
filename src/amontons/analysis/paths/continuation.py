"""Continuation of the solution curves of piecewise smooth problems, step by step.

Algorithm 1 of [LR]: predictor along the tangent, inexact Moore-Penrose corrector, step control.
What happens at a kink depends on what the problem tells:
- Where it names the pieces around a point (`residual_of`, `jacobian_of`, `margins`, `pieces`;
  see `path`), the corrector stays with the selection function of one piece, also beyond its
  border; the border is then a zero of a margin along a smooth curve, found to rounding, and the
  first-order system gives all ways on.
- Else the active selection functions are taken, a kink is bisected, and where the corrector
  fails at it the new tangent comes from algorithm 2 of [LR], the simple tangent switch.

Folds inside of a piece, where p' changes sign, and branch points, where the determinant of the
bordered matrix does, are located too.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InvalidInput
from .corrector import Curve, Spot, Tolerances
from .first_order import Tangent, first_order
from .path import Event, EventKind, PathProblem, Point, Stop, name_of
from .tangent_switch import nearest_tangent, switched_tangent

Array = NDArray[np.float64]
WITHIN, ACROSS = 0.999, 0.99999  # cosines inside of a piece, and where kinks may come
LOCATED = 1e-3  # margin of a located border, relative to the one that counts as zero
BEHIND = 1e-9  # distance from a kink at which its next piece has begun
MOST_KINKS = 20  # passed at one point before the walk ends
PIECES = ("residual_of", "jacobian_of", "margins", "pieces")


class Switch(Enum):
    """How a kink is passed."""

    FIRST_ORDER = "first-order"
    TANGENT = "tangent"


@dataclass(frozen=True)
class Continuation:
    """The options of algorithms 1 and 2, with the names of [LR] in brackets; lengths weighted.

    step: first, and after a kink that was passed by the tangent switch.  A problem's |H| and
    unknowns should have size one: the tolerances are absolute.
    """

    step: float = 5e-4  # [h]
    min_step: float = 5e-7  # [h_min]
    max_step: float = 0.1  # [h_max]
    grow: float = 1.3  # [h_inc]
    shrink: float = 0.5  # [h_dec]
    residual: float = 5e-12  # [epsilon]
    change: float = 5e-12  # [epsilon']
    min_cosine: float | None = None  # [c_min] between neighbouring tangents; see `cosine`
    corrections: int = 5  # [j_max]
    quick: int = 4  # [j_thr] corrections below which the step grows
    border: float = 1e-9  # margin of a piece that counts as zero
    switch: Switch | None = None  # None: by the first-order system where the problem allows it

    def __post_init__(self) -> None:
        steps = (0 < self.min_step <= self.step <= self.max_step) and np.isfinite(self.max_step)
        checks = {
            "step": (steps, "0 < min_step <= step <= max_step"),
            "grow": (self.grow > 1, "a number > 1"),
            "shrink": (0 < self.shrink < 1, "a number between 0 and 1"),
            "residual": (self.residual > 0, "a number > 0"),
            "change": (self.change > 0, "a number > 0"),
            "min_cosine": (self.min_cosine is None or self.min_cosine < 1, "a number < 1"),
            "corrections": (self.corrections >= 1, "at least 1"),
            "border": (self.border > 0, "a number > 0"),
        }
        for name, (holds, wanted) in checks.items():
            if not holds:
                raise InvalidInput(f"{name}: expected {wanted}, got {getattr(self, name)}")

    @property
    def tolerances(self) -> Tolerances:
        """Those of the corrector."""
        return Tolerances(self.residual, self.change, self.corrections)

    def cosine(self, problem: PathProblem) -> float:
        """The smallest cosine between neighbouring tangents: 0.999, or 0.99999 as in [LR].

        The latter where a jump of the tangent is all that tells of a kink.
        """
        if self.min_cosine is not None:
            return self.min_cosine
        return WITHIN if self._knows_pieces(problem) else ACROSS

    def start(self, problem: PathProblem, y: Array, p: float) -> tuple[Tangent, ...]:
        """All one-sided tangents at a solution, as far as the problem tells its pieces."""
        if self._knows_pieces(problem):
            found = first_order(problem, y, p, tolerance=self.border)
            if found.tangents:
                return found.tangents
        curve = Curve(problem, len(y))
        ty, tp = curve.any_tangent(y, p)
        one = Tangent(ty, tp, name_of(problem.piece(y, p)))
        return one, -one

    def walk(
        self, problem: PathProblem, y: Array, p: float, tangent: Tangent,
        interval: tuple[float, float], *, step: float | None = None,
    ) -> Iterator[tuple[Point, Event | None]]:  # fmt: skip
        """From a solution along a tangent: points, and events with the points they are at.

        Ends with an event END.  To go on later, start from the last point: its state,
        parameter, tangent and step.
        """
        low, high = interval
        if not low <= p <= high:
            raise InvalidInput(f"start: expected a parameter in {low:g} … {high:g}, got {p:g}")
        walk = _Walk(self, problem, y, p, tangent, interval, step or self.step)
        yield walk.here(), None
        while walk.stop is None:
            yield from walk.advance()

    def _knows_pieces(self, problem: PathProblem) -> bool:
        known = all(hasattr(problem, name) for name in PIECES)
        if self.switch is Switch.FIRST_ORDER and not known:
            raise InvalidInput(f"switch: the problem has not all of {', '.join(PIECES)}")
        return known and self.switch is not Switch.TANGENT


def resumed(point: Point) -> Tangent:
    """The tangent with which `walk` goes on from a point."""
    return Tangent(point.direction, point.rate, point.piece)


Found = list[tuple[Point, Event | None]]


class _Walk:
    """Where the continuation is, and one step of it."""

    def __init__(
        self, options: Continuation, problem: PathProblem, y: Array, p: float,
        tangent: Tangent, interval: tuple[float, float], step: float,
    ) -> None:  # fmt: skip
        self.options, self.problem, self.interval = options, problem, interval
        self.by_pieces = options._knows_pieces(problem)
        self.cosine = options.cosine(problem)
        self.piece: Any = tangent.piece
        self.curve = Curve(problem, len(y), self.piece if self.by_pieces else None)
        ty, tp = self.curve.unit(tangent.direction, tangent.rate)
        self.spot = Spot(y, p, ty, tp)
        self.step = min(max(step, options.min_step), options.max_step)
        self.travelled = 0.0
        self.stop: Stop | None = None
        self.turn = self._sense(tp)
        self.sign = 0  # of the bordered determinant on this piece, 0 unknown
        self.kinks_here = 0  # kinks passed without getting on

    def here(self) -> Point:
        """The present point."""
        s = self.spot
        return Point(s.p, s.y, s.ty, s.tp, self.piece, self.travelled, self.step)

    def advance(self) -> Found:
        """One accepted step: points and events on the way; a kink at most."""
        reduced = False
        while True:
            new = self._corrected(self.step)
            if new is not None:
                spot, count = new
                leaves = self._leaves(spot)
                if not leaves:
                    return self._accept(spot, count, reduced)
                found = self._border(self.step)
                if found is not None:
                    return found
            if self.step <= self.options.min_step:
                return self._stuck()
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
        was = self.sign
        point = self._zero(spot, lambda s: float(was * s.sign))
        if point is None:
            point = spot
        from .first_order import kernel

        lines = kernel(*self.curve.jacobian(point.y, point.p), self.curve.weight, 1e-5)
        rows = [np.append(point.ty, point.tp), -np.append(point.ty, point.tp)]
        for line in lines.T:
            along = self.curve.product(line[:-1], line[-1], point.ty, point.tp)
            rest = line - along * np.append(point.ty, point.tp)
            size = self.curve.length(rest[:-1], float(rest[-1]))
            if size > 0.5:
                rows += [rest / size, -rest / size]
                break
        event = Event(EventKind.BRANCH, point.p, point.y, self.travelled + self.curve.length(
            point.y - self.spot.y, point.p - self.spot.p), self.piece, self.piece,
            directions=np.array(rows), detail="other lines to first order")  # fmt: skip
        return [(replace(self.here(), parameter=point.p, state=point.y,
                         arclength=event.arclength), event)]  # fmt: skip

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

        def value(step: float) -> float:
            found = at(step)
            if found is None:
                raise ArithmeticError
            return float(test(found))

        try:
            if value(0.0) <= 0:
                return self.spot
            if value(whole) >= 0:
                return None
            return at(float(brentq(value, 0.0, whole, xtol=1e-14, rtol=1e-14)))
        except ArithmeticError:
            return None

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
    def _leaves(self, spot: Spot) -> bool:
        if self.by_pieces:
            margins = self.problem.margins(self.piece, spot.y, spot.p)  # type: ignore[attr-defined]
            return bool((margins < -self.options.border * 1e-3).any())
        return name_of(self.problem.piece(spot.y, spot.p)) != self.piece

    def _border(self, step: float) -> Found | None:
        """Over the border that lies before `step`; None where it can not be located."""
        if not self.by_pieces:
            return self._bisected(step, switch=False)
        inside = self._to_border(step)
        if inside is None:
            return None
        out = self._between(inside)
        if self.stop is not None:
            return out
        self._move(inside)
        return [*out, *self._first_order()]

    def _to_border(self, step: float) -> Spot | None:
        """The point of this piece's curve where the first margin vanishes, by regula falsi.

        Cubics through the points already there predict the next: one correction will do.
        """
        o, s, problem = self.options, self.spot, self.problem
        end = self.curve.correct(*s.ahead(step), s.ty, s.tp, o.tolerances)
        if end is None:
            return None
        here = problem.margins(self.piece, s.y, s.p)  # type: ignore[attr-defined]
        there = problem.margins(self.piece, end[0].y, end[0].p)  # type: ignore[attr-defined]
        watched = np.flatnonzero(there < 0)
        low, high = (0.0, s), (step, end[0])
        f_low = float(np.maximum(here[watched], 0).min(initial=np.inf))
        f_high, best = float(there[watched].min()), end[0]
        if f_low <= 0:
            return s
        side = 0  # which end moved last
        for _ in range(60):
            h = low[0] + (high[0] - low[0]) * f_low / (f_low - f_high)
            found = self.curve.correct(*self._cubic(low, high, h), s.ty, s.tp, o.tolerances)
            if found is None:
                return None
            best = found[0]
            margins = problem.margins(self.piece, best.y, best.p)  # type: ignore[attr-defined]
            value = float(margins[watched].min())
            if abs(value) <= LOCATED * o.border or high[0] - low[0] <= 1e-15:
                return best
            if value > 0:
                low, f_low, f_high = (h, best), value, f_high * (0.5 if side > 0 else 1.0)
                side = 1
            else:
                high, f_high, f_low = (h, best), value, f_low * (0.5 if side < 0 else 1.0)
                side = -1
        return best

    def _cubic(
        self, low: tuple[float, Spot], high: tuple[float, Spot], h: float
    ) -> tuple[Array, float]:
        """The point at h on the cubic through two spots along their tangents.

        h is the distance from the present point along its tangent, as in `_zero`.
        """
        (a, one), (b, two) = low, high
        t, length = (h - a) / (b - a), b - a
        here = self.spot
        rates = [length / self.curve.product(x.ty, x.tp, here.ty, here.tp) for x in (one, two)]
        weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t)
        slopes = (1 - t) ** 2 * t * rates[0], -(t**2) * (1 - t) * rates[1]
        y = weights[0] * one.y + weights[1] * two.y + slopes[0] * one.ty + slopes[1] * two.ty
        p = weights[0] * one.p + weights[1] * two.p + slopes[0] * one.tp + slopes[1] * two.tp
        return y, p

    def _first_order(self) -> Found:
        """At a kink that was located: all ways on, and the one that is taken."""
        s, before = self.spot, self.piece
        tolerance = max(self.options.border, 1e-10 * float(np.abs(s.y).max(initial=0)))
        system = first_order(self.problem, s.y, s.p, tolerance=tolerance)
        others = system.others(-s.ty, -s.tp, self.curve.weight)
        self.kinks_here += 1
        if self.kinks_here > MOST_KINKS:
            return [(self.here(), self._ended(Stop.SINGULAR, "kinks without end"))]
        if not others:
            stop = Stop.DEAD_END if system.complete else Stop.SINGULAR
            return [(self.here(), self._ended(stop, system.reason))]
        came = self._orientation(self.piece, s.tp)
        chosen = min(others, key=lambda t: (
            self._orientation(t.piece, t.rate) != came,
            -self.curve.product(t.direction, t.rate, s.ty, s.tp),
        ))  # fmt: skip
        several = len(others) > 1 or bool(system.sets)
        self._enter(chosen)
        turned = self._note_turn()
        if several:
            rows = np.array([np.append(t.direction, t.rate) for t in system.tangents])
            detail = "" if system.complete else "solutions near this point are not isolated"
            event = self._event(EventKind.BRANCH, before, directions=rows, detail=detail)
        else:
            event = self._event(EventKind.FOLD if turned else EventKind.STATUS, before)
        return [(self.here(), event)]

    def _enter(self, tangent: Tangent) -> None:
        self.piece = tangent.piece
        if self.by_pieces:
            self.curve = Curve(self.problem, len(self.spot.y), self.piece)
        ty, tp = self.curve.unit(tangent.direction, tangent.rate)
        old = self.spot
        self.spot, self.sign = Spot(old.y, old.p, ty, tp, old.sign), 0

    def _orientation(self, piece: Any, rate: float) -> int:
        from .corrector import determinant_sign

        J, _ = self.problem.jacobian_of(piece, self.spot.y, self.spot.p)  # type: ignore[attr-defined]
        return self._sense(rate) * determinant_sign(J)

    def _stuck(self) -> Found:
        """The corrector fails at the smallest step."""
        if self.by_pieces:
            return [(self.here(), self._ended(Stop.STEP_TOO_SMALL))]
        return self._bisected(self.step, switch=True) or [(self.here(), self._ended(Stop.LOST))]

    def _bisected(self, step: float, switch: bool) -> Found | None:
        """The kink before `step`, by bisection; over it by algorithm 2 if `switch`."""
        before, low, high = self.piece, 0.0, step
        last: Spot | None = None
        beyond: Spot | None = None
        for k in range(60):
            # first just behind the last kink, which lies there but for rounding
            h = min(BEHIND, high / 2) if k == 0 else (low + high) / 2
            found = self._corrected(h)
            if found is not None and not self._leaves(found[0]):
                low, last = h, found[0]
            else:
                high = h
                if found is not None:
                    beyond = found[0]
            if high - low <= 1e-15:
                break
        out: Found = []
        if last is not None:
            out = self._between(last)
            if self.stop is not None:
                return out
            self._move(last)
        self.kinks_here += 1
        if self.kinks_here > MOST_KINKS:
            return [*out, (self.here(), self._ended(Stop.SINGULAR, "kinks without end"))]
        if switch:
            tangent = switched_tangent(
                self.curve, self.spot, self.options.min_step, self.cosine
            )
            if tangent is None:
                return [*out, (self.here(), self._ended(Stop.LOST))]
        elif beyond is None:
            return None
        else:
            near = nearest_tangent(self.curve, self.spot, self.options.min_step)
            tangent = (beyond.ty, beyond.tp) if near is None else near
        self.step = self.options.step if switch else self.step
        ahead = (self.spot.y + BEHIND * tangent[0],
                 self.spot.p + BEHIND * tangent[1])  # fmt: skip
        after = name_of(self.problem.piece(*ahead))
        self._enter(Tangent(tangent[0], tangent[1], after))
        kind = EventKind.FOLD if self._note_turn() else EventKind.STATUS
        return [*out, (self.here(), self._event(kind, before))]

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
        return Event(kind, self.spot.p, self.spot.y, self.travelled, before, self.piece, **more)

    def _ended(self, stop: Stop, detail: str = "") -> Event:
        self.stop = stop
        return Event(EventKind.END, self.spot.p, self.spot.y, self.travelled, self.piece,
                     stop=stop, detail=detail)  # fmt: skip
