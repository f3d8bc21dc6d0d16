"""General contact of a deck: *CONTACT with what it includes, leaves out, and assigns.

The pairs are found on the outside of the elements, as `find_contacts` does: parts that face
each other no farther apart than a facet is wide plus the farthest that supports move anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...mechanics.contact.finding import Allowed, Reach
from ...mechanics.meshes import Mesh
from ...mechanics.model.finding import FoundContacts, FoundPair, Parts, Side, find_between
from ...mechanics.model.names import named_bodies
from ...mechanics.model.parts import Body
from .cards import Card
from .contacts import Pair, ask_surface
from .flat import Deck, Placed
from .history import FREE, History
from .materials import Interaction
from .meshing import Region
from .scopes import Index, missing

Mask = NDArray[np.bool_]
Between = tuple[str, str]  # names of two surfaces, "" for the whole outside
HELPERS = ("CONTACTINCLUSIONS", "CONTACTEXCLUSIONS", "CONTACTPROPERTYASSIGNMENT")
SMOOTH = "frictionless and hard, of *CONTACT"  # the interaction where none is assigned
MOST = 0.5  # part of a surface that has to be of a named one


@dataclass
class General:
    """All of a *CONTACT: surfaces between which it acts, does not, and its interactions."""

    card: Card
    included: list[Between] = field(default_factory=list)
    excluded: list[Between] = field(default_factory=list)
    assigned: list[tuple[Between, str]] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """All surfaces that are named."""
        every = [*self.included, *self.excluded, *(between for between, _ in self.assigned)]
        return list(dict.fromkeys(name for between in every for name in between if name))


def read_general(
    deck: Deck, region: Region, interactions: dict[str, Interaction]
) -> General | None:
    """The general contact of a deck, None without; its surfaces are asked of the mesh.

    Adds the interaction of what has none.  Raises FileFormatError with file and line.
    """
    for step in deck.steps:
        for placed in step:
            if placed.card.keyword in ("CONTACT", *HELPERS):
                raise placed.card.error("stands in a step; expected before the first one")
    made: General | None = None
    for placed in deck.model:
        card = placed.card
        if card.keyword == "CONTACT":
            if made is not None:
                raise card.error(f"expected one, line {made.card.number} has it already")
            made = General(card)
        elif card.keyword in HELPERS:
            if made is None:
                raise card.error("stands before *CONTACT; expected after it")
            _take(made, placed, region, interactions)
    if made is not None:
        interactions.setdefault(SMOOTH, Interaction(made.card))
        if not made.included:
            raise made.card.error(
                "expected *CONTACT INCLUSIONS, ALL EXTERIOR, or with pairs of surfaces after it"
            )
    return made


def _take(
    made: General, placed: Placed, region: Region, interactions: dict[str, Interaction]
) -> None:
    card = placed.card
    if card.keyword == "CONTACTINCLUSIONS" and "ALLEXTERIOR" in card.options:
        made.included.append(("", ""))
        return
    for row in card.rows():
        names = [text.strip('"').upper() for text in row.fields]
        names += [""] * (2 - len(names))
        for name in names[:2]:
            if name:
                ask_surface(region, placed, name, row)
        both = names[0], names[1] or names[0]
        if card.keyword == "CONTACTPROPERTYASSIGNMENT":
            name = names[2] if len(names) > 2 else ""
            if name not in interactions:
                raise row.error(missing("surface interaction", name, interactions))
            made.assigned.append((both, name))
        elif card.keyword == "CONTACTINCLUSIONS":
            made.included.append(both)
        elif not any(names[:2]):
            raise row.error(f"{card}: expected a surface, or two, that do not touch")
        else:
            made.excluded.append((names[0], names[1] or names[0]))


def found_pairs(
    made: General, body: Body, pairs: Sequence[Pair], reach: Reach, titles: list[str] | None,
) -> tuple[Mesh, list[Pair], list[str]]:  # fmt: skip
    """The mesh with surfaces of the pairs that are found, these, and what to say of them.

    pairs: those of the deck, whose facets are not found again; titles: names of parts.
    Raises FileFormatError where nothing is found.
    """
    parts = _parts(body, titles)
    skin, mesh = parts.skins[0], body.mesh
    everywhere = np.ones(len(skin.part), dtype=bool)
    masks = {name: skin.holds(mesh.surface(name)) for name in made.names} | {"": everywhere}
    yes = [(masks[a], masks[b]) for a, b in made.included]
    no = [(masks[a], masks[b]) for a, b in made.excluded]
    no += [(skin.holds(mesh.surface(p.slave)), skin.holds(mesh.surface(p.master)))
           for p in pairs]  # fmt: skip
    found = _found(parts, reach, yes, no)
    if not (found.contacts or pairs):
        count = len(parts.titles[0])
        raise made.card.error(
            f"no contact found: the deck has {count} part{'s' if count > 1 else ''} that share "
            "no nodes, none of which faces another or itself nearby; name the pairs"
        )
    mesh = found.bodies[0].mesh
    out, said = [], []
    for contact, pair in zip(found.contacts, found.pairs, strict=True):
        assert contact.master is not None
        sides = [skin.holds(mesh.surface(n)) for n in (contact.slave, contact.master)]
        name = _interaction(made, masks, sides[0], sides[1])
        out.append(Pair(contact.slave, contact.master, made.card, name))
        said.append(_told(pair, name))
    return mesh, out, said


def self_contact(
    body: Body, pairs: Sequence[Pair], reach: Reach, titles: list[str] | None
) -> tuple[Mesh, list[Pair], list[str]]:
    """The mesh, pairs of two sides in the place of those of a surface with itself, and words.

    Raises FileFormatError for a surface that faces itself nowhere nearby.
    """
    out, said, mesh = [], [], body.mesh
    for pair in pairs:
        if not pair.itself:
            out.append(pair)
            continue
        parts = _parts(replace(body, mesh=mesh), titles)
        own = parts.skins[0].holds(mesh.surface(pair.slave))
        found = _found(parts, reach, [(own, own)], [])
        if not found.contacts:
            raise pair.card.error(
                f"surface {pair.slave}: no contact with itself found: it faces itself nowhere "
                "closer than a facet is wide plus the farthest that supports move anything; "
                "expected slave, master: two surfaces of what may meet"
            )
        named = {f"{pair.slave}: {name}": facets
                 for name, facets in found.bodies[0].mesh.surfaces.items()
                 if name not in mesh.surfaces}  # fmt: skip
        mesh = mesh.with_surfaces(named)
        for contact, seen in zip(found.contacts, found.pairs, strict=True):
            slave, master = (f"{pair.slave}: {n}" for n in (contact.slave, contact.master))
            out.append(replace(pair, slave=slave, master=master, itself=False))
            said.append(_told(seen, pair.interaction))
    return mesh, out, said


def _parts(body: Body, titles: list[str] | None) -> Parts:
    """The parts of the mesh of a deck, under their names where these are known."""
    parts = Parts.of(named_bodies([body]))
    if titles is not None and len(titles) == len(parts.titles[0]):
        parts = replace(parts, titles=[titles])
    return parts


def _found(
    parts: Parts, reach: Reach, yes: Sequence[tuple[Mask, Mask]],
    no: Sequence[tuple[Mask, Mask]],
) -> FoundContacts:  # fmt: skip
    """Contacts between facets that may meet, of a part with itself too."""
    rule: Allowed = partial(_allowed, yes, no)

    def allowed(one: Side, other: Side) -> Allowed:
        return rule

    return find_between(parts, reach, {"mu": 0.0}, allowed, itself=True)


def _allowed(
    yes: Sequence[tuple[Mask, Mask]], no: Sequence[tuple[Mask, Mask]], one: Index, other: Index
) -> Mask:
    """Pairs of facets (k,) that are included and not excluded, whichever is the slave."""
    out = np.zeros(len(one), dtype=bool)
    for a, b in yes:
        out |= (a[one] & b[other]) | (b[one] & a[other])
    for a, b in no:
        out &= ~((a[one] & b[other]) | (b[one] & a[other]))
    return out


def _interaction(made: General, masks: dict[str, Mask], slave: Mask, master: Mask) -> str:
    """The last interaction that is assigned between surfaces that hold most of both sides."""
    name = SMOOTH
    for (a, b), given in made.assigned:
        for one, other in ((masks[a], masks[b]), (masks[b], masks[a])):
            if one[slave].mean() > MOST and other[master].mean() > MOST:
                name = given
    return name


def _told(pair: FoundPair, interaction: str) -> str:
    return f"contact found: {pair}; {interaction}"


def motion_of(history: History) -> float:
    """The largest displacement that supports prescribe."""
    numbers = np.unique(np.concatenate([at[:, :3].ravel() for at in history.held]))
    values = [
        abs(v) for k in numbers[numbers != FREE] for v in history.supports.courses[k].values
    ]
    return float(np.nanmax([0.0, *values]))


def part_titles(deck: Deck, at: Index, label: Index) -> list[str] | None:
    """Names of the connected parts of a mesh: their instances, None where these do not tell.

    at: number in the mesh of each node of the deck; label (n,): part of each node of the mesh.
    """
    titles = [""] * (int(label.max()) + 1)
    for name, own in deck.instances.items():
        nodes = at[own.node_at]
        for part in np.unique(label[nodes[nodes >= 0]]):
            titles[part] = f"{titles[part]} and {name}" if titles[part] else name
    return titles if all(titles) and len(set(titles)) == len(titles) else None
