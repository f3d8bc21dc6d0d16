"""All solutions of the complementarity problem of tangents, by a tree search.

D x = c + y with conditions row by row is put into the form of `pattern_search`: contacts with
four variables a, b >= 0 (x_N = a + b, x_T = mu (a - b)), y_N and y_T; a scalar condition is one
without friction, whose second row is empty.  Every solution has x y <= 0, so x D x <= c x:
where the symmetric part of D is positive definite that ellipsoid bounds all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ..solutions.pattern_leaves import NODE, leaves_of
from ..statuses import FREE, MINUS, PLUS, STICK, States, word
from ..tolerances import SLACK

Array = NDArray[np.float64]
REACH = 1e6  # bound of x where none is known, in the size of c and D
COINCIDE = 1e-8  # distance at which a list of all has patterns that share a solution once
SINGULAR = 1e-11  # of a system, relative


@dataclass(frozen=True, eq=False)
class RateSolutions:
    """The list of x (M,); complete: every other pattern of statuses was excluded.

    patterns: of each x, one letter per condition: pairs o (x = 0) or c (y = 0), contacts at
    rest f, s, + or -.  sets: patterns with more than one solution.  finished: the search came
    to its end.
    """

    solutions: tuple[Array, ...]
    patterns: tuple[str, ...]
    sets: tuple[str, ...]
    complete: bool
    reason: str
    examined: int
    finished: bool = True

    def __len__(self) -> int:
        return len(self.solutions)


def rate_solutions(
    D: Array, b: Array, pairs: int, mu: Array, nodes: int, deadline: Deadline = NEVER
) -> RateSolutions:
    """All x with D x = y + b and the conditions of [LR] (35), as far as time allows."""
    size = float(np.abs(b).max(initial=0.0))
    if not len(D) or size <= SLACK**2:
        nothing = np.zeros(len(D))
        word = "o" * pairs + "f" * len(mu)
        return RateSolutions((nothing,), (word,), (), True, "nothing drives these rates", 0)
    tree = _Tree(D, -b / size, pairs, mu)
    found: list[tuple[Array, str]] = []
    sets: list[str] = []
    examined, done = 0, False
    for leaves, more, done in tree.leaves():
        examined += more
        for states in leaves:
            x, free = tree.solved(states)
            if free:
                sets.append(tree.word(states))
            elif x is not None and all(np.abs(x - z).max() > COINCIDE for z, _ in found):
                found.append((x, tree.word(states)))
        deadline.spend(NODE * more * len(tree.rhs) ** 2)
        if not done and (examined >= nodes or deadline.passed):
            break
    reason = "every other pattern is excluded"
    if not done:
        reason = f"the search stopped after {examined} patterns"
    elif not tree.bounded:
        reason = f"rates above {REACH:g} times those of the load were not looked for"
    complete = done and tree.bounded and not sets
    if sets and done:
        reason = "tangents are not isolated"
    return RateSolutions(
        tuple(x * size for x, _ in found), tuple(word for _, word in found), tuple(sets),
        complete, reason, examined, done,
    )  # fmt: skip


class _Tree:
    """y = D x + c in the form of the search."""

    def __init__(self, D: Array, c: Array, pairs: int, mu: Array) -> None:
        self.D, self.c, self.pairs, self.mu = D, c, pairs, mu
        zi = len(mu)
        self.blocks = pairs + zi
        shrink = 1 / np.maximum(mu, 1.0)
        G = np.zeros((len(D), 2 * self.blocks))  # x = G (a, b)
        rows = np.full(2 * self.blocks, -1)  # of y; none of the second of a pair
        for k in range(pairs):
            G[k, 2 * k], rows[2 * k] = 1.0, k
        for j in range(zi):
            k, t = pairs + j, pairs + zi + j
            G[k, 2 * k : 2 * k + 2] = shrink[j]
            G[t, 2 * k : 2 * k + 2] = shrink[j] * mu[j] * np.array([1.0, -1.0])
            rows[2 * k], rows[2 * k + 1] = k, t
        self.G, known = G, rows >= 0
        self.A, self.rhs = np.zeros((len(rows), len(rows))), np.zeros(len(rows))
        self.A[known], self.rhs[known] = (D @ G)[rows[known]], c[rows[known]]
        self.frictional = np.concatenate([np.zeros(pairs, dtype=bool), mu > 0])
        self.low, self.high, self.bounded = self._box()

    def _box(self) -> tuple[Array, Array, bool]:
        """Bounds of all variables, (4 blocks,) each, and whether they are proved."""
        n = len(self.rhs)
        low, high = np.full(2 * n, -REACH), np.full(2 * n, REACH)
        S = (self.D + self.D.T) / 2
        values = np.linalg.eigvalsh(S)
        if values[0] <= 1e-12 * values[-1]:
            return low, high, False
        inverse = np.linalg.inv(S)
        middle = -inverse @ self.c / 2
        radius = np.sqrt(self.c @ inverse @ self.c) / 2
        reach = np.sqrt(np.diagonal(inverse)) * radius
        of_y = np.sqrt(np.einsum("ij,jk,ik->i", self.D, inverse, self.D)) * radius
        y = self.D @ middle + self.c
        room = 1e-9 * (1 + radius)
        for k in range(self.blocks):
            v = 4 * k
            most = middle[k] + reach[k] + room
            if k >= self.pairs:
                most *= max(self.mu[k - self.pairs], 1.0)
            low[v : v + 2], high[v : v + 2] = -room, most
            low[v + 2], high[v + 2] = y[k] - of_y[k] - room, y[k] + of_y[k] + room
            if k >= self.pairs:
                t = k + len(self.mu)
                low[v + 3], high[v + 3] = y[t] - of_y[t] - room, y[t] + of_y[t] + room
            else:
                low[v + 3], high[v + 3] = -room, room
        return low, high, True

    def leaves(self) -> Iterator[tuple[States, int, bool]]:
        """(patterns that are not excluded, nodes, done?) in turns."""
        spread, reacts = np.zeros(len(self.rhs)), np.ones(self.blocks, dtype=bool)
        box = self.low, self.high
        return leaves_of(self.A, spread, self.rhs, box, reacts, self.frictional)

    def solved(self, states: States) -> tuple[Array | None, bool]:
        """(x of a pattern, or None; are there more?)."""
        rows, columns = self._system(states)
        if not rows:
            x = np.zeros(len(self.c))
            return (x, False) if self._holds(states, x) else (None, False)
        M = self.D[rows] @ columns
        values = np.linalg.svd(M, compute_uv=False)
        w = np.linalg.lstsq(M, -self.c[rows], rcond=SINGULAR)[0]
        x = columns @ w
        size = max(1.0, float(np.abs(x).max()))
        if np.abs(M @ w + self.c[rows]).max() > SLACK * size or not self._holds(states, x):
            return None, False
        return x, bool(values[-1] <= SINGULAR * values[0])

    def _system(self, states: States) -> tuple[list[int], Array]:
        """Rows with y = 0, and x = columns w of what is free on a pattern."""
        rows: list[int] = []
        columns: list[Array] = []
        for k, state in enumerate(states):
            if state == FREE:
                continue
            rows.append(k)
            if state == STICK:
                rows.append(k + len(self.mu))
                columns += [self.G[:, 2 * k], self.G[:, 2 * k + 1]]
            else:
                columns.append(self.G[:, 2 * k + (state == MINUS)])
        return rows, np.array(columns).T

    def _holds(self, states: States, x: Array) -> bool:
        """True where the inequalities of a pattern hold."""
        y = self.D @ x + self.c
        size = max(1.0, float(np.abs(x).max(initial=0.0)))
        n = self.blocks
        least = float(np.concatenate([x[:n], y[:n]]).min())
        at_rest = np.arange(self.pairs, n)
        t = at_rest + len(self.mu)
        room = self.mu * x[at_rest] - np.abs(x[t])
        slips = np.isin(states[at_rest], [PLUS, MINUS])
        sign = np.where(states[at_rest] == PLUS, 1.0, -1.0)
        against = np.where(slips, sign * y[t], 0.0)
        worst = min(least, room.min(initial=0.0), -against.max(initial=0.0))
        return worst >= -SLACK * size

    def word(self, states: States) -> str:
        """One letter per block."""
        pairs = "".join("o" if state == FREE else "c" for state in states[: self.pairs])
        return pairs + word(states[self.pairs :])
