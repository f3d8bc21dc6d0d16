"""What no jump does to bodies: turn their cells inside out.

An equilibrium is far away after a jump, and Newton's steps may have led there through states
that bodies can not pass: energies of finite strains are felt at points of integration alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements.hyperelasticity import HyperelasticBody
from .nonlinear_parts import NonlinearParts
from .worst_cells import turned_corner

Array = NDArray[np.float64]


def led_astray(parts: NonlinearParts, u: Array, before: Array) -> str:
    """Why no jump leads from displacements `before` to u (nodes, d), in words; "" for nothing.

    Corners that were inside out before it do not count.
    """
    each = zip(
        parts.names, parts.bodies, np.split(u, parts.ends), np.split(before, parts.ends),
        strict=True,
    )  # fmt: skip
    for name, body, own, old in each:
        if isinstance(body, HyperelasticBody) and (
            corner := turned_corner(body.mesh, own, old)
        ):
            return f"over a jump {corner} in body {name!r}"
    return ""
