"""Which patterns have no solution at any load between two, with multipliers that show it.

The search of `interval_search` on the whole interval at once, kept for a certificate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import InvalidInput
from ...problem.friction import FrictionProblem
from ..scaled import Scaled
from ..statuses import states_of, word
from .interval_search import Family, not_negative
from .load_interval import Piece
from .pattern_leaves import NODE, Cut

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Exclusions:
    """Which patterns have no solution at any load between two, and why.

    excluded: as in `Proof`, with multipliers (k, nc, 2); left: the complete patterns that are
    not; loads (2, nc, 2): at both ends of the interval, which begins or ends a little inside
    where there is no load.  middles (pieces, nc, 2): reactions r_N, r_T in the middle of each
    piece that was given, in their order.  All in the units of the problem.
    """

    excluded: tuple[str, ...]
    multipliers: Array
    left: tuple[str, ...]
    loads: Array
    middles: Array


def exclusions_between(
    start: FrictionProblem, end: FrictionProblem, pieces: Sequence[Piece], deadline: Deadline
) -> Exclusions:
    """What the search excludes on the whole interval between two loads.

    pieces: all that have solutions there, by `pieces_between`.

    Raises InvalidInput where friction differs too, W is not definite, or there is no load at
    an end: then solutions are multiples of those at the other one; TimeUp.
    """
    family = Family(*(Scaled.of(problem, deadline) for problem in (start, end)))
    if family.zero.any():
        raise InvalidInput("branches: there is no load at an end: solutions are multiples of "
                           "those at the other one, of which there is a list")  # fmt: skip
    if family.rubs or not family.bounded:
        why = "friction differs" if family.rubs else "W is not definite"
        raise InvalidInput(f"branches: expected loads alone to differ and W definite; {why}")
    cuts: list[Cut] = []
    left: list[str] = []
    work = NODE * (2.0 * family.scaled.contacts + 2) ** 2
    for leaves, more in family.leaves(family.interval, cuts=cuts):
        deadline.pay(work * more)
        left += [word(states) for states in leaves]
    loads = family.at(*family.interval)[0] * family.scaled.to_u.repeat(2)
    rows = np.array([y for _, y in cuts]).reshape(len(cuts), -1, 2)
    return Exclusions(
        tuple(word(states) for states, _ in cuts), rows, tuple(left), loads.reshape(2, -1, 2),
        np.array([_middle(family, piece) for piece in pieces]),
    )


def _middle(family: Family, piece: Piece) -> Array:
    """Reactions in the middle of a line, (nc, 2).

    A piece ends where it is sure, and a short one may have its middle farther from that of the
    line than any solution is from another.
    """
    states = states_of(piece.pattern)
    found = family.linear(states).slacks(*family.interval, 0.0)
    span = None if found is None else not_negative(*found[:2])
    if span is None:
        return piece.r
    first, last = family.interval
    return family.solution(states, first + (last - first) * (2 + sum(span)) / 4)
