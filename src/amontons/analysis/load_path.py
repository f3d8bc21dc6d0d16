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
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..cones import Coulomb
from ..contact.current import BACK, OPEN, SLIP, STICK, Pieces
from ..errors import InvertedCells, UnsupportedForm
from ..model.large_deformation import LargeDeformation
from ..solution import ContactStatus

Array = NDArray[np.float64]
LETTERS = np.array(["f", "s", "+", "-"])  # of OPEN, STICK, SLIP, BACK as in `pattern`


@dataclass(frozen=True, eq=False)
class LoadPath:
    """A PathProblem in the displacements y (n,) of the free dofs and the share p of the load.

    step: the problem at p = 1; load, prescribed (dofs,): those at p = 0; drift (nc, d): V.
    """

    step: LargeDeformation
    load: Array
    prescribed: Array
    drift: Array | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.step.law, Coulomb):
            raise UnsupportedForm("path: expected Coulomb friction, this model has Tresca's")
        if self.step.dimension != 2:
            raise UnsupportedForm("path: expected a model in 2D, this one is in 3D")
        if self.drift is None:
            object.__setattr__(self, "drift", np.zeros_like(self.step.before))

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
    def residual(self, y: Array, p: float) -> Array:
        """F, (n,), unit of force; infinite where cells are inverted."""
        return self._residual(y, p, None)

    def residual_of(self, piece: Hashable, y: Array, p: float) -> Array:
        """The selection function of a piece, (n,)."""
        return self._residual(y, p, self._states(piece))

    def _residual(self, y: Array, p: float, states: Pieces | None) -> Array:
        try:
            return self.at(p).residual(y, states)
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
        step = self.step
        try:
            here = self.at(p).linearisation(y, states)
        except InvertedCells as reason:
            raise np.linalg.LinAlgError(str(reason)) from reason
        return here.matrix, here.shifted(
            step.load - self.load,
            step.prescribed - self.prescribed,
            -self.drift,  # type: ignore[operator]
        )

    def piece(self, y: Array, p: float) -> str:
        """The pattern of statuses: f free, s stick, slip + or -, from the sign of the force."""
        return self._name(self.at(p).pieces(y))

    def pieces(self, y: Array, p: float, tolerance: float) -> list[str]:
        """All patterns that meet at a point: contacts near a border take both sides of it.

        tolerance: distance to a border, unit of force, that counts as none.
        """
        point = self.at(p).contact_point(y)
        choices = []
        for k, own in enumerate(point.pieces):
            near = [own]
            for other in (OPEN, STICK, SLIP, BACK):
                states = point.pieces.copy()
                states[k] = other
                if other != own and point.margins(states)[k].min() >= -tolerance:
                    near.append(other)
            choices.append(near)
        return [self._name(np.array(states)) for states in product(*choices)]

    def margins(self, piece: Hashable, y: Array, p: float) -> Array:
        """Distances to the borders of a piece, unit of force: all positive inside of it."""
        return self.at(p).contact_point(y).margins(self._states(piece)).ravel()

    @staticmethod
    def _name(states: NDArray) -> str:
        return "".join(LETTERS[states])

    @staticmethod
    def _states(piece: Any) -> NDArray[np.int8]:
        return np.array(["fs+-".index(letter) for letter in piece], dtype=np.int8)

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
