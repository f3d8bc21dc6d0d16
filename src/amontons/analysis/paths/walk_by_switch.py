"""A walk on problems that only tell which piece is active.

The active selection functions are followed.  Where a step leaves the piece, or fails with its
prediction on another one, the kink is located (`kink`), and the ways on from there are looked
for around it (`local_ways`); where none is found, algorithm 2 of [LR], the simple tangent
switch, tells how to go on.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot
from .kink import KinkSearch, bend_between
from .local_ways import LocalWays
from .path import EventKind, Stop, name_of
from .tangent_switch import AHEAD, switched_tangent
from .tangents import Tangent
from .walk import Found, Walk

Array = NDArray[np.float64]
BEHIND = 1e-9  # distance from a kink at which its next piece has begun


class WalkBySwitch(Walk):
    """The walk that passes kinks by probes and the tangent switch."""

    bend: Array | None = None  # of the curve of this piece, as far as it is known

    def _curve(self, n: int) -> Curve:
        return Curve(self.problem, n)

    def _leaves(self, spot: Spot) -> bool:
        return name_of(self.problem.piece(spot.y, spot.p)) != self.piece

    def _move(self, spot: Spot) -> None:
        old = self.spot
        super()._move(spot)
        bend = bend_between(self.curve, old, spot)
        self.bend = self.bend if bend is None else bend

    def _enter(self, tangent: Tangent) -> None:
        super()._enter(tangent)
        self.bend = None

    def _over_border(self, step: float, spot: Spot | None) -> Found | None:
        if spot is None and name_of(self.problem.piece(*self.spot.ahead(step))) == self.piece:
            return None
        bend = np.zeros(len(self.spot.y) + 1) if self.bend is None else self.bend
        search = KinkSearch(self.curve, self.piece, self.spot, bend, self.cosine,
                            self.options.tolerances)  # fmt: skip
        found = search.located(step)
        if found is None:
            return None
        last, ends = found
        if self._jumps(last):
            return None
        return self._passed(last) if ends else self._accept(last, 0, True)

    def _stuck(self) -> Found:
        tangent = self._switched()
        if tangent is None:
            return [(self.here(), self._ended(Stop.LOST))]
        if tangent.piece == self.piece:  # a sharp turn of a smooth curve looks like a kink
            detail = "the tangent turns, or jumps, inside of one piece"
            return [(self.here(), self._ended(Stop.STEP_TOO_SMALL, detail))]
        return self._along([tangent])

    def _passed(self, last: Spot) -> Found:
        """Over a kink just behind a point."""
        out = self._between(last)
        if self.stop is not None:
            return out
        self._move(last)
        ahead = tuple(factor * self.options.ahead_of_kink for factor in AHEAD)
        ways = LocalWays(self.curve, self.spot, self.piece, ahead,
                         self.options.tolerances).found()  # fmt: skip
        if not ways:
            tangent = self._switched()
            if tangent is None:
                return [*out, (self.here(), self._ended(Stop.LOST))]
            ways = [tangent]
        return [*out, *self._along(ways)]

    def _switched(self) -> Tangent | None:
        """The tangent of algorithm 2."""
        found = switched_tangent(self.curve, self.spot, self.options, self.cosine)
        if found is None:
            return None
        y, p = self.spot.y + BEHIND * found[0], self.spot.p + BEHIND * found[1]
        return Tangent(*found, name_of(self.problem.piece(y, p)))

    def _along(self, ways: list[Tangent]) -> Found:
        """Go on along one of some tangents."""
        end = self._without_end()
        if end is not None:
            return [(self.here(), end)]
        s, before = self.spot, self.piece
        chosen = ways[0] if len(ways) == 1 else self._straightest(ways)
        turned = self.curve.product(chosen.direction, chosen.rate, s.ty, s.tp) < self.cosine
        if turned:
            self.step = self.options.step
        more: dict[str, Any] = {}
        if len(ways) > 1:
            back = np.append(-s.ty, -s.tp)
            rows = [back, *(np.append(t.direction, t.rate) for t in ways)]
            more = {"directions": np.array(rows)}
        self._enter(chosen)
        turns = self._note_turn()
        if more:
            more["turns"] = turns
        kind = EventKind.FOLD if turns else EventKind.STATUS
        kind = EventKind.BRANCH if more else kind
        return [(self.here(), self._event(kind, before, **more))]

    def _straightest(self, ways: list[Tangent]) -> Tangent:
        """The tangent that keeps the orientation and turns least."""
        s = self.spot

        def rank(t: Tangent) -> tuple[bool, float]:
            y, p = s.y + BEHIND * t.direction, s.p + BEHIND * t.rate
            sign = self.curve.orientation(y, p, t.direction, t.rate)
            along = self.curve.product(t.direction, t.rate, s.ty, s.tp)
            return bool(s.sign) and sign != s.sign, -along

        return min(ways, key=rank)
