"""Stages of a deck: steps between which neither supports nor laws of contact come or go."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mechanics.meshes import Mesh
from ...mechanics.model import Contact
from ...mechanics.model.beside import Beside
from ...mechanics.steps import State
from .cards import Card
from .contacts import Pair
from .course import Course
from .flat import Deck, Placed
from .history import FREE, Group, History
from .materials import Interaction, changed_interactions
from .scopes import Index, missing

MOST = 20  # increments of a step that may choose them
INSIDE = 1e-6  # share of a step from its ends in which nothing bends that steps should meet
AWAY = 10.0  # sizes of a body by which sides are apart whose contact is removed


@dataclass
class Held:
    """A stage: from when on, what `Prescribed.at` is then, and the interactions.

    removed: pairs (slave, master) that do not act.  supports, contacts: parts of its model.
    """

    number: int
    begin: float
    held: Index
    interactions: dict[str, Interaction]
    removed: frozenset[tuple[str, str]] = frozenset()
    supports: list[tuple[str, list[Course | None]]] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    names: list[str] = field(default_factory=list)  # of the node sets of its supports

    def name(
        self, groups: Sequence[Group], known: dict[str, Index], sets: Mapping[bytes, str]
    ) -> None:
        """Name the node sets of groups of supports; those that are known keep their names.

        sets: names of the deck's own sets, by their nodes; others are named after the line of
        their card.
        """
        names = {own.tobytes(): name for name, own in known.items()
                 if name.startswith("support")}  # fmt: skip
        for nodes, _, card in groups:
            key = nodes.tobytes()
            if key not in names:
                base = f"support {sets[key]}" if key in sets else (
                    f"support of line {card.number}")  # fmt: skip
                names[key], k = base, 2
                while names[key] in known:
                    names[key], k = f"{base} part {k}", k + 1
            self.names.append(names[key])
            known[names[key]] = nodes

    def contacts_of(
        self, pairs: Sequence[Pair], mesh: Mesh, law: Callable[..., dict[str, Any]]
    ) -> list[Contact]:
        """The contacts of its model."""
        far = AWAY * float(np.ptp(mesh.points, axis=0).max())
        return [
            pair.contact(
                {} if pair.within is not None
                else law(self.interactions[pair.interaction], nodal=pair.nodal),
                far if (pair.slave, pair.master) in self.removed else None,
            )
            for pair in pairs
        ]

    def since(
        self, beside: Beside, name: str, course: Course, axis: int, state: State
    ) -> Callable[[NDArray[np.float64], float], float]:
        """A course that goes on from where nodes are at a state, or what is beside them."""
        entry = beside.named(name)
        dofs, points = beside.nodes(name) if entry is None else (entry.dofs, entry.points)
        moved = state.displacement[dofs]
        known = {x.tobytes(): u[axis] for x, u in zip(points, moved, strict=True)}
        begin = state.time

        def value(x: NDArray[np.float64], t: float) -> float:
            return course.since(begin, float(known[x.tobytes()])).at(t)

        return value


def read_stages(
    deck: Deck, history: History, interactions: dict[str, Interaction]
) -> list[Held]:
    """The stages of a deck; raises FileFormatError for changes that can not be followed."""
    out: list[Held] = []
    removed: frozenset[tuple[str, str]] = frozenset()
    for k, step in enumerate(deck.steps):
        changed = changed_interactions(interactions, [placed.card for placed in step])
        gone = _removed(step, removed)
        differs = any(changed[name] is not interactions[name] for name in changed)
        if k == 0 or differs or gone != removed or _comes_or_goes(history, k):
            out.append(Held(len(out), history.spans[k].begin, history.held[k], changed, gone))
        else:
            out[-1] = replace(out[-1], held=history.held[k])
        interactions, removed = changed, gone
    return out


def _comes_or_goes(history: History, k: int) -> bool:
    """Whether step k > 0 holds other components, or some from where they are."""
    now, before = history.held[k], history.held[k - 1]
    if ((now == FREE) != (before == FREE)).any():
        return True
    new = np.unique(now[(now != before) & (now != FREE)])
    return any(history.supports.courses[number].is_open for number in new)


def _removed(
    step: Sequence[Placed], removed: frozenset[tuple[str, str]]
) -> frozenset[tuple[str, str]]:
    """Contact pairs that *MODEL CHANGE takes away or brings back."""
    out = set(removed)
    for placed in step:
        card = placed.card
        if card.keyword != "MODELCHANGE":
            continue
        if card.label("TYPE") not in ("CONTACT PAIR", "CONTACTPAIR"):
            raise card.error(
                f"TYPE={card.label('TYPE')}: elements that come and go are not read, expected "
                "TYPE=CONTACT PAIR"
            )
        if ("ADD" in card.options) == ("REMOVE" in card.options):
            raise card.error("expected either ADD or REMOVE")
        for row in card.rows():
            names = [text.strip('"').upper() for text in row.fields]
            if len(names) != 2:
                raise row.error(f"{card}: expected slave, master, got {len(names)} names")
            pair = names[0], names[1]
            (out.add if "REMOVE" in card.options else out.discard)(pair)
    return frozenset(out)


def check_removed(stages: Sequence[Held], pairs: Sequence[Pair], deck: Deck) -> None:
    """Raise FileFormatError for a pair that is removed and is none."""
    known = {(pair.slave, pair.master) for pair in pairs}
    steps = [placed.card for step in deck.steps for placed in step]
    cards: list[Card] = [card for card in steps if card.keyword == "MODELCHANGE"]
    for stage in stages:
        for pair in pairs:
            if pair.itself and (pair.slave, pair.master) in stage.removed:
                raise cards[0].error(
                    f"{pair.slave}: contact with itself that comes and goes is not read"
                )
        for slave, master in sorted(stage.removed - known):
            names = [", ".join(each) for each in known]
            raise cards[0].error(missing("contact pair", f"{slave}, {master}", names))


def times_of(
    history: History, increments: int | None, notes: list[str]
) -> tuple[float, None, tuple[float, ...]]:
    """Step, no crossing, and the ends of all steps in time: fields of a `Schedule`.

    Every step of the deck has its increments, those of the first one's size, at most MOST
    where it may choose them, and all times at which something bends.
    """
    times: set[float] = set()
    for span in history.spans:
        length = span.end - span.begin
        count = max(int(np.ceil(length / span.increment - 1e-9)), 1)
        if increments is not None:
            count = increments
        elif count > MOST and not span.direct:
            notes.append(
                f"{span.card} (line {span.card.number}): {MOST} increments, not {count}: the "
                "first one of the deck is a guess; --set deck.increments=N asks for others"
            )
            count = MOST
        even = span.begin + length * np.arange(1, count) / count
        near = INSIDE * length
        bends = [t for t in history.corners if span.begin + near < t < span.end - near]
        bends = [t for t in bends if not len(even) or np.abs(even - t).min() > near]
        times |= {float(t) for t in (*even, *bends, span.end)}
    ends = tuple(sorted(times))
    return float(np.diff((0.0, *ends)).min()), None, ends
