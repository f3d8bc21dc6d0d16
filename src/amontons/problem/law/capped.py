"""Coulomb friction up to a largest shear: |r_T| <= min(mu r_N, tau).

    0 <= u_N  ⟂  r_N >= 0;    g = min(mu r_N, tau),  |r_T| <= g,
    r_T = -g u_T / |u_T| where u_T != 0

The interface slides as Coulomb's until the shear reaches what the weaker of the two materials
bears (Orowan's limit of friction in metal forming).  An open contact has no friction.  As
tau -> infinity the law is Coulomb's, as mu -> infinity that of Tresca on closed contacts.

Below the cap, mu r_N <= tau, a contact obeys Coulomb's law with mu, above it Tresca's with tau;
at r_N = tau / mu both say the same.  So the natural map is the one or the other by r_N, which
is zero exactly at a solution but jumps elsewhere at the cap; Alart and Curnier's function
(`Law.augmented_reaction`) is continuous.

A single contact (`solve_capped`): with the bound g as a number it is Tresca's, whose r_N(g) is
continuous where A is definite, so that min(mu r_N(g), tau) - g has a zero in [0, tau]: either
g = mu r_N, a solution of Coulomb's law, or g = tau, one of Tresca's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from ...core.compiled import njit
from .law import (
    BOUND,
    MU,
    Array,
    Kind,
    Kinds,
    Law,
    columns_of,
    kinds_of,
    per_contact,
    same_length,
)
from .one_contact import solve_coulomb, solve_tresca
from .states import OPEN

HALVINGS = 60  # of [0, tau], to the last bit


@dataclass(frozen=True, eq=False)
class CappedCoulomb(Law):
    """Coulomb friction with coefficient mu up to a shear cap; (nc,), cap in the unit of r."""

    name: ClassVar[str] = "capped Coulomb friction"
    mu: Array
    cap: Array

    def __post_init__(self) -> None:
        given = same_length(mu=per_contact("mu", self.mu), cap=per_contact("cap", self.cap))
        for name, values in zip(("mu", "cap"), given, strict=True):
            object.__setattr__(self, name, values)

    @cached_property
    def kind(self) -> Kinds:
        """CAPPED, (nc,)."""
        return kinds_of(Kind.CAPPED, len(self.mu))

    @cached_property
    def parameters(self) -> Array:
        """(mu, cap), (nc, 2)."""
        return columns_of(self.mu, self.cap, len(self.mu))

    def _of(self, kind: Kinds, parameters: Array) -> CappedCoulomb:
        return CappedCoulomb(parameters[:, MU], parameters[:, BOUND])


@njit(cache=True, error_model="numpy")
def solve_capped(A, b0, b1, b2, mu, cap, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2, state) of one contact; (g1, g2) guesses r_T."""
    r0, r1, r2, state = solve_coulomb(A, b0, b1, b2, mu, g1, g2)
    if mu * r0 <= cap or state == OPEN:
        return r0, r1, r2, state
    r0, r1, r2, state = solve_tresca(A, b0, b1, b2, cap, g1, g2)
    if mu * r0 >= cap and state != OPEN:
        return r0, r1, r2, state
    low, high = 0.0, cap  # another solution of Coulomb's law, or at the cap itself
    for _ in range(HALVINGS):
        bound = 0.5 * (low + high)
        r0, r1, r2, state = solve_tresca(A, b0, b1, b2, bound, r1, r2)
        if min(mu * r0, cap) > bound:
            low = bound
        else:
            high = bound
    return r0, r1, r2, state
