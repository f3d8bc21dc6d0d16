"""Newton's steps and sweeps in turn: the end of what sweeps alone only come near to.

Where statuses are found what is left of the error sits in few modes that go through the whole
packing, in which sweeps need ten thousands; a step of Newton's method has them at once.  Alone
it is hardly ever taken whole: contacts that slide slowly turn with a small part of it, and
others open or stick again.  These are what a few sweeps put right.  So a step

    (A + B W + shift) dr = -F,   F of Alart and Curnier, A = dF/dr, B = dF/du,

is judged by its error after some sweeps, in parts of its length until that is smaller.  The
shift, in r's unit, is a proximal term that holds reactions where they are more than balances:
smaller after whole steps, larger after short ones.  Where no part of a step with a larger and
larger shift helps, reactions are in a trap: a place that is no solution but nearly one.  The
matrix is almost singular there in one direction, to which F belongs: along it nothing changes
but the place.  That direction is the step with the least shift, however long.  So the trap is
left by sweeps that go on without asking for a smaller error and, in turn with them, along that
direction from the best reaction, to one side and the other, nearer and farther.

The idea is that of nonlinear preconditioning: X.-C. Cai, D. Keyes, SIAM J. Sci. Comput. 24
(2002); the proximal term that of R. T. Rockafellar, SIAM J. Control Optim. 14 (1976).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...linear.block_kernels import velocity_of_rows_inplace
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ..sweeps.kernels import sweep_data, watch_for
from ..sweeps.shared import sweeps
from .block_lu import Symbolic, newton_step_inplace
from .functions import AlartCurnier

Array = NDArray[np.float64]
SWEEPS = 100  # after a part of a step, before it is judged
PARTS = (1.0, 0.25, 0.0625, 0.015625)  # of a step, tried in this order
FIRST_SHIFT, LEAST_SHIFT, MOST_SHIFT = 1e-5, 1e-10, 1e-2  # relative to rho W_ii, about 1
SOFTER, STIFFER, MUCH_STIFFER = 0.1, 3.0, 10.0  # after a whole step, a short one, none
TRUSTED = 1e-4  # relative residual of a step up to which its factor is believed
FAILURES = 4  # steps without a part that helps, after which they lead nowhere
STALLED, LESS = 8, 0.7  # so many steps without a part of the error do the same
WANDERED, KICKED = 10, 2  # times as many sweeps alone then, and after a kick
# Length of kicks along a step from the best reaction, of that: one after another, and again.
KICKS = (0.05, -0.05, 0.15, -0.15, 0.5, -0.5, 0.015, -0.015, 0.005, -0.005)


@dataclass(eq=False)
class Alternation:
    """Where steps and sweeps have come to: r (nc, 3) and its error, unit of u."""

    problem: FrictionProblem
    r: Array
    error: float
    shift: float = FIRST_SHIFT
    failures: int = 0
    steps: int = 0  # of Newton in the last advance: 0 or 1
    traps: int = 0  # times that steps led nowhere
    kicks: int = 0  # since the best reaction last was another one
    kick: Array | None = None  # direction of these, (nc, 3), as long as the reaction

    def __post_init__(self) -> None:
        self.data = sweep_data(self.problem)
        self.best, self.least = self.r, self.error
        self.mark, self.since = self.error, 0  # error when that last fell, steps since
        self.symbols = Symbolic.of(self.problem).arrays

    @property
    def stalled(self) -> bool:
        """True where steps lead nowhere, and that place is left next."""
        return self.since >= STALLED or self.failures >= FAILURES

    def advance(self, goal: float) -> int:
        """One step, in the part that helps; the sweeps that it took.  goal: unit of u."""
        self.steps = 0
        if self.stalled:
            self.traps += 1
            done = self._leave(goal)
        else:
            done = self._go_on(goal)
        if self.error < self.least:
            self.best, self.least, self.kicks, self.kick = self.r, self.error, 0, None
        return done

    def _go_on(self, goal: float) -> int:
        self.since += 1
        self.steps = 1
        step = self._step(self.r, self.shift)
        done, helped = (0, False) if step is None else self._along(step, goal)
        if not helped:
            self.shift = min(MUCH_STIFFER * self.shift, MOST_SHIFT)
            self.failures += 1
        return done

    def _along(self, step: Array, goal: float) -> tuple[int, bool]:
        """Sweeps made from parts of a step, and whether one of them helps, which is taken."""
        done = 0
        for part in PARTS:
            trial = self.r + part * step
            done += sweeps(self.data, trial, SWEEPS, watch_for(goal))
            error = self._judge(trial)
            if not error < self.error:
                continue
            self.r, self.error, self.failures = trial, error, 0
            if error < LESS * self.mark:
                self.mark, self.since = error, 0
            if part == 1.0:
                self.shift = max(SOFTER * self.shift, LEAST_SHIFT)
            elif part < PARTS[1]:
                self.shift = min(STIFFER * self.shift, MOST_SHIFT)
            return done, True
        return done, False

    def _leave(self, goal: float) -> int:
        """Sweeps from elsewhere, or further from here, without asking for a smaller error."""
        trial, count = self.r.copy(), WANDERED * SWEEPS
        if self.traps % 2 == 0:
            kicked = self._kicked()
            if kicked is not None:
                trial, count = kicked, KICKED * SWEEPS
        done = sweeps(self.data, trial, count, watch_for(goal))
        self.r, self.error = trial, self._judge(trial)
        self.mark, self.since, self.failures, self.shift = self.error, 0, 0, FIRST_SHIFT
        return done

    def _kicked(self) -> Array | None:
        """The best reaction, moved along its step; None where it has none."""
        if self.kick is None:
            self.steps = 1
            step = self._step(self.best, LEAST_SHIFT)
            length = 0.0 if step is None else float(np.linalg.norm(step))
            if step is None or length == 0.0:
                return None
            self.kick = step * (np.linalg.norm(self.best) / length)
        part = KICKS[self.kicks % len(KICKS)]
        self.kicks += 1
        return self.best + part * self.kick

    def _judge(self, r: Array) -> float:
        error = natural_error(*self.problem.product_data, r)
        return error if math.isfinite(error) else math.inf

    def _step(self, r: Array, shift: float) -> Array | None:
        """dr (nc, 3) at r, or None where the factor is not to be believed."""
        indptr, indices, data, q, _, _, rho = self.problem.kernel_data
        u, dr = np.empty_like(r), np.empty_like(r)
        velocity_of_rows_inplace(0, len(q), indptr, indices, data, q, r, u)
        F, A, B = AlartCurnier().linearise(r, u, self.problem.law, rho)
        A += shift * np.eye(3)
        with np.errstate(all="ignore"):
            residual = newton_step_inplace(indptr, indices, data, A, B, F, *self.symbols, dr)
        return dr if residual <= TRUSTED and np.isfinite(dr).all() else None
