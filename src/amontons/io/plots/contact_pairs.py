"""What figures show of one slave surface and its obstacle or master."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...mechanics.model.matching import pairs_of
from ...problem.solution import FrictionSolution

if TYPE_CHECKING:
    from ...mechanics.model import ContactFields, Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactPair:
    """The contacts of one slave surface with one obstacle or master; rows as in the fields."""

    name: str
    body: int
    facets: tuple
    status: NDArray[np.int8]
    bound: Array  # of the shear traction
    points: Array
    frames: Array
    gap: Array
    slip: Array
    pressure: Array
    shear: Array
    node: NDArray[np.int64]


def contact_pairs(
    solution: FrictionSolution, fields: ContactFields, model: Model
) -> list[ContactPair]:
    """The pairs of a model that have contacts, in its order."""
    bound = solution.problem.law.bound(solution.r) / fields.weights
    found = []
    for (contact, _, rows), (body, facets) in zip(
        pairs_of(model), fields.facets, strict=True
    ):
        if len(rows):
            pair = ContactPair(
                contact.slave, body, facets, solution.status[rows], bound[rows],
                fields.points[rows], fields.frames[rows], fields.gap[rows], fields.slip[rows],
                fields.pressure[rows], fields.shear[rows], fields.node[rows],
            )  # fmt: skip
            crowded = model.dimension == 3 and len(np.unique(pair.node)) < len(rows)
            found.append(_at_nodes(pair, fields.weights[rows]) if crowded else pair)
    return found


def _at_nodes(pair: ContactPair, weights: Array) -> ContactPair:
    """Gauss points gathered at their nodes: means by area, and the highest status."""
    node, label = np.unique(pair.node, return_inverse=True)
    label = label.ravel()
    total = np.bincount(label, weights)

    def mean(values: Array) -> Array:
        out = np.zeros((len(node), *values.shape[1:]))
        np.add.at(out, label, (values.T * (weights / total[label])).T)
        return out

    status = np.zeros(len(node), dtype=pair.status.dtype)
    np.maximum.at(status, label, pair.status)
    names = ("bound", "points", "gap", "slip", "pressure", "shear")
    means = {name: mean(getattr(pair, name)) for name in names}
    first = np.unique(label, return_index=True)[1]
    return replace(pair, status=status, node=node, frames=pair.frames[first], **means)
