"""Friction along components that supports hold.

A node that supports hold along the surface of an obstacle moves on it by a given s_H.  What
friction gives it there, lambda_H, nobody asks for in a balance of forces: the support takes it
at once.  It is what the law says, at the force lambda_F and motion s_F of the other components,

    law(lambda_F + lambda_H, x)_H = 0,                                                      (1)

law of `current` (2) or `framed_point`: of one sign, and of one solution where s_H is not zero,
between the most that friction bears, either way.  Its rows F stay with

    dlaw_F = R_F - R_FH R_HH^-1 R_H,    R: derivatives of all of the law.                   (2)

In z_T a part 1 - GIVE of lambda_H counts, so that R_HH is never zero: contacts that stick do so
by springs of 1 / GIVE times rho, drawn by what friction was at the end of the last step, which
`before` adds to s_H.  Nodes that do not move keep it as far as friction still bears it, nodes
that never did have none, and rounding of s_H is no slip.

Between bodies s_H follows the master, on which lambda_H acts by the averages of `moved_pairs`,
so that (1) is an equation for lambda_H and the master's motion together: a multiplier where
contacts stick, a sign where they slip.  Contacts that stick there give way by more,
GIVE_BETWEEN, as the matrix of Newton's steps has their springs; `model.rubbed_states` moves
lambda_H with v, so that steps find from slip to stick, and `given` here.  On given pieces of
the law, which contacts that are to close have, lambda_H is that of (1) on these.  Paths leave
friction between bodies along held components out, see `model.rubbed_between`.

rho > 0 in z_T may be any, and is SOFT times that of other contacts: that is the stiffness of a
node with its neighbours at rest, while nodes that supports hold slide together.  With more of
it all of them go from slip past stick to slip the other way in every step (underside of a block
held on a slab, both nearly incompressible: 97 to 395 steps, or no solution, with 1; 3 to 14
with .1); with far less, what slips seems to stick (17 steps for 4 with .01, and no solution of
a stiff block on a soft slab, which takes 15).  Other compressible bodies that were tried, in 2D
and 3D, with mu from .1 to 1, Tresca's law or springs, take one to four steps with each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .current import ContactPoint, CurrentContact, Partials, Pieces

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
GIVE = 1e-9  # of lambda_H / rho: far beyond what a mesh tells, and above rounding
GIVE_BETWEEN = 1e-4  # between bodies, where the motion follows lambda_H
SOFT = 0.1  # of rho in z_T, where supports hold slaves that slide on a body
SOLVED = 1e-15  # what (1) may miss, and steps that change nothing, over the forces in it
SECOND = 1e-9  # steps of Newton's method, over the forces, after which the error is rounding
ITERATIONS = 100  # of (1) at most: halvings lead to the last digit in some fifty


def dragged(
    point: ContactPoint, given: Array | None = None, pieces: Pieces | None = None
) -> ContactPoint:
    """The point with lambda_H of (1) in its force, where anything moves that supports hold.

    given (nc, d): lambda_H between bodies, in the place of (1); pieces (nc,): of the law in
    (1) between bodies, else the active ones.
    """
    held = ~point.contact.free & point.contact.heard
    if not held.any():
        return point
    between = held & ~point.contact.at_obstacles[:, None]
    moved = (held & (point.slip != 0)).any(axis=1) & (point.bound > 0)
    moved &= ~(held & (point.n != 0)).any(axis=1) & ~point.tied
    held = between | held & moved[:, None]
    if not held.any():
        return point
    point = replace(point, held=held)
    if given is not None:
        point = replace(point, force=point.force + np.where(between, given, 0.0))
        return replace(point, force=point.force + _forces(point, held & ~between))
    point = replace(point, force=point.force + _forces(point, held))
    if pieces is None or not between.any():
        return point
    return _on_pieces(point, pieces, between)


def _on_pieces(point: ContactPoint, pieces: Pieces, between: Mask) -> ContactPoint:
    """The point with lambda_H between bodies, (nc, d), of given pieces of the law."""
    point = replace(point, chosen=np.where(between.any(axis=1), pieces, point.pieces))
    for _ in range(ITERATIONS):  # two where the law of the pieces is linear, as in 2D
        step = missed(point)
        point = replace(point, force=point.force + step)
        size = point.bound + np.linalg.norm(point.force * between, axis=1)
        if (np.abs(step).max(axis=1) <= SECOND * size).all():
            break
    return point


def softened(contact: CurrentContact) -> Array:
    """rho in z_T, (nc,): SOFT of it where supports hold slaves on a master."""
    if contact.rubbed is None:
        return contact.rho
    return np.where(contact.rubbed.any(axis=1), SOFT * contact.rho, contact.rho)


def before(contact: CurrentContact, force: Array) -> Array:
    """What is added to s for forces (nc, d) at the end of the last step, in global axes."""
    held = contact.heard & ~contact.free
    return -contact.giving * np.where(held, force, 0.0) / contact.rho_along[:, None]


def _forces(point: ContactPoint, held: Mask) -> Array:
    """lambda_H, (nc, d), by Newton's method between the ends where it may lie."""
    force = point.force
    if not held.any():
        return np.zeros_like(force)
    stretch = point.contact.law.stretch
    most = point.bound
    if stretch is not None:
        most = most * np.linalg.eigvalsh(stretch)[:, -1]
    size = np.where(held.any(axis=1), most + np.linalg.norm(point.z_tangent, axis=1), 1.0)
    single = held.sum(axis=1) == 1
    low, high = np.where(held, -most[:, None], 0.0), np.where(held, most[:, None], 0.0)
    way = point.z_tangent * held
    length = np.linalg.norm(way, axis=1, keepdims=True)
    found = np.where(held, point.bound[:, None] * way / np.where(length > 0, length, 1.0), 0.0)
    for _ in range(ITERATIONS):
        here = replace(point, force=force + found)
        missing = np.where(held, here.residual(), 0.0)
        step = _solved(here.of_all()[0], held, missing[:, :, None])[:, :, 0]
        least = np.minimum(np.abs(missing), np.abs(step)).max(axis=1)
        if (least <= SOLVED * size).all():
            break
        high, low = np.where(missing > 0, found, high), np.where(missing < 0, found, low)
        tried = found - step
        inside = (tried >= low) & (tried <= high) | ~single[:, None]
        found = np.where(inside, tried, (low + high) / 2)
    return found


