"""Algorithm 2 of [LR]: the tangent on the other side of a kink, for problems that do not tell.

The tangent of the next piece is that of the selection function that is active a little ahead.
Its sense is the one that keeps the orientation, the sign of the bordered determinant: the test
of [LR], on which side that selection function stays active, can mislead where several kinks
follow closely or the tangents are nearly parallel; it decides where a determinant vanishes.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot

if TYPE_CHECKING:
    from .continuation import Continuation

Array = NDArray[np.float64]
AHEAD = (1.0, 10.0, 150.0, 1.5e3, 1.5e4)  # times h_1, one after the other
REACH = 1e5  # times h_2, the largest that is tried


def switched_tangent(
    curve: Curve, spot: Spot, options: Continuation, cosine: float
) -> tuple[Array, float] | None:
    """(y', p') of length 1 that leads away from a kink just ahead, None if none does."""
    for factor in AHEAD:
        there = spot.ahead(options.ahead_of_kink * factor)
        line = _line(curve, *there)
        if line is None or _aligned(curve, line, (spot.ty, spot.tp)) >= cosine:
            continue  # still the piece from which the curve comes
        sign = curve.orientation(*there, *line)
        if sign and spot.sign:
            r = sign * spot.sign
            return r * line[0], r * line[1]
        found = _sense(curve, spot, line, options.aside_of_kink, cosine)
        if found is not None:
            return found
    return None


def _sense(
    curve: Curve, spot: Spot, line: tuple[Array, float], first: float, cosine: float
) -> tuple[Array, float] | None:
    """Step 3: the side on which the line stays the tangent, further and further away."""
    ty, tp = line
    distance = first
    while distance <= REACH * first:
        for r in (1.0, -1.0):
            other = _line(curve, spot.y + r * distance * ty, spot.p + r * distance * tp)
            if other is not None and _aligned(curve, other, line) >= cosine:
                return r * ty, r * tp
        distance += first * 10 ** np.floor(np.log10(distance / first))
    return None


def _line(curve: Curve, y: Array, p: float) -> tuple[Array, float] | None:
    try:
        return curve.any_tangent(y, p)
    except np.linalg.LinAlgError:
        return None


def _aligned(curve: Curve, a: tuple[Array, float], b: tuple[Array, float]) -> float:
    return abs(curve.product(*a, *b))
