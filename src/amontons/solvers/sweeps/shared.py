"""Sweeps over large problems in several threads: the loops of `kernels`, step by step.

Threads share the visits of a sweep (`chunks`) and the vectors of Anderson's mixing (`mixing`).
Small problems go through the compiled loops of the same names.  Which of both it is depends on
the problem alone, not on the number of threads: compiled into another loop, sums may be formed
in another order.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.threads import FINER, Range, over_blocks, shared, split
from .chunks import SUMMED, stages_of
from .kernels import (
    Sweep,
    anderson_inplace,
    content,
    sweeps_inplace,
    visit_inplace,
)
from .mixing import choose, combine, record, sums_of

Array = NDArray[np.float64]
CONTACT_WORK = 150.0  # of a contact, in numbers that a sweep touches


@njit(cache=True, error_model="numpy", nogil=True)
def _visit_part(begin, end, s, r, sums):
    """Visit some contacts; sums: of their changes squared."""
    for first in range(begin, end, SUMMED):
        last = min(first + SUMMED, end)
        sums[first // SUMMED] = visit_inplace(s, first, last, False, r)


@njit(cache=True)
def _total(sums):
    """In the order of `sweep_inplace`."""
    change = 0.0
    for part in sums:
        change += part
    return math.sqrt(change)


class SharedSweep:
    """One sweep after another on the data of one problem."""

    def __init__(self, s: Sweep) -> None:
        self.s = s
        self.sums = np.empty(-(-len(s.order) // SUMMED))
        work = 9.0 * len(s.indices) + CONTACT_WORK * len(s.order)
        self.stages = [_joined(part, 0.5 * work) for part in stages_of(s.work)]

    @classmethod
    def of(cls, s: Sweep) -> SharedSweep | None:
        """None where there is nothing to share."""
        return None if len(s.work) < 3 else cls(s)

    def __call__(self, r: Array) -> float:
        """Sweep on r (nc, 3); the change."""
        for stage in self.stages:
            shared(_visit_part, stage, (self.s, r, self.sums))
        return float(_total(self.sums))


def _joined(chunks: list[Range], work: float) -> list[Range]:
    """Chunks that follow one another, joined to some ranges for each thread.

    More than elsewhere: these take milliseconds, of which late threads leave more to others.
    """
    parts = split(len(chunks), work, finer=2 * FINER)
    return [(chunks[a][0], chunks[b - 1][1]) for a, b in parts]


def sweeps(s: Sweep, r: Array, count: int, watch: Array) -> int:
    """As `sweeps_inplace`."""
    sweep = SharedSweep.of(s)
    if sweep is None:
        return sweeps_inplace(s, r, count, watch)
    for k in range(count):
        if content(s, r, sweep(r), watch):
            return k + 1
    return count


def anderson(  # noqa: PLR0913
    s: Sweep, r: Array, x: Array, history: Array, gram: Array, stored: NDArray, count: int,
    watch: Array,
) -> int:  # fmt: skip
    """As `anderson_inplace`."""
    sweep = SharedSweep.of(s)
    if sweep is None:
        return anderson_inplace(s, r, x, history, gram, stored, count, watch)
    r[:, :] = x
    for k in range(count):
        if content(s, r, sweep(r), watch):
            x[:, :] = r
            return k + 1
        _mix(r, x, history, gram, stored, x if k + 1 == count else r)
    return count


def _mix(r: Array, x: Array, history: Array, gram: Array, stored: NDArray, into: Array) -> None:  # noqa: PLR0913
    """As `mix_inplace`; what x becomes is put `into` as well."""
    sums, weights = sums_of(history), np.zeros(gram.shape[1])
    g, point, size = r.reshape(-1), x.reshape(-1), float(r.size)
    used = min(int(stored[0]) + 1, len(weights))
    over_blocks(record, r.size, (6.0 + used) * size, g, point, history, stored, sums)
    filled = choose(gram, stored, sums, weights)
    work = (3.0 + filled) * size
    over_blocks(combine, r.size, work, g, point, into.reshape(-1), history, weights, filled)
