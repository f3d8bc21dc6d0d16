"""The numbers of a law by the names that a contact of a model has for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, shown
from ...problem.law import (
    CappedCoulomb,
    Cohesive,
    Compliant,
    Coulomb,
    Law,
    Orthotropic,
    Tied,
    Tresca,
    VaryingCompliance,
    VaryingFriction,
)

Array = NDArray[np.float64]


def numbers_of(law: Law) -> dict[str, Any]:
    """The numbers of a law by the names that `Contact` has for them; raises InvalidInput."""
    if isinstance(law, Compliant):
        return numbers_of(law.law) | _stiffnesses(law)
    if isinstance(law, VaryingFriction):
        return numbers_of(law.inner) | {"mu": law.curve}
    if isinstance(law, VaryingCompliance):
        return numbers_of(law.inner) | {"stiffness": law.curve}
    if isinstance(law, Cohesive):
        return numbers_of(law.law) | {"cohesion": law.cohesion}
    if isinstance(law, Tied):
        return {}
    if isinstance(law, Coulomb):
        return {"mu": law.mu}
    if isinstance(law, Tresca):
        return {"tresca": law.limit}
    if isinstance(law, CappedCoulomb):
        return {"mu": law.mu, "cap": law.cap}
    if isinstance(law, Orthotropic):
        return {"mu": law.mu1, "mu_across": law.mu2, "angle": law.angle}
    raise InvalidInput(
        "law: expected Coulomb, Tresca, CappedCoulomb, Orthotropic or Tied, with or without "
        f"cohesion and compliance, got {shown(law)}"
    )


def _stiffnesses(law: Compliant) -> dict[str, Array]:
    """Those of a compliance; none where it is zero."""
    given = {"stiffness": law.compliance, "stick_stiffness": law.stick_compliance}
    for values in given.values():
        if values.any() and not values.all():
            raise InvalidInput(
                "law: expected a compliance > 0 at all nodes of a contact, or 0 at all; give "
                "rigid nodes a Contact of their own (where=)"
            )
    return {name: 1 / values for name, values in given.items() if values.any()}
