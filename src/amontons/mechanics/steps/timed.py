"""Models whose supports and loads depend on time."""

from __future__ import annotations

from dataclasses import replace

from ..model import BodyForce, Fix, Model, NodalForce, Pressure, Temperature
from ..model.parts import Load
from ..model.timing import at_time, is_timed

Part = Fix | Load

__all__ = ["at_time", "depends_on_time", "growth_in_words", "is_timed", "part_at", "steady"]


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
    return model._shared.once(_steady, (), model)


def _steady(model: Model) -> Model:
    found = replace(
        model,
        supports=[part_at(part, 0.0) for part in model.supports],
        loads=[part_at(part, 0.0) for part in model.loads],
    )
    found._shared.put(_steady, (), found)
    return found


def growth_in_words(model: Model) -> str:
    """How loads and supports of quasi-static steps come to act, where that may surprise."""
    parts = [part for part in (*model.supports, *model.loads) if _is_something(part.value)]
    if not depends_on_time(model):
        return (
            "nothing depends on the time t: loads and supports grow with it, in full at t = 1"
        )
    at_once = [_name(part) for part in parts if not is_timed(part.value)]
    if not at_once:
        return ""
    names = ", ".join(dict.fromkeys(at_once))
    return f"what does not depend on the time t acts in full from the first step on: {names}"


def _is_something(value: object) -> bool:
    """False for zero and for components that are free."""
    if isinstance(value, list | tuple):
        return any(_is_something(entry) for entry in value)
    return value is not None and (callable(value) or bool(value))


def _name(part: Part) -> str:
    if isinstance(part, BodyForce):
        return "body force" if part.region is None else f"body force in {part.region!r}"
    if isinstance(part, Temperature):
        return "temperature"
    words = {Fix: "fix", Pressure: "pressure", NodalForce: "nodal force"}
    return f"{words.get(type(part), 'traction')} on {part.on!r}"
