"""Bounds on the critical friction of a 3D problem: multipliers below, a singular piece above.

The multipliers (`contact_multipliers`) prove, the piece (`disc_pieces`) is a witness; nothing
closes what is between.  On finer meshes the lower bound falls with the square root of the
size of facets, because its forms see one contact at a time; the upper one hardly moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import TimeUp
from ...core.onlookers import say
from ..multipliers.rounding import EPSILON, determinant_sign
from .contact_multipliers import ContactMultipliers, contact_multipliers
from .disc_pieces import SLIP, DiscPiece, bases, equations, singular_piece
from .status_pieces import Pieces

Array = NDArray[np.float64]
LOWER = 0.7  # part of the time for the multipliers: many contacts need it
NOT_PROVED = "multipliers of every contact gave no proof in time or within rounding"
ROOMS = (1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6)  # above t, where the determinant is negative


def lower_bound(
    pieces: Pieces, deadline: Deadline, first: float | None
) -> tuple[ContactMultipliers | None, str]:
    """(multipliers in the units of the problem, empty or why there are none).

    first: a friction of interest; a bound above it is enough.
    """
    say("critical friction: multipliers of every contact")
    wanted = np.inf if first is None else first
    try:
        found = contact_multipliers(pieces.W, pieces.shape, deadline, wanted=wanted)
    except TimeUp as reason:
        return None, str(reason)
    if found.t > 0:
        return found.unscaled(pieces.scale), ""
    return None, NOT_PROVED


def upper_bound(pieces: Pieces, deadline: Deadline) -> DiscPiece | None:
    """A singular piece, with t moved up to where its determinant is provably negative."""
    say("critical friction: upper bounds")
    found = singular_piece(pieces, deadline)
    if found is None or found.t == np.inf:
        return None
    for room in ROOMS:
        t = found.t * (1 + room)
        if _sign(pieces, found, t) < 0:
            return DiscPiece(t, found.states, found.directions, found.null)
    return None


def coefficients(pieces: Pieces, found: DiscPiece) -> Array:
    """Friction of the slipping contacts of the problem, 0 elsewhere, (nc,)."""
    out = np.zeros(pieces.total)
    slip = found.states >= SLIP
    out[pieces.places[slip]] = found.t * pieces.shape[slip]
    return out


def directions(pieces: Pieces, found: DiscPiece) -> Array:
    """Directions of slip of the slipping contacts of the problem, 0 elsewhere, (nc, 2)."""
    out = np.zeros((pieces.total, 2))
    slip = found.states >= SLIP
    out[pieces.places[slip]] = found.directions[slip]
    return out


def pattern(pieces: Pieces, found: DiscPiece) -> str:
    """A letter of every contact of the problem; those that can not react are free."""
    out = np.full(pieces.total, "f")
    out[pieces.places] = list(found.pattern)
    return "".join(out)


def residual(pieces: Pieces, found: DiscPiece) -> float:
    """What the null vector leaves of its equations, relative to their terms."""
    J = equations(pieces.W, pieces.shape, found.states, found.directions, found.t)
    size = np.abs(J) @ np.abs(found.null)
    return float((np.abs(J @ found.null) / np.where(size > 0, size, 1.0)).max(initial=0.0))


def _sign(pieces: Pieces, found: DiscPiece, t: float) -> int:
    """Sign of the determinant at friction t shape, 0 where rounding could change it.

    Directions are unit vectors within rounding, which scales rows and turns nothing else.
    """
    V, R, _, _ = bases(pieces.shape, found.states, found.directions, t)
    J, size = (a.T @ (b.T @ w.T).T for a, b, w in (
        (V, R, pieces.W), (abs(V), abs(R), np.abs(pieces.W))))  # fmt: skip
    return determinant_sign(J, 8 * EPSILON * size)


__all__ = ["coefficients", "directions", "lower_bound", "pattern", "residual", "upper_bound"]
