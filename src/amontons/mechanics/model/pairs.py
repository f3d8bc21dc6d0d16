"""Numbers of whole contact pairs: force, moment, area, pressure, slip, friction work, stick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...problem.law.states import ContactStatus
from .matching import pairs_of
from .reactions import arms
from .wrench import Acting, Wrench

if TYPE_CHECKING:
    from .fields import ContactFields
    from .model import Model
    from .parts import Contact

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Slip:
    """Largest slip of the contacts of a pair, lengths; of motion while they were open nothing.

    net: between where a contact has slid from and where it is; accumulated: the length of the
    way, back and forth, since the start.
    """

    net: float
    accumulated: float


@dataclass(frozen=True, eq=False)
class PairResult(Acting):
    """What one contact pair transmits.

    name, slave, master: as in the model, master None with an obstacle, whose kind is then in
    `obstacle`: "plane", "sphere" or "levelset".  area: of what touches, of now where contact
    is found there, else undeformed; in 2D a length, and forces are per thickness.
    largest_pressure: stress >= 0.  friction_work: energy >= 0 that friction has taken since
    the start.  share_sticking: area that sticks over area that touches, 0 where nothing does.
    """

    name: str
    slave: str
    master: str | None
    obstacle: str | None
    wrench: Wrench
    area: float
    largest_pressure: float
    slip: Slip
    friction_work: float
    share_sticking: float

    @property
    def record(self) -> dict[str, Any]:
        """Plain data, as an entry of `pairs` in solution.json."""
        return {
            "name": self.name, "slave": self.slave, "master": self.master,
            "obstacle": self.obstacle, **self.wrench.record, "area": self.area,
            "largest_pressure": self.largest_pressure,
            "slip": {"net": self.slip.net, "accumulated": self.slip.accumulated},
            "friction_work": self.friction_work, "share_sticking": self.share_sticking,
        }  # fmt: skip


def pair_results(model: Model, fields: ContactFields) -> dict[str, PairResult]:
    """The numbers of every contact pair of a solved model, by its name."""
    at = arms(model, fields.displacement)
    starts = model.discretisation.offsets // model.dimension
    out = {}
    for name, (contact, placed, numbers) in zip(model.pair_names, pairs_of(model), strict=True):
        first = int(starts[placed.body])
        nodes, forces = model.formulation.forces_of_pair(placed, fields, numbers)
        wrench = Wrench.of(at[first + nodes], forces)
        out[name] = _result(name, contact, numbers, fields, wrench)
    return out


def _result(
    name: str, contact: Contact, numbers: Index, fields: ContactFields, wrench: Wrench
) -> PairResult:
    status = fields.status[numbers]
    touches, sticks = status != ContactStatus.OPEN, status == ContactStatus.STICK
    area, stuck = (float(fields.areas[numbers[some]].sum()) for some in (touches, sticks))
    net = np.linalg.norm(fields.slid[numbers], axis=1)
    obstacle = contact.obstacle
    return PairResult(
        name, contact.slave, ", ".join(contact.masters) or None,
        None if obstacle is None else type(obstacle).__name__.lower(), wrench, area,
        float(fields.pressure[numbers].max(initial=0.0)),
        Slip(float(net.max(initial=0.0)), float(fields.path[numbers].max(initial=0.0))),
        float(fields.friction_work[numbers].sum()), stuck / area if area > 0 else 0.0,
    )  # fmt: skip
