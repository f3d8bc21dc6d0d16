"""Contacts and obstacles of a case file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...core.expressions import Expression
from .tables import Blame, Table
from .values import configuration, scalar

if TYPE_CHECKING:
    from ...mechanics.contact import Nitsche, Obstacle
    from ...mechanics.meshes import Mesh
    from ...mechanics.model import Contact

LAWS = "a table, { coulomb = COEFFICIENT } or { tresca = STRESS }"


def read_contact(table: Table, mesh: Mesh) -> Contact:
    """The contact of a table [[contact]]."""
    from ...mechanics.model import Contact

    table.only("slave", "obstacle", "master", "friction", "method", "configuration")
    method = _contact_method(table)
    slave = table.text("slave")
    for key in ("slave", "master"):
        if key in table.data:
            with Blame(table, key):
                mesh.surface(table.text(key))
    if ("obstacle" in table.data) == ("master" in table.data):
        raise table.error("", "expected either obstacle or master")
    friction = table.as_table("friction", table.need("friction", LAWS), LAWS)
    friction.only("coulomb", "tresca")
    if len(friction.data) != 1:
        raise friction.error("", "expected either coulomb, a coefficient, or tresca, a stress")
    key = next(iter(friction.data))
    value = _steady(friction, key)
    if isinstance(value, float) and value < 0:
        raise friction.error(key, f"expected a number >= 0, got {value}")
    mu, tresca = (value, None) if key == "coulomb" else (None, value)
    with Blame(table, ""):
        if "master" in table.data:
            master = table.text("master")
            return Contact(slave, master=master, mu=mu, tresca=tresca, method=method,
                           **configuration(table))  # fmt: skip
        obstacle = _obstacle(table.table("obstacle"), mesh.dim)
        return Contact(slave, obstacle, mu=mu, tresca=tresca, method=method,
                       **configuration(table))  # fmt: skip


def _steady(table: Table, key: str) -> float | Expression:
    """A number or an expression without the time."""
    value = scalar(table, key)
    if isinstance(value, Expression) and "t" in value.names:
        raise table.error(key, "expected an expression in x, y, z: only loads and supports "
                          "depend on the time t")  # fmt: skip
    return value


def _contact_method(table: Table) -> str | Nitsche | None:
    """A word, or a table { kind = "nitsche", kappa = …, theta = … } of options, or None."""
    from ...mechanics.contact import Nitsche

    if "method" not in table.data:
        return None
    if not isinstance(table.data.get("method"), dict):
        return table.choice("method", ("nodal", "mortar", "dual-mortar", "nitsche"))
    options = table.table("method")
    options.only("kind", "kappa", "scale", "theta", "points")
    options.need("kind", "'nitsche', the method that has options")
    options.choice("kind", ("nitsche",))
    values: dict[str, Any] = {
        key: options.number(key) for key in ("kappa", "scale", "theta") if key in options.data
    }
    if "points" in options.data:
        values["points"] = options.whole("points")
    with Blame(options, ""):
        return Nitsche(**values)


def refuse_repeated(top: Table) -> None:
    """The same pair twice would share its load at random; two laws do not fit one problem."""
    seen: list[dict[str, Any]] = []
    tables = top.tables("contact")
    for table in tables:
        law, first = (set(part.data["friction"]) for part in (table, tables[0]))
        if law != first:
            raise table.error(
                "friction", f"expected {first.pop()} as in contact[0], one law for all, "
                f"got {law.pop()}"
            )  # fmt: skip
        pair = {key: table.data.get(key) for key in ("slave", "obstacle", "master")}
        if pair in seen:
            raise table.error(
                "", f"the same slave and partner as in contact[{seen.index(pair)}]; "
                "expected every pair once"
            )  # fmt: skip
        seen.append(pair)


def _obstacle(table: Table, dim: int) -> Obstacle:
    from ...mechanics.contact import LevelSet, Plane, Sphere

    table.only("plane", "sphere", "level_set")
    if len(table.data) != 1:
        raise table.error("", "expected one of plane, sphere, level_set")
    kind = next(iter(table.data))
    if kind == "level_set":
        function = _steady(table, "level_set")
        if not isinstance(function, Expression):
            raise table.error(kind, f"expected an expression in x, y, z, got {function}")
        return LevelSet(function)
    inner = table.table(kind)
    with Blame(inner, ""):
        if kind == "plane":
            inner.only("point", "normal")
            point = inner.numbers("point", (dim,)) if "point" in inner.data else None
            return Plane(normal=inner.numbers("normal", (dim,)), point=point)
        inner.only("center", "radius")
        return Sphere(center=inner.numbers("center", (dim,)), radius=inner.number("radius"))
