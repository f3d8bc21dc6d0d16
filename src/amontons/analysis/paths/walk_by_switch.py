"""A walk on problems that only tell which piece is active: kinks are bisected.

The active selection functions are followed.  Where the corrector gets over a kink, the walk
goes on behind it; where it fails there, the new tangent comes from algorithm 2 of [LR], the
simple tangent switch.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot
from .first_order import Tangent
from .path import EventKind, Stop, name_of
from .tangent_switch import nearest_tangent, switched_tangent
from .walk import Found, Walk

Array = NDArray[np.float64]
BEHIND = 1e-9  # distance from a kink at which its next piece has begun


class WalkBySwitch(Walk):
    """The walk that passes kinks by the tangent switch."""

    def _curve(self, n: int) -> Curve:
        return Curve(self.problem, n)

    def _leaves(self, spot: Spot) -> bool:
        return name_of(self.problem.piece(spot.y, spot.p)) != self.piece

    def _over_border(self, step: float, spot: Spot) -> Found | None:
        return self._bisected(step, switch=False)

    def _stuck(self) -> Found:
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
        end = self._without_end()
        if end is not None:
            return [*out, (self.here(), end)]
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
        if switch and after == before:  # a sharp turn of a smooth curve looks like a kink
            detail = "the tangent turns, or jumps, inside of one piece"
            return [*out, (self.here(), self._ended(Stop.STEP_TOO_SMALL, detail))]
        self._enter(Tangent(tangent[0], tangent[1], after))
        kind = EventKind.FOLD if self._note_turn() else EventKind.STATUS
        return [*out, (self.here(), self._event(kind, before))]
