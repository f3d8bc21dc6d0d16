"""Large deformations as a path problem: what the paths over load and friction share.

`load_path` and `rubbing_path` say what changes with the parameter.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline, now
from ...core.errors import InvertedCells, NotConverged
from ...mechanics.contact.current import BACK, Pieces
from ...mechanics.model.large_deformation import LargeDeformation
from ...mechanics.model.moved_pairs import PairLinearisation
from ...mechanics.model.obstacle_linearisation import Linearisation
from ...mechanics.model.rubbed_between import without_rubbed
from ...problem.law.states import OPEN, SLIP, STICK
from ...problem.settling import settle
from ...problem.solution import ContactStatus, FrictionSolution, Outcome
from ...solvers.driver import drive
from .index_sets import IndexSets, index_sets
from .path import SOLVED, judged

Array = NDArray[np.float64]
Linear = Linearisation | PairLinearisation
ALIGNED = 1e-10  # residual that edges of facets of both sides leave where they coincide
BORDER = 1e-9  # distance to a border, in units of force, that counts as none
LETTERS = {2: "f+s-", 3: "fls"}  # of OPEN, SLIP, STICK, BACK as in `pattern`, by dimension


@dataclass(frozen=True, eq=False)
class LargePath(ABC):
    """A PathProblem in the displacements y (n,) of the free dofs and a parameter p.

    step: the problem at p = 1, without friction along what supports hold between two bodies.
    Residuals and margins are forces divided by `unit`, so that rounding is far below one.
    Letters of a pattern: f free, s stick, slip + or - along the tangent in 2D, l in 3D.
    """

    step: LargeDeformation
    name: ClassVar[str]

    def __post_init__(self) -> None:
        self.step.parts.check_tangent()
        object.__setattr__(self, "step", without_rubbed(self.step))

    @abstractmethod
    def at(self, p: float) -> LargeDeformation:
        """The problem at a value of the parameter."""

    @abstractmethod
    def by_parameter(self, here: Linear, pieces: Pieces | None) -> Array:
        """dF/dp, (n,), unit of force, of given (or the active) pieces at a linearisation."""

    @property
    def limit(self) -> Deadline:
        """The deadline of those who follow it, see `timed`."""
        return getattr(self, "deadline", NEVER)

    @property
    def moved(self) -> float:
        """The largest displacement prescribed on the way from p = 0 to 1."""
        return 0.0

    @property
    def kinds(self) -> NDArray[np.int8]:
        """The pieces that a contact has."""
        both = [OPEN, STICK, SLIP, BACK] if self.step.dimension == 2 else [OPEN, STICK, SLIP]
        return np.array(both, dtype=np.int8)

    @property
    def resolution(self) -> float:
        """Unit of the residual: facets whose edges coincide have no exact derivatives in 3D."""
        return ALIGNED if self.step.dimension == 3 and self.step.parts.has_pairs else 0.0

    # ---------------------------------------------------------------- PathProblem
    @cached_property
    def unit(self) -> float:
        """Force on a node where stresses are as large as moduli."""
        forces = np.concatenate([body.unit_forces() for body in self.step.parts.bodies])
        return float(np.sqrt((forces**2).mean()))

    @cached_property
    def weight(self) -> float:
        """kappa of the weighted norm: 1 / n in the unit of the prescribed displacement.

        At least a hundredth of the size of the bodies: of less, as in small steps, rounding
        of the positions would hide the last digits that the corrector waits for.
        """
        size = max(self.moved, 0.01 * float(np.ptp(self.step.parts.X, axis=0).max()))
        return 1.0 / (self.step.unknowns * size**2)

    def residual(self, y: Array, p: float) -> Array:
        """F, (n,), in units of force; infinite where cells are inverted."""
        return self._residual(y, p, None)

    def residual_of(self, piece: Hashable, y: Array, p: float) -> Array:
        """The selection function of a piece, (n,)."""
        return self._residual(y, p, self._states(piece))

    def _residual(self, y: Array, p: float, states: Pieces | None) -> Array:
        try:
            return self.at(p).residual(y, states) / self.unit
        except InvertedCells:
            return np.full(y.shape, np.inf)

    def remark(self, y: Array, p: float) -> str:
        """Why there are no forces at a state: the cell that is inverted; "" where there are."""
        try:
            self.at(p).residual(y)
        except InvertedCells as reason:
            return str(reason)
        return ""

    def jacobian(self, y: Array, p: float) -> tuple[sparse.csc_array, Array]:
        """dF/dy, (n, n), and dF/dp, (n,), of the active piece.

        Raises LinAlgError where cells are inverted.
        """
        return self._slopes(y, p, None)

    def jacobian_of(
        self, piece: Hashable, y: Array, p: float
    ) -> tuple[sparse.csc_array, Array]:
        """The same of a given piece."""
        return self._slopes(y, p, self._states(piece))

    def _slopes(
        self, y: Array, p: float, states: Pieces | None
    ) -> tuple[sparse.csc_array, Array]:
        self.limit.check()
        try:
            here = self.at(p).linearisation(y, states)
        except InvertedCells as reason:
            raise np.linalg.LinAlgError(str(reason)) from reason
        return here.matrix / self.unit, self.by_parameter(here, states) / self.unit

    def piece(self, y: Array, p: float) -> str:
        """The pattern of statuses, slip by the sign of the force."""
        return self._name(self.at(p).pieces(y))

    def pieces(self, y: Array, p: float, tolerance: float) -> list[str]:
        """All patterns that meet at a point: contacts near a border take both sides of it.

        tolerance: distance to a border that counts as none.
        """
        point = self.at(p).contact_point(y)
        kinds = self.kinds
        margins = [
            point.margins(np.full(self.step.contacts, kind)) / self.unit for kind in kinds
        ]
        fits = np.stack([margin.min(axis=1) >= -tolerance for margin in margins])
        fits |= point.pieces == kinds[:, None]
        return [self._name(np.array(s)) for s in product(*(kinds[own] for own in fits.T))]

    def margins(self, piece: Hashable, y: Array, p: float) -> Array:
        """Distances to the borders of a piece: all positive inside of it."""
        point = self.at(p).contact_point(y)
        return point.margins(self._states(piece)).ravel() / self.unit

    def index_sets(self, y: Array, p: float, tolerance: float = BORDER) -> IndexSets:
        """The sets of [LR] (25), of forces in units of `unit`."""
        point = self.at(p).contact_point(y)
        stick = np.full(self.step.contacts, STICK, dtype=np.int8)
        ahead, behind = point.margins(stick)[:, 1:].T / self.unit
        without = np.isinf(ahead)  # no friction
        normal, bound = point.z_normal / self.unit, np.where(without, 0, ahead + behind) / 2
        along = np.abs(np.where(without, 0, ahead - behind)) / 2
        return index_sets(normal, along, np.maximum(bound, 0), without, tolerance)

    def _name(self, states: NDArray) -> str:
        return "".join(LETTERS[self.step.dimension][state] for state in states)

    def _states(self, piece: Any) -> NDArray[np.int8]:
        letters = LETTERS[self.step.dimension]
        return np.array([letters.index(letter) for letter in piece], dtype=np.int8)

    # ---------------------------------------------------------------- solutions
    def solution(self, y: Array, p: float) -> FrictionSolution:
        """The point as a solution of its tangent problem, with the judge's error."""
        problem, began = self.at(p), now()
        u = problem.local_velocity(y)
        told = settle(problem.law_at(y), problem.rho, problem.reactions(y), u)
        error = problem.error(told.r, y)
        record = judged(error, problem.measure, now() - began)
        tangent = problem.recover(told.r, y)[0]
        return FrictionSolution(tangent, told.r, u, np.array(y), record, settled=told)

    def found_at(self, p: float) -> Array:
        """A solution (n,) at a value of the parameter, by Newton's method with load steps.

        Raises NotConverged where it finds none.
        """
        found = drive(self.at(p), tolerance=SOLVED, time_limit=self.limit)
        if found.convergence.outcome is not Outcome.CONVERGED:
            raise NotConverged(f"start: no solution at {p:g}: {found.convergence}", found)
        assert found.v is not None
        return found.v

    # ---------------------------------------------------------------- tables
    def describe(self, y: Array, p: float) -> dict[str, Any]:
        """Counts of statuses and the resultant of the contact forces, for tables."""
        problem = self.at(p)
        point = problem.contact_point(y)
        states = point.pieces
        counts = {
            ContactStatus.OPEN: states == OPEN,
            ContactStatus.SLIP: (states == SLIP) | (states == BACK),
            ContactStatus.STICK: states == STICK,
        }
        total = point.force.sum(axis=0)
        return {
            **{status.name.lower(): int(mask.sum()) for status, mask in counts.items()},
            **{f"resultant_{axis}": float(f) for axis, f in zip("xyz", total, strict=False)},
        }
