"""States of a model as a page shows them: displacement, fields of both sides, forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...linear.blocks import spatial
from ...mechanics.elements import von_mises
from ..contact_fields import SLAVE, contact_fields
from ..vtk import stresses
from .skin import Skin

if TYPE_CHECKING:
    from ...mechanics.model import ContactFields

Array = NDArray[np.float64]
Index = NDArray[np.int64]
NAMES = {"pressure": "CPRESS", "shear": "CSHEAR", "slip": "CSLIP", "gap": "COPEN"}
MOST_NUMBERS = 3_000_000  # of all states of a page together, some megabytes
MOST_ARROWS = 2000  # forces that are drawn, the largest


@dataclass(frozen=True, eq=False)
class State:
    """One state: moved (V, 3) per vertex of the skin; status (C,) and values {field: (C,)}.

    C: the contact vertices of the skin, both sides, `Stage.contacts`.  force (V, 3) on both;
    stress (V,), von Mises.
    label: what it is, in words; parameter: time, load or friction; stamp: as of the solution.
    """

    moved: NDArray[np.float32]
    status: NDArray[np.int8]
    values: dict[str, Array]
    force: NDArray[np.float32]
    stress: NDArray[np.float32]
    label: str = ""
    parameter: float = 0.0
    stamp: str = ""
    counts: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Stage:
    """A model ready to be shown: its skin and its contact vertices."""

    skin: Skin
    contacts: Index = field(init=False)  # vertices, ascending

    def __post_init__(self) -> None:
        zones = self.skin.zones
        parts = [piece.ravel() for z in zones for piece in (z.pieces, z.master_pieces)]
        object.__setattr__(self, "contacts", np.unique(np.concatenate(parts)))

    def most(self, wanted: int) -> int:
        """How many states a page can hold, 2 to `wanted`."""
        each = 4 * len(self.skin.points) + 8 * len(self.contacts)
        return max(2, min(wanted, MOST_NUMBERS // each))

    def state(self, fields: ContactFields, solution: Any, **words: Any) -> State:
        """A state of the model; solution: of a solve, or a step in time."""
        model, skin = self.skin.model, self.skin
        sizes = [len(body.mesh.points) for body in model.bodies]
        starts = np.cumsum([0, *sizes])
        found = contact_fields(model, fields, solution.sliding, starts)
        values = {name: found[key].astype(float) for name, key in NAMES.items()}
        status = found["CSTATUS"]
        on_slaves = (found["CSIDE"] & SLAVE).astype(bool)
        force = np.where(on_slaves[:, None], found["CFORCE"], 0.0)
        at = skin.whole
        mine = at[self.contacts]
        moved = spatial(np.concatenate(fields.displacement))[at]
        parts = stresses(model, fields, getattr(solution, "time", None))
        stress = von_mises(np.concatenate([nodes for _, nodes in parts]))
        told = getattr(solution, "solution", solution)
        counts = {name: int((solution.status == k).sum())
                  for k, name in enumerate(("open", "slip", "stick"))}  # fmt: skip
        return State(
            moved.astype(np.float32), status[mine].astype(np.int8),
            {name: array[mine] for name, array in values.items()},
            force[at].astype(np.float32),
            stress[at].astype(np.float32), stamp=told.convergence.stamp,
            counts=counts, **words,
        )  # fmt: skip


def chosen(count: int, most: int) -> Index:
    """At most so many of `count` states, evenly, the first and the last among them."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, most)).astype(np.int64))


def largest_forces(states: Sequence[State]) -> Index:
    """Vertices whose forces are drawn: the largest of all states, ascending."""
    length = np.max([np.linalg.norm(state.force, axis=1) for state in states], axis=0)
    order = np.argsort(-length, kind="stable")[:MOST_ARROWS]
    return np.sort(order[length[order] > 0])
