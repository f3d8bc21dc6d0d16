"""Bodies between planes that face each other: reactions that squeeze no more than loads do.

A rigid body in a guide without play can be squeezed by any force: reactions of both planes that
balance each other are no load, but friction goes with them, so that each squeeze is another
motion and all of them solve the problem.  Which one sweeps come to is chance.  Contacts that
give way have no squeeze without a load.  So the problem is first solved with W + e on the
diagonal, coarsely; those contacts alone that press there are solved as they are, and the whole
problem starts from what that gives.  Where the others stay closed or open without reactions it
is an answer, which the judge confirms without a sweep; else sweeps go on from there.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .quick import Posed
from .rows import Mobility, Rows, delassus
from .sweeping import FEWEST, WORK, Search, found_quickly

Array = NDArray[np.float64]
SOFT = 0.05  # of the trace of its own W_ii: how much a contact gives way at first
EARLY = 1e-6  # error of that
SAME = 1e-9  # 1 - cosine of two normals that are one; cosine of two that are perpendicular


class Guides(NamedTuple):
    """Planes of which some face each other: normals (p, 3) of all, and which do (p, p).

    They do where their normals are more than a right angle apart: a wedge faces itself.
    """

    normals: Array
    opposed: NDArray[np.bool_]

    @classmethod
    def of(cls, normals: Array) -> Guides | None:
        """None where no two of the planes face each other."""
        opposed = normals @ normals.T < -SAME
        return cls(normals, opposed) if opposed.any() else None

    def hold(self, rows: Rows, contacts: int, bodies: int) -> bool:
        """True where a body touches two planes that face each other."""
        on = np.flatnonzero(rows.master[:contacts] < 0)
        contact, plane = np.nonzero(rows.axes[on, 0] @ self.normals.T > 1.0 - SAME)
        touches = np.zeros((bodies, len(self.normals)))
        touches[rows.slave[on[contact]], plane] = 1.0
        return bool((touches @ self.opposed * touches).any())


def least_squeezed(
    rows: Rows, mobility: Mobility, posed: Posed, contacts: int, mu: float,
    tolerance: float,
) -> Posed:  # fmt: skip
    """The same problem, started from contacts alone that press if all give way."""
    data = posed.data.copy()
    own = data[posed.diagonal]
    gives = SOFT * np.trace(own, axis1=1, axis2=2)
    data[posed.diagonal] = own + gives[:, None, None] * np.eye(3)
    soft = Search(posed._replace(data=data), rows, mobility, contacts, mu, EARLY)
    found = soft.sweep(soft.r, max(FEWEST, WORK // max(len(posed.indices), 1)), 0)
    r = soft.latest if found is None else found.r
    presses = r[:, 0] > 0.0
    presses[contacts:] = True
    some: list[Any] = [part[presses] for part in rows]
    W = delassus(Rows(*some), *mobility)
    few = Posed(*W, posed.q[presses], r[presses])
    count = int(presses[:contacts].sum())
    search = Search(few, Rows(*some), mobility, count, mu, tolerance)
    start = np.zeros_like(r)
    start[presses] = found_quickly(search)[1]
    return posed._replace(start=start)