def _solved(by_force: Array, held: Mask, right: Array) -> Array:
    """R_HH^-1 times right (nc, d, m), zero in other rows."""
    both = held[:, :, None] & held[:, None, :]
    matrix = np.where(both, by_force, np.eye(held.shape[1]))
    return np.linalg.solve(matrix, np.where(held[:, :, None], right, 0.0))


def without_held(point: ContactPoint, pieces: Pieces | None) -> Partials:
    """(2) in the place of the partials of all components, on some (the active) pieces."""
    own, held = point.slopes if pieces is None else point.of_all(pieces), point.held
    free, heard = point.contact.free[:, None, :], point.contact.heard[:, None, :]
    if held is None:
        return own[0] * free, own[1], own[2], own[3] * heard, own[4]
    active = point.slopes
    by_held = own[0] * held[:, None, :]

    def reduced(whole: Array, acting: Array) -> Array:
        flat = acting.reshape(*held.shape, -1)
        more = by_held @ _solved(active[0], held, flat)
        return whole - more.reshape(whole.shape)

    by_force, by_normal, by_gap, by_motion, by_axis = (
        None if whole is None or acting is None else reduced(whole, acting)
        for whole, acting in zip(own, active, strict=True)
    )
    return by_force * free, by_normal, by_gap, by_motion * heard, by_axis  # type: ignore


def between_bodies(point: ContactPoint) -> Mask | None:
    """Held components between bodies that the law hears, (nc, d); None for none."""
    if point.held is None:
        return None
    held = point.held & ~point.contact.at_obstacles[:, None]
    return held if held.any() else None


def of_held(point: ContactPoint) -> tuple[Array, Partials] | None:
    """lambda_H (nc, d) between bodies and its partials; None where there is none."""
    if (held := between_bodies(point)) is None:
        return None
    free, heard = point.contact.free[:, None, :], point.contact.heard[:, None, :]
    active = point.slopes

    def by(acting: Array) -> Array:
        return -_solved(active[0], held, acting.reshape(*held.shape, -1)).reshape(acting.shape)

    by_force, by_normal, by_gap, by_motion = (by(part) for part in active[:4])
    by_axis = None if active[4] is None else by(active[4])
    partials = by_force * free, by_normal, by_gap, by_motion * heard, by_axis
    return point.force * held, partials


def missed(point: ContactPoint) -> Array:
    """What (1) asks to be added to lambda_H between bodies, (nc, d), to first order."""
    return asked(point, point.residual(point.chosen))


def asked(point: ContactPoint, law: Array) -> Array:
    """The same with slopes of here where the law (nc, d) is that of another point."""
    held = between_bodies(point)
    assert held is not None
    return -_solved(point.slopes[0], held, law[:, :, None])[:, :, 0]
