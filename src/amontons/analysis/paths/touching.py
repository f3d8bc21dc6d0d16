"""Tangents along the border of a piece: there the first order does not decide, the curve does.

A direction that stays in the border to first order belongs to a curve only if the curve of the
piece, which bends, stays inside; and two pieces that share it may hold one curve or two ([LR]
example 1).  So the curve of the piece is computed at some small distances, and what it does at
the smallest one at which it can be told from rounding decides.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.1.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .corrector import Curve, Spot, Tolerances

Array = NDArray[np.float64]
DISTANCES = (1e-5, 1e-4, 1e-3, 1e-2)  # weighted, ahead of the point
TOLERANCES = Tolerances(5e-12, 5e-12, 5)
ROUNDING = 1e-10  # change of a margin, or of an unknown of size one, that tells nothing


def ahead(
    problem: Any, piece: Hashable, y: Array, p: float, direction: Array, rate: float
) -> list[Spot | None]:
    """The points of a piece's curve at all distances; None where the corrector fails."""
    curve = Curve(problem, len(y), piece)
    found = []
    for h in DISTANCES:
        guess = y + h * direction, p + h * rate
        corrected = curve.correct(*guess, direction, rate, TOLERANCES)
        found.append(None if corrected is None else corrected[0])
    return found


def stays_inside(
    problem: Any, piece: Hashable, y: Array, p: float, near: NDArray[np.bool_],
    spots: list[Spot | None],
) -> bool:  # fmt: skip
    """False where the curve of a piece leaves it over one of the margins near zero.

    Also True where nothing could be computed.
    """
    here = problem.margins(piece, y, p)[near]
    unknown = np.ones(len(here), dtype=bool)
    for spot in spots:
        if spot is None:
            continue
        change = problem.margins(piece, spot.y, spot.p)[near] - here
        told = unknown & (np.abs(change) > ROUNDING)
        if (change[told] < 0).any():
            return False
        unknown &= ~told
    return True


def one_curve(a: list[Spot | None], b: list[Spot | None]) -> bool:
    """True where two curves with one tangent can not be told from each other."""
    for one, other in zip(a, b, strict=False):  # none where nothing was asked
        if one is None or other is None:
            continue
        size = max(1.0, float(np.abs(one.y).max(initial=0)))
        apart = max(float(np.abs(one.y - other.y).max(initial=0)), abs(one.p - other.p))
        if apart > ROUNDING * size:
            return False
    return True
