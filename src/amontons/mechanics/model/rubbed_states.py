"""Newton's method where friction between bodies acts along components that supports hold.

lambda_H of `contact.dragged` follows the motion s_H steeply where contacts stick, by springs
that give way by little, and of slip it knows the sign alone: Newton's steps in displacements
would go from slip to slip the other way, to and fro.  So lambda_H moves with v as if it were an
unknown, with the law's row for it: with R that law and F the rows of v,

    F(v, lambda_H) = 0,    R_H(v, lambda_H) = 0,
    d lambda_H = -R_HH^-1 (R_H + R_Hv dv),
    (F_v - F_H R_HH^-1 R_Hv) dv = -(F - F_H R_HH^-1 R_H),                                   (1)

and the pieces of the law are those of lambda_H and s_H together, which have stick between slip
and slip.  R_HH is block diagonal, and never singular: 1 where contacts slip or are open, GIVE
where they stick.  Steps are judged by what (1) asks for at the state that they lead to, F and
R_H of there, all derivatives those of here, as the natural test has it of any system: with the
derivatives of there it would hear 1 / GIVE of R_H where contacts come to stick.

Which contacts slip which way hangs together: steps begin at the solution of the tangent
problem with contact, which finds it in some hundred cheap iterations at most; from other signs
they go to and fro.

The coefficients c of the pressures of hybrid cells, if any, move with both, as `PressureStates`
has it: with c of v alone volumes follow every change of lambda_H by forces that steps undo.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...solvers.newton.states import Linear
from .moved_pairs import PairLinearisation
from .pressure_states import Reduced

if TYPE_CHECKING:
    from .large_deformation import LargeDeformation

Array = NDArray[np.float64]


class RubbedStates:
    """States w = [v, c, lambda_H] of a problem, as in `PlainStates`.

    known: problem and state whose first-order change gives the first pressures; the first
    lambda_H is that of v, of which predictors know the slips.
    """

    def __init__(
        self, problem: LargeDeformation, v: Array, known: tuple[LargeDeformation, Array] | None
    ) -> None:
        self.problem, parts = problem, problem.parts
        rubbed = parts.contact.rubbed
        assert rubbed is not None
        self._rubbed, self._volumes = rubbed, any(parts.keeps_volume)
        moved, pressures, needed = problem.displacement(v), np.zeros(0), None
        if self._volumes:
            now, old = (problem, v) if known is None else known
            u = now.displacement(old)
            pressures = parts.pressures(u, moved - u)
            needed = problem._needed(moved, pressures)
        held = problem._point(moved, needed=needed)[0].force[rubbed]
        self._ends = np.cumsum([len(v), len(pressures)])
        self.start = np.concatenate([v, pressures, held])

    def v(self, w: Array) -> Array:
        """The displacements of the free dofs, (n,)."""
        return w[: self._ends[0]]

    def _parted(self, w: Array) -> tuple[Array, Array | None, Array]:
        """v (n,), c, None for no hybrid cells, and lambda_H (nc, d)."""
        v, c, force = np.split(w, self._ends)
        held = np.zeros(self._rubbed.shape)
        held[self._rubbed] = force
        return v, c if self._volumes else None, held

    def _both(self, v: Array, c: Array | None, held: Array) -> tuple[Array, Array]:
        """F (n,) at pressures c, or those of v, and the law at contacts, (nc, d)."""
        problem = self.problem
        u = problem.displacement(v)
        needed = None if c is None else problem._needed(u, c)
        point, rest = problem._point(u, needed=needed, held=held)
        rest[problem.parts.at] = law = point.residual()
        return rest[problem.parts.free], law

    def residual(self, w: Array) -> Array:
        """Forces out of balance (n,), errors of the volume as forces, (c,), and R_H."""
        v, c, held = self._parted(w)
        balance, law = self._both(v, c, held)
        missed = law[self._rubbed]
        if c is None:
            return np.concatenate([balance, missed])
        u, parts = self.problem.displacement(v), self.problem.parts
        right = parts.pressures(u, np.zeros_like(u))
        return np.concatenate([balance, parts.pressure_forces * (c - right), missed])

    def reactions(self, w: Array) -> Array:
        """Contact forces, (nc, d), with lambda_H."""
        v, _, held = self._parted(w)
        return self.problem.reactions(v, held)

    def missing(self, w: Array) -> Array:
        """The right side of (1) with slopes of the last linearisation, (n,), and c of v."""
        v, _, held = self._parted(w)
        balance, law = self._both(v, None, held)
        return balance + self._here.with_held(law)

    def linearisation(self, w: Array) -> Linear:
        """What is left of the tangent at a state when c and lambda_H are eliminated."""
        v, c, held = self._parted(w)
        here = self.problem.linearisation(v, pressures=c, held=held)
        assert isinstance(here, PairLinearisation)
        self._here, self._missing = here, np.zeros(len(here.rest))
        if c is None:
            return here  # type: ignore[return-value]  # a cached matrix serves as well
        parts = self.problem.parts
        self._missing = parts.forces(here.u) - parts.forces(here.u, c)
        return Reduced(here.matrix, here.residual + here.passed(self._missing), here)

    def size(self, w: Array, here: Linear) -> float:
        """|residual(w)|."""
        return float(np.linalg.norm(self.residual(w)))

    def whole(self, w: Array, step: Array) -> Array:
        """The step of all of w with a step (n,) of v; w: where the last linearisation was."""
        here, (v, c, _) = self._here, self._parted(w)
        moved = self.problem.displacement(v + step) - here.u
        force = here.followed(moved.ravel(), self._missing)[self._rubbed]
        if c is None:
            return np.concatenate([step, force])
        return np.concatenate([step, self.problem.parts.pressures(here.u, moved) - c, force])
