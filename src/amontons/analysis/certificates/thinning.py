"""A part of many contacts, spread out over all of them by how W couples them.

Positions are not needed: |W_ij| falls with the distance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.int64]
COARSEST = 60  # contacts of which no fewer ones are asked


def couplings(W: Array, contacts: int) -> Array:
    """|W_ij| + |W_ji| over the roots of |W_ii| and |W_jj|, (contacts, contacts)."""
    d = len(W) // contacts
    size = np.sqrt((W.reshape(contacts, d, contacts, d) ** 2).sum(axis=(1, 3)))
    root = np.sqrt(np.diag(size).copy())
    near = size / root / root[:, None]
    return near + near.T


def spread_out(near: Array, count: int) -> Places:
    """So many contacts, each far from those chosen before; couplings near (k, k)."""
    chosen = [int(np.argmin(near.sum(axis=1)))]
    nearest = near[chosen[0]].copy()
    while len(chosen) < count:
        nearest[chosen] = np.inf
        chosen.append(int(np.argmin(nearest)))
        nearest = np.maximum(nearest, near[chosen[-1]])
    return np.sort(chosen)
