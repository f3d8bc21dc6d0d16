"""Non-smooth Gauss-Seidel (NSGS): contact after contact, each solved exactly.

    r_i <- r_i + relaxation (exact solution of contact i given all others - r_i)  [ABD] eq. (12)

A judgement costs nearly as much as a sweep.  With batch=ADAPTIVE one is due only when

    |r_{k+1} - r_k| / |r_{k+1}| < tau,                                            [ABD] eq. (14)

where tau is adapted: from each judged sweep to the change at which the error, falling in
proportion, will be the tolerance.

Optionally with Anderson acceleration: the sweep G is a fixed-point map, and the next iterate is
the combination of the last ones whose residual G(r) - r is smallest.  A mixed iterate may leave
the cone; the next sweep brings it back, so only sweeps are ever handed out.

[ABD] V. Acary, M. Brémond, F. Dubois, "Méthodes de Newton non-lisses pour les problèmes de
contact frottant dans les systèmes de multi-corps flexibles", CSMA 2017.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..blocks import spatial
from ..cones import Tresca
from ..errors import InvalidInput, UnsupportedForm
from ..options import check_options
from ..problem import Form, FrictionProblem
from .base import Iterate, Target, check_at_least
from .local_contact import LocalSolver
from .sweeps import (
    Acceleration,
    Sweep,
    SweepOrder,
    sweep_data,
    sweeps_inplace,
    sweeps_until_inplace,
    watch_for,
)

Array = NDArray[np.float64]
FIRST = 10  # sweeps before criterion (14) is first compared with the error
LONGEST = 100  # sweeps without an iterate at most: the driver has a clock and a callback


class Batch(Enum):
    """When Gauss-Seidel hands out an iterate, other than after a number of sweeps."""

    ADAPTIVE = "adaptive"


@dataclass(frozen=True)
class GaussSeidel:
    """NSGS on the Delassus form; one iterate per `batch` sweeps.

    anderson_depth > 0 accelerates: the window of past sweeps, 5 to 10 is usual.
    batch=Batch.ADAPTIVE judges when the cheap criterion [ABD] eq. (14) says so.
    """

    form: ClassVar[Form] = Form.DELASSUS
    local: LocalSolver = LocalSolver.EXACT  # how one contact is solved
    relaxation: float = 1.0  # below 2; 1.3 to 1.6 is often much faster on packings
    anderson_depth: int = 0  # past sweeps that are combined; 0: plain sweeps
    batch: int | Batch = 1  # sweeps between two judgements
    order: SweepOrder = SweepOrder.STORED  # of the contacts in a sweep

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(0, anderson_depth=self.anderson_depth)
        if not 0 < self.relaxation < 2:
            raise InvalidInput(f"relaxation: expected between 0 and 2, got {self.relaxation}")
        if not isinstance(self.batch, Batch):
            check_at_least(1, batch=self.batch)
        elif self.anderson_depth:
            raise InvalidInput(
                "batch: ADAPTIVE compares plain sweeps, with anderson_depth give a number"
            )

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Sweeps from `start`, for ever."""
        d = problem.dimension
        if isinstance(problem.law, Tresca) and self.local is not LocalSolver.EXACT:
            raise UnsupportedForm(f"local={self.local.name}: needs Coulomb friction; use EXACT")
        data = sweep_data(problem, self.local, self.relaxation, self.order)
        never = watch_for(0.0)
        r = spatial(start.r)
        if isinstance(self.batch, Batch):
            yield from _adaptive(problem, data, r, target)
            return
        if self.anderson_depth:
            memory = Acceleration(data, r, self.anderson_depth)
            while True:
                done = memory.sweep(self.batch, never)
                yield Iterate(memory.r[:, :d].copy(), iterations=done)
        while True:
            done = sweeps_inplace(data, r, self.batch, never)
            yield Iterate(r[:, :d].copy(), iterations=done)


def _adaptive(
    problem: FrictionProblem, data: Sweep, r: Array, target: Target
) -> Iterator[Iterate]:
    """Sweeps from r, an iterate where [ABD] eq. (14) holds or after LONGEST of them."""
    before, d = np.empty_like(r), problem.dimension
    sweeps, tau = FIRST, target.tolerance
    while True:
        done, change = sweeps_until_inplace(data, r, before, sweeps, tau)
        iterate = Iterate(r[:, :d].copy(), iterations=done)
        error = problem.error(iterate.r)
        yield iterate  # whoever asks for more was not content
        if 0 < error < math.inf:
            tau = change * min(target.tolerance / error, 0.5)
        sweeps = LONGEST
