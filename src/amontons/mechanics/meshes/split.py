"""Parts of a mesh that share nodes taken apart, so that they can be in contact.

A file often holds touching volumes as one mesh: they are bonded.  `split` gives each side of
the surface between them nodes of its own, at the same places.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from .cells import CELLS, FACET_KIND
from .facets import Facets
from .mesh import Mesh, unknown

Index = NDArray[np.int64]
Glue = bool | Mapping[str, bool]


def split(mesh: Mesh, glue: Glue) -> Mesh:
    """The mesh with its regions apart: glue is False, or {surface: False} for some surfaces.

    Of a surface "joint" that is cut between the regions steel and copper, "joint-steel" and
    "joint-copper" are the two sides, each on its own region; what of it is not cut keeps the
    name.  Sides without a surface are "steel-copper", that of steel, and "copper-steel".
    Nothing is changed with True.  Raises InvalidInput for an unknown surface, and for one that
    does not lie between two regions.
    """
    check_glue(glue)
    names = [] if isinstance(glue, bool) else [name for name, kept in glue.items() if not kept]
    for name in names:
        if name not in mesh.surfaces:
            raise InvalidInput(unknown("surface", name, mesh.surfaces), ("glue",))
    if glue is True or (not names and glue is not False):
        return mesh
    sides = [_Sides.of(mesh, size) for size in sorted(_sizes(mesh))]
    tables = {side.size: side for side in sides}
    for side in sides:
        side.cut(mesh, None if glue is False else names)
    if names:
        _check_cut(mesh, names, tables)
    return _taken_apart(mesh, tables, everywhere=glue is False)


def check_glue(glue: object) -> None:
    """Raise InvalidInput for what is neither a truth value nor one for each surface."""
    if isinstance(glue, bool):
        return
    if not isinstance(glue, Mapping) or not all(isinstance(v, bool) for v in glue.values()):
        raise InvalidInput(
            "expected True, False, or {surface: False} for a surface that is not glued, got "
            f"{glue!r}", ("glue",),
        )  # fmt: skip


@dataclass(eq=False)
class _Sides:
    """Sides of all cells with so many nodes; `partner` is the same side of the next cell."""

    size: int
    nodes: Index  # (k, size), outwards
    cell: Index  # (k,), numbered over all blocks
    place: Index  # (k, size), of these nodes in the cell
    region: Index  # (k,)
    partner: Index  # (k,), -1 on the boundary
    is_cut: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: Mesh, size: int) -> _Sides:
        nodes, cell, place, region, first = [], [], [], [], 0
        for block in mesh.cells:
            numbers = first + np.arange(len(block.nodes))
            for side in CELLS[block.kind].facets:
                if len(side) == size:
                    nodes.append(block.nodes[:, side])
                    cell.append(numbers)
                    place.append(np.tile(np.asarray(side), (len(numbers), 1)))
                    region.append(np.full(len(numbers), mesh.regions.index(block.region)))
            first += len(block.nodes)
        table = np.concatenate(nodes)
        _, label = np.unique(np.sort(table, axis=1), axis=0, return_inverse=True)
        order = np.argsort(label.ravel(), kind="stable")
        ranked = label.ravel()[order]
        same = np.flatnonzero(ranked[1:] == ranked[:-1])
        partner = np.full(len(table), -1)
        partner[order[same]], partner[order[same + 1]] = order[same + 1], order[same]
        return cls(size, table, np.concatenate(cell), np.concatenate(place),
                   np.concatenate(region), partner, np.zeros(len(table), bool))  # fmt: skip

    def cut(self, mesh: Mesh, names: list[str] | None) -> None:
        """Mark sides between regions, all of them or those of some surfaces."""
        between = (self.partner >= 0) & (self.region != self.region[self.partner])
        if names is not None:
            wanted = np.zeros(len(self.nodes), dtype=bool)
            for name in names:
                wanted[self.rows(mesh.surfaces[name])] = True
            between &= wanted | wanted[self.partner]
        self.is_cut = between

    def rows(self, facets: tuple[Facets, ...]) -> Index:
        """A row for each facet with so many nodes, the one of its first cell."""
        tables = [b.nodes for b in facets if b.nodes.shape[1] == self.size]
        if not tables:
            return np.zeros(0, dtype=np.int64)
        wanted = np.concatenate(tables)
        both = np.concatenate([self.nodes, wanted])
        _, label = np.unique(np.sort(both, axis=1), axis=0, return_inverse=True)
        label = label.ravel()
        first = np.full(label.max() + 1, -1)
        first[label[: len(self.nodes)][::-1]] = np.arange(len(self.nodes))[::-1]
        return first[label[len(self.nodes) :]]


def _sizes(mesh: Mesh) -> set[int]:
    return {len(side) for block in mesh.cells for side in CELLS[block.kind].facets}


def _check_cut(mesh: Mesh, names: list[str], tables: Mapping[int, _Sides]) -> None:
    for name in names:
        facets = mesh.surfaces[name]
        if not any(side.is_cut[side.rows(facets)].any() for side in tables.values()):
            raise InvalidInput(
                f"surface {name!r} does not lie between two regions, there is nothing to take "
                f"apart; regions: {', '.join(mesh.regions)}", ("glue",),
            )  # fmt: skip


def _taken_apart(mesh: Mesh, tables: Mapping[int, _Sides], *, everywhere: bool) -> Mesh:
    """Copies of nodes for cells that no uncut side joins any more, and all facets on them."""
    starts = np.cumsum([0, *(b.nodes.size for b in mesh.cells)])
    corners = np.concatenate([b.nodes.ravel() for b in mesh.cells])
    first = np.concatenate([
        at + np.arange(len(b.nodes)) * b.nodes.shape[1]
        for at, b in zip(starts, mesh.cells, strict=False)
    ])  # fmt: skip
    number, origin = _copies(mesh, tables, corners, first, everywhere)
    cells = tuple(
        replace(b, nodes=number[at : at + b.nodes.size].reshape(b.nodes.shape))
        for at, b in zip(starts, mesh.cells, strict=False)
    )
    surfaces: dict[str, list[Facets]] = {}
    for side in tables.values():
        new = number[first[side.cell][:, None] + side.place]
        for name, rows in _named_rows(mesh, side):
            facets = Facets(FACET_KIND[mesh.dim, side.size], new[rows])
            surfaces.setdefault(name, []).append(facets)
    return Mesh(mesh.points[origin], cells, {k: tuple(v) for k, v in surfaces.items()},
                name=mesh.name, axisymmetric=mesh.axisymmetric)  # fmt: skip


def _copies(
    mesh: Mesh, tables: Mapping[int, _Sides], corners: Index, first: Index, everywhere: bool
) -> tuple[Index, Index]:
    """New node of every corner of a cell, and the old node of each new one.

    everywhere: regions that share an edge or a node only come apart there, too.
    """
    from scipy.sparse import csgraph

    at_cut = np.zeros(len(mesh.points), dtype=bool)
    one, two = [], []
    for side in tables.values():
        at_cut[side.nodes[side.is_cut]] = True
        kept = np.flatnonzero((side.partner >= 0) & ~side.is_cut)
        here, there = kept, side.partner[kept]
        # the same nodes on both sides of the facet, in the order of their numbers
        ours, theirs = (np.argsort(side.nodes[k], axis=1) for k in (here, there))
        one.append(first[side.cell[here]][:, None]
                   + np.take_along_axis(side.place[here], ours, axis=1))  # fmt: skip
        two.append(first[side.cell[there]][:, None]
                   + np.take_along_axis(side.place[there], theirs, axis=1))  # fmt: skip
    if everywhere:
        at_cut |= _shared_by_regions(mesh)
    a, b = (np.concatenate([t.ravel() for t in tables_]) for tables_ in (one, two))
    graph = sparse.coo_array((np.ones(len(a), np.int8), (a, b)), shape=(len(corners),) * 2)
    _, part = csgraph.connected_components(graph, directed=False)
    key = np.where(at_cut[corners], part, -1)
    pairs = np.stack([corners, key], axis=1)
    found, number = np.unique(pairs, axis=0, return_inverse=True)
    return number.ravel(), found[:, 0]


def _shared_by_regions(mesh: Mesh) -> NDArray[np.bool_]:
    """Which nodes belong to cells of more than one region."""
    count = np.zeros(len(mesh.points), dtype=np.int64)
    for region in mesh.regions:
        own = np.concatenate([b.nodes.ravel() for b in mesh.cells if b.region == region])
        count[np.unique(own)] += 1
    return count > 1


def _named_rows(mesh: Mesh, side: _Sides) -> list[tuple[str, Index]]:
    """Names of surfaces of the result, with the rows of the sides that they consist of."""
    found, named = [], np.zeros(len(side.nodes), dtype=bool)
    for name, facets in mesh.surfaces.items():
        rows = side.rows(facets)
        cut = rows[side.is_cut[rows]]
        found.append((name, rows[~side.is_cut[rows]]))
        both = np.concatenate([cut, side.partner[cut]])
        named[both] = True
        for k in np.unique(side.region[both]):
            found.append((f"{name}-{mesh.regions[k]}", both[side.region[both] == k]))
    rest = np.flatnonzero(side.is_cut & ~named)
    pairs = np.stack([side.region[rest], side.region[side.partner[rest]]], axis=1)
    for k, other in np.unique(pairs, axis=0):
        name = f"{mesh.regions[k]}-{mesh.regions[other]}"
        found.append((name, rest[(pairs == (k, other)).all(axis=1)]))
    return [(name, rows) for name, rows in found if len(rows)]
