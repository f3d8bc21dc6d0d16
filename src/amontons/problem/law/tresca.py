"""Tresca friction: |r_T| <= tau, a number that does not depend on the pressure.

    0 <= u_N  ⟂  r_N >= 0;    |r_T| <= tau,  r_T = -tau u_T / |u_T| where u_T != 0

also where the contact is open: the law is that of a step of iterations on Coulomb's, whose
bound is known, and of a layer that flows at a given shear.  Closed contacts alone have such a
bound under `CappedCoulomb` with a large mu.  The normal cone of a convex set that does not move
with the solution: with W positive definite there is one solution.  A single contact:
`one_contact.solve_tresca`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .cones import project_disk
from .law import BOUND, Array, Kind, Kinds, Law, Mask, columns_of, kinds_of, per_contact


@dataclass(frozen=True, eq=False)
class Tresca(Law):
    """Given friction: |r_T| <= bound, shape (nc,), unit of r, whatever the pressure."""

    name: ClassVar[str] = "Tresca friction"
    limit: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "limit", per_contact("bound", self.limit))

    @cached_property
    def kind(self) -> Kinds:
        """TRESCA, (nc,)."""
        return kinds_of(Kind.TRESCA, len(self.limit))

    @cached_property
    def parameters(self) -> Array:
        """(0, tau), (nc, 2)."""
        return columns_of(0.0, self.limit, len(self.limit))

    @property
    def coefficient(self) -> Array:
        """The number per contact that the law needs, shape (nc,)."""
        return self.limit

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """Residual of the law, (nc, d), unit of r; zero exactly at a solution."""
        x = r - rho[:, None] * u
        normal = np.maximum(x[:, 0], 0)
        return r - np.column_stack([normal, project_disk(x[:, 1:], self.limit)])

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,); an open contact may slide."""
        x = r - rho[:, None] * u
        return x[:, 0] > 0, np.linalg.norm(x[:, 1:], axis=1) > self.limit

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r, shape (nc,)."""
        return self.limit

    def bound_slope(self, r: Array) -> Array:
        """Derivative of the bound in r_N, (nc,): zero."""
        return np.zeros(len(self.limit))

    def at(self, index: NDArray[np.integer]) -> Tresca:
        """The law of a selection of contacts."""
        return Tresca(self.limit[index])

    def _of(self, kind: Kinds, parameters: Array) -> Tresca:
        return Tresca(parameters[:, BOUND])
