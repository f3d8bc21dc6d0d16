"""Supports and forces of a deck on nodes that are none of the mesh: references, bolts, axes."""

from __future__ import annotations

import numpy as np

from ...mechanics.model import Axes
from ...mechanics.model.constraints import ROTATION
from .axes import Turned
from .cards import Card
from .history import FREE, Course, History, Prescribed
from .joints import TRANSLATIONS, Joints
from .scopes import Index

Given = tuple[str, str, list[Course | None], Card]  # "supports" or "loads", name, values, card


def special_nodes(
    history: History, joints: Joints, turned: Turned, at: Index, dim: int
) -> tuple[list[tuple[Axes, Index, Card]], list[Given]]:
    """Axes of the model with the nodes of each, and what is given on all these nodes.

    It is then taken out of the history, whose rest is given on nodes of the mesh.
    """
    _check_moments(history, joints, at)
    axes = turned.parts(_used(history, joints, turned), at, dim)
    out: list[Given] = []
    for kind, given in (("supports", history.supports), ("loads", history.forces)):
        for node in np.flatnonzero((given.at != FREE).any(axis=1)):
            out += _on_reference(kind, given, int(node), joints, at, dim)
        for part, nodes, _ in axes:
            courses = given.of(int(nodes[0]), range(dim))
            if any(course is not None for course in courses):
                out.append((kind, part.name, courses, _card(given, int(nodes[0]))))
            given.at[nodes] = FREE
    return axes, out


def _on_reference(
    kind: str, given: Prescribed, node: int, joints: Joints, at: Index, dim: int
) -> list[Given]:
    """What is given at a node without elements, by the name of its reference or bolt."""
    lead = joints.turns.get(node)
    if at[node] >= 0 or not (lead is not None or node in joints.named):
        return []
    turns = range(TRANSLATIONS, 2 * TRANSLATIONS) if dim == 3 else (2 * TRANSLATIONS - 1,)
    title, card = joints.title(node if lead is None else lead), _card(given, node)
    if node in joints.lengths:
        parts = [(title, [0])]
    elif lead is not None:
        parts = [(title + ROTATION, list(range(TRANSLATIONS)) if dim == 3 else [2])]
    else:
        parts = [(title, list(range(dim))), (title + ROTATION, list(turns))]
    out: list[Given] = []
    for name, components in parts:
        courses = given.of(node, components)
        if any(course is not None for course in courses):
            out.append((kind, name, courses, card))
    given.at[node] = FREE
    return out


def _card(given: Prescribed, node: int) -> Card:
    numbers = given.at[node]
    return given.cards[int(numbers[numbers != FREE].max())]


def _check_moments(history: History, joints: Joints, at: Index) -> None:
    """Raise FileFormatError for a moment at a node that does not turn."""
    moments = (history.forces.at[:, TRANSLATIONS:] != FREE).any(axis=1) & (at >= 0)
    for node in np.flatnonzero(moments):
        raise _card(history.forces, int(node)).error(
            f"node {joints.deck.node_name(int(node))}: a moment at a node of solid elements, "
            "which does not turn; give it to a reference node"
        )


def _used(history: History, joints: Joints, turned: Turned) -> dict[int, tuple]:
    """Turned nodes that something names, and a key: those with equations have one each."""
    single = {
        int(node) for terms, *_ in (*joints.equations, *joints.springs)
        for nodes, _, _ in terms for node in nodes
    }  # fmt: skip
    out = {}
    for node in turned.axes:
        rows = (*history.supports.at[node, :3].tolist(), *history.forces.at[node, :3].tolist())
        if node in single or any(number != FREE for number in rows):
            out[node] = (*rows, node if node in single else -1, id(turned.cards[node]))
    return out
