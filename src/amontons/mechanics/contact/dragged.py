"""Friction along components that supports hold, at contacts whose motion there is known.

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
SOLVED = 1e-15  # what (1) may miss, and steps that change nothing, over the forces in it
ITERATIONS = 100  # of (1) at most: halvings lead to the last digit in some fifty


def dragged(point: ContactPoint) -> ContactPoint:
    """The point with lambda_H of (1) in its force, where anything moves that supports hold."""
    held = ~point.contact.free & point.contact.heard
    if not held.any():
        return point
    moved = (held & (point.slip != 0)).any(axis=1)
    moved &= ~(held & (point.n != 0)).any(axis=1) & ~point.tied & (point.bound > 0)
    if not moved.any():
        return point
    point = replace(point, held=held & moved[:, None])
    return replace(point, force=point.force + _forces(point))


def before(contact: CurrentContact, force: Array) -> Array:
    """What is added to s for forces (nc, d) at the end of the last step, in global axes."""
    held = contact.heard & ~contact.free
    return -GIVE * np.where(held, force, 0.0) / contact.rho[:, None]


def _forces(point: ContactPoint) -> Array:
    """lambda_H, (nc, d), by Newton's method between the ends where it may lie."""
    held, force = point.held, point.force
    assert held is not None
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
    own, held = point.of_all(pieces), point.held
    free, heard = point.contact.free[:, None, :], point.contact.heard[:, None, :]
    if held is None:
        return own[0] * free, own[1], own[2], own[3] * heard, own[4]
    active = own if pieces is None else point.of_all()
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
