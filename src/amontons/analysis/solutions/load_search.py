"""All linear pieces that have a solution at some load between two, in 2D, with proof.

    u = W r + (1 - t) c_0 + t c_1,    0 <= t <= 1,

the share t of the way from one load to the other being one more unknown of `pattern_search`,
which excludes patterns for all t at once.  On a pattern that is left, r, u and the slacks of
its inequalities are linear in t: with bounds of all errors at both ends (`piece_solution`) each
slack tells where it surely is, and where it may be, not negative.  So there is a `LoadPiece`
for each line of the diagram, closed ones included, and no other line exists.

Patterns that only touch: one contact that changes its status has a solution on all of its
statuses at that load, a contact at rest on both of its slips.  Theirs are solutions of a
piece, within `NEAR`; what is neither that nor sure leaves a doubt.

Where all of q_i of a contact vanishes at an end, as where a load grows from zero on closed
gaps, all patterns meet: the interval begins or ends START of its length inside.  Where all of q
does, solutions at all other loads are multiples of those at the other end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ..multipliers.rounding import EPSILON
from ..scaled import Scaled
from ..statuses import States, word
from ..tolerances import DATA, SAME
from .pattern_leaves import NODE, leaves_of
from .piece_solution import Located, PieceSystem, located
from .plane_problem import PlaneProblem

Array = NDArray[np.float64]
LEAF = 4e6  # operations of a pattern that is left, besides its linear system
START = 1e-6  # of the interval, by which ends without load are left out
POINT = 1e-8  # share of the interval up to which a piece is a point
NEAR = SAME  # distance of scaled solutions that count as one, relative to the largest


@dataclass(frozen=True, eq=False)
class LoadPiece:
    """A linear piece that has a solution at every share of the load from low to high.

    pattern: as of `PieceSolution`.  r_low, r_high (nc, 2): reactions at both ends; between
    them r is linear.
    """

    pattern: str
    low: float
    high: float
    r_low: Array
    r_high: Array

    def at(self, share: float) -> Array:
        """r, (nc, 2), at a share between low and high."""
        part = (share - self.low) / (self.high - self.low)
        return (1 - part) * self.r_low + part * self.r_high


@dataclass(frozen=True, eq=False)
class LoadPieces:
    """What `pieces_between` found; doubt: empty where these are proved to be all.

    interval: the shares of the load that this holds for.  touching: patterns whose solutions
    are those of pieces within rounding.  examined: partial patterns that were looked at.
    """

    pieces: tuple[LoadPiece, ...]
    interval: tuple[float, float]
    touching: int
    doubt: str
    examined: int


@dataclass(frozen=True, eq=False)
class _Line:
    """Where a pattern has solutions, shares of the searched interval: surely, and possibly."""

    states: States
    sure: tuple[float, float]
    possible: tuple[float, float]
    ends: tuple[Located, Located]

    def r(self, t: float) -> Array:
        """Scaled reactions at t, (2 nc,)."""
        return (1 - t) * self.ends[0].r + t * self.ends[1].r

    @property
    def is_sure(self) -> bool:
        """True where it has solutions on more than a point, whatever rounding does."""
        return self.sure[1] - self.sure[0] > POINT


def pieces_between(
    start: FrictionProblem, end: FrictionProblem, deadline: Deadline
) -> LoadPieces:
    """All pieces that have a solution between two problems, which differ in their load alone.

    Raises TimeUp where W is not there in time.
    """
    a, b = (Scaled.of(problem, deadline) for problem in (start, end))
    if not a.contacts:
        return LoadPieces((LoadPiece("", 0.0, 1.0, a.q, b.q),), (0.0, 1.0), 0, "", 0)
    if not (a.q.any() or b.q.any()):
        return LoadPieces((), (0.0, 1.0), 0, "there is no load at either end", 0)
    scaled = a if a.to_u[0] >= b.to_u[0] else b  # the larger unit
    loads = np.stack([(x.q * (x.to_u / scaled.to_u)).ravel() for x in (a, b)])
    low, high = _searched(loads)
    corners = np.stack([(1 - t) * loads[0] + t * loads[1] for t in (low, high)])
    search = _Search(PlaneProblem(scaled, corners), ~loads.any(axis=1), deadline)
    search.run()
    sure = [line for line in search.lines if line.is_sure]
    others = [line for line in search.lines if not line.is_sure]
    new = [line for line in others if not _touches(line, sure)]
    doubt = search.doubt
    if not doubt and new:
        doubt = f"{len(new)} patterns are too near to a solution to be excluded"
    span = high - low
    pieces = tuple(
        LoadPiece(
            word(line.states), low + span * line.sure[0], low + span * line.sure[1],
            line.r(line.sure[0]).reshape(-1, 2) * scaled.to_r,
            line.r(line.sure[1]).reshape(-1, 2) * scaled.to_r,
        )
        for line in sorted(sure, key=lambda line: line.sure)
    )  # fmt: skip
    return LoadPieces(pieces, (low, high), len(others) - len(new), doubt, search.nodes)


def _searched(loads: Array) -> tuple[float, float]:
    """The interval without ends at which contacts have no load of their own."""
    size = np.abs(loads).max(initial=0.0)
    still = [
        bool((np.abs(c.reshape(-1, 2)).max(axis=1, initial=0.0) <= DATA * size).any())
        for c in loads
    ]
    return (START if still[0] else 0.0, 1.0 - START if still[1] else 1.0)


class _Search:
    """The search for patterns, and what it left; zero (2,): which ends have no load at all."""

    def __init__(
        self, plane: PlaneProblem, zero: NDArray[np.bool_], deadline: Deadline
    ) -> None:
        self.plane, self.zero, self.deadline = plane, zero, deadline
        self.corners = [copy(plane), copy(plane)]
        for corner, load in zip(self.corners, plane.loads, strict=True):
            corner.c = load
        self.lines: list[_Line] = []
        self.nodes = 0
        self.doubt = ""

    def run(self) -> None:
        """Fill `lines`; `doubt` says what stands against their being all."""
        size = 2.0 * self.plane.contacts + 2
        singular = 0
        for leaves, more, done in self._leaves():
            self.nodes += more
            say(f"all loads: {self.nodes} partial patterns, {len(self.lines)} pieces")
            self.deadline.spend(NODE * size**2 * more)
            for states in leaves:
                self.deadline.spend(LEAF + 20.0 * size**3)
                if self.deadline.passed:
                    break
                singular += not self._examined(states[:-1])
            if self.deadline.passed and not (done and not len(leaves)):
                self.doubt = f"stopped after {self.deadline}"
                return
        if singular:
            self.doubt = (
                f"{singular} patterns have a singular matrix, and may have many solutions"
            )
        elif not self.plane.box.bounded:
            self.doubt = "W is singular: reactions may grow without bound"

    def _leaves(self) -> Iterator[tuple[States, int, bool]]:
        """The turns of the search; the load is a contact of its own, a = t and u_N = 1 - t."""
        plane, box = self.plane, self.plane.box
        m = len(box.c)
        unit = 1 / box.to_u * plane.scaled.to_u.repeat(2)
        A, spread, c = np.zeros((m + 2, m + 2)), np.zeros(m + 2), np.zeros(m + 2)
        first, last = (unit * load for load in plane.loads)
        if self.zero.any():  # loads are multiples: one stands for all
            first = last = last if self.zero[0] else first
        A[:m, :m], A[:m, m], A[m, m] = box.A, last - first, -1.0
        spread[:m] = box.spread + 4 * EPSILON * (np.abs(first) + np.abs(last))
        c[:m], c[m] = first, 1.0
        low = np.concatenate([box.low, [0.0, 0.0, 0.0, 0.0]])
        high = np.concatenate([box.high, [1.0, 0.0, 1.0, 0.0]])
        reacts, frictional = (np.append(x, True) for x in (plane.reacts, plane.mu > 0))
        return leaves_of(A, spread, c, (low, high), reacts, frictional, loaded=True)

    def _examined(self, states: States) -> bool:
        """Keep what a pattern has; False where its matrix is singular."""
        first, last = (PieceSystem.of(corner, states) for corner in self.corners)
        for data in (DATA, 0.0):
            found = first.inverse(data)
            if found is None:
                continue
            a, b = (located(system, *found, data) for system in (first, last))
            possible = _not_negative(a.slack + a.off_slack, b.slack + b.off_slack)
            if possible is not None:
                sure = _not_negative(a.slack - a.off_slack, b.slack - b.off_slack)
                self.lines.append(_Line(states, sure or (1.0, 0.0), possible, (a, b)))
            return True
        return False


def _not_negative(a: Array, b: Array) -> tuple[float, float] | None:
    """The shares t at which no (1 - t) a + t b is negative, if there are any."""
    low, high = 0.0, 1.0
    for x, y in zip(a, b, strict=True):
        if x < 0 and y < 0:
            return None
        if x < 0:
            low = max(low, x / (x - y))
        elif y < 0:
            high = min(high, x / (x - y))
    return (low, high) if low <= high else None


def _touches(line: _Line, sure: Sequence[_Line]) -> bool:
    """True where all possible solutions of a line are those of sure ones, within NEAR."""
    low, high = line.possible
    kinks = [t for other in sure for t in other.possible if low < t < high]
    stops = sorted({low, *kinks, high})
    pairs = list(zip(stops[:-1], stops[1:], strict=True)) or [(low, low)]
    return all(
        any(
            other.possible[0] - POINT <= p and q <= other.possible[1] + POINT
            and _same(line.r(p), other.r(p)) and _same(line.r(q), other.r(q))
            for other in sure
        )
        for p, q in pairs if q - p > POINT or len(pairs) == 1
    )  # fmt: skip


def _same(r: Array, other: Array) -> bool:
    size = max(1.0, float(np.abs(r).max(initial=0.0)), float(np.abs(other).max(initial=0.0)))
    return bool(np.abs(r - other).max(initial=0.0) <= NEAR * size)
