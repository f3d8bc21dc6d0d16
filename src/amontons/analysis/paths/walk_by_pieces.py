"""A walk on problems that name the pieces around a point: kinks are located and told in full.

The corrector stays with the selection function of one piece, also beyond its border, so the
border is a zero of a margin along a smooth curve, found to rounding; the first-order system
gives all ways on.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .border import Border
from .corrector import Curve, Spot, determinant_sign
from .first_order import first_order
from .path import EventKind, Stop
from .tangents import FirstOrder, Tangent
from .walk import Found, Walk

Array = NDArray[np.float64]
NEARLY, AHEAD = 1e-3, 10.0  # over the smallest step: to measure rates, to look for a corner
FURTHER = 10.0 ** np.arange(5)  # over the smallest step: where to ask why none leads on
MET = 10.0  # borders that a located point may miss, in what locates one of them
LOCATED = 1e-3  # margin of a located border, relative to the one that counts as zero


class WalkByPieces(Walk):
    """The walk that passes kinks by the first-order system."""

    def _curve(self, n: int) -> Curve:
        return Curve(self.problem, n, self.piece)

    def _margins(self, spot: Spot) -> Array:
        return self.problem.margins(self.piece, spot.y, spot.p)

    def _leaves(self, spot: Spot) -> bool:
        return bool((self._margins(spot) < -self.options.border * LOCATED).any())

    def _over_border(self, step: float, spot: Spot | None) -> Found | None:
        if spot is None:
            return None
        o = self.options
        border = Border(self.problem, self.curve, self.spot, o.tolerances)
        shorter = step > o.min_step
        inside = border.located(step, spot, LOCATED * o.border, shorter)
        if inside is None or self._jumps(inside):
            return None
        out = self._between(inside)
        if self.stop is not None:
            return out
        self._move(inside)
        return [*out, *self._first_order()]

    def _stuck(self) -> Found:
        corner = self._corner_ahead()
        if corner is None:
            return [(self.here(), self._ended(Stop.STEP_TOO_SMALL, self._remark()))]
        self._move(corner)
        return self._first_order()

    def _remark(self) -> str:
        """What the problem, where it can tell, says of states just ahead, the nearest first."""
        tell = getattr(self.problem, "remark", None)
        if tell is None:
            return ""
        steps = self.options.min_step * FURTHER
        told = (tell(*self.spot.ahead(float(step))) for step in steps)
        return next((words for words in told if words), "")

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

    def _first_order(self) -> Found:
        """At a kink that was located: all ways on, and the one that is taken."""
        s, before = self.spot, self.piece
        tolerance = max(self.options.border, 1e-10 * float(np.abs(s.y).max(initial=0)))
        system = first_order(self.problem, s.y, s.p, tolerance=tolerance)
        others = system.others(-s.ty, -s.tp, self.curve.weight, before)
        end = self._without_end()
        if end is not None:
            return [(self.here(), end)]
        if not others:
            stop = Stop.DEAD_END if system.complete else Stop.SINGULAR
            return [(self.here(), self._ended(stop, system.reason))]
        chosen = others[0] if len(others) == 1 else self._straightest(others)
        several = len(others) > 1 or bool(system.sets)
        self._enter(chosen)
        turned = self._note_turn()
        if several:
            rows = np.array([np.append(t.direction, t.rate) for t in system.tangents])
            detail = system.told(self._apart(system, tolerance), MET * LOCATED * tolerance)
            event = self._event(
                EventKind.BRANCH, before, turns=turned, directions=rows, detail=detail
            )
        else:
            event = self._event(EventKind.FOLD if turned else EventKind.STATUS, before)
        return [(self.here(), event)]

    def _apart(self, system: FirstOrder, tolerance: float) -> float:
        """The largest margin that counts as zero, among those of pieces with a tangent."""
        s = self.spot
        margins = [np.abs(self.problem.margins(t.piece, s.y, s.p)) for t in system.tangents]
        return max((float(m[m <= tolerance].max(initial=0.0)) for m in margins), default=0.0)

    def _straightest(self, others: list[Tangent]) -> Tangent:
        """The tangent that keeps the orientation and turns least."""
        s = self.spot
        came = self._orientation(self.piece, s.tp)
        return min(others, key=lambda t: (
            all(self._orientation(piece, t.rate) != came for piece in t.pieces),
            -self.curve.product(t.direction, t.rate, s.ty, s.tp),
        ))  # fmt: skip

    def _orientation(self, piece: Any, rate: float) -> int:
        """Of the curve on a piece: its sign stays where the curve passes a kink."""
        J, _ = self.problem.jacobian_of(piece, self.spot.y, self.spot.p)
        return self._sense(rate) * determinant_sign(J)
