"""Large deformations as a path problem: from one load to another, with the memory between.

Loads and prescribed displacements go linearly from those at p = 0 to those of the step at
p = 1, and the motion that friction speaks of loses its drift,

    load (1 - p) load_0 + p load_1,   s = x - x_before + (1 - p) V,                         (1)

the continuation problem of [LR] section 3: at p = 0 a solution of the last step solves it, with
V the motion of that step where the steps are equally long, and at p = 1 it is the next step.
V = 0 gives the static problem under a growing load.  2D, as slip has two senses there.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline, now
from ...core.errors import InvertedCells, NotConverged, UnsupportedForm, UnsupportedLaw
from ...mechanics.contact.current import BACK, Pieces
from ...mechanics.model import Model
from ...mechanics.model.large_deformation import LargeDeformation, large_step
from ...mechanics.model.nodal_forces import NodalForces
from ...mechanics.steps.system import Motion
from ...problem.law import Coulomb
from ...problem.law.states import OPEN, SLIP, STICK
from ...problem.settling import settle
from ...problem.solution import ContactStatus, FrictionSolution, Outcome
from ...solvers.driver import drive
from .index_sets import IndexSets, index_sets
from .path import SOLVED, judged

Array = NDArray[np.float64]
BORDER = 1e-9  # distance to a border, in units of force, that counts as none
LETTERS = np.array(["f", "+", "s", "-"])  # of OPEN, SLIP, STICK, BACK as in `pattern`


@dataclass(frozen=True, eq=False)
class LoadPath:
    """A PathProblem in the displacements y (n,) of the free dofs and the share p of the load.

    step: the problem at p = 1; load, prescribed (dofs,): those at p = 0, loads that follow the
    body as `NodalForces`; drift (nc, d): V.
    Residuals and margins are forces divided by `unit`, so that rounding is far below one.
    """

    step: LargeDeformation
    load: NodalForces | Array
    prescribed: Array
    drift: Array | None = None
    deadline: Deadline = NEVER  # of those who follow it, see `timed`
    name: ClassVar[str] = "load"

    def __post_init__(self) -> None:
        if not isinstance(self.step.law, Coulomb):
            raise UnsupportedLaw(f"path: expected Coulomb friction, got {self.step.law.name}")
        if self.step.dimension != 2:
            raise UnsupportedForm("path: expected a model in 2D, this one is in 3D")
        if self.drift is None:
            object.__setattr__(self, "drift", np.zeros_like(self.step.drift))

    def at(self, p: float) -> LargeDeformation:
        """The problem at a share p of the load."""
        step = self.step
        return replace(
            step,
            load=self.load + p * (step.load - self.load),
            prescribed=self.prescribed + p * (step.prescribed - self.prescribed),
            drift=step.drift + (1 - p) * self.drift,  # type: ignore[operator]
        )

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
        moved = float(np.abs(self.step.prescribed - self.prescribed).max(initial=0.0))
        size = max(moved, 0.01 * float(np.ptp(self.step.parts.X, axis=0).max()))
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
        self.deadline.check()
        step = self.step
        try:
            here = self.at(p).linearisation(y, states)
        except InvertedCells as reason:
            raise np.linalg.LinAlgError(str(reason)) from reason
        change = here.shifted(
            step.load - self.load,
            step.prescribed - self.prescribed,
            -self.drift,  # type: ignore[operator]
        )
        return here.matrix / self.unit, change / self.unit

    def piece(self, y: Array, p: float) -> str:
        """The pattern of statuses: f free, s stick, slip + or -, from the sign of the force."""
        return self._name(self.at(p).pieces(y))

    def pieces(self, y: Array, p: float, tolerance: float) -> list[str]:
        """All patterns that meet at a point: contacts near a border take both sides of it.

        tolerance: distance to a border that counts as none.
        """
        point = self.at(p).contact_point(y)
        kinds = np.array([OPEN, STICK, SLIP, BACK], dtype=np.int8)
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

    @staticmethod
    def _name(states: NDArray) -> str:
        return "".join(LETTERS[states])

    @staticmethod
    def _states(piece: Any) -> NDArray[np.int8]:
        return np.array(["f+s-".index(letter) for letter in piece], dtype=np.int8)

    # ---------------------------------------------------------------- solutions
    def solution(self, y: Array, p: float) -> FrictionSolution:
        """The point as a solution of its tangent problem, with the judge's error."""
        problem, began = self.at(p), now()
        u = problem.local_velocity(y)
        told = settle(problem.law, problem.rho, problem.reactions(y), u)
        error = problem.error(told.r, y)
        record = judged(error, problem.measure, now() - began)
        tangent = problem.recover(told.r, y)[0]
        return FrictionSolution(tangent, told.r, u, np.array(y), record, settled=told)

    def found_at(self, p: float) -> Array:
        """A solution (n,) at a share of the load, by Newton's method with load steps.

        Raises NotConverged where it finds none.
        """
        found = drive(self.at(p), tolerance=SOLVED, time_limit=self.deadline)
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


def load_path(model: Model, interval: tuple[float, float]) -> LoadPath:
    """A model in large deformations over its load.

    Loads and supports that depend on the time t are taken at t, and have to be straight lines
    in it; where none does, all of them grow with the parameter as load factor.  Friction speaks
    of the motion from the undeformed state.
    """
    motion = Motion(model)
    if not motion.is_timed:
        interval = (0.0, 1.0)
    a, b = interval
    lines = []
    for first, last in zip(*motion.straight(interval, "follow it in parts"), strict=True):
        slope = (last - first) / (b - a)
        lines.append((first - a * slope, first + (1 - a) * slope))
    (load_0, load_1), (prescribed_0, prescribed_1) = lines
    return LoadPath(large_step(motion.body, load_1, prescribed_1), load_0, prescribed_0)
