"""What contacts have slid, and the work that it took, step by step.

A contact slides by du in a step in which the law lets it, else not at all, however far an open
one moves.  Friction acts on du; of its forces before and after a quasi-static step, r0 and r1,

    work = (r0 + r1)_T . du_T / 2,  but r1_T . du_T where that takes less, or creates energy,

as `energy` says: slip waits until the pressure has fallen, and a contact that turns round
within the step has nothing of the force before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .state import State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def quasi_static_friction(before: Array, after: Array, du: Array) -> Array:
    """Work of friction on the bodies in a step, (nc,), <= 0, of tangential forces (nc, d-1)."""
    at_end = (after * du).sum(axis=1)
    mean = 0.5 * ((before + after) * du).sum(axis=1)
    return np.minimum(np.where(mean > 0, at_end, np.maximum(at_end, mean)), 0.0)


def rubbed(state: State, du: Array, sliding: Mask, work: Array) -> dict[str, Any]:
    """slid, path and friction_work of the next state.

    du (nc, d-1): tangential motion of the step; sliding (nc,): contacts that the law lets
    slide; work (nc,): of friction on the bodies, <= 0.
    """
    moved = np.where(sliding[:, None], du, 0.0)
    return {
        "slid": state.slid + moved, "path": state.path + np.linalg.norm(moved, axis=1),
        "friction_work": state.friction_work - work,
    }  # fmt: skip
