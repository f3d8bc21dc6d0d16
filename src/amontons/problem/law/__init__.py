"""Laws of friction, one file each: what `law` says a law is, a single contact, statuses."""

from .capped import CappedCoulomb
from .cohesive import Cohesive
from .compliant import Compliant
from .coulomb import Coulomb
from .law import Kind, Law
from .mixed import Mixed, joined
from .orthotropic import Orthotropic
from .overclosure import (
    ExponentialOverclosure,
    Overclosure,
    OverclosureCurve,
    VaryingCompliance,
)
from .rolling import RollingFriction
from .tied import Tied
from .tresca import Tresca
from .varying import FrictionCurve, VaryingFriction

__all__ = ["CappedCoulomb", "Cohesive", "Compliant", "Coulomb", "ExponentialOverclosure",
           "FrictionCurve", "Kind", "Law", "Mixed", "Orthotropic", "Overclosure",
           "OverclosureCurve", "RollingFriction", "Tied", "Tresca", "VaryingCompliance",
           "VaryingFriction", "joined"]
