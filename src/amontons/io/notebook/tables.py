"""Results as tables of pandas and datasets of xarray, both optional."""

from __future__ import annotations

from functools import singledispatch
from importlib import import_module
from typing import Any

import numpy as np

from ...analysis.basins.study import Basins
from ...analysis.paths.diagram import Diagram
from ...analysis.paths.path import Branch
from ...analysis.solutions.enumerate import Solutions
from ...core.errors import InvalidInput, MissingDependency
from ...problem.solution import ContactStatus, Convergence, FrictionSolution
from ..results import Output

Columns = dict[str, Any]


def needed(package: str, what: str) -> Any:
    """The package; raises MissingDependency with the words that install it."""
    try:
        return import_module(package)
    except ImportError as reason:
        raise MissingDependency(
            f"{what} needs {package}: python -m pip install 'amontons[notebook]'"
        ) from reason


def to_dataframe(result: Any) -> Any:
    """A pandas table; raises InvalidInput for a result that is none."""
    pandas = needed("pandas", "to_dataframe")
    return pandas.DataFrame(columns(result))


@singledispatch
def columns(result: Any) -> Any:
    """The columns of a result, or its rows as dicts."""
    output = getattr(result, "output", None)  # of a solved model
    if not isinstance(output, Output):
        raise InvalidInput(f"to_dataframe: a {type(result).__name__} is no table")
    return columns(output)


def _per_contact(solution: FrictionSolution) -> Columns:
    words = np.array([status.name.lower() for status in ContactStatus])
    out: Columns = {"status": words[solution.status]}
    for name, array in (("r", solution.r), ("u", solution.u)):
        parts = ("N", "T1", "T2")[: array.shape[1]]
        out |= {f"{name}_{part}": array[:, k] for k, part in enumerate(parts)}
    return out


@columns.register
def _(result: FrictionSolution) -> Columns:
    return _per_contact(result)


@columns.register
def _(result: Output) -> Columns:
    fields, out = result.fields, _per_contact(result.solution)
    if fields is None:
        return out
    axes = dict(zip("xyz", fields.points.T, strict=False))
    force = {f"force_{axis}": part for axis, part in zip("xyz", fields.force.T, strict=False)}
    return {**axes, "body": fields.body, "node": fields.node, "area": fields.weights,
            "gap": fields.gap, "pressure": fields.pressure,
            "shear": np.linalg.norm(fields.shear, axis=1),
            "slip": np.linalg.norm(fields.slip, axis=1), **force, **out}  # fmt: skip


@columns.register
def _(result: Solutions) -> list[Columns]:
    return [
        {"pattern": s.pattern, "error": s.error, "orientation": s.orientation,
         "energy": s.energy, "freedom": s.freedom}
        for s in result.solutions
    ]  # fmt: skip


def _flat(row: Columns) -> Columns:
    """A row whose dicts have become columns of their own."""
    out: Columns = {}
    for name, value in row.items():
        out |= value if isinstance(value, dict) else {name: value}
    return out


@columns.register
def _(result: Branch) -> list[Columns]:
    return [_flat(row) for row in result.table()]


@columns.register
def _(result: Diagram) -> list[Columns]:
    return [{"branch": k, **_flat(row)} for k, b in enumerate(result) for row in b.table()]


@columns.register
def _(result: Basins) -> list[Columns]:
    return [_flat(row) for row in result.table()]


@columns.register
def _(result: Convergence) -> list[Columns]:
    names = ("iteration", "error", "linear_iterations", "seconds")
    return [{name: getattr(step, name) for name in names} for step in result.history]


def to_xarray(result: Any) -> Any:
    """An xarray dataset; raises InvalidInput for a result without one."""
    xarray = needed("xarray", "to_xarray")
    variables, coordinates, attributes = arrays(result)
    return xarray.Dataset(variables, coordinates, attributes)


Parts = tuple[Columns, Columns, Columns]  # variables, coordinates, attributes


@singledispatch
def arrays(result: Any) -> Parts:
    """Variables with the names of their dimensions, coordinates, attributes."""
    output = getattr(result, "output", None)
    if not isinstance(output, Output):
        raise InvalidInput(
            f"to_xarray: a {type(result).__name__} has none, expected a solution or a branch"
        )
    return arrays(output)


@arrays.register
def _(result: FrictionSolution) -> Parts:
    local = ("contact", "component")
    record = result.convergence
    variables = {"r": (local, result.r), "u": (local, result.u),
                 "status": ("contact", result.status)}  # fmt: skip
    names = ["N", "T1", "T2"][: result.r.shape[1]]
    return variables, {"component": names}, {"outcome": record.outcome.name.lower(),
                                             "error": record.error}  # fmt: skip


@arrays.register
def _(result: Output) -> Parts:
    variables, coordinates, attributes = arrays(result.solution)
    fields, model = result.fields, result.model
    if fields is None or model is None:
        return variables, coordinates, attributes
    variables |= {name: ("contact", getattr(fields, name)) for name in ("gap", "pressure")}
    variables |= {"area": ("contact", fields.weights),
                  "place": (("contact", "axis"), fields.points),
                  "force": (("contact", "axis"), fields.force)}  # fmt: skip
    for k, (body, moved) in enumerate(zip(model.bodies, fields.displacement, strict=True)):
        name = body.name or f"body{k + 1}"
        variables[f"points_{name}"] = ((f"node_{name}", "axis"), body.mesh.points)
        variables[f"displacement_{name}"] = ((f"node_{name}", "axis"), moved)
    coordinates["axis"] = list("xyz"[: fields.points.shape[1]])
    return variables, coordinates, attributes


@arrays.register
def _(result: Branch) -> Parts:
    variables = {"y": (("point", "unknown"), result.states),
                 "arclength": ("point", result.arclength)}  # fmt: skip
    return variables, {result.name: ("point", result.parameter)}, {}
