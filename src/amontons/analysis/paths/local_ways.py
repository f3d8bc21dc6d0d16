"""All ways on from a kink, for problems that only tell which piece is active.

Pieces around the point are met by probes: ahead, aside, and along the tangent lines of the
pieces that have been met.  A direction counts if it lies in its piece and a solution is found
along it, at distances at which one that only seems to be there would show ([LR] example 1).

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot, Tolerances
from .path import name_of
from .tangents import SAME, Tangent, product

Array = NDArray[np.float64]
SURE = (1e-4, 1e-5)  # distances at which a false direction has no solution
SHORT = (1e-6, 1e-7, 1e-8)  # where the next kink, or a fold, is nearer
BEGIN = 1e-7  # where every direction has a solution
TOLD = (1e-3, 1e-4, 1e-5)  # where curves with one tangent are held against each other
ASIDE = 1e-7  # distance of probes around the point
ALONG = 1e-6  # of probes along a direction
ACROSS = 1e-3  # of probes beside a direction, in that along it
PIECES = 8  # that are looked at
NEAR = 0.1  # distance of a solution to its prediction, in that to the point
APART = 1e-10  # distance of two solutions of size one that are not the same


class LocalWays:
    """The ways on from a spot that was reached on a piece."""

    def __init__(
        self, curve: Curve, spot: Spot, piece: Hashable, ahead: tuple[float, ...],
        tolerances: Tolerances,
    ) -> None:  # fmt: skip
        self.curve, self.spot, self.piece = curve, spot, piece
        self.ahead, self.tolerances = ahead, tolerances
        self.weight = curve.weight
        across = np.random.default_rng(0).standard_normal(len(spot.y) + 1)
        self.across = across / curve.length(across[:-1], float(across[-1]))

    def found(self) -> list[Tangent]:
        """All ways but the one that led here; those that are sure where there are any."""
        back = Tangent(-self.spot.ty, -self.spot.tp, self.piece)
        sure: list[Tangent] = []
        short: list[Tangent] = []
        for tangent in self._candidates():
            if tangent.piece == self.piece and self._points(tangent, back):
                continue
            distance = self._reach(tangent)
            if distance is None or self._one(tangent, back):
                continue
            kept = sure if distance in SURE else short
            if not any(self._one(tangent, other) for other in kept):
                kept.append(tangent)
        return sure or short

    def all(self) -> list[Tangent]:
        """All ways from the spot, also back."""
        kept: list[Tangent] = []
        for tangent in self._candidates():
            if self._reach(tangent) is None:
                continue
            if not any(self._one(tangent, other) for other in kept):
                kept.append(tangent)
        return kept

    def meets_others(self) -> bool:
        """True where another piece is met around the spot."""
        s = self.spot
        probes = self._around(s.y, s.p, ASIDE)
        for sign in (1.0, -1.0):
            y, p = s.ahead(sign * ASIDE)
            probes += [(y, p), *self._around(y, p, ACROSS * ASIDE)]
        return any(self._piece(*probe) != self.piece for probe in probes)

    def _candidates(self) -> list[Tangent]:
        """Directions of the pieces that meet here, as far as probes meet them."""
        s = self.spot
        lines: dict[Hashable, tuple[Array, float]] = {self.piece: (s.ty, s.tp)}
        probes = [s.ahead(h) for h in self.ahead] + self._around(s.y, s.p, ASIDE)
        while probes and len(lines) <= PIECES:
            y, p = probes.pop(0)
            piece = self._piece(y, p)
            line = None if piece in lines else self._line(y, p)
            if line is None:
                continue
            lines[piece] = line
            for h in (ALONG, -ALONG):
                y, p = s.y + h * line[0], s.p + h * line[1]
                probes += self._around(y, p, ACROSS * ALONG)
        return [
            Tangent(sign * ty, sign * tp, piece) for piece, (ty, tp) in lines.items()
            for sign in (1.0, -1.0)
        ]  # fmt: skip

    def _around(self, y: Array, p: float, distance: float) -> list[tuple[Array, float]]:
        change = distance * self.across
        return [(y + s * change[:-1], p + s * float(change[-1])) for s in (1.0, -1.0)]

    def _piece(self, y: Array, p: float) -> Hashable:
        return name_of(self.curve.problem.piece(y, p))

    def _line(self, y: Array, p: float) -> tuple[Array, float] | None:
        try:
            return self.curve.any_tangent(y, p)
        except np.linalg.LinAlgError:
            return None

    def _points(self, a: Tangent, b: Tangent) -> bool:
        """True for the same direction."""
        along = product(a.direction, a.rate, b.direction, b.rate, self.weight)
        return along >= 1 - SAME

    def _reach(self, t: Tangent) -> float | None:
        """The largest distance at which a direction has a solution in its piece."""
        for h in (*SURE, *SHORT):
            ahead = self.spot.y + h * t.direction, self.spot.p + h * t.rate
            beside = (ahead, *self._around(*ahead, ACROSS * h))
            if all(self._piece(*place) != t.piece for place in beside):
                continue
            spot = self._solution(t, h)
            if spot is not None and self._piece(spot.y, spot.p) == t.piece:
                begins = self._solution(t, BEGIN) is not None  # not behind the next kink
                return self._surely(t, h) if begins else None
        return None

    def _surely(self, t: Tangent, h: float) -> float:
        """A distance of SURE where solutions go on that far, on whatever piece."""
        if h in SURE or all(self._solution(t, far) is None for far in SURE):
            return h
        return SURE[-1]

    def _solution(self, t: Tangent, h: float) -> Spot | None:
        y, p = self.spot.y + h * t.direction, self.spot.p + h * t.rate
        found = self.curve.correct(y, p, t.direction, t.rate, self.tolerances)
        if found is None:
            return None
        spot = found[0]
        return spot if self.curve.length(spot.y - y, spot.p - p) <= NEAR * h else None

    def _one(self, a: Tangent, b: Tangent) -> bool:
        """True where two directions lead along the same curve."""
        along = product(a.direction, a.rate, b.direction, b.rate, self.weight)
        if along < 1 - SAME:
            return False
        angle = np.sqrt(2 * max(1 - along, 0.0))
        for h in TOLD:
            x, z = self._solution(a, h), self._solution(b, h)
            if x is None or z is None:
                continue
            size = max(1.0, float(np.abs(x.y).max(initial=0)))
            if self.curve.length(x.y - z.y, x.p - z.p) > APART * size + angle * h:
                return False
        return True
