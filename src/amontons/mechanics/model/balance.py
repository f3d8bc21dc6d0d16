"""Why a model may have no solution: bodies that no admissible contact forces balance.

For a rigid motion a of the bodies that supports leave loose, balance wants

    load . a + sum_i r_i . u_i = 0,    u = H^T a,

while r_i . u_i >= 0 for all r_i in the cone of Coulomb where u_iN >= mu_i |u_iT| (Farkas).  A
motion that opens all contacts so far, or slides by less, and on which the load works is a proof
that there is no solution.  It comes from a linear program, |u_iT| enclosed by a polygon from
outside: what it finds is a proof, what it does not find may still be none.  Where friction
has a largest value, under Tresca's law or a cap, u_iN >= 0, and the work of all bounds
g_i |u_iT| is subtracted; that of cohesion is in the load (`FrictionProblem.plain`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...problem.law import Law
from ...problem.law.law import BOUND, COULOMB, MU
from .assembly import Discretisation
from .rigid import NAMES, Piece, rigid_motions

Array = NDArray[np.float64]
CORNERS = 24  # of the polygon around the circle |u_T| <= 1
WORKS = 1e-6  # work of the load, relative to the largest possible one, that is not rounding
MOST = 20_000  # contacts for which the linear program takes seconds
NAMED = 5  # bodies at most
SMALL = 1e-6  # parts of a motion, relative to the largest, that are rounding


@dataclass(frozen=True)
class Imbalance:
    """The loose bodies that contact may not hold, in words, and whether that is proved."""

    reason: str
    is_proved: bool = False

    def __str__(self) -> str:
        return self.reason


def imbalance(
    parts: Discretisation, loose: list[tuple[Piece, Array]], law: Law, load: Array
) -> Imbalance | None:
    """What contact has to hold under the load (n,), and whether it can; None for no body.

    loose: pieces with the rigid modes that supports leave free, as from `loose_modes`.
    """
    if not loose:
        return None
    motion, of = rigid_motions(loose, parts.dofs)
    moved = parts.gathered(motion)
    size = float(np.abs(load) @ np.abs(moved).max(axis=1))
    found, most = None, law.widest
    if size > 0 and len(law) <= MOST and most is not None:
        found = _escape(parts.whole_H.T @ motion, load @ moved / size, most, size)
    if found is None:
        return Imbalance(
            f"contact and friction alone hold {in_words(loose)}: perhaps they do not suffice"
        )
    texts = [
        f"body {piece.name!r} gives way by "
        f"{_motion_in_words(piece.moving(basis @ found[of == k]))}"
        for k, (piece, basis) in enumerate(loose)
        if np.abs(found[of == k]).max() > SMALL * np.abs(found).max()
    ]
    return Imbalance(
        "there is no solution, no contact forces balance the loads: " + "; ".join(texts), True
    )


def in_words(loose: list[tuple[Piece, Array]]) -> str:
    """The names of loose pieces, the first of many."""
    names = [f"body {piece.name!r}" for piece, _ in loose]
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _motion_in_words(motion: Array) -> str:
    """The parts of a rigid motion (3 or 6,)."""
    names = NAMES[2 if len(motion) == 3 else 3]
    large = np.abs(motion) > SMALL * np.abs(motion).max()
    return " with ".join(name for name, is_large in zip(names, large, strict=True) if is_large)


def _escape(local: Array, power: Array, law: Law, size: float) -> Array | None:
    """The motion (k,) with the smallest sum of parts on which the load works by 1, or None.

    local (nc d, k): displacements of the contacts; power (k,): work of the load over size.
    """
    from scipy.optimize import linprog

    nc, k = len(law), len(power)
    d = len(local) // nc
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    sides = np.array([[1.0], [-1.0]])
    if d == 3:
        sides = np.stack([np.cos(angle), np.sin(angle)], axis=1) / np.cos(np.pi / CORNERS)
    u = local.reshape(nc, d, k)
    if law.stretch is not None:  # r.u >= 0 for all r is u_N >= mu |u_T'|
        u = np.concatenate([u[:, :1], np.einsum("cij,cjk->cik", law.stretch, u[:, 1:])], axis=1)
    coulomb, parameters = law.kind == COULOMB, law.parameters
    slack = sparse.diags_array(np.where(coulomb, parameters[:, MU], 0.0))
    lost = np.where(coulomb | law.tied, 0.0, parameters[:, BOUND]) / size
    # unknowns: motion = a - b with a, b >= 0 as its size is minimised, and t >= |u_T|
    rows = [sparse.hstack([_both(-u[:, 0]), slack])]  # mu t <= u_N
    for side in sides:
        along = np.einsum("c,ick->ik", side, u[:, 1:])
        rows.append(sparse.hstack([_both(along), -sparse.eye_array(nc)]))
    ties = np.flatnonzero(law.tied)  # do not move at all: their t is 0 too
    rows.append(sparse.hstack([_both(u[ties, 0]), sparse.csr_array((len(ties), nc))]))
    rows.append(sparse.csr_array(np.concatenate([-power, power, lost])[None]))
    right = np.append(np.zeros((1 + len(sides)) * nc + len(ties)), -1.0)
    cost = np.concatenate([np.ones(2 * k), np.zeros(nc)])
    bounds = [(0, 1 / WORKS)] * (2 * k) + [(0, 0 if tied else None) for tied in law.tied]
    matrix = sparse.vstack(rows, format="csc")
    result = linprog(cost, matrix, right, bounds=bounds, method="highs-ipm")
    return result.x[:k] - result.x[k : 2 * k] if result.status == 0 else None


def _both(block: Array) -> sparse.csr_array:
    """A block of coefficients of a - b."""
    return sparse.csr_array(np.hstack([block, -block]))
