"""What supports do to the bodies: forces at their nodes, and resultants.

Where the bodies need `inner`, loads give `load` and contacts `pushed`, what is left at dofs
that supports hold is theirs:  reaction = inner - load - pushed.  Forces of supports on a rigid
body are known as far as they move it: of all that do the same, the smallest is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .names import support_names
from .references import beside_wrench
from .supports import prescribed_values
from .wrench import Acting, Wrench

if TYPE_CHECKING:
    from .assembly import Discretisation
    from .fields import ContactFields
    from .model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SupportResult(Acting):
    """The force of one support on the bodies, (d,), global axes, and its moment.

    name: the surface, numbered where several supports hold one.  A component that several
    supports prescribe at a node counts for the first of them.
    """

    name: str
    on: str
    wrench: Wrench

    @property
    def record(self) -> dict[str, Any]:
        """Plain data: name, on, force, moment, point."""
        return {"name": self.name, "on": self.on, **self.wrench.record}


def support_forces(parts: Discretisation, rest: Array) -> Array:
    """Forces of supports on all dofs (dofs,), of inner - load - pushed there, (dofs,)."""
    if parts.eliminated is not None:
        return parts.eliminated.held_by(rest)
    out = np.zeros_like(rest)
    out[parts.fixed] = rest[parts.fixed]
    return out


def arms(model: Model, displacement: Sequence[Array]) -> Array:
    """Where the forces at all nodes act, (nodes, d): deformed where bodies may turn.

    Small strains balance forces on the undeformed body, and so do their moments.
    """
    points = np.concatenate([body.mesh.points for body in model.bodies])
    if any(body.turns for body in model.bodies):
        return points + np.concatenate(list(displacement))
    return points


def support_results(model: Model, fields: ContactFields) -> dict[str, SupportResult]:
    """The force of every support of a solved model, by its name."""
    beside = model.beside
    at, whole = arms(model, fields.displacement), np.concatenate(fields.reaction)
    left, out = np.ones(beside.total, dtype=bool), {}
    others = np.zeros(0) if fields.references is None else fields.references.reaction
    for name, support in zip(support_names(model.supports), model.supports, strict=True):
        held = ~np.isnan(prescribed_values(model.bodies, (support,), beside)) & left
        left &= ~held
        of_nodes = held[: whole.size].reshape(whole.shape)
        nodes = np.flatnonzero(of_nodes.any(axis=1))
        wrench = Wrench.of(at[nodes], np.where(of_nodes[nodes], whole[nodes], 0.0))
        if beside.count:
            own = np.zeros(beside.total)
            own[beside.first :] = np.where(held[beside.first :], others, 0.0)
            wrench = wrench + beside_wrench(beside, own)
        out[name] = SupportResult(name, support.on, wrench)
    return out
