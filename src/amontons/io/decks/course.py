"""A value over time, as the steps of a deck prescribe it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Course:
    """A value over time: straight between these points, constant after the last."""

    times: tuple[float, ...] = (0.0,)
    values: tuple[float, ...] = (0.0,)

    def at(self, t: float) -> float:
        """The value at a time; NaN where it goes on from what is not known here."""
        found = float(np.interp(t, self.times, self.values))
        return found if np.isfinite(found) or t not in self.times else self._given(t)

    def _given(self, t: float) -> float:
        return self.values[len(self.times) - 1 - self.times[::-1].index(t)]

    @property
    def is_open(self) -> bool:
        """True where it begins, or is held, at what is not known here."""
        return bool(np.isnan(self.values).any())

    def since(self, t: float, value: float) -> Course:
        """The course from a time on, at which it is known to be `value`."""
        later = [(s, v) for s, v in zip(self.times, self.values, strict=True) if s > t]
        ends = [(s, value if np.isnan(v) else v) for s, v in later]
        begin = (t, self.at(t) if np.isfinite(self.at(t)) else value)
        times, values = zip(begin, *ends, strict=True)
        return Course(times, values)

    @property
    def last(self) -> float:
        """The value at the end."""
        return self.values[-1]

    @property
    def is_zero(self) -> bool:
        """True for a value that is always 0."""
        return not any(self.values)

    def then(self, times: Sequence[float], values: Sequence[float]) -> Course:
        """This course with more points, those at its end and after."""
        kept = [k for k, t in enumerate(self.times) if t < times[0]]
        return Course((*(self.times[k] for k in kept), *times),
                      (*(self.values[k] for k in kept), *values))  # fmt: skip

    def until(self, t: float) -> Course:
        """What it was up to a time, at least its first point."""
        kept = [k for k, time in enumerate(self.times) if time <= t] or [0]
        return Course(tuple(self.times[k] for k in kept), tuple(self.values[k] for k in kept))
