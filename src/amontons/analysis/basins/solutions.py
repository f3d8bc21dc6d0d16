"""The solutions that runs are told by: each with a name, and how far a state is from them.

A state is told by its energy: |dv|_M = sqrt(dv M dv) of the difference of two motions, in the
Delassus form sqrt(dr W dr), which is the same number.  Reactions that make the same motion, as
there are where W is singular, are one solution.  Distances are relative to the largest energy
of a solution, or to the energy that the load could make if that is more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import InvalidInput
from ...problem.friction import Form, FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers import Auto, SemismoothNewton
from ...solvers.driver import drive
from ...solvers.first_iterate import first_iterate

Array = NDArray[np.float64]
FAILED, OTHER = "failed", "other"
APART = 0.5  # of the distance to the next solution, within which a state belongs to one
POLISHED = 1e-11  # error of a solution that a run has found and nobody has listed
ACCEPTED = 1e-9  # the same where rounding allows no less
POLISHING = 50  # Newton steps for it
LEAP = 1e-2  # by which they may move it, relative as `within`
INSIDE = (0.25, 0.5, 0.75)  # points between two states of a connected set that are judged


@dataclass(frozen=True, eq=False)
class KnownSolution:
    """One solution of the problem: r, u (nc, d) in the local frames, v (n,) or None.

    pattern: statuses of the contacts, f, s, + and -, in 3D l.  source: "listed" by the search
    for all solutions, "given" by the user, or "found" by a run and solved again to rounding.
    error: by the judge.  energy: sqrt(r W r), unit of sqrt(r u).  freedom: of a connected set.
    """

    name: str
    pattern: str
    r: Array
    u: Array
    v: Array | None
    error: float
    energy: float
    source: str
    freedom: int = 0


@dataclass(eq=False)
class Atlas:
    """The solutions known so far; complete: there is no other, with proof."""

    problem: FrictionProblem
    within: float
    known: list[KnownSolution] = field(default_factory=list)
    complete: bool = False
    reason: str = ""
    frozen: bool = False  # True: no run adds a solution

    @property
    def scale(self) -> float:
        """The energy that distances are relative to."""
        p = self.problem
        load = float(np.sqrt((p.rho[:, None] * p.free_velocity**2).sum()))
        return max([load, *[one.energy for one in self.known]]) or 1.0

    def add(self, r: Array, source: str, *, name: str = "", freedom: int = 0) -> KnownSolution:
        """Take note of a solution; its name, if none is given, comes from its pattern."""
        found = drive(
            self.problem, start=first_iterate(self.problem, _R(r)), max_iterations=1,
            contact_tolerance=np.inf,
        )  # fmt: skip
        energy = float(np.sqrt(max(self._product(found.r, found.u), 0.0)))
        one = KnownSolution(
            self._free_name(name or word_of(found.pattern)), found.pattern, np.array(r),
            found.u, found.v, self.problem.error(r), energy, source, freedom,
        )  # fmt: skip
        self.known.append(one)
        return one

    def _product(self, r: Array, u: Array) -> float:
        """r W r of reactions with the velocities u."""
        return float((r * (u - self.problem.free_velocity)).sum())

    def _free_name(self, name: str) -> str:
        taken = {one.name for one in self.known} | {FAILED, OTHER}
        k, free = 2, name
        while free in taken:
            free, k = f"{name} {k}", k + 1
        return free

    # ------------------------------------------------------------------ telling states
    def distances(self, r: Array | None, v: Array | None) -> Array:
        """To each known solution, relative; of v (n,) where there is one, else of r (nc, d)."""
        if not self.known:
            return np.zeros(0)
        problem = self.problem
        if problem.form is Form.GLOBAL:
            if v is None:
                v = problem.velocity(r)[1]  # type: ignore[arg-type]
            squares = []
            for one in self.known:
                dv = v - one.v  # type: ignore[operator]
                squares.append(dv @ (problem.M @ dv))
        else:
            u = problem.velocity(r)[0]  # type: ignore[arg-type]
            squares = [((r - one.r) * (u - one.u)).sum() for one in self.known]  # type: ignore[operator]
        return np.sqrt(np.maximum(squares, 0.0)) / self.scale

    def tell(
        self, r: Array | None, v: Array | None, pattern: str, within: float,
        deadline: Deadline, tolerance: float,
    ) -> tuple[str, float]:  # fmt: skip
        """(name, distance) of a state that its own judge takes for a solution.

        The nearest solution where it is `within`; else what Newton's method makes of r, if that
        is near: a known solution, or one more.  OTHER where none of this holds.
        """
        far = self.distances(r, v)
        if len(far):
            k = int(np.argmin(far))
            if far[k] <= min(within, APART * self._gap(k)):
                return self.known[k].name, float(far[k])
        least = float(far.min(initial=np.inf))
        if r is None or r.shape != (self.problem.contacts, self.problem.dimension):
            return OTHER, least
        for one in self.known:
            if one.freedom and one.pattern == pattern and self._joined(r, one, tolerance):
                return one.name, 0.0
        return self._polished(r, deadline, least)

    def _gap(self, k: int) -> float:
        """Distance of a known solution to the next one."""
        one = self.known[k]
        others = np.delete(self.distances(one.r, one.v), k)
        return float(others.min(initial=np.inf))

    def _joined(self, r: Array, one: KnownSolution, tolerance: float) -> bool:
        """True where the states between belong to the same connected set."""
        between = [(1 - t) * r + t * one.r for t in INSIDE]
        return all(self.problem.error(state) <= 10 * tolerance for state in between)

    def _polished(self, r: Array, deadline: Deadline, least: float) -> tuple[str, float]:
        """The solution that Newton's method finds beside a state."""
        start = _R(r)
        for solver in (SemismoothNewton(), Auto()):
            found = drive(
                self.problem, solver, start=start, tolerance=POLISHED,  # type: ignore[arg-type]
                max_iterations=POLISHING, time_limit=deadline,
            )  # fmt: skip
            if self._moved(r, found) <= LEAP and found.convergence.error <= ACCEPTED:
                break
        else:
            return OTHER, least
        far = self.distances(found.r, found.v)
        moved = self._moved(r, found)
        if len(far):
            k = int(np.argmin(far))
            if far[k] <= min(self.within, APART * self._gap(k)):
                return self.known[k].name, moved
        if self.complete or self.frozen or self._near_two(far):
            return OTHER, least
        return self.add(found.r, "found").name, moved

    def _near_two(self, far: Array) -> bool:
        """True where a state is nearer to a solution than can be told apart."""
        return bool((far <= self.within).any())

    def _moved(self, r: Array, found: FrictionSolution) -> float:
        """Distance of a state to what became of it."""
        dr = found.r - r
        du = found.u - self.problem.velocity(r)[0]
        return float(np.sqrt(max((dr * du).sum(), 0.0))) / self.scale


