"""Energy balance of a step.

With v_theta = theta v1 + (1 - theta) v0 and dq = h v_theta, a step of the theta method obeys

    gain of kinetic + elastic = loads + supports + r . u_theta - damping - lost,
    lost = (theta - 1/2) (|v1 - v0|_M^2 + |q1 - q0|_K^2) >= 0,                              (1)

r being the impulses of contact.  Part of `lost` is what their jump loses: a ball that stops
dead does no work on u_theta = u1 = 0 with theta = 1, and still its energy is gone.  Theirs is

    contact = r . (u0 + u1) / 2,    numerical = lost - (theta - 1/2) r . (u1 - u0),         (2)

the work of an impulse in the classical theory of impacts: -(1 - e^2) m v^2 / 2 for a rigid body
and a restitution e, whatever theta.  contact - numerical is never positive.

A quasi-static step, with the forces K q = load + held + H r before and after, obeys

    gain of elastic = (f0 + f1) / 2 . dq,    f = load + held + H r,                         (3)

exactly for linear elasticity: loads and supports are booked by their means, as they grow along
a straight line.  Friction is booked with its force at the end, contact = r1_T . du_T <= 0, as
the law of the step has it, and a normal force does no work.  So

    numerical = (r1_T - r0_T) . du_T / 2 - (r0_N + r1_N) . du_N / 2                         (4)

is what the straight line misses of the path: zero where contacts stay closed and stick, slide
under a constant force, or have no friction; else of either sign, and, but for what a jump sets
free, of second order in the step.  At finite strains (3) has the mean of the inner forces, and
the rest of the gain, of third order, is part of `numerical`.

All balances hold up to the residual of the contact solve, which `defect` holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Energies:
    """Energies at the end of a step, and works within it, all in the unit of work.

    loads, supports: work done on the bodies.  contact: work of all contacts and impacts, lost
    where negative.  damping: dissipated, never negative.  numerical: lost in the time scheme,
    see `energy`; what contact may create at an impact, numerical loses.  gain: of kinetic +
    elastic.
    """

    kinetic: float = 0.0
    elastic: float = 0.0
    gain: float = 0.0
    loads: float = 0.0
    supports: float = 0.0
    contact: float = 0.0
    damping: float = 0.0
    numerical: float = 0.0

    @property
    def total(self) -> float:
        """Kinetic and elastic energy at the end."""
        return self.kinetic + self.elastic

    @property
    def created(self) -> float:
        """What contact and scheme add to the energy of a step of dynamics: never positive."""
        return self.contact - self.numerical

    @property
    def defect(self) -> float:
        """What the balance misses: zero but for the tolerance of the solve."""
        works = self.loads + self.supports + self.contact - self.damping - self.numerical
        return self.gain - works

    @property
    def turnover(self) -> float:
        """Size of what the balance sums up, to compare the defect with."""
        parts = (self.gain, self.loads, self.supports, self.contact, self.damping,
                 self.numerical)  # fmt: skip
        return sum(abs(part) for part in parts)


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces (dofs,) on all dofs at one end of a quasi-static step, and the stored energy.

    inner: those that the bodies need; load: external ones; pushed: those of contact.
    """

    inner: Array
    load: Array
    pushed: Array
    elastic: float


def slow_energies(
    before: Forces, after: Forces, dq: Array, fixed: Index, friction: float
) -> Energies:
    """The balance (3), (4) of a quasi-static step that moves the dofs by dq (dofs,).

    The load before is the one that the state balances, whatever was said of that time: a load
    that is there at once grows along the step.  fixed: prescribed dofs; friction: r1_T . du_T.
    """
    balanced = before.inner - before.pushed
    load = balanced.copy()
    load[fixed] = before.load[fixed]
    held = np.zeros_like(dq)
    held[fixed] = (balanced - load + after.inner - after.load - after.pushed)[fixed]
    gain = after.elastic - before.elastic
    path = 0.5 * (before.inner + after.inner) @ dq - gain  # zero for linear elasticity
    pushed = 0.5 * (before.pushed + after.pushed) @ dq
    return Energies(
        elastic=after.elastic, gain=gain, loads=float(0.5 * (load + after.load) @ dq),
        supports=float(0.5 * held @ dq), contact=friction,
        numerical=float(path + friction - pushed),
    )  # fmt: skip
