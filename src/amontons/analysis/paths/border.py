"""Locating the border of a piece on the smooth curve of that piece, which goes on beyond it.

Between two points the curve and its margins are interpolated by cubics, by their values and
slopes there: the first zero of a cubic is a prediction with an error of the fourth order, so
two or three corrections do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot, Tolerances
from .path import PathProblem

Array = NDArray[np.float64]
NUDGE = 1e-7  # step along the tangent, by which slopes of margins are measured
HALVINGS = 54  # of an interval in which a cubic has a zero
PATIENCE = 4  # predictions between two halvings of the interval that is left
RISING = 1e-7  # slope of a margin with which a curve leaves a border
NONE = 1e-15  # an interval too short to be halved


@dataclass(frozen=True, eq=False)
class Knot:
    """A point at a distance h from the first one along its tangent.

    margins (k,) and their slopes dm/dh; rate: of the arclength, by h.
    """

    h: float
    spot: Spot
    margins: Array
    slopes: Array
    rate: float


class Border:
    """The border of a piece between a point inside of it and one beyond."""

    def __init__(
        self, problem: PathProblem, curve: Curve, start: Spot, tolerances: Tolerances
    ) -> None:
        self.problem, self.curve, self.start = problem, curve, start
        self.tolerances = tolerances

    def located(
        self, step: float, end: Spot, zero: float, shorter: bool = False
    ) -> Spot | None:
        """Where the first margin vanishes, up to `zero`; end: the point a step ahead.

        None where the corrector fails or, if it can be shorter, where the step passes the piece
        from one border to another, as where a contact opens and closes again.
        """
        low, high = self._knot(0.0, self.start), self._knot(step, end)
        watched = np.flatnonzero(high.margins < 0)
        on_border = low.margins[watched] <= 0
        if on_border.any():
            entering = low.slopes[watched][on_border] > RISING
            return None if shorter and entering.all() else low.spot
        for count in range(1, 61):
            h = _first_zero(low, high, watched)
            if count % PATIENCE == 0:
                h = (low.h + high.h) / 2
            found = self.curve.correct(*_cubic(low, high, h), self.start.ty, self.start.tp,
                                       self.tolerances)  # fmt: skip
            if found is None:
                return None
            new = self._knot(h, found[0])
            value = float(new.margins[watched].min())
            if abs(value) <= zero or high.h - low.h <= NONE:
                return new.spot
            low, high = (new, high) if value > 0 else (low, new)
        return low.spot

    def _knot(self, h: float, spot: Spot) -> Knot:
        margins = self._margins(spot.y, spot.p)
        ahead = self._margins(*spot.ahead(NUDGE))
        finite = np.isfinite(margins) & np.isfinite(ahead)
        rate = 1 / self.curve.product(spot.ty, spot.tp, self.start.ty, self.start.tp)
        slopes = np.zeros_like(margins)
        slopes[finite] = rate * (ahead[finite] - margins[finite]) / NUDGE
        return Knot(h, spot, margins, slopes, rate)

    def _margins(self, y: Array, p: float) -> Array:
        return self.problem.margins(self.curve.piece, y, p)


def _basis(t: Array | float) -> tuple[Array | float, ...]:
    """Hermite's cubics: of both values and of both slopes."""
    return ((1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t),
            (1 - t) ** 2 * t, -(t**2) * (1 - t))  # fmt: skip


def _first_zero(low: Knot, high: Knot, watched: NDArray[np.int64]) -> float:
    """The first h at which the cubic of a margin vanishes, among those that change sign."""
    changing = watched[(high.margins[watched] < 0) & (low.margins[watched] > 0)]
    length = high.h - low.h
    a, b = np.zeros(len(changing)), np.ones(len(changing))
    for _ in range(HALVINGS):
        t = (a + b) / 2
        weights = _basis(t)
        value = (
            weights[0] * low.margins[changing] + weights[1] * high.margins[changing]
            + length * (weights[2] * low.slopes[changing] + weights[3] * high.slopes[changing])
        )  # fmt: skip
        a, b = np.where(value > 0, t, a), np.where(value > 0, b, t)
    return low.h + length * float(((a + b) / 2).min(initial=1.0))


def _cubic(low: Knot, high: Knot, h: float) -> tuple[Array, float]:
    """The point at h on the cubic through two points along their tangents."""
    length = high.h - low.h
    w = _basis((h - low.h) / length)
    one, two = low.spot, high.spot
    slopes = length * low.rate * w[2], length * high.rate * w[3]
    y = w[0] * one.y + w[1] * two.y + slopes[0] * one.ty + slopes[1] * two.ty
    p = w[0] * one.p + w[1] * two.p + slopes[0] * one.tp + slopes[1] * two.tp
    return y, float(p)
