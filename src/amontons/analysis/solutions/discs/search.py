"""All solutions of a 3D Coulomb problem, with proof: branch and bound over statuses and arcs.

A region gives every contact the statuses it may have and an arc for its direction of slip.
With at most one known solution in it, multipliers close it (`multipliers`): about that
solution there is no other, or there is none at all.  Else, and where two known solutions are in
it, a contact is decided: free or closed, stick or slip, then halves of the arc.  Regions in
which every contact is free or sticks are a linear system.  Solutions to begin with come from
`multistart`, further ones from Newton's method where no region is left to divide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....core.clock import NEVER, Deadline, TimeLimit, deadline_of
from ....problem.friction import FrictionProblem
from ...scaled import UNRESOLVED, Scaled
from ...statuses import FREE, STICK
from ...tolerances import ON, REFERENCE, RESOLVED, SOLVED
from ..enumerate import Solutions, missing, searched
from ..existence import exist
from ..multistart import EXTRA, ROUND, Finder, statuses
from ..newton_batch import newton, on_piece, polished, solve_work, width
from ..region_tree import RegionTree
from .multipliers import BoxProblem, BoxProof
from .proof import DiscProof, box_of
from .sets import Law, Region, Regions, states_of_regions

Array = NDArray[np.float64]
FINEST = 0.002  # rad: half of the smallest arc
SURE = 1e-7  # scaled violation of the law that excludes the solution of a linear system
GHOST_STEPS, TURN = 12, 1e-6  # Newton steps for directions, rad of their differences
SECONDS = 60.0  # whose work a search without a time limit may take: it may grow without end
LARGEST = 300  # contacts up to which regions have multipliers: memory
VAGUE = 1e-9  # relative error of a solution that can not be a reference
STARTS = 300  # of Newton's method before the search


def enumerate_discs(
    problem: FrictionProblem | Scaled, *, time_limit: TimeLimit = None,
    tolerance: float = SOLVED, keep_proof: bool = False,
) -> Solutions:  # fmt: skip
    """All solutions of a 3D Coulomb problem; the global form is condensed.

    time_limit: seconds, after which the list is not complete; without it operations are
    counted, as many as take about SECONDS.  tolerance: error by the judge that a solution may
    have.  keep_proof: fill `Solutions.proof` with a DiscProof.  Raises UnsupportedForm under
    Tresca's law.
    """
    deadline = deadline_of(time_limit, SECONDS)

    def search(scaled: Scaled) -> Solutions:
        finder = Finder(scaled, np.random.default_rng(0), tolerance)
        tree = DiscSearch(scaled, finder, deadline)
        tree.begin()
        tree.run()
        entries = [replace(entry, distance=tree.resolution,
                           at_least=int(exist(scaled, [entry.r], deadline)),
                           sole=tree.complete and not (entry.freedom or entry.touching))
                   for entry in finder.solutions()]  # fmt: skip
        return Solutions(
            tuple(entries), tree.complete, tree.reason, tree.examined,
            proof=tree.proof() if keep_proof else None, resolution=tree.resolution,
            unresolved=tree.unresolved,
        )  # fmt: skip

    return searched(problem, deadline, search)


class DiscSearch(RegionTree):
    """The state of one search; `run` does it."""

    def __init__(self, scaled: Scaled, finder: Finder, deadline: Deadline = NEVER) -> None:
        super().__init__(scaled, deadline)
        self.finder = finder
        self.proofs: list[BoxProof] = []
        self.linear: list[Regions] = []
        self.errors: list[float] = []
        if self._penetrates:
            self.queue.clear()

    @property
    def several(self) -> bool:
        """True where more than one solution is known."""
        return len(self.finder.found) > 1

    def _look_elsewhere(self, deadline: Deadline) -> None:
        """Look for solutions from many starts."""
        self.begin(deadline)

    def begin(self, deadline: Deadline | None = None) -> None:
        """Solutions from many starts, more where one is known to be missing."""
        deadline = self.deadline if deadline is None else deadline
        self.finder.begin(deadline)
        used = 0
        while used < STARTS or (self.finder.lacks_one and used < EXTRA * STARTS):
            if deadline.passed:
                return
            used += self.finder.search(ROUND if width(self.scaled) > ROUND else 10, deadline)

    @property
    def complete(self) -> bool:
        """True when every region was closed, and solutions can be told apart."""
        return super().complete and self._resolved and not self._missing

    @property
    def resolution(self) -> float:
        """How far another solution can be from one that is taken to be on a border, relative.

        A reference within ON of another status counts as having both.  What it is off by, other
        solutions may be off by as much more as W is soft.
        """
        off = max((_off_border(self.scaled, r) for r in self.finder.found), default=0.0)
        if off > 0.0:
            softest = float(np.linalg.eigvalsh(self.scaled.symmetric)[0])
            off /= max(softest, np.finfo(float).tiny)
        return self.scaled.relative(max(ON, off), *self.finder.found)

    @property
    def _missing(self) -> str | None:
        """What the orientations of the solutions say, see `local_degree`."""
        if 0 in self.finder.sign:
            return None
        return missing(sum(self.finder.sign), 0 if self._penetrates else 1)

    @property
    def unresolved(self) -> bool:  # type: ignore[override]
        """True where all regions are closed, but solutions can not be told apart."""
        closed = not (self.stopped or self.undecided)
        return closed and not self._resolved

    @property
    def _resolved(self) -> bool:
        loaded = all(self.scaled.resolves(r) for r in self.finder.found)
        return loaded and self.resolution <= RESOLVED

    @property
    def _penetrates(self) -> bool:
        """True when a contact that can not react has u_N < 0, beyond rounding: no solution."""
        return bool((self.scaled.q[~self.scaled.reacts, 0] < -SURE).any())

    @property
    def reason(self) -> str:
        """Why the list is complete, or why not."""
        if self.stopped and len(self.scaled.mu) > LARGEST:
            return f"more than {LARGEST} contacts: regions were not looked at"
        if self.stopped:
            return f"stopped after {self.deadline}"
        if self.undecided:
            return f"{self.undecided} regions could be neither divided nor excluded"
        if self.unresolved:
            return UNRESOLVED
        if self._missing is not None:
            return self._missing
        return "every region was searched and all others are excluded"

    def proof(self) -> DiscProof:
        """What closed the regions, in the units of the problem."""
        return DiscProof(
            tuple(box_of(self.scaled, proof) for proof in self.proofs),
            tuple("".join(region.letter for region in regions) for regions in self.linear),
        )

    @property
    def affords_step(self) -> bool:
        """True where there are time and memory to look at a region."""
        return len(self.scaled.mu) <= LARGEST and super().affords_step

    def _polish(self) -> None:
        """Known solutions to the last digits; those that can not be are no references."""
        self.errors = []
        for k, r in enumerate(self.finder.found):
            better, step = polished(self.scaled, r)
            if np.abs(better - r).max(initial=0.0) <= ON * (1 + np.abs(r).max(initial=0.0)):
                self.finder.found[k] = better
            self.errors.append(REFERENCE + 10 * step / (1 + float(np.abs(r).max(initial=0.0))))

    def _look_at(self, regions: Regions) -> list[Regions]:
        """Regions that remain of one; none where it is closed or has to be given up."""
        if len(self.errors) < len(self.finder.found):
            self._polish()
        inside = [r for r in self.finder.found if self._holds(regions, r)]
        if len(inside) > 1:
            p = self._difference(regions, inside)
            parts = [] if p is None else self._divided(regions, p, inside)
            self.undecided += not parts
            return parts
        if all(region.letter in "fs" for region in regions):
            self._settle(regions, bool(inside))
            return []
        error = self._error(inside[0]) if inside else REFERENCE
        if error > VAGUE:
            self.undecided += 1
            return []
        box = BoxProblem(self.scaled, regions, inside[0] if inside else None, error=error)
        answer = box.solve(self.deadline)
        if answer.proof is not None:
            self.proofs.append(answer.proof)
            return []
        if not inside and all(region.letter in "fsl" for region in regions):
            if self._newton(regions):
                return [regions]
            if self._closed_about_a_ghost(regions):
                return []
        return self._parts_of(regions, answer.scores, inside)

    def _closed_about_a_ghost(self, regions: Regions) -> bool:
        """Close a pattern about the one point where its equations hold but a sign does not."""
        r, error = self._ghost(regions)
        if r is None or not self._holds(regions, r) or error > VAGUE:
            return False
        u = self.scaled.velocity(r[None])[0]
        slip = np.array([region.letter == "l" for region in regions])
        stick = np.array([region.letter == "s" for region in regions])
        size = 1 + np.abs(r).max()
        excess = np.linalg.norm(r[:, 1:], axis=1) - self.scaled.mu * r[:, 0]
        worst = max(np.max(excess[stick], initial=-np.inf),
                    np.max(-u[~slip & ~stick, 0], initial=-np.inf))  # fmt: skip
        if worst <= SURE * size or not (r[slip, 0] > SURE * size).all():
            return False
        answer = BoxProblem(self.scaled, regions, r, error=error).solve(self.deadline)
        if answer.proof is not None:
            self.proofs.append(answer.proof)
        return answer.proof is not None

    def _ghost(self, regions: Regions) -> tuple[Array | None, float]:
        """(r with the equations of a pattern and u_T along r_T, relative error of it)."""
        slip = np.flatnonzero([region.letter == "l" for region in regions])
        states = states_of_regions(regions)
        angle = np.array([region.middle for region in regions])
        step, r, u, direction = np.inf, np.empty(0), np.empty(0), np.empty(0)
        for _ in range(GHOST_STEPS):
            trial = np.vstack([angle, angle + TURN * np.eye(len(angle))[slip]])
            direction = np.stack([np.cos(trial), np.sin(trial)], axis=2)
            self.deadline.spend(solve_work(self.scaled, len(trial)))
            r = on_piece(self.scaled, np.tile(states, (len(trial), 1)), direction)
            u = self.scaled.velocity(r)
            across = direction[..., 0] * u[..., 2] - direction[..., 1] * u[..., 1]
            value = across[0, slip]
            J = (across[1:, slip] - value).T / TURN
            try:
                turn = np.linalg.solve(J, value)
            except np.linalg.LinAlgError:
                return None, np.inf
            step = float(np.abs(turn).max(initial=0.0))
            if not step < 1.0:
                return None, np.inf
            angle[slip] -= turn
        along = np.einsum("pi,pi->p", direction[0], u[0, :, 1:])
        proper = step < VAGUE and (along[slip] > SURE).all()
        return (r[0], REFERENCE + 100 * step) if proper else (None, np.inf)

    def _error(self, r: Array) -> float:
        """Bound of the relative error of one of the solutions found."""
        return next(e for e, r0 in zip(self.errors, self.finder.found, strict=True) if r0 is r)

    # ---------------------------------------------------------------- regions
    def _laws(self, r: Array) -> list[Law]:
        z = np.hstack([r, self.scaled.velocity(r[None])[0]])
        return [Law(float(mu), own) for mu, own in zip(self.scaled.mu, z, strict=True)]

    def _holds(self, regions: Regions, r: Array) -> bool:
        laws = self._laws(r)
        return all(law.lies_in(region) for law, region in zip(laws, regions, strict=True))

    def _slip_divided(self, own: Region, p: int, inside: Sequence[Array]) -> list[Region]:
        """Halves of an arc; a circle is cut across the direction of a known solution.

        The arc of two known solutions is cut between them.
        """
        if own.half <= FINEST:
            return []
        angles = [law.direction for law in (self._laws(r)[p] for r in inside)]
        known = [angle for angle in angles if angle is not None]
        if own.half >= np.pi:
            middle = known[0] if known else own.middle
            return [Region("l", middle, np.pi / 2), Region("l", middle + np.pi, np.pi / 2)]
        return [Region("l", own.middle - own.half / 2, own.half / 2),
                Region("l", own.middle + own.half / 2, own.half / 2)]  # fmt: skip

    def _difference(self, regions: Regions, inside: list[Array]) -> int | None:
        """A contact whose division tells known solutions apart."""
        rank: list[tuple[int, int, int]] = []
        for p in range(len(regions)):
            parts = self._divided(regions, p, inside)
            counts = [sum(self._holds(part, r) for r in inside) for part in parts]
            if parts and max(counts) < len(inside):
                rank.append((max(counts), sum(counts), p))
        if rank:
            return min(rank)[2]
        return next((p for p in self._order(regions, np.zeros(len(regions)))
                     if self._divided(regions, p, inside)), None)  # fmt: skip

    # ---------------------------------------------------------------- leaves
    def _start(self, regions: Regions) -> Array:
        """Scaled r on a pattern, slip in the middle of its arcs, signs disregarded."""
        states = states_of_regions(regions)[None]
        angle = np.array([region.middle for region in regions])
        direction = np.column_stack([np.cos(angle), np.sin(angle)])
        return on_piece(self.scaled, states, direction[None])

    def _newton(self, regions: Regions) -> bool:
        """True when Newton's method from a region finds a solution that was not known."""
        reached = newton(self.scaled, self._start(regions), np.random.default_rng(0),
                         deadline=self.deadline)  # fmt: skip
        return any([self.finder.add(r) for r in reached])

    def _settle(self, regions: Regions, known: bool) -> None:
        """A region without slip: its linear system has a solution of the law or not."""
        self.linear.append(regions)
        r = self._start(regions)[0]
        u = self.scaled.velocity(r[None])[0]
        free = np.array([region.letter == "f" for region in regions])
        closed = ~free
        equations = max(np.abs(r[free]).max(initial=0.0), np.abs(u[closed]).max(initial=0.0))
        matrix = self.scaled.W[np.ix_(np.repeat(closed, 3), np.repeat(closed, 3))]
        if equations > 1e-9 * (1 + np.abs(r).max()) or _ill_conditioned(matrix):
            self.undecided += 1
            return
        if known:
            return
        tangent = np.linalg.norm(r[:, 1:], axis=1) - self.scaled.mu * r[:, 0]
        worst = max(np.max(-u[free, 0], initial=-np.inf),
                    np.max(tangent[closed], initial=-np.inf),
                    np.max(-r[closed, 0], initial=-np.inf))  # fmt: skip
        if worst <= SURE * (1 + np.abs(r).max()) and not self.finder.add(r):
            self.undecided += not self._known(r)

    def _known(self, r: Array) -> bool:
        size = 1 + np.abs(r).max()
        return any(np.abs(r - other).max() <= 10 * ON * size for other in self.finder.found)


def _off_border(scaled: Scaled, r: Array) -> float:
    """Largest distance from another status, scaled, that counts as none without being it."""
    u, states = scaled.velocity(r[None])[0], statuses(scaled, r)[0]
    stick = np.minimum(r[:, 0], scaled.mu * r[:, 0] - np.linalg.norm(r[:, 1:], axis=1))
    slip = np.where(scaled.mu > 0, np.linalg.norm(u[:, 1:], axis=1), np.inf)
    distance = np.select([states == FREE, states == STICK],
                         [np.abs(u[:, 0]), stick], np.minimum(r[:, 0], slip))  # fmt: skip
    distance = np.abs(distance[scaled.reacts])
    return float(distance[distance <= ON].max(initial=0.0))


def _ill_conditioned(matrix: Array) -> bool:
    if not len(matrix):
        return False
    values = np.linalg.svd(matrix, compute_uv=False)
    return bool(values[-1] <= 1e-8 * values[0])
