"""Values that depend on time: expressions in t, and functions of (x, t)."""

from __future__ import annotations

import inspect
from dataclasses import is_dataclass, replace
from functools import partial
from typing import Any

from ..model import BodyForce, Fix, Model, Traction

Part = Fix | Traction | BodyForce


def is_timed(value: Any) -> bool:
    """True for an expression with t in it, a function of (x, t), or a list with one of them."""
    if isinstance(value, list | tuple):
        return any(is_timed(entry) for entry in value)
    if _is_expression(value):
        return "t" in value.names
    return callable(value) and _takes_time(value)


def depends_on_time(model: Model) -> bool:
    """True where a load or a support of a model depends on time."""
    return any(is_timed(part.value) for part in (*model.supports, *model.loads))


def at_time(value: Any, t: float) -> Any:
    """The value at time t: a number, or a function of position alone."""
    if isinstance(value, list | tuple):
        return [at_time(entry, t) for entry in value]
    if not is_timed(value):
        return value
    if _is_expression(value):
        return replace(value, time=float(t))
    return partial(_swapped, value, float(t))


def part_at(part: Part, t: float) -> Part:
    """A support or load with its value at time t."""
    return replace(part, value=at_time(part.value, t))


def steady(model: Model) -> Model:
    """The model with supports and loads as they are at time 0: the one that is assembled."""
    if not depends_on_time(model):
        return model
    if "steady" not in model._shared:
        model._shared["steady"] = replace(
            model,
            supports=[part_at(part, 0.0) for part in model.supports],
            loads=[part_at(part, 0.0) for part in model.loads],
        )
    return model._shared["steady"]


def _swapped(function: Any, t: float, x: Any) -> Any:
    return function(x, t)


def _is_expression(value: Any) -> bool:
    """An amontons.expressions.Expression, which lies above this layer: known by its fields."""
    return is_dataclass(value) and hasattr(value, "names") and hasattr(value, "time")


def _takes_time(function: Any) -> bool:
    """True for a function with two arguments without default."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # a builtin without signature takes x alone
        return False
    plain = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters if p.kind in plain and p.default is inspect.Parameter.empty]
    return len(needed) == 2
