"""Solver settings from words: a method's name in kebab-case and values of its fields.

A field that holds a part of a solver takes the part's name, or a table of its fields:

    line_search = "armijo"
    line_search = { kind = "armijo", halvings = 20 }
    line_search = { halvings = 20 }                     # of the part that it has anyway
"""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

from .. import linear, solvers
from ..errors import InvalidInput, shown
from ..expressions import nearest
from ..solvers import METHODS
from ..solvers.base import Solver

if TYPE_CHECKING:
    from ..analysis.paths.continuation import Continuation

LIMITS = ("max_iterations", "max_sweeps")  # one limit; the second in Gauss-Seidel's words

NUMBERS = ("tolerance", "contact_tolerance", "time_limit")


@dataclass(frozen=True)
class Settings:
    """What the driver is told: method and options of the solver, tolerance and limits."""

    method: str = "auto"
    tolerance: float = 1e-8
    max_iterations: int | None = None
    time_limit: float | None = None  # seconds
    options: dict[str, Any] = field(default_factory=dict)
    contact_tolerance: float | None = None  # of every contact; the root of tolerance
    along_paths: dict[str, Any] = field(default_factory=dict)  # of [continuation]

    def solver(self) -> Solver:
        """The solver; raises InvalidInput for an unknown method or field."""
        return make_solver(self.method, self.options)

    def continuation(self) -> Continuation | None:
        """How curves are followed, where something is said; raises InvalidInput as `solver`."""
        if not self.along_paths:
            return None
        from ..analysis.paths.continuation import Continuation

        return _made(Continuation, self.along_paths, "continuation")


def method_class(method: str) -> type:
    """The class behind a name in kebab-case."""
    if method not in METHODS:
        raise InvalidInput(f"unknown method '{method}'{nearest(method, METHODS)}")
    return METHODS[method]


def make_solver(method: str, options: dict[str, Any]) -> Solver:
    """A solver with some of its fields set; values may be texts, as on the command line."""
    kind = method_class(method)
    names = [f.name for f in dataclasses.fields(kind) if f.init]
    for name in options:
        if name not in names:
            raise InvalidInput(f"solver.{name}: {_no_such_field(method, name, names)}")
    return _made(kind, options, "solver")


def _made(part: Any, options: dict[str, Any], where: str) -> Any:
    """A dataclass, or a copy of an instance, with some fields set; `where` is its key."""
    kind = part if isinstance(part, type) else type(part)
    hints = typing.get_type_hints(kind)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    values = {}
    for name, value in options.items():
        key = f"{where}.{name}"
        if name not in fields:
            hint = nearest(name, fields) if fields else ""
            raise InvalidInput(f"{key}: {_kebab(kind.__name__)} has no such field{hint}")
        default = _default(fields[name])
        if isinstance(value, dict) and "kind" not in value and default is not None:
            values[name] = _made(default, value, key)
        else:
            values[name] = _convert(key, value, hints[name])
    try:
        return part(**values) if part is kind else dataclasses.replace(part, **values)
    except InvalidInput as reason:
        raise InvalidInput(f"{where}.{reason}") from None


def _default(field: dataclasses.Field) -> Any:
    """The part that a field holds when nothing is said, None where it holds a value."""
    made = field.default_factory
    return None if made is dataclasses.MISSING else made()


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
    """A value of the type that a field is annotated with; `name` is its dotted key."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return _convert_union(name, value, typing.get_args(hint))
    if hint is bool:
        return _word(name, value, {"true": True, "false": False})
    if hint in (int, float):
        return _number(name, value, hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _word(name, value, _words(hint))
    if hint is str and isinstance(value, str):
        return value
    if isinstance(value, str | dict):
        return _component(name, value, hint)
    raise InvalidInput(f"{name}: can not be set here, use the Python interface")


def _words(kind: type[Enum]) -> dict[str, Enum]:
    return {member.name.lower().replace("_", "-"): member for member in kind}


def _component(name: str, value: str | dict[str, Any], protocol: type) -> Any:
    """A part of a solver by its class name in kebab-case, or by a table with that as kind."""
    wanted = [key for key in vars(protocol) if not key.startswith("_")]
    fitting: dict[str, type] = {
        _kebab(kind.__name__): kind
        for kind in (getattr(home, key) for home in (solvers, linear) for key in home.__all__)
        if isinstance(kind, type)
        and dataclasses.is_dataclass(kind)
        and all(hasattr(kind, key) for key in wanted)
    }
    options = dict(value) if isinstance(value, dict) else {"kind": value}
    if "kind" not in options:
        raise InvalidInput(f"{name}.kind: missing, expected one of {', '.join(fitting)}")
    chosen = str(options.pop("kind"))
    if chosen not in fitting:
        raise InvalidInput(f"{name}: unknown value '{chosen}'{nearest(chosen, fitting)}")
    return _made(fitting[chosen], options, name)


def _kebab(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "-", name).lower()


def _convert_union(name: str, value: Any, hints: tuple) -> Any:
    if type(None) in hints and (value is None or value == "none"):
        return None
    reasons = []
    for hint in hints:
        if hint is type(None):
            continue
        try:
            return _convert(name, value, hint)
        except InvalidInput as reason:
            reasons.append(reason)
    if len(reasons) == 1:
        raise reasons[0]
    wanted = " or ".join(_wanted(hint) for hint in hints if hint is not type(None))
    raise InvalidInput(f"{name}: expected {wanted}, got {shown(value)}")


def _wanted(hint: Any) -> str:
    """What a field of that type takes, for messages."""
    if isinstance(hint, type) and issubclass(hint, Enum):
        return " or ".join(_words(hint))
    return {int: "a whole number", float: "a number"}.get(hint, hint.__name__)


def _word(name: str, value: Any, words: dict[str, Any]) -> Any:
    key = str(value).lower()
    if key not in words:
        raise InvalidInput(f"{name}: expected {' or '.join(words)}, got {shown(value)}")
    return words[key]


def _number(name: str, value: Any, kind: type) -> Any:
    wanted = "a whole number" if kind is int else "a number"
    problem = InvalidInput(f"{name}: expected {wanted}, got {shown(value)}")
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        raise problem
    try:
        number = kind(value)
    except (TypeError, ValueError, OverflowError):
        raise problem from None
    if number != number or number in (float("inf"), -float("inf")):
        raise problem
    return number
