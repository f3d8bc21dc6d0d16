"""Locating a kink of a curve whose problem only tells which piece is active.

On the piece the curve is smooth: it is predicted to second order, so that predictions stay on
the piece up to its border, and the corrector converges there in a step or two.  Where the
border lies tells the piece beyond: with residual R and derivatives at a prediction over there,

    R + R' (c(s) - c(s_beyond)) = 0                                                        (1)

row by row along the predicted curve c, as both pieces agree on their border; a row that changed
gives its s exactly if the pieces are straight.  Every s is checked, and between checks that
tell nothing new the interval is halved.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot, Tolerances
from .path import name_of

Array = NDArray[np.float64]
CLOSED = 1e-14  # length of an interval that is not divided any more, or that of rounding
SURE = 1e-3  # by which a zero of (1) may be off, in the square of the interval
BASELINE = 1e-5  # distance of two points from which the curve's bend is measured
LARGE = 1e-3  # of the largest row, of one that counts
BEHIND = 1e-9  # distance from a kink at which its next piece has begun
PATIENCE = 5  # steps from one halving to the next
WIDER = 4.0  # growth of an interval whose end was predicted too early
ROUNDS = 120


def bend_between(curve: Curve, a: Spot, b: Spot) -> Array | None:
    """d(y', p') / ds between two points of a curve, (n + 1,); None where they are too near."""
    length = curve.length(b.y - a.y, b.p - a.p)
    return np.append(b.ty - a.ty, b.tp - a.tp) / length if length >= BASELINE else None


class KinkSearch:
    """The last point on a piece before a kink ahead of a point; bend: of the curve there."""

    def __init__(
        self, curve: Curve, piece: Hashable, start: Spot, bend: Array, cosine: float,
        tolerances: Tolerances,
    ) -> None:  # fmt: skip
        self.curve, self.piece = curve, piece
        self.cosine, self.tolerances = cosine, tolerances
        self.base, self.at, self.bend = start, 0.0, bend

    def located(self, step: float) -> tuple[Spot, bool] | None:
        """(last point within `step`, does the piece end there?); None if it is the start.

        Where the curve runs along the border predictions leave the piece too early: the last
        point is then one from which to go on.
        """
        low, high, start = 0.0, step, self.base
        near = 0  # 1: just before a zero of (1), 2: just after it
        zero, spread, guessed = 0.0, 0.0, True  # guessed: high is beyond by prediction only
        for count in range(ROUNDS):
            if high - low <= CLOSED:
                break
            if near == 2 and zero + spread < high:
                s, near = zero + spread, 0
            else:
                found = None if count % PATIENCE == PATIENCE - 1 else self._zero(low, high)
                s, near = (low + high) / 2, 0
                if found is not None:
                    spread = max(SURE * (high - low) ** 2, CLOSED / 4)
                    zero, s, near = found, max(found - spread, (low + found) / 2), 1
            predicted = self._is_own(*self._predicted(s))
            spot = self._on_piece(s) if predicted else None
            if spot is None:
                high, near, guessed = s, 0, not predicted
            else:
                low, near = s, 2 if near == 1 else 0
                self._move(spot, s)
                high = self._revised(low, high, step) if guessed else high
        ends = self._ends()
        return None if self.base is start and not ends else (self.base, ends)

    def _revised(self, low: float, high: float, step: float) -> float:
        """A bound that is beyond the border as predicted from nearby, too."""
        while high < step and self._is_own(*self._predicted(high)):
            high = min(step, low + WIDER * (high - low))
        return high

    def _ends(self) -> bool:
        """True where another piece is active just ahead."""
        return any(not self._is_own(*self.base.ahead(h)) for h in (BEHIND, 10 * BEHIND))

    def _is_own(self, y: Array, p: float) -> bool:
        return name_of(self.curve.problem.piece(y, p)) == self.piece

    def _predicted(self, s: float) -> tuple[Array, float]:
        h = s - self.at
        y, p = self.base.ahead(h)
        return y + h * h / 2 * self.bend[:-1], p + h * h / 2 * float(self.bend[-1])

    def _on_piece(self, s: float) -> Spot | None:
        """The point of the curve at s, predicted there; None where it is not on the piece."""
        y, p = self._predicted(s)
        b = self.base
        found = self.curve.correct(y, p, b.ty, b.tp, self.tolerances)
        if found is None:
            return None
        spot = found[0]
        aligned = self.curve.product(spot.ty, spot.tp, b.ty, b.tp) >= self.cosine
        near = self.curve.length(spot.y - y, spot.p - p) <= (s - self.at) / 2 + BEHIND
        return spot if aligned and near and self._is_own(spot.y, spot.p) else None

    def _move(self, spot: Spot, s: float) -> None:
        bend = bend_between(self.curve, self.base, spot)
        self.base, self.at, self.bend = spot, s, self.bend if bend is None else bend

    def _zero(self, low: float, high: float) -> float | None:
        """The first s between two where a row of (1) vanishes."""
        y, p = self._predicted(high)
        if self._is_own(y, p):
            return None
        h = high - self.at
        ty, tp = self.base.ty + h * self.bend[:-1], self.base.tp + h * float(self.bend[-1])
        rest = self.curve.residual(y, p)
        J, Jp = self.curve.jacobian(y, p)
        slope = J @ ty + Jp * tp
        size, steep = np.abs(rest), np.abs(slope)
        told = (size > LARGE * size.max(initial=0)) & (steep > LARGE * steep.max(initial=0))
        s = high - rest[told] / slope[told]
        s = s[(s > low) & (s < high)]
        return float(s.min()) if len(s) else None
