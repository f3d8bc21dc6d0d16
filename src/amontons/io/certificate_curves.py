"""All solutions in 3D, of one load or of all between two, as a file for `certificate_checker`.

    tree (b,)   boxes in the order in which the checker divides them: -1 excluded, -2 a tube,
                else the contact that is decided, nc for the time
    y           (excluded, nc, 3) what excludes a box
    x, k        (tubes, n + 1) the centres of tubes, padded, and what they are parametrised by
    t, r        (s,), (s, nc, 3): one of every curve, or all solutions of one load
    span (2,)   the part of the time from 0, the load q and mu, to 1, `end` and `mu_end`
    distance    within which solutions are of the lines of the tubes, unit of r

The checker decides what holds: whatever it does not take is divided.  The y are those of
`cone_exclusion`, the centres are found by Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.solutions.discs.cone_exclusion import exclude
from ..analysis.solutions.discs.load_tree import undecided
from ..analysis.solutions.load_interval import START
from ..analysis.statuses import SLIP, states_of
from ..core.clock import Deadline
from ..core.errors import InvalidInput
from .certificate_checker.boxes import ARCS, Problem, divided
from .certificate_checker.curves import chains
from .certificate_checker.numbers import Refused
from .certificate_checker.tubes import forms_of, tube

Array = NDArray[np.float64]
Box = tuple[str, Any, tuple[float, float]]
BATCH = 200  # boxes that the checker looks at together
MOST = 60_000  # boxes of a certificate
WORK = 4e5, 800.0, 4e6  # operations of a box, and per cube of the reactions; of a tube
SPARE, SLOWER = 1 + 1e-6, 1.6  # bounds by which the kernel is stricter than the checker
NEWTON, CONVERGED, LOST = 20, 1e-14, 1e6  # steps to a centre; the last one; largest number
FAR = 4.0  # times a box that its centre may be off
THIN, NOTHING = 1e-3, 1e-9  # how far a tube reaches from its line: of its reactions, scaled
FINEST = 1e-8  # half of an arc, or of a span, that is not divided
ROOM = 1.1  # times the distance here, for other processors
FRICTIONLESS = "o"


def curves_between(
    start: tuple[Array, Array], end: tuple[Array, Array] | None, W: Array, deadline: Deadline
) -> dict[str, Any]:
    """Arrays that prove all solutions of (q (nc, 3), mu (nc,)), or of all between two.

    Raises InvalidInput where boxes can not be told from solutions, or there are too many.
    """
    (q, mu), (last, rub) = start, start if end is None else end
    more = {} if end is None else {"end": last, "mu_end": rub}
    try:
        problem = Problem(W, q, mu, **more)
    except Refused as reason:
        raise InvalidInput(f"certificate: {reason}") from reason
    still = (np.abs(problem.loads).reshape(2, -1, 3).max(axis=2) == 0).any(axis=1)
    span = (START if still[0] and end is not None else 0.0,
            0.0 if end is None else 1 - START if still[1] else 1.0)  # fmt: skip
    tree = _Tree(problem, deadline)
    tree.grow(span)
    return {**tree.arrays(), "span": np.array(span), **more}


@dataclass(eq=False)
class _Node:
    """A box, what became of it, and its parts."""

    box: Box
    kind: int = -3
    told: Any = None
    parts: list[_Node] = field(default_factory=list)


@dataclass(eq=False)
class _Tree:
    """Boxes, divided until the checker takes each."""

    problem: Problem
    deadline: Deadline
    seen: int = 0

    def grow(self, span: tuple[float, float]) -> None:
        """Divide all that is not excluded and is no tube, or one that may hold nothing."""
        nc = self.problem.mus.shape[1]
        self.root = _Node(("." * nc, (ARCS[0],) * nc, span))
        stack = [self.root]
        while stack:
            self._divide(stack)
            stack = self._doubtful()

    def _divide(self, stack: list[_Node]) -> None:
        """Divide nodes until the checker takes what is left."""
        nc = self.problem.mus.shape[1]
        while stack:
            batch, stack = stack[-BATCH:], stack[:-BATCH]
            self.seen += len(batch)
            self.deadline.spend(len(batch) * (WORK[0] + WORK[1] * (3.0 * nc) ** 3))
            if self.seen > MOST or self.deadline.passed:
                why = f"more than {MOST} boxes" if self.seen > MOST else str(self.deadline)
                raise InvalidInput(f"certificate: stopped after {why}, with {len(stack)} left")
            for node, guess in self._left_of(batch):
                stack += self._parts(node, guess)

    def _doubtful(self) -> list[_Node]:
        """The parts of tubes of curves that nowhere surely hold a solution."""
        held = [node for node in self.nodes() if node.kind == -2 and node.told[2] is not None]
        sure, low, high, _ = (np.array(a) for a in zip(*(x.told[2] for x in held), strict=True))
        parts: list[_Node] = []
        for chain in chains(low, high):
            for node in [held[j] for j in chain if not sure[chain].any()]:
                node.kind, node.told = self._widest(node.box), None
                node.parts = [_Node(one) for one in self._divided(node)]
                parts += node.parts
        return parts

    def _divided(self, node: _Node) -> list[Box]:
        return divided(node.box, node.kind, self.problem.rubs)

    def nodes(self) -> list[_Node]:
        """All nodes, in the order of the file."""
        nodes, stack = [], [self.root]
        while stack:
            nodes.append(stack.pop())
            stack += reversed(nodes[-1].parts)
        return nodes

    def _left_of(self, batch: list[_Node]) -> list[tuple[_Node, Array]]:
        """The nodes that are not excluded, with (r, u) near which there may be a solution."""
        tried = [self._separated(node.box) for node in batch]
        y = np.array([one[1] for one in tried])
        out = self.problem.excluded([node.box for node in batch], y)
        left = []
        for node, (hopeful, multipliers, guess), proved in zip(batch, tried, out, strict=True):
            if hopeful and proved:
                node.kind, node.told = -1, multipliers
            else:
                left.append((node, guess))
        return left

    def _separated(self, box: Box) -> tuple[bool, Array, Array]:
        """(whether y excludes a box by the package, y (nc, 3), a guess (nc, 6) where not)."""
        problem, (letters, arcs, span) = self.problem, box
        states, nc = _states(letters), len(letters)
        angles = np.zeros((2, nc)) + [[0.0], [np.pi]]
        for i in np.flatnonzero(states == SLIP):
            angles[:, i] = _arc(arcs[i])
        mus, loads = (_at_ends(x, span) for x in (problem.mus, problem.loads))
        mus[:2] = np.sort(mus[:2], axis=0)
        y, guess = np.zeros(3 * nc), np.zeros((nc, 6))
        part = float(problem.part(np.array([span]))[0])
        hopeful = exclude(problem.W, states, angles, mus, loads, problem.most * part * SPARE,
                          problem.fast * part * SLOWER, y, guess)  # fmt: skip
        return bool(hopeful), y.reshape(nc, 3), guess

    def _parts(self, node: _Node, guess: Array) -> list[_Node]:
        """The parts of a box that is not excluded, none where it is a tube."""
        problem, (letters, _, span) = self.problem, node.box
        mus, loads = (_at_ends(x, span) for x in (problem.mus, problem.loads))
        i = int(undecided(problem.W, loads[:2].mean(axis=0), _states(letters),
                          mus[:2].max(axis=0), guess))  # fmt: skip
        if i < 0:
            self.deadline.spend(WORK[2])
            if self._is_tube(node, guess):
                return []
            i = self._widest(node.box)
        node.kind = i
        node.parts = [_Node(part) for part in self._divided(node)]
        return node.parts

    def _widest(self, box: Box) -> int:
        """What to divide of decided contacts: the widest arc, or the time as the load turns."""
        (letters, arcs, (first, last)), problem = box, self.problem
        arc = [_arc(one)[1] * (x == "l") for x, one in zip(letters, arcs, strict=True)]
        wide = np.array([*arc, (last - first) / 2])
        (a, b, _), mus = _at_ends(problem.loads, box[2]), problem.mus
        turns = np.linalg.norm(b - a) / max(np.linalg.norm(a + b), 1e-300)
        rubs = np.abs(mus[1] - mus[0]).max() * wide[-1]
        score = np.append(wide[:-1], turns + rubs) * (wide > FINEST)
        if not score.any():
            raise InvalidInput(
                f"certificate: from {first:.9g} to {last:.9g} two patterns or two curves meet, "
                f"or {letters!r} has a singular matrix: boxes can not tell"
            )
        return int(np.argmax(score))

    # ------------------------------------------------------------------ tubes
    def _is_tube(self, node: _Node, guess: Array) -> bool:
        """Whether the checker finds one thin tube, or nothing, in a decided box."""
        found = self._centre(node.box, guess)
        if found is None:
            return False
        try:
            held = tube(self.problem, node.box, *found)
        except (Refused, np.linalg.LinAlgError):
            return False
        if held is not None and held[3] > THIN * np.abs(held[1:3])[:, 1:].max() + NOTHING:
            return False
        node.kind, node.told = -2, (*found, held)
        return True

    def _centre(self, box: Box, guess: Array) -> tuple[Array, int] | None:
        """(x, k): a point of the curve in a box, its parameter; None where there is none."""
        (letters, arcs, span), mus = box, self.problem.mus
        x: list[float] = []
        turns: list[int] = []
        middle = (span[0] + span[1]) / 2
        for i, letter in enumerate(letters):
            r, u = guess[i, :3], guess[i, 3:]
            p = float((1 - middle) * mus[0, i] + middle * mus[1, i]) * r[0]
            e = np.sum(arcs[i], axis=0)
            e /= np.linalg.norm(e)
            turns += [len(x) + 2, len(x) + 3] if letter == "l" else []
            tell = {"f": [], "o": [r[0]], "s": [r[0], p, *r[1:]],
                    "l": [r[0], p, *e, np.hypot(*u[1:])]}  # fmt: skip
            x += tell[letter]
        c, n = np.array([*x, middle]), len(x)
        zero = forms_of(self.problem, letters)[0][:, 0]
        M = zero + zero.swapaxes(1, 2)
        low, high = self.problem.ranges(box)
        choice = [*turns, n] if span[0] < span[1] else [n]
        if len(choice) > 1:
            J = (M @ np.append(c, 1.0))[:, :-1] * (high - low + 1e-12)
            d = np.abs(np.linalg.svd(J)[2][-1])
            choice.sort(key=lambda j: -d[j])
        for k in choice:
            point = _on_curve(M, c, k)
            if point is None:
                continue
            off = np.abs(point - c)[[*turns, n]]
            if (off <= FAR * (high - low)[[*turns, n]]).all():
                return point, k
        return None

    # ------------------------------------------------------------------ what is written
    def arrays(self) -> dict[str, Any]:
        """All of the file but the problem and the span."""
        nc, to_r = self.problem.mus.shape[1], self.problem.to_r
        nodes = self.nodes()
        y = [node.told for node in nodes if node.kind == -1]
        told = [node.told for node in nodes if node.kind == -2]
        x = np.zeros((len(told), 1 + 5 * nc))
        for row, (c, _, _) in zip(x, told, strict=True):
            row[: len(c)] = c
        tubes = [held for *_, held in told if held is not None]
        sure, low, high, off = (np.array(a) for a in zip(*tubes, strict=True))
        at = []
        for chain in chains(low, high):
            best = chain[np.argmax(sure[chain])]
            at.append((low[best] + high[best]) / 2)
        points = np.array(at)
        return {
            "tree": np.array([node.kind for node in nodes], dtype=np.int16),
            "y": np.array(y).reshape(-1, nc, 3), "x": x,
            "k": np.array([k for _, k, _ in told], dtype=np.int16),
            "t": points[:, 0], "r": (points[:, 1:] * to_r).reshape(-1, nc, 3),
            "distance": np.array(ROOM * off.max() * to_r),
        }  # fmt: skip


def _on_curve(M: Array, c: Array, k: int) -> Array | None:
    """The point with x_k where forms vanish, by Newton's method, or None; M: twice them."""
    c, others = c.copy(), np.delete(np.arange(len(c)), k)
    for _ in range(NEWTON):
        X = np.append(c, 1.0)
        try:
            step = np.linalg.solve((M @ X)[:, others], M @ X @ X / 2)
        except np.linalg.LinAlgError:
            return None
        c[others] -= step
        size = np.abs(c).max()
        if not size < LOST:
            return None
        if np.abs(step).max(initial=0.0) <= CONVERGED * (1 + size):
            return c
    return c


def _states(letters: str) -> NDArray[np.int8]:
    """States of the package for letters of the checker."""
    return states_of(letters.replace(FRICTIONLESS, "l")) - np.int8(1) * np.array(
        [x == FRICTIONLESS for x in letters]
    )


def _arc(arc: Any) -> tuple[float, float]:
    """(middle, half) of an arc, angles."""
    (a, b), turn = np.array(arc), np.sum(arc, axis=0)
    half = np.arctan2(np.linalg.norm(b - a) / 2, np.linalg.norm(turn) / 2)
    return float(np.arctan2(turn[1], turn[0])), float(half)


def _at_ends(x: Array, span: tuple[float, float]) -> Array:
    """(3, .): x at both ends of a span, and the size of its terms."""
    first, last = ((1 - t) * x[0] + t * x[1] for t in span)
    return np.stack([first, last, np.abs(x).sum(axis=0)])
