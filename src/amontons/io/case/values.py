"""Numbers and expressions of a case file, and what has them on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import AmontonsError, InvalidInput, number_hint, shown
from ...core.expressions import Expression
from .tables import Table

if TYPE_CHECKING:
    from ...mechanics.model import Body


FREE = ("none", "null", "nan", "any")  # what users write for a free component


def on_surface(
    kind: type, table: Table, bodies: Sequence[Body], *more: str, free: bool = False
) -> Any:  # fmt: skip
    """A support or load of a table, on a surface that a body has; more: its other keys."""
    from ...mechanics.model.supports import locate

    part = on_named(kind, table, bodies[0].mesh.dim, *more, free=free)
    with table.blamed("on"):
        locate(bodies, part.on)
    return part


def on_named(kind: type, table: Table, dim: int, *more: str, free: bool = False) -> Any:
    """The same where the names of surfaces are not known yet."""
    table.only("on", "value", *more)
    value = vector(table, "value", dim, free=free)
    return kind(table.text("on"), value, **configuration(table))


def configuration(table: Table) -> dict[str, Any]:
    """The key configuration, where it is given."""
    if "configuration" not in table.data:
        return {}
    return {"configuration": table.choice("configuration", ("reference", "current"))}


def pressure_on(table: Table, bodies: Sequence[Body]) -> Any:
    """The pressure of a table [[pressure]]."""
    from ...mechanics.model import Pressure
    from ...mechanics.model.supports import locate

    table.only("on", "value")
    name = table.text("on")
    with table.blamed("on"):
        locate(bodies, name)
    given = table.need("value", "a number or an expression")
    value: Any = _entry(table, "value", given, bodies[0].mesh.dim)
    return Pressure(name, value)


def temperature_of(table: Table, bodies: Sequence[Body]) -> Any:
    """The change of temperature of a table [[temperature]]."""
    from ...mechanics.model import Temperature
    from ...mechanics.model.supports import locate

    table.only("value", "region", "on")
    given = table.need("value", "a number or an expression")
    value: Any = _entry(table, "value", given, bodies[0].mesh.dim)
    where: dict[str, Any] = {k: table.text(k) for k in ("region", "on") if k in table.data}
    if "on" in where:
        with table.blamed("on"):
            locate(bodies, where["on"], sets=True)
    with table.blamed():
        return Temperature(value, **where)


def vector(table: Table, key: str, dim: int, *, free: bool = False) -> list:
    """One number, expression or, for supports, "free" (None) per component."""
    words = "numbers or expressions" + (' or "free"' if free else "")
    values = table.need(key, f"a list of {dim} {words}")
    if not isinstance(values, list) or len(values) != dim:
        alone = isinstance(values, int | float | str) and values != "free"
        write = f"; write {[*[0] * (dim - 1), values]}" if alone else ""
        if isinstance(values, str) and values.count(",") == dim - 1:
            write = f"; write [{values}] without quotes"
        raise table.error(key, f"expected a list of {dim} {words}, got {shown(values)}{write}")
    return [
        None if free and value == "free" else _entry(table, f"{key}[{k}]", value, dim, free)
        for k, value in enumerate(values)
    ]


def scalar(table: Table, key: str) -> float | Expression:
    """A number, or an expression in x, y, z."""
    return _entry(table, key, table.need(key, "a number or an expression"), 3)


def _entry(
    table: Table, key: str, value: Any, dim: int, free: bool = False
) -> float | Expression:
    """A finite number, or an expression; one without variables is a number at once."""
    if not isinstance(value, str):
        return table.as_number(key, value)
    try:
        expression = Expression(value)
        if dim == 2 and "z" in expression.names:
            raise InvalidInput(f"expression {value!r}: 'z' does not exist in 2D")
        return expression if expression.names else float(expression(np.zeros(3)))
    except AmontonsError as reason:
        hint = number_hint(value)
        if value.strip().lower() in FREE:
            hint = '; did you mean "free"?' if free else ""
        raise table.error(key, f"{reason}{hint}") from None


def steady(table: Table, key: str) -> float | Expression:
    """A number or an expression without the time."""
    value = scalar(table, key)
    if isinstance(value, Expression) and "t" in value.names:
        raise table.error(key, "expected an expression in x, y, z: only loads and supports "
                          "depend on the time t")  # fmt: skip
    return value
