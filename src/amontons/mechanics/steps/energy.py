"""Energy balance of a step.

With v_theta = theta v1 + (1 - theta) v0 and dq = h v_theta, a step of the theta method obeys

    gain of kinetic + elastic = loads + supports + r . u_theta - damping - lost,
    lost = (theta - 1/2) (|v1 - v0|_M^2 + |q1 - q0|_K^2) >= 0,                              (1)

r being the impulses of contact.  Part of `lost` is what their jump loses: where a ball stops
dead, no work is done on u_theta = u1 = 0 with theta = 1, and still its energy is gone.  So

    contact = r . u_theta - x,    numerical = lost - x,    x = (theta - 1/2) r . (u1 - u0), (2)

contact being r . (u0 + u1) / 2, the work of an impulse in the classical theory of impacts:
-(1 - e^2) m v^2 / 2 for a rigid body and a restitution e, whatever theta.  Loads and waves
within the step shift that a little; x is cut off at r . u_theta and at `lost`, so that contact
is never positive and numerical never negative.  There is such an x where r . u_theta <= lost,
which is what every step is made to obey: contact and scheme together create no energy.

A quasi-static step, with the forces K q = load + held + H r before and after, obeys

    gain of elastic = (f0 + f1) / 2 . dq,    f = load + held + H r,                         (3)

exactly for linear elasticity: works are booked by the means of both forces, as they grow along
a straight line.  For contact this is

    mean = (r0 + r1) . du / 2,                                                              (4)

the true work where both grow in proportion or stay.  Contact by contact, only the tangential
part is booked, as nothing does work along the normal; and where it is more than the force at
the end says, r1_T . du_T <= 0 (the pressure has fallen), or positive (friction has turned round
within the step), that force alone is booked (`rubbing`).  With the sum, contact = friction,

    numerical = friction - mean                                                             (5)

is what the straight line misses of the path: zero without friction or slip while contacts stay
closed; else of second order in the step, but for what a jump sets free.  Negative says that
the loads did more work than their means tell: take smaller steps.  In large deformations (3)
has the mean of the inner forces, and the rest of the gain, of third order, is part of
`numerical`; so is what loads that follow the body do beyond the mean of their ends, which the
work of the loads contains.

All balances hold up to the residual of the contact solve, which `defect` holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
TOLERATED = 1e-7  # work of contact, relative to all of the step, that is the solve's error


@dataclass(frozen=True)
class Energies:
    """Energies at the end of a step, and works within it, all in the unit of work.

    loads, supports: work done on the bodies.  elastic: with that of contacts which give way.
    contact: work of all contacts and impacts but for what they store so, never positive.
    damping: dissipated, never negative.  numerical: lost in the time scheme, never negative in
    dynamics but for springs of contacts on areas that grow, in quasi-static steps what a
    straight line misses.  gain: of kinetic + elastic.
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

    inner: those that the bodies need; load: external ones; pushed: those of contact; springs:
    energy that contacts which give way store.
    """

    inner: Array
    load: Array
    pushed: Array
    elastic: float
    springs: float = 0.0


def slow_energies(  # noqa: PLR0913
    before: Forces, after: Forces, dq: Array, fixed: Index, friction: float,
    path: float = 0.0, bend: float = 0.0,
) -> Energies:  # fmt: skip
    """The balance (3) to (5) of a quasi-static step that moves the dofs by dq (dofs,).

    The load before is the one that the state balances, whatever was said of that time: a load
    that is there at once grows along the step.  fixed: prescribed dofs; friction: work of
    friction on the bodies;
    path: `path_work` of large deformations; bend: work of loads beyond that of their mean.
    """
    balanced = before.inner - before.pushed
    load = balanced.copy()
    load[fixed] = before.load[fixed]
    held = np.zeros_like(dq)
    held[fixed] = (balanced - load + after.inner - after.load - after.pushed)[fixed]
    stored = after.springs - before.springs
    gain = after.elastic - before.elastic + stored
    works = {"loads": 0.5 * (load + after.load) @ dq + bend, "supports": 0.5 * held @ dq}
    mean = 0.5 * (before.pushed + after.pushed) @ dq + stored  # that on u', see `springs`
    size = abs(gain) + sum(map(abs, works.values()))
    contact = friction if abs(friction - mean) > TOLERATED * size else float(mean)
    return Energies(elastic=after.elastic + after.springs, gain=gain, contact=contact,
                    numerical=float(path + bend + contact - mean),
                    **{name: float(work) for name, work in works.items()})  # fmt: skip


def path_work(before: Forces, after: Forces, dq: Array) -> float:
    """What the mean of the inner forces does beyond the stored energy, of third order in dq."""
    mean = 0.5 * (before.inner + after.inner)
    return float(mean @ dq - (after.elastic - before.elastic))
