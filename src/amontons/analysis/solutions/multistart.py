"""Many solutions of a Coulomb problem by Newton's method from many starts, 2D and 3D.

A finder, not a proof: what it lists are solutions, and there may be others.  Starts: status
patterns with random shares of free, sticking and slipping contacts in random directions;
random reactions in the cone; known solutions with some contacts in another status; points
between and beyond two known solutions; and the same starts again with the known solutions
deflated (`newton_batch`).  Isolated solutions with regular Jacobians have orientations that add
up to 1 where W is positive definite (degree theory): while they do not, one is missing, and
the search goes on for up to EXTRA times the starts.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ...core.arrays import whole
from ...core.clock import NEVER, Deadline, TimeLimit, deadline_of
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ...solvers.driver import drive
from ..scaled import Scaled
from ..statuses import FREE, SLIP, STICK, States
from ..tolerances import BORDER, SAME, SINGULAR, SOLVED
from .enumerate import PieceSolution, Solutions, searched
from .newton_batch import jacobian, linearise, newton, on_piece, solve_work, width

Array = NDArray[np.float64]
ROUND = 100  # starts between two looks at the clock and at the solutions known so far
SOLVER = 10.0  # seconds for a solver, where Newton's method is dear; counted without a limit
EXTRA = 3  # times the starts while a solution is known to be missing
FLAT = 1e-4  # of their distance: an error between two solutions that makes them connected
ROUNDING = 1e-11  # scaled distance below which a difference of status counts as none
RANKED = 1000  # rows up to which the kernel of a Jacobian comes from its singular values
WORDS = 64  # touching patterns that are listed
KINDS = np.array([FREE, STICK, SLIP])  # of Newton's method


def multistart(
    problem: FrictionProblem, *, starts: int = 1000, seed: int = 0,
    time_limit: TimeLimit = None, tolerance: float = SOLVED,
) -> Solutions:  # fmt: skip
    """Solutions of a 2D or 3D Coulomb problem found from many starts; never complete.

    starts: Newton iterations that are begun.  seed: of their choice.  time_limit: seconds.
    tolerance: error by the judge that a solution may have.  The global form is condensed.
    Raises UnsupportedForm under Tresca's law.
    """
    starts, seed = whole("starts", starts, least=1), whole("seed", seed, least=0)
    deadline = deadline_of(time_limit)

    def search(scaled: Scaled) -> Solutions:
        finder = Finder(scaled, np.random.default_rng(seed), tolerance)
        finder.begin(deadline)
        used = 0
        while used < starts or (finder.lacks_one and used < EXTRA * starts):
            if deadline.passed:
                break
            say(f"this load: {used} starts, {len(finder.found)} solutions")
            used += finder.search(min(ROUND, EXTRA * starts - used), deadline)
        found = tuple(finder.solutions())
        return Solutions(found, False, finder.reason(used), used, resolution=SAME)

    return searched(problem, deadline, search)


class Finder:
    """The solutions found so far, and where to look next."""

    def __init__(self, scaled: Scaled, random: np.random.Generator, tolerance: float) -> None:
        self.scaled, self.random, self.tolerance = scaled, random, tolerance
        self.found: list[Array] = []  # scaled reactions
        self.sign: list[int] = []  # orientations

    def begin(self, deadline: Deadline = NEVER) -> None:
        """What a solver finds, where Newton's method is dear."""
        if width(self.scaled) <= ROUND:
            own = Deadline.counted(SOLVER) if deadline == NEVER else deadline.within(SOLVER)
            found = drive(self.scaled.problem, tolerance=self.tolerance, time_limit=own)
            self.add(found.r / self.scaled.to_r)

    def search(self, count: int, deadline: Deadline = NEVER) -> int:
        """Newton from `count` starts, until the deadline at most; returns count."""
        plain = self._starts(count, deadline)
        for r in newton(self.scaled, plain, self.random, deadline=deadline):
            self.add(r)
        if self.found:
            some, known = plain[: max(1, count // 4)], np.array(self.found)
            for r in newton(self.scaled, some, self.random, known, deadline):
                self.add(r)
        return count

    def add(self, r: Array) -> bool:
        """Keep scaled reactions that the judge accepts and that are new."""
        size = 1 + np.abs(r).max(initial=0.0)
        if any(self._same(r, other, size) for other in self.found):
            return False
        if self.scaled.problem.certain_error(r * self.scaled.to_r) > self.tolerance:
            return False
        for k, other in enumerate(self.found):
            if self._connected(
                r, other
            ):  # keep a point inside, its Jacobian is that of the set
                self.found[k], self.sign[k] = (r + other) / 2, 0
                return False
        self.found.append(r)
        self.sign.append(orientation(self.scaled, r)[0])
        return True

    def _same(self, r: Array, other: Array, size: float) -> bool:
        """True for a solution again: same place, of different status only by rounding."""
        apart = float(np.abs(r - other).max(initial=0.0))
        if apart > SAME * size or apart <= ROUNDING * size:
            return apart <= SAME * size
        return bool((statuses(self.scaled, r)[0] == statuses(self.scaled, other)[0]).all())

    def _connected(self, r: Array, other: Array) -> bool:
        """True where the segment between two solutions consists of solutions."""
        points = np.array([(1 - t) * r + t * other for t in (0.25, 0.5, 0.75)])
        F = linearise(self.scaled, points, np.ones(points.shape[:2]))[0]
        apart, size = np.abs(r - other).max(), 1 + np.abs(r).max()
        return bool(np.abs(F).max() <= min(BORDER * size, FLAT * apart))

    @property
    def lacks_one(self) -> bool:
        """True when regular solutions were found whose orientations do not add up to 1."""
        return 0 not in self.sign and sum(self.sign) != 1

    def reason(self, used: int) -> str:
        """What the list rests on."""
        text = f"Newton's method from {used} starts, no proof"
        if 0 in self.sign:
            return f"{text}; a connected set or a singular Jacobian was found"
        if self.lacks_one:
            return f"{text}; orientations add up to {sum(self.sign)}, not 1: one is missing"
        return f"{text}; orientations add up to 1"

    # ---------------------------------------------------------------- starts
    def _starts(self, count: int, deadline: Deadline) -> Array:
        """Reactions to start from, (count, nc, d), fewer where time is up."""
        kinds = [self._patterns, self._in_the_cone]
        if self.found:
            kinds += [self._patterns, self._neighbours]
        if len(self.found) > 1:
            kinds.append(self._between)
        parts = np.array_split(np.arange(count), len(kinds))
        return np.concatenate(
            [kind(len(part), deadline) for kind, part in zip(kinds, parts, strict=True)]
        )

    def _directions(self, count: int) -> Array:
        """Unit tangents, (count, nc, d - 1): in half of the starts about one for all."""
        nc, d = self.scaled.shape
        each = self.random.standard_normal((count, nc, d - 1))
        common = self.random.standard_normal((count, 1, d - 1))
        each += common * self.random.choice([0.0, 5.0], (count, 1, 1))
        return each / np.maximum(np.linalg.norm(each, axis=2, keepdims=True), 1e-300)

    def _solved(
        self, states: States, direction: Array, deadline: Deadline
    ) -> Array:
        most, out = width(self.scaled), [np.zeros((0, *self.scaled.shape))]
        for k in range(0, len(states), most):
            if deadline.passed:
                break
            some = states[k : k + most]
            deadline.spend(solve_work(self.scaled, len(some)))
            out.append(on_piece(self.scaled, some, direction[k : k + most]))
        return np.concatenate(out)

    def _patterns(self, count: int, deadline: Deadline) -> Array:
        """Points of random patterns, each with its own shares of the statuses."""
        shares = self.random.dirichlet([0.5, 0.5, 0.5], count)
        chance = self.random.random((count, self.scaled.shape[0]))
        states = KINDS[(chance[:, :, None] > shares.cumsum(axis=1)[:, None, :2]).sum(axis=2)]
        return self._solved(states, self._directions(count), deadline)

    def _in_the_cone(self, count: int, deadline: Deadline) -> Array:
        nc, d = self.scaled.shape
        size = 10.0 ** self.random.uniform(-1.5, 1.5, (count, 1))
        normal = size * self.random.exponential(1.0, (count, nc))
        normal *= self.random.random((count, nc)) < self.random.random((count, 1))
        share = self.random.random((count, nc, 1)) ** 0.5
        tangent = (self.scaled.mu * normal)[:, :, None] * share * self._directions(count)
        return np.concatenate([normal[:, :, None], tangent], axis=2)

    def _neighbours(self, count: int, deadline: Deadline) -> Array:
        """Points of patterns that differ in some contacts from that of a known solution."""
        nc = self.scaled.shape[0]
        which = self.random.integers(len(self.found), size=count)
        known = [statuses(self.scaled, r) for r in self.found]
        states = np.array([known[k][0] for k in which]).reshape(count, nc)
        direction = np.array([known[k][1] for k in which]).reshape(count, nc, -1)
        changed = self.random.integers(1, min(4, nc) + 1, (count, 1)) / nc
        changed = self.random.random((count, nc)) < changed
        states = np.where(changed, KINDS[self.random.integers(3, size=(count, nc))], states)
        other = self._directions(count)
        return self._solved(states, np.where(changed[:, :, None], other, direction), deadline)

    def _between(self, count: int, deadline: Deadline) -> Array:
        """Points on the line through two known solutions, each contact for itself or all."""
        nc, _ = self.scaled.shape
        pick = self.random.integers(len(self.found), size=(2, count))
        known = np.array(self.found)
        t = self.random.uniform(-0.3, 1.3, (count, 1, 1))
        own = self.random.random((count, nc, 1)) < 0.5
        t = np.where(self.random.random((count, 1, 1)) < 0.5, t, own)
        return (1 - t) * known[pick[0]] + t * known[pick[1]]

    # ---------------------------------------------------------------- results
    def solutions(self) -> Iterator[PieceSolution]:
        """One entry per solution, most sticking contacts first."""
        entries = [described(self.scaled, r) for r in self.found]
        yield from sorted(entries, key=lambda s: (-s.pattern.count("s"), s.pattern))


# ------------------------------------------------------------- what a solution is
def statuses(scaled: Scaled, r: Array) -> tuple[States, Array]:
    """(status, (nc,), direction of slip, (nc, d - 1)) of one scaled solution."""
    u = scaled.velocity(r[None])[0]
    bound = scaled.mu * np.maximum(r[:, 0], 0)
    reach = np.linalg.norm(r[:, 1:] - u[:, 1:], axis=1)
    closed = (r[:, 0] > u[:, 0]) & scaled.reacts
    slip = closed & ((reach > bound) | (scaled.mu == 0))
    states = np.where(slip, SLIP, np.where(closed, STICK, FREE))
    length = np.linalg.norm(u[:, 1:], axis=1, keepdims=True)
    direction = np.where(length > 0, u[:, 1:] / np.where(length > 0, length, 1), 0.0)
    return states, direction


def orientation(scaled: Scaled, r: Array) -> tuple[int, int]:
    """(sign of the determinant of the generalised Jacobian or 0, dimension of its kernel).

    +1 without friction: there A + B W belongs to a symmetric positive definite problem.  By one
    LU where that is regular beyond doubt; the kernel of a large one is counted by its pivots.
    """
    matrix = jacobian(scaled, r)
    lu, swaps, _ = lapack.dgetrf(matrix)
    size = float(np.abs(matrix).sum(axis=0).max(initial=0.0))
    if len(matrix) and lapack.dgecon(lu, size)[0] > len(matrix) * SINGULAR:
        odd = np.count_nonzero(swaps != np.arange(len(swaps)))
        odd += np.count_nonzero(np.diag(lu) < 0)
        return (-1 if odd % 2 else 1), 0
    if len(matrix) > RANKED:
        pivots = np.abs(np.diag(lu))
        return 0, max(1, int((pivots <= SINGULAR * pivots.max(initial=0.0)).sum()))
    values = np.linalg.svd(matrix, compute_uv=False)
    freedom = int((values <= SINGULAR * values.max(initial=0.0)).sum())
    return (0 if freedom else int(np.linalg.slogdet(matrix)[0])), freedom


def described(scaled: Scaled, r: Array) -> PieceSolution:
    """A scaled solution as an entry of a list, in the units of the problem."""
    u = scaled.velocity(r[None])[0]
    each = zip(r, u, scaled.mu, scaled.reacts, strict=True)
    letters = [_letters(*contact) for contact in each]
    words = ["".join(word) for word in itertools.islice(itertools.product(*letters), WORDS)]
    sign, freedom = orientation(scaled, r)
    reaction = r * scaled.to_r
    velocity = np.array(scaled.problem.velocity(reaction)[0])
    energy = float((reaction * (u - scaled.q) * scaled.to_u).sum() / 2)
    error = scaled.problem.error(reaction)
    return PieceSolution(words[0], tuple(words[1:]), reaction, velocity, error, sign, energy,
                         freedom)  # fmt: skip


def _letters(r: Array, u: Array, mu: float, able: bool) -> list[str]:
    """Statuses that one contact has, at a border more than one: the most sticking first."""
    near = BORDER * (1 + np.abs(r).max())
    out = []
    if able and abs(u[0]) <= near:
        if np.abs(u[1:]).max() <= near and mu > 0:
            out.append("s")
        if np.linalg.norm(r[1:]) >= mu * r[0] - near:
            out += _slip_letters(r, u, mu, near)
    if np.abs(r).max() <= near:
        out.append("f")
    return out or ["f"]


def _slip_letters(r: Array, u: Array, mu: float, near: float) -> list[str]:
    if len(r) == 3:
        return ["l"]
    if mu == 0:
        return ["+"]  # as `all_solutions` calls a contact without friction
    plus = bool(abs(r[1] - mu * r[0]) <= near and u[1] <= near)
    minus = bool(abs(r[1] + mu * r[0]) <= near and u[1] >= -near)
    return ["+"] * plus + ["-"] * minus
