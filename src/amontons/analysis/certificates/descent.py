"""Descent by limited memory of gradients, on values that may have been found too small.

Iterative methods see the largest eigenvalue of a matrix from below, and now and then miss it.
A step is taken then because of a value that nothing near it has, all further trials are above
it, and a line search that trusts it ends the search where it only began.  So the first trial
of a line that is refused puts the value at its beginning in doubt: it is looked for again, from
what the trial has found, and the line begins anew, with all that is remembered, where it was
too small.

[Nocedal] J. Nocedal, S. J. Wright, "Numerical Optimization", 2nd ed. (2006), algorithm 7.4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
T = TypeVar("T")
REMEMBERED = 10  # steps whose gradients are kept
TRIALS = 6  # of a line
ARMIJO = 1e-4  # part of the decrease along the slope that is enough
SHORTER, SHORTEST = 0.5, 0.1  # of the last trial, between which the next one is
WALL = 0.2  # of the last trial where that has no value
RISE = 1e-6  # by which a value that is looked for again was too small
FLAT, LEVEL = 1e-5, 2e-9  # slope in one unknown, relative decrease, where a search ends
CURVED = 1e-10  # relative: steps along which the slope rises less tell nothing


@dataclass(eq=False)
class Point(Generic[T]):
    """A value with its gradient at x, inf where there is none, and what it was made of."""

    x: Array
    value: float
    gradient: Array
    kept: T


@dataclass(eq=False)
class Descent(Generic[T]):
    """The search for a smaller value.

    at: the point at x.  again: the same point looked at anew, the larger value is nearer to
    the truth; None where values are exact.  Both may raise what ends the search; `best` is what
    was found until then.  goal: a value below which the search ends.
    """

    at: Callable[[Array], Point[T]]
    again: Callable[[Point[T]], Point[T]] | None = None
    goal: float = -np.inf
    best: Point[T] | None = None
    memory: list[tuple[Array, Array, float]] = field(default_factory=list)

    def run(self, x: Array, steps: int) -> None:
        """So many steps from x, with at most twice as many values."""
        here, values = self._seen(x), 1
        most = 2 * steps
        while steps > 0 and values < most and np.isfinite(here.value):
            if here.value < self.goal:
                here = self._doubted(here)
                if here.value < self.goal:
                    return
            if np.abs(here.gradient).max(initial=0.0) < FLAT:
                return
            there, here, tried = self._line(here)
            values += tried
            if there is None:
                if not self.memory:
                    return
                self.memory.clear()
                continue
            self._remember(there.x - here.x, there.gradient - here.gradient)
            level = here.value - there.value <= LEVEL * max(abs(here.value), 1.0)
            here, steps = there, steps - 1
            if level:
                return

    def _seen(self, x: Array) -> Point[T]:
        """The point at x."""
        point = self.at(x)
        if self.best is None or point.value < self.best.value:
            self.best = point
        return point

    def _line(self, here: Point[T]) -> tuple[Point[T] | None, Point[T], int]:
        """(the next point, the one before it as it is known now, number of values)."""
        doubted, step, tried = self.again is None, 1.0, 0
        d, slope = self._downhill(here)
        left = TRIALS
        while left > 0 and slope < 0:
            left -= 1
            there, tried = self._seen(here.x + step * d), tried + 1
            if there.value <= here.value + ARMIJO * step * slope:
                return there, here, tried
            if not np.isfinite(there.value):
                step *= WALL
                continue
            if not doubted:  # once a line: the next trial may be below
                doubted, before = True, here.value
                here = self._doubted(here)
                if there.value <= here.value + ARMIJO * step * slope:
                    return there, here, tried
                if here.value > before + RISE:
                    (d, slope), step, left = self._downhill(here), 1.0, TRIALS
                    continue
            bent = 2 * (there.value - here.value - slope * step)
            step *= min(max(-slope * step / bent, SHORTEST), SHORTER)
        return None, here, tried

    def _doubted(self, here: Point[T]) -> Point[T]:
        """The same point with the value that it has by what was found since."""
        if self.again is None:
            return here
        found = self.again(here)
        if found.value <= here.value:
            return here
        if self.best is here:
            self.best = found
        return found

    def _downhill(self, here: Point[T]) -> tuple[Array, float]:
        """(direction d, slope along it) by the gradients that are remembered."""
        d, parts = here.gradient.copy(), []
        for s, y, inverse in reversed(self.memory):
            parts.append(inverse * (s @ d))
            d -= parts[-1] * y
        if self.memory:
            s, y, inverse = self.memory[-1]
            d /= inverse * (y @ y)
        else:
            d /= max(float(np.linalg.norm(d)), 1e-300)
        for (s, y, inverse), part in zip(self.memory, reversed(parts), strict=True):
            d += s * (part - inverse * (y @ d))
        return -d, -float(here.gradient @ d)

    def _remember(self, s: Array, y: Array) -> None:
        """A step and the change of the gradient along it."""
        along = float(s @ y)
        if along > CURVED * np.linalg.norm(s) * np.linalg.norm(y):
            self.memory.append((s, y, 1 / along))
            del self.memory[:-REMEMBERED]
