"""Which part, instance or assembly a name of a deck belongs to.

Nodes and elements are numbered in a part; sets and surfaces are named in a part, an instance or
the assembly.  "Bolt-1.Head" is the set of an instance, "Head" one of the place where it is
written, or else of the assembly.  A deck without parts has one place for all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...core.words import near
from .cards import Card, Row, is_whole

Index = NDArray[np.int64]
DENSE = 4  # numbers up to the largest, for each that is there, at which a table pays
Faces = list[tuple[Index, str]]  # elements, and the side of each: S1, SPOS, ... or "" for all


@dataclass
class Analytic:
    """A surface given by a profile; how its instance stands, and the body that moves it."""

    card: Card
    move: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda points: points
    body: str = ""


@dataclass
class Names:
    """Numbers and names of one place: of nodes, elements, sets and surfaces of the whole deck.

    node_labels, element_labels: sorted numbers in the place; node_at, element_at: which node or
    element of the deck each is.
    """

    title: str = ""
    node_labels: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    node_at: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    element_labels: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    element_at: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    node_sets: dict[str, Index] = field(default_factory=dict)
    element_sets: dict[str, Index] = field(default_factory=dict)
    faces: dict[str, Faces] = field(default_factory=dict)  # surfaces of element faces
    node_surfaces: dict[str, Index] = field(default_factory=dict)
    analytic: dict[str, Analytic] = field(default_factory=dict)

    def add_nodes(self, labels: Index, at: Index) -> None:
        """Number nodes."""
        self.node_labels, self.node_at = _merged(self.node_labels, self.node_at, labels, at)

    def add_elements(self, labels: Index, at: Index) -> None:
        """Number elements."""
        self.element_labels, self.element_at = _merged(
            self.element_labels, self.element_at, labels, at
        )

    def nodes(self, labels: Index) -> Index:
        """The nodes of the deck with these numbers, -1 where there is none."""
        return _found(self.node_labels, self.node_at, labels)

    def elements(self, labels: Index) -> Index:
        """The elements of the deck with these numbers, -1 where there is none."""
        return _found(self.element_labels, self.element_at, labels)


@dataclass
class Scope:
    """A place and, in an assembly, those that it knows by name."""

    own: Names
    instances: dict[str, Names] = field(default_factory=dict)
    above: Names | None = None

    def nodes(self, text: str, row: Row) -> Index:
        """The nodes that a number or the name of a set stands for, "Inst-1.7" too."""
        return self._named(text, row, "node")

    def elements(self, text: str, row: Row) -> Index:
        """The elements that a number or the name of a set stands for."""
        return self._named(text, row, "element")

    def acted_on(self, text: str, row: Row, what: str = "node") -> Index:
        """The same, of "node" or "element", by a card that would do nothing to an empty set.

        Raises FileFormatError for one: the support or load that is meant would be missing.
        """
        found = self._named(text, row, what)
        if not len(found):
            text = f"{what} set {text}: is empty, so that this line does nothing"
            raise row.error(f"{text}: give it {what}s, or take the line out")
        return found

    def _named(self, text: str, row: Row, what: str) -> Index:
        names, rest = self._place(text)
        known = names.node_sets if what == "node" else names.element_sets
        if is_whole(rest) and rest not in known:
            numbers = np.array([int(rest)])
            at = names.nodes(numbers) if what == "node" else names.elements(numbers)
            if at[0] < 0:
                raise row.error(f"{what} {text}: there is none with this number")
            return at
        for place in (names, self.above):
            sets = {} if place is None else getattr(place, f"{what}_sets")
            if rest in sets:
                return sets[rest]
        raise row.error(missing(f"{what} set", text, self._known(f"{what}_sets")))

    def surface(self, text: str, row: Row) -> tuple[Faces, Index | None]:
        """Faces of a surface, and its nodes if it is made of nodes."""
        names, rest = self._place(text)
        for place in (names, self.above):
            if place is not None and rest in place.faces:
                return place.faces[rest], None
            if place is not None and rest in place.node_surfaces:
                return [], place.node_surfaces[rest]
        known = [*self._known("faces"), *self._known("node_surfaces")]
        raise row.error(missing("surface", text, known))

    def analytic(self, text: str) -> Analytic | None:
        """The analytic surface of a name, None where it is none."""
        names, rest = self._place(text)
        for place in (names, self.above):
            if place is not None and rest in place.analytic:
                return place.analytic[rest]
        return None

    def _place(self, text: str) -> tuple[Names, str]:
        """The place that a name names, and the name there."""
        key = text.strip('"').strip().upper()
        head, dot, rest = key.rpartition(".")
        if dot and head in self.instances:
            return self.instances[head], rest
        return self.own, key

    def _known(self, kind: str) -> list[str]:
        found = [*getattr(self.own, kind)]
        if self.above is not None:
            found += getattr(self.above, kind)
        return found + [f"{k}.{n}" for k, p in self.instances.items() for n in getattr(p, kind)]


def missing(what: str, text: str, known: Iterable[str]) -> str:
    """The words for a name that is not there, with those that are near."""
    names = sorted(set(known))
    meant = near(text, names)
    hint = f"; did you mean {meant}?" if meant else ""
    if len(names) > 12:
        names = [*names[:12], f"... ({len(names)} in all)"]
    return f"{what} {text}: not found, known: {', '.join(names) or 'none'}{hint}"


def _merged(labels: Index, at: Index, more: Index, more_at: Index) -> tuple[Index, Index]:
    labels, at = np.concatenate([labels, more]), np.concatenate([at, more_at])
    if (np.diff(labels) > 0).all():
        return labels, at
    order = np.argsort(labels, kind="stable")
    return labels[order], at[order]


def _found(labels: Index, at: Index, wanted: Index) -> Index:
    if len(labels) and len(wanted) > len(labels) > labels[-1] // DENSE:
        table = np.full(int(labels[-1]) + 2, -1)  # the last for all that are too large
        table[labels] = at
        return table[np.clip(wanted, 0, len(table) - 1)]
    place = np.searchsorted(labels, wanted)
    place = np.minimum(place, max(len(labels) - 1, 0))
    if not len(labels):
        return np.full(len(wanted), -1)
    return np.where(labels[place] == wanted, at[place], -1)
