"""Status of every contact: the piece of the friction law that holds, without a threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .law.states import ContactStatus
from .protocol import Problem

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class ActiveSets:
    """Numbers of contacts in the sets of one step of an active set method.

    open, stick, slip: not in contact; in contact and held; in contact and sliding.  normal,
    tangential: |A_n| and |A_tau|, where the second counts open contacts that may slide too.
    kept: steps right before this one with the same sets.  change: of u, relative.
    """

    open: int
    stick: int
    slip: int
    normal: int
    tangential: int
    kept: int
    change: float

    @classmethod
    def of(cls, normal: Mask, tangential: Mask, kept: int, change: float) -> ActiveSets:
        """From which contacts are in A_n and A_tau, (nc,)."""
        slip, closed, able = (int(m.sum()) for m in (normal & tangential, normal, tangential))
        return cls(len(normal) - closed, closed - slip, slip, closed, able, kept, change)

    def __str__(self) -> str:
        return f"{self.open}/{self.stick}/{self.slip}"


def classify(
    problem: Problem, r: Array, u: Array
) -> tuple[NDArray[np.int8], NDArray[np.bool_], Array]:
    """(status, sliding, margin), each (nc,), of reactions r and velocities u, (nc, d).

    The status is the region of the law in which r - rho u lies: near a solution, and away from
    its kinks, any rho > 0 tells the same.  A closed contact without friction slips.

    margin is the distance to the nearest change of status, in the unit of r_N: rho u_N for an
    open contact, the smaller of r_N and the slack of the friction bound for a sticking one, the
    smaller of r_N and rho |u_T| for a slipping one; r_N counts from its largest tension.  Ties,
    which have no other status, have infinite ones.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # of what can not be squared
        closed, sliding = problem.law.regions(r, u, problem.rho)
    closed = closed & (
        (r[:, 0] + problem.law.cohesion > 0) | problem.law.tied
    )  # of an unconverged state: without force there is no contact
    status = np.where(
        closed, np.where(sliding, ContactStatus.SLIP, ContactStatus.STICK), ContactStatus.OPEN
    ).astype(np.int8)
    return status, sliding, margins(problem, r, u, status)


def margins(
    problem: Problem, r: Array, u: Array, status: NDArray[np.int8]
) -> Array:
    """The margins of `classify` for given statuses, (nc,), unit of r_N."""
    pressure = r[:, 0] + problem.law.cohesion
    shear = problem.law.shear
    slack = problem.law.bound(r) - np.linalg.norm(shear(r), axis=1)  # along r_T
    slide = problem.rho * np.linalg.norm(shear(u), axis=1)
    stick = status == ContactStatus.STICK
    closed = np.minimum(pressure, np.where(stick, slack, slide))
    closed = np.where(problem.law.tied, np.inf, closed)
    return np.maximum(
        np.where(status == ContactStatus.OPEN, problem.rho * u[:, 0], closed), 0.0
    )
