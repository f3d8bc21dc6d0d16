"""A walk on problems that name the pieces around a point: kinks are located and told in full.

The corrector stays with the selection function of one piece, also beyond its border, so the
border is a zero of a margin along a smooth curve, found to rounding; the first-order system
gives all ways on.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot, determinant_sign
from .first_order import first_order
from .path import EventKind, Stop
from .walk import Found, Walk

Array = NDArray[np.float64]
NEARLY, AHEAD = 1e-3, 10.0  # over the smallest step: to measure rates, to look for a corner
LOCATED = 1e-3  # margin of a located border, relative to the one that counts as zero


class WalkByPieces(Walk):
    """The walk that passes kinks by the first-order system."""

    def _curve(self, n: int) -> Curve:
        return Curve(self.problem, n, self.piece)

    def _margins(self, spot: Spot) -> Array:
        return self.problem.margins(self.piece, spot.y, spot.p)  # type: ignore[attr-defined]

    def _leaves(self, spot: Spot) -> bool:
        return bool((self._margins(spot) < -self.options.border * LOCATED).any())

    def _over_border(self, step: float) -> Found | None:
        inside = self._to_border(step)
        if inside is None:
            return None
        out = self._between(inside)
        if self.stop is not None:
            return out
        self._move(inside)
        return [*out, *self._first_order()]

    def _stuck(self) -> Found:
        corner = self._corner_ahead()
        if corner is None:
            return [(self.here(), self._ended(Stop.STEP_TOO_SMALL))]
        self._move(corner)
        return self._first_order()

    def _corner_ahead(self) -> Spot | None:
        """A solution just ahead on the tangent, at a border beyond which no curve goes on.

        So it is where contacts come to rest in 3D: the direction of slip ends there.
        """
        s, short = self.spot, self.options.min_step
        y, p = s.ahead(NEARLY * short)
        here, there = self._margins(s), self._margins(Spot(y, p, s.ty, s.tp))
        falling = there < here  # not where both are infinite
        rates = (here[falling] - there[falling]) / (NEARLY * short)
        h = float((np.maximum(here[falling], 0.0) / rates).min(initial=np.inf))
        if not h <= AHEAD * short:
            return None
        y, p = s.ahead(h)
        rest = float(np.linalg.norm(self.problem.residual(y, p)))
        return Spot(y, p, s.ty, s.tp, s.sign) if rest <= self.options.border else None

    def _to_border(self, step: float) -> Spot | None:
        """The point of this piece's curve where the first margin vanishes, by regula falsi.

        Cubics through the points already there predict the next: one correction will do.
        """
        o, s = self.options, self.spot
        end = self.curve.correct(*s.ahead(step), s.ty, s.tp, o.tolerances)
        if end is None:
            return None
        here = self._margins(s)
        there = self._margins(end[0])
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
            margins = self._margins(best)
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
        end = self._without_end()
        if end is not None:
            return [(self.here(), end)]
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
            detail = system.reason
            event = self._event(EventKind.BRANCH, before, directions=rows, detail=detail)
        else:
            event = self._event(EventKind.FOLD if turned else EventKind.STATUS, before)
        return [(self.here(), event)]

    def _orientation(self, piece: Any, rate: float) -> int:
        """Of the curve on a piece: its sign stays where the curve passes a kink."""
        J, _ = self.problem.jacobian_of(piece, self.spot.y, self.spot.p)  # type: ignore[attr-defined]
        return self._sense(rate) * determinant_sign(J)
