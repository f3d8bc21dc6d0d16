"""Contacts that give way, from step to step: what their springs remember and store.

With a compliance C of the contacts (`problem.law.compliant`) the part of the displacement that
stays is u' = u + C r, r being forces.  Friction speaks of the change of u'_T, so the stick
spring of a contact remembers where it was by the last slip and force: no other state is needed.
Where a contact opens, r = 0, the spring is free and u'_T = u_T from then on.

As r . du = r . du' - r . C dr, the works of the contacts fall apart into those on u', which are
never positive, and the energy r . C r / 2 that springs store.

In dynamics the law of a spring is that of the end of the step, with q1 = q0 + h u_theta,

    0 <= gap0 + h u_theta_N + c r_N / h  ⟂  r_N >= 0     for impulses r,
    r_T opposes h u_theta_T + c_T (r_T / h - f0_T),   f0 the force of the last step,

which are laws of u1 as others: divided by theta h.  It is implicit Euler for the springs: their
energy being convex, none is created, also where contacts close, open or slide; a bounce loses
some of it, of the order of h sqrt(k / m).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...problem.law import Compliant, Law, VaryingCompliance, VaryingFriction

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Springs:
    """C of contacts, rows (nc, d) of its diagonal, length per force; zero where rigid.

    curves: the law with curves of pressure over overclosure, None where all are straight; C is
    then what it is as pressure begins.
    """

    C: Array
    curves: VaryingCompliance | None = None

    @classmethod
    def of(cls, law: Law, d: int) -> Springs:
        """Those of a law of forces."""
        give = np.zeros((len(law), 3)) if law.give is None else law.give
        return cls(give[:, :d], law if isinstance(law, VaryingCompliance) else None)

    def at(self, contacts: Index) -> Springs:
        """Those of a selection of contacts, (k,)."""
        curves = None if self.curves is None else self.curves.at(contacts)
        return Springs(self.C[contacts], curves)

    @property
    def presses(self) -> Mask:
        """Contacts whose pressure follows from their overclosure, (nc,)."""
        return self.C[:, 0] > 0

    @property
    def sticks(self) -> Mask:
        """Contacts that stick elastically, (nc,)."""
        return self.C[:, 1] > 0

    def remembered(self, slip: Array, force: Array) -> Array:
        """u'_T, (nc, d-1), of a state with tangential displacements slip (nc, d-1)."""
        return slip + self.C[:, 1:] * force[:, 1:]

    def energy(self, force: Array) -> float:
        """r . C r / 2 of forces (nc, d), along curves what they store."""
        stored = 0.5 * self.C * force**2
        if self.curves is not None:
            stored[:, 0] = np.where(
                self.curves.curved, self.curves.energy(force), stored[:, 0]
            )
        return float(stored.sum())

    def slipped(self, du: Array, before: Array, after: Array) -> Array:
        """du'_T, (nc, d-1), of motions du and forces of both ends of a step, (nc, d) each."""
        return (du + self.C * (after - before))[:, 1:]

    def taken(self, before: Array, after: Array) -> Array:
        """What stick springs store more at the end of a step, (nc,), of forces (nc, d)."""
        return 0.5 * (self.C * (after**2 - before**2))[:, 1:].sum(axis=1)

    # ---------------------------------------------------------------- dynamics
    def of_impulses(self, law: Law, h: float, theta: float) -> Law:
        """The law of impulses r and velocities u1 of a step h, see the module."""
        if isinstance(law, VaryingFriction):  # u_theta is theta of the u that the law has
            inner, own = self.of_impulses(law.inner, h, theta), self.presses | self.sticks
            return VaryingFriction(
                law.curve, law.area * h, np.where(own, 1 / theta, 1.0), inner, law.pieces
            )
        scaled = law.scaled(h)
        if isinstance(scaled, VaryingCompliance):
            inner = self.of_impulses(law.inner, h, theta)  # type: ignore[attr-defined]
            return replace(scaled, law=inner, length=scaled.length * theta * h)
        if not isinstance(scaled, Compliant):
            return scaled
        own = scaled.compliance, scaled.stick_compliance, scaled.offset
        return Compliant(scaled.law, *(c / (theta * h) for c in own))

    def shifted(self, shifts: Array, mean: Array, open_: Array, stretch: Array) -> Array:
        """What is added to u1 in the law, (nc, d): `shifts` but for what springs do.

        mean: what makes u1 to u_theta; open_ (nc,): gap0 / (theta h); stretch (nc, d): forces
        of the last step over theta h.
        """
        out, presses = shifts.copy(), self.presses
        out[presses] = mean[presses]
        out[presses, 0] += open_[presses]
        sticks = self.sticks
        out[sticks, 1:] = (mean - self.C * stretch)[sticks, 1:]
        return out