@dataclass(frozen=True, eq=False)
class _R:
    """Reactions as a start."""

    r: Array
    v: Array | None = None


def word_of(pattern: str) -> str:
    """free, stick, slip, or what there is of them: "free+stick"; "" of no contact is free."""
    present = [
        word for word, letters in (("free", "f"), ("stick", "s"), ("slip", "+-l"))
        if set(pattern) & set(letters)
    ]  # fmt: skip
    if "slip" in present:
        return "slip"  # wherever anything slides, whatever the others do
    return "+".join(present) or "free"


def given_solutions(atlas: Atlas, solutions: Any) -> None:
    """Put solutions of the user into an atlas, each judged; raises InvalidInput for others.

    solutions: a list of `all_solutions`, or names with states that have r.
    """
    entries = getattr(solutions, "solutions", None)
    if entries is not None:
        for one in entries:
            atlas.add(np.asarray(one.r, dtype=float), "listed", freedom=one.freedom)
        atlas.complete, atlas.reason = solutions.complete, solutions.reason
        return
    if not isinstance(solutions, Mapping | Sequence) or isinstance(solutions, str):
        raise InvalidInput(
            "solutions: expected what all_solutions finds, or names with solutions, got "
            f"{type(solutions).__name__}"
        )
    if not isinstance(solutions, Mapping):
        solutions = {f"solution {k}": one for k, one in enumerate(solutions, 1)}
    atlas.reason = "the solutions that were given"
    for name, one in solutions.items():
        if name in (FAILED, OTHER):
            raise InvalidInput(f"solutions: {name!r} is what runs are called that found none")
        try:
            r = first_iterate(atlas.problem, one).r
        except InvalidInput as reason:
            raise InvalidInput(f"solutions: {name}: {reason}") from None
        error = atlas.problem.error(r)
        if not error <= ACCEPTED:
            raise InvalidInput(f"solutions: {name}: its error is {error:.1e}, it is none")
        atlas.add(r, "given", name=name)
