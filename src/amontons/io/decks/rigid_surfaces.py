"""Rigid surfaces of a deck, R3D3 and R3D4: thin solid elements behind them, all nodes rigid.

*RIGID BODY, ELSET= ties all nodes of its elements to the reference node, those that are made
here too, so that the solid elements never deform, whatever their material.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .cards import Card, Row
from .flat import Block, Deck
from .materials import Section
from .scopes import Faces, Index
from .shapes import SHAPES, Shape

Array = NDArray[np.float64]
SOLID = {"R3D3": "C3D6", "R3D4": "C3D8"}
SHELLS = {kind: Shape(SHAPES[solid].cell, SHAPES[solid].nodes // 2, ())
          for kind, solid in SOLID.items()}  # fmt: skip
FRONT = "S2"  # the side of these solid elements that is the rigid surface
THIN = 0.1  # thickness over the size of an element
EDGE = 0.05  # length of a mean normal below which it has no direction


def solid_shells(deck: Deck) -> Index:
    """Put solid elements in the place of rigid ones; returns these elements, (k,).

    Those of a surface named SNEG are turned around, so that the front is where contact is.
    Raises FileFormatError for elements of no rigid body, and for contact on both sides.
    """
    blocks = [k for k, block in enumerate(deck.blocks) if block.kind in SOLID]
    if not blocks:
        return np.zeros(0, dtype=np.int64)
    count = max(block.first + len(block.nodes) for block in deck.blocks)
    shell, bound = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    for k in blocks:
        shell[_elements(deck.blocks[k])] = True
    for placed in deck.model:
        if placed.card.keyword == "RIGIDBODY" and placed.card.label("ELSET"):
            row = Row(placed.card.file, placed.card.number, [])
            bound[placed.scope.elements(placed.card.name("ELSET"), row)] = True
    back = _labelled(deck, shell)
    rows = []
    for k in blocks:
        block, own = deck.blocks[k], _elements(deck.blocks[k])
        if not bound[own].all():
            raise block.card.error(
                f"{int((~bound[own]).sum())} of its elements are in no *RIGID BODY, ELSET=; "
                "rigid elements need one, with a REF NODE"
            )
        rows.append(np.where(back[own][:, None], block.nodes[:, ::-1], block.nodes))
    new = _behind(deck, rows, deck.blocks[blocks[0]].card)
    for k, nodes in zip(blocks, rows, strict=True):
        block = deck.blocks[k]
        both = np.concatenate([new[nodes], nodes], axis=1)
        deck.blocks[k] = replace(block, kind=SOLID[block.kind], nodes=both)
    return np.flatnonzero(shell)


def section_of(elements: Index, other: Section) -> Section:
    """The section of rigid elements, beside another one of the deck."""
    law = replace(other.material, density=None, expansion=0.0)
    return replace(other, name="rigid surfaces", elements=elements, material=law, axes=None)


def _elements(block: Block) -> Index:
    return block.first + np.arange(len(block.nodes))


def _labelled(deck: Deck, shell: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Name the front in all surfaces; returns which elements have it on their negative side."""
    sides = {label: np.zeros(len(shell), dtype=bool) for label in ("SPOS", "SNEG")}
    for names in (deck.top.own, *deck.instances.values()):
        for surface, faces in names.faces.items():
            out: Faces = []
            for elements, label in faces:
                own = elements[shell[elements]]
                if len(own):
                    sides["SNEG" if label == "SNEG" else "SPOS"][own] = True
                    out.append((own, FRONT))
                if len(own) < len(elements):
                    out.append((elements[~shell[elements]], label))
            names.faces[surface] = out
    both = sides["SPOS"] & sides["SNEG"]
    if both.any():
        block = next(b for b in deck.blocks if both[_elements(b)].any())
        raise block.card.error(
            f"contact on both sides, SPOS and SNEG, of {int(both.sum())} rigid elements is not "
            "read; expected one side, or two rigid bodies"
        )
    return sides["SNEG"]


def _behind(deck: Deck, rows: list[Index], card: Card) -> Index:
    """Add a node behind each node of the elements; returns new node of each old one, or -1."""
    normal, size = np.zeros_like(deck.points), []
    count = np.zeros(len(deck.points))
    for nodes in rows:
        x = deck.points[nodes]
        across = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
        area = np.linalg.norm(across, axis=1, keepdims=True) / 2
        if not area.all():
            raise card.error("a rigid element without an area")
        size.append(np.sqrt(area).ravel())
        for column in nodes.T:
            np.add.at(normal, column, across / (2 * area))
            np.add.at(count, column, 1)
    used = np.flatnonzero(count)
    mean = normal[used] / count[used, None]
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    if (length < EDGE).any():
        label = deck.node_name(int(used[length.ravel() < EDGE][0]))
        raise card.error(
            f"node {label}: the normals of the rigid elements there point in opposite "
            "directions; expected elements with their nodes in one sense of rotation"
        )
    new = np.full(len(deck.points), -1)
    new[used] = len(deck.points) + np.arange(len(used))
    thickness = THIN * float(np.concatenate(size).min())
    points = deck.points[used] - thickness * mean / length
    deck.points = np.concatenate([deck.points, points])
    return new
