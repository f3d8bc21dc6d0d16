"""Pieces of the law of `current`: the statuses of contacts, and in 2D both ways of slip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...problem.law.states import SLIP

Array = NDArray[np.float64]
Pieces = NDArray[np.int8]
BACK = 3  # beside the statuses: slip against t, 2D only


def slides(kind: Pieces) -> NDArray[np.bool_]:
    """Pieces SLIP and BACK, (nc,)."""
    return (kind == SLIP) | (kind == BACK)


def tangents(n: Array) -> Array:
    """t of `frames` in 2D, (nc, 2)."""
    return np.stack([n[:, 1], -n[:, 0]], axis=1)
