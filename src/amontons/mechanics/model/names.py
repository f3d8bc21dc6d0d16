"""Lists of a model's parts, checked, and a name for each of them that no other has."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ...core.errors import InvalidInput, within

if TYPE_CHECKING:
    from .parts import Body, Contact, Fix


def tuple_of(name: str, values: object, kind: object) -> tuple:
    """The list `name` of a model, of objects of one kind; raises InvalidInput."""
    wanted = getattr(kind, "__name__", _either(kind))
    if isinstance(values, kind):  # type: ignore[arg-type]
        raise InvalidInput(f"{name}: expected a list of {wanted}, got one alone; write [it]")
    try:
        items = tuple(values)  # type: ignore[arg-type]
    except TypeError as error:
        raise InvalidInput(f"{name}: expected a list, got {values!r}") from error
    for item in items:
        if not isinstance(item, kind):  # type: ignore[arg-type]
            raise InvalidInput(f"{name}: expected {wanted}, got {item!r}")
    return items


def _either(kind: object) -> str:
    """The classes of a union in words."""
    *names, last = [each.__name__ for each in getattr(kind, "__args__", (object,))]
    return f"{', '.join(names)} or {last}"


def named_bodies(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """Bodies with distinct names: "body", or "body 1", "body 2", … where none is given."""
    several = len(bodies) > 1
    out = tuple(
        body if body.name else replace(body, name=f"body {k + 1}" if several else "body")
        for k, body in enumerate(bodies)
    )
    names = [body.name for body in out]
    if len(set(names)) < len(names):
        raise InvalidInput(f"bodies: expected distinct names, got {', '.join(names)}")
    return out


def pair_names(contacts: Sequence[Contact]) -> tuple[str, ...]:
    """The name of every contact pair: its own, else its slave's, with a number if shared.

    Raises InvalidInput where two contacts are given one name.
    """
    given: dict[str, int] = {}
    for k, contact in enumerate(contacts):
        if contact.name and given.setdefault(contact.name, k) != k:
            with within("contacts", k, "name"):
                raise InvalidInput(
                    f"expected names that differ, got {contact.name!r} as for contact "
                    f"{given[contact.name]} on {contacts[given[contact.name]].slave!r}"
                )
    return _distinct([(c.name, c.slave) for c in contacts])


def support_names(supports: Sequence[Fix]) -> tuple[str, ...]:
    """The name of every support: its surface, numbered where several hold one."""
    return _distinct([("", support.on) for support in supports])


def _distinct(pairs: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Names of (given or "", default): defaults that are not alone get a number."""
    taken = {given for given, _ in pairs if given}
    count = Counter(default for given, default in pairs if not given)
    out, last = [], Counter[str]()
    for given, default in pairs:
        name = given or default
        if not given and (count[default] > 1 or default in taken):
            while name in taken or name == default:
                last[default] += 1
                name = f"{default} {last[default]}"
        taken.add(name)
        out.append(name)
    return tuple(out)
