"""What no step does to bodies: turn cells inside out over a jump, put one through another.

An equilibrium is far away after a jump, and Newton's steps may have led there through states
that bodies can not pass: energies of finite strains are felt at points of integration alone,
and what does not face a master passes no force, wherever it lies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements.hyperelasticity import HyperelasticBody
from .in_each_other import DEEP, deepest_overlap
from .nonlinear_parts import NonlinearParts
from .worst_cells import turned_corner

Array = NDArray[np.float64]
TURNED = 0.1  # by how much more a corner may be inside out after a step that is no jump


def led_astray(parts: NonlinearParts, u: Array, before: Array, jumped: bool = True) -> str:
    """Why no step leads from displacements `before` to u (nodes, d), in words; "" for nothing.

    jumped: over a jump.  What was so before it does not count: corners as much inside out,
    and bodies as deep in each other.  Small steps may lead there, as averages of gaps do, and
    points of integration in front of a corner: without a jump it may be a little more.
    """
    over = "over a jump " if jumped else ""
    depth, told = deepest_overlap(parts, u)
    slack = 0.0 if jumped else DEEP / 2
    if told and depth.share > deepest_overlap(parts, before, 0.0)[0].share + slack:
        return over + told
    each = zip(
        parts.names, parts.bodies, np.split(u, parts.ends), np.split(before, parts.ends),
        strict=True,
    )  # fmt: skip
    for name, body, own, old in each:
        if isinstance(body, HyperelasticBody) and (
            corner := turned_corner(body.mesh, own, old, 0.0 if jumped else TURNED)
        ):
            return f"{over}{corner} in body {name!r}"
    return ""
