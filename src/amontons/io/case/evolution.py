"""The [evolution] and [wall] tables of a case file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from .tables import Table

if TYPE_CHECKING:
    from ...analysis.paths.continuation import Continuation
    from ...mechanics.ready.walls import Wall
    from ...mechanics.steps import MoreauJean, QuasiStatic

KINDS = ("dynamic", "quasi-static")


@dataclass(frozen=True)
class Evolution:
    """How a case goes on in time: the method, and the end."""

    method: MoreauJean | QuasiStatic
    until: float


def read_evolution(table: Table, options: Continuation | None = None) -> Evolution:
    """kind, step, until, and the fields of QuasiStatic or MoreauJean; crossing: a switch.

    options: of the steps along a path that is crossed.
    """
    from ...mechanics.steps import MoreauJean, QuasiStatic

    kind = table.choice("kind", KINDS, KINDS[0])
    method = MoreauJean if kind == "dynamic" else QuasiStatic
    names = [field.name for field in fields(method)]
    table.only("kind", "until", *names)
    until = table.number("until")
    if not until > 0:
        raise table.error("until", f"expected a time > 0, got {until}")
    values: dict[str, Any] = {"step": table.number("step")}
    for field in fields(method):
        if field.name in table.data and field.name != "step":
            switch = isinstance(field.default, bool) or field.name == "crossing"
            values[field.name] = _value(table, field.name, switch)
    if "crossing" in values:
        from ...analysis.paths.path_crossing import PathCrossing

        crossing = PathCrossing() if options is None else PathCrossing(options)
        values["crossing"] = crossing if values["crossing"] else None
    if until < values["step"]:
        raise table.error("until", f"expected at least the first step, {values['step']:g}, got "
                          f"{until:g}; take smaller steps")  # fmt: skip
    return Evolution(method(**values), until)  # type: ignore[arg-type]


def _value(table: Table, key: str, is_switch: bool) -> float | bool:
    return _switch(table, key) if is_switch else table.number(key)


def _switch(table: Table, key: str) -> bool:
    if not isinstance(table.data[key], bool):
        raise table.error(key, f"expected true or false, got {table.data[key]!r}")
    return table.data[key]


def read_wall(table: Table, materials: dict[str, Any]) -> Wall:
    """The wall of a table [wall]; materials: default and, for plate and base, plate."""
    from ...mechanics.ready.walls import Bond, Wall

    table.only("rows", "blocks", "size", "cells", "bond", "friction", "support_friction",
               "plate", "base", "rigid")  # fmt: skip
    words = {bond.name.lower(): bond for bond in Bond}
    counts = table.need("cells", "whole numbers, one per direction")
    if not isinstance(counts, list) or not all(type(c) is int and c >= 1 for c in counts):
        raise table.error("cells", f"expected whole numbers >= 1, got {counts!r}")
    return Wall(
        table.whole("rows") or _missing(table, "rows"),
        table.whole("blocks") or _missing(table, "blocks"),
        tuple(table.numbers("size", (2, 3))), tuple(counts), materials["default"],
        bond=words[table.choice("bond", tuple(words), "running")],
        mu=table.number("friction"), mu_support=table.number("support_friction"),
        plate=table.number("plate", 0.0), plate_material=materials.get("plate"),
        base=table.number("base", 0.0), rigid="rigid" in table.data and _switch(table, "rigid"),
    )  # fmt: skip


def _missing(table: Table, key: str) -> int:
    table.need(key, "a whole number")
    raise table.error(key, "expected a whole number >= 1")
