"""A choice of problems of graded difficulty, for comparisons of methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput

Array = NDArray[np.float64]


def graded(difficulty: Sequence[float], count: int) -> NDArray[np.int64]:
    """Indices (count,), ascending, of problems spread evenly between easiest and hardest.

    difficulty: a number for each problem, such as the iterations of a method; a problem with
    one that is not finite is never chosen.  Goals stand at equal distances between least and
    largest difficulty; each, from the hardest down, takes the nearest problem that is left, of
    several the one farthest (by index) from those that are chosen.

    >>> graded([4, 4, 4, 9, 6, 5], 3).tolist()
    [0, 3, 4]
    """
    value = np.asarray(difficulty, dtype=float)
    left = np.isfinite(value)
    if not 1 <= count <= left.sum():
        raise InvalidInput(
            f"count: expected a number from 1 to {left.sum()}, the problems with a difficulty, "
            f"got {count!r}"
        )
    chosen: list[int] = []
    low, high = value[left].min(), value[left].max()
    for goal in np.linspace(high, low, count):
        distance = np.where(left, np.abs(value - goal), np.inf)
        near = np.flatnonzero(distance == distance.min())
        taken = np.array(chosen if chosen else [-1])
        apart = np.abs(near[:, None] - taken).min(axis=1)
        best = int(near[apart.argmax()]) if chosen else int(near[0])
        left[best] = False
        chosen.append(best)
    return np.sort(np.array(chosen, dtype=np.int64))
