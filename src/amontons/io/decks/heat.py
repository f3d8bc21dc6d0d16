"""Temperatures of a deck: what nodes have at first, and what steps give them.

A body grows by its expansion times the change from the first temperature, 0 where a deck gives
none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .cards import Card, number
from .flat import Placed
from .scopes import Index

Array = NDArray[np.float64]
NONE = -1


@dataclass
class Heat:
    """Courses of the temperature by number: `at` (nodes,), NONE where none; first (nodes,)."""

    at: Index
    first: Array
    courses: list = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)

    @classmethod
    def of(cls, count: int, before: Sequence[Placed]) -> Heat:
        """Of the nodes of a deck, with *INITIAL CONDITIONS."""
        heat = cls(np.full(count, NONE), np.zeros(count))
        for each in before:
            if each.card.keyword != "INITIALCONDITIONS":
                continue
            for row in each.card.rows():
                if len(row.fields) < 2:
                    raise row.error("*INITIAL CONDITIONS: expected nodes and a temperature")
                nodes = each.scope.acted_on(row.fields[0], row)
                heat.first[nodes] = number(row.fields[1], row, "*INITIAL CONDITIONS")
        return heat

    def give(self, each: Placed, start: Callable, follow: Callable) -> None:
        """*TEMPERATURE of a step.

        start(times, values): a course; follow(course, value, card=): what this step makes of
        it.
        """
        card = each.card
        for option in ("FILE", "BSTEP", "USER", "SUBMODEL"):
            if option in card.options:
                raise card.error(f"{option}: is not read")
        if card.label("OP") == "NEW":
            raise card.error("OP=NEW: is not read, give the first temperature instead")
        for row in card.rows():
            if len(row.fields) < 2:
                raise row.error("*TEMPERATURE: expected nodes and a temperature")
            nodes = each.scope.acted_on(row.fields[0], row)
            value = number(row.fields[1], row, "*TEMPERATURE")
            keys = np.stack([self.at[nodes].astype(float), self.first[nodes]], axis=1)
            for old, first in np.unique(keys, axis=0):
                same = (keys == (old, first)).all(axis=1)
                is_new = old == NONE
                before = start((0.0,), (float(first),)) if is_new else self.courses[int(old)]
                self.courses.append(follow(before, value, card=card))
                self.cards.append(card)
                self.at[nodes[same]] = len(self.courses) - 1

    def groups(self) -> list[tuple[Index, object, Card]]:
        """Nodes with the same change of temperature: (nodes, its course, card)."""
        rows = np.flatnonzero(self.at != NONE)
        keys = np.stack([self.at[rows].astype(float), self.first[rows]], axis=1)
        out = []
        for number_, first in np.unique(keys, axis=0):
            course = self.courses[int(number_)]
            change = replace(course, values=tuple(v - float(first) for v in course.values))
            nodes = rows[(keys == (number_, first)).all(axis=1)]
            out.append((nodes, change, self.cards[int(number_)]))
        return out
