"""Solver settings from words: a method's name in kebab-case and values of its fields.

A field that holds a part of a solver takes the part's name, or a table of its fields:

    line_search = "armijo"
    line_search = { kind = "armijo", halvings = 20 }
    line_search = { halvings = 20 }                     # of the part that it has anyway
"""

from __future__ import annotations

import dataclasses
import re
import typing
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from ... import linear, solvers
from ...core.errors import Address, InvalidInput
from ...core.options import alternatives, hints_of, is_enum, members_of, usual_part
from ...core.plugins import installed, load, loaded
from ...core.words import near, nearest
from ...solvers import METHODS
from ...solvers.contract import Solver

if TYPE_CHECKING:
    from ...analysis.paths.continuation import Continuation

GROUP = "amontons.solvers"  # of entry points
LIMITS = ("max_iterations", "max_sweeps")  # one limit; the second in Gauss-Seidel's words

NUMBERS = ("tolerance", "contact_tolerance", "time_limit")
ALIASES = {"none": "full-step"}  # of parts of a solver
GENERAL = ("method", *NUMBERS, *LIMITS)  # of the driver; all else are options of the solver


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
        from ...analysis.paths.continuation import Continuation

        return _made(Continuation, self.along_paths, ("continuation",))


def method_class(method: str) -> type:
    """The class behind a name in kebab-case, of ours or of an installed package.

    Or behind "package.module:Class", whose module is imported.  Raises InvalidInput for what
    can not be found, and for what is no solver.
    """
    if method in METHODS:
        return METHODS[method]
    if ":" in method:
        return _checked(load(method), method)
    others = installed(GROUP)
    if method not in others:
        own = "; one of your own is package.module:Class"
        known = nearest(method, [*METHODS, *others])
        raise InvalidInput(f"unknown method '{method}'{known}{own if 'known' in known else ''}")
    return _checked(loaded(others[method]), method)


def _checked(kind: Any, method: str) -> type:
    """A class from outside that drivers can use: a dataclass with `form` and `iterates`."""
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise InvalidInput(f"'{method}': expected the class of a solver, a dataclass")
    lacks = [name for name in ("form", "iterates") if not hasattr(kind, name)]
    if lacks:
        raise InvalidInput(f"'{method}': no solver, it has no {' and no '.join(lacks)}")
    return kind


def make_solver(method: str, options: dict[str, Any]) -> Solver:
    """A solver with some of its fields set; values may be texts, as on the command line."""
    kind = method_class(method)
    names = [f.name for f in dataclasses.fields(kind) if f.init]
    for name in options:
        if name not in names:
            raise InvalidInput(_no_such_field(method, name, names), ("solver", name))
    return _made(kind, options, ("solver",))


def _made(part: Any, options: dict[str, Any], where: Address) -> Any:
    """A dataclass, or a copy of an instance, with some fields set; `where` is its address."""
    kind = part if isinstance(part, type) else type(part)
    hints = hints_of(kind)
    values = {}
    for name, value in options.items():
        key = (*where, name)
        if name not in hints:
            hint = nearest(name, hints) if hints else ""
            raise InvalidInput(f"{_kebab(kind.__name__)} has no such field{hint}", key)
        default = usual_part(kind, name)
        if isinstance(value, dict) and "kind" not in value and default is not None:
            values[name] = _made(default, value, key)
        else:
            values[name] = _convert(key, value, hints[name])
    make: Any = part if isinstance(part, type) else partial(dataclasses.replace, part)
    try:
        return make(**values)
    except InvalidInput as reason:
        raise InvalidInput(reason.text, (*where, *reason.at)) from None


def _no_such_field(method: str, name: str, names: list[str]) -> str:
    """What the method has instead, and which methods have the field."""
    owners = [
        other for other, kind in METHODS.items()
        if any(f.name == name and f.init for f in dataclasses.fields(kind))
    ]  # fmt: skip
    text = f"{method} has no such field" if names else f"{method} has no fields"
    if owners:
        return f"{text}; '{name}' is a field of {', '.join(owners)}: choose with --method"
    meant = near(name, (*names, *GENERAL))
    if meant is not None:
        return f"{text}; did you mean '{meant}'?"
    return text + (nearest(name, names) if names else "")


def _convert(at: Address, value: Any, hint: Any) -> Any:
    """What a field gets for a text or a table; the field itself checks what remains.

    at: its address.  Texts are read as "none", numbers and truth values where the field
    takes such; words of enums are left to the field, see `amontons.options`.
    """
    hints = alternatives(hint)
    parts = [one for one in hints if _is_part(one)]
    if type(None) in hints and value == "none":
        return None
    if parts and isinstance(value, str | dict):
        return _component(at, value, parts[0])
    if parts or any(typing.get_origin(one) is tuple for one in hints):
        raise InvalidInput("can not be set here, use the Python interface", at)
    return _read(value, hints) if isinstance(value, str) else value


def _is_part(hint: Any) -> bool:
    """True for a class or protocol of parts of solvers."""
    plain = (bool, int, float, str, type(None))
    return isinstance(hint, type) and hint not in plain and not is_enum(hint)


def _read(text: str, hints: tuple[Any, ...]) -> Any:
    """The number or truth value that a text is, where one of the types takes such."""
    truth = {"true": True, "false": False}
    if bool in hints and text.lower() in truth:
        return truth[text.lower()]
    for kind in (int, float):
        if kind in hints:
            try:
                return kind(text)
            except ValueError:
                continue
    return text


def _component(at: Address, value: str | dict[str, Any], protocol: type) -> Any:
    """A part of a solver by its class name in kebab-case, or by a table with that as kind."""
    wanted = members_of(protocol)
    fitting: dict[str, type] = {
        _kebab(kind.__name__): kind
        for kind in (getattr(home, key) for home in (solvers, linear) for key in home.__all__)
        if isinstance(kind, type)
        and dataclasses.is_dataclass(kind)
        and all(hasattr(kind, key) for key in wanted)
    }
    options = dict(value) if isinstance(value, dict) else {"kind": value}
    if "kind" not in options and len(fitting) > 1:
        raise InvalidInput(f"missing, expected one of {', '.join(fitting)}", (*at, "kind"))
    chosen = str(options.pop("kind", next(iter(fitting))))
    if chosen not in fitting and ALIASES.get(chosen) in fitting:
        chosen = ALIASES[chosen]
    if chosen not in fitting:
        raise InvalidInput(f"unknown value '{chosen}'{nearest(chosen, fitting)}", at)
    return _made(fitting[chosen], options, at)


def _kebab(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "-", name).lower()
