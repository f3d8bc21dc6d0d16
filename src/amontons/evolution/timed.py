"""Models whose supports and loads depend on time."""

from __future__ import annotations

from dataclasses import replace

from ..model import BodyForce, Fix, Model, Traction
from ..model.timing import at_time, is_timed

Part = Fix | Traction | BodyForce

__all__ = ["at_time", "depends_on_time", "is_timed", "part_at", "steady"]


def depends_on_time(model: Model) -> bool:
    """True where a load or a support of a model depends on time."""
    return any(is_timed(part.value) for part in (*model.supports, *model.loads))


def part_at(part: Part, t: float) -> Part:
    """A support or load with its value at time t."""
    return replace(part, value=at_time(part.value, t))


def steady(model: Model) -> Model:
    """The model with supports and loads as they are at time 0: the one that is assembled.

    Only what does not depend on that time may be taken from it: matrices, which components
    supports hold, and gaps.
    """
    if not depends_on_time(model):
        return model
    if "steady" not in model._shared:
        found = replace(
            model,
            supports=[part_at(part, 0.0) for part in model.supports],
            loads=[part_at(part, 0.0) for part in model.loads],
        )
        found._shared["steady"] = found
        model._shared["steady"] = found
    return model._shared["steady"]
