"""Algorithm 2 of [LR]: the tangent on the other side of a kink, for problems that do not tell.

The tangent of the next piece is that of the selection function that is active a little ahead;
its sense is the one in which that selection function stays active.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot

Array = NDArray[np.float64]
AHEAD = 1.5  # h_1 / h_min
REACH = 1e5  # largest h_2 / h_min that is tried


def switched_tangent(
    curve: Curve, spot: Spot, min_step: float, cosine: float
) -> tuple[Array, float] | None:
    """(y', p') of length 1 that leads away from a kink just ahead, None if none does."""
    for factor in (1.0, 10.0, 100.0, 1000.0):  # how far ahead the next piece is looked for
        ahead = AHEAD * min_step * factor
        line = _line(curve, *spot.ahead(ahead))
        if line is None or _aligned(curve, line, (spot.ty, spot.tp)) >= cosine:
            continue  # still the piece from which the curve comes
        found = _sense(curve, spot, line, min_step, cosine)
        if found is not None:
            return found
    return None


def _sense(
    curve: Curve, spot: Spot, line: tuple[Array, float], min_step: float, cosine: float
) -> tuple[Array, float] | None:
    """Step 3: the side on which the line stays the tangent, further and further away."""
    ty, tp = line
    distance = min_step
    while distance <= REACH * min_step:
        for r in (1.0, -1.0):
            other = _line(curve, spot.y + r * distance * ty, spot.p + r * distance * tp)
            if other is not None and _aligned(curve, other, line) >= cosine:
                return r * ty, r * tp
        distance += min_step * 10 ** np.floor(np.log10(distance / min_step))
    return None


def _line(curve: Curve, y: Array, p: float) -> tuple[Array, float] | None:
    try:
        return curve.any_tangent(y, p)
    except np.linalg.LinAlgError:
        return None


def _aligned(curve: Curve, a: tuple[Array, float], b: tuple[Array, float]) -> float:
    return abs(curve.product(*a, *b))
