"""What joints do in the middle of a step: close at its end, and take back what parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .joints import Joints
from .met import Met
from .quick import Posed
from .rows import Rows, velocities
from .states import Motion

Array = NDArray[np.float64]


def closed(  # noqa: PLR0913
    joints: Joints, at: Met, before: Motion, middle: tuple[Any, ...], h: float, gravity: Array
) -> tuple[Met, Array, Array]:
    """With the rows of joints in a step h, their impulses alone and c (k, 3), see `joints`.

    middle: of `ends.middle_of`, from the motion before.  Joints that contacts hang on keep the
    rows of the middle and c = 0: what joints do alone says little of those, and bodies that are
    wedged between both contradict other rows.
    """
    if at.hung is not None:
        return at, np.zeros_like(at.apart), np.zeros_like(at.apart)
    theirs, pull, c = joints.closed(before.orientation, middle, before.velocity, h, gravity)
    nc = len(at.keys)
    rows: list[Any] = [
        np.concatenate([a[:nc], b]) for a, b in zip(at.rows, theirs, strict=True)
    ]
    return at._replace(rows=Rows(*rows)), pull, c


def mirror_inplace(  # noqa: PLR0913
    at: Met, middle: tuple[Any, ...], v: Array, pull: Array, c: Array, posed: Posed
) -> None:
    """Add to free velocities what joints take back; they alone start with what solves them.

    v (n, 3): before the step.
    """
    nc, q = len(at.keys), posed.q
    those: list[Any] = [part[nc:] for part in at.rows]
    u_m = velocities(Rows(*those), v, np.einsum("bij,bj->bi", middle[2], middle[3]))
    q[nc:] += u_m - c
    if not nc:  # beside contacts it would leave none of the load to them
        posed.start[:] = pull
    if at.hung is not None:
        q[:nc, 0] -= np.minimum(at.hung.pulled(c - u_m, len(v)), 0.0)
