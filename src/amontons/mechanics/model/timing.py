"""Values of supports and loads that depend on time: expressions in t, functions of (x, t).

That a value depends on time is read from its form, never from what it is at some time.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ...core.expressions import Expression


@dataclass(frozen=True)
class AtTime:
    """A function of (x, t) at one time: a function of x that is still known to depend on t."""

    function: Callable[[Any, float], Any]
    time: float

    def __call__(self, x: Any) -> Any:
        """The value at a point."""
        return self.function(x, self.time)


def is_timed(value: Any) -> bool:
    """True for an expression with t in it, a function of (x, t), or a list with one of them."""
    if isinstance(value, list | tuple):
        return any(is_timed(entry) for entry in value)
    if isinstance(value, AtTime):
        return True
    if isinstance(value, Expression):
        return "t" in value.names
    return callable(value) and _takes_time(value)


def at_time(value: Any, t: float) -> Any:
    """The value at time t: a number, or a function of position alone."""
    if isinstance(value, list | tuple):
        return [at_time(entry, t) for entry in value]
    if not is_timed(value):
        return value
    if isinstance(value, Expression):
        return replace(value, time=float(t))
    function = value.function if isinstance(value, AtTime) else value
    return AtTime(function, float(t))


def steady_value(value: Any) -> Any:
    """A support's value that can not be called with a time: the same, or that at time 0."""
    return at_time(value, 0.0) if _is_raw(value) else value


def lasting(value: Any) -> Any:
    """A support's value with None (free) in the components that depend on time."""
    if isinstance(value, list | tuple):
        return [None if is_timed(entry) else entry for entry in value]
    return (lambda x: [None] * len(x)) if is_timed(value) else value


def _is_raw(value: Any) -> bool:
    """True where a function of (x, t) has not been given its time."""
    if isinstance(value, list | tuple):
        return any(_is_raw(entry) for entry in value)
    return is_timed(value) and not isinstance(value, AtTime | Expression)




def _takes_time(function: Any) -> bool:
    """True for a function with two arguments without default."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # a builtin without signature takes x alone
        return False
    plain = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters if p.kind in plain and p.default is inspect.Parameter.empty]
    return len(needed) == 2
