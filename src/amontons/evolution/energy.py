"""Energy balance of a step.

With v_theta = theta v1 + (1 - theta) v0 and dq = h v_theta, a step of the theta method obeys

    gain of kinetic + elastic = loads + supports + contact - damping - numerical,
    numerical = (theta - 1/2) (|v1 - v0|_M^2 + |q1 - q0|_K^2) >= 0,

up to the residual of the contact solve, which `defect` holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Energies:
    """Energies at the end of a step, and works within it, all in the unit of work.

    loads, supports: work done on the bodies.  contact: work of all contacts and impacts, never
    positive.  damping, numerical: dissipated, never negative.  gain: of kinetic + elastic.
    """

    kinetic: float = 0.0
    elastic: float = 0.0
    gain: float = 0.0
    loads: float = 0.0
    supports: float = 0.0
    contact: float = 0.0
    damping: float = 0.0
    numerical: float = 0.0

    @property
    def total(self) -> float:
        """Kinetic and elastic energy at the end."""
        return self.kinetic + self.elastic

    @property
    def defect(self) -> float:
        """What the balance misses: zero but for the tolerance of the solve."""
        works = self.loads + self.supports + self.contact - self.damping - self.numerical
        return self.gain - works

    @property
    def turnover(self) -> float:
        """Size of what the balance sums up, to compare the defect with."""
        parts = (self.gain, self.loads, self.supports, self.contact, self.damping,
                 self.numerical)  # fmt: skip
        return sum(abs(part) for part in parts)
