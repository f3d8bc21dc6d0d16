"""A doubt about friction coefficients that look like percent, or like an angle.

Dry solids have some 0.05 to 1.5, rubber up to some 4.  Between SEEN and MEANT a number may well
be a percentage (30 for 0.3) or an angle of friction in degrees (30 for tan 30 = 0.58).  Larger
ones can be neither: they stand for surfaces that do not slip, as in studies of jamming.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.warned import ResultWarning
from ...problem.law.law import MU
from .fields import ContactFields
from .matching import pairs_of

if TYPE_CHECKING:
    from .model import Model

SEEN = 10.0  # above any that is measured between surfaces
MEANT = 200.0  # from here on nobody means percent of friction, or degrees
STEEPEST = 90.0  # degrees, which no angle of friction reaches


def like_percent(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """A warning for each contact pair with a coefficient between SEEN and MEANT."""
    law, out = model.law.widest, []
    if law is None:
        return []
    mu = np.where(law.tied, 0.0, law.parameters[:, MU])
    for name, (_, _, numbers) in zip(model.pair_names, pairs_of(model), strict=True):
        odd = numbers[(mu[numbers] > SEEN) & (mu[numbers] < MEANT)]
        if odd.size:
            largest = float(mu[odd].max())
            out.append(ResultWarning("friction-like-percent", _told(name, largest),
                                     tuple(odd.tolist())))  # fmt: skip
    return out


def _told(name: str, mu: float) -> str:
    angle = np.degrees(np.arctan(mu))
    meant = f"mu = {mu / 100:g} if it is meant in percent"
    if mu < STEEPEST:
        meant += f", {np.tan(np.radians(mu)):.3g} if it is an angle of friction in degrees"
    return (
        f"contact {name!r}: a friction coefficient of {mu:g} lets nothing slide below "
        f"{angle:.1f} degrees, and dry solids have 0.05 to 1.5; write {meant}, or tie the "
        "sides if they shall not slip"
    )
