"""Newton's method for bodies whose hybrid cells keep their volume: pressures are unknowns, too.

A step that is right to first order leaves an error of second order in the volume of cells.
Near incompressibility it costs a pressure that is no part of the answer, and the next tangent
would be that of a body under this pressure.  So the coefficients c of the pressures move with
the displacements v as if both were unknowns (`elements.hybrid` has b and N, c* belongs to v),

    f(v, c) = load,    c = c*(v),    dc = c*(v) - c + N b . dv,

and elimination of dc leaves the usual matrix, with the pressures c in its geometric part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.condensed import Structure
from ...solvers.newton.states import Linear
from .moved_pairs import PairLinearisation
from .obstacle_linearisation import Linearisation

if TYPE_CHECKING:
    from .large_deformation import LargeDeformation

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reduced(Linear):
    """The linear problem of a step of v: matrix (n, n), residual (n,); here: its state."""

    matrix: sparse.csc_array
    residual: Array
    here: Linearisation | PairLinearisation

    @property
    def structure(self) -> Structure:
        """What the matrix consists of."""
        return self.here.structure


class PressureStates:
    """States w = [v, c] of a problem, as in `PlainStates`.

    known: problem and state whose first-order change gives the first pressures.
    """

    def __init__(
        self, problem: LargeDeformation, v: Array, known: tuple[LargeDeformation, Array] | None
    ) -> None:
        self.problem, self._size = problem, len(v)
        now, old = (problem, v) if known is None else known
        u = now.displacement(old)
        change = problem.displacement(v) - u
        self.start = np.concatenate([v, problem.parts.pressures(u, change)])

    def v(self, w: Array) -> Array:
        """The displacements of the free dofs, (n,)."""
        return w[: self._size]

    def residual(self, w: Array) -> Array:
        """Forces out of balance (n,), and errors of the volume weighed as forces, (c,)."""
        v, c = w[: self._size], w[self._size :]
        u, parts = self.problem.displacement(v), self.problem.parts
        right = parts.pressures(u, np.zeros_like(u))
        balance = self.problem.residual(v, pressures=c)
        return np.concatenate([balance, parts.pressure_forces * (c - right)])

    def reactions(self, w: Array) -> Array:
        """Contact forces, (nc, d)."""
        return self.problem.reactions(self.v(w))

    def missing(self, w: Array) -> Array:
        """F (n,) with the pressures of v."""
        return self.problem.residual(self.v(w))

    def linearisation(self, w: Array) -> Reduced:
        """What is left of the tangent at a state when the pressures are eliminated."""
        v, c = w[: self._size], w[self._size :]
        here = self.problem.linearisation(v, pressures=c)
        parts = self.problem.parts
        missing = parts.forces(here.u) - parts.forces(here.u, c)
        return Reduced(here.matrix, here.residual + here.passed(missing), here)

    def size(self, w: Array, here: Linear) -> float:
        """|residual(w)|: that of `here` contains pressures that volumes do not ask for."""
        return float(np.linalg.norm(self.residual(w)))

    def whole(self, w: Array, step: Array) -> Array:
        """The step of all of w with a step (n,) of v."""
        v, c = w[: self._size], w[self._size :]
        u = self.problem.displacement(v)
        change = self.problem.displacement(v + step) - u
        return np.concatenate([step, self.problem.parts.pressures(u, change) - c])
