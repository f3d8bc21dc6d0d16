"""What a state says of its contacts, said once: a status each, and reactions that keep to it.

A method stops within the tolerance of a solution, and may leave some 1e-9 of the load on a
contact whose motion says that it is open.  Then an area counted where r_N > 0 is not the area
of the contacts that are closed.  So an open contact carries nothing here, exactly (under
Tresca's law no r_N, and no shear above its bound).  That changes r within the error that was
judged; the driver judges it again.

Closed contacts keep what was found: to cut their shear to what friction allows would move, by
as little, gaps that a linear solve has closed to rounding; steps in time take them for open.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .compiled import njit
from .cones import Law, Tresca
from .errors import SingularOperator
from .judge import Measure
from .problem import FrictionProblem
from .status import ContactStatus

Array = NDArray[np.float64]
Motion = tuple[Array, Array | None]  # u (nc, d), and v (n,) where there is one
EPSILON = float(np.finfo(float).eps)
OPEN, SLIP, STICK = (int(status) for status in ContactStatus)


@dataclass(frozen=True, eq=False)
class Settled:
    """Reactions r (nc, d) that keep to their status, (nc,), and what `classify` says besides.

    changed: False where r is what was given, and then it is the same array.
    """

    r: Array
    status: NDArray[np.int8]
    sliding: NDArray[np.bool_]
    changed: bool


def settle(law: Law, rho: Array, r: Array, u: Array) -> Settled:
    """The status of every contact at r, u (nc, d), as by `classify`, and r that keeps to it.

    rho (nc,): unit of r / u, 0 where a contact can not react.
    """
    out, status, sliding, changed = _settle(
        np.ascontiguousarray(r), np.ascontiguousarray(u), rho, law.coefficient,
        isinstance(law, Tresca),
    )  # fmt: skip
    return Settled(out if changed else r, status, sliding, changed)


def motion(problem: FrictionProblem, r: Array, v: Array | None = None) -> Motion:
    """(u, v) of a state whose v is given, else of its reactions; v = 0 where M is singular."""
    if v is not None:
        return problem.local_velocity(v), v
    try:
        return problem.velocity(r)
    except SingularOperator:  # and no solver has found another v
        return at_rest(problem)


def at_rest(problem: FrictionProblem) -> Motion:
    """(u, v) of v = 0."""
    v = np.zeros(problem.unknowns)
    return problem.local_velocity(v), v


def settled_state(
    problem: FrictionProblem, r: Array, v: Array | None
) -> tuple[Motion, Settled]:
    """`settled` for a state, by the form and the v that judge it."""
    exact = problem.measure is Measure.EXACT
    form = problem.condensed() if exact else problem
    kept = None if exact else v
    return settled(problem.law, form.rho, r, lambda r: motion(form, r, kept))


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
def _settle(r, u, rho, coefficient, tresca):
    nc, d = r.shape
    out, changed = r.copy(), False
    status, sliding = np.zeros(nc, np.int8), np.zeros(nc, np.bool_)
    for i in range(nc):
        slip2 = x2 = r2 = 0.0
        for k in range(1, d):
            slip2 += u[i, k] * u[i, k]
            x = r[i, k] - rho[i] * u[i, k]
            x2 += x * x
            r2 += r[i, k] * r[i, k]
        x, shear, mu = np.sqrt(x2), np.sqrt(r2), coefficient[i]
        if tresca:
            closed = r[i, 0] - rho[i] * u[i, 0] > 0.0
            slides = x > mu
        else:
            normal = r[i, 0] - rho[i] * (u[i, 0] + mu * np.sqrt(slip2))
            closed = mu * x > -normal
            slides = closed and not (x <= mu * normal and mu > 0.0)
        sliding[i] = slides
        if closed and r[i, 0] > 0.0:
            status[i] = SLIP if slides else STICK
            continue
        changed = changed or r[i, 0] != 0.0
        out[i, 0] = 0.0
        bound = mu if tresca else 0.0
        if shear > bound * (1.0 + 4.0 * EPSILON):
            changed = True
            for k in range(1, d):
                out[i, k] *= bound / shear
    return out, status, sliding, changed


__all__ = ["Motion", "Settled", "at_rest", "motion", "settle", "settled", "settled_state"]
