"""Evolution in time: Moreau-Jean dynamics and quasi-static steps as iterators of results."""

from .energy import Energies
from .moreau_jean import MoreauJean
from .passage import Passage
from .quasi_static import QuasiStatic
from .schedule import Schedule, Stage
from .state import State, TimeStep, at_rest
from .stepping import evolve

__all__ = [
    "Energies",
    "MoreauJean",
    "Passage",
    "QuasiStatic",
    "Schedule",
    "Stage",
    "State",
    "TimeStep",
    "at_rest",
    "evolve",
]
