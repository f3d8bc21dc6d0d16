"""A doubt about finite sliding: the other side has come through facets that supports hold.

A force at a slave node is what its body needs there beside its loads (`moved_pairs`); where a
support holds the node along its normal nobody knows that, so that it has no contact.  Its
facets give their share to their other nodes.  A facet of held nodes alone has no other nodes:
it passes no force, and nothing keeps the master from passing through it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ..contact.current_mortar import MortarPair
from .fields import ContactFields
from .nonlinear_parts import nonlinear_parts

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
PASSED = 1e-6  # depth over the size of the slave's surface that is no matter of rounding


def held_facets(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Facets of held slave nodes alone through which their master has come."""
    displacement = np.concatenate(fields.displacement)
    if not np.isfinite(displacement).all():
        return []
    parts = nonlinear_parts(model)
    found = (_passed(pair, parts.X, parts.X + displacement) for pair in parts.contact.pairs)
    return [warning for warning in found if warning is not None]


def _passed(pair: object, X: Array, x: Array) -> ResultWarning | None:
    if not isinstance(pair, MortarPair) or pair.fold is not None:
        return None
    slave = pair.slave
    alone = ~np.asarray((np.isin(slave.nodes, pair.slaves) & slave.real).any(axis=1))
    if not alone.any():
        return None
    held = slave.part(np.flatnonzero(alone))
    nodes = held.all
    free = np.ones((len(nodes), x.shape[1]), dtype=bool)
    meeting = MortarPair(nodes, held, pair.master, free).at(x)
    depth = np.where(meeting.met, -meeting.gap, 0.0)
    worst = int(depth.argmax())
    if not depth[worst] > PASSED * float(np.ptp(x[slave.all], axis=0).max()):
        return None
    return ResultWarning(
        "held-slave-facets",
        f"contact on {pair.names[0]!r} with {pair.names[1]!r}: supports hold all nodes of "
        f"{int(alone.sum())} of its {len(alone)} facets, which therefore pass no force, and "
        f"the master has come through them by up to {depth[worst]:.3g}, at "
        f"{X[nodes[worst]].round(6).tolist()}; make the other surface the slave",
    )
