"""The mesh of a deck alone: cells, groups of elements, surfaces; nothing of its physics.

Elements of any physics count by their shape: shells and membranes on solids, lines on plane
cells, are what exporters write for groups of sides.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from ...core.errors import FileFormatError
from ...mechanics.meshes.cells import FACET_KIND
from ...mechanics.meshes.mesh import Mesh
from ...mechanics.meshes.raw import RawBlock, RawMesh, to_mesh
from ...mechanics.meshes.split import Glue, check_glue, split
from .cards import Card, read_cards
from .flat import Block, Deck, flatten
from .scopes import Index, Names
from .shapes import QUAD, QUAD8, SHAPES, TRI, TRI6, Shape, side_named, side_of

MESH_CARDS = {
    "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "PART", "ENDPART", "ASSEMBLY",
    "ENDASSEMBLY", "INSTANCE", "ENDINSTANCE",
}  # fmt: skip
SHELLS = {
    name: Shape(cell, nodes, sides)
    for cell, nodes, sides, names in (
        ("tri", 3, TRI, "S3 S3R STRI3 M3D3 R3D3 SFM3D3"),
        ("quad", 4, QUAD, "S4 S4R M3D4 M3D4R R3D4 SFM3D4 SFM3D4R"),
        ("tri6", 6, TRI6, "S6 STRI65 M3D6 SFM3D6"),
        ("quad8", 8, QUAD8, "S8 S8R M3D8 M3D8R SFM3D8 SFM3D8R"),
        ("line", 2, (), "T2D2 T3D2 B21 B31 B31R R2D2 SAX1"),
        ("line3", 3, (), "T2D3 T3D3 B22 B32 B32R SAX2"),
    )
    for name in names.split()
}
SOLIDS = {  # of other physics, or with other ways to integrate
    f"{head}{tail}": shape
    for name, shape in SHAPES.items() if name.startswith("C3D")
    for head, tail in (("DC3D", name[3:]), (name, "H"), (name, "T"), (name, "RH"), (name, "M"))
}  # fmt: skip


def read_deck_mesh(path: str | os.PathLike[str], *, glue: Glue = True) -> Mesh:
    """Cells, ELSETs as regions or surfaces, NSETs that span sides and SURFACEs as surfaces.

    Names are written as in the file; those of an instance follow it, "Bolt-1.head".  Raises
    FileFormatError naming file and line.
    """
    check_glue(glue)
    return split(_whole(Path(path))[0], glue)


def read_numbered_mesh(path: Path) -> tuple[Mesh, Index]:
    """The mesh of a deck, and the number that every node (nodes,) has there.

    Raises FileFormatError for a deck that calls two nodes alike, in several instances.
    """
    mesh, deck = _whole(path)
    labels = np.zeros(len(deck.points), dtype=np.int64)
    for names, _ in deck.point_labels:
        labels[names.node_at] = names.node_labels
    used = np.unique(np.concatenate([block.nodes.ravel() for block in deck.blocks]))
    if len(used) != len(mesh.points) or len(np.unique(labels[used])) != len(used):
        raise FileFormatError(
            f"{path}: expected a deck whose nodes have one number each, without elements on "
            "sides of others alone"
        )
    return mesh, labels[used]


def _whole(path: Path) -> tuple[Mesh, Deck]:
    """The mesh of a file, bonded where regions meet, and the flat deck."""
    cards = [card for card in _model(read_cards(path)) if card.keyword in MESH_CARDS]
    deck = flatten(cards, SHAPES | SOLIDS | SHELLS)
    if not deck.blocks:
        raise FileFormatError(f"{path}: expected a mesh, got no elements (*ELEMENT)")
    chosen = {card.label("ELSET") for card in cards if card.keyword == "ELSET"}
    return to_mesh(_raw(deck, _writing(cards), chosen), os.fspath(path)), deck


def _model(cards: list[Card]) -> Iterator[Card]:
    """The cards before the first step."""
    for card in cards:
        if card.keyword == "STEP":
            return
        yield card


def _writing(cards: list[Card]) -> dict[str, str]:
    """Names as they were written first, by those in capitals."""
    found: dict[str, str] = {}
    for card in cards:
        for value in card.options.values():
            found.setdefault(value.upper(), value)
    return found


def _raw(deck: Deck, writing: dict[str, str], chosen: set[str | None]) -> RawMesh:
    """Blocks split by the sets that their elements are in.

    chosen: sets with a card of their own; before those of *ELEMENT they name equal regions.
    """
    count = sum(len(block.nodes) for block in deck.blocks)
    groups: list[list[str]] = [[] for _ in range(count)]
    node_sets, faces = {}, []
    for names in (deck.top.own, *deck.instances.values()):

        def called(key: str, names: Names = names) -> str:
            own = writing.get(key, key)
            return f"{writing.get(names.title, names.title)}.{own}" if names.title else own

        for key in sorted(names.element_sets, key=lambda key: key not in chosen):
            name = called(key)
            for element in names.element_sets[key]:
                groups[element].append(name)
        for key, members in (names.node_sets | names.node_surfaces).items():
            node_sets[called(key)] = members
        for key, sides in names.faces.items():
            for elements, label in sides:
                faces += _sides(deck, elements, label, called(key))
    blocks = [part for block in deck.blocks for part in _parts(block, groups, deck.shapes)]
    return RawMesh(deck.points, [*blocks, *faces], node_sets)


def _parts(
    block: Block, groups: list[list[str]], shapes: Mapping[str, Shape]
) -> list[RawBlock]:
    """The elements of a block, apart where they are in other groups."""
    rows: dict[tuple[str, ...], list[int]] = {}
    for k in range(len(block.nodes)):
        rows.setdefault(tuple(dict.fromkeys(groups[block.first + k])), []).append(k)
    cell = shapes[block.kind].cell
    return [RawBlock(cell, block.nodes[own], key) for key, own in rows.items()]


def _wrong(where: str, text: str) -> FileFormatError:
    return FileFormatError(f"{where}: {text}")


def _sides(deck: Deck, elements: Index, label: str, name: str) -> Iterator[RawBlock]:
    """Sides of elements as facets, of shells and lines the elements themselves."""
    for block in deck.blocks:
        nodes, shape = block.nodes[block.rows_of(elements)], deck.shapes[block.kind]
        if not len(nodes):
            continue
        if side_of(label) is None:
            if block.kind in SHELLS:
                yield RawBlock(shape.cell, nodes, (name,))
            continue
        error = partial(_wrong, f"{block.card.file}: surface {name}")
        chosen = nodes[:, side_named(label, block.kind, shape, error)]
        dim = 2 if shape.cell.startswith(("tri", "quad")) else 3
        yield RawBlock(FACET_KIND[dim, chosen.shape[1]], chosen, (name,))
