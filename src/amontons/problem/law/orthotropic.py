"""Orthotropic friction: mu_1 along one tangent, mu_2 across, and slip normal to the ellipse.

    0 <= u_N  ⟂  r_N >= 0;    (r_T1 / mu_1)^2 + (r_T2 / mu_2)^2 <= r_N^2,
    u_T = -lambda (r_T1 / mu_1^2, r_T2 / mu_2^2),  lambda >= 0, zero inside of the ellipse

in the principal directions, which a frame turned by `angle` about n has: rolled, brushed or
ground surfaces, fibres, wood.  The sliding rule is the *associated* one, of largest dissipation
under the pressure: slip is normal to the ellipse.  It is opposite to r_T along the principal
directions only; a body pulled at another angle drifts towards the direction that is easier.
Laws whose slip opposes r_T, or with another ellipse for slip, are others ([MS], [Z]).

With D = diag(mu_1, mu_2), mu = sqrt(mu_1 mu_2), T = D / mu turned by the angle:

    r_T = T s_T:     |D^-1 r_T| <= r_N            is  |s_T| <= mu s_N
    u_T' = T u_T:    u_T = -lambda D^-2 r_T       is  u_T' = -(lambda / mu^2) s_T
    |D u_T| = mu |u_T'|, so that De Saxcé's u_N + |D u_T| is u_N + mu |u_T'|, and r.u = s.u'

which is Coulomb's law of s and u' (`changed`).  With mu the geometric mean T has determinant 1,
and T = 1 for mu_1 = mu_2.  Under another sliding rule no such change exists.

[MS] A. Michałowski, Z. Mróz, "Associated and non-associated sliding rules in contact friction
problems", Arch. Mech. 30 (1978).  [Z] A. Zmitrowicz, Int. J. Solids Struct. 25 (1989).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only, real
from ...core.errors import InvalidInput
from .changed import Changed
from .coulomb import Coulomb
from .law import Array, Law, per_contact, same_length

MOST = 1e4  # mu_1 / mu_2: entries of W, whose errors count, are stretched by its square


@dataclass(frozen=True, eq=False)
class Orthotropic(Changed):
    """Friction mu1 along the tangent at `angle` [rad] from t1 to t2, mu2 across; each (nc,).

    Both are positive or both zero.  For contacts in 3D; where mu1 = mu2, Coulomb's law.
    """

    name: ClassVar[str] = "orthotropic friction"
    mu1: Array
    mu2: Array
    angle: Array = 0.0  # type: ignore[assignment]

    def __post_init__(self) -> None:
        turned = real("angle", self.angle)
        if not np.isfinite(turned).all():
            raise InvalidInput("angle: expected finite numbers, in radians")
        values = {"mu1": per_contact("mu1", self.mu1), "mu2": per_contact("mu2", self.mu2),
                  "angle": per_contact("angle", turned % np.pi)}  # fmt: skip
        for name, value in zip(values, same_length(**values), strict=True):
            object.__setattr__(self, name, value)
        small, large = np.minimum(self.mu1, self.mu2), np.maximum(self.mu1, self.mu2)
        for i in np.flatnonzero(large > MOST * small)[:1]:
            raise InvalidInput(
                "mu1, mu2: expected both 0, or both positive with a ratio of at most "
                f"{MOST:g}, got {self.mu1[i]:g} and {self.mu2[i]:g}"
            )

    @cached_property
    def plain(self) -> Law:  # type: ignore[override]  # made once
        """Coulomb's law with the geometric mean of both coefficients."""
        # the root of a square is not always its root
        same, mean = self.mu1 == self.mu2, np.sqrt(self.mu1) * np.sqrt(self.mu2)
        return Coulomb(np.where(same, self.mu1, mean))

    @cached_property
    def stretch(self) -> Array | None:  # type: ignore[override]
        """T, (nc, 2, 2); None where all contacts have mu1 = mu2."""
        if (self.mu1 == self.mu2).all():
            return None
        mean = self.plain.parameters[:, 0]
        t1, t2 = (np.divide(mu, mean, out=np.ones(len(mean)), where=mean > 0)
                  for mu in (self.mu1, self.mu2))  # fmt: skip
        half, cosine, sine = (t1 - t2) / 2, np.cos(2 * self.angle), np.sin(2 * self.angle)
        T = np.empty((len(mean), 2, 2))
        T[:, 0, 0] = (t1 + t2) / 2 + half * cosine
        T[:, 1, 1] = (t1 + t2) / 2 - half * cosine
        T[:, 0, 1] = T[:, 1, 0] = half * sine
        return read_only(T)

    def at(self, index: NDArray[np.integer]) -> Orthotropic:
        """The law of a selection of contacts."""
        return Orthotropic(self.mu1[index], self.mu2[index], self.angle[index])

    def scaled(self, force: float | Array) -> Orthotropic:
        """Itself: coefficients have no unit."""
        return self

    def with_bounds(self, bounds: Array) -> Orthotropic:
        """Itself: it has none."""
        return self
