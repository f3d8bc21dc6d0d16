"""Where the instance of a part stands in an assembly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .cards import Card, Row, number

Array = NDArray[np.float64]


def motion(card: Card) -> Callable[[Array], Array]:
    """How an instance stands: translated, then turned about an axis by an angle in degrees."""
    rows = [row for row in card.rows() if any(row.fields)]
    shift, turn = np.zeros(3), np.eye(3)
    about = np.zeros(3)
    for row in rows[:2]:
        values = [number(text, row, "instance") for text in row.fields]
        if len(values) <= 3:
            shift[: len(values)] = values
        elif len(values) == 7:
            about = np.array(values[:3])
            turn = _rotation(np.array(values[3:6]) - about, np.deg2rad(values[6]), row)
        else:
            raise row.error(
                "instance: expected a translation (3 numbers) or an axis and an angle (7), "
                f"got {len(values)}"
            )
    return lambda points: (points + shift - about) @ turn.T + about


def _rotation(axis: Array, angle: float, row: Row) -> Array:
    size = float(np.linalg.norm(axis))
    if not size:
        raise row.error("instance: the two points of the axis are one")
    x, y, z = axis / size
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
