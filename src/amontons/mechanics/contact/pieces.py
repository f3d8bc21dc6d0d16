"""Pieces of the law of `current`: the statuses of contacts, and in 2D both ways of slip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...problem.law.states import OPEN, SLIP, STICK

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pieces = NDArray[np.int8]
BACK = 3  # beside the statuses: slip against t, 2D only


def slides(kind: Pieces) -> NDArray[np.bool_]:
    """Pieces SLIP and BACK, (nc,)."""
    return (kind == SLIP) | (kind == BACK)


def tangents(n: Array) -> Array:
    """t of `frames` in 2D, (nc, 2)."""
    return np.stack([n[:, 1], -n[:, 0]], axis=1)


def friction_slopes(
    kind: Pieces, n: Array, z: Array, along: Array, bound: Array
) -> tuple[Array, Array]:
    """Derivatives of P of `current` by z_T, (nc, d, d), and by the bound, (nc, d).

    kind (nc,): STICK, SLIP, BACK; n, z (nc, d); along (nc,): of `ContactPoint`; bound (nc,).
    """
    d = n.shape[1]
    in_z = np.where((kind == STICK)[:, None, None], np.eye(d), 0.0)
    slip = slides(kind)
    if d == 2:
        sign = np.where(kind == SLIP, 1.0, -1.0)
        return in_z, np.where(slip, sign, 0.0)[:, None] * tangents(n)
    length = np.where(along > 0, along, 1.0)
    s = z / length[:, None]
    turning = (bound / length)[:, None, None] * (np.eye(d) - s[:, :, None] * s[:, None, :])
    in_z = np.where(slip[:, None, None], turning, in_z)
    return in_z, np.where(slip[:, None], s, 0.0)


def turned_slip(kind: Pieces, n: Array, bound: Array) -> Array:
    """2D: the derivative of +-t by n at a fixed bound, (nc, 2, 2): dt = -n (t . dn)."""
    size = np.select([kind == SLIP, kind == BACK], [1.0, -1.0], 0.0) * bound
    return -size[:, None, None] * n[:, :, None] * tangents(n)[:, None, :]


def margins(
    pieces: Pieces, z_normal: Array, along: Array, bound: Array, without: Mask
) -> Array:
    """Distances to the borders of given pieces, (nc, 3): all positive inside of them.

    Contacts without friction, without (nc,), slip: no point is inside of their other closed
    pieces.
    """
    closed = (pieces > 0) & (pieces < 4)
    z = np.where(closed, z_normal, -z_normal)
    kind = pieces % 4
    far = np.full(len(z), np.inf)
    borders = [bound - along, along - bound, -along - bound]
    ahead = np.select([kind == STICK, kind == SLIP, kind == BACK], borders, far)
    behind = np.where(kind == STICK, bound + along, far)
    other = without & ((kind == STICK) | (kind == BACK))  # pieces they do not have
    ahead[without], behind[without] = np.inf, np.inf
    ahead[other] = -np.inf
    return np.stack([z, ahead, behind], axis=1)


def active(
    along: Array, bound: Array, closed: Mask, alone: Mask, without: Mask, tied: Mask
) -> Pieces:
    """Which piece of the law is active, (nc,): OPEN, STICK, SLIP or, in 2D, BACK.

    Contacts without friction slip.  Under a given bound, alone, also open contacts stick or
    slip; they have 4 added.  All (nc,), along of `ContactPoint`.
    """
    slide = np.abs(along) > bound
    out = np.where(slide, np.where(along < 0, BACK, SLIP), STICK)
    out[without] = SLIP
    out[~closed & ~alone] = OPEN
    out[~closed & alone] += 4
    out[tied] = STICK
    return out.astype(np.int8)
