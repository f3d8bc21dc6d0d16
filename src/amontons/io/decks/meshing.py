"""The mesh of a flat deck: cells by section, the surfaces and node sets that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...core.errors import AmontonsError, InvalidInput
from ...mechanics.meshes import Cells, Facets, Mesh
from ...mechanics.meshes.cells import CELLS, FACET_KIND
from ...mechanics.meshes.check import checked_cells
from ...mechanics.meshes.surfaces import facet_normals
from .cards import Card, Row
from .flat import Deck, at_element
from .materials import Section
from .scopes import Faces, Index
from .shapes import SHAPES, side_named

Array = NDArray[np.float64]
FACING = 0.3  # cosine from which normals of two facets face each other


@dataclass
class Region:
    """What is known of the mesh before it is made.

    section_of (elements,): number of the section, -1 without one; at (elements,): block and
    row of each element.
    """

    deck: Deck
    sections: Sequence[Section]
    plane: str
    section_of: Index
    block_of: Index
    facets: dict[str, list[Facets]] = field(default_factory=dict)
    node_sets: dict[str, Index] = field(default_factory=dict)

    @classmethod
    def of(cls, deck: Deck, sections: Sequence[Section]) -> Region:
        """Check elements and sections; raises FileFormatError for what can not be meshed."""
        if not deck.blocks:
            raise InvalidInput("*ELEMENT: missing, the deck has no elements")
        count = sum(len(block.nodes) for block in deck.blocks)
        section_of = np.full(count, -1)
        for k, section in enumerate(sections):
            section_of[section.elements] = k
        block_of = np.concatenate([
            np.full(len(block.nodes), k) for k, block in enumerate(deck.blocks)
        ])  # fmt: skip
        first = deck.blocks[0]
        for block in deck.blocks:
            shape = SHAPES[block.kind]
            if shape.plane != SHAPES[first.kind].plane:
                raise block.card.error(
                    f"expected elements of one kind, got {first.kind} and {block.kind}"
                )
            own = section_of[block.first : block.first + len(block.nodes)]
            if (own < 0).any():
                raise block.card.error(
                    f"{int((own < 0).sum())} of its elements are in no *SOLID SECTION: they "
                    "have no material"
                )
        return cls(deck, sections, SHAPES[first.kind].plane, section_of, block_of)

    @property
    def dim(self) -> int:
        """2 or 3."""
        return 2 if self.plane else 3

    @property
    def thickness(self) -> float:
        """Of all sections in 2D; raises FileFormatError where they differ.

        1 for axisymmetric elements, whose forces are those of the whole body.
        """
        if self.plane in ("", "axisymmetric"):
            return 1.0
        for section in self.sections[1:]:
            if section.thickness != self.sections[0].thickness:
                raise section.card.error("thickness: sections of several thicknesses")
        return self.sections[0].thickness

    def add_faces(self, name: str, faces: Faces, where: Card | Row) -> None:
        """Ask for a surface of element faces."""
        out = self.facets.setdefault(name, [])
        for elements, label in faces:
            for block_number in np.unique(self.block_of[elements]):
                block = self.deck.blocks[block_number]
                own = elements[self.block_of[elements] == block_number] - block.first
                shape = SHAPES[block.kind]
                sides = shape.sides if not label else (
                    side_named(label, block.kind, shape, where.error),
                )  # fmt: skip
                out += [_facets(self.dim, block.nodes[own][:, side]) for side in sides]

    def covers(self, nodes: Index) -> bool:
        """Whether nodes are all those of some outer facets."""
        marked = np.zeros(len(self.deck.points), dtype=bool)
        marked[nodes] = True
        left = marked.copy()
        for facets in self._boundary():
            left[facets.nodes[marked[facets.nodes].all(axis=1)]] = False
        return not left.any()

    def add_around(self, name: str, nodes: Index, master: Sequence[Facets], where: Row) -> None:
        """Ask for the outer facets next to nodes that face the closest one of a master."""
        points = self.deck.points
        marked, other = np.zeros((2, len(points)), dtype=bool)
        marked[nodes] = True
        for facets in master:
            other[facets.nodes] = True
        sides = [
            _centres(points, Facets(f.kind, f.nodes[other[f.nodes].all(axis=1)]), self.dim)
            for f in self._boundary()
        ]
        centres, normals = (np.concatenate(x) for x in zip(*sides, strict=True))
        tree, out = cKDTree(centres), []
        for facets in self._boundary():
            own = Facets(facets.kind, facets.nodes[marked[facets.nodes].any(axis=1)])
            if not len(own.nodes):
                continue
            at, outward = _centres(points, own, self.dim)
            facing = np.einsum("ij,ij->i", outward, normals[tree.query(at)[1]]) < -FACING
            if facing.any():
                out.append(Facets(own.kind, own.nodes[facing]))
        covered = np.zeros(len(points), dtype=bool)
        for facets in out:
            covered[facets.nodes] = True
        for node in nodes[~covered[nodes]][:1]:
            raise where.error(
                f"surface {name}: node {self.deck.node_name(int(node))} is on no outer facet "
                "that faces the master; give the surface by element faces"
            )
        self.facets[name] = out

    def facet_size(self, name: str) -> float:
        """The mean length of a side of the facets of a surface."""
        sizes = []
        for facets in self.facets[name]:
            x = self.deck.points[facets.nodes[:, : CELLS[facets.kind].corner_count]]
            sizes.append(np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).ravel())
        return float(np.concatenate(sizes).mean())

    def add_covering(self, name: str, nodes: Index, where: Card | Row) -> None:
        """Ask for the surface that nodes make: the outer facets all of whose nodes they are."""
        marked = np.zeros(len(self.deck.points), dtype=bool)
        marked[nodes] = True
        found = [f for f in self._boundary() if len(f.nodes)]
        kept = [Facets(f.kind, f.nodes[marked[f.nodes].all(axis=1)]) for f in found]
        covered = np.zeros(len(marked), dtype=bool)
        for facets in kept:
            covered[facets.nodes] = True
        left = nodes[~covered[nodes]]
        if len(left):
            raise where.error(
                f"surface {name}: of its {len(nodes)} nodes {len(left)} make no facet of the "
                f"mesh with others of them, node {self.deck.node_name(int(left[0]))} for one; "
                "give it as a surface of element faces"
            )
        self.facets[name] = [f for f in kept if len(f.nodes)]

    def _boundary(self) -> tuple[Facets, ...]:
        from ...mechanics.meshes.facets import boundary

        return boundary(tuple(self._cells()))

    def _cells(self) -> list[Cells]:
        """All cells, one block for each type and section."""
        out = []
        for block in self.deck.blocks:
            own = self.section_of[block.first : block.first + len(block.nodes)]
            out += [
                Cells(SHAPES[block.kind].cell, block.nodes[own == k], self.sections[k].name,
                      SHAPES[block.kind].integration)
                for k in np.unique(own)
            ]
        return out

    @property
    def numbering(self) -> Index:
        """The number in the mesh of each node of the deck, -1 for one without elements."""
        used = np.zeros(len(self.deck.points), dtype=bool)
        for block in self.deck.blocks:
            used[block.nodes] = True
        return np.where(used, np.cumsum(used) - 1, -1)

    def mesh(self, title: str) -> tuple[Mesh, Index]:
        """The mesh, and the number in it of each node of the deck, -1 for one without elements.

        Raises FileFormatError that names a surface without outer facets.
        """
        at = self.numbering
        points = self.deck.points[at >= 0]
        if self.dim == 2:
            if np.ptp(points[:, 2]):
                raise InvalidInput("*NODE: plane elements with nodes at several z")
            points = points[:, :2]
        cells = [replace(c, nodes=at[c.nodes]) for c in self._cells()]
        surfaces = {
            name: tuple(Facets(f.kind, at[f.nodes]) for f in _joined(facets))
            for name, facets in self.facets.items()
        }
        sets = {name: at[nodes][at[nodes] >= 0] for name, nodes in self.node_sets.items()}
        try:
            mesh = Mesh(points, tuple(cells), surfaces, name=title, node_sets=sets,
                        axisymmetric=self.plane == "axisymmetric")  # fmt: skip
        except InvalidInput as reason:
            raise self._blamed(points, at, reason) from reason
        return mesh, at

    def _blamed(self, points: Array, at: Index, reason: InvalidInput) -> AmontonsError:
        """The reason with the line of the first element that is no valid cell by itself."""
        labels = self.deck.element_labels()
        for block in self.deck.blocks:
            kind, nodes = SHAPES[block.kind].cell, at[block.nodes]
            first, last = 0, len(nodes)
            if _is_valid(points, kind, nodes):
                continue
            while last - first > 1:
                middle = (first + last) // 2
                if _is_valid(points, kind, nodes[first:middle]):
                    first = middle
                else:
                    last = middle
            return at_element(block.card, int(labels[block.first + first]), str(reason))
        return reason


def _is_valid(points: Array, kind: str, nodes: Index) -> bool:
    try:
        checked_cells(points, kind, nodes, "")
    except InvalidInput:
        return False
    return True


def _centres(points: Array, facets: Facets, dim: int) -> tuple[Array, Array]:
    """Centres and outward unit normals of facets, (k, dim) each."""
    corners = points[facets.nodes][..., :dim]
    normal = facet_normals(points[:, :dim], facets)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return corners.mean(axis=1), normal / np.where(size > 0, size, 1.0)


def _facets(dim: int, nodes: Index) -> Facets:
    return Facets(FACET_KIND[dim, nodes.shape[1]], nodes)


def _joined(facets: Sequence[Facets]) -> list[Facets]:
    """One block for each kind, every facet once."""
    out = []
    for kind in dict.fromkeys(f.kind for f in facets):
        nodes = np.concatenate([f.nodes for f in facets if f.kind == kind])
        corners = np.sort(nodes[:, : CELLS[kind].corner_count], axis=1)
        _, first = np.unique(corners, axis=0, return_index=True)
        out.append(Facets(kind, nodes[np.sort(first)]))
    return out
