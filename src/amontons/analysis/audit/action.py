"""Action and reaction: whether contact forces on all sides of pairs add up to nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...mechanics.model.supports import locate

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from .forces import NodalForces
    from .sides import Side

Index = NDArray[np.int64]


def between_sides(
    model: Model, forces: NodalForces, every: Sequence[tuple[Side, ...]]
) -> tuple[float, str]:  # fmt: skip
    """Largest sum of the forces on both sides over the pressure, and its pair; (0, "") if none.

    Pairs that have nodes in common are taken together.  Along a direction of space in which a
    support holds one of the nodes nothing is known, nor of pairs with an obstacle.
    """
    d = model.dimension
    force, bound, held = (
        part.reshape(-1, d) for part in (forces.missing, forces.known, forces.is_held)
    )
    nodes = [_nodes(model, k) for k in range(len(model.contacts))]
    worst, found = 0.0, ""
    for group in _groups(nodes, len(force)):
        if any(model.contacts[k].master is None for k in group):
            continue
        on = np.unique(np.concatenate([nodes[k] for k in group]))
        free = ~held[on].any(axis=0)
        size = sum(max(_carried(side) for side in every[k]) for k in group)
        left = np.maximum(np.abs(force[on].sum(axis=0)) - bound[on].sum(axis=0), 0.0)
        share = float(np.linalg.norm(left * free)) / size if size > 0 else 0.0
        if share > worst:
            worst, found = share, model.pair_names[group[0]]
    return worst, found


def _carried(side: Side) -> float:
    """Sum of the forces that press, of a bond all."""
    size = np.linalg.norm(side.r, axis=1) if side.law.tied.any() else np.abs(side.r[:, 0])
    return float(size.sum())


def _nodes(model: Model, pair: int) -> Index:
    """Nodes of both surfaces of a pair, in the whole model."""
    contact, out = model.contacts[pair], []
    for name in (contact.slave, contact.master):
        if name is not None:
            k, surface = locate(model.bodies, name)
            first = int(model.discretisation.offsets[k]) // model.dimension
            out.append(first + model.bodies[k].mesh.surface_nodes(surface))
    return np.concatenate(out)


def _groups(nodes: Sequence[Index], total: int) -> list[list[int]]:
    """Pairs that have nodes in common, directly or through others."""
    if not nodes:
        return []
    pair = np.repeat(np.arange(len(nodes)), [len(each) for each in nodes])
    on = sparse.csr_array(
        (np.ones(len(pair)), (pair, np.concatenate(nodes))), shape=(len(nodes), total)
    )
    count, group = connected_components(on @ on.T, directed=False)
    return [np.flatnonzero(group == k).tolist() for k in range(count)]
