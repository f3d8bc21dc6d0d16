"""What makes two runs the same: all that decides their numbers, and not how far they go."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from typing import Any

import numpy as np

from ...mechanics.meshes import Mesh
from ..readers import Case

MESH = "the mesh"  # key of the digest of its numbers
SOLVER = "solver."  # how keys begin that decide how well a step is solved, not what is solved
SHOWN = 3  # differences that a message names
ABSENT = "not there"
EXACT = 2**53  # below it whole numbers are numbers


def identity(case: Case) -> dict[str, Any]:
    """JSON data by dotted key: two cases with the same take the same steps.

    Meshes go in by their numbers: a mesh file may move, and must not change.  Left out: the
    title, names of units, the end in time, and limits on work, which can only stop a run.
    """
    tables = {key: value for key, value in case.tables.items()
              if key not in ("title", "solver", "evolution", "units")}  # fmt: skip
    if "mesh" in tables:
        given = tables["mesh"]
        tables["mesh"] = (
            [_without_file(one) for one in given] if isinstance(given, list)
            else _without_file(given)
        )  # fmt: skip
    assert case.evolution is not None
    settings = case.settings
    solver = {"method": settings.method, "tolerance": settings.tolerance,
              "contact_tolerance": settings.contact_tolerance, **settings.options}  # fmt: skip
    found = _flat({**tables, "evolution": case.evolution.method, "solver": solver})
    return {**found, MESH: _digest([body.mesh for body in case.model.bodies])}


def _without_file(mesh: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in mesh.items() if key != "file"}


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """What differs, in words: "material.default.young was 100.0, is 200.0"."""
    keys = [key for key in dict.fromkeys((*old, *new)) if old.get(key) != new.get(key)]
    found = [
        f"{key} has changed" if key == MESH
        else f"{key} was {_shown(old, key)}, is {_shown(new, key)}"
        for key in keys[:SHOWN]
    ]  # fmt: skip
    return found if len(keys) <= SHOWN else [*found, f"and {len(keys) - SHOWN} more"]


def _shown(values: dict[str, Any], key: str) -> str:
    text = json.dumps(values[key]) if key in values else ABSENT
    return text if len(text) <= 60 else f"{text[:59]}…"


def _flat(value: Any, key: str = "") -> dict[str, Any]:
    """Tables, lists and options as one table with dotted keys; whole numbers like all numbers.

    Options that are not set are not there.
    """
    if value is None:
        return {}
    if dataclasses.is_dataclass(value):
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        value = {"kind": type(value).__name__, **fields}
    if isinstance(value, dict):
        parts = [(f"{key}.{name}" if key else name, part) for name, part in value.items()]
    elif isinstance(value, list | tuple):
        parts = [(f"{key}[{k}]", part) for k, part in enumerate(value)]
    elif isinstance(value, int) and not isinstance(value, bool) and abs(value) < EXACT:
        return {key: float(value)}
    else:
        return {key: value if isinstance(value, bool | float | str) else str(value)}
    found: dict[str, Any] = {}
    for name, part in parts:
        found |= _flat(part, name)
    return found


def _digest(meshes: list[Mesh]) -> str:
    """A hash of nodes, cells and surfaces."""
    whole = hashlib.sha256()
    for mesh in meshes:
        _take(whole, "points", mesh.points)
        for block in mesh.cells:
            _take(whole, f"{block.kind} {block.region}", block.nodes)
        for name, parts in mesh.surfaces.items():
            for facets in parts:
                _take(whole, f"{name} {facets.kind}", facets.nodes)
    return whole.hexdigest()


def _take(whole: Any, name: str, values: Any) -> None:
    array = np.ascontiguousarray(values)
    whole.update(f"{name} {array.dtype.str} {array.shape}".encode())
    whole.update(array.tobytes())
