"""Which key of a case file an address in its model is."""

from __future__ import annotations

from typing import Any

from ...core.errors import Address, dotted

# in the order in which a model has them
LOADS = ("traction", "pressure", "body_force", "temperature")
FRICTION = {"mu": "coulomb", "mu_across": "coulomb", "direction": "direction",
            "tresca": "tresca", "cap": "cap", "cohesion": "cohesion",
            "stiffness": "stiffness", "stick_stiffness": "stick_stiffness"}  # fmt: skip


def key_of(at: Address, tables: dict[str, Any]) -> str:
    """The key, such as contact[0].friction.coulomb of ("contacts", 0, "mu"); "" of none.

    tables: what the file says.  Bodies and contacts of [wall] have no tables of their own.
    """
    part, *rest = at or ("",)
    if part in ("bodies", "contacts") and "wall" in tables:
        return "wall"
    if part == "bodies":
        several = rest[:1] if isinstance(tables.get("mesh"), list) else ()
        return "material" if "material" in rest else dotted(("mesh", *several))
    if part == "supports":
        if rest and int(rest[0]) >= len(tables.get("fix", ())):
            return "pretension" if "pretension" in tables else "reference"
        return dotted(("fix", *rest))
    if part in ("references", "springs"):
        return dotted((part.removesuffix("s"), *rest[:1]))
    if part == "constraints":
        return _constraint_key(int(rest[0]) if rest else 0, tables)
    if part == "contacts":
        inner = [key for name in rest[1:] for key in _contact_keys(name)]
        return dotted(("contact", *_contact_at(rest[:1], tables), *inner))
    if part == "loads" and rest:
        return _load_key(int(rest[0]), tuple(rest[1:]), tables)
    return ""


def _constraint_key(number: int, tables: dict[str, Any]) -> str:
    for kind in ("coupling", "equation", "pretension"):
        count = len(tables.get(kind, ()))
        if number < count:
            return dotted((kind, number))
        number -= count
    return ""


def _contact_at(number: list[str | int], tables: dict[str, Any]) -> list[str | int]:
    """The table of a contact: those that are found come after all others."""
    given = tables.get("contact", ())
    places = sorted(range(len(given)), key=lambda k: "pairs" in given[k])
    if not (number and places):
        return number
    return [places[min(int(number[0]), len(places) - 1)]]


def _contact_keys(name: str | int) -> Address:
    return ("friction", FRICTION[name]) if name in FRICTION else (name,)


def _load_key(number: int, inner: Address, tables: dict[str, Any]) -> str:
    for kind in LOADS:
        count = len(tables.get(kind, ()))
        if number < count:
            return dotted((kind, number, *inner))
        number -= count
    return ""
