"""Bilateral rows: contacts that neither part nor slip, whatever their reaction.

    u = 0,    r of any sign and direction

as of ties between meshes, welds, hinges of several rows.  It is the limit of Coulomb's law with
cohesion and friction that nothing breaks: convex, so with W positive definite there is one
solution.  Where tied rows say the same twice, W is singular, u is unique and r is not.
`Compliant(Tied(), c, c_T)` is an elastic bond, u = -C r.

In kernels: kind TIED with the parameters (0, infinity).  Such a contact always sticks.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.errors import InvalidInput, shown
from .law import Array, Kind, Kinds, Law, Mask, columns_of, kinds_of
from .states import STICK


@dataclass(frozen=True, eq=False)
class Tied(Law):
    """Bonds at `contacts` contacts: u = 0, reactions free."""

    name: ClassVar[str] = "bilateral contact"
    contacts: int = 1

    def __post_init__(self) -> None:
        try:
            count = operator.index(self.contacts)
        except TypeError:
            count = -1
        if count < 0:
            raise InvalidInput(
                f"contacts: expected how many there are, got {shown(self.contacts)}"
            )

    @cached_property
    def kind(self) -> Kinds:
        """TIED, (nc,)."""
        return kinds_of(Kind.TIED, self.contacts)

    @cached_property
    def parameters(self) -> Array:
        """(0, infinity), (nc, 2)."""
        return columns_of(0.0, np.inf, self.contacts)

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """rho u, (nc, d), unit of r: r - P(r - rho u) with nothing to project onto."""
        return rho[:, None] * u

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,): always stuck."""
        closed = np.ones(self.contacts, dtype=bool)
        return closed, ~closed

    def at(self, index: NDArray[np.integer]) -> Tied:
        """The law of a selection of contacts."""
        return Tied(len(self.kind[index]))

    def _of(self, kind: Kinds, parameters: Array) -> Tied:
        return Tied(len(kind))


@njit(cache=True, error_model="numpy")
def solve_tied(A, b0, b1, b2):
    """(r_N, r_T1, r_T2, STICK) with A r + b = 0; directions that do not react have r = 0."""
    M, x = A.copy(), np.array([-b0, -b1, -b2])
    size = max(abs(A[0, 0]), abs(A[1, 1]), abs(A[2, 2]))
    for k in range(3):
        if abs(M[k, k]) <= 1e-13 * size or M[k, k] != M[k, k]:
            M[k, :] = 0.0
            M[:, k] = 0.0
            M[k, k], x[k] = 1.0, 0.0
        for i in range(k + 1, 3):
            share = M[i, k] / M[k, k]
            x[i] -= share * x[k]
            for j in range(k, 3):
                M[i, j] -= share * M[k, j]
    for k in range(2, -1, -1):
        for j in range(k + 1, 3):
            x[k] -= M[k, j] * x[j]
        x[k] /= M[k, k]
    return x[0], x[1], x[2], STICK
