"""Contacts found: which parts of bodies may touch, and the pairs of surfaces that they make.

A rigid body is never the slave.  Else the slave is the finer mesh by the facets that meet, else
the softer body by Young's modulus, else the smaller surface, else the part that stands later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number
from ...core.errors import InvalidInput, shown, within
from ..contact.finding import (
    Allowed,
    Meeting,
    Reach,
    Skin,
    close_parts,
    meeting,
    meetings_within,
)
from ..elements.rigid import Rigid
from ..meshes.facets import Facets, corner_facets
from ..meshes.mesh import unknown
from ..meshes.surfaces import facet_areas
from .names import named_bodies, tuple_of
from .parts import Body, Contact
from .rigid import piece_labels, piece_titles
from .supports import locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Side = tuple[int, int]  # number of a body, and of a part of it
ALIKE = 0.1  # sizes of facets, moduli and areas that differ by less do not decide


@dataclass(frozen=True)
class FoundPair:
    """What was found of a pair, undeformed.

    parts: slave and master, as `piece` names; facets: how many of each side are in the contact;
    area: of what lies opposite, in 2D a length; gap, overlap: the smallest distance and the
    largest depth between facets, averages over pieces of them, unit of length.
    """

    parts: tuple[str, str]
    facets: tuple[int, int]
    area: float
    gap: float
    overlap: float

    def __str__(self) -> str:
        apart = f"overlap {self.overlap:.3g}" if self.overlap else f"gap {self.gap:.3g}"
        return (
            f"{self.parts[0]} (slave, {self.facets[0]} facets) on {self.parts[1]} "
            f"({self.facets[1]} facets): area {self.area:.4g}, {apart}"
        )


@dataclass(frozen=True, eq=False)
class FoundContacts:
    """Bodies with the surfaces that were found, their contacts, and what is known of each.

    A model takes both: Model(found.bodies, contacts=found.contacts, ...).
    """

    bodies: tuple[Body, ...]
    contacts: tuple[Contact, ...]
    pairs: tuple[FoundPair, ...]

    def __iter__(self) -> Iterator[Contact]:
        return iter(self.contacts)

    def __len__(self) -> int:
        return len(self.contacts)

    def __str__(self) -> str:
        return "\n".join(self.lines)

    @property
    def lines(self) -> tuple[str, ...]:
        """What was found, a line for each pair."""
        return tuple(f"contact found: {pair}" for pair in self.pairs)


def find_contacts(
    bodies: Sequence[Body], *, gap: float | None = None, exclude: Sequence[Any] = (),
    known: Sequence[Contact] = (), itself: bool = False, **law: Any,
) -> FoundContacts:  # fmt: skip
    """All pairs of parts that may touch, small sliding: one contact for each two parts.

    gap: parts that are farther apart do not touch, >= 0, unit of length; by default facets
    count that are no farther apart than the larger of them is wide (its radius).
    exclude: names of bodies or parts that touch nothing, and pairs of names that do not touch
    each other.  A part is what is connected in a mesh; where a body has several they are named
    by their regions, else "body (part 1 of 2)".
    known: contacts given by hand, whose facets are not found again between the same two sides.
    itself: also contact of parts with themselves: slots that close, folds.  Facets that share a
    node do not meet; each two faces that do make a pair.
    law: what `Contact` takes: mu=0.3, method="mortar", ...; for all that is found.

    Raises InvalidInput where nothing is found, and for names that no body has.
    """
    bodies = named_bodies(tuple_of("bodies", bodies, Body))
    if gap is not None and number("gap", gap) < 0:
        raise InvalidInput(f"expected a distance >= 0, got {shown(gap)}", ("gap",))
    if len({body.mesh.dim for body in bodies}) > 1:
        raise InvalidInput("expected all in 2D or all in 3D, got both", ("bodies",))
    Contact("slave", master="master", **law)  # what is wrong of the law is said at once
    parts = Parts.of(bodies)
    apart = parts.excluded(exclude)
    by_hand = [_known_facets(parts, contact) for contact in known if contact.master]
    by_hand += [((j, k), (b, a)) for (k, j), (a, b) in by_hand]

    def allowed(one: Side, other: Side) -> Allowed | None:
        if apart.holds(parts.names(one), parts.names(other)):
            return None
        return partial(_not_known, [
            masks for (k, j), masks in by_hand if (k, j) == (one[0], other[0])
        ])  # fmt: skip

    found = find_between(parts, Reach(gap), law, allowed, itself=itself)
    if not found.contacts and not known:
        raise InvalidInput(_nothing(parts, gap))
    return found


def find_between(
    parts: Parts, reach: Reach, law: dict[str, Any],
    allowed: Callable[[Side, Side], Allowed | None], *, itself: bool = False,
) -> FoundContacts:  # fmt: skip
    """Contacts of parts within reach; allowed: which facets of two may meet, None for none.

    itself: also of parts with themselves.
    """
    made = _Made(parts.bodies)
    for k, skin in enumerate(parts.skins if itself else ()):
        for p in np.unique(skin.part):
            may = allowed((k, int(p)), (k, int(p)))
            for met in [] if may is None else meetings_within(skin, int(p), reach, may):
                made.add(parts, ((k, int(p)), (k, int(p))), met, law)
    for k, p, j, q in close_parts(parts.skins, reach):
        may = allowed((k, p), (j, q))
        if may is None:
            continue
        met = meeting(parts.skins[k], parts.skins[j], (p, q), reach, may)
        if met is not None:
            made.add(parts, ((k, p), (j, q)), met, law)
    return made.found()


@dataclass(frozen=True, eq=False)
class _Excluded:
    """Names that touch nothing, and pairs of names that do not touch each other."""

    alone: set[str]
    pairs: set[frozenset[str]]

    def holds(self, one: set[str], other: set[str]) -> bool:
        """Whether two parts, by all of their names, are not to touch."""
        if (one | other) & self.alone:
            return True
        return any(frozenset((a, b)) in self.pairs for a in one for b in other)


@dataclass(frozen=True, eq=False)
class Parts:
    """The connected parts of all bodies: outsides, and names by body and part."""

    bodies: Sequence[Body]
    skins: list[Skin]
    titles: list[list[str]]

    @classmethod
    def of(cls, bodies: Sequence[Body]) -> Parts:
        """Label and name the parts of every body."""
        labels = [piece_labels(body.mesh) for body in bodies]
        titles = [
            piece_titles(body.mesh, body.name, label)
            for body, label in zip(bodies, labels, strict=True)
        ]
        skins = [
            Skin.of(body.mesh, label) for body, label in zip(bodies, labels, strict=True)
        ]
        return cls(bodies, skins, titles)

    def names(self, side: Side) -> set[str]:
        """The names of a part: its own, and that of its body."""
        return {self.titles[side[0]][side[1]], self.bodies[side[0]].name}

    def excluded(self, exclude: Sequence[Any]) -> _Excluded:
        """Names and pairs of names; raises InvalidInput for names of nothing."""
        if isinstance(exclude, str):
            text = f"expected a list, got one name; write [{exclude!r}]"
            raise InvalidInput(text, ("exclude",))
        known = [name for titles in self.titles for name in titles]
        known = list(dict.fromkeys([*(body.name for body in self.bodies), *known]))
        out = _Excluded(set(), set())
        for k, given in enumerate(exclude):
            names = (given,) if isinstance(given, str) else tuple(given)
            with within("exclude", k):
                if len(names) not in (1, 2) or not all(isinstance(n, str) for n in names):
                    raise InvalidInput(f"expected a name or two of them, got {shown(given)}")
                for name in names:
                    if name not in known:
                        raise InvalidInput(unknown("part", name, known))
            if len(names) == 1:
                out.alone.add(names[0])
            else:
                out.pairs.add(frozenset(names))
        return out


@dataclass(eq=False)
class _Made:
    """Contacts that were found so far, and the surfaces that they add to meshes."""

    bodies: Sequence[Body]
    contacts: list[Contact] = field(default_factory=list)
    pairs: list[FoundPair] = field(default_factory=list)
    surfaces: dict[int, dict[str, tuple[Facets, ...]]] = field(default_factory=dict)

    def add(
        self, parts: Parts, which: tuple[Side, Side], met: Meeting,
        law: dict[str, Any],
    ) -> None:  # fmt: skip
        """One pair; which: body and part of both sides."""
        order = (0, 1) if _first_is_slave(parts, which, met) else (1, 0)
        names = [parts.titles[which[k][0]][which[k][1]] for k in order]
        labels = (f"{names[0]} on {names[1]}", f"{names[1]} under {names[0]}")
        times = sum(pair.parts == (names[0], names[1]) for pair in self.pairs)
        if times:  # a part meets itself in several places
            labels = (f"{labels[0]} {times + 1}", f"{labels[1]} {times + 1}")
        for side, label in zip(order, labels, strict=True):
            body = which[side][0]
            chosen = parts.skins[body].facets(met.faces[side])
            self.surfaces.setdefault(body, {})[label] = chosen
        self.contacts.append(Contact(labels[0], master=labels[1], **law))
        count = len(met.faces[order[0]]), len(met.faces[order[1]])
        self.pairs.append(
            FoundPair((names[0], names[1]), count, met.area, met.gap, met.overlap)
        )

    def found(self) -> FoundContacts:
        """Everything, with bodies that have the surfaces."""
        bodies = []
        for k, body in enumerate(self.bodies):
            if k in self.surfaces:
                other = copy(body)
                object.__setattr__(other, "mesh", body.mesh.with_surfaces(self.surfaces[k]))
                body = other  # noqa: PLW2901
            bodies.append(body)
        return FoundContacts(tuple(bodies), tuple(self.contacts), tuple(self.pairs))


def _first_is_slave(
    parts: Parts, which: tuple[Side, Side], met: Meeting
) -> bool:
    """Whether the first of two sides is the slave, by the rules above."""
    bodies = [parts.bodies[k] for k, _ in which]
    skins = [parts.skins[k] for k, _ in which]
    rigid = [isinstance(body.material, Rigid) for body in bodies]
    if rigid[0] != rigid[1]:
        return rigid[1]
    sizes = [float(np.median(s.radius[f])) for s, f in zip(skins, met.near, strict=True)]
    young = [_young(skin, body, part) for skin, body, (_, part) in
             zip(skins, bodies, which, strict=True)]  # fmt: skip
    area = [
        sum(float(facet_areas(s.mesh.points, corner_facets(b)).sum()) for b in s.facets(f))
        for s, f in zip(skins, met.faces, strict=True)
    ]
    for one, other in (sizes, young, area):
        if abs(one - other) > ALIKE * max(one, other):
            return one < other
    return False


def _young(skin: Skin, body: Body, part: int) -> float:
    """The mean of Young's moduli of a body, or of the regions of one of its parts; or 0."""
    given = body.material
    if not isinstance(given, Mapping):
        laws: list[Any] = [given]
    else:
        inside = np.zeros(len(body.mesh.points), dtype=bool)
        inside[skin.corners[skin.part == part]] = True
        regions = {b.region for b in body.mesh.cells if inside[b.nodes].any()}
        laws = [law for region, law in given.items() if region in regions]
    known = [law for law in laws if hasattr(law, "young")]
    values = [np.mean(np.asarray(law.young, dtype=float)) for law in known]
    return float(np.mean(values)) if values else 0.0


