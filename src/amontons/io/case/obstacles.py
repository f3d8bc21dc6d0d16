"""Obstacles of a case file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...core.errors import shown
from ...core.expressions import Expression
from .tables import Table
from .values import steady

if TYPE_CHECKING:
    from ...mechanics.contact import Obstacle

KINDS = ("plane", "sphere", "cylinder", "profile", "level_set")


def read_obstacle(table: Table, dim: int) -> Obstacle:
    """The one obstacle of a table."""
    from ...mechanics.contact import Cylinder, LevelSet, Plane, Sphere

    table.only(*KINDS)
    if len(table.data) != 1:
        raise table.error("", f"expected one of {', '.join(KINDS)}")
    kind = next(iter(table.data))
    if kind == "level_set":
        function = steady(table, "level_set")
        if not isinstance(function, Expression):
            raise table.error(kind, f"expected an expression in x, y, z, got {function}")
        return LevelSet(function)
    inner = table.table(kind)
    if kind == "profile":
        return _profile(inner, dim)
    with inner.blamed():
        if kind == "plane":
            inner.only("point", "normal")
            point = inner.numbers("point", (dim,)) if "point" in inner.data else None
            return Plane(normal=inner.numbers("normal", (dim,)), point=point)
        if kind == "cylinder":
            inner.only("point", "axis", "radius", "hollow")
            hollow = inner.data.get("hollow", False)
            if not isinstance(hollow, bool):
                raise inner.error("hollow", f"expected true or false, got {shown(hollow)}")
            return Cylinder(inner.numbers("point", (3,)), inner.numbers("axis", (3,)),
                            inner.number("radius"), hollow)  # fmt: skip
        inner.only("center", "radius")
        return Sphere(center=inner.numbers("center", (dim,)), radius=inner.number("radius"))


def _profile(table: Table, dim: int) -> Obstacle:
    """A chain of lines and arcs, in 3D revolved about an axis or extruded."""
    from ...mechanics.contact import Extrusion, Profile, Revolution

    table.only("start", "steps", "point", "axis", "origin", "x_axis", "y_axis")
    given = table.need("steps", "ends of lines, [x, y], and of arcs, { end, center }")
    if not isinstance(given, list):
        raise table.error("steps", f"expected a list, got {shown(given)}")
    start = table.numbers("start", (2,))
    steps = [_step(table, k, step) for k, step in enumerate(given)]
    with table.blamed():
        profile = Profile(start, steps)
        if "axis" in table.data:
            table.need("point", "three numbers, a point of the axis")
            point = table.numbers("point", (3,))
            return Revolution(profile, point, table.numbers("axis", (3,)))
        if dim == 2:
            return profile
        axes = (table.numbers(key, (3,)) for key in ("origin", "x_axis", "y_axis"))
        return Extrusion(profile, *axes)


def _step(table: Table, k: int, given: Any) -> Any:
    """The end of a line, or end and center of an arc."""
    key = f"steps[{k}]"
    if isinstance(given, dict):
        arc = table.as_table(key, given)
        arc.only("end", "center")
        return arc.numbers("end", (2,)), arc.numbers("center", (2,))
    return Table(table.file, table.where, {key: given}).numbers(key, (2,))
