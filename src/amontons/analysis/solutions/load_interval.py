"""Load and friction between two problems, c = (1 - t) c_0 + t c_1 and mu likewise, scaled.

Where all of q_i of a contact vanishes at an end, as where a load grows from zero on closed
gaps, all patterns meet: the interval begins or ends START of its length inside.  Where all of q
does, solutions at all other loads are multiples of those at the other end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scaled import Scaled
from ..tolerances import DATA

Array = NDArray[np.float64]
Span = tuple[float, float]
START = 1e-6  # of the interval, by which ends without load are left out


@dataclass(frozen=True, eq=False)
class Piece:
    """A status pattern that has a solution at every t from low to high.

    pattern: as of `PieceSolution`.  r (nc, d): reactions in the middle, or where `at` says, as
    in 3D, where the solutions of a piece are a curve that may turn back.
    """

    pattern: str
    low: float
    high: float
    r: Array
    at: float | None = None

    @property
    def middle(self) -> float:
        """Where r is."""
        return (self.low + self.high) / 2 if self.at is None else self.at


@dataclass(frozen=True, eq=False)
class Pieces:
    """What a search of an interval found; doubt: empty where these are proved to be all.

    interval: the t that this holds for.  touching: patterns whose solutions are those of
    pieces within NEAR.  examined: partial patterns, in 3D boxes, that were looked at.
    undecided: in 3D, with a doubt, the spans of t outside of which the pieces are all; in 2D
    always empty, as a doubt is one about all t.
    """

    pieces: tuple[Piece, ...]
    interval: Span
    touching: int
    doubt: str
    examined: int
    undecided: tuple[Span, ...] = ()


class LoadInterval:
    """loads (2, nc d) and mus (2, nc) at both ends, scaled by the larger unit of both.

    rubs: whether friction varies.  interval: the t that can be searched.  zero (2,): at which
    end there is no load at all.
    """

    def __init__(self, a: Scaled, b: Scaled) -> None:
        self.scaled = a if a.to_u[0] >= b.to_u[0] else b
        self.loads = np.stack([(x.q * (x.to_u / self.scaled.to_u)).ravel() for x in (a, b)])
        self.mus = np.stack([a.mu, b.mu])
        self.rubs = bool((a.mu != b.mu).any())
        size = np.abs(self.loads).max()
        rows = np.abs(self.loads.reshape(2, -1, a.dimension)).max(axis=2)
        still = (rows <= DATA * size).any(axis=1)
        self.interval = (START if still[0] else 0.0, 1.0 - START if still[1] else 1.0)
        self.zero: NDArray[np.bool_] = np.logical_not(self.loads.any(axis=1))

    def at(self, a: float, b: float) -> tuple[Array, Array]:
        """(loads (2, nc d), coefficients (2, nc)) at both ends of a span."""
        t = np.array([[a], [b]])
        loads, mus = ((1 - t) * x[0] + t * x[1] for x in (self.loads, self.mus))
        return loads, mus
