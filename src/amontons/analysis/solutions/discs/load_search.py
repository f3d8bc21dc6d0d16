"""All curves of solutions at some load or friction between two, in 3D, proved.

    u = W r + q(t),    q = (1 - t) q_0 + t q_1,    mu = (1 - t) mu_0 + t mu_1,    0 <= t <= 1.

`load_tree` divides statuses, directions of slip and t until every box has no solution or one
curve of them.  There is a `Piece` for every part of a curve that surely holds solutions, closed
ones included, and no solution is elsewhere, but within NEAR of these, and where `undecided`
says.  Reactions are bounded by dissipation, as in `plane_problem`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline
from ....core.onlookers import say
from ....problem.friction import FrictionProblem
from ...scaled import Scaled
from ...statuses import ANY, FREE, States, word
from ...tolerances import SAME
from ..load_interval import LoadInterval, Piece, Pieces, Span
from ..plane_problem import energy_range
from .curve_box import Boxes, Curves, narrowed, on_curve, traced
from .curve_equations import EPSILON, Pattern
from .load_tree import PARTS, leaves_inplace

Array = NDArray[np.float64]
LARGEST = 10  # contacts up to which a search is tried
BUDGET = 2000  # boxes between two looks at the clock
ROOM = 20_000  # boxes on the stack
TURN = 500  # leaves of one turn
LEFT = 200  # boxes that are left, after which nothing more is looked at
BOX = 2e5, 400.0  # operations of a box, and per cube of the reactions
LEAF = 5  # boxes that a leaf counts for
FINEST = 1e-6  # half of an arc, or of a span of t, that is not divided
POINT = 1e-9  # of x_k: what of a curve may stay open at the end of a sure part
SHRUNK = 0.7  # of an arc or span: after that much a box is looked at again
NEAR = SAME  # distance of scaled solutions that count as one, relative to the largest
SURE_BOUND = 1 + 1e-9  # rounding of sums of bounds


def pieces_in_space(start: FrictionProblem, end: FrictionProblem, deadline: Deadline) -> Pieces:
    """All pieces with a solution between two problems, which differ in load and friction alone.

    Raises TimeUp where W is not there in time.
    """
    a, b = (Scaled.of(problem, deadline) for problem in (start, end))
    if not a.contacts:
        return Pieces((Piece("", 0.0, 1.0, a.q),), (0.0, 1.0), 0, "", 0)
    if not (a.q.any() or b.q.any()):
        return Pieces((), (0.0, 1.0), 0, "there is no load at either end", 0, ((0.0, 1.0),))
    interval = LoadInterval(a, b)
    search = _Search(interval, deadline)
    search.run()
    loose = search.loose()
    if loose:
        search.doubts.append(f"{len(loose)} patterns are too near to a solution to be excluded")
    undecided = joined([*search.left, *((c.t[0], c.t[2]) for c in loose)])
    if undecided:  # ends that are left out are not proved either
        low, high = interval.interval
        undecided = joined([*undecided, *(x for x in ((0.0, low), (high, 1.0)) if x[0] < x[1])])
    touching = sum(not c.is_sure for c in search.curves) - len(loose)
    doubt = "; ".join(search.doubts)
    return Pieces(search.pieces(), interval.interval, touching, doubt, search.seen, undecided)


def joined(spans: list[Span]) -> tuple[Span, ...]:
    """Spans in order, those that meet put together."""
    out: list[Span] = []
    for low, high in sorted((min(span), max(span)) for span in spans):
        if out and low <= out[-1][1]:
            out[-1] = out[-1][0], max(out[-1][1], high)
        else:
            out.append((low, high))
    return tuple(out)


@dataclass(frozen=True, eq=False)
class _Curve:
    """Part of a curve of one pattern: t (3,) and scaled r (3, 3 nc) at its ends and between.

    is_sure: it holds solutions; else it is a point that may be one.
    """

    states: States
    t: Array
    r: Array
    is_sure: bool


class _Stack:
    """Boxes that are still to be looked at: states, middles, halves (k, nc), spans (k, 2)."""

    def __init__(self, nc: int) -> None:
        self.arrays = (np.zeros((ROOM, nc), dtype=np.int8), np.zeros((ROOM, nc)),
                       np.zeros((ROOM, nc)), np.zeros((ROOM, 2)))  # fmt: skip
        self.top = 0

    def push(self, *box: Array | States) -> None:
        """Put a box on top."""
        for array, part in zip(self.arrays, box, strict=True):
            array[self.top] = part
        self.top += 1

    @property
    def spans(self) -> list[Span]:
        """Those of t."""
        return [(float(a), float(b)) for a, b in self.arrays[3][: self.top]]


@dataclass
class _Search:
    """The search over all boxes, and what it left."""

    interval: LoadInterval
    deadline: Deadline
    curves: list[_Curve] = field(default_factory=list)
    left: list[Span] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    patterns: dict[bytes, Pattern] = field(default_factory=dict)
    seen: int = 0

    def __post_init__(self) -> None:
        scaled, (zero, loads) = self.interval.scaled, (self.interval.zero, self.interval.loads)
        if zero.any():  # loads are multiples of one: that one stands for all
            loads = np.stack([loads[1 if zero[0] else 0]] * 2)
        self.W, self.loads = np.ascontiguousarray(scaled.W), loads
        self.q, self.mu = (np.stack([x[0], x[1] - x[0]]) for x in (loads, self.interval.mus))
        self.stack = _Stack(scaled.contacts)
        half = np.full(scaled.contacts, np.pi)
        self.stack.push(np.where(scaled.reacts, ANY, FREE), 0 * half, half,
                        np.array(self.interval.interval))  # fmt: skip

    def run(self) -> None:
        """Fill `curves` and `left`; `doubts` say what stands against the curves being all."""
        bounds = _bounds(self.W, self.loads)
        if bounds is None:
            self._give_up("W is not definite: reactions may grow without bound")
            return
        nc, m = self.interval.scaled.contacts, len(self.W)
        leaves: Any = (np.zeros((TURN, nc), dtype=np.int8), np.zeros((TURN, nc)),
                       np.zeros((TURN, nc)), np.zeros((TURN, 2)))  # fmt: skip
        guesses = np.zeros((TURN, nc, 6))
        while self.stack.top:
            self.stack.top, seen, count = leaves_inplace(
                self.W, self.q, self.mu, self.interval.scaled.reacts, *bounds,
                self.stack.arrays, self.stack.top, BUDGET, leaves, guesses,
            )  # fmt: skip
            self.seen += seen
            for which in _alike(leaves[0][:count]):
                states, (middle, half, span) = leaves[0][which], (x[which] for x in leaves[1:])
                self._look_at(states, middle, half, span, guesses[which])
            say(f"interval: {self.seen} boxes, {len(self.curves)} parts of curves")
            self.deadline.spend(BOX[0] * (seen + LEAF * count) + BOX[1] * seen * float(m) ** 3)
            why = self._why_stop(seen)
            if self.stack.top and why:
                self._give_up(why)
                return
        if self.left:
            self.doubts.append(f"{len(self.left)} boxes could be neither divided nor excluded")

    def _why_stop(self, seen: int) -> str:
        """Why no more boxes are looked at, empty to go on."""
        if self.deadline.passed:
            return f"stopped after {self.deadline}"
        if len(self.left) >= LEFT:
            return f"more than {LEFT} boxes could be neither divided nor excluded"
        if self.stack.top + PARTS * TURN > ROOM:
            return f"more than {ROOM} boxes at a time"
        return ""

    def _give_up(self, why: str) -> None:
        self.doubts.append(why)
        self.left += self.stack.spans

    # ------------------------------------------------------------------ leaves
    def _look_at(
        self, states: States, middle: Array, half: Array, span: Array, guess: Array
    ) -> None:
        """Trace the curves in boxes (B, ...) of one pattern; divide what is open."""
        key = states[0].tobytes()
        if key not in self.patterns:
            self.patterns[key] = Pattern(states[0].copy(), self.W, self.q, self.mu)
        pattern = self.patterns[key]
        slip, y = pattern.slip, np.zeros((len(states), pattern.ny))
        x = np.hstack([y, middle[:, slip], span.mean(axis=1, keepdims=True)])
        wide = np.hstack([y, half[:, slip], np.diff(span) / 2])
        boxes = Boxes(x, wide + 4 * EPSILON * (1 + np.abs(x)))  # no gaps between neighbours
        empty, narrow, k = narrowed(pattern, boxes)
        some = np.flatnonzero(~empty & (k >= 0))
        known = np.zeros(len(k), dtype=bool)
        if len(some):
            curves = traced(pattern, narrow.part(some), k[some], self.interval.interval)
            known[some] = curves.known
            for j in np.flatnonzero(curves.known):
                self._keep(pattern, narrow.part(some[j]), curves, int(j))
        for j in np.flatnonzero(~empty & ~known):
            box, before = narrow.part(j), boxes.half[j, pattern.ny :]
            wide = box.half[pattern.ny :]
            if (wide <= FINEST).all():
                t, h = float(box.x[-1]), float(box.half[-1])
                self.left.append((t - h, t + h))
            elif (wide < SHRUNK * before).any():
                self._push(pattern, box.x, box.half)
            else:
                self._halve(pattern, box, guess[j])

    def _push(self, pattern: Pattern, x: Array, half: Array) -> None:
        """Put a box of a pattern on the stack."""
        middles, halves = np.zeros((2, len(pattern.states)))
        middles[pattern.slip], halves[pattern.slip] = x[pattern.turn], half[pattern.turn]
        low, high = self.interval.interval
        span = np.array([max(x[-1] - half[-1], low), min(x[-1] + half[-1], high)])
        self.stack.push(pattern.states, middles, halves, span)

    def _halve(self, pattern: Pattern, box: Boxes, guess: Array) -> None:
        """Both halves by what matters most: an arc or the span of t."""
        normal, speed = guess[:, 0], np.hypot(guess[:, 4], guess[:, 5])
        friction = np.abs(self.mu[0] + box.x[-1] * self.mu[1])
        weight = np.zeros(pattern.n + 1)
        weight[pattern.turn] = (1e-3 + friction * normal + speed)[pattern.slip]
        weight[-1] = np.linalg.norm(self.q[1]) + np.abs(self.mu[1]) @ normal + 1e-6
        j = int(np.argmax(np.where(box.half > FINEST, weight * box.half, -1.0)))
        for sign in (-1.0, 1.0):
            x, half = box.x.copy(), box.half.copy()
            half[j] /= 2
            x[j] += sign * half[j]
            self._push(pattern, x, half)

    def _keep(self, pattern: Pattern, box: Boxes, curves: Curves, j: int) -> None:
        """Note what is sure of a curve, and put what is open on the stack."""
        (low, high), (a, b) = curves.possible[j], curves.sure[j]
        x, d, z, ny = curves.x[j], curves.d[j], curves.z[j], pattern.ny
        open_parts: list[Span] = []
        if low > high:
            return
        if a < b:
            self._note(pattern, curves, j, (a, b))
            for part in ((low, min(high, a)), (max(low, b), high)):
                width = part[1] - part[0]
                if width > POINT:
                    open_parts.append(part)
                elif width * np.abs(d).max() > NEAR:  # a steep curve: `loose` tells
                    self._note(pattern, curves, j, part, is_sure=False)
        elif high - low <= POINT:
            self._note(pattern, curves, j, (low, high), is_sure=False)
        else:
            open_parts = [(low, (low + high) / 2), ((low + high) / 2, high)]
        for part in open_parts:
            ends = x + np.outer(part, d)
            least = np.maximum(ends.min(axis=0) - z - 1e-15, box.x - box.half)
            most = np.minimum(ends.max(axis=0) + z + 1e-15, box.x + box.half)
            if (least[ny:] <= most[ny:]).all():
                self._push(pattern, (least + most) / 2, (most - least) / 2 * (1 + 1e-12))

    def _note(
        self, pattern: Pattern, curves: Curves, j: int, part: Span, *, is_sure: bool = True
    ) -> None:
        """Keep part of a curve, with its points."""
        places = np.array([part[0], (part[0] + part[1]) / 2, part[1]])
        x = curves.x[j] + np.outer(places, curves.d[j])
        better, fine = on_curve(pattern, x, np.full(3, curves.k[j]))
        x = np.where(fine[:, None], better, x)
        self.curves.append(_Curve(pattern.states, x[:, -1], pattern.reactions(x), is_sure))

    # ------------------------------------------------------------------ what was found
    def _factor(self, t: float) -> float:
        """What reactions to `loads` are multiplied by."""
        zero = self.interval.zero
        return t if zero[0] else 1 - t if zero[1] else 1.0

    def pieces(self) -> tuple[Piece, ...]:
        """The parts of curves that surely hold solutions, in the units of the problem."""
        to_r, out = self.interval.scaled.to_r, []
        for c in sorted(self.curves, key=lambda c: float(c.t.min())):
            if c.is_sure:
                t = float(c.t[1])
                r = c.r[1].reshape(-1, 3) * to_r * self._factor(t)
                out.append(Piece(word(c.states), float(c.t.min()), float(c.t.max()), r, t))
        return tuple(out)

    def loose(self) -> list[_Curve]:
        """Points that may be solutions, and are not within NEAR of an end of what is sure."""
        ends = [(c.t[j], c.r[j]) for c in self.curves if c.is_sure for j in (0, 2)]
        out = []
        for c in self.curves:
            if c.is_sure:
                continue
            size = max(1.0, float(np.abs(c.r).max()))
            if not any(abs(t - c.t[1]) <= NEAR and np.abs(r - c.r[1]).max() <= NEAR * size
                       for t, r in ends):  # fmt: skip
                out.append(c)
        return out


def _alike(states: States) -> list[NDArray[np.intp]]:
    """Indices of boxes with the same pattern."""
    found: dict[bytes, list[int]] = {}
    for j, row in enumerate(states):
        found.setdefault(row.tobytes(), []).append(j)
    return [np.array(which) for which in found.values()]


def _bounds(W: Array, loads: Array) -> tuple[float, Array] | None:
    """(bound of sum r_N, of |u_T| of every contact (nc,)) at all loads between loads (2, 3 nc).

    None where W is not surely definite.
    """
    nc = len(W) // 3
    normal = np.zeros((len(W), 1))
    normal[::3] = 1.0
    found = energy_range(W, loads, np.hstack([normal, W.T]))
    if found is None:
        return None
    middle, reach = found
    most = (middle + reach).max(axis=0)
    motion = (np.abs(middle[:, 1:] + loads) + reach[1:]).max(axis=0)
    fastest = np.linalg.norm(motion.reshape(nc, 3)[:, 1:], axis=1)
    return max(float(most[0]), 0.0) * SURE_BOUND + 1e-12, fastest * SURE_BOUND + 1e-12
