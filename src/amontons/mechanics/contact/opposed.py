"""How far two facets stand opposite each other: what is edge-on counts as it is seen both ways.

A slave facet sees the master along its own normal n.  Of a facet of the master, normal N, that
it sees edge-on that tells of a plane, not of a place: a side of a slave beside a slab sees the
top of that in front of it, far away, and its lower corner lies behind the plane of the top,
continued beyond its end.  What touches is opposite both ways.  So integrals over what the
slave's facet sees are taken times

    o = W + (1 - W) S(2 c) S(2 f),    W = S(4 c^2 - 1),    c = - n . N,                     (1)

f the part that they share along N: of the slave's facet as it is seen from there, or of the
master's if that is less; S of `edge_on`.  Within 45 degrees all counts, W = 1.  From 60 degrees
on, W = 0, counts what the master sees as well, whole from half a facet on, as beside a rim that
is pressed in deep, and fades as the angle comes near a right one: a side whose foot leans out
by a little tells nothing of what lies under it.  o has two continuous derivatives by c and f.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .edge_on import rising

Array = NDArray[np.float64]
Values = NDArray[Any]  # real, or complex in the search for derivatives
STEP = 1e-100


def cosine(slave: Values, master: Values) -> Values:
    """c of (1), (k,), of facets with corners slave (k, a, d) and master (k, b, d); not < 0."""
    a, b = area(slave), area(master)
    across, size = -(a * b).sum(axis=1), (a * a).sum(axis=1) * (b * b).sum(axis=1)
    ok = (across.real > 0) & (size.real > 0)
    return np.where(ok, across / np.sqrt(np.where(ok, size, 1.0)), 0.0)


def area(corners: Values) -> Values:
    """Area vectors (k, 3) of facets; of lines their edges (k, 2)."""
    if corners.shape[2] == 2:
        return np.asarray(corners[:, 1] - corners[:, 0])
    return 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])


def opposed(slave: Values, master: Values, seen: Values) -> Values:
    """o of (1), (k,); seen (k,): what they share along the master's normal, an area."""
    a, b = (np.sqrt((one * one).sum(axis=1)) for one in (area(slave), area(master)))
    c = cosine(slave, master)
    most = np.where((a * c).real < b.real, a * c, b)
    most = np.where(most.real > 0, most, 1.0)
    whole = rising(4 * c * c - 1)
    return np.asarray(whole + (1 - whole) * rising(2 * c) * rising(2 * seen / most))


def steps(slave: Array, master: Array) -> tuple[Values, Values]:
    """Corners moved by i STEP along every coordinate, (k ways, a, d) and (k ways, b, d)."""
    (k, a, d), both = slave.shape, np.concatenate([slave, master], axis=1)
    ways = both.shape[1] * d
    moved = both.reshape(k, 1, ways) + 1j * STEP * np.eye(ways)
    moved = moved.reshape(k * ways, both.shape[1], d)
    return moved[:, :a], moved[:, a:]
