"""Fields of solvers and of their parts: what they are given, held against their annotations.

Every dataclass of options calls `check_options` first in its `__post_init__`, so that a word
chooses what it says and a value of the wrong type is refused where it is given, from Python as
from case files and the command line.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Sequence
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from .errors import InvalidInput, shown

NOTHING = object()  # stands for a value that does not fit


def check_options(part: Any) -> None:
    """Words of enum fields become their members, whole numbers in float fields floats.

    part: a dataclass of options that is being made.  Raises InvalidInput that names the field,
    what it takes, the value, and the class.
    """
    kind = type(part)
    for name, hint in hints_of(kind).items():
        value = getattr(part, name)
        taken = _taken(value, hint)
        if taken is NOTHING:
            wanted = _wanted(hint, kind, name)
            text = f"expected {wanted}, got {shown(value)}"
            error = InvalidInput(f"{text} (field of {kind.__name__})", (name,))
            error.text = text  # keys of files and the command line say of which part
            raise error
        if taken is not value:
            object.__setattr__(part, name, taken)  # frozen, and not yet shown to anybody


@cache
def hints_of(kind: type) -> dict[str, Any]:
    """Annotations of the fields that a dataclass is made from."""
    hints = typing.get_type_hints(kind)
    return {f.name: hints[f.name] for f in dataclasses.fields(kind) if f.init}


def alternatives(hint: Any) -> tuple[Any, ...]:
    """The types of a union, or the one type that an annotation is."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return typing.get_args(hint)
    return (hint,)


def is_enum(hint: Any) -> bool:
    """True for a class of words."""
    return isinstance(hint, type) and issubclass(hint, Enum)


def words(kind: type[Enum]) -> dict[str, Enum]:
    """The members of an enum by their names in kebab-case."""
    return {member.name.lower().replace("_", "-"): member for member in kind}


def members_of(protocol: type) -> list[str]:
    """What an object needs to have to follow a protocol."""
    return [key for key in vars(protocol) if not key.startswith("_")]


def _taken(value: Any, hint: Any) -> Any:
    """The value as a field of this type keeps it; NOTHING where it does not fit."""
    for one in alternatives(hint):
        taken = _as_one(value, one)
        if taken is not NOTHING:
            return taken
    return NOTHING


def _as_one(value: Any, hint: Any) -> Any:
    if hint is type(None):
        fits = value is None
    elif is_enum(hint):
        if isinstance(value, str):
            return words(hint).get(value.lower().replace("_", "-"), NOTHING)
        fits = isinstance(value, hint)
    elif hint is bool:
        return bool(value) if isinstance(value, bool | np.bool_) else NOTHING
    elif hint in (int, float):
        return _number(value, hint)
    elif typing.get_origin(hint) is tuple:
        fits = isinstance(value, Sequence) and not isinstance(value, str)
    elif getattr(hint, "_is_protocol", False):
        has_all = all(hasattr(value, key) for key in members_of(hint))
        fits = has_all and not isinstance(value, type)
    else:
        fits = isinstance(value, hint)
    return value if fits else NOTHING


def _number(value: Any, kind: type) -> Any:
    """A finite int or float; no truth value, no text, no fraction for a whole number."""
    accepted = (int, np.integer) if kind is int else (int, float, np.integer, np.floating)
    if isinstance(value, bool | Enum) or not isinstance(value, accepted):
        return NOTHING
    try:
        number = kind(value)
    except OverflowError:  # an int that no float can hold
        return NOTHING
    return number if math.isfinite(number) else NOTHING


def _wanted(hint: Any, kind: type, name: str) -> str:
    """What a field takes, for messages."""
    return " or ".join(_in_words(one, kind, name) for one in alternatives(hint))


def _in_words(hint: Any, kind: type, name: str) -> str:
    if is_enum(hint):
        return " or ".join(words(hint))
    if typing.get_origin(hint) is tuple:
        return "a sequence"
    plain = {
        type(None): "None", bool: "True or False", int: "a whole number", float: "a number",
        str: "a text",
    }  # fmt: skip
    if hint in plain:
        return plain[hint]
    usual = usual_part(kind, name)
    example = f", such as {type(usual).__name__}()" if usual is not None else ""
    return f"an instance of {hint.__name__}{example}"


def usual_part(kind: type, name: str) -> Any:
    """The part that a field holds when nothing is said, None where it holds a value."""
    field = next(f for f in dataclasses.fields(kind) if f.name == name)
    made = field.default_factory
    return None if made is dataclasses.MISSING else made()
