"""All linear pieces that have a solution at some load or friction between two, in 2D, proved.

    u = W r + c(t),    c = (1 - t) c_0 + t c_1,    mu = (1 - t) mu_0 + t mu_1,    0 <= t <= 1.

`pattern_search` excludes status patterns for all t of a cell [a, b] at once: the load is one
more unknown, slip lies between both ends of mu, and what sticks within the larger one.  Cells
that leave too much are halved.  The slacks of a pattern that is left are linear over the cell
up to a bound (`moving_pattern`), which tells where it surely has a solution and where it
possibly has one; the rest is divided again.  There is a `Piece` for each line of the diagram,
closed ones included, and no other line exists.

Patterns that only touch: one contact that changes its status has a solution on all of its
statuses at that t, a contact at rest on both of its slips.  Theirs are solutions of a piece,
within NEAR; what is neither that nor sure leaves a doubt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import TimeUp
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ..multipliers.rounding import EPSILON, gamma
from ..scaled import Scaled
from ..statuses import ANY, FREE, LOAD, MINUS, PLUS, States, word
from ..tolerances import DATA, SAME
from .load_interval import LoadInterval, Piece, Pieces, Span
from .moving_pattern import MovingPattern
from .pattern_leaves import NODE, Cut, leaves_of
from .plane_problem import PlaneProblem

Array = NDArray[np.float64]
LEAF = 4e6  # operations of a part of a pattern that is left, besides its linear system
POINT = 1e-9  # share of the interval up to which a part is a point
PARTS = 400  # of one pattern on a cell, after which it is left undecided
LEAVES = 30  # patterns of a cell, above which it is halved
NODES = 30_000  # partial patterns of a cell, likewise
CELL = 1e-4  # share of the interval below which no cell is halved
NEAR = SAME  # distance of scaled solutions that count as one, relative to the largest


def pieces_between(start: FrictionProblem, end: FrictionProblem, deadline: Deadline) -> Pieces:
    """All pieces with a solution between two problems, which differ in load and friction alone.

    Raises TimeUp where W is not there in time.
    """
    a, b = (Scaled.of(problem, deadline) for problem in (start, end))
    if not a.contacts:
        return Pieces((Piece("", 0.0, 1.0, a.q),), (0.0, 1.0), 0, "", 0)
    if not (a.q.any() or b.q.any()):
        return Pieces((), (0.0, 1.0), 0, "there is no load at either end", 0)
    family = Family(a, b)
    search = _Search(family, deadline)
    others: list[_Part] = []
    try:
        search.run()
        parts = search.parts()
        sure, others = ([x for x in parts if x.is_sure is kind] for kind in (True, False))
        new = sum(not search.touches(part, sure) for part in others)
        if new:
            search.doubts.append(f"{new} patterns are too near to a solution to be excluded")
    except TimeUp:
        search.doubts.append(f"stopped after {deadline}")
    pieces = tuple(
        Piece(word(part.states), *part.span, family.solution(part.states, sum(part.span) / 2))
        for part in sorted(search.parts(), key=lambda part: part.span)
        if part.is_sure
    )
    return Pieces(pieces, family.interval, len(others), "; ".join(search.doubts), search.nodes)


class Family(LoadInterval):
    """The patterns of all loads between two, for the search."""

    def __init__(self, a: Scaled, b: Scaled) -> None:
        super().__init__(a, b)
        whole = PlaneProblem(self.scaled, self.loads, self.mus.max(axis=0))
        self.shrink, self.bounded = whole.shrink, whole.box.bounded

    def leaves(
        self, span: Span, below: States | None = None, cuts: list[Cut] | None = None
    ) -> Iterator[tuple[States, int]]:
        """(patterns of a span that the search can not exclude, nodes) in turns.

        Contacts with the largest mu of the span, behind them the same with the least one for
        slip, which lies between both, and the load.  below: a pattern, to search through
        those that differ from it in the first contact.  cuts takes what is excluded, with
        multipliers (2 nc,) of u in the units of the problem.
        """
        loads, mus = self.at(*span)
        plane = PlaneProblem(self.scaled, loads, mus.max(axis=0))
        box, nc, more = plane.box, plane.contacts, plane.contacts if self.rubs else 0
        m, size = 2 * nc, 2 * (nc + more + 1)
        A, spread, c = np.zeros((size, size)), np.zeros(size), np.zeros(size)
        first, last = (box.u * load for load in plane.loads)
        if self.zero.any():  # loads are multiples: one stands for all
            first = last = last if self.zero[0] else first
        A[:m, :m], A[:m, -2], A[-2, -2] = box.A, last - first, -1.0
        spread[:m] = box.spread + 4 * EPSILON * (np.abs(first) + np.abs(last))
        c[:m], c[-2] = first, 1.0
        low, high = np.zeros((2, nc + more + 1, 4))
        low[:nc], high[:nc] = box.low.reshape(-1, 4), box.high.reshape(-1, 4)
        high[-1] = 1.0, 0.0, 1.0, 0.0
        if more:
            least = PlaneProblem(self.scaled, loads, mus.min(axis=0), plane.shrink)
            A[:m, m:-2] = box.u[:, None] * least.A / box.x
            pressed = least.most_pressed
            high[nc:-1, :2] = pressed[:, None] * box.x.reshape(-1, 2)
            terms = np.abs(self.scaled.W) @ (np.abs(least.generators) @ pressed.repeat(2))
            spread[:m] += gamma(m + 12) * box.u * terms
        root = np.concatenate([np.full(nc, ANY), np.full(more, FREE), [LOAD]]).astype(np.int8)
        if below is not None:
            root[1:nc] = below[1:]
        if below is not None and more:
            root[nc + 1 : -1] = np.where(np.isin(below[1:], (PLUS, MINUS)), below[1:], FREE)
        partner = np.append(nc + np.arange(nc), np.full(nc + 1, -1)) if more else None
        excluded: list[Cut] | None = None if cuts is None else []
        turns = leaves_of(
            A, spread, c, (low.ravel(), high.ravel()), np.resize(plane.reacts, len(root)),
            np.resize(plane.mu > 0, len(root)), excluded, root=root, partner=partner,
        )  # fmt: skip
        for leaves, nodes, _ in turns:
            yield leaves[:, :nc], nodes
        if cuts is not None:
            to_u = self.scaled.to_u.repeat(2) / box.u
            cuts += [(states[:nc], y[:m] / to_u) for states, y in excluded or ()]

    def allows(self, states: States, span: Span) -> bool:
        """False where a pattern has no solution in the box of all of them, by the search."""
        turns = self.leaves(span, states)
        return any((leaf == states).all() for leaves, _ in turns for leaf in leaves)

    def linear(self, states: States) -> MovingPattern:
        """What belongs to a pattern, linear in t."""
        ends = [PlaneProblem(self.scaled, self.loads, mu, self.shrink) for mu in self.mus]
        rows = ends[0].system(states)[1]
        R = [plane.system(states)[0] for plane in ends]
        P, Q = zip(*(plane.slack_matrices(states) for plane in ends), strict=True)
        return MovingPattern(
            self.scaled.W, rows, (R[0], R[1] - R[0]), (P[0], P[1] - P[0]), Q[0],
            (self.loads[0], self.loads[1] - self.loads[0]),
        )  # fmt: skip

    def solution(self, states: States, t: float) -> Array:
        """Reactions, (nc, 2), of a pattern at t."""
        return self.linear(states).reaction(t).reshape(-1, 2) * self.scaled.to_r


@dataclass(frozen=True, eq=False)
class _Part:
    """A span in which a pattern surely has solutions, or possibly has some."""

    states: States
    span: Span
    is_sure: bool


@dataclass
class _Search:
    """The search for patterns over all cells, and what it left."""

    family: Family
    deadline: Deadline
    found: dict[bytes, list[_Part]] = field(default_factory=dict)
    patterns: dict[bytes, MovingPattern] = field(default_factory=dict)
    nodes: int = 0
    doubts: list[str] = field(default_factory=list)

    def run(self) -> None:
        """Fill `found`; `doubts` say what stands against its being all."""
        if not self.family.bounded:
            self.doubts.append("W is singular: reactions may grow without bound")
            return
        cells = [self.family.interval]
        while cells:
            a, b = cells.pop()
            leaves = self._leaves((a, b), may_halve=self.family.rubs and b - a > CELL)
            if leaves is None:
                cells += _halves(a, b)
                continue
            for states in leaves:
                self._trace(states, (a, b))

    def _leaves(self, span: Span, may_halve: bool) -> list[States] | None:
        """Patterns that a cell leaves; None where halves of it should be looked at."""
        found: list[States] = []
        size, looked = 2.0 * self.family.scaled.contacts + 2, 0
        for leaves, more in self.family.leaves(span):
            looked += more
            self.nodes += more
            say(f"interval: {self.nodes} partial patterns, {len(self.found)} with solutions")
            self.deadline.spend(NODE * size**2 * more * (4 if self.family.rubs else 1))
            self.deadline.check()
            found += list(leaves)
            if may_halve and (looked > NODES or len(found) > LEAVES):
                return None
        return found

    def _trace(self, states: States, cell: Span) -> None:
        """Find where on a cell a pattern has solutions, and where it may have some."""
        key = states.tobytes()
        if key not in self.patterns:
            self.patterns[key] = self.family.linear(states)
        pattern, parts = self.patterns[key], self.found.setdefault(key, [])
        open_spans, work = [cell], LEAF + 40.0 * (2.0 * len(states)) ** 3
        for _ in range(PARTS):
            if not open_spans:
                return
            self.deadline.spend(work)
            self.deadline.check()
            a, b = open_spans.pop()
            found = pattern.slacks(a, b, DATA) or pattern.slacks(a, b, 0.0)
            if found is not None:
                open_spans += self._divided(states, (a, b), found, parts)
            elif not self.family.allows(states, (a, b)):  # reactions grow without bound there
                continue
            elif b - a <= POINT or not self.family.rubs:
                parts.append(_Part(states, (a, b), False))
            else:
                open_spans += _halves(a, b)
        parts += [_Part(states, span, False) for span in open_spans]

    def _divided(
        self, states: States, span: Span, found: tuple[Array, Array, Array],
        parts: list[_Part],
    ) -> list[Span]:  # fmt: skip
        """The spans that are still open; what is decided, or a point, goes to `parts`."""
        s0, s1, bound = found
        a, b = span

        def place(x: float) -> float:
            return min(max((a + b) / 2 + x * (b - a) / 2, a), b)

        possible = not_negative(s0 + bound, s1)
        if possible is None:
            return []
        low, high = (place(x) for x in possible)
        sure = not_negative(s0 - bound, s1)
        rest = [(low, high)]
        if sure is not None and sure[0] < sure[1]:
            inner = place(sure[0]), place(sure[1])
            parts.append(_Part(states, inner, True))
            rest = [(low, inner[0]), (inner[1], high)]
        rest = [(p, q) for p, q in rest if q > p or sure is None]
        points = [x for x in rest if x[1] - x[0] <= POINT or not self.family.rubs]
        parts += [_Part(states, x, False) for x in points]
        left = [x for x in rest if x not in points]
        return [y for x in left for y in ([x] if x[1] - x[0] < (b - a) / 2 else _halves(*x))]

    def parts(self) -> list[_Part]:
        """All that was found, neighbours put together."""
        out: list[_Part] = []
        for parts in self.found.values():
            joined: list[_Part] = []
            for part in sorted(parts, key=lambda part: part.span):
                last = joined[-1] if joined else None
                gap = part.span[0] - last.span[1] if last else np.inf
                if last and last.is_sure == part.is_sure and gap <= 4 * POINT:
                    span = last.span[0], max(last.span[1], part.span[1])
                    joined[-1] = _Part(part.states, span, part.is_sure)
                else:
                    joined.append(part)
            out += joined
        return [p for p in out if not p.is_sure or p.span[1] - p.span[0] > 4 * POINT]

    def touches(self, part: _Part, sure: Sequence[_Part]) -> bool:
        """True where all possible solutions of a part are those of sure ones, within NEAR."""
        self.deadline.spend(LEAF * (1 + len(sure)))
        self.deadline.check()
        low, high = part.span
        kinks = [t for other in sure for t in other.span if low < t < high]
        stops = sorted({low, *kinks, high})
        spans = [(p, q) for p, q in pairwise(stops) if q - p > 8 * POINT] or [(low, high)]
        return all(
            any(
                other.span[0] - 8 * POINT <= p and q <= other.span[1] + 8 * POINT
                and all(self._same(part.states, other.states, t) for t in (p, q))
                for other in sure
            )
            for p, q in spans
        )  # fmt: skip

    def _same(self, states: States, others: States, t: float) -> bool:
        """Whether two patterns have the same solution at t."""
        try:
            r, other = (self.patterns[x.tobytes()].reaction(t) for x in (states, others))
        except np.linalg.LinAlgError:
            return False
        size = max(1.0, *(float(np.abs(x).max(initial=0.0)) for x in (r, other)))
        return bool(np.abs(r - other).max(initial=0.0) <= NEAR * size)


def _halves(a: float, b: float) -> list[Span]:
    return [((a + b) / 2, b), (a, (a + b) / 2)]


def not_negative(s0: Array, s1: Array) -> Span | None:
    """The s from -1 to 1 at which no s_0 + s s_1 is negative, if there are any."""
    low, high = -1.0, 1.0
    for x, slope in zip(s0, s1, strict=True):
        if x + slope < 0 and x - slope < 0:
            return None
        if x - slope < 0:
            low = max(low, -x / slope)
        elif x + slope < 0:
            high = min(high, -x / slope)
    return (low, high) if low <= high else None
