"""References, bolts, turned axes of a solved model: how far they moved, what acts on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .beside import AXES, LENGTH, POINT, TURN, Beside
from .constraints import ROTATION
from .wrench import Wrench

if TYPE_CHECKING:
    from .assembly import Discretisation
    from .fields import ContactFields
    from .model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReferenceFields:
    """displacement, reaction of supports, load: of the dofs beside the nodes, (k,) each."""

    displacement: Array
    reaction: Array
    load: Array


@dataclass(frozen=True, eq=False)
class ReferenceResult:
    """A reference, or a pretension, of a solved model.

    displacement: (dim,), of a pretension (1,), the length taken out of the bolt; rotation: (3,)
    in radians, in 2D (1,), of a pretension empty.  force, moment: what loads and supports give
    together, and the nodes that follow take; of a pretension (1,), the force in the bolt, > 0
    in tension, whether it is given or its length.
    """

    name: str
    displacement: Array
    rotation: Array
    force: Array
    moment: Array

    @property
    def record(self) -> dict[str, Any]:
        """Plain data: name, displacement, rotation, force, moment."""
        names = ("displacement", "rotation", "force", "moment")
        return {"name": self.name} | {key: getattr(self, key).tolist() for key in names}


def reference_fields(
    parts: Discretisation, displacement: Array, reaction: Array, load: Array
) -> ReferenceFields | None:
    """Of values (dofs,); None where nothing is beside the nodes."""
    first = parts.beside.first
    if not parts.beside.count:
        return None
    return ReferenceFields(displacement[first:], reaction[first:], load[first:])


def reference_results(model: Model, fields: ContactFields) -> dict[str, ReferenceResult]:
    """All references and pretensions of a solved model, by name."""
    beside, values, out = model.beside, fields.references, {}
    if values is None:
        return out
    acting = values.reaction + values.load
    for name, entry in beside.entries.items():
        own = entry.dofs[0] - beside.first
        if entry.kind == LENGTH:
            none = np.zeros(0)
            out[name] = ReferenceResult(name, values.displacement[own], none, acting[own], none)
        elif entry.kind == POINT:
            turn = beside.entries[name + ROTATION].dofs[0] - beside.first
            out[name] = ReferenceResult(name, values.displacement[own],
                                        values.displacement[turn], acting[own],
                                        acting[turn])  # fmt: skip
    return out


def beside_wrench(beside: Beside, force: Array) -> Wrench:
    """The resultant of forces (dofs,) on what is beside the nodes, about the origin.

    A force in a bolt acts on both of its halves, and has none.
    """
    dim = beside.dim
    total = Wrench(np.zeros(dim), np.zeros(3 if dim == 3 else 1), np.zeros(dim))
    for entry in beside.entries.values():
        own = force[entry.dofs]
        if entry.kind == TURN:
            total = Wrench(total.force, total.moment + own[0], total.point)
        elif entry.kind == POINT:
            total = total + Wrench.of(entry.points, own)
        elif entry.kind == AXES and entry.axes is not None:
            total = total + Wrench.of(entry.points, np.einsum("kc,kcd->kd", own, entry.axes))
    return total
