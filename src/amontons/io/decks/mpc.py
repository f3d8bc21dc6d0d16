"""*MPC of a deck as equations, linear about the undeformed nodes.

PLANE: nodes stay in the plane of the first three; STRAIGHT: on the line through the first two;
BEAM: two nodes keep their distance (CalculiX); TIE: they move alike; LINEAR: the first moves as
the line between the two others.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .cards import Card, Row
from .flat import Deck, Placed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Raw = tuple[Index, int, float]
FLAT = 1e-9  # sine of an angle that is none
TURNING = ("PLANE", "STRAIGHT", "BEAM")  # elsewhere nonlinear: about the moved nodes
TYPES = (*TURNING, "TIE", "LINEAR")


def mpc_equations(deck: Deck, placed: Placed) -> list[tuple[list[Raw], Card]]:
    """The equations of a card; raises FileFormatError for other types and wrong nodes."""
    kind, nodes, row = _read(placed)
    found = MAKERS[kind](deck.points, nodes, row)
    return [([term for term in terms if term[2]], placed.card) for terms in found]


def turning_mpcs(deck: Deck, numbers: Index) -> Iterator[tuple[str, Index]]:
    """Types of cards that turn with their nodes, and these nodes' numbers in the mesh.

    numbers: of the deck's nodes in the mesh, -1 for one without elements, which has no results.
    """
    for placed in deck.model:
        if placed.card.keyword == "MPC":
            kind, nodes, _ = _read(placed)
            known = numbers[nodes]
            if kind in TURNING and (known >= 0).all():
                yield kind, known


def _read(placed: Placed) -> tuple[str, Index, Row]:
    """Type, nodes of the deck and first line of a card, checked."""
    card = placed.card
    rows = [row for row in card.rows() if any(row.fields)]
    if not rows:
        raise card.error("expected a type and nodes")
    kind = rows[0].fields[0].upper()
    if kind not in TYPES:
        raise rows[0].error(f"*MPC {kind}: is not read, expected one of {', '.join(TYPES)}")
    fields = [(t, row) for row in rows for t in row.fields[row is rows[0] :] if t]
    nodes = np.concatenate([placed.scope.nodes(text, row) for text, row in fields] or
                           [np.zeros(0, dtype=np.int64)])  # fmt: skip
    least = {"PLANE": 4, "STRAIGHT": 3, "LINEAR": 3}.get(kind, 2)
    if len(nodes) < least or (kind in ("BEAM", "TIE") and len(nodes) != 2):
        raise rows[0].error(f"*MPC {kind}: expected {least} nodes, got {len(nodes)}")
    return kind, nodes, rows[0]


def _one(node: int, component: int, factor: float) -> Raw:
    return np.array([node]), component, float(factor)


def _plane(x: Array, nodes: Index, row: Row) -> list[list[Raw]]:
    a, b, c = nodes[:3]
    normal = np.cross(x[b] - x[a], x[c] - x[a])
    size = float(np.linalg.norm(normal))
    if size <= FLAT * np.linalg.norm(x[b] - x[a]) * np.linalg.norm(x[c] - x[a]):
        raise row.error("*MPC PLANE: its first three nodes lie on a line")
    normal = normal / size
    first = int(np.abs(normal).argmax())
    order = [first, *(k for k in range(3) if k != first)]
    out = []
    for node in nodes[3:]:
        system = np.stack([x[b] - x[a], x[c] - x[a], normal], axis=1)
        s, t, _ = np.linalg.solve(system, x[node] - x[a])
        shares = ((node, 1.0), (a, s + t - 1), (b, -s), (c, -t))
        out.append([_one(n, k, w * normal[k]) for n, w in shares for k in order])
    return out


def _along(x: Array, a: int, b: int, node: int, row: Row) -> float:
    way = x[b] - x[a]
    if not way.any():
        raise row.error("*MPC: its two nodes are at one place")
    return float((x[node] - x[a]) @ way / (way @ way))


def _straight(x: Array, nodes: Index, row: Row) -> list[list[Raw]]:
    a, b = nodes[:2]
    way = x[b] - x[a]
    out = []
    for node in nodes[2:]:
        s = _along(x, a, b, node, row)
        main = int(np.abs(way).argmax())
        for k in range(3):
            if k == main:
                continue
            shares = ((node, 1.0), (a, s - 1), (b, -s))
            slope = way[k] / way[main]
            parts = ((k, 1.0), (main, -slope))
            out.append([_one(n, c, w * f) for n, w in shares for c, f in parts])
    return out


def _beam(x: Array, nodes: Index, row: Row) -> list[list[Raw]]:
    a, b = nodes
    way = x[b] - x[a]
    if not way.any():
        raise row.error("*MPC BEAM: its two nodes are at one place")
    first = int(np.abs(way).argmax())
    order = [first, *(k for k in range(3) if k != first)]
    return [[_one(n, k, sign * way[k]) for n, sign in ((a, 1.0), (b, -1.0)) for k in order]]


def _tie(x: Array, nodes: Index, row: Row) -> list[list[Raw]]:
    a, b = nodes
    return [[_one(a, k, 1.0), _one(b, k, -1.0)] for k in range(3)]


def _linear(x: Array, nodes: Index, row: Row) -> list[list[Raw]]:
    p, a, b = nodes[:3]
    s = _along(x, a, b, p, row)
    return [[_one(p, k, 1.0), _one(a, k, s - 1), _one(b, k, -s)] for k in range(3)]


MAKERS = {"PLANE": _plane, "STRAIGHT": _straight, "BEAM": _beam, "TIE": _tie, "LINEAR": _linear}
