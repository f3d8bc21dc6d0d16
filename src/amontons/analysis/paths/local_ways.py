"""All ways on from a kink, for problems that only tell which piece is active.

Pieces around the point are met by probes: ahead, aside, and along the tangent lines of the
pieces that have been met.  A direction counts if it lies in its piece and a solution is found
along it, at distances at which one that only seems to be there would show ([LR] example 1).
Two directions count as two curves only if their solutions, on one plane across both, are apart:
where they have an angle at the nearest distance that resolves it, as further away other kinks
lie between; where they touch at any distance at which both are on the pieces they began on.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace

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
ALIKE = 0.9  # cosine of directions that may belong to one curve
RESOLVED = (1e-7, 1e-6, 1e-5)  # where curves with an angle are held against each other
APART = 1e-10  # distance of two solutions of size one that are not the same
CLEAR = 10.0  # of it, that directions are to be apart where their angle tells


@dataclass(frozen=True, eq=False)
class Way:
    """A direction; sure: its solutions go far; off: distance of the nearest to its tangent."""

    tangent: Tangent
    sure: bool
    off: float


class LocalWays:
    """The ways on from a spot that was reached on a piece."""

    def __init__(
        self, curve: Curve, spot: Spot, piece: Hashable, ahead: tuple[float, ...],
        tolerances: Tolerances,
    ) -> None:  # fmt: skip
        self.curve, self.spot, self.piece = curve, spot, piece
        self.ahead, self.tolerances = ahead, tolerances
        self.weight = curve.weight
        self.known: dict[tuple[int, float], tuple[Tangent, Spot | None]] = {}
        across = np.random.default_rng(0).standard_normal(len(spot.y) + 1)
        self.across = across / curve.length(across[:-1], float(across[-1]))

    def found(self) -> list[Tangent]:
        """All ways but the one that led here; those that are sure where there are any."""
        back = Tangent(-self.spot.ty, -self.spot.tp, self.piece)
        ahead = (
            t for t in self._candidates()
            if t.piece != self.piece or self._cosine(t, back) < 1 - SAME
        )  # fmt: skip
        return self._distinct(ahead, back)

    def all(self) -> list[Tangent]:
        """All ways from the spot, also back."""
        return self._distinct(self._candidates())

    def _distinct(
        self, candidates: Iterable[Tangent], back: Tangent | None = None
    ) -> list[Tangent]:
        """One tangent per curve, of those that lead into their piece; the sure ones if any.

        Those that can not be told from one count as one.  Where a piece is short the one
        behind it has a solution nearby, too, on the same curve: the tangent with the least
        distance to its solution is that of the curve.  back: one whose curve is left out.
        """
        kept: list[Way] = []
        for tangent in candidates:
            way = self._way(tangent)
            if way is None:
                continue
            known = False if back is None else self._one(tangent, back)
            if known:
                continue
            way = replace(way, sure=way.sure and known is not None)
            same = [
                k for k, other in enumerate(kept)
                if self._one(tangent, other.tangent) is not False
            ]  # fmt: skip
            if not same:
                kept.append(way)
            elif way.off < kept[same[0]].off:
                kept[same[0]] = replace(way, sure=way.sure or kept[same[0]].sure)
        sure = [way.tangent for way in kept if way.sure]
        return sure or [way.tangent for way in kept]

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

    def _way(self, t: Tangent) -> Way | None:
        """A direction with a solution in its piece; None where there is none."""
        for h in (*SURE, *SHORT):
            ahead = self.spot.y + h * t.direction, self.spot.p + h * t.rate
            beside = (ahead, *self._around(*ahead, ACROSS * h))
            if all(self._piece(*place) != t.piece for place in beside):
                continue
            spot = self._solution(t, h)
            if spot is not None and self._piece(spot.y, spot.p) == t.piece:
                begin = self._solution(t, BEGIN)
                if begin is None:
                    return None
                sure = h in SURE or any(self._solution(t, far) is not None for far in SURE)
                y, p = self.spot.y + BEGIN * t.direction, self.spot.p + BEGIN * t.rate
                return Way(t, sure, self.curve.length(begin.y - y, begin.p - p))
        return None

    def _solution(self, t: Tangent, h: float) -> Spot | None:
        key = id(t), h
        if key not in self.known:
            y, p = self.spot.y + h * t.direction, self.spot.p + h * t.rate
            found = self.curve.correct(y, p, t.direction, t.rate, self.tolerances)
            near = found is not None and (
                self.curve.length(found[0].y - y, found[0].p - p) <= NEAR * h
            )
            self.known[key] = t, found[0] if found is not None and near else None
        return self.known[key][1]

    def _cosine(self, a: Tangent, b: Tangent) -> float:
        return product(a.direction, a.rate, b.direction, b.rate, self.weight)

    def _one(self, a: Tangent, b: Tangent) -> bool | None:
        """Whether two directions lead along the same curve; None where that can not be told."""
        along = self._cosine(a, b)
        if along < ALIKE:
            return False
        if along >= 1 - SAME:
            told = [self._coincide(a, b, h) for h in TOLD if self._begun(a, b, h)]
            return all(one is not False for one in told)
        angle = np.sqrt(2 * (1 - along))
        size = max(1.0, float(np.abs(self.spot.y).max(initial=0)))
        told = (
            self._coincide(a, b, h) for h in RESOLVED if h * angle > CLEAR * APART * size
        )
        return next((one for one in told if one is not None), None)

    def _begun(self, a: Tangent, b: Tangent, h: float) -> bool:
        """True where the solutions at a distance are on the pieces of both directions."""
        spots = [(t, self._solution(t, h)) for t in (a, b)]
        return all(s is not None and self._piece(s.y, s.p) == t.piece for t, s in spots)

    def _coincide(self, a: Tangent, b: Tangent, h: float) -> bool | None:
        """Whether the solutions at a distance are one on a plane across both directions.

        None where one is missing.
        """
        x, z = self._solution(a, h), self._solution(b, h)
        if x is None or z is None:
            return None
        normal = self.curve.unit(a.direction + b.direction, a.rate + b.rate)
        half = self.curve.product(z.y - x.y, z.p - x.p, *normal) / 2
        found = []
        for spot, way in ((x, half), (z, -half)):
            place = spot.ahead(way / self.curve.product(spot.ty, spot.tp, *normal))
            found.append(self.curve.on_plane(*place, *normal, self.tolerances))
        one, other = found
        if one is None or other is None:
            return None
        size = max(1.0, float(np.abs(x.y).max(initial=0)))
        return self.curve.length(one[0] - other[0], one[1] - other[1]) <= APART * size
