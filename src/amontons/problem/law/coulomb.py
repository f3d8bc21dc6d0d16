"""Coulomb friction: r in the cone K = { |r_T| <= mu r_N }, and it opposes the slip.

    K* ∋ u + mu |u_T| n  ⟂  r ∈ K            (De Saxcé's change of variable, [ABH])

which says all: r_N >= 0 and u_N >= 0, one of them zero; |r_T| <= mu r_N; and
r_T = -mu r_N u_T / |u_T| where the contact slips.  The law is a cone: a multiple of a solution
solves the multiple of the load.  A single contact: `one_contact.solve_coulomb`.

[ABH] V. Acary, M. Brémond, O. Huber, "On solving contact problems with Coulomb friction:
formulations and numerical comparisons", Inria RR-9118 (2018).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cones import cone_regions, natural_map, with_de_saxce
from .law import MU, Array, Kind, Kinds, Law, Mask, columns_of, kinds_of, per_contact


@dataclass(frozen=True, eq=False)
class Coulomb(Law):
    """Coulomb friction with coefficient mu, shape (nc,), dimensionless."""

    name: ClassVar[str] = "Coulomb friction"
    mu: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", per_contact("mu", self.mu))

    @cached_property
    def kind(self) -> Kinds:
        """COULOMB, (nc,)."""
        return kinds_of(Kind.COULOMB, len(self.mu))

    @cached_property
    def parameters(self) -> Array:
        """(mu, infinity), (nc, 2)."""
        return columns_of(self.mu, np.inf, len(self.mu))

    @property
    def coefficient(self) -> Array:
        """The number per contact that the law needs, shape (nc,)."""
        return self.mu

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """r - P_K(r - rho u_hat), (nc, d), unit of r; zero exactly at a solution."""
        return natural_map(r, u, self.mu, rho)

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,): the piece of the natural map that holds at (r, u)."""
        x = r - rho[:, None] * with_de_saxce(u, self.mu)
        inside, polar, *_ = cone_regions(x, self.mu)
        return ~polar, ~polar & ~inside

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r, shape (nc,)."""
        return self.mu * np.maximum(r[:, 0], 0)

    def bound_slope(self, r: Array) -> Array:
        """Derivative of the bound in r_N, (nc,): zero at r_N <= 0."""
        return np.where(r[:, 0] > 0, self.mu, 0.0)

    def at(self, index: NDArray[np.integer]) -> Coulomb:
        """The law of a selection of contacts."""
        return Coulomb(self.mu[index])

    def scaled(self, force: float | Array) -> Coulomb:
        """Itself: mu has no unit."""
        return self

    def _of(self, kind: Kinds, parameters: Array) -> Coulomb:
        return Coulomb(parameters[:, MU])


def as_law(mu: ArrayLike | Law) -> Law:
    """A law as it is; numbers are coefficients of Coulomb's."""
    return mu if isinstance(mu, Law) else Coulomb(mu)  # type: ignore[arg-type]  # it converts
