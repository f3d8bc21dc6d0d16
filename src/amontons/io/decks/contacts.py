"""Contact pairs of a deck: surfaces, laws, adjusted nodes and clearances.

The slave comes first.  A slave surface of nodes that make no facets is met node by node, each
with its share of the facets next to it that face the master; all else is mortar contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...mechanics.model import Contact
from .cards import Card, Row, number
from .flat import Deck, Placed
from .materials import Interaction
from .meshing import Region
from .options import spelled
from .scopes import Analytic, Index, missing
from .tools import Tool, obstacle_of

Array = NDArray[np.float64]
ASIDE = {"HCRIT", "NOTHICKNESS", "SMALLSLIDING", "EXTENSIONZONE", "GEOMETRICCORRECTION",
         "SUPPLEMENTARYCONSTRAINTS", "WEIGHT", "TRACKING", "CPSET", "SMOOTH"}  # fmt: skip
ROUNDING = 1e-12  # of the coordinates: distances below are none
NEAR = 0.025  # of the size of a facet: a slave node that is tied without a tolerance


@dataclass
class Pair:
    """A contact pair of a deck: names of its surfaces in the mesh, its law, what is adjusted.

    adjust: nodes of the slave at most so far from the master are put onto it, or nodes of the
    deck that are; nodes: of the deck, those of the slave that take part, None for all.
    itself: a surface against itself, `self_contact` finds its sides.
    """

    slave: str
    master: str
    card: Card
    interaction: str
    nodal: bool = False
    adjust: float | Index | None = None
    nodes: Index | None = None
    points: Array | None = None
    clearance: float | None = None
    within: float | None = None
    glued: Array | None = None
    tool: Tool | None = None
    itself: bool = False
    follows: str | None = None

    def contact(self, law: dict[str, Any], far: float | None = None) -> Contact:
        """The contact of the model under a law; far: how far away one is that is removed."""
        if self.glued is not None:
            nodal = "mortar" if self.points is None else "nodal"
            return Contact(self.slave, master=self.master, tied=True, method=nodal,
                           where=partial(near, self.glued))  # fmt: skip
        gap = self.clearance if far is None else far
        if self.tool is not None:
            return Contact(self.slave, self.tool, follows=self.follows, method="mortar",
                           clearance=gap, **law)  # fmt: skip
        if self.points is None:
            return Contact(self.slave, master=self.master, clearance=gap, **law)
        where = partial(near, self.points)
        return Contact(
            self.slave, master=self.master, clearance=gap, method="nodal", where=where, **law
        )


def near(points: Array, x: Array) -> NDArray[np.bool_]:
    """Which of x (n, dim) are among points (k, dim)."""
    size = float(np.abs(points).max(initial=0.0)) or 1.0
    return np.asarray(cKDTree(points).query(x)[0] <= 1e-9 * size)


def read_contacts(
    deck: Deck, region: Region, interactions: dict[str, Interaction], notes: list[str],
) -> list[Pair]:  # fmt: skip
    """The pairs of a deck; raises FileFormatError with file and line."""
    for step in deck.steps:
        for placed in step:
            if placed.card.keyword in ("CONTACTPAIR", "SURFACEINTERACTION", "CLEARANCE"):
                raise placed.card.error("stands in a step; expected before the first one")
    pairs: list[Pair] = []
    for placed in deck.model:
        if placed.card.keyword in ("CHANGEFRICTION", "CHANGESURFACEBEHAVIOR", "MODELCHANGE"):
            raise placed.card.error("stands before the first *STEP; expected in one")
        if placed.card.keyword == "CONTACTPAIR":
            pairs += _pairs(placed, region, interactions, notes)
        elif placed.card.keyword == "TIE":
            pairs += _ties(placed, region)
        elif placed.card.keyword == "CLEARANCE":
            _clear(placed, pairs, region)
    return pairs


def _pairs(
    placed: Placed, region: Region, interactions: dict[str, Interaction], notes: list[str]
) -> list[Pair]:
    card = placed.card
    if "TIED" in card.options:
        raise card.error("TIED: is not read, expected *TIE")
    name = card.name("INTERACTION")
    if name not in interactions:
        raise card.error(missing("surface interaction", name, interactions))
    smooth = card.label("TYPE") in (None, "NODE TO SURFACE")
    out = []
    for row in card.rows():
        names = [text for text in row.fields if text]
        names = names * 2 if len(names) == 1 and len(row.fields) <= 2 else names
        if len(names) != 2:
            raise row.error(
                f"*CONTACT PAIR: expected slave, master, got {len(row.fields)} names"
            )
        pair = Pair("", names[1].strip('"').upper(), card, name, smooth)
        analytic = placed.scope.analytic(names[1])
        if analytic is not None:
            pair.tool, pair.follows = _tool(analytic, names[1], region.dim, row)
            pair.slave, pair.nodal = ask_surface(region, placed, names[0], row), False
        else:
            pair.master = ask_surface(region, placed, names[1], row)
            pair.slave, pair.nodes = _slave(region, placed, names[0], pair.master, row)
            pair.itself = pair.slave == pair.master
        pair.adjust = _adjust(placed)
        out.append(pair)
    if smooth and out:
        what = "node by node" if out[0].nodes is not None else "mortar"
        notes.append(f"{card} (line {card.number}): NODE TO SURFACE is taken as {what}")
    return out


def _tool(surface: Analytic, name: str, dim: int, row: Row) -> tuple[Tool, str]:
    """The obstacle of an analytic surface, and the body that it moves with."""
    if not surface.body:
        raise row.error(f"surface {name}: expected a *RIGID BODY, ANALYTICAL SURFACE={name}")
    return obstacle_of(surface, dim), surface.body


def _ties(placed: Placed, region: Region) -> list[Pair]:
    """*TIE: slave, master; nodes of the slave near the master are put onto it and glued."""
    card = placed.card
    for option in ("CYCLICSYMMETRY", "MULTISTAGE", "FLUIDPERIODIC"):
        if option in card.options:
            raise card.error(f"{spelled(option)}: is not read")
    out = []
    for row in card.rows():
        names = [text for text in row.fields if text]
        if len(names) != 2:
            raise row.error(f"{card}: expected slave, master, got {len(names)} names")
        master = ask_surface(region, placed, names[1], row)
        slave, nodes = _slave(region, placed, names[0], master, row)
        given = card.options.get("POSITIONTOLERANCE")
        within = (number(given, row, "POSITION TOLERANCE") if given
                  else NEAR * region.facet_size(master))  # fmt: skip
        adjust = None if card.label("ADJUST") == "NO" else within
        out.append(Pair(slave, master, card, "", adjust=adjust, nodes=nodes, within=within))
    return out


def _adjust(placed: Placed) -> float | Index | None:
    """The distance or the nodes of ADJUST."""
    card = placed.card
    value = card.options.get("ADJUST")
    if value is None:
        return None
    row = Row(card.file, card.number, [])
    try:
        float(value)
    except ValueError:
        return placed.scope.nodes(value, row)
    distance = number(value, row, f"{card}: ADJUST")
    if distance < 0:
        raise card.error(f"ADJUST: expected a distance >= 0 or a node set, got {value}")
    return distance


def _clear(placed: Placed, pairs: Sequence[Pair], region: Region) -> None:
    """*CLEARANCE, MASTER=, SLAVE=, VALUE=: the gap of a pair, < 0 for an overlap."""
    card = placed.card
    master, slave = card.name("MASTER"), card.name("SLAVE")
    if not card.options.get("VALUE"):
        raise card.error("VALUE: missing, expected a gap, < 0 for an overlap")
    row = Row(card.file, card.number, [])
    value = number(card.options["VALUE"], row, f"{card}: VALUE")
    found = [p for p in pairs if (p.slave, p.master) == (slave, master)]
    if not found:
        known = [f"{p.slave}, {p.master}" for p in pairs]
        raise card.error(missing("contact pair", f"{slave}, {master}", known))
    for pair in found:
        pair.clearance = value


# ------------------------------------------------------------------------------- surfaces
def ask_surface(region: Region, placed: Placed, text: str, row: Row) -> str:
    """Ask the mesh for a surface; returns its name there."""
    faces, nodes = placed.scope.surface(text, row)
    name = text.strip('"').upper()
    if not sum(len(elements) for elements, _ in faces) and (nodes is None or not len(nodes)):
        raise row.error(f"{placed.card}: surface {text}: is empty, expected element faces")
    if name not in region.facets:
        if nodes is None:
            region.add_faces(name, faces, row)
        else:
            region.add_covering(name, nodes, row)
    return name


def _slave(
    region: Region, placed: Placed, text: str, master: str, row: Row
) -> tuple[str, Index | None]:
    """The name of a slave surface in the mesh, and its nodes where they make no facets."""
    _, nodes = placed.scope.surface(text, row)
    name = text.strip('"').upper()
    if nodes is None or name in region.facets or region.covers(nodes):
        return ask_surface(region, placed, text, row), None
    region.add_around(name, nodes, region.facets[master], row)
    return name, nodes
