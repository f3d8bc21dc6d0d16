"""Gauss-Seidel sweeps with Nesterov's momentum, restarted when a sweep changes more.

    x = r_k + b_k (r_k - r_{k-1}),   open where x_N < 0 and nothing ties
    r_{k+1} = sweep(x)
    t_{k+1} = (1 + sqrt(1 + 4 t_k^2)) / 2,   b_k = (t_k - 1) / t_{k+1},   t_0 = 1

t returns to 1 when the change of a sweep is larger than that of the one before [OC, 3.2].  One
vector more than plain sweeps.  On packings that roll, where statuses go on changing, it goes on
falling where plain sweeps need ten times as many and Newton's method stands; on stacks of rigid
blocks, where reactions are far from unique, it may come to a halt.

[N] Y. Nesterov, Soviet Mathematics Doklady 27 (1983); [OC] B. O'Donoghue, E. Candès, "Adaptive
restart for accelerated gradient schemes", Foundations of Computational Mathematics 15 (2015).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...problem.law.law import TIED
from .kernels import Sweep, content, sweep_flops, sweep_inplace
from .shared import SharedSweep

Array = NDArray[np.float64]
MOMENTUM_FLOPS = 3  # per component of r


@njit(cache=True, error_model="numpy")
def push_inplace(kind, r, old, t):
    """r becomes the next point to sweep from, old what r was; returns the next t."""
    after = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))
    b = (t - 1.0) / after
    for i in range(len(r)):
        goes = r[i, 0] + b * (r[i, 0] - old[i, 0]) > 0.0 or kind[i] == TIED
        for a in range(3):
            now = r[i, a]
            r[i, a] = now + b * (now - old[i, a]) if goes else 0.0
            old[i, a] = now
    return after


@njit(cache=True, error_model="numpy")
def momentum_inplace(s, r, old, pace, sweeps, watch):
    """Up to `sweeps` sweeps on r (nc, 3), fewer when the judge is content; returns how many.

    old (nc, 3): the reaction before r; pace (2,): t and the change of the last sweep, from
    where a call goes on.  watch: see `watch_for`.
    """
    for k in range(sweeps):
        after = push_inplace(s.kind, r, old, pace[0])
        change = sweep_inplace(s, False, r)
        pace[0] = 1.0 if change > pace[1] else after
        pace[1] = change
        if content(s, r, change, watch):
            return k + 1
    return sweeps


def _momentum(s: Sweep, r: Array, old: Array, pace: Array, sweeps: int, watch: Array) -> int:  # noqa: PLR0913
    """The same, a large problem in several threads."""
    sweep = SharedSweep.of(s)
    if sweep is None:
        return momentum_inplace(s, r, old, pace, sweeps, watch)
    for k in range(sweeps):
        after = push_inplace(s.kind, r, old, pace[0])
        change = sweep(r)
        pace[:] = 1.0 if change > pace[1] else after, change
        if content(s, r, change, watch):
            return k + 1
    return sweeps


@dataclass(eq=False)
class Momentum:
    """Sweeps with momentum, and what they remember between two calls; r (nc, 3) is kept."""

    data: Sweep
    r: Array
    pace: Array = field(default_factory=lambda: np.array([1.0, math.inf]))

    def __post_init__(self) -> None:
        self.r = self.r.copy()
        self.old = self.r.copy()

    def sweep(self, sweeps: int, watch: Array) -> tuple[int, float]:
        """Go on for `sweeps` sweeps or until the judge is content; sweeps done, operations."""
        s, before = self.data, float(self.data.work[0])
        done = _momentum(s, self.r, self.old, self.pace, sweeps, watch)
        own = MOMENTUM_FLOPS * self.r.size * done
        return done, sweep_flops(s, done, float(s.work[0]) - before) + own
