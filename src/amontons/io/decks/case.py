"""A deck as a case: its model, its steps in time, and what of it was left out.

Signs and order: a contact pair names the slave first; pressures push into a body.  Contact is
that of mortar elements, whatever discretisation the deck asks for; surfaces that overlap by a
law of pressure over overclosure do so only where the law is read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import Address, AmontonsError, FileFormatError, InvalidInput
from ...mechanics.contact.finding import Reach
from ...mechanics.elements.plasticity import is_plastic
from ...mechanics.model import (
    BodyForce,
    Fix,
    Model,
    NodalForce,
    Pressure,
    Reference,
    Spring,
    Temperature,
)
from ...mechanics.model.beside import Beside
from ...mechanics.model.constraints import Constraint
from ...mechanics.model.parts import Body
from ...mechanics.model.rigid import piece_labels
from ...mechanics.steps import Schedule, Stage, State
from ..case.evolution import Evolution
from ..case.overrides import override_settings
from ..case.settings import Settings
from ..readers import Case
from .about import About
from .adjusting import adjusted
from .axes import Turned
from .body_loads import body_force, scaled
from .cards import Card, Row, read_cards
from .contact_laws import Options, law_of
from .contacts import read_contacts
from .course import Course
from .flat import Deck, Placed, flatten
from .general import found_pairs, motion_of, part_titles, read_general, self_contact
from .history import History, read_history
from .joints import Joints, tied
from .keywords import left_out, plain, sorted_out
from .large import of_size
from .materials import read_interactions, read_sections
from .meshing import Region
from .options import PLACED, with_known_options
from .rigid_surfaces import SHELLS, section_of, solid_shells
from .scopes import Index
from .shapes import SHAPES
from .special import special_nodes
from .stages import Held, check_removed, read_stages, times_of
from .tools import OWN, own_nodes, tool_bodies

KINDS = ("supports", "loads", "contacts", "references", "constraints", "springs")


@dataclass
class Found:
    """The parts of a model with the card that each comes from."""

    loads: list[Any] = field(default_factory=list)
    references: list[Reference] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    cards: dict[str, list[Card]] = field(default_factory=lambda: {key: [] for key in KINDS})

    def add(self, kind: str, part: Any, card: Card) -> None:
        """Add one part."""
        getattr(self, kind).append(part)
        self.cards[kind].append(card)

    def line_of(self, at: Address) -> str:
        """Where in the deck the culprit stands."""
        if len(at) < 2 or at[0] not in self.cards or not isinstance(at[1], int):
            return ""
        card = self.cards[at[0]][at[1]]
        return f"line {card.number}: {card}"


def read(path: Path, overrides: Sequence[str] = (), method: str | None = None) -> Case:
    """The case in a deck.  Overrides: those of the solver, deck.allow and deck.hard."""
    settings, options = _settings(overrides, method)
    allow, notes = plain(options.allow), []
    cards = read_cards(path)
    cards = [with_known_options(c, allow, notes) if c.keyword in PLACED else c for c in cards]
    deck = flatten(cards, SHAPES | SHELLS)
    notes += _leave_out(deck, options)
    if not deck.steps:
        raise cards[-1].error("the deck ends here without a *STEP, it loads nothing")
    try:
        make = partial(_case, path, deck, settings, options)
        return of_size(make, deck, notes, small=options.small)
    except FileFormatError:
        raise
    except AmontonsError as reason:
        raise FileFormatError(f"{path}: {reason}") from reason


def _settings(overrides: Sequence[str], method: str | None) -> tuple[Settings, Options]:
    own = [text for text in overrides if text.split("=")[0].strip().startswith("deck.")]
    rest = [text for text in overrides if text not in own]
    settings = override_settings(Settings(method or "auto"), rest)
    values: dict[str, Any] = {}
    for text in own:
        key, _, value = text.partition("=")
        name = key.strip().removeprefix("deck.")
        if name == "allow":
            words = value.strip().strip("[]").replace('"', "").split(",")
            values["allow"] = tuple(word.strip() for word in words if word.strip())
        elif name == "increments" and value.strip().isdigit() and int(value) > 0:
            values["increments"] = int(value)
        elif name in ("hard", "small") and value.strip().lower() in ("true", "false"):
            values[name] = value.strip().lower() == "true"
        else:
            raise InvalidInput(
                f"--set {text}: expected deck.allow=[KEYWORD, ...], deck.hard=true, "
                "deck.small=true or deck.increments=NUMBER, of each step"
            )
    return settings, Options(**values)


def _leave_out(deck: Deck, options: Options) -> list[str]:
    """Take the cards away that are not read, and say so."""
    kept, notes = sorted_out([p.card for p in deck.model], options.allow)
    deck.model = _with(deck.model, kept)
    static = any(p.card.keyword == "STATIC" for step in deck.steps for p in step)
    said = [left_out([p.card for p in s], options.allow, has_static=static) for s in deck.steps]
    deck.steps = [step for step, note in zip(deck.steps, said, strict=True) if not note]
    notes += [note for note in said if note]
    for k, step in enumerate(deck.steps):
        kept, more = sorted_out([p.card for p in step], options.allow)
        deck.steps[k] = _with(step, kept)
        notes += [note for note in more if note not in notes]
    return notes


def _with(placed: list[Placed], cards: list[Card | None]) -> list[Placed]:
    """Those that have a card left."""
    return [
        Placed(card, one.scope)
        for one, card in zip(placed, cards, strict=True)
        if card is not None
    ]


def _case(
    path: Path, deck: Deck, settings: Settings, options: Options, notes: list[str],
    finite: bool,
) -> Case:  # fmt: skip
    shells = solid_shells(deck)
    sections = read_sections(deck, deck.model, notes)
    if len(shells):
        sections.append(section_of(shells, sections[0]))
    joints, turned = Joints.of(deck), Turned.of(deck)
    region = Region.of(deck, sections)
    history = read_history(deck, deck.model, deck.steps)
    title = _title(deck) or path.name.split(".")[0]
    notes += _formulations(deck)
    found = Found()
    interactions = read_interactions([p.card for p in deck.model])
    general = read_general(deck, region, interactions)
    stages = read_stages(deck, history, interactions)
    _joined(found, region, history, (joints, turned), stages)
    _name_nodes(region, deck, history, stages)
    pairs = read_contacts(deck, region, interactions, notes)
    check_removed(stages, pairs, deck)
    _name_faces(region, history)
    mesh, at = region.mesh(title)
    sections = [s for s in sections if s.name in mesh.regions]  # others are given again
    materials = {s.name: s.law(region.plane, finite=finite) for s in sections}
    near = Reach(more=motion_of(history))
    itself = any(pair.itself for pair in pairs)
    found_by_us = itself or general is not None
    titles = part_titles(deck, at, piece_labels(mesh)) if found_by_us else None
    if itself:
        mesh, pairs, said = self_contact(Body(mesh, materials), pairs, near, titles)
        notes += said
    if general is not None:
        mesh, more, said = found_pairs(general, Body(mesh, materials), pairs, near, titles)
        pairs += more
        notes += said
    if not pairs:
        notes.append("no contact in this deck: the bodies meet nothing, linear statics")
    mesh = adjusted(mesh, at, pairs, notes)
    _loads(found, region, history, at, notes)
    law = partial(law_of, options=options, notes=notes)
    for stage in stages:
        _supports(found, stage, region, history, at, notes)
        stage.contacts = stage.contacts_of(pairs, mesh, law)
    found.cards["contacts"] = [pair.card for pair in pairs]
    bodies = [Body(mesh, materials), *tool_bodies(joints, region)]
    if len(bodies) > 1:
        bodies[0] = replace(bodies[0], name=OWN)
        found.constraints[:] = own_nodes(found.constraints)
        found.springs[:] = own_nodes(found.springs)
    make = partial(_model, bodies, found, title)
    later = tuple(Stage(s.begin, partial(_of_state, make, s)) for s in stages[1:])
    plan = Schedule(*times_of(history, options.increments, notes), stages=later)
    case = Case(make(stages[0], None), settings, title, path,
                evolution=Evolution(plan, history.until), key_of=found.line_of,
                tables={"deck": {"cards": deck.digest}}, notes=tuple(notes),
                about=About.of(deck, history, at, stages, make))  # fmt: skip
    remembers = is_plastic(materials) or any(c.mu for c in stages[0].contacts)
    if later or (len(deck.steps) > 1 and remembers) or is_plastic(materials):
        return case  # friction and flow remember what was before
    return replace(case, target=make(stages[0], history.until), moving=case.target)


def _title(deck: Deck) -> str:
    for placed in deck.model:
        if placed.card.keyword == "HEADING":
            for row in placed.card.rows():
                return ", ".join(row.fields)[:80]
    return ""


def _formulations(deck: Deck) -> list[str]:
    """What elements of the deck do otherwise than ours."""
    kinds = dict.fromkeys(block.kind for block in deck.blocks)
    return [f"{kind}: {SHAPES[kind].note}" for kind in kinds if SHAPES[kind].note]


# ------------------------------------------------------------------------------ history
def _joined(
    found: Found, region: Region, history: History, given: tuple[Joints, Turned],
    stages: Sequence[Held],
) -> None:  # fmt: skip
    """References, constraints and springs, and what supports and loads give to them."""
    joints, turned = given
    joints.name_surfaces(region)
    at, share = region.numbering, 1.0 / region.thickness
    axes, loads = special_nodes(history, stages, joints, turned, at, region.dim)
    names = {int(n): part.name for part, nodes, _ in axes for n in nodes if len(nodes) == 1}
    made = tied(joints, at, region.dim, share, names)
    for part, _, card in axes:
        found.add("constraints", part, card)
    for kind in ("references", "constraints", "springs"):
        for part, card in getattr(made, kind):
            found.add(kind, part, card)
    for number, name, courses, card in loads:
        if number is None:
            found.add("loads", (NodalForce, name, [scaled(c, share) for c in courses]), card)
            continue
        stages[number].supports.append((name, courses))
        if not number:
            found.cards["supports"].append(card)


def _name_nodes(region: Region, deck: Deck, history: History, stages: Sequence[Held]) -> None:
    """Node sets of supports and forces: supports have the name of the same set of the deck."""
    sets: dict[bytes, str] = {}  # the first name of each
    for scope in (deck.top.own, *deck.instances.values()):
        for name, members in scope.node_sets.items():
            called = f"{scope.title}.{name}" if scope.title else name
            sets.setdefault(np.asarray(members, dtype=np.int64).tobytes(), called)
    for stage in stages:
        groups = history.supports.groups(region.dim, stage.held)
        stage.name(groups, region.node_sets, sets)
    for k, (nodes, _, _) in enumerate(history.forces.groups(region.dim)):
        region.node_sets[f"force {k + 1}"] = nodes
    for k, (nodes, _, _) in enumerate(history.heat.groups() if history.heat else ()):
        region.node_sets[f"temperature {k + 1}"] = nodes


def _name_faces(region: Region, history: History) -> None:
    for (name, label), (_, card, scope) in history.faces.items():
        row = Row(card.file, card.number, [])
        if label:
            faces = [(scope.elements(name, row), label)]
        else:
            faces, nodes = scope.surface(name, row)
            if nodes is not None:
                raise row.error(f"surface {name}: expected one of element faces")
        region.add_faces(_loaded(name, label), faces, row)


def _loaded(name: str, label: str) -> str:
    return f"pressure {name} {label}".strip()


def _supports(
    found: Found, stage: Held, region: Region, history: History, at: Index, notes: list[str]
) -> None:
    groups = history.supports.groups(region.dim, stage.held)
    for name, (nodes, courses, card) in zip(stage.names, groups, strict=True):
        if _without_elements(region, name, nodes, at):
            text = f"{card} (line {card.number}): nodes without elements are left out"
            notes += [text] if text not in notes else []
        if len(region.node_sets[name]):
            stage.supports.append((name, courses))
            if not stage.number:
                found.cards["supports"].append(card)


def _loads(
    found: Found, region: Region, history: History, at: Index, notes: list[str]
) -> None:
    dim, share = region.dim, 1.0 / region.thickness
    for k, (nodes, courses, card) in enumerate(history.forces.groups(dim)):
        name = f"force {k + 1}"
        if _without_elements(region, name, nodes, at):
            label = region.deck.node_name(int(nodes[at[nodes] < 0][0]))
            raise card.error(f"node {label}: belongs to no element, where does its force go?")
        found.add("loads", (NodalForce, name, [scaled(c, share) for c in courses]), card)
    grows = any(section.material.grows for section in region.sections)
    for k, (nodes, change, card) in enumerate(history.heat.groups() if history.heat else ()):
        if not grows:
            notes.append(f"{card} (line {card.number}): no material has an *EXPANSION")
            break
        name = f"temperature {k + 1}"
        _without_elements(region, name, nodes, at)
        if len(region.node_sets[name]):
            found.add("loads", (Temperature, name, change), card)
    for (name, label), (course, card, _) in history.faces.items():
        found.add("loads", (Pressure, _loaded(name, label), course), card)
    for (name, _), (course, way, card, scope) in history.bodies.items():
        chosen = set(scope.elements(name, Row(card.file, card.number, [])).tolist())
        for section in region.sections:
            own = set(section.elements.tolist())
            if not own & chosen:
                continue
            if own - chosen:
                raise card.error(f"{name} holds only a part of {section.name}")
            density = section.material.density
            if density is None:
                raise card.error(f"the material of {section.name} has no *DENSITY")
            found.add("loads", (BodyForce, section.name, (scaled(course, density), way)), card)


def _without_elements(region: Region, name: str, nodes: Index, at: Index) -> bool:
    """True where nodes of a set belong to no element; leaves them out of it."""
    kept = nodes[at[nodes] >= 0]
    region.node_sets[name] = kept
    return len(kept) < len(nodes)


def _of_state(make: Callable[..., Model], stage: Held, state: State) -> Model:
    """The model of a stage that begins, or goes on, at a state."""
    return make(stage, None, state)


def _model(
    bodies: list[Body], found: Found, title: str, stage: Held, time: float | None,
    state: State | None = None,
) -> Model:  # fmt: skip
    """The model of a stage at a time, or as it goes on in time where that is None."""
    value = partial(_value, time)
    beside = Beside.of(bodies, found.references, found.constraints)
    supports = [
        Fix(name, [
            None if c is None else stage.since(beside, name, c, axis, state)
            if c.is_open and state is not None else value(c)
            for axis, c in enumerate(courses)
        ])
        for name, courses in stage.supports
    ]  # fmt: skip
    loads: list[Any] = []
    for kind, name, courses in found.loads:
        if kind is NodalForce:
            loads.append(NodalForce(name, [value(c) for c in courses]))
        elif kind is Temperature:
            loads.append(Temperature(value(courses), on=name, mean=True))
        elif kind is Pressure:
            loads.append(Pressure(name, value(courses)))
        else:
            loads.append(body_force(name, *courses, value, bodies[0].mesh.dim))
    return Model(
        bodies, supports, stage.contacts, loads, name=title, references=found.references,
        constraints=found.constraints, springs=found.springs,
    )  # fmt: skip


def _value(time: float | None, course: Course) -> Any:
    if course.is_zero:
        return 0.0
    if time is not None:
        return course.at(time)
    return lambda x, t: course.at(t)
