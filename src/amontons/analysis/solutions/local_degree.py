"""How many solutions a border of the law stands for: the local degree of a solution there.

A solution inside a linear piece counts as the sign of its determinant.  One on the border of
several pieces belongs to all of them.  Contacts that are not on a border keep their status, the
others have one of those that meet there, and inequalities that are far from zero are left out:
a piecewise linear map of its own, whose pieces are cones.  Its degree is the sum of the signs
of all pieces that have a solution, for any load; that of a random one is counted.  Where the
solutions of all pieces fulfil what was left out, for W, q and mu as uncertain as they are,
those of the cones are those of the problem.  With degree one and all signs +1 there is then
exactly one solution, whatever rounding does.  Signs that differ hide two solutions of different
status, or none, in what rounding leaves open.

All degrees add up to one where W is positive definite, or no reaction in the cone has W r = 0:
(1 - s) mu and W + s with s from 0 to 1 lead to a monotone problem without friction, whose only
solution counts as one, and r W r + q r <= 0 keeps all solutions bounded on the way, for the
cone only shrinks.

[Ortega] J. Ortega, W. Rheinboldt, "Iterative solution of nonlinear equations in several
variables" (1970), section 6.2 (homotopy invariance).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..statuses import FREE, FRICTIONLESS, MINUS, PLUS, STICK, States
from ..tolerances import DATA
from .piece_solution import Existence, PieceAnswer, PieceSystem, located
from .plane_problem import PlaneProblem

Array = NDArray[np.float64]
FANS = (  # statuses of a contact that together are a law
    (FREE,), (STICK,), (PLUS,), (MINUS,),
    (FREE, PLUS), (FREE, MINUS),
    (STICK, PLUS), (STICK, MINUS),
    (FREE, STICK, PLUS, MINUS),
)  # fmt: skip
PIECES = 1024  # that may meet in a solution
GENERIC = 1e-7  # a change of a slack that is too small to have a sign, relative
TRIES = 4  # changes of the load


@dataclass(frozen=True)
class Degree:
    """The local degree, whether exactly one solution is there, and the pieces that meet.

    value: None for a set, where a piece that meets there is nearly singular, too many meet, or
    solutions may be so far apart that others would meet.
    """

    value: int | None = None
    sole: bool = False
    pieces: frozenset[tuple[int, ...]] = frozenset()


UNKNOWN = Degree()


def degree(plane: PlaneProblem, group: Sequence[PieceAnswer]) -> Degree:
    """That of answers that are one solution within rounding, in 2D."""
    first = group[0]
    if first.existence is Existence.SURE and len(group) == 1:
        return Degree(first.sign, True, frozenset([tuple(first.states.tolist())]))
    if first.freedom:
        return UNKNOWN
    off_r = np.max([np.abs(g.r - first.r) + g.off_r for g in group], axis=0)
    off_u = np.max([np.abs(g.u - first.u) + g.off_u for g in group], axis=0)
    choices = [_statuses(plane, first, i, off_r, off_u) for i in range(plane.contacts)]
    if math.prod(len(own) for own in choices) > PIECES:
        return UNKNOWN
    pieces = []
    for states in itertools.product(*choices):
        kept = [_kept(own, state) for own, state in zip(choices, states, strict=True)]
        piece = _Cone.of(plane, np.array(states, dtype=np.int8), np.concatenate(kept))
        if piece is None:
            return UNKNOWN
        pieces.append(piece)
    met = frozenset(tuple(piece.states) for piece in pieces)
    if any(tuple(g.states.tolist()) not in met for g in group):
        return UNKNOWN
    random = np.random.default_rng(0)
    found = {_count(pieces, random.standard_normal(len(plane.W))) for _ in range(TRIES)}
    found -= {None}
    if len(found) != 1:
        return UNKNOWN
    (value,) = found
    return Degree(value, value == 1 and all(piece.sign == 1 for piece in pieces), met)


def _statuses(
    plane: PlaneProblem, at: PieceAnswer, i: int, off_r: Array, off_u: Array
) -> list[int]:
    """Statuses that contact i has within the errors given."""
    n, t, mu = 2 * i, 2 * i + 1, float(plane.mu[i])
    if not plane.reacts[i]:
        return [FREE]
    room = mu * off_r[n] + off_r[t]
    still_n, still_t = abs(at.u[n]) <= off_u[n], abs(at.u[t]) <= off_u[t]
    out = []
    if abs(at.r[n]) <= off_r[n] and abs(at.r[t]) <= off_r[t] and at.u[n] >= -off_u[n]:
        out.append(FREE)
    if still_n and mu == 0:
        out.append(FRICTIONLESS)
    elif still_n:
        if still_t and abs(at.r[t]) <= mu * at.r[n] + room:
            out.append(STICK)
        if abs(at.r[t] - mu * at.r[n]) <= room and at.u[t] <= off_u[t]:
            out.append(PLUS)
        if abs(at.r[t] + mu * at.r[n]) <= room and at.u[t] >= -off_u[t]:
            out.append(MINUS)
    return out if mu == 0 or tuple(out) in FANS else list(FANS[-1])


def _kept(statuses: Sequence[int], state: int) -> list[bool]:
    """Which inequalities of a state belong to the law that some statuses make.

    In the order of `PlaneProblem.slack_matrices`.
    """
    whole, alone = len(statuses) == len(FANS[-1]), len(statuses) == 1
    if state in (FREE, FRICTIONLESS):
        return [not alone]
    if state == STICK:
        return [whole or PLUS in statuses, whole or MINUS in statuses]
    return [whole or FREE in statuses, whole or STICK in statuses]


class _Cone:
    """One piece seen from a point on its border: the directions into it."""

    def __init__(self, system: PieceSystem, X: Array, active: NDArray[np.bool_]) -> None:
        self.system, self.X, self.active = system, X, active
        self.states = system.states.tolist()
        self.sign = system.sign

    @classmethod
    def of(
        cls, plane: PlaneProblem, states: States, active: NDArray[np.bool_]
    ) -> _Cone | None:
        """The cone of a pattern with some of its inequalities.

        None where its determinant has no sure sign, or its solution may violate another one.
        """
        system = PieceSystem.of(plane, states)
        found = system.inverse(DATA)
        if found is None:
            return None
        own = located(system, *found, DATA)
        if (own.slack[~active] <= own.off_slack[~active]).any():
            return None
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
