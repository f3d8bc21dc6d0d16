"""Slip of contacts that close within a step: what they slid before is none.

A contact with the gap g > 0 at the beginning of a step, which came closer by c > 0 and slid by
s_T in the last one (as long as this one), closes about a part g / c into the step if bodies go
on like that, and until then slides by

    a = |s_T| min(g / c, 1)                                                                 (1)

against no force.  Were that counted as slip, and so taken back by stick, the edge of contact
where bodies roll onto each other would reach as far ahead of itself as contacts go in half a
step, in the mean: forces of rolling have errors of first order in the step that way, with (1)
of second order.  Compare [VW], for steady rolling on a fixed grid.

(1) tells of the past, so that it bounds what is not counted and does not prescribe it: up to
a, either way, a contact that closes has no friction, see `current`, and friction never acts
along with a motion.  If bodies do not go on as before (they come to rest, or another load
begins), contacts that close have none in that step where they slide by less than a; those that
have touched before are not concerned, nor those that are SOON or more steps away.

s_T is that of (3') in `current_mortar` between two bodies, and so turns with them.

[VW] E. Vollebregt, P. Wilders, "FASTSIM2: a second-order accurate frictional rolling contact
algorithm", Comput. Mech. 47 (2011) 105-116.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .current_pairs import Meetings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SOON = 2.0  # g / c up to which a contact may close in the step, if bodies come closer faster


def slid_while_open(
    earlier: Meetings, now: Meetings, before: Array, u: Array, open_: Mask,
    offset: Array | float = 0.0, least: float = 0.0,
) -> Array:  # fmt: skip
    """a of (1), (nc,), a length; zero of contacts that touch or are far from it.

    earlier, now: where the pairs met at the beginning and the end of the last step, at
    displacements before and u (nodes, d); open_ (nc,): contacts open at its end;
    offset (nc,): of gaps, by the law; least: the gap that is none but rounding.
    """
    gap, closer = now.gap + offset, earlier.gap - now.gap
    comes = open_ & now.met & earlier.met & (gap > least) & (gap < SOON * closer)
    if not comes.any():
        return np.zeros(len(gap))
    n, s = now.normals, now.motion(u, before, earlier)
    s = s - n * (n * s).sum(axis=1)[:, None]
    part = np.minimum(gap / np.where(comes, closer, 1.0), 1.0)
    return np.where(comes, part * np.linalg.norm(s, axis=1), 0.0)


def left(z: Array, short: Array) -> Array:
    """1 - short / |z|, at least zero, (nc,), for z (nc, m): what is left of its length."""
    size = np.linalg.norm(z, axis=1)
    longer = size > short
    part = np.where(longer, 1 - short / np.where(longer, size, 1.0), 0.0)
    return np.where(short > 0, part, 1.0)


def slope_of_left(z: Array, short: Array) -> Array:
    """Derivative of left(z, short) z by z, (nc, m, m)."""
    part, size = left(z, short), np.linalg.norm(z, axis=1)
    way = z / np.where(size > 0, size, 1.0)[:, None]
    along = np.where(part > 0, 1 - part, 0.0)[:, None, None]
    return part[:, None, None] * np.eye(z.shape[1]) + along * way[:, :, None] * way[:, None, :]