def _known_facets(parts: Parts, contact: Contact) -> tuple[tuple[int, int], tuple[Mask, Mask]]:
    """Bodies of both sides of a contact, and which facets in the tables of all are its own."""
    assert contact.master is not None
    (k, slave), (j, master) = (locate(parts.bodies, n) for n in (contact.slave, contact.master))
    return (k, j), (parts.skins[k].holds(parts.bodies[k].mesh.surface(slave)),
                    parts.skins[j].holds(parts.bodies[j].mesh.surface(master)))  # fmt: skip


def _not_known(known: Sequence[tuple[Mask, Mask]], one: Index, other: Index) -> Mask:
    """Pairs of facets (k,) that are in no contact by hand."""
    free = np.ones(len(one), dtype=bool)
    for first, second in known:
        free &= ~(first[one] & second[other])
    return free


def _nothing(parts: Parts, gap: float | None) -> str:
    count = sum(len(titles) for titles in parts.titles)
    if count == 1:
        return (
            f"no contact found: {parts.titles[0][0]} is one part, all glued; parts that touch "
            "need nodes of their own: read the mesh with glue=False, in a case file "
            "glue = false"
        )
    far = "the size of a facet" if gap is None else f"{gap:g}"
    return (
        f"no contact found: none of the {count} parts lies within {far} of another and faces "
        "it; give a larger gap, check positions and units, or name the pairs"
    )
