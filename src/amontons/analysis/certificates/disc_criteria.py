"""Criteria of critical friction with friction discs: the smallest friction at which they fail.

`older_criteria` says what they are.  Contacts are in two groups: with u_N = 0, and with r_N = 0
and any u_N.  What is multi-affine in the ratios of r_N and u_N fails first in such a group.
The matrix of r = A u for u_T of all contacts is then

    A = [W of all T and of N with u_N = 0]^-1,   zero in the other N.

Full contact has one group only, u_N = 0; the P-matrix criterion all of them.  In the critical
friction the other contacts are open, r = 0, so that their T is left out as well.

Each is a least value over angles (`slip_arcs`): local searches from many points give an upper
bound with a witness, halving boxes of angles a lower one.  All is done in floating point; the
rounding of A is not counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from . import slip_arcs as arcs
from .energy_bound import energy_bound
from .exact_threshold import LARGEST

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ARCS = 4  # intervals of the circle to begin with
SAMPLED = 400  # angles at which local searches may begin
POLISHED = 6  # of them from which one does
STEPS = 150  # evaluations of a local search per angle
BOXES = 2_000  # between two looks at the clock
ROOM = 4000  # boxes beyond those to begin with
LEVELS = (0.3, 0.6, 0.8, 0.9, 0.95, 0.98)  # of the upper bound, proved one after another
FAR = 2.0  # upper bounds from which a local search may begin
BETTER = 1e-9  # relative, by which a new upper bound is one


class Criterion(Enum):
    """Which criterion."""

    P_MATRIX = "p-matrix"
    FULL_CONTACT = "full contact"
    SHARP = "sharp full contact"
    CRITICAL = "critical"


@dataclass(eq=False)
class Found:
    """lower <= t <= upper; difference (k, 3) is d of the upper bound; examined: boxes."""

    lower: float = 0.0
    upper: float = np.inf
    difference: Array | None = None
    examined: int = 0
    reason: str = ""


def disc_threshold(
    W: Array, shape: Array, criterion: Criterion, gap: float, deadline: Deadline
) -> Found:
    """Bounds on the t at which a criterion fails with friction t shape in discs.

    W (3 k, 3 k) regular, shape (k,).
    """
    found = Found()
    if criterion is not Criterion.FULL_CONTACT and not _couples(W):
        found.lower = np.inf
        found.reason = "no tangential force moves a contact along its normal"
        return found
    if criterion is not Criterion.FULL_CONTACT:
        found.lower = energy_bound(W, shape, deadline)[0]
    turns = criterion is Criterion.FULL_CONTACT
    parts = [_Part(found, A, shape[own], own, len(shape), closed, turns, deadline)
             for A, own, closed in _groups(W, criterion)]  # fmt: skip
    for part in parts:
        part.descend()
    for level in (*LEVELS, 1 - gap):
        while found.lower < (target := level * min(found.upper, LARGEST)):
            if all(part.prove(target) for part in parts):
                found.lower = target
            elif not found.upper <= target:
                return found
    return found


def _couples(W: Array) -> bool:
    tangent = np.arange(len(W)) % 3 != 0
    return bool((W[~tangent][:, tangent] != 0).any() or (W[tangent][:, ~tangent] != 0).any())


def _groups(W: Array, criterion: Criterion) -> list[tuple[Array, Index, NDArray[np.bool_]]]:
    """(A, its contacts, which of them have u_N = 0) of every group of contacts."""
    k = len(W) // 3
    every = np.array(list(product([True, False], repeat=k)))[:-1]
    if criterion in (Criterion.FULL_CONTACT, Criterion.SHARP):
        every = every[:1]
    found = []
    for closed in every:
        keep = np.ones((k, 3), dtype=bool)
        keep[~closed, 0] = False
        own = np.arange(k)
        if criterion is Criterion.CRITICAL:
            own, keep[~closed] = np.flatnonzero(closed), False
        rows = np.flatnonzero(keep)
        A = np.zeros_like(W)
        A[np.ix_(rows, rows)] = np.linalg.inv(W[np.ix_(rows, rows)])
        place = (3 * own[:, None] + np.arange(3)).ravel()
        found.append((A[np.ix_(place, place)], own, closed[own]))
    return found


@dataclass(eq=False)
class _Part:
    """The search over the angles of one group; `found` is that of all groups.

    turns: psi takes all values, else only 0 and pi.
    """

    found: Found
    A: Array
    shape: Array
    own: Index
    total: int
    closed: NDArray[np.bool_]
    turns: bool
    deadline: Deadline

    @property
    def cost(self) -> float:
        """Operations of a box."""
        return 6000.0 + 1500.0 * 2 ** len(self.own)

    # ------------------------------------------------------------------ upper bounds
    def descend(self) -> None:
        """Local searches from the best of some angles."""
        random = np.random.default_rng(0)
        k = len(self.own)
        angles = random.uniform(-np.pi, np.pi, (SAMPLED, 2 * k))
        if not self.turns:
            angles[:, k:] = np.pi * random.integers(0, 2, (SAMPLED, k))
        largest = min(FAR * self.found.upper, LARGEST)  # other groups may fail much later
        values = np.full(SAMPLED, np.inf)
        for i, row in enumerate(angles):
            if self.deadline.passed:
                return
            values[i] = self._value(row, largest)
        for start in np.argsort(values)[:POLISHED]:
            if np.isfinite(values[start]) and not self.deadline.passed:
                self._polish(angles[start])

    def _value(self, angles: Array, largest: float = LARGEST) -> float:
        t, rho = arcs.point_threshold(self.A, self.shape, angles, largest)
        self.deadline.spend((arcs.BISECTIONS if t < np.inf else 1) * self.cost)
        if t < self.found.upper * (1 - BETTER):
            self.found.upper, self.found.difference = float(t), self._difference(angles, rho)
        return float(t)

    def _polish(self, angles: Array) -> None:
        """Nelder and Mead's search over theta, and over psi where it turns."""
        from scipy.optimize import minimize

        free = len(angles) if self.turns else len(self.own)

        def value(x: Array) -> float:
            t = self._value(np.concatenate([x, angles[free:]]))
            return float(np.log(min(t, 10 * LARGEST)))

        for width in (0.3, 0.01):
            simplex = angles[:free] + width * np.vstack([np.zeros(free), np.eye(free)])
            done = minimize(value, angles[:free], method="Nelder-Mead", options={
                "maxfev": STEPS * free, "xatol": 1e-9, "fatol": 1e-12,
                "initial_simplex": simplex})  # fmt: skip
            angles = np.concatenate([done.x, angles[free:]])
            if self.deadline.passed:
                return

    def _difference(self, angles: Array, rho: Array) -> Array:
        """d of all contacts for rho at a point, scaled to one."""
        k = len(self.own)
        motion = np.zeros((k, 3))
        motion[:, 1] = rho * np.cos(angles[:k])
        motion[:, 2] = rho * np.sin(angles[:k])
        d = np.zeros((self.total, 3))
        d[self.own] = (self.A @ motion.ravel()).reshape(k, 3)
        return d / max(np.abs(d).max(), np.finfo(float).tiny)

    # ------------------------------------------------------------------ lower bounds
    def prove(self, t: float) -> bool:
        """Whether the criterion holds at t; else it is not known, or the upper bound fell."""
        middle, half, top = self._boxes()
        while not self.deadline.passed:
            status, top, seen = arcs.search_inplace(self.A, t * self.shape, middle, half, top,
                                                    BOXES)  # fmt: skip
            self.found.examined += seen
            self.deadline.spend(self.cost * seen)
            if status == arcs.PROVED:
                return True
            if status == arcs.FAILED:
                self._value(middle[top - 1])
                self._polish(middle[top - 1].copy())
                return False
            if status == arcs.SMALL:
                self.found.reason = "boxes of angles became too small"
                return False
        self.found.reason = "time is up"
        return False

    def _boxes(self) -> tuple[Array, Array, int]:
        """A stack of boxes that cover all angles; rho n and -rho n are the same."""
        k = len(self.own)
        circle = (np.arange(ARCS) + 0.5) * 2 * np.pi / ARCS
        signs = circle if self.turns else np.array([0.0, np.pi])
        psi = [signs if closed else signs[:1] for closed in self.closed]
        start = np.array(list(product(circle[: ARCS // 2], *[circle] * (k - 1), *psi)))
        width = np.full(2 * k, np.pi / ARCS)
        if not self.turns:
            width[k:] = 0.0
        middle, half = np.empty((2, len(start) + ROOM, 2 * k))
        middle[: len(start)], half[: len(start)] = start, width
        return middle, half, len(start)
