"""What a state says of its contacts, said once: a status each, and reactions that keep to it.

A method stops within the tolerance of a solution, and may leave some 1e-9 of the load on a
contact whose motion says that it is open.  Then an area counted where r_N > 0 is not the area
of the contacts that are closed.  So an open contact carries nothing here, exactly (under
Tresca's law no r_N, and no shear above its bound; with cohesion its tension).  That changes r
within the error that was judged; the driver judges it again.

Closed contacts keep what was found: to cut their shear to what friction allows would move, by
as little, gaps that a linear solve has closed to rounding; steps in time take them for open.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import njit
from ..linear.blocks import spatial
from .judge.contacts import settled_contact
from .judge.measures import Weakest
from .law import Law

if TYPE_CHECKING:
    from .equations import Equations

Array = NDArray[np.float64]
Motion = tuple[Array, Array | None]  # u (nc, d), and v (n,) where there is one


class Settled(NamedTuple):
    """Reactions r (nc, d) that keep to their status, (nc,), and what `classify` says besides.

    changed: False where r is what was given, and then it is the same array.
    """

    r: Array
    status: NDArray[np.int8]
    sliding: NDArray[np.bool_]
    changed: bool


class Accepted(NamedTuple):
    """A state whose error will do, and what else is asked of it.

    r, v, error: as they were, or with reactions that keep to their statuses.  weakest: None
    where contacts are not looked at one by one, or where the error of the new r will not do.
    motion, settled: None where they have not been found on the way.
    """

    r: Array
    v: Array | None
    error: float
    weakest: Weakest | None = None
    motion: Motion | None = None
    settled: Settled | None = None


def settle(law: Law, rho: Array, r: Array, u: Array) -> Settled:
    """The status of every contact at r, u (nc, d), as by `classify`, and r that keeps to it.

    rho (nc,): unit of r / u, 0 where a contact can not react.
    """
    status, sliding = np.empty((2, len(r)), np.int8)
    rows, moved = spatial(law.pressed(r)), spatial(law.stretched(u, r))
    kept = np.empty((len(r), 3))
    changed = _settle(rows, moved, rho, law.kind, law.parameters, kept, status, sliding)
    out = law.released(np.ascontiguousarray(kept[:, : r.shape[1]])) if changed else r
    return Settled(out, status, sliding.view(np.bool_), changed)


def accepted_exactly(
    problem: Equations, r: Array, v: Array | None, error: float, tolerance: float
) -> Accepted:
    """What `Problem.accepted` says by the exact measure, in the Delassus form."""
    d, found = r.shape[1], r
    while (at := problem.assessed(found)).changed:
        found = np.ascontiguousarray(at.kept[:, :d])
    told = Settled(found, at.status, at.sliding, found is not r)
    if told.changed:  # its motion is found again
        v, error = None, at.error
    weakest = at.weakest if error <= tolerance else None
    return Accepted(found, v, error, weakest, (at.u[:, :d], None), told)


def settled(
    law: Law, rho: Array, r: Array, velocity: Callable[[Array], Motion]
) -> tuple[Motion, Settled]:
    """The motion of reactions that keep to the statuses of that motion, and these.

    Other reactions may move otherwise, and that may have other statuses; every round opens a
    contact or takes shear from one, so that it ends.
    """
    while True:
        moved = velocity(r)
        found = settle(law, rho, r, moved[0])
        if not found.changed:
            return moved, found
        r = found.r


@njit(cache=True, error_model="numpy")
def _settle(r, u, rho, kind, parameters, kept, status, sliding):  # noqa: PLR0913
    """Fill kept (nc, 3), status and sliding (nc,); True where kept is not r."""
    changed = False
    for i in range(len(r)):
        state, slides, normal, shear = settled_contact(
            r[i, 0], r[i, 1], r[i, 2], u[i, 0], u[i, 1], u[i, 2], rho[i], kind[i], parameters[i]
        )
        status[i], sliding[i] = state, slides
        for k in range(3):
            kept[i, k] = (shear if k else normal) * r[i, k]
            changed = changed or kept[i, k] != r[i, k]
    return changed


__all__ = ["Accepted", "Motion", "Settled", "accepted_exactly", "settle", "settled"]
