"""A deck without parts: nodes, elements, sets and surfaces of all instances, and its steps.

Parts are put where their instances stand (translated first, then turned), numbers and names
stay those of the instance (`scopes`).  What a card means for the model is for others to say:
cards of materials, interactions and steps are kept in their order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from .cards import LARGEST, Card, Row, digest_of, is_whole, number, whole
from .placement import motion
from .scopes import Analytic, Index, Names, Scope, missing
from .shapes import SHAPES, Shape, unread

Array = NDArray[np.float64]
SPRINGS = {"SPRINGA": 2, "SPRING1": 1, "SPRING2": 2}  # spring elements, and their nodes
WIDTH = 3  # coordinates of a node
ENDS = {"PART": "ENDPART", "INSTANCE": "ENDINSTANCE", "ASSEMBLY": "ENDASSEMBLY",
        "STEP": "ENDSTEP"}  # fmt: skip


@dataclass(frozen=True)
class Block:
    """Elements of one type: nodes (k, n) of the deck; first: number of the first one in it."""

    kind: str
    first: int
    nodes: Index
    card: Card

    def rows_of(self, elements: Index) -> Index:
        """Which of its elements are among these elements of the deck, in their order."""
        inside = (elements >= self.first) & (elements < self.first + len(self.nodes))
        return elements[inside] - self.first


@dataclass(frozen=True)
class Placed:
    """A card of the model with the place whose names it knows."""

    card: Card
    scope: Scope


@dataclass
class Deck:
    """All of a deck, flat.

    points (n, 3); point_labels: what the deck calls each node, element_labels each element;
    model: cards before the first step; steps: those of each step, with *STEP in front;
    springs: by set, type and nodes of spring elements; doubled: new node -> that at its place.
    """

    points: Array = field(default_factory=lambda: np.zeros((0, WIDTH)))
    point_labels: list[tuple[Names, Index]] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    model: list[Placed] = field(default_factory=list)
    steps: list[list[Placed]] = field(default_factory=list)
    top: Scope = field(default_factory=lambda: Scope(Names()))
    instances: dict[str, Names] = field(default_factory=dict)
    springs: dict[str, list[tuple[str, Index]]] = field(default_factory=dict)
    doubled: dict[int, int] = field(default_factory=dict)
    digest: str = ""  # of all that is not in the mesh
    shapes: Mapping[str, Shape] = field(default_factory=lambda: SHAPES)
    _points: list[Array] = field(default_factory=list)
    _count: int = 0
    _elements: int = 0

    def node_name(self, node: int) -> str:
        """What the deck calls a node: "17", or "Bolt-1.17" in an instance."""
        for names, at in self.point_labels:
            if len(at) and at[0] <= node <= at[-1]:
                label = names.node_labels[np.flatnonzero(names.node_at == node)[0]]
                return f"{names.title}.{label}" if names.title else str(label)
        return str(node)

    def node_sets(self) -> dict[bytes, str]:
        """Names of all node sets by their nodes, the first one where several are the same."""
        found: dict[bytes, str] = {}
        for scope in (self.top.own, *self.instances.values()):
            for name, nodes in scope.node_sets.items():
                called = f"{scope.title}.{name}" if scope.title else name
                found.setdefault(np.asarray(nodes, dtype=np.int64).tobytes(), called)
        return found

    def element_labels(self) -> Index:
        """Numbers of all elements in the deck, those of their part in an instance."""
        labels = np.zeros(sum(len(block.nodes) for block in self.blocks), dtype=np.int64)
        for names in {id(n): n for n, _ in self.point_labels}.values():
            labels[names.element_at] = names.element_labels
        return labels


def flatten(cards: Sequence[Card], shapes: Mapping[str, Shape] = SHAPES) -> Deck:
    """The deck that cards make; raises FileFormatError with file and line."""
    deck = Deck(digest=digest_of(cards), shapes=shapes)
    parts: dict[str, list[Card]] = {}
    k = 0
    while k < len(cards):
        card = cards[k]
        if card.keyword in ENDS.values():
            raise card.error(f"there is no *{card.written.removeprefix('END ')} to end")
        if card.keyword == "PART":
            name = card.name("NAME")
            if name in parts:
                raise card.error(f"NAME: part {name} is there already")
            inner, k = _inside(cards, k)
            parts[name] = inner
        elif card.keyword == "ASSEMBLY":
            inner, k = _inside(cards, k)
            _assemble(deck, inner, parts)
        elif card.keyword == "STEP":
            inner, k = _inside(cards, k)
            scope = deck.top
            deck.steps.append([Placed(c, scope) for c in (card, *inner)])
        else:
            _take(deck, card, deck.top)
            k += 1
    deck.points = np.concatenate([deck.points, *deck._points])
    for names, at in ((deck.top.own, deck.top.own.node_at),
                      *((n, n.node_at) for n in deck.instances.values())):  # fmt: skip
        deck.point_labels.append((names, np.sort(at)))
    return deck


def _inside(cards: Sequence[Card], start: int) -> tuple[list[Card], int]:
    """The cards up to the end of what begins at `start`, and where to go on."""
    begin = cards[start]
    end = ENDS[begin.keyword]
    for k in range(start + 1, len(cards)):
        if cards[k].keyword == end:
            return list(cards[start + 1 : k]), k + 1
        if cards[k].keyword == begin.keyword:
            raise cards[k].error(f"the one of line {begin.number} has not ended")
    raise begin.error(f"has no *END {begin.written}: is the file cut?")


# ------------------------------------------------------------------------------ assembly
def _assemble(deck: Deck, cards: Sequence[Card], parts: dict[str, list[Card]]) -> None:
    assembly = deck.top.own
    deck.top = Scope(assembly, deck.instances)
    k = 0
    while k < len(cards):
        card = cards[k]
        if card.keyword != "INSTANCE":
            _take(deck, card, deck.top)
            k += 1
            continue
        inner, k = _inside(cards, k)
        name, part = card.name("NAME"), card.name("PART")
        if part not in parts:
            raise card.error(missing("part", part, parts))
        if name in deck.instances:
            raise card.error(f"NAME: instance {name} is there already")
        deck.instances[name] = Names(card.options["NAME"])
        scope = Scope(deck.instances[name], deck.instances, assembly)
        before = len(deck._points)
        for each in (*parts[part], *inner):
            _take(deck, each, scope)
        move = motion(card)
        deck._points[before:] = [move(points) for points in deck._points[before:]]
        for surface in deck.instances[name].analytic.values():
            surface.move = move


# --------------------------------------------------------------------------------- cards
def _take(deck: Deck, card: Card, scope: Scope) -> None:
    """Read a card that names something of the mesh; keep all others."""
    taken = TAKEN.get(card.keyword)
    if taken is None:
        deck.model.append(Placed(card, scope))
    else:
        taken(deck, card, scope)


def _nodes(deck: Deck, card: Card, scope: Scope) -> None:
    if card.label("SYSTEM") not in (None, "R"):
        raise card.error(f"SYSTEM={card.label('SYSTEM')}: expected R, rectangular coordinates")
    table = card.table(1 + WIDTH)
    if table is None or not _regular(table[:, 0]):
        rows = list(card.rows())
        table = np.array([_node(row) for row in rows]).reshape(-1, 1 + WIDTH)
    if not np.isfinite(table).all():
        for row in card.rows():
            _node(row)
    labels = table[:, 0].astype(np.int64)
    at = deck._count + np.arange(len(labels))
    _no_doubles(labels, scope.own.nodes(labels), card, "node")
    deck._points.append(table[:, 1:])
    deck._count += len(labels)
    scope.own.add_nodes(labels, at)
    _named(scope.own.node_sets, card.label("NSET"), at)


def _regular(labels: Array) -> bool:
    """True for whole numbers > 0, as far as 64 bits hold them."""
    return bool(((labels == np.floor(labels)) & (labels > 0) & (labels < LARGEST)).all())


def _node(row: Row) -> list[float]:
    label = whole(row.fields[0], row, "node")
    if label <= 0:
        raise row.error(f"node: expected a number > 0, got {label}")
    if len(row.fields) > 1 + WIDTH:
        row.fields[1 + WIDTH :] = []  # direction cosines of a normal
    values = [number(text, row, "coordinate") for text in row.fields[1:]]
    return [label, *values, *[0.0] * (WIDTH - len(values))]


def _no_doubles(labels: Index, before: Index, card: Card, what: str) -> None:
    """Raise FileFormatError for a number that is given twice."""
    again = labels[before >= 0]
    if not len(again) and (np.diff(labels) > 0).all():
        return
    found, counts = np.unique(labels, return_counts=True)
    twice = found[counts > 1]
    if not len(twice) and not len(again):
        return
    label = int(twice[0] if len(twice) else again[0])
    seen = 0 if len(twice) else 1
    for row in card.rows():
        if is_whole(row.fields[0]) and int(row.fields[0]) == label:
            seen += 1
            if seen > 1:
                raise row.error(f"{what} {label}: the number is given twice")
    raise card.error(f"{what} {label}: the number is given twice")


def _elements(deck: Deck, card: Card, scope: Scope) -> None:
    kind = card.name("TYPE")
    if kind in SPRINGS:
        _springs(deck, card, scope, kind)
        return
    if kind not in deck.shapes:
        raise card.error(f"TYPE={kind}: {unread(kind, deck.shapes)}")
    width = 1 + deck.shapes[kind].nodes
    table = card.table(width, np.int64)
    if table is None or (table.size and not 0 < table.min() <= table.max() < LARGEST):
        table = _element_rows(card, width).astype(np.int64)
    if not len(table):
        return
    labels, nodes = table[:, 0], table[:, 1:]
    known = scope.own.nodes(nodes.ravel()).reshape(nodes.shape)
    if (known < 0).any():
        k, n = np.argwhere(known < 0)[0]
        raise at_element(card, int(labels[k]), f"node {nodes[k, n]} is not there")
    at = deck._elements + np.arange(len(labels))
    _no_doubles(labels, scope.own.elements(labels), card, "element")
    deck.blocks.append(Block(kind, deck._elements, known, card))
    deck._elements += len(labels)
    scope.own.add_elements(labels, at)
    _named(scope.own.element_sets, card.label("ELSET"), at)


def _springs(deck: Deck, card: Card, scope: Scope, kind: str) -> None:
    """Spring elements: known by the set of their card alone."""
    table = _element_rows(card, 1 + SPRINGS[kind]).astype(np.int64)[:, 1:]
    known = scope.own.nodes(table.ravel()).reshape(table.shape)
    if (known < 0).any():
        raise card.error(f"node {table[known < 0][0]} is not there")
    deck.springs.setdefault(card.name("ELSET"), []).append((kind, known))


def at_element(card: Card, label: int, text: str) -> FileFormatError:
    """What is wrong with an element, with its line."""
    for row in card.rows():
        if is_whole(row.fields[0]) and int(row.fields[0]) == label:
            return row.error(f"element {label}: {text}")
    return card.error(f"element {label}: {text}")


def _element_rows(card: Card, width: int) -> Array:
    """Elements one by one, each of them perhaps over several lines."""
    found: list[list[int]] = []
    current: list[int] = []
    last: Row | None = None
    for row in card.rows():
        if not current:
            last = row
        current += [whole(text, row, "element") for text in row.fields if text]
        if len(current) > width:
            raise row.error(
                f"element {current[0]}: {card.label('TYPE')}: expected {width - 1} nodes, got "
                f"{len(current) - 1}"
            )
        if len(current) == width:
            found.append(current)
            current = []
    if current and last is not None:
        raise last.error(
            f"element {current[0]}: expected {width - 1} nodes, got {len(current) - 1}; is the "
            "file cut?"
        )
    for line in found:
        if min(line) <= 0:
            raise card.error(f"element {line[0]}: expected numbers > 0, got {min(line)}")
    return np.array(found, dtype=np.float64).reshape(-1, width)


def _named(sets: dict[str, Index], name: str | None, members: Index) -> None:
    """Add to a set; a second card with the same name goes on with it."""
    if name is not None:
        old = sets.get(name)
        sets[name] = members if old is None else _unique(np.concatenate([old, members]))


def _unique(members: Index) -> Index:
    """The members once each, in their order."""
    _, first = np.unique(members, return_index=True)
    return members[np.sort(first)]


def _set_reader(option: str, what: str) -> Callable[[Deck, Card, Scope], None]:
    def read(deck: Deck, card: Card, scope: Scope) -> None:
        name = card.name(option)
        instance = card.label("INSTANCE")
        inner = scope
        if instance is not None:
            if instance not in deck.instances:
                raise card.error(missing("instance", instance, deck.instances))
            inner = Scope(deck.instances[instance], deck.instances, scope.own)
        sets: dict[str, Index] = getattr(scope.own, f"{what}_sets")
        members = _generated if "GENERATE" in card.options else _listed
        found = members(card, inner, what, name)
        if instance is not None and what == "node" and name in inner.own.node_sets:
            inner.own.node_sets[name] = _unique(
                np.concatenate([inner.own.node_sets[name], found])
            )
        _named(sets, name, found)

    return read


def _generated(card: Card, scope: Scope, what: str, name: str) -> Index:
    """first, last, step on each line; numbers that are not there are left out."""
    out: list[Index] = []
    look = scope.own.nodes if what == "node" else scope.own.elements
    for row in card.rows():
        values = [whole(text, row, what) for text in row.fields if text]
        if len(values) not in (2, 3):
            raise row.error(f"GENERATE: expected first, last, step, got {row.fields}")
        first, last, step = (*values, 1)[:3]
        if step <= 0 or last < first:
            raise row.error(
                f"GENERATE: expected first <= last and step > 0, got {first}, {last}, {step}"
            )
        labels = scope.own.node_labels if what == "node" else scope.own.element_labels
        inside = labels[(labels >= first) & (labels <= last) & ((labels - first) % step == 0)]
        out.append(look(inside))
    return _unique(np.concatenate(out)) if out else np.zeros(0, dtype=np.int64)


def _listed(card: Card, scope: Scope, what: str, name: str) -> Index:
    """Numbers and names of sets."""
    look = scope.nodes if what == "node" else scope.elements
    table = card.table(None)
    if table is not None and _regular(table.ravel()):
        labels = table.ravel().astype(np.int64)
        found = scope.own.nodes(labels) if what == "node" else scope.own.elements(labels)
        if (found >= 0).all():
            return _unique(found)
    out: list[Index] = [np.zeros(0, dtype=np.int64)]
    for row in card.rows():
        for text in row.fields:
            if text.upper().strip('"') == name and "." not in text:
                raise row.error(f"{what} set {name}: names itself")
            if text:
                out.append(look(text, row))
    return _unique(np.concatenate(out))


def _surface(deck: Deck, card: Card, scope: Scope) -> None:
    name = card.name("NAME")
    kind = card.label("TYPE") or "ELEMENT"
    own = scope.own
    if name in own.faces or name in own.node_surfaces or name in own.analytic:
        raise card.error(f"NAME: surface {name} is there already")
    if kind == "NODE":
        found = [scope.nodes(row.fields[0], row) for row in card.rows()]
        own.node_surfaces[name] = _unique(np.concatenate(found)) if found else np.zeros(0, int)
        return
    if kind in ("SEGMENTS", "CYLINDER", "REVOLUTION"):
        own.analytic[name] = Analytic(card)
        return
    if kind != "ELEMENT":
        raise card.error(
            f"TYPE={kind}: expected ELEMENT, NODE, SEGMENTS, CYLINDER or REVOLUTION"
        )
    own.faces[name] = [
        (scope.elements(row.fields[0], row),
         (row.fields[1] if len(row.fields) > 1 else "").upper())
        for row in card.rows()
    ]  # fmt: skip


TAKEN = {
    "NODE": _nodes, "ELEMENT": _elements, "NSET": _set_reader("NSET", "node"),
    "ELSET": _set_reader("ELSET", "element"), "SURFACE": _surface,
}  # fmt: skip
