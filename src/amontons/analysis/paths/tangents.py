"""One-sided tangents at a point: what they are, and whether a curve leaves along them.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.1.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..tolerances import SAME
from .cones import TangentCone
from .path import weight_of
from .touching import ahead, one_curve, stays_inside

Array = NDArray[np.float64]
INWARD = 1e-9  # rate, of a direction of length 1, below which a condition does not change


@dataclass(frozen=True, eq=False)
class Tangent:
    """A one-sided direction (y', p') of weighted length 1 and the piece into which it leads.

    strict: it leads into the inside of the piece; else touching names the others.
    """

    direction: Array
    rate: float
    piece: Hashable
    strict: bool = True
    touching: tuple[Hashable, ...] = ()

    @property
    def pieces(self) -> tuple[Hashable, ...]:
        """All pieces in which the curve along it lies."""
        return (self.piece, *self.touching)

    def __neg__(self) -> Tangent:
        return Tangent(-self.direction, -self.rate, self.piece, self.strict, self.touching)


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """All one-sided tangents at a point; complete: no piece was left out and none has a set.

    sets: pieces with more than one tangent line: there solutions are not isolated; cones: all
    tangents into these.  problem: the path whose unknowns the directions are in.
    """

    tangents: tuple[Tangent, ...]
    sets: tuple[Hashable, ...] = ()
    complete: bool = True
    reason: str = ""
    cones: tuple[TangentCone, ...] = ()
    problem: Any = field(default=None, repr=False)

    def told(self, apart: float, rounding: float) -> str:
        """The reason, and whether the point is one: borders that meet there up to a distance.

        apart: the largest distance to a border that counts as none there.
        """
        if apart <= rounding:
            return self.reason
        unresolved = (
            f"unresolved: borders of pieces meet here within {apart:.1e}, and curves that pass "
            "by each other at that distance are taken as one"
        )
        return "; ".join(filter(None, (self.reason, unresolved)))

    def others(
        self, direction: Array, rate: float, weight: float, piece: Hashable
    ) -> list[Tangent]:
        """The tangents but the one along a direction, by which the point was reached.

        Where several curves share that direction, the one on the piece that was left.
        """
        back = [
            t for t in self.tangents
            if product(t.direction, t.rate, direction, rate, weight) >= 1 - SAME
        ]  # fmt: skip
        own = [t for t in back if piece in t.pieces]
        left_out = own if own and len(back) > 1 else back
        return [t for t in self.tangents if not any(t is one for one in left_out)]


def merged(
    problem: Any, y: Array, p: float, found: list[Tangent], tolerance: float
) -> tuple[Tangent, ...]:
    """One tangent per curve; pieces that share it are `touching`.

    What is not strict was found to first order only: there the curve itself is asked.
    """
    straight, weight = getattr(problem, "straight", False), weight_of(problem, len(y))
    kept: list[tuple[Tangent, list[Any]]] = []
    for one in sorted(found, key=lambda t: not t.strict):
        spots: list[Any] = []
        if not (one.strict or straight):
            spots = ahead(problem, one.piece, y, p, one.direction, one.rate)
            near = near_zero(problem, one.piece, y, p, tolerance)
            if not stays_inside(problem, one.piece, y, p, near, spots):
                continue
        for k, (other, others) in enumerate(kept):
            along = product(one.direction, one.rate, other.direction, other.rate, weight)
            if along > 1 - SAME and one_curve(spots, others):
                kept[k] = replace(other, touching=(*other.touching, one.piece)), others
                break
        else:
            kept.append((one, spots))
    return tuple(tangent for tangent, _ in kept)


def inward(
    problem: Any, piece: Hashable, y: Array, p: float, direction: Array, rate: float,
    tolerance: float,
) -> bool | None:  # fmt: skip
    """Whether a direction leads strictly into a piece; None where it leads out of it."""
    step = 1e-6 * max(1.0, float(np.abs(y).max(initial=0)))
    near = near_zero(problem, piece, y, p, tolerance)
    here = problem.margins(piece, y, p)
    if (here[~near] < 0).any():
        return None
    half, whole = (
        (problem.margins(piece, y + h * direction, p + h * rate)[near] - here[near]) / h
        for h in (step / 2, step)
    )
    rates = 2 * half - whole  # one-sided, and not that of a margin's curvature
    limit = INWARD * max(1.0, float(np.abs(direction).max(initial=0)))
    if (rates < -limit).any():
        return None
    return bool((rates > limit).all())


def near_zero(problem: Any, piece: Hashable, y: Array, p: float, tolerance: float) -> Any:
    """Mask of the margins that count as zero."""
    return np.abs(problem.margins(piece, y, p)) <= tolerance


def product(a: Array, ap: float, b: Array, bp: float, weight: float) -> float:
    """The weighted product of (a, ap) and (b, bp)."""
    return float(weight * (a @ b) + ap * bp)
