"""All tangents at a point of a problem that only names the active piece, found by probes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from .corrector import Curve, Spot
from .local_ways import LocalWays
from .path import name_of
from .tangent_switch import AHEAD
from .tangents import FirstOrder, Tangent

if TYPE_CHECKING:
    from .continuation import Continuation

Array = NDArray[np.float64]
REASON = "the problem does not tell its pieces: these tangents were found by probes"


def by_probes(curve: Curve, y: Array, p: float, options: Continuation) -> FirstOrder:
    """The one-sided tangents at a solution; `complete` is False.

    Raises SingularOperator where no tangent is unique.
    """
    piece = name_of(curve.problem.piece(y, p))
    try:
        ty, tp = curve.any_tangent(y, p)
    except np.linalg.LinAlgError as reason:
        raise SingularOperator(
            f"start: the tangent is not unique at {p:g}: curves cross there, or solutions "
            "are not isolated; start at another point of the curve"
        ) from reason
    ahead = tuple(factor * options.ahead_of_kink for factor in AHEAD)
    ways = LocalWays(curve, Spot(y, p, ty, tp), piece, ahead, options.tolerances)
    one = Tangent(ty, tp, piece)
    found = ways.all() if ways.meets_others() else []
    return FirstOrder(tuple(found) or (one, -one), (), False, REASON)
