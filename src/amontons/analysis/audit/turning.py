"""Constraints that turn with their nodes: how far an answer may be off their linear equations.

*MPC of type PLANE, STRAIGHT and BEAM hold nodes on the plane or line through moved nodes, or
at their distance.  Our equations are linear about the undeformed nodes: with a direction n that
becomes n', and nodes that are off their place in the plane (or line) by w, they miss the length
|n' - n| |w|.  Tie forces act along n': nodes that n leaves free get |n' - n| of them, and those
that span it the moment |w| of them over the width that they span.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SPANNING = {"PLANE": 3, "STRAIGHT": 2, "BEAM": 1}  # nodes that say where the others are


@dataclass(frozen=True, eq=False)
class Turning:
    """One such constraint: its kind, and the numbers (k,) of its nodes in the whole model."""

    kind: str
    nodes: Index


@dataclass(frozen=True, eq=False)
class Turned:
    """What moved nodes change: normal or way before, after (3,), and what follows of them.

    off (k, 3): w of the nodes after those that span; shares (k, spanning); inverse_width: one
    over a length, of the narrowest way across the spanning nodes.
    """

    before: Array
    after: Array
    off: Array
    shares: Array
    inverse_width: float

    @property
    def tilt(self) -> float:
        """|n' - n|."""
        return float(np.linalg.norm(self.after - self.before))


def _unit(vector: Array) -> Array:
    return vector / (float(np.linalg.norm(vector)) or 1.0)


def _turned(tie: Turning, points: Array, u: Array) -> Turned:
    count = SPANNING[tie.kind]
    base, rest = tie.nodes[:count], tie.nodes[count:]
    if tie.kind == "BEAM":  # a length: what the way's own change adds, half its square
        way, change = points[rest[0]] - points[base[0]], u[rest[0]] - u[base[0]]
        length = float(np.linalg.norm(way)) or 1.0
        return Turned(way / length, _unit(way + change), change[None], np.ones((1, 1)),
                      1.0 / length)  # fmt: skip
    legs = points[base[1:]] - points[base[0]]
    moved = legs + u[base[1:]] - u[base[0]]
    inverse = np.linalg.pinv(legs)
    part = (points[rest] - points[base[0]]) @ inverse
    shares = np.column_stack([1.0 - part.sum(axis=1), part])
    if tie.kind == "PLANE":
        before, after = (_unit(np.cross(*each)) for each in (legs, moved))
    else:
        before, after = _unit(legs[0]), _unit(moved[0])
    return Turned(before, after, u[rest] - shares @ u[base], shares,
                  float(np.linalg.norm(inverse, 2)))  # fmt: skip


def straightened(ties: Sequence[Turning], points: Array, u: Array) -> Array:
    """Displacements (n, 3) less what these constraints allow beyond their linear equations."""
    out = u.copy()
    for tie in ties:
        turned, rest = _turned(tie, points, u), tie.nodes[SPANNING[tie.kind] :]
        along = turned.off @ turned.before
        across = turned.off - along[:, None] * turned.before
        excess = across if tie.kind == "STRAIGHT" else along[:, None] * turned.before
        allowed = turned.tilt * np.linalg.norm(turned.off, axis=1)
        size = np.linalg.norm(excess, axis=1)
        part = np.minimum(1.0, allowed / np.where(size > 0, size, 1.0))
        out[rest] -= part[:, None] * excess
    return out


def turned_forces(ties: Sequence[Turning], points: Array, u: Array, forces: Array) -> Array:
    """By how much tie forces of linear equations may be off, (n, 3), as forces (n, 3) are."""
    out = np.zeros_like(forces)
    for tie in ties:
        turned, count = _turned(tie, points, u), SPANNING[tie.kind]
        base, rest = tie.nodes[:count], tie.nodes[count:]
        carried = np.linalg.norm(forces[rest], axis=1)
        out[rest] += (turned.tilt * carried)[:, None]
        turns = turned.inverse_width * np.linalg.norm(turned.off, axis=1)
        each = carried @ (turned.tilt * np.abs(turned.shares) + turns[:, None])
        out[base] += each[:, None]
    return out


__all__ = ["Turning", "straightened", "turned_forces"]
