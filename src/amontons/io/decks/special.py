"""Supports and forces of a deck on nodes that are none of the mesh: references, bolts, axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mechanics.model import Axes
from ...mechanics.model.constraints import ROTATION
from .axes import Turned
from .cards import Card
from .course import Course
from .history import FREE, History, Prescribed
from .joints import TRANSLATIONS, Joints
from .scopes import Index
from .stages import Held

# number of the stage of a support, None of a load; name, values, card
Given = tuple[int | None, str, list[Course | None], Card]


def special_nodes(
    history: History, stages: Sequence[Held], joints: Joints, turned: Turned, at: Index,
    dim: int,
) -> tuple[list[tuple[Axes, Index, Card]], list[Given]]:  # fmt: skip
    """Axes of the model with the nodes of each, and what is given on all these nodes.

    It is then taken out of history and stages, whose rest is given on nodes of the mesh.
    """
    _check_moments(history, joints, at)
    axes = turned.parts(_used(history, stages, joints, turned), at, dim)
    out: list[Given] = []
    tables = [(s.number, history.supports, s.held) for s in stages]
    for stage, given, held in (*tables, (None, history.forces, history.forces.at)):
        for node in np.flatnonzero((held != FREE).any(axis=1)):
            for name, components in _named(int(node), joints, at, dim):
                courses = given.of(int(node), components, held)
                if any(course is not None for course in courses):
                    out.append((stage, name, courses, _card(given, held, int(node))))
        for part, nodes, _ in axes:
            courses = given.of(int(nodes[0]), range(dim), held)
            if any(course is not None for course in courses):
                out.append((stage, part.name, courses, _card(given, held, int(nodes[0]))))
            held[nodes] = FREE
        held[joints.all_named] = FREE
    return axes, out


def _named(node: int, joints: Joints, at: Index, dim: int) -> list[tuple[str, list[int]]]:
    """Names of what a node without elements stands for, and its components."""
    lead = joints.turns.get(node)
    if at[node] >= 0 or not (lead is not None or node in joints.named):
        return []
    turns = range(TRANSLATIONS, 2 * TRANSLATIONS) if dim == 3 else (2 * TRANSLATIONS - 1,)
    title = joints.title(node if lead is None else lead)
    if node in joints.lengths:
        return [(title, [0])]
    if lead is not None:
        return [(title + ROTATION, list(range(TRANSLATIONS)) if dim == 3 else [2])]
    return [(title, list(range(dim))), (title + ROTATION, list(turns))]


def _card(given: Prescribed, held: Index, node: int) -> Card:
    numbers = held[node]
    return given.cards[int(numbers[numbers != FREE].max())]


def _check_moments(history: History, joints: Joints, at: Index) -> None:
    """Raise FileFormatError for a moment at a node that does not turn."""
    moments = (history.forces.at[:, TRANSLATIONS:] != FREE).any(axis=1) & (at >= 0)
    for node in np.flatnonzero(moments):
        raise _card(history.forces, history.forces.at, int(node)).error(
            f"node {joints.deck.node_name(int(node))}: a moment at a node of solid elements, "
            "which does not turn; give it to a reference node"
        )


def _used(
    history: History, stages: Sequence[Held], joints: Joints, turned: Turned
) -> dict[int, tuple]:
    """Turned nodes that something names, and a key: those with equations have one each."""
    single = {
        int(node) for terms, *_ in (*joints.equations, *joints.springs)
        for nodes, _, _ in terms for node in nodes
    }  # fmt: skip
    out = {}
    for node in turned.axes:
        tables = (*(s.held for s in stages), history.forces.at)
        rows = tuple(number for table in tables for number in table[node, :3].tolist())
        if node in single or any(number != FREE for number in rows):
            out[node] = (*rows, node if node in single else -1, id(turned.cards[node]))
    return out
