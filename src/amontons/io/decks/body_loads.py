"""Loads in the bodies of a deck: gravity, and the centrifugal load of a steady rotation.

GRAV: rho g along a direction.  CENTRIF: rho omega^2 times the way from the axis, of undeformed
bodies, with omega^2 as the deck gives it; in 2D the axis is one through the plane, or in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mechanics.model import BodyForce
from .cards import Row, number
from .course import Course

Array = NDArray[np.float64]
Way = tuple[Array, ...]  # of gravity (3,); or a point and the direction of an axis
COMPONENTS = 3


def way_of(row: Row, label: str) -> Way:
    """What a line of *DLOAD has after the size; directions get the length 1."""
    values = np.array([number(text, row, label) for text in row.fields[3:]])
    spins = label == "CENTRIF"
    if len(values) != COMPONENTS * (1 + spins) or not values[-COMPONENTS:].any():
        what = "a point and a direction" if spins else "a direction"
        raise row.error(f"{label}: expected a value and three components of {what}")
    way = values[-COMPONENTS:] / np.linalg.norm(values[-COMPONENTS:])
    return (values[:COMPONENTS], way) if spins else (way,)


def scaled(course: Course | None, factor: float) -> Course:
    """A course times a number; none is one that stays 0."""
    if course is None:
        return Course()
    return replace(course, values=tuple(factor * v for v in course.values))


def body_force(
    region: str, course: Course, way: Way, value: Callable[[Course], Any], dim: int
) -> BodyForce:
    """The load of a region; the course has the density in it; value: of a course at a time."""
    if len(way) == 1:
        return BodyForce([value(scaled(course, w)) for w in way[0][:dim]], region=region)
    point, axis = way
    size: Any = value(course)
    across = np.eye(COMPONENTS) - np.outer(axis, axis)

    def away(x: Array) -> Array:
        return (across[:, :dim] @ x - across @ point)[:dim]

    if isinstance(size, float):
        return BodyForce(lambda x: size * away(x), region=region)
    return BodyForce(lambda x, t: size(x, t) * away(x), region=region)
