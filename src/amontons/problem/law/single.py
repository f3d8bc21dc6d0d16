"""A single contact solved exactly, whatever its law: u = A r + b."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiled import njit
from .capped import solve_capped
from .coulomb import Coulomb
from .law import BOUND, COULOMB, MU, TIED, TRESCA, Array, Law
from .one_contact import solve_coulomb, solve_tresca
from .tied import solve_tied


@njit(cache=True, error_model="numpy")
def solve_contact(A, b0, b1, b2, kind, p, g1, g2):  # noqa: PLR0913
    """(r_N, r_T1, r_T2, state) of one contact of a kind with parameters p; guess of r_T."""
    if kind == COULOMB:
        return solve_coulomb(A, b0, b1, b2, p[MU], g1, g2)
    if kind == TRESCA:
        return solve_tresca(A, b0, b1, b2, p[BOUND], g1, g2)
    if kind == TIED:
        return solve_tied(A, b0, b1, b2)
    return solve_capped(A, b0, b1, b2, p[MU], p[BOUND], g1, g2)


def solve_one(A: ArrayLike, b: ArrayLike, law: Law | float) -> tuple[Array, Array, int]:
    """(r, u, state) of one contact given as arrays A (3, 3), b (3,); for tests and teaching.

    law: of one contact, or the coefficient of Coulomb's.
    """
    law = law if isinstance(law, Law) else Coulomb(np.array([float(law)]))
    own: Array = np.ascontiguousarray(A, dtype=float)
    given: Array = np.array(b, dtype=float)
    W = own if law.give is None else own + np.diag(law.give[0])
    shift = np.broadcast_to(law.offset, 1)[0] * np.eye(3)[0]
    q = given + shift - W @ (law.cohesion[0] * np.eye(3)[0])
    T = np.column_stack([law.stretched(row[None])[0] for row in np.eye(3)])
    *found, state = solve_contact(
        np.ascontiguousarray(T @ W @ T), *(T @ q), law.kind[0], law.parameters[0], 0.0, 0.0
    )
    r = law.released(np.array(found)[None])[0]
    return r, own @ r + given, state
