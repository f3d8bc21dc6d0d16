"""*TRANSFORM: nodes whose components of supports, forces and equations are along other axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...mechanics.model import Axes
from .cards import Card, Row, number
from .flat import Deck
from .scopes import Index

Array = NDArray[np.float64]
ON_AXIS = 1e-9  # distance from an axis, relative to its length, that is none


@dataclass
class Turned:
    """Axes (nodes, 3, 3) of nodes of the deck, and the card of each, None without."""

    axes: dict[int, Array] = field(default_factory=dict)
    cards: dict[int, Card] = field(default_factory=dict)

    @classmethod
    def of(cls, deck: Deck) -> Turned:
        """Read all cards before the first step."""
        made = cls()
        for placed in deck.model:
            card = placed.card
            if card.keyword != "TRANSFORM":
                continue
            row = next(card.rows(), None)
            values = [] if row is None else [number(t, row, str(card)) for t in row.fields]
            if row is None or len(values) != 6:
                raise card.error(f"expected six coordinates of two points, got {len(values)}")
            a, b = np.array(values[:3]), np.array(values[3:])
            kind = card.label("TYPE") or "R"
            if kind not in ("R", "C"):
                raise card.error(f"TYPE={kind}: expected R, rectangular, or C, cylindrical")
            where = Row(card.file, card.number, [])
            for node in placed.scope.nodes(card.name("NSET"), where):
                at = deck.points[node]
                axes = _rectangular(a, b, row) if kind == "R" else _cylindrical(a, b, at, row)
                made.axes[int(node)], made.cards[int(node)] = axes, card
        return made

    def parts(
        self, used: dict[int, tuple], at: Index, dim: int
    ) -> list[tuple[Axes, Index, Card]]:
        """Axes of the model, the nodes of the deck each stands for, and its card.

        used: nodes whose components something names, with a key; nodes of one key share axes.
        """
        keys: dict[tuple, list[int]] = {}
        for node, key in used.items():
            if node in self.axes and at[node] >= 0:
                keys.setdefault(key, []).append(node)
        out = []
        for k, nodes in enumerate(keys.values()):
            table = np.array(sorted(nodes, key=lambda n: at[n]))
            card = self.cards[int(table[0])]
            axes = np.stack([self.axes[int(n)] for n in table])
            if dim == 2 and np.abs(axes[:, 2, :2]).max() > ON_AXIS:
                raise card.error("in 2D: expected axes turned about z")
            part = Axes(f"axes {k + 1}", at[table], axes[:, :dim, :dim])
            out.append((part, table, card))
        return out


def _unit(vector: Array, row: Row) -> Array:
    size = float(np.linalg.norm(vector))
    if not size:
        raise row.error("*TRANSFORM: expected points that give directions")
    return vector / size


def _rectangular(a: Array, b: Array, row: Row) -> Array:
    """First axis along a, the second in the plane of a and b."""
    first = _unit(a, row)
    third = _unit(np.cross(a, b), row)
    return np.stack([first, np.cross(third, first), third])


def _cylindrical(a: Array, b: Array, at: Array, row: Row) -> Array:
    """Radial, around and along the axis from a to b."""
    along = _unit(b - a, row)
    arm = at - a - ((at - a) @ along) * along
    if np.linalg.norm(arm) <= ON_AXIS * np.linalg.norm(b - a):
        raise row.error(f"*TRANSFORM: the node at {at.tolist()} is on the axis")
    radial = _unit(arm, row)
    return np.stack([radial, np.cross(along, radial), along])
