"""Single values set on the command line: `mesh.cells=32`, `contact.friction.coulomb=0.5`."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...core.errors import FileFormatError, InvalidInput
from .settings import LIMITS, NUMBERS, Settings, method_class

DEEPEST = 50  # tables in tables: further down Python itself gives up
DIGITS = 9  # of an index


def split_override(text: str) -> tuple[list[str], Any]:
    """Dotted path and value of "a.b=value"; the value is read as TOML, else as a text.

    "a[0].b", as messages have it, is "a.0.b".
    """
    key, sign, value = text.partition("=")
    path = [part.strip() for part in re.sub(r"\[(\d+)\]", r".\1", key).split(".")]
    if not sign or not all(path):
        raise InvalidInput(f"--set {text}: expected key=value, such as mesh.cells=32")
    if len(path) > DEEPEST:
        raise InvalidInput(f"--set {text}: expected at most {DEEPEST} parts of a key")
    return path, _value(value.strip())


def _value(text: str) -> Any:
    try:
        found = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return text
    return found["value"] if set(found) == {"value"} else text


def check_depth(data: dict[str, Any], file: str) -> None:
    """Raise FileFormatError for tables and lists in each other that no case can need."""
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        inner = (list(part.values()) if isinstance(part, dict) else part for part in level)
        level = [x for part in inner for x in part if isinstance(x, dict | list)]
    if level:
        raise FileFormatError(f"{file}: expected tables and lists at most {DEEPEST} deep")


def apply_overrides(
    data: dict[str, Any], overrides: Sequence[str], file: str
) -> dict[str, Any]:
    """A copy of the data of a case file with some values replaced or added.

    A list of tables takes an index, `fix.0.on=top`; the only one needs none.
    """
    data = copy.deepcopy(data)
    for text in overrides:
        path, value = split_override(text)
        set_value(data, path, value, f"{file}: --set {text}")
    return data


def set_value(data: dict[str, Any], path: list[str], value: Any, blame: str) -> None:
    """Set one value of nested tables and lists in place; `blame` begins its complaints."""
    node: Any = data
    for k, part in enumerate(path):
        last = k == len(path) - 1
        if isinstance(node, list) and not part.isdigit() and len(node) == 1:
            node = node[0]
        if isinstance(node, list):
            if not part.isdecimal() or len(part) > DIGITS or int(part) >= len(node):
                raise InvalidInput(
                    f"{blame}: expected an index from 0 to {len(node) - 1}, got '{part}'"
                )
            key: Any = int(part)
        elif isinstance(node, dict):
            key = part
        else:
            raise InvalidInput(f"{blame}: '{path[k - 1]}' is a value, it has no '{part}'")
        if last:
            node[key] = value
        else:
            node = node.setdefault(key, {}) if isinstance(node, dict) else node[key]


def override_settings(settings: Settings, overrides: Sequence[str]) -> Settings:
    """Settings changed by `solver.field=value`; `make_solver` checks the fields.

    By `continuation.field=value`, too.
    """
    for text in overrides:
        path, value = split_override(text)
        if path[0] == "continuation" and len(path) == 2:
            paths = {**settings.along_paths, path[1]: value}
            settings = replace(settings, along_paths=paths)
            settings.continuation()
            continue
        named = path[1:2] and path[1] in (*LIMITS, *NUMBERS, "method")
        if path[0] != "solver" or len(path) < 2 or (named and len(path) > 2):
            raise InvalidInput(
                f"--set {text}: expected solver.FIELD=VALUE or continuation.FIELD=VALUE, as "
                "this is not a case file"
            )
        key = path[1]
        if key in LIMITS:
            if type(value) is not int or value < 1:
                raise InvalidInput(f"--set {text}: expected a whole number >= 1")
            settings = replace(settings, max_iterations=value)
        elif key in NUMBERS:
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise InvalidInput(f"--set {text}: expected a number")
            settings = replace(settings, **{key: float(value)})
        elif key == "method":
            method_class(str(value))
            settings = replace(settings, method=str(value))
        else:
            options = copy.deepcopy(settings.options)
            set_value(options, path[1:], value, f"--set {text}")
            settings = replace(settings, options=options)
    return settings
