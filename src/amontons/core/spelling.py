"""Types of compiled functions in words that can be read back."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

from numba import types


def spelled(arguments: Sequence[types.Type]) -> str:
    """Types as Python that `read` understands: "float64, Array(int64, 1, 'C')"."""
    return ", ".join(map(_one, arguments))


def _one(kind: Any) -> str:
    if isinstance(kind, types.Array):
        flags = "" if kind.mutable else ", readonly=True"
        flags += "" if kind.aligned else ", aligned=False"
        return f"Array({_one(kind.dtype)}, {kind.ndim}, {kind.layout!r}{flags})"
    if isinstance(kind, types.BaseNamedTuple):
        made = kind.instance_class
        return f"named({made.__module__ + ':' + made.__qualname__!r}, {spelled(kind.types)})"
    if isinstance(kind, types.UniTuple):
        return f"UniTuple({_one(kind.dtype)}, {kind.count})"
    if isinstance(kind, types.Tuple):
        return f"Tuple(({spelled(kind.types)},))"
    if isinstance(kind, types.Omitted):
        return f"Omitted({kind.value!r})"
    return str(kind)


def read(text: str) -> tuple[types.Type, ...]:
    """The types that `spelled` has put in words; raises NameError or SyntaxError for others."""
    names = {name: getattr(types, name) for name in dir(types)}
    names |= {"bool": types.boolean, "named": _named, "__builtins__": {}}
    return tuple(eval(f"[{text}]", names))


def _named(made: str, *members: types.Type) -> Any:
    """The type of a named tuple "module:class" with these members."""
    module, name = made.split(":")
    return types.BaseTuple.from_types(members, getattr(importlib.import_module(module), name))
