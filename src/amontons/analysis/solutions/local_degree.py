"""How many solutions a border of the law stands for: the local degree of a solution there.

A solution inside a linear piece counts as the sign of its determinant.  One on the border of
several pieces belongs to all of them: with a small change d of the load each piece P gives a
change dr of the solution, and has a solution where dr goes into P.  The degree is the sum of
their signs, and the same for every d.  Where all signs are +1 it is their number: with degree
one there is exactly one solution, whatever d.  Signs that differ hide two solutions of
different status, or none, in what rounding leaves open.

All degrees add up to one where W is positive definite, or no reaction in the cone has W r = 0:
(1 - s) mu and W + s with s from 0 to 1 lead to a monotone problem without friction, whose only
solution counts as one, and r W r + q r <= 0 keeps all solutions bounded on the way, for the
cone only shrinks.

[Ortega] J. Ortega, W. Rheinboldt, "Iterative solution of nonlinear equations in several
variables" (1970), section 6.2 (homotopy invariance).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import pattern_search as search
from .piece_solution import DATA, PieceAnswer, PieceSystem
from .scaled_problem import ScaledProblem, States

Array = NDArray[np.float64]
PIECES = 1024  # that may meet in a solution
GENERIC = 1e-7  # a change of a slack that is too small to have a sign, relative
TRIES = 4  # changes of the load


def degree(scaled: ScaledProblem, group: Sequence[PieceAnswer]) -> tuple[int | None, bool]:
    """(local degree, exactly one solution?) of answers that are one solution within rounding.

    None where a piece that meets there is nearly singular, or too many meet.
    """
    first = group[0]
    off_r = np.max([np.abs(g.r - first.r) + g.off_r for g in group], axis=0)
    off_u = np.max([np.abs(g.u - first.u) + g.off_u for g in group], axis=0)
    choices = [_statuses(scaled, first, i, off_r, off_u) for i in range(scaled.contacts)]
    if np.prod([float(len(own)) for own in choices]) > PIECES:
        return None, False
    pieces = []
    for states in itertools.product(*choices):
        piece = _Cone.of(scaled, np.array(states, dtype=np.int8), first, off_r, off_u)
        if piece is None:
            return None, False
        pieces.append(piece)
    met = {tuple(piece.states) for piece in pieces}
    if any(tuple(g.states) not in met for g in group):
        return None, False
    random = np.random.default_rng(0)
    found = {_count(pieces, random.standard_normal(len(scaled.W))) for _ in range(TRIES)}
    found -= {None}
    if len(found) != 1:
        return None, False
    (value,) = found
    return value, value == 1 and all(piece.sign == 1 for piece in pieces)


def _statuses(
    scaled: ScaledProblem, at: PieceAnswer, i: int, off_r: Array, off_u: Array
) -> list[int]:
    """Statuses that contact i has within the errors given."""
    n, t, mu = 2 * i, 2 * i + 1, float(scaled.mu[i])
    if not scaled.reacts[i]:
        return [search.OPEN]
    room = mu * off_r[n] + off_r[t]
    still_n, still_t = abs(at.u[n]) <= off_u[n], abs(at.u[t]) <= off_u[t]
    out = []
    if abs(at.r[n]) <= off_r[n] and abs(at.r[t]) <= off_r[t] and at.u[n] >= -off_u[n]:
        out.append(search.OPEN)
    if still_n and mu == 0:
        out.append(search.FRICTIONLESS)
    elif still_n:
        if still_t and abs(at.r[t]) <= mu * at.r[n] + room:
            out.append(search.STICK)
        if abs(at.r[t] - mu * at.r[n]) <= room and at.u[t] <= off_u[t]:
            out.append(search.SLIP_PLUS)
        if abs(at.r[t] + mu * at.r[n]) <= room and at.u[t] >= -off_u[t]:
            out.append(search.SLIP_MINUS)
    return out


class _Cone:
    """One piece seen from a point on its border: the directions into it."""

    def __init__(self, system: PieceSystem, X: Array, active: NDArray[np.bool_]) -> None:
        self.system, self.X, self.active = system, X, active
        self.states = system.states.tolist()
        E = (system.scaled.W @ system.R)[system.rows]
        self.sign = int(np.linalg.slogdet(E)[0]) if len(E) else 1

    @classmethod
    def of(
        cls, scaled: ScaledProblem, states: States, at: PieceAnswer, off_r: Array, off_u: Array
    ) -> _Cone | None:
        """The cone of a pattern at a point, None where its determinant has no sure sign."""
        system = PieceSystem.of(scaled, states)
        found = system.inverse(DATA)
        if found is None:
            return None
        slack = system.P @ at.r + system.Q @ at.u
        active = slack <= np.abs(system.P) @ off_r + np.abs(system.Q) @ off_u
        return cls(system, found[0], active)

    def enters(self, d: Array) -> bool | None:
        """Whether the change by a load d leads into the piece; None on its border."""
        y = -(self.X @ d[self.system.rows])
        change = (self.system.L @ y + self.system.Q @ d)[self.active]
        size = np.abs(self.system.L) @ np.abs(y) + np.abs(self.system.Q) @ np.abs(d)
        if (np.abs(change) <= GENERIC * size[self.active]).any():
            return None
        return bool((change > 0).all())


def _count(pieces: Sequence[_Cone], d: Array) -> int | None:
    """Sum of the signs of all pieces that have a solution for a change d of the load."""
    entered = [piece.enters(d) for piece in pieces]
    if None in entered:
        return None
    return sum(p.sign for p, inside in zip(pieces, entered, strict=True) if inside)
