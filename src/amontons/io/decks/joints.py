"""What ties nodes of a deck to one another: equations, couplings, rigid bodies, bolts, springs.

A node without elements that one of these cards names is a reference of the model, "node 17";
its components 4 to 6 are rotations, and so are those of the ROT NODE of a rigid body.  A slave
surface of *TIE is a contact that neither parts nor slips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...mechanics.meshes import Facets
from ...mechanics.model import Coupling, Equation, Pretension, Reference, Spring
from ...mechanics.model.constraints import ROTATION, Constraint, Term
from .cards import Card, Row, number, whole
from .flat import Deck, Placed
from .meshing import Region
from .mpc import mpc_equations
from .scopes import Index, missing
from .sections import face_nodes, nodes_of, open_along

Array = NDArray[np.float64]
TRANSLATIONS = 3
KEYWORDS = {"EQUATION", "MPC", "COUPLING", "KINEMATIC", "DISTRIBUTING", "RIGIDBODY",
            "PRE-TENSIONSECTION", "SPRING"}  # fmt: skip
Raw = tuple[Index, int, float]  # nodes of the deck, component from 0, coefficient


@dataclass
class Bolt:
    """A pretension section: its node, the surface of its pulled side, the given normal."""

    node: int
    sides: tuple[str, str]
    normal: Array | None
    card: Card


@dataclass
class Joints:
    """All of a deck before its mesh is made; nodes are those of the deck.

    turns: node whose displacements are the rotations of another one.
    """

    deck: Deck
    leads: dict[int, Card] = field(default_factory=dict)
    turns: dict[int, int] = field(default_factory=dict)
    equations: list[tuple[list[Raw], Card]] = field(default_factory=list)
    couplings: list[tuple[str, int, str, tuple[int, ...] | None, Card]] = field(
        default_factory=list
    )
    bolts: list[Bolt] = field(default_factory=list)
    springs: list[tuple[list[Raw], float, Card]] = field(default_factory=list)
    sets: dict[str, Index] = field(default_factory=dict)
    faces: list[tuple[str, Placed]] = field(default_factory=list)
    tools: list[tuple[str, int]] = field(default_factory=list)  # bodies, and their nodes

    @classmethod
    def of(cls, deck: Deck) -> Joints:
        """Read all cards before the first step; opens the mesh at the sections of bolts."""
        made = cls(deck)
        cards = [p for p in deck.model if p.card.keyword in KEYWORDS]
        for k, placed in enumerate(cards):
            key = placed.card.keyword
            if key == "COUPLING":
                made._coupling(placed, cards[k + 1] if k + 1 < len(cards) else None)
            elif key in READERS:
                READERS[key](made, placed)
        return made

    @cached_property
    def named(self) -> dict[int, Card]:
        """Nodes without elements that a card names, but for those that are rotations."""
        used = np.zeros(len(self.deck.points), dtype=bool)
        for block in self.deck.blocks:
            used[block.nodes] = True
        out = dict(self.leads)
        for terms, *_, card in (*self.equations, *self.springs):
            for nodes, _, _ in terms:
                for node in nodes[~used[nodes]]:
                    if int(node) not in self.turns:
                        out.setdefault(int(node), card)
        return out

    @property
    def all_named(self) -> list[int]:
        """Nodes without elements that stand for references, rotations and bolts."""
        return [*self.named, *self.turns]

    @property
    def lengths(self) -> set[int]:
        """Nodes whose first component is the length of a bolt."""
        return {bolt.node for bolt in self.bolts}

    # ------------------------------------------------------------------------------ cards
    def _equations(self, placed: Placed) -> None:
        """The number of terms, then node, component, coefficient of each, over lines."""
        rows = [row for row in placed.card.rows() if any(row.fields)]
        k = 0
        while k < len(rows):
            head = rows[k]
            count = whole(head.fields[0], head, "*EQUATION: number of terms")
            fields: list[tuple[str, Row]] = []
            while len(fields) < 3 * count and k + 1 < len(rows):
                k += 1
                fields += [(text, rows[k]) for text in rows[k].fields]
            if count < 1 or len(fields) != 3 * count:
                raise head.error(
                    f"*EQUATION: expected {count} terms of node, component, coefficient, got "
                    f"{len(fields)} entries"
                )
            terms = [self._term(placed, fields[3 * i : 3 * i + 3]) for i in range(count)]
            sizes = {len(nodes) for nodes, _, _ in terms}
            if len(sizes - {1}) > 1:
                raise head.error(f"*EQUATION: sets of several sizes, {sorted(sizes)}")
            if not terms[0][2]:
                raise head.error("*EQUATION: the first coefficient is 0; it is eliminated")
            self.equations.append((terms, replace(placed.card, number=head.number)))
            k += 1

    def _term(self, placed: Placed, fields: Sequence[tuple[str, Row]]) -> Raw:
        (name, row), (component, _), (factor, _) = fields
        nodes = placed.scope.nodes(name, row)
        which = whole(component, row, "*EQUATION: component")
        if not 1 <= which <= 2 * TRANSLATIONS:
            raise row.error(f"*EQUATION: expected a component from 1 to 6, got {which}")
        return nodes, which - 1, number(factor, row, "*EQUATION: coefficient")

    def _mpc(self, placed: Placed) -> None:
        self.equations += mpc_equations(self.deck, placed)

    def _coupling(self, placed: Placed, after: Placed | None) -> None:
        card = placed.card
        kinds = {"KINEMATIC": "kinematic", "DISTRIBUTING": "distributing"}
        if after is None or after.card.keyword not in kinds:
            raise card.error("expected *KINEMATIC or *DISTRIBUTING as the next card")
        if "ORIENTATION" in card.options:
            raise card.error("ORIENTATION: is not read")
        row = Row(card.file, card.number, [])
        lead = self._lead(placed, "REFNODE", row)
        kind, chosen = kinds[after.card.keyword], None
        if kind == "kinematic":
            chosen = _components(after.card)
        faces, nodes = placed.scope.surface(card.name("SURFACE"), row)
        name = f"coupling {len(self.couplings) + 1}"
        if nodes is None:
            del faces
            self.faces.append((name, placed))
        else:
            self.sets[name] = nodes
        self.couplings.append((name, lead, kind, chosen, card))

    def _rigid(self, placed: Placed) -> None:
        card = placed.card
        row = Row(card.file, card.number, [])
        lead = self._lead(placed, "REFNODE", row)
        if card.label("ROTNODE"):
            turn = placed.scope.nodes(card.name("ROTNODE"), row)
            self.turns[int(turn[0])] = lead
        if card.label("ANALYTICALSURFACE"):
            self._tool(placed, lead, row)
            return
        if card.label("NSET"):
            nodes = placed.scope.nodes(card.name("NSET"), row)
        else:
            chosen = placed.scope.elements(card.name("ELSET"), row)
            nodes = nodes_of(self.deck, chosen)
        own = [*self.turns, lead]
        name = f"rigid body {len(self.couplings) + 1}"
        self.sets[name] = nodes[~np.isin(nodes, own)]
        self.couplings.append((name, lead, "kinematic", None, card))

    def _tool(self, placed: Placed, lead: int, row: Row) -> None:
        """A rigid body that is an analytic surface alone."""
        name = placed.card.name("ANALYTICALSURFACE")
        for option in ("NSET", "ELSET"):
            if option in placed.card.options:
                raise placed.card.error(f"{option}: expected ANALYTICAL SURFACE alone")
        surface = placed.scope.analytic(name)
        if surface is None:
            known = placed.scope.own.analytic
            raise row.error(missing("analytic surface", name, known))
        surface.body = f"tool {len(self.tools) + 1}"
        self.tools.append((surface.body, lead))
        self.couplings.append((surface.body, lead, "kinematic", None, placed.card))

    def _lead(self, placed: Placed, option: str, row: Row) -> int:
        nodes = placed.scope.nodes(placed.card.name(option), row)
        if len(nodes) != 1:
            raise placed.card.error(f"{option}: expected one node, got {len(nodes)}")
        self.leads[int(nodes[0])] = placed.card
        return int(nodes[0])

    def _bolt(self, placed: Placed) -> None:
        card = placed.card
        if "ELEMENT" in card.options:
            raise card.error("ELEMENT: beams are not read, expected SURFACE")
        row = Row(card.file, card.number, [])
        faces, nodes = placed.scope.surface(card.name("SURFACE"), row)
        if nodes is not None:
            raise card.error("SURFACE: expected one of element faces")
        node = self._lead(placed, "NODE", row)
        given = next(card.rows(), None)
        normal = None
        if given is not None:
            normal = np.array([number(text, given, "normal") for text in given.fields[:3]])
            size = float(np.linalg.norm(normal))
            if len(normal) != 3 or not size:
                raise given.error(f"{card}: expected three components of a normal")
            normal = normal / size
        name = f"section {len(self.bolts) + 1}"
        self.bolts.append(Bolt(node, (name, f"{name} opposite"), normal, card))
        self.faces.append((name, placed))
        open_along(self.deck, [e for e, _ in faces], face_nodes(self.deck, faces, card), card)

    def _spring(self, placed: Placed) -> None:
        card = placed.card
        if "NONLINEAR" in card.options or "ORIENTATION" in card.options:
            raise card.error("expected a linear spring without ORIENTATION")
        name = card.name("ELSET")
        found = self.deck.springs.get(name)
        if not found:
            raise card.error(missing("set of spring elements", name, self.deck.springs))
        rows = [row for row in card.rows() if any(row.fields)]
        for kind, nodes in found:
            want = 1 if kind == "SPRINGA" else 2
            if len(rows) != want:
                raise card.error(f"{kind}: expected {want} lines of data, got {len(rows)}")
            stiffness = number(rows[-1].fields[0], rows[-1], "stiffness")
            if stiffness < 0:
                raise rows[-1].error(f"{card}: expected a stiffness >= 0, got {stiffness:g}")
            for ends in nodes:
                self.springs.append((self._ends(kind, ends, rows[0], card), stiffness, card))

    def _ends(self, kind: str, ends: Index, row: Row, card: Card) -> list[Raw]:
        if kind != "SPRINGA":
            which = [whole(text, row, f"{card}: component") - 1 for text in row.fields if text]
            if len(which) != len(ends) or not all(0 <= c < 2 * TRANSLATIONS for c in which):
                raise row.error(f"{kind}: expected {len(ends)} components from 1 to 6")
            signs = (1.0,) if len(ends) == 1 else (1.0, -1.0)
            return [(ends[k : k + 1], c, signs[k]) for k, c in enumerate(which)]
        way = self.deck.points[ends[1]] - self.deck.points[ends[0]]
        size = float(np.linalg.norm(way))
        if not size:
            raise card.error("SPRINGA: its two nodes are at one place")
        return [
            (ends[k : k + 1], c, sign * float(way[c] / size))
            for k, sign in ((0, -1.0), (1, 1.0)) for c in range(3) if way[c]
        ]  # fmt: skip

    # ------------------------------------------------------------------------------- mesh
    def name_surfaces(self, region: Region) -> None:
        """Ask the mesh for surfaces and node sets."""
        for name, placed in self.faces:
            card = placed.card
            row = Row(card.file, card.number, [])
            faces, _ = placed.scope.surface(card.name("SURFACE"), row)
            region.add_faces(name, faces, row)
        back = np.arange(len(self.deck.points))
        for new, old in self.deck.doubled.items():
            back[new] = old
        for bolt in self.bolts:
            region.facets[bolt.sides[1]] = [
                Facets(f.kind, back[f.nodes]) for f in region.facets[bolt.sides[0]]
            ]
        region.node_sets |= self.sets

    def title(self, node: int) -> str:
        """The name of a reference."""
        return f"node {self.deck.node_name(node)}"


def _components(card: Card) -> tuple[int, ...] | None:
    """The components that *KINEMATIC couples, None for all."""
    chosen: set[int] = set()
    for row in card.rows():
        first = whole(row.fields[0], row, f"{card}: component")
        last = whole(row.fields[1], row, str(card)) if len(row.fields) > 1 else first
        if not 1 <= first <= last <= 2 * TRANSLATIONS:
            raise row.error(f"{card}: expected components from 1 to 6, got {first} to {last}")
        chosen |= {k - 1 for k in range(first, last + 1) if k <= TRANSLATIONS}
    return tuple(sorted(chosen)) if chosen and len(chosen) < TRANSLATIONS else None


READERS = {
    "EQUATION": Joints._equations, "MPC": Joints._mpc, "RIGIDBODY": Joints._rigid,
    "PRE-TENSIONSECTION": Joints._bolt, "SPRING": Joints._spring,
}  # fmt: skip


# ------------------------------------------------------------------------------- the model
@dataclass
class Tied:
    """References, constraints and springs of the model, each with its card."""

    references: list[tuple[Reference, Card]] = field(default_factory=list)
    constraints: list[tuple[Constraint, Card]] = field(default_factory=list)
    springs: list[tuple[Spring, Card]] = field(default_factory=list)


def tied(
    joints: Joints, at: Index, dim: int, share: float, turned: dict[int, str]
) -> Tied:
    """The parts of the model; at: number in the mesh of each node, -1 without elements.

    share: of forces, 1 / thickness in 2D; turned: nodes with axes of their own, under a name.
    """
    out = Tied()
    lengths = joints.lengths
    for node, card in joints.named.items():
        if node not in lengths:
            point = joints.deck.points[node][:dim]
            out.references.append((Reference(joints.title(node), point), card))

    def term(raw: Raw) -> list[Term]:
        nodes, component, factor = raw
        plain = (at[nodes] >= 0) & ~np.isin(nodes, list(turned))
        if plain.all():
            return [(at[nodes], component, factor)]
        return [_term_of(int(n), component, factor) for n in nodes]

    def _term_of(node: int, component: int, factor: float) -> Term:
        if node in turned:
            return turned[node], component, factor
        if at[node] >= 0:
            return int(at[node]), component, factor
        lead = joints.turns.get(node)
        if lead is not None:
            return joints.title(lead) + ROTATION, _rotation(component, dim), factor
        if component >= TRANSLATIONS:
            turn = _rotation(component - TRANSLATIONS, dim)
            return joints.title(node) + ROTATION, turn, factor
        return joints.title(node), component, factor

    for terms, card in joints.equations:
        for each in _single([term(raw) for raw in terms]):
            out.constraints.append((Equation(each), card))
    for name, lead, kind, chosen, card in joints.couplings:
        wanted = None if chosen is None else [c for c in chosen if c < dim]
        made = Coupling(name, joints.title(lead), kind, wanted)
        out.constraints.append((made, card))
    for bolt in joints.bolts:
        normal = None if bolt.normal is None else bolt.normal[:dim].tolist()
        made = Pretension(joints.title(bolt.node), bolt.sides, normal)
        out.constraints.append((made, bolt.card))
    for terms, stiffness, card in joints.springs:
        for each in _single([term(raw) for raw in terms]):
            out.springs.append((Spring(each, stiffness * share), card))
    return out


def _single(terms: list[list[Term]]) -> list[list[Term]]:
    """Lists of terms: one of whole sets, or one for each of their nodes."""
    if all(len(each) == 1 for each in terms):
        return [[each[0] for each in terms]]
    count = max(len(each) for each in terms)
    return [[each[k] if len(each) > 1 else each[0] for each in terms] for k in range(count)]


def _rotation(component: int, dim: int) -> int:
    """The component of a rotation: in 2D that about z is the only one."""
    return component if dim == 3 else component - 2
