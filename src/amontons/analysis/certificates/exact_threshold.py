"""The friction from which on some pattern of statuses is singular, by all determinants.

Every pattern found with a negative determinant gives a smaller upper bound, where that one
vanishes; the lower bound is proved when just below it every pivot is positive.  Small windows
of contacts, the others held in the statuses of the best pattern, find the upper bound first.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ..statuses import FREE, States
from . import determinant_search as search
from .determinant_search import NEGATIVE, POSITIVE, STOPPED, UNKNOWN
from .status_pieces import Pieces

Array = NDArray[np.float64]
LARGEST = 1e4  # friction up to which a threshold is looked for
CLOSE = 1e-6  # distance of lower and upper bound, relative
WINDOW = 7  # contacts of a window: 4^7 patterns take about a millisecond
WINDOW_WORK = 2e6  # operations of preparing a window
STRIDES = (1, 2, 3, 4, 6)  # of the contacts of a window, by how strongly they are coupled
PATTERNS = 500_000  # between two looks at the clock
PIVOT = 500.0  # operations that a pivot counts for, with its share of Schur complements


@dataclass(eq=False)
class Threshold:
    """Bounds on t: all patterns keep their sign below lower; `states` is singular at upper.

    null: r (2 k,) with E W r = 0 at upper.  proved: lower comes from a complete search.
    """

    upper: float = np.inf
    states: States | None = None
    null: Array | None = None
    lower: float = 0.0
    proved: bool = False
    seen: int = field(default=0)

    def take(self, pieces: Pieces, states: States) -> bool:
        """Take a pattern as the new upper bound where it is a smaller one."""
        answer = pieces.threshold(states)
        if answer is None or not answer[0] < self.upper:
            return False
        self.upper, self.null = answer
        self.states = states.copy()
        return True


def exact_threshold(
    pieces: Pieces, threshold: Threshold, deadline: Deadline,
    allowed: NDArray[np.bool_] | None = None,
) -> None:  # fmt: skip
    """Close the bounds of `threshold` by all patterns, as far as time allows.

    allowed: the states of every contact, by default all that a contact can have.
    """
    n = pieces.contacts
    allowed = pieces.allowed() if allowed is None else allowed
    while True:
        t = min(threshold.upper * (1 - CLOSE), LARGEST)
        sign, states, seen = first_failure(pieces.W, t * pieces.shape, allowed, deadline)
        threshold.seen += seen
        if sign == POSITIVE:
            threshold.lower, threshold.proved = t, True
            return
        if sign == STOPPED:
            return
        states = np.concatenate([states, np.full(n - len(states), FREE)])
        if not threshold.take(pieces, states):
            _below(pieces, threshold, allowed, deadline)
            return


def _below(
    pieces: Pieces, threshold: Threshold, allowed: NDArray[np.bool_], deadline: Deadline
) -> None:
    """A lower bound where rounding hides the signs just below the threshold."""
    for gap in (1e-5, 1e-4, 1e-3, 1e-2, 1e-1):
        t = min(threshold.upper, LARGEST) * (1 - gap)
        sign, _, seen = first_failure(pieces.W, t * pieces.shape, allowed, deadline)
        threshold.seen += seen
        if sign == POSITIVE:
            threshold.lower, threshold.proved = t, True
        if sign in (POSITIVE, STOPPED):
            return


def first_failure(
    W: Array, m: Array, allowed: NDArray[np.bool_], deadline: Deadline = NEVER,
    rounding: Array | float = 0.0,
) -> tuple[int, States, int]:  # fmt: skip
    """(sign, pattern of the first contacts, pivots seen) of the first pivot that is not > 0.

    The sign is NEGATIVE or UNKNOWN (within rounding of zero); POSITIVE where all patterns pass,
    STOPPED at the deadline.  rounding: of the entries of W.
    """
    n = len(m)
    if n == 0:
        return POSITIVE, np.zeros(0, dtype=np.int64), 0
    S, B = np.zeros((2, n, 2 * n, 2 * n))
    S[0], B[0] = W, rounding
    work = np.empty((2, 2 * n, 2 * n))
    turn, states = np.zeros((2, n), dtype=np.int64)
    level = total = 0
    while True:
        sign, level, seen = search.search_inplace(
            m, allowed, S, B, work, turn, states, level, PATTERNS
        )
        total += seen
        deadline.spend(PIVOT * seen)
        if sign != STOPPED or deadline.passed:
            return sign, states[: level + 1].copy(), total


# ------------------------------------------------------------- upper bounds from windows
def search_windows(pieces: Pieces, threshold: Threshold, deadline: Deadline) -> None:
    """Lower the upper bound by all patterns of windows of contacts, until none helps.

    A window is a contact with its nearest others, or every second one of them and so on: some
    patterns only move as a whole.
    """
    n = pieces.contacts
    order = np.argsort(-pieces.coupling, axis=1, kind="stable")
    reach = [s for s in STRIDES if s == 1 or s * (WINDOW - 1) < n]
    windows = [np.sort(order[c, : s * WINDOW : s][:WINDOW]) for s in reach for c in range(n)]
    base = np.full(n, FREE) if threshold.states is None else threshold.states
    idle = 0  # windows since the last success
    while idle < len(windows):
        for window in windows:
            idle += 1
            while _improve(pieces, threshold, base, window, deadline):
                assert threshold.states is not None
                base, idle = threshold.states, 0
                if deadline.passed:
                    return
            if idle >= len(windows) or deadline.passed:
                return


def _improve(
    pieces: Pieces, threshold: Threshold, base: States, window: NDArray[np.int64],
    deadline: Deadline,
) -> bool:  # fmt: skip
    """Look for a singular pattern below the upper bound that differs from base in a window."""
    t = min(threshold.upper * (1 - CLOSE), LARGEST)
    outside = base.copy()
    outside[window] = FREE
    deadline.spend(WINDOW_WORK + float((outside != FREE).sum() * 2) ** 3)
    S = remaining(pieces, outside, window, t)
    if S is None:
        return threshold.take(pieces, outside)
    allowed = pieces.allowed()[window]
    sign, found, seen = first_failure(S, t * pieces.shape[window], allowed, deadline)
    threshold.seen += seen
    if sign not in (NEGATIVE, UNKNOWN):
        return False
    states = outside.copy()
    states[window[: len(found)]] = found
    return threshold.take(pieces, states)


def remaining(
    pieces: Pieces, states: States, window: NDArray[np.int64], t: float
) -> Array | None:
    """Schur complement of W for the window, the others in their states; None if singular."""
    rows = pieces.rows(states)
    inside = (2 * window[:, None] + [0, 1]).ravel()
    if not len(rows):
        return pieces.W[np.ix_(inside, inside)]
    E = pieces.matrix(states, t)
    slip, m = pieces.slipping(states)
    left = pieces.W[np.ix_(inside, rows)]
    left[:, np.searchsorted(rows, 2 * slip)] += pieces.W[np.ix_(inside, 2 * slip + 1)] * (t * m)
    sign, size = np.linalg.slogdet(E)
    if not sign > 0 or not np.isfinite(size):
        return None
    return pieces.W[np.ix_(inside, inside)] - left @ np.linalg.solve(
        E, pieces.W[np.ix_(rows, inside)]
    )
