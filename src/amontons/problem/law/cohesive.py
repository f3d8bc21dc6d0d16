"""Cohesion: a law that bears a tension c, as a translation of r_N.

With s = r + c n every law here is asked of s instead of r:

    0 <= u_N  ⟂  r_N + c >= 0;   |r_T| <= g(r_N + c): mu (r_N + c), tau, min(mu (r_N + c), tau)

For Coulomb's law that is Mohr and Coulomb's criterion with the cohesion mu c of shear and its
tip as the tensile strength; capillary forces between wet grains are modelled so, see [RER].  As

    u = W r + q = W s + (q - W c n),    M v = H r + f = H s + (f - H c n),

a problem with cohesion is one without it under another load, see `changed`.

What this is not: damage.  A contact that has opened still pulls with c, at any distance, as a
rigid-plastic bond does; who wants a bond that breaks takes the cohesion away where a step ends
open.

[RER] V. Richefeu, M. El Youssoufi, F. Radjaï, "Shear strength properties of wet granular
materials", Phys. Rev. E 73 (2006).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, shown
from .changed import Changed
from .compliant import Compliant
from .law import INSIDE, Array, Law, Mask, per_contact, same_length


@dataclass(frozen=True, eq=False)
class Cohesive(Changed):
    """A law with the tension that its contacts bear: tension (nc,) or one number, unit of r."""

    law: Law
    tension: Array

    def __post_init__(self) -> None:
        if not isinstance(self.law, Law) or isinstance(self.law, Cohesive | Compliant):
            raise InvalidInput(
                "law: expected Coulomb, Tresca, … without cohesion or compliance, got "
                f"{shown(self.law)}"
            )
        if self.law.varies:
            raise InvalidInput(f"law: {INSIDE}")
        tension = per_contact("cohesion", self.tension)
        if len(self.law) == 1 != len(tension):
            object.__setattr__(self, "law", self.law.at(np.zeros(len(tension), dtype=int)))
        *_, tension = same_length(law=self.law.parameters[:, 0], cohesion=tension)
        object.__setattr__(self, "tension", tension)
        if (tension[self.law.tied] > 0).any():
            raise InvalidInput("cohesion: expected 0 at tied contacts, which bear any tension")

    @property
    def name(self) -> str:
        """The name of the law, with cohesion."""
        return f"{self.law.name} with cohesion"

    @property
    def plain(self) -> Law:
        """The law without cohesion, and without a stretch."""
        return self.law.plain

    @property
    def cohesion(self) -> Array:  # type: ignore[override]
        """Largest tension, (nc,), unit of r."""
        return self.tension

    @property
    def stretch(self) -> Array | None:  # type: ignore[override]
        """That of the law without cohesion."""
        return self.law.stretch

    def at(self, index: NDArray[np.integer]) -> Cohesive:
        """The law of a selection of contacts."""
        return Cohesive(self.law.at(index), self.tension[index])

    def scaled(self, force: float | Array) -> Cohesive:
        """The law in another unit of r."""
        return Cohesive(self.law.scaled(force), self.tension * force)

    def with_mu(self, mu: Array) -> Cohesive:
        """The law with other coefficients mu, (nc,)."""
        return Cohesive(self.law.with_mu(mu), self.tension)

    def lost(self, gone: Mask) -> Cohesive:
        """The law without tension, and without Tresca's bounds, of contacts gone (nc,)."""
        return Cohesive(self.law.lost(gone), np.where(gone, 0.0, self.tension))

    def with_bounds(self, bounds: Array) -> Cohesive:
        """The law with other bounds tau, (nc,)."""
        return Cohesive(self.law.with_bounds(bounds), self.tension)
