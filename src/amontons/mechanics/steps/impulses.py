"""What the law of impulses adds to velocities: restitution, or what creates less energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .springs import Springs

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TRIES = 3  # times that restitution is made smaller before the law on u_theta replaces it
ENOUGH = 1.05  # times what a first-order estimate says that takes
ROUNDING = 1e-10  # of what a contact gives and takes: it creates no energy below


@dataclass(frozen=True, eq=False)
class Shifts:
    """What is added to u1 in the law of the active contacts, (k, d).

    before (k, d): u0; opening (k,): gap over h, of open contacts; theta; restitution: that of
    contacts with the law on u1; on_mean (k,): those with the law on u_theta; springs: contacts
    that give way, gap (k,) and pulled (k, d), forces at first, over theta h; tied (k,);
    tries: how often restitution was made smaller.
    """

    before: Array
    opening: Array
    theta: float
    restitution: float
    on_mean: Mask
    springs: Springs
    gap: Array
    pulled: Array
    tied: Mask
    tries: int = 0

    @classmethod
    def of(
        cls, before: Array, gap: Array, method: Any, springs: Springs, pulled: Array,
        tied: Mask,
    ) -> Shifts:  # fmt: skip
        """Those of a step of `MoreauJean` from u0 (k, d), gaps (k,) and forces (k, d)."""
        none = np.zeros(len(before), dtype=bool)
        opening = np.maximum(gap, 0) / method.step if method.reach else np.zeros(len(gap))
        end = method.theta * method.step
        return cls(before, opening, method.theta, method.restitution, none, springs, gap / end,
                   pulled / end, tied)  # fmt: skip

    @property
    def values(self) -> Array:
        """(k, d), unit of velocity."""
        out = np.zeros_like(self.before)
        out[:, 0] = self.restitution * self.before[:, 0]
        mean = (1 - self.theta) / self.theta * self.before
        out = np.where(self.on_mean[:, None], mean, out)
        # gap at the end >= 0: u1 >= -(gap + (1 - theta) h u0) / (theta h)
        is_open = self.opening > 0
        out[is_open, 0] = (self.opening / self.theta + mean[:, 0])[is_open]
        out[self.tied] = 0.0  # u1 = 0
        return self.springs.shifted(out, mean, self.gap, self.pulled)

    def changed(self, r: Array, after: Array, excess: float) -> Shifts | None:
        """Laws that create less than r and u1 = after, (k, d), did by `excess`; None: no other.

        First those on u_theta for contacts that create energy by themselves, then a smaller
        restitution, then the law on u_theta for all that do work on it.
        """
        own = (r * (self.before + after)).sum(axis=1)
        size = (np.abs(r) * (np.abs(self.before) + np.abs(after))).sum(axis=1)
        creating = own > ROUNDING * size  # with restitution 1 it is zero but for rounding
        if (creating & ~self.on_mean).any():
            return replace(self, on_mean=self.on_mean | creating)
        impact = (self.before[:, 0] < 0) & ~self.on_mean & ~self.springs.presses
        power = float(r[impact, 0] @ -self.before[impact, 0])
        e = self.restitution
        if e > 0 and power > 0 and self.tries < TRIES:
            # impacts take (1 - e) power / 2, power ~ 1 + e: with e it changes by this slope
            smaller = max(0.0, e - ENOUGH * excess * (1 + e) / (e * power))
            return replace(self, restitution=smaller, tries=self.tries + 1)
        mean = self.theta * after + (1 - self.theta) * self.before
        working = (r * mean).sum(axis=1) > 0
        if (working & ~self.on_mean).any():
            return replace(self, on_mean=self.on_mean | working)
        return None
