"""What is answered about other solutions for the same load, in 2D and 3D."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...solutions.discs.proof import DiscBox
from ...solutions.enumerate import PieceSolution
from ..load_multipliers import LoadMultipliers

Array = NDArray[np.float64]


class LoadOutcome(Enum):
    """What is known about other solutions for the same load."""

    CERTIFIED = "certified"  # there is no other
    REFUTED = "refuted"  # here is another
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class LoadBranch:
    """One part of a certificate: no other solution has statuses of this pattern.

    pattern: per contact f free, s stick, + or - slip, x slip, c closed, . anything.
    multipliers: (nc, 4, 4) for z - z0, or (nc, 5, 5) for (z, 1), z = (r_N, r_T, u_N, u_T), in
    the units of the problem.
    """

    pattern: str
    multipliers: Array


@dataclass(frozen=True, eq=False)
class LoadCertificate:
    """The answer of `certify_load`.

    other: a second solution where REFUTED.  branches: what proves CERTIFIED; together they have
    all patterns.  distance: bound of the difference of reactions to r0 (nc, 2), relative to
    the largest reaction or, if that is larger, to what the load can make.  examined:
    inequalities that were solved.  multipliers: of every contact, what proves CERTIFIED without
    branches; else how far they came, None where they were not looked for.
    """

    outcome: LoadOutcome
    other: PieceSolution | None
    branches: tuple[LoadBranch | DiscBox, ...]
    r0: Array
    distance: float
    examined: int
    reason: str
    seconds: float
    unresolved: bool = False  # is it undecided because loads differ too much?
    multipliers: LoadMultipliers | None = None

    def __str__(self) -> str:
        return f"{self.outcome.value}: {self.reason}"
