"""Pairs that a case file leaves to be found: [[contact]] with pairs = "auto"."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...core.errors import shown
from .contacts import contact_method, friction
from .tables import Table

if TYPE_CHECKING:
    from ...mechanics.model import Body, Contact, FoundContacts

KEYS = ("pairs", "friction", "method", "gap", "exclude", "itself")


def found_contacts(
    tables: Sequence[Table], bodies: Sequence[Body], known: Sequence[Contact]
) -> FoundContacts | None:
    """What the one table of them asks for, None without; known: contacts of the others."""
    from ...mechanics.model import find_contacts

    asking = [table for table in tables if "pairs" in table.data]
    if not asking:
        return None
    if len(asking) > 1:
        raise asking[1].error("pairs", "expected one table that asks for all other pairs; "
                              "name those with numbers of their own")  # fmt: skip
    table = asking[0]
    table.choice("pairs", ("auto",))
    table.only(*KEYS)
    gap = None
    if "gap" in table.data:
        gap = table.number("gap")
        if gap < 0:
            raise table.error("gap", f"expected a distance >= 0, got {gap}")
    itself = table.data.get("itself", False)
    if not isinstance(itself, bool):
        raise table.error("itself", f"expected true or false, got {shown(itself)}")
    law = friction(table)
    with table.blamed():
        return find_contacts(
            bodies, gap=gap, exclude=_names(table), known=known,
            itself=itself, method=contact_method(table), **law,
        )  # fmt: skip


def _names(table: Table) -> list[str | tuple[str, ...]]:
    """Names of bodies or parts, and lists of two."""
    given = table.data.get("exclude", [])
    ok = isinstance(given, list) and all(
        isinstance(one, str)
        or (isinstance(one, list) and len(one) == 2 and all(isinstance(n, str) for n in one))
        for one in given
    )
    if not ok:
        raise table.error("exclude", 'expected a list of names and pairs of names, ["pad", '
                          f'["ring", "shaft"]], got {shown(given)}')  # fmt: skip
    return [one if isinstance(one, str) else tuple(one) for one in given]
