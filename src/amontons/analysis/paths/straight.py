"""What paths of straight lines share: whether a path is one, and the tangents at a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import UnsupportedForm
from .first_order import first_order
from .friction_path import FrictionPath
from .tangents import FirstOrder

Array = NDArray[np.float64]
TIE = 1e-10  # scaled condition that counts as zero at an event


def leaving(path: FrictionPath, y: Array, p: float) -> FirstOrder:
    """All one-sided branches at a solution, one without a border having two."""
    check_straight(path)
    return first_order(path, y, p, tolerance=TIE * max(1.0, float(np.abs(y).max(initial=0))))


def check_straight(path: FrictionPath) -> None:
    """Raise UnsupportedForm where the pieces are not straight lines."""
    if not path.straight or path.tresca:
        raise UnsupportedForm(
            "event tracking: expected a 2D problem with Coulomb friction and a load parameter, "
            "whose pieces are straight lines; use method='general'"
        )
