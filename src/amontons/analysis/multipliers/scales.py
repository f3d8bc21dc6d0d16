"""Sizes of contacts and of the load: with them no change of units changes an answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def contact_sizes(W: Array, contacts: int) -> tuple[Array, NDArray[np.bool_]]:
    """(|W_ii|_2 (nc,), W_ii != 0 (nc,)): the scale of every contact, and whether it can react.

    Those that can not get the largest scale of the others, whatever the units.
    """
    d = len(W) // max(contacts, 1)
    own = np.arange(contacts)
    size = np.linalg.norm(W.reshape(contacts, d, contacts, d)[own, :, own], 2, axis=(1, 2))
    reacts = size > 0
    largest = size.max(initial=0.0)
    return np.where(reacts, size, largest if largest > 0 else 1.0), reacts


def load_size(q: Array, mu: Array, reacts: NDArray[np.bool_]) -> float:
    """Norm of q (nc, d), scaled, over the contacts whose own q can make a reaction.

    With q_N >= mu |q_T| nothing in the cone has q r < 0: an obstacle that is far away would
    set the scale otherwise, and make all solutions of the others look like one.
    """
    tangent = np.linalg.norm(q[:, 1:], axis=1)
    loaded = reacts & (q[:, 0] < mu * tangent)
    return float(np.linalg.norm(q[loaded]) or np.linalg.norm(q))
