"""The regions of a problem about a known solution, divided until there is no other, or one.

The whole problem is one region first: multipliers (`discs.multipliers`) that leave no other
solution.  Where there are none, Newton's method looks for one from many starts, and then the
regions are divided until one is found or all are closed.  In 2D it also starts from where an
inequality fails.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import RATE, Deadline
from ....core.errors import InvalidInput
from ...scaled import Scaled
from ...solutions.discs.known import NEAR, not_a_solution, refined
from ...solutions.discs.multipliers import BoxProblem, BoxProof, too_many
from ...solutions.discs.plane_sets import plane_laws
from ...solutions.discs.proof import DiscBox, box_of
from ...solutions.discs.search import DiscSearch
from ...solutions.discs.sets import Regions
from ...solutions.enumerate import PieceSolution
from ...solutions.multistart import Finder, described
from ...solutions.newton_batch import newton, polished
from ...solutions.region_tree import RegionTree
from ...statuses import BOTH_WAYS
from ...tolerances import BELONGS, ON, REFINED, SEGMENT, SOLVED
from .answer import LoadBranch

Array = NDArray[np.float64]
POLISHED = 10.0  # operations of refining the solution per cube of the reactions
STARTS = 60  # of Newton's method once the first inequality of a 2D problem has no multipliers
STEP_WORK = 30.0  # operations of a start per cube of the reactions


class DiscTree(DiscSearch):
    """Regions of a 3D problem; known (nc, 3): the solution, refined and scaled.

    Solutions within ON of each other count as one.
    """

    def __init__(self, scaled: Scaled, r: Array, deadline: Deadline) -> None:
        deadline.pay(POLISHED * float(scaled.q.size) ** 3)
        self.known, _ = polished(scaled, r / scaled.to_r)
        super().__init__(scaled, Finder(scaled, np.random.default_rng(0), SOLVED), deadline)
        apart = np.abs(self.known - r / scaled.to_r).max()
        if apart > REFINED * (1 + np.abs(self.known).max()) or not self.finder.add(self.known):
            raise not_a_solution(scaled.problem, r)
        if not self.queue:
            raise InvalidInput("solution: a contact that can not react penetrates")

    @property
    def other(self) -> PieceSolution | None:
        """Another solution, where one was found."""
        first, *rest = self.finder.found
        others = [r for r in rest if np.abs(r - first).max() > ON]
        return described(self.scaled, others[0]) if others else None

    @property
    def parts(self) -> int:
        """Regions that were closed."""
        return len(self.proofs) + len(self.linear)

    @property
    def branches(self) -> tuple[DiscBox, ...]:
        """What closed the regions, in the units of the problem."""
        return self.proof().boxes


class PlaneTree(RegionTree):
    """Regions of a 2D problem; known (nc, 2): the solution, refined and scaled."""

    LOOK = (1.5e7, 1.5e6, 20.0)

    def __init__(self, scaled: Scaled, r: Array, deadline: Deadline) -> None:
        super().__init__(scaled, deadline)
        self.solution = refined(scaled, (r / scaled.to_r).ravel())
        self.about, self.alone = plane_laws(scaled, self.solution), plane_laws(scaled, None)
        self.known = self.solution.r.reshape(-1, 2)
        self.size = max(1.0, float(np.abs(self.known).max(initial=0.0)))
        self.random = np.random.default_rng(0)
        self.proofs: list[BoxProof] = []
        self.other: PieceSolution | None = None

    def _look_at(self, regions: Regions) -> list[Regions]:
        """Prove a region, or look for another solution where that fails, and divide it."""
        pairs = zip(self.about, regions, strict=True)
        if all(law.lies_in(region.letter) for law, region in pairs):
            box = BoxProblem(self.scaled, regions, self.known, known=self.solution,
                             laws=self.about)  # fmt: skip
        else:
            box = BoxProblem(self.scaled, regions, None, laws=self.alone)
        answer = box.solve(self.deadline, NEAR * self.size)
        if answer.proof is not None:
            self.proofs.append(answer.proof)
            return []
        self.other = self._near(answer.direction)
        return self._parts_of(regions, answer.scores)

    @property
    def several(self) -> bool:
        """True where another solution is known."""
        return self.other is not None

    @property
    def affords_step(self) -> bool:
        """True where there are time and memory to prove a region; the whole is tried anyway."""
        few = not self.examined or not too_many(self.scaled)
        return few and super().affords_step

    @property
    def reason(self) -> str:
        """Why the regions are not all closed."""
        if not self.stopped:
            return f"{self.undecided} patterns could neither be excluded nor solved"
        left = f"stopped after {self.deadline} with {len(self.queue)} branches left"
        return too_many(self.scaled) or left

    # ------------------------------------------------------------------ another solution
    @property
    def _start_work(self) -> float:
        """Operations of Newton's method from one start, at most and roughly."""
        return STEP_WORK * self.scaled.W.shape[0] ** 3

    def _near(self, z: Array) -> PieceSolution | None:
        """From where an inequality fails: along d, or at z / tau."""
        if not self.deadline.affords(4 * self._start_work) or not z.any():
            return None
        if z.shape[1] == 5:
            starts = z[None, :, :2] / (z[0, 4] or 1.0)
        else:
            length = np.abs(z[:, :2]).max(initial=0.0)
            steps = np.array([-3.0, -0.3, 0.3, 3.0])[:, None, None]
            starts = self.known + steps * z[:, :2] / (length or 1.0)
        return self._first(newton(self.scaled, starts, self.random, deadline=self.deadline))

    def _look_elsewhere(self, deadline: Deadline) -> None:
        """Look for another solution from many starts."""
        if not deadline.affords(2 * self._start_work):
            return
        finder = Finder(self.scaled, self.random, SOLVED)
        finder.add(self.known)
        each = int(np.clip(0.2 * RATE / self._start_work, 2, STARTS))
        for _ in range(0, STARTS, each):
            finder.search(each, deadline)
            self.other = self._first(np.array(finder.found).reshape(-1, *self.known.shape))
            if self.other or deadline.passed:
                return

    def _first(self, reached: Array) -> PieceSolution | None:
        far = BELONGS * (1 + np.abs(self.known).max(initial=0.0))
        for r in reached:
            if np.abs(r - self.known).max() > far and self._solves(r):
                return described(self.scaled, r)
        return None

    def _solves(self, r: Array) -> bool:
        """True where r is a solution, and not only because all between the two nearly are."""
        error, between = (
            self.scaled.problem.certain_error(point * self.scaled.to_r)
            for point in (r, (r + self.known) / 2)
        )
        return error <= SOLVED and (between > 100 * error or between <= SEGMENT)

    # ------------------------------------------------------------------ what is proved
    @property
    def parts(self) -> int:
        """Regions that were proved."""
        return len(self.proofs)

    @property
    def resolution(self) -> float:
        """Bound of the difference of reactions to those known, relative to the largest."""
        off = max((proof.distance for proof in self.proofs), default=0.0)
        return self.scaled.relative(off, self.known)

    @property
    def branches(self) -> tuple[LoadBranch, ...]:
        """The multipliers in the units of the problem: exact, units are powers of two."""
        boxes = [box_of(self.scaled, proof) for proof in self.proofs]
        return tuple(LoadBranch(box.letters.replace("l", BOTH_WAYS), box.V) for box in boxes)
