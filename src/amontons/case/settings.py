"""Solver settings from words: a method's name in kebab-case and values of its fields."""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from .. import linear, solvers
from ..errors import InvalidInput
from ..expressions import nearest
from ..solvers import METHODS
from ..solvers.base import Solver

LIMITS = ("max_iterations", "max_sweeps")  # one limit; the second in Gauss-Seidel's words


@dataclass(frozen=True)
class Settings:
    """What the driver is told: method and options of the solver, tolerance and limits."""

    method: str = "auto"
    tolerance: float = 1e-8
    max_iterations: int | None = None
    time_limit: float | None = None  # seconds
    options: dict[str, Any] = field(default_factory=dict)

    def solver(self) -> Solver:
        """The solver; raises InvalidInput for an unknown method or field."""
        return make_solver(self.method, self.options)


def method_class(method: str) -> type:
    """The class behind a name in kebab-case."""
    if method not in METHODS:
        raise InvalidInput(f"unknown method '{method}'{nearest(method, METHODS)}")
    return METHODS[method]


def make_solver(method: str, options: dict[str, Any]) -> Solver:
    """A solver with some of its fields set; values may be texts, as on the command line."""
    kind = method_class(method)
    hints = typing.get_type_hints(kind)
    names = [f.name for f in dataclasses.fields(kind) if f.init]
    for name in options:
        if name not in names:
            raise InvalidInput(f"solver.{name}: {_no_such_field(method, name, names)}")
    values = {name: _convert(name, value, hints[name]) for name, value in options.items()}
    try:
        return kind(**values)
    except InvalidInput as reason:
        raise InvalidInput(f"solver.{reason}") from None


def _no_such_field(method: str, name: str, names: list[str]) -> str:
    """What the method has instead, and which methods have the field."""
    owners = [
        other for other, kind in METHODS.items()
        if any(f.name == name and f.init for f in dataclasses.fields(kind))
    ]  # fmt: skip
    text = f"{method} has no such field" if names else f"{method} has no fields"
    if owners:
        return f"{text}; '{name}' is a field of {', '.join(owners)}: choose with --method"
    return text + (nearest(name, names) if names else "")


def in_words(text: str) -> str:
    """A message with the names of methods as on the command line."""
    for name, kind in METHODS.items():
        text = re.sub(rf"\b{kind.__name__}\b", name, text)
    return text


def _convert(name: str, value: Any, hint: Any) -> Any:
    """A value of the type that a field is annotated with."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return _convert_union(name, value, typing.get_args(hint))
    if hint is bool:
        return _word(name, value, {"true": True, "false": False})
    if hint in (int, float):
        return _number(name, value, hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        words = {member.name.lower().replace("_", "-"): member for member in hint}
        return _word(name, value, words)
    if hint is str and isinstance(value, str):
        return value
    if isinstance(value, str):
        return _component(name, value, hint)
    raise InvalidInput(f"solver.{name}: can not be set here, use the Python interface")


def _component(name: str, value: str, protocol: type) -> Any:
    """A part of a solver by its class name in kebab-case: `linear = "conjugate-gradient"`."""
    wanted = [key for key in vars(protocol) if not key.startswith("_")]
    fitting: dict[str, Callable[[], Any]] = {
        _kebab(kind.__name__): kind
        for kind in (getattr(home, key) for home in (solvers, linear) for key in home.__all__)
        if isinstance(kind, type)
        and dataclasses.is_dataclass(kind)
        and all(hasattr(kind, key) for key in wanted)
    }
    if value not in fitting:
        raise InvalidInput(f"solver.{name}: unknown value '{value}'{nearest(value, fitting)}")
    return fitting[value]()


def _kebab(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "-", name).lower()


def _convert_union(name: str, value: Any, hints: tuple) -> Any:
    if type(None) in hints and (value is None or value == "none"):
        return None
    problem = InvalidInput(f"solver.{name}: can not be set to {value!r}")
    for hint in hints:
        if hint is type(None):
            continue
        try:
            return _convert(name, value, hint)
        except InvalidInput as reason:
            problem = reason
    raise problem


def _word(name: str, value: Any, words: dict[str, Any]) -> Any:
    key = str(value).lower()
    if key not in words:
        raise InvalidInput(f"solver.{name}: expected {' or '.join(words)}, got {value!r}")
    return words[key]


def _number(name: str, value: Any, kind: type) -> Any:
    wanted = "a whole number" if kind is int else "a number"
    problem = InvalidInput(f"solver.{name}: expected {wanted}, got {value!r}")
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        raise problem
    try:
        number = kind(value)
    except (TypeError, ValueError, OverflowError):
        raise problem from None
    if number != number or number in (float("inf"), -float("inf")):
        raise problem
    return number
