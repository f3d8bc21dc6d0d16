"""Gmsh's text files, versions 2.2 and 4.1, with the line number in every complaint.

Own reader because elements may belong to several physical groups, and groups of different
dimension may share a name.  Format: gmsh reference manual, "File formats".
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from .raw import RawBlock, RawMesh

Index = NDArray[np.int64]
KINDS = {1: ("line", 2), 2: ("tri", 3), 3: ("quad", 4), 4: ("tet", 4), 5: ("hex", 8),
         6: ("wedge", 6), 7: ("pyramid", 5), 8: ("line3", 3), 9: ("tri6", 6), 10: ("quad9", 9),
         11: ("tet10", 10), 12: ("hex27", 27), 13: ("wedge18", 18), 14: ("pyramid14", 14),
         15: ("vertex", 1), 16: ("quad8", 8), 17: ("hex20", 20), 18: ("wedge15", 15),
         19: ("pyramid13", 13)}  # fmt: skip
ORDER = {  # of gmsh's nodes, in the places of ours: edges and faces come in another order
    "tet10": (0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
    "hex20": (*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
    "hex27": (*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15,
              22, 23, 21, 24, 20, 25, 26),
    "wedge15": (*range(6), 6, 9, 7, 12, 14, 13, 8, 10, 11),
}  # fmt: skip
DIMENSION = {"vertex": 0, "line": 1, "tri": 2, "quad": 2, "line3": 1, "tri6": 2, "quad8": 2,
             "quad9": 2}  # fmt: skip
Names = dict[tuple[int, int], str]


class Lines:
    """The lines of a file, read one after the other; complaints carry the line number."""

    def __init__(self, path: str, lines: Sequence[str]) -> None:
        self.path, self.lines, self.at = path, lines, 0

    def error(self, expected: str, found: str | None = None) -> FileFormatError:
        """An error at the line read last."""
        line = self.lines[self.at - 1].strip() if found is None and self.at else found
        return FileFormatError(f"{self.path}:{self.at}: expected {expected}, got {line!r}")

    def next(self, expected: str) -> str:
        """The next line."""
        if self.at >= len(self.lines):
            raise self.error(expected, "end of file")
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self, expected: str, least: int = 1) -> list[int]:
        """The next line as at least that many whole numbers."""
        words = self.next(expected).split()
        try:
            numbers = [int(word) for word in words]
        except ValueError:
            raise self.error(expected) from None
        if len(numbers) < least:
            raise self.error(expected)
        return numbers

    def table(self, rows: int, columns: int, expected: str, kind: type) -> NDArray:
        """The next `rows` lines as numbers (rows, columns); further columns are cut off."""
        first = self.at
        if rows < 0 or first + rows > len(self.lines):
            self.at = len(self.lines)
            raise self.error(f"{rows} lines of {expected}", "end of file")
        try:
            out = np.array(
                [line.split()[:columns] for line in self.lines[first : first + rows]],
                dtype=kind,
            )
            if rows and out.shape != (rows, columns):
                raise ValueError
        except (ValueError, OverflowError):
            self._find_bad(first, rows, columns, expected, kind)
            raise
        self.at = first + rows
        return out.reshape(rows, columns)

    def _find_bad(self, first: int, rows: int, columns: int, expected: str, kind: type) -> None:
        for self.at in range(first + 1, first + rows + 1):
            words = self.lines[self.at - 1].split()[:columns]
            try:
                if np.array(words, dtype=kind).shape != (columns,):
                    raise ValueError
            except (ValueError, OverflowError):
                raise self.error(expected) from None


def is_text(head: bytes) -> bool:
    """True for the first bytes of a gmsh text file of version 2 or 4.1."""
    match = re.search(rb"\$MeshFormat\s+(\S+)\s+(\d)", head)
    return bool(match) and match[2] == b"0" and match[1] in (b"2", b"2.1", b"2.2", b"4.1")


def read_text(path: str, text: str) -> RawMesh:
    """The mesh of a gmsh text file."""
    lines = Lines(path, text.splitlines())
    names: Names = {}
    entities: dict[tuple[int, int], list[int]] = {}
    version, nodes, elements = "", None, None
    while lines.at < len(lines.lines):
        section = lines.next("a section").strip()
        if section == "$MeshFormat":
            version = lines.next("a version").split()[0]
        elif section == "$PhysicalNames":
            names = _names(lines)
        elif section == "$Entities":
            entities = _entities(lines)
        elif section == "$Nodes":
            nodes = _nodes_2(lines) if version < "4" else _nodes_4(lines)
        elif section == "$Elements":
            elements = _elements_2(lines) if version < "4" else _elements_4(lines, entities)
        elif section and not section.startswith("$"):
            raise lines.error("a section that starts with $")
        _skip_to_end(lines, section)
    if nodes is None or elements is None:
        raise FileFormatError(f"{path}: expected sections $Nodes and $Elements, one is missing")
    return _raw(path, names, nodes, elements)


def _skip_to_end(lines: Lines, section: str) -> None:
    if not section:
        return
    end = "$End" + section[1:]
    while lines.next(end).strip() != end:
        if section in ("$Nodes", "$Elements", "$PhysicalNames"):
            raise lines.error(end)


def _names(lines: Lines) -> Names:
    """{(dimension, tag): name}."""
    out = {}
    for _ in range(lines.integers("the number of physical names")[0]):
        match = re.match(r'\s*(\d+)\s+(-?\d+)\s+"(.*)"', lines.next("a physical name"))
        if not match:
            raise lines.error('dimension tag "name"')
        out[int(match[1]), int(match[2])] = match[3]
    return out


def _entities(lines: Lines) -> dict[tuple[int, int], list[int]]:
    """{(dimension, entity): physical tags}."""
    out = {}
    counts = lines.integers("numbers of points, curves, surfaces, volumes", 4)
    for dim, count in enumerate(counts[:4]):
        skip = 4 if dim == 0 else 7
        for _ in range(count):
            words = lines.next("an entity").split()
            try:
                tags = int(words[skip])
                out[dim, int(words[0])] = [int(w) for w in words[skip + 1 : skip + 1 + tags]]
            except (IndexError, ValueError):
                raise lines.error("an entity: tag, box, number of physical tags") from None
    return out


def _nodes_2(lines: Lines) -> tuple[Index, NDArray]:
    """(node tags, coordinates (n, 3))."""
    count = lines.integers("the number of nodes")[0]
    table = lines.table(count, 4, "a node: tag x y z", float)
    return table[:, 0].astype(np.int64), table[:, 1:]


def _nodes_4(lines: Lines) -> tuple[Index, NDArray]:
    blocks = lines.integers("numBlocks numNodes minTag maxTag", 2)[0]
    tags, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for _ in range(blocks):
        *_, count = lines.integers("dimension entity parametric numNodes", 4)
        tags.append(lines.table(count, 1, "a node tag", int)[:, 0])
        points.append(lines.table(count, 3, "coordinates x y z", float))
    return np.concatenate(tags), np.concatenate(points)


Elements = list[tuple[str, Index, list[int]]]  # kind, node tags (k, nodes), physical tags


def _kind(lines: Lines, code: int) -> tuple[str, int]:
    if code not in KINDS:
        kinds = ", ".join(map(str, KINDS))
        raise lines.error(f"an element type of first or second order, among {kinds}", str(code))
    return KINDS[code]


def _elements_2(lines: Lines) -> Elements:
    count = lines.integers("the number of elements")[0]
    found: dict[tuple[str, int], list[list[int]]] = {}
    for _ in range(count):
        words = lines.integers("an element: number type tags nodes", 3)
        kind, size = _kind(lines, words[1])
        if len(words) != 3 + words[2] + size:
            raise lines.error(f"an element with {words[2]} tags and {size} nodes")
        physical = abs(words[3]) if words[2] else 0
        found.setdefault((kind, physical), []).append(words[-size:])
    return [
        (kind, np.array(rows), [physical] if physical else [])
        for (kind, physical), rows in found.items()
    ]


def _elements_4(lines: Lines, entities: dict[tuple[int, int], list[int]]) -> Elements:
    out = []
    for _ in range(lines.integers("numBlocks numElements minTag maxTag", 2)[0]):
        dim, entity, code, count = lines.integers("dimension entity type numElements", 4)[:4]
        kind, size = _kind(lines, code)
        table = lines.table(count, 1 + size, "an element: tag nodes", int)
        out.append((kind, table[:, 1:], [abs(t) for t in entities.get((dim, entity), [])]))
    return out


def _raw(path: str, names: Names, nodes: tuple[Index, NDArray], elements: Elements) -> RawMesh:
    """Nodes by position instead of tag, physical tags by name (or their number)."""
    tags, points = nodes
    order = np.argsort(tags, kind="stable")
    ordered = tags[order]
    if (np.diff(ordered) == 0).any():
        raise FileFormatError(
            f"{path}: node {ordered[:-1][np.diff(ordered) == 0][0]} comes twice"
        )
    blocks = []
    for kind, table, physical in elements:
        place = np.minimum(np.searchsorted(ordered, table), max(len(ordered) - 1, 0))
        if len(ordered) == 0 or (ordered[place] != table).any():
            missing = (
                table.ravel()[0] if not len(ordered) else table[ordered[place] != table][0]
            )
            raise FileFormatError(
                f"{path}: an element names node {missing}, which is not defined"
            )
        dim = DIMENSION.get(kind, 3)
        groups = tuple(names.get((dim, tag), str(tag)) for tag in physical)
        if kind in ORDER:
            place = place[:, ORDER[kind]]
        blocks.append(RawBlock(kind, order[place], groups))
    return RawMesh(points, blocks)
