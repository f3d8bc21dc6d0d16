"""A doubt about finite sliding: a slave that no part of its master faces, as by a wrong place.

Its contacts are open, whatever its body does: with small strains that is refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ...problem.law.states import ContactStatus
from ..contact.current_mortar import MortarPair
from .fields import ContactFields
from .nonlinear_parts import nonlinear_parts

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]


def unfaced_slaves(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Slaves without a master in front of them, looked for where all contacts are open."""
    displacement = np.concatenate(fields.displacement)
    if not np.isfinite(displacement).all() or (fields.status != ContactStatus.OPEN).any():
        return []
    parts = nonlinear_parts(model)
    x = parts.X + displacement
    return [
        _warning(pair, x)
        for pair in parts.contact.pairs
        if isinstance(pair, MortarPair) and pair.fold is None and not pair.at(x).met.any()
    ]


def _warning(pair: MortarPair, x: Array) -> ResultWarning:
    slave, master = (
        f"{name!r} reaches from {at.min(axis=0).round(6).tolist()} to "
        f"{at.max(axis=0).round(6).tolist()}"
        for name, at in zip(
            pair.names, (x[pair.slave.all], x[pair.master.all]), strict=False
        )
    )
    return ResultWarning(
        "unfaced-slave",
        f"contact on {pair.names[0]!r} with {pair.names[1]!r}: no part of the slave has a "
        f"master facet in front of it, so that it passes no force; {slave}, {master}: check "
        "the positions, the units and which sides are named",
    )
