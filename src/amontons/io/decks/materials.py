"""Materials, sections and interactions of a deck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...core.errors import InvalidInput
from .cards import Card, Row, number
from .elastic import (
    Axes,
    Elastic,
    Material,
    axes_of,
    elastic,
    elastic_rubber,
    expansion,
    first_row,
    flow,
    read_orientations,
)
from .flat import Deck, Placed
from .options import spelled
from .rubber import rubber
from .scopes import Index, missing

MATERIAL = ("ELASTIC", "HYPERELASTIC", "DENSITY", "EXPANSION", "PLASTIC")  # cards that are read


@dataclass(frozen=True)
class Section:
    """Elements of one material; thickness in 2D."""

    name: str
    elements: Index
    material: Elastic
    thickness: float
    card: Card
    axes: Axes | None = None

    def law(self, plane: str, *, finite: bool) -> Material:
        """The material for a plane state, in the axes of the section; of finite strains."""
        return self.material.law(plane, self.axes, finite=finite)


@dataclass
class Interaction:
    """How two surfaces touch: friction coefficient, and pressure over overclosure.

    behaviour: "HARD", or the word of a law that lets surfaces overlap, with its numbers; slope:
    shear stress over elastic slip, None where there is none.
    """

    card: Card
    friction: float = 0.0
    slope: float | None = None
    limit: float | None = None
    behaviour: str = "HARD"
    values: Sequence[Row] = ()
    behaviour_card: Card | None = None


def read_materials(cards: Sequence[Card], notes: list[str]) -> dict[str, Elastic]:
    """The materials by name; notes: gets what is to be said of them."""
    found: dict[str, Elastic] = {}
    density: dict[str, float] = {}
    grows: dict[str, Any] = {}
    flows: dict[str, Any] = {}
    current: Card | None = None
    for card in cards:
        if card.keyword == "MATERIAL":
            current = card
            if card.name("NAME") in found:
                raise card.error(f"NAME: material {card.name('NAME')} is there already")
        elif card.keyword in MATERIAL:
            if current is None:
                raise card.error("stands before the first *MATERIAL")
            name = current.name("NAME")
            if card.keyword == "DENSITY":
                density[name] = number(first_row(card).fields[0], first_row(card), "density")
            elif card.keyword == "EXPANSION":
                grows[name] = expansion(card)
            elif card.keyword == "PLASTIC":
                flows[name] = flow(card)
            elif card.keyword == "HYPERELASTIC":
                found[name] = elastic_rubber(rubber(card, notes), card)
            else:
                found[name] = elastic(card)
    return {
        name: replace(e, density=density.get(name), expansion=grows.get(name, 0.0),
                      flow=flows.get(name))
        for name, e in found.items()
    }


def read_sections(
    deck: Deck, placed: Sequence[Placed], notes: list[str]
) -> list[Section]:
    """Which elements are of which material; notes: gets what is to be said of those."""
    materials = read_materials([p.card for p in placed], notes)
    turned, found = read_orientations([p.card for p in placed]), []
    for each in placed:
        card = each.card
        if card.keyword != "SOLIDSECTION":
            continue
        name = card.name("MATERIAL")
        if name not in materials:
            raise card.error(missing("material", name, materials))
        row = next(card.rows(), Row(card.file, card.number, [""]))
        thickness = number(row.fields[0], row, "thickness") or 1.0
        if thickness < 0:
            raise row.error(f"thickness: expected a length > 0, got {thickness:g}")
        place = Row(card.file, card.number, [])
        title = card.name("ELSET")
        elements = each.scope.elements(title, place)
        inside = each.scope.own.title
        found.append(Section(f"{inside}.{title}" if inside else title, elements,
                             materials[name], thickness, card,
                             axes_of(card, turned)))  # fmt: skip
    if not found:
        if deck.blocks:
            raise deck.blocks[0].card.error("no *SOLID SECTION gives a material to elements")
        raise InvalidInput("*ELEMENT: missing, the deck has no solid elements")
    return found


def read_interactions(cards: Sequence[Card]) -> dict[str, Interaction]:
    """The interactions by name."""
    found: dict[str, Interaction] = {}
    current: Interaction | None = None
    for card in cards:
        if card.keyword == "SURFACEINTERACTION":
            current = found[card.name("NAME")] = Interaction(card)
        elif card.keyword in ("SURFACEBEHAVIOR", "FRICTION"):
            if current is None:
                raise card.error("stands before the first *SURFACE INTERACTION")
            (_behaviour if card.keyword == "SURFACEBEHAVIOR" else _friction)(current, card)
    return found


def changed_interactions(
    found: dict[str, Interaction], cards: Sequence[Card]
) -> dict[str, Interaction]:
    """The interactions as a step changes them, the same ones where it does not."""
    out = dict(found)
    current: Interaction | None = None
    for card in cards:
        if card.keyword in ("CHANGEFRICTION", "CHANGESURFACEBEHAVIOR"):
            name = card.name("INTERACTION")
            if name not in out:
                raise card.error(missing("surface interaction", name, out))
            current = out[name] = replace(out[name])
        elif card.keyword in ("FRICTION", "SURFACEBEHAVIOR"):
            if current is None:
                raise card.error(
                    "stands in a step; expected *CHANGE FRICTION or *CHANGE SURFACE BEHAVIOR "
                    "with the interaction before it"
                )
            (_behaviour if card.keyword == "SURFACEBEHAVIOR" else _friction)(current, card)
    return out


def _behaviour(interaction: Interaction, card: Card) -> None:
    word = card.label("PRESSURE-OVERCLOSURE") or "HARD"
    if "NOSEPARATION" in card.options:
        raise card.error("NO SEPARATION: is not read")
    interaction.behaviour, interaction.values = word, tuple(card.rows())
    interaction.behaviour_card = card


def _friction(interaction: Interaction, card: Card) -> None:
    for option in ("USER", "EXPONENTIALDECAY", "ROUGH", "LAGRANGE"):
        if option in card.options and option != "LAGRANGE":
            raise card.error(f"{spelled(option)}: is not read, expected a coefficient")
    rows = list(card.rows())
    if len(rows) != 1:
        raise card.error(f"expected one line with a coefficient, got {len(rows)}")
    row = rows[0]
    values = [number(text, row, "*FRICTION") for text in row.fields]
    if values[0] < 0:
        raise row.error(f"*FRICTION: expected a coefficient >= 0, got {values[0]:g}")
    interaction.friction = values[0]
    interaction.slope = interaction.limit = None
    if len(values) > 1 and values[1] > 0 and "SLIPTOLERANCE" not in card.options:
        interaction.slope = values[1]
    if card.options.get("TAUMAX"):
        interaction.limit = number(card.options["TAUMAX"], row, "TAUMAX")
