"""Which single node spoils a balance: one displacement that is off leaves forces around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LIKELY = 0.9  # share of the imbalance that one node explains, from which it is named first
FROM = 5  # candidates are the nodes around so many of the worst ones


def culprits(
    K: sparse.csr_array, left: Array, off: Mask, dim: int
) -> list[tuple[int, float, float]]:  # fmt: skip
    """Nodes that explain an imbalance alone: (node, share, its displacement's error), best first.

    K (dofs, dofs): stiffness; left (dofs,): forces that balance nothing, where off (dofs,) says
    that they should.  share: part of the squares of these forces.  Empty where no node does.
    """
    force = np.where(off, left, 0.0)
    size = float(np.abs(force).max(initial=0.0))
    if not size > 0:
        return []
    force = force / size
    nodal = np.abs(force).reshape(-1, dim).max(axis=1)
    worst = np.argsort(-nodal, kind="stable")[:FROM]
    rows = (worst[:, None] * dim + np.arange(dim)).ravel()
    near = np.unique(K[rows].indices // dim)
    found = []
    for node in near.tolist():
        columns = K[node * dim : (node + 1) * dim].T.toarray() * off[:, None]
        unit = float(np.abs(columns).max(initial=0.0))
        if not unit > 0:
            continue
        error = np.linalg.lstsq(columns / unit, force, rcond=None)[0]
        rest = force - columns @ error / unit
        share = 1.0 - float(rest @ rest) / float(force @ force)
        if share >= LIKELY:
            found.append((node, share, float(np.linalg.norm(error)) * size / unit))
    return sorted(found, key=lambda each: -each[1])
