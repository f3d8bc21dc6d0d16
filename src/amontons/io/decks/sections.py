"""Sections of bolts in a deck: elements on one side of them get nodes of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .cards import Card
from .flat import Deck
from .scopes import Faces, Index
from .shapes import SHAPES, side_named

Array = NDArray[np.float64]


def nodes_of(deck: Deck, elements: Index) -> Index:
    """All nodes of some elements."""
    found = [block.nodes[block.rows_of(elements)] for block in deck.blocks]
    return np.unique(np.concatenate([nodes.ravel() for nodes in found]))


def face_nodes(deck: Deck, faces: Faces, card: Card) -> Index:
    """Nodes of the faces of a section."""
    out = []
    for elements, label in faces:
        for block in deck.blocks:
            own = block.rows_of(elements)
            if len(own):
                side = side_named(label, block.kind, SHAPES[block.kind], card.error)
                out.append(block.nodes[own][:, side].ravel())
    return np.unique(np.concatenate(out))


def open_along(deck: Deck, elements: Sequence[Index], section: Index, card: Card) -> None:
    """Give the elements on the side of the faces nodes of their own, as CalculiX does."""
    middle = deck.points[section].mean(axis=0)
    own = np.concatenate(elements)
    corners = [
        (block, k, deck.points[block.nodes[k]].mean(axis=0))
        for block in deck.blocks
        for k in np.flatnonzero(np.isin(block.nodes, section).any(axis=1))
    ]  # fmt: skip
    spread = deck.points[section] - middle
    plane = np.linalg.svd(spread, full_matrices=True)[2]
    normal = plane[-1] if np.ptp(deck.points[:, 2]) else _in_plane(plane[0])
    inside = [c for block, k, c in corners if block.first + k in set(own.tolist())]
    side = np.sign((np.mean(inside, axis=0) - middle) @ normal)
    new = np.arange(len(deck.points))
    new[section] = len(deck.points) + np.arange(len(section))
    moved = [(block, k) for block, k, c in corners if np.sign((c - middle) @ normal) == side]
    if len(moved) == len(corners):
        raise card.error("SURFACE: no elements lie on the other side of the section")
    for j, block in enumerate(deck.blocks):
        rows = [k for other, k in moved if other is block]
        nodes = block.nodes.copy()
        nodes[rows] = new[nodes[rows]]
        deck.blocks[j] = replace(block, nodes=nodes)
    for node in section:
        deck.doubled[int(new[node])] = int(node)
    deck.points = np.concatenate([deck.points, deck.points[section]])


def _in_plane(along: Array) -> Array:
    return np.array([-along[1], along[0], 0.0])
