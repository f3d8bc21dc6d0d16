"""Compliant contact: pressure over overclosure, as of asperities that give way.

With C = diag(c, c_T, c_T), lengths per force, every law here is asked of u + C r instead of u:

    0 <= u_N + c r_N  ⟂  r_N >= 0;    r_T opposes u_T + c_T r_T, the part of the slip that stays

so that closed sides overlap by c r_N, u_N = -c r_N as it is told, and contacts that stick have
slipped elastically by -c_T r_T.  As u + C r = (W + C) r + q, a problem with compliance is one
without it whose W has more on its diagonal: definite where c, c_T > 0, also where W is not.
Its energy r.C r / 2 is stored in the contacts.  c -> 0 is the law without compliance.
With an offset, the overclosure at which the pressure begins, it is u_N + c r_N + offset.

c_T counts from the state in which u_T = 0; in steps one after the other, u_T is to count from
the last u_T + c_T r_T (`mechanics.steps.springs`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only, real
from ...core.errors import InvalidInput, shown
from .changed import Changed
from .law import INSIDE, Array, Law, Mask, per_contact, same_length


@dataclass(frozen=True, eq=False)
class Compliant(Changed):
    """A law whose contacts give way: compliance, stick_compliance (nc,) or a number, u / r.

    offset: overclosure at which the pressure begins, (nc,) or a number, < 0 across a gap.
    """

    law: Law
    compliance: Array
    stick_compliance: Array = 0.0  # type: ignore[assignment]
    offset: Array = 0.0  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if not isinstance(self.law, Law) or isinstance(self.law, Compliant):
            raise InvalidInput(
                f"law: expected Coulomb, Tresca, … without compliance, got {shown(self.law)}"
            )
        if self.law.varies:
            raise InvalidInput(f"law: {INSIDE}")
        given = (per_contact("compliance", self.compliance),
                 per_contact("stick_compliance", self.stick_compliance))  # fmt: skip
        size = max(map(len, given))
        if len(self.law) == 1 != size:
            object.__setattr__(self, "law", self.law.at(np.zeros(size, dtype=int)))
        _, c, stick = same_length(
            law=self.law.parameters[:, 0], compliance=given[0], stick_compliance=given[1]
        )
        object.__setattr__(self, "compliance", c)
        object.__setattr__(self, "stick_compliance", stick)
        object.__setattr__(self, "give", read_only(np.column_stack([c, stick, stick])))
        offset = np.atleast_1d(real("offset", self.offset))
        if len(offset) not in (1, len(c)) or not np.isfinite(offset).all():
            raise InvalidInput(f"offset: expected one finite number or {len(c)} of them")
        offset = np.broadcast_to(offset, len(c)).astype(float)
        object.__setattr__(self, "offset", read_only(offset))

    @property
    def name(self) -> str:  # type: ignore[override]
        """The name of the law, with compliance."""
        return f"{self.law.name} with compliance"

    @property
    def plain(self) -> Law:
        """The law in all its own variables."""
        return self.law.plain

    @property
    def cohesion(self) -> Array:  # type: ignore[override]
        """That of the law without compliance."""
        return self.law.cohesion

    @property
    def stretch(self) -> Array | None:  # type: ignore[override]
        """That of the law without compliance."""
        return self.law.stretch

    def at(self, index: NDArray[np.integer]) -> Compliant:
        """The law of a selection of contacts."""
        return Compliant(self.law.at(index), self.compliance[index],
                         self.stick_compliance[index], self.offset[index])  # fmt: skip

    def scaled(self, force: float | Array) -> Compliant:
        """The law in another unit of r."""
        return Compliant(self.law.scaled(force), self.compliance / force,
                         self.stick_compliance / force, self.offset)  # fmt: skip

    def with_mu(self, mu: Array) -> Compliant:
        """The law with other coefficients mu, (nc,)."""
        return replace(self, law=self.law.with_mu(mu))

    def lost(self, gone: Mask) -> Compliant:
        """The law where contacts gone (nc,) have lost what holds them without pressure."""
        return replace(self, law=self.law.lost(gone))

    def with_bounds(self, bounds: Array) -> Compliant:
        """The law with other bounds tau, (nc,)."""
        return replace(self, law=self.law.with_bounds(bounds))
