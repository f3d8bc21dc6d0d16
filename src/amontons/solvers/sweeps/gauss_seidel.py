"""Non-smooth Gauss-Seidel (NSGS): contact after contact, each solved exactly.

    r_i <- r_i + relaxation (exact solution of contact i given all others - r_i)  [ABD] eq. (12)

A judgement costs nearly as much as a sweep.  With batch=ADAPTIVE one is due only when

    |r_{k+1} - r_k| / |r_{k+1}| < tau,                                            [ABD] eq. (14)

where tau is adapted: from each judged sweep to the change at which the error, falling in
proportion, will be the tolerance.  The error is that of the driver: with Criterion.NATURAL the
paper's (13).

A contact is solved exactly, or by an iteration of the literature (`local_contact`), which
local_tolerance and local_steps end early: three projections per visit are often quicker than a
hundred, as the next sweep changes the contact again.

Optionally with Anderson acceleration: the sweep G is a fixed-point map, and the next iterate is
the combination of the last ones whose residual G(r) - r is smallest.  A mixed iterate may leave
the cone; the next sweep brings it back, so only sweeps are ever handed out.  Or with Nesterov's
momentum (`momentum`), which keeps one vector more.

[ABD] V. Acary, M. Brémond, F. Dubois, "Méthodes de Newton non-lisses pour les problèmes de
contact frottant dans les systèmes de multi-corps flexibles", CSMA 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedLaw
from ...core.options import check_options
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb
from ..contract import Iterate, Iterates, Target, check_at_least
from .kernels import (
    Acceleration,
    Sweep,
    SweepOrder,
    counted,
    sweep_data,
    sweeps_until_inplace,
    watch_for,
)
from .local_contact import CLOSE, LocalSolver
from .momentum import Momentum
from .shared import sweeps as shared_sweeps

Array = NDArray[np.float64]
CHANGE_FLOPS = 5  # of criterion (14) per component of r
FIRST = 10  # sweeps before criterion (14) is first compared with the error
LONGEST = 100  # sweeps without an iterate at most: the driver has a clock and a callback


class Batch(Enum):
    """When Gauss-Seidel hands out an iterate, other than after a number of sweeps."""

    ADAPTIVE = "adaptive"


@dataclass(frozen=True)
class GaussSeidel:
    """NSGS on the Delassus form; one iterate per `batch` sweeps.

    anderson_depth > 0 accelerates: the window of past sweeps, 5 to 10 is usual; momentum=True
    does by momentum, best without relaxation.
    batch=Batch.ADAPTIVE judges when the cheap criterion [ABD] eq. (14) says so.
    """

    form: ClassVar[Form] = Form.DELASSUS
    local: LocalSolver = LocalSolver.EXACT  # how one contact is solved
    relaxation: float = 1.0  # below 2; 1.3 to 1.6 is often much faster on packings
    anderson_depth: int = 0  # past sweeps that are combined; 0: plain sweeps
    batch: int | Batch = 1  # sweeps between two judgements
    order: SweepOrder = SweepOrder.STORED  # of the contacts in a sweep
    local_tolerance: float | None = None  # relative change of one contact; 1e-14
    local_steps: int | None = None  # on one contact; 20 of Newton, 100 projections
    momentum: bool = False  # Nesterov's, restarted when a sweep changes more than the last

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(0, anderson_depth=self.anderson_depth)
        self._check_local()
        if not 0 < self.relaxation < 2:
            text = f"expected between 0 and 2, got {self.relaxation}"
            raise InvalidInput(text, ("relaxation",))
        accelerated = "anderson_depth" if self.anderson_depth else "momentum"
        if not isinstance(self.batch, Batch):
            check_at_least(1, batch=self.batch)
        elif self.anderson_depth or self.momentum:
            raise InvalidInput(
                f"ADAPTIVE compares plain sweeps, with {accelerated} give a number", ("batch",)
            )
        if self.anderson_depth and self.momentum:
            raise InvalidInput("momentum: sweeps are accelerated by anderson_depth already")

    def _check_local(self) -> None:
        for name in ("local_tolerance", "local_steps"):
            if getattr(self, name) is not None and self.local is LocalSolver.EXACT:
                raise InvalidInput(
                    f"{name}: the exact solution of a contact takes no steps; "
                    "use local NEWTON or PROJECTION"
                )
        if self.local_tolerance is not None and not 0 < self.local_tolerance < 1:
            raise InvalidInput(
                f"local_tolerance: expected between 0 and 1, got {self.local_tolerance}"
            )
        if self.local_steps is not None:
            check_at_least(1, local_steps=self.local_steps)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterates:
        """Sweeps from `start`, for ever."""
        d = problem.dimension
        if not isinstance(problem.law, Coulomb) and self.local is not LocalSolver.EXACT:
            raise UnsupportedLaw(f"local={self.local.name}: needs Coulomb friction; use EXACT")
        data = sweep_data(
            problem, self.local, self.relaxation, self.order,
            close=CLOSE if self.local_tolerance is None else self.local_tolerance,
            steps=self.local_steps,
        )  # fmt: skip
        never = watch_for(0.0)
        r = spatial(start.r)
        if isinstance(self.batch, Batch):
            yield from _adaptive(problem, data, r, target)
            return
        if self.anderson_depth or self.momentum:
            depth = self.anderson_depth
            memory = Acceleration(data, r, depth) if depth else Momentum(data, r)
            while True:
                done, flops = memory.sweep(self.batch, never)
                yield Iterate(memory.r[:, :d].copy(), iterations=done, flops=flops)
        while True:
            run = partial(shared_sweeps, data, r, self.batch, never)
            done, flops = counted(data, run)
            yield Iterate(r[:, :d].copy(), iterations=done, flops=flops)


def _adaptive(
    problem: FrictionProblem, data: Sweep, r: Array, target: Target
) -> Iterates:
    """Sweeps from r, an iterate where [ABD] eq. (14) holds or after LONGEST of them."""
    before, d = np.empty_like(r), problem.dimension
    sweeps, tau = FIRST, target.tolerance
    while True:
        run = partial(sweeps_until_inplace, data, r, before, sweeps, tau)
        (done, change), flops = counted(data, run)
        flops += CHANGE_FLOPS * done * r.size
        iterate = Iterate(r[:, :d].copy(), iterations=done, flops=flops)
        error = target.error(problem, iterate, (yield iterate))
        if 0 < error < math.inf:
            tau = change * min(target.tolerance / error, 0.5)
        sweeps = LONGEST
