"""Contacts of one slave with several masters, as one contact with all of them.

Where contact is found at finite sliding a node carries one force: that of the average over all
that it faces, of whichever body.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from .parts import Contact

APART = ("master", "more_masters", "name")  # what contacts that are one may differ in


def with_masters(contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
    """Contacts without those of a slave whose law another contact of it has."""
    out: list[Contact] = []
    for contact in contacts:
        for k, other in enumerate(out):
            if _are_one(other, contact):
                more = (*other.more_masters, *contact.masters)
                out[k] = replace(other, more_masters=more, name=other.name or contact.name)
                break
        else:
            out.append(contact)
    return tuple(out)


def _are_one(one: Contact, other: Contact) -> bool:
    """Whether two contacts differ in masters alone, which neither has twice."""
    if one.slave != other.slave or one.master is None or other.master is None:
        return False
    if one.name and other.name:  # both are asked for by name
        return False
    if set(one.masters) & {*other.masters, one.slave} or other.slave in other.masters:
        return False
    names = [f.name for f in fields(Contact) if f.name not in APART]
    return all(_same(getattr(one, name), getattr(other, name)) for name in names)


def _same(one: object, other: object) -> bool:
    """Whether two values are one: the same object, or equal numbers, words and arrays."""
    if one is other:
        return True
    if callable(one) or callable(other):
        return False
    try:
        return bool(np.array_equal(np.asarray(one), np.asarray(other)))
    except (TypeError, ValueError):
        return False
