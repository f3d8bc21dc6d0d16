"""Which contacts are where: the index sets of [LR] eq. (25), at a solution of a path.

With z = r - u, normal and tangential, and the bound b of |z_T| (mu z_N where z_N > 0 under
Coulomb's law, else zero), contacts are free, in strong contact or grazing by the sign of z_N,
and in strong stick, in slip or in impending slip by that of b - |z_T|.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.1.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class IndexSets:
    """Numbers of contacts, ascending; the letters of [LR] (25) in brackets.

    The first three make up all contacts, the last four too.  A free contact counts as in slip
    where it moves and as in impending slip where it does not, as there.
    """

    free: Indices  # [I_f] not in contact
    closed: Indices  # [I_c] strong contact
    grazing: Indices  # [I_z] closed without force
    frictionless: Indices  # [I_0]
    stick: Indices  # [I_s] strong stick
    slip: Indices  # [I_l]
    impending: Indices  # [I_i] force at its bound, no motion

    @property
    def undecided(self) -> Indices:
        """I_z and the contacts of I_c in I_i: more than one piece meets there."""
        return np.union1d(self.grazing, np.intersect1d(self.closed, self.impending))

    @property
    def at_rest(self) -> Indices:
        """I_z and I_i: without force and without motion."""
        return np.intersect1d(self.grazing, self.impending)

    def record(self) -> dict[str, list[int]]:
        """What the JSON file holds."""
        return {item.name: getattr(self, item.name).tolist() for item in fields(self)}

    def __str__(self) -> str:
        parts = [
            f"{item.name} {', '.join(map(str, members))}"
            for item in fields(self)
            if len(members := getattr(self, item.name))
        ]
        return "; ".join(parts)


def index_sets(
    normal: Array, tangential: Array, bound: Array, frictionless: NDArray[np.bool_],
    tolerance: float,
) -> IndexSets:  # fmt: skip
    """The sets of z_N (nc,), |z_T| (nc,) and the bound (nc,) of the latter.

    tolerance: distance to a border that counts as none, in the unit of z.
    """
    apart = tangential - bound
    rubs = ~frictionless
    where = np.flatnonzero
    return IndexSets(
        free=where(normal < -tolerance),
        closed=where(normal > tolerance),
        grazing=where(np.abs(normal) <= tolerance),
        frictionless=where(frictionless),
        stick=where(rubs & (apart < -tolerance)),
        slip=where(rubs & (apart > tolerance)),
        impending=where(rubs & (np.abs(apart) <= tolerance)),
    )


def told_sets(problem: Any, y: Array, p: float) -> IndexSets | None:
    """The sets at a point, where the problem tells them."""
    tell = getattr(problem, "index_sets", None)
    return None if tell is None else tell(y, p)


def told_rates(problem: Any, y: Array, p: float) -> Any:
    """The first-order system of contacts at a point, where the problem tells it."""
    tell = getattr(problem, "contact_rates", None)
    return None if tell is None else tell(y, p)
