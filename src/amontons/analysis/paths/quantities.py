"""Numbers along a branch by name: for axes of figures, and as columns of a table.

    load, friction, parameter     the parameter, whatever it is called
    arclength, norm, open, ...    a column of `Branch.table`
    r_N 3, r_T 3, u_N 3, u_T 3    reaction or motion of contact 3, counted from 0; in 3D |r_T|
    sum r_N, sum r_T              over all contacts; in 3D of |r_T|
    force x                       sum of the contact forces on the slaves, with a model
    displacement y top            mean over the nodes of a surface, with a model

Signs and units are those of the problem.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, shown

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from .path import Branch

Array = NDArray[np.float64]
Quantity = str | Callable[[Any], float]
PARAMETER = "parameter"
OF_CONTACTS = ("r_N", "r_T", "u_N", "u_T")
KNOWN = (
    "parameter, arclength, a column of its table, 'r_N 3' (contact 3; also r_T, u_N, u_T), "
    "'sum r_N', 'sum r_T', 'force x' or 'displacement y SURFACE' with model="
)


@dataclass(frozen=True, eq=False)
class _Asked:
    """A quantity of a branch, in words."""

    branch: Branch
    name: str
    model: Model | None

    def wrong(self, why: str) -> InvalidInput:
        return InvalidInput(f"quantity {self.name!r}: {why}; expected {KNOWN}")


def values_of(branch: Branch, quantity: Quantity, model: Model | None = None) -> Array:
    """A quantity at all points of a branch, (points,).

    quantity: a name as in this module, or a function of one entry of `Branch.solutions`.
    Raises InvalidInput for a name that the branch does not have.
    """
    if callable(quantity):
        return np.array([float(quantity(s)) for s in branch.solutions], dtype=float)
    if not isinstance(quantity, str):
        raise InvalidInput(f"quantity: expected a name or a function, got {shown(quantity)}")
    words = quantity.split()
    asked = _Asked(branch, quantity, model)
    if len(words) == 2 and words[0] in OF_CONTACTS:
        return _of_contact(asked, *words)
    if len(words) == 2 and words[0] == "sum" and words[1] in OF_CONTACTS[:2]:
        r = _reactions(asked)
        return _component(r, words[1]).sum(axis=1)
    if len(words) == 2 and words[0] == "force":
        return _force(asked, words[1])
    if len(words) == 3 and words[0] == "displacement":
        return _displacement(asked, words[1], words[2])
    return _column(asked)


def columns(branch: Branch) -> dict[str, list[Any]]:
    """The table of a branch by columns, nested ones flat; with the orientation of each point.

    orientation: of the line from this point on, of the last point that to it.
    """
    found: dict[str, list[Any]] = {}
    sign = branch.orientation
    for k, row in enumerate(branch.table()):
        flat = {"parameter": row.pop("parameter"), "arclength": row.pop("arclength")}
        if len(sign):
            flat["orientation"] = int(sign[min(k, len(sign) - 1)])
        for key, value in row.items():
            flat |= value if isinstance(value, dict) else {key: value}
        for key, value in flat.items():
            found.setdefault(key, []).append(value)
    return found


def csv_of(branches: Sequence[Branch], extra: Sequence[str], model: Model | None) -> str:
    """All points of branches as CSV, one row each; extra: further quantities by name."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names: dict[str, None] = {}
    tables = []
    for branch in branches:
        table = columns(branch)
        table |= {name: values_of(branch, name, model).tolist() for name in extra}
        names |= dict.fromkeys(table)
        tables.append(table)
    head = ["branch"] if len(branches) > 1 else []
    first = branches[0].name if branches else PARAMETER
    writer.writerow([*head, *(first if name == PARAMETER else name for name in names)])
    for number, (branch, table) in enumerate(zip(branches, tables, strict=True)):
        for k in range(len(branch)):
            row = [table[name][k] if name in table else "" for name in names]
            writer.writerow([*([number] if head else []), *map(_cell, row)])
    return out.getvalue()


def _cell(value: Any) -> Any:
    """A number so that it is read back as it is."""
    return repr(float(value)) if isinstance(value, float | np.floating) else value


# ------------------------------------------------------------------------------- by name
def _column(asked: _Asked) -> Array:
    """The parameter, or a column of numbers of the table."""
    if asked.name in (PARAMETER, asked.branch.name):
        return asked.branch.parameter
    if asked.name == "arclength":
        return asked.branch.arclength
    table = columns(asked.branch)
    if asked.name not in table:
        raise asked.wrong(f"this branch has {', '.join(table)}")
    try:
        return np.array(table[asked.name], dtype=float)
    except (TypeError, ValueError):
        raise asked.wrong("no numbers") from None


def _reactions(asked: _Asked, name: str = "r") -> Array:
    """r or u of all points, (points, nc, d)."""
    try:
        return np.array([getattr(solution, name) for solution in asked.branch.solutions])
    except AttributeError:
        raise asked.wrong("the points of this branch have no contacts") from None


def _component(values: Array, name: str) -> Array:
    """Normal part or tangential part of (points, nc, d), the size of the latter in 3D."""
    if name.endswith("N"):
        return values[..., 0]
    return values[..., 1] if values.shape[-1] == 2 else np.linalg.norm(values[..., 1:], axis=-1)


def _of_contact(asked: _Asked, name: str, number: str) -> Array:
    """A reaction or a motion of one contact."""
    values = _reactions(asked, name[0])
    if not number.isdecimal() or int(number) >= values.shape[1]:
        raise asked.wrong(f"no contact {number} among 0 .. {values.shape[1] - 1}")
    return _component(values[:, int(number)], name)


def _force(asked: _Asked, axis: str) -> Array:
    """Sum of the contact forces on the slaves, global axes."""
    from ...mechanics.contact import forces

    model, k = _model(asked), _axis(asked, axis)
    rows = [placed.rows for placed in model.discretisation.placed]
    return np.array([forces(rows, r)[:, k].sum() for r in _reactions(asked)])


def _displacement(asked: _Asked, axis: str, surface: str) -> Array:
    """Mean displacement of the nodes of a surface."""
    from ...mechanics.model.supports import locate, prescribed_values
    from ...mechanics.steps.timed import part_at, steady

    model, k = _model(asked), _axis(asked, axis)
    body, name = locate(model.bodies, surface)
    parts = steady(model).discretisation
    nodes = model.bodies[body].mesh.surface_nodes(name)
    found = []
    grows = asked.branch.name == "load" and steady(model) is model
    for point, solution in zip(asked.branch.points, asked.branch.solutions, strict=True):
        if getattr(solution, "v", None) is None:
            raise asked.wrong("the points of this branch have no displacements")
        supports = [part_at(support, point.parameter) for support in model.supports]
        prescribed = prescribed_values(model.bodies, supports, parts.beside)  # type: ignore[arg-type]
        factor = point.parameter if grows else model.load_factor
        whole = parts.spread(solution.v, factor * prescribed)
        own = whole[parts.offsets[body] : parts.offsets[body + 1]].reshape(-1, model.dimension)
        found.append(float(own[nodes, k].mean()))
    return np.array(found)


def _model(asked: _Asked) -> Model:
    if asked.model is None:
        raise asked.wrong("it needs the model")
    return asked.model


def _axis(asked: _Asked, axis: str) -> int:
    axes = "xyz"[: _model(asked).dimension]
    if len(axis) != 1 or axis not in axes:
        raise asked.wrong(f"no axis {axis!r} among {', '.join(axes)}")
    return axes.index(axis)
