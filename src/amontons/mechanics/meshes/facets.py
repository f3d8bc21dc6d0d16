"""Sides of cells: outward orientation of given facets, and the boundary of a mesh."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import integers, read_only
from ...core.errors import InvalidInput
from ...core.locks import KeepsLocks
from .cells import CELLS, FACET_KIND, FIRST
from .single_sides import single_sides

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Cells(KeepsLocks):
    """Cells of one kind in one region: nodes (k, nodes per cell) in VTK order.

    integration: of the stiffness, "full", or "hybrid", the volume changing on the mean of each
    cell (`elements/hybrid`; the same for tri and tet, whose volume changes evenly); at small
    strains "reduced", with fewer points: 1 for tri around an axis, 2 per direction for quad8,
    quad9, hex20 and hex27, 2 for wedge, 9 for wedge15; of quad and hex also "incompatible",
    bending modes inside of each cell on its own, or "hybrid-incompatible", with both
    (`elements/uniform`; around an axis "hybrid").  "auto": from a poisson of 0.4 on
    hybrid-incompatible where there is such a cell, else hybrid; below full.
    """

    kind: str
    nodes: Index
    region: str = "default"
    integration: str = "auto"


@dataclass(frozen=True, eq=False)
class Facets(KeepsLocks):
    """Facets of one kind ("line", "tri", "quad", "line3", …): nodes (k, nodes per facet).

    Right-hand rule outwards; in 2D the outward normal is the right side of the direction.
    """

    kind: str
    nodes: Index


def corner_facets(facets: Facets) -> Facets:
    """The same facets as those of first order on their corners; their sides are straight."""
    kind = FIRST.get(facets.kind, facets.kind)
    return Facets(kind, facets.nodes[:, : CELLS[kind].nodes])


BACKWARDS = {"line": (1, 0), "tri": (0, 2, 1), "quad": (0, 3, 2, 1), "line3": (1, 0, 2),
             "tri6": (0, 2, 1, 5, 4, 3), "quad8": (0, 3, 2, 1, 7, 6, 5, 4),
             "quad9": (0, 3, 2, 1, 7, 6, 5, 4, 8)}  # fmt: skip


def turned(facets: tuple[Facets, ...]) -> tuple[Facets, ...]:
    """The same facets seen from behind: normals are opposite."""
    return tuple(Facets(b.kind, b.nodes[:, BACKWARDS[b.kind]]) for b in facets)


PARTS = {  # of facets of second order, through all of their nodes
    "line3": (("line", ((0, 2), (2, 1))),),
    "tri6": (("tri", ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))),),
    "quad8": (("tri", ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7))), ("quad", ((4, 5, 6, 7),))),
    "quad9": (("quad", ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))),),
}


def linear_parts(facets: tuple[Facets, ...]) -> tuple[Facets, ...]:
    """The same surface as facets of first order between all of its nodes."""
    return tuple(
        Facets(kind, np.concatenate([block.nodes[:, part] for part in parts]))
        for block in facets
        for kind, parts in PARTS.get(block.kind, ((block.kind, (slice(None),)),))
    )


def sides(cells: tuple[Cells, ...], near: NDArray[np.bool_] | None = None) -> dict[int, Index]:
    """All sides of all cells, outwards, by number of nodes: {nodes per side: (k, nodes)}.

    near, (n,): only sides all of whose nodes are marked.
    """
    found: dict[int, list[Index]] = {}
    for block in cells:
        marked = None if near is None else near[block.nodes]
        for side in CELLS[block.kind].facets:
            some = block.nodes
            if marked is not None:
                some = some[np.logical_and.reduce([marked[:, k] for k in side])]
            found.setdefault(len(side), []).append(some[:, side])
    return {size: np.concatenate(tables) for size, tables in found.items()}


def boundary(cells: tuple[Cells, ...]) -> tuple[Facets, ...]:
    """Facets that belong to one cell only, outwards."""
    out = []
    dim = CELLS[cells[0].kind].dim if cells else 3
    points = 1 + max((int(block.nodes.max(initial=-1)) for block in cells), default=-1)
    for size in sorted({len(side) for block in cells for side in CELLS[block.kind].facets}):
        nodes = _all_sides(cells, size)
        out.append(nodes[single_sides(nodes, points)].astype(np.int64))
    kinds = [FACET_KIND[dim, nodes.shape[1]] for nodes in out]
    return tuple(
        Facets(kind, nodes) for kind, nodes in zip(kinds, out, strict=True) if len(nodes)
    )


def _all_sides(cells: tuple[Cells, ...], size: int) -> NDArray[np.int32]:
    """All sides of `size` nodes, (k, size), in the order of `sides`."""
    own = [
        (block, side) for block in cells for side in CELLS[block.kind].facets
        if len(side) == size
    ]  # fmt: skip
    ends = np.cumsum([0, *(len(block.nodes) for block, _ in own)])
    out = np.empty((ends[-1], size), dtype=np.int32)
    for (block, side), first, last in zip(own, ends[:-1], ends[1:], strict=True):
        for slot, corner in enumerate(side):
            out[first:last, slot] = block.nodes[:, corner]
    return out


def inner_facets(cells: tuple[Cells, ...], facets: tuple[Facets, ...], points: int) -> int:
    """How many of the given facets lie between two cells."""
    known = sides(cells, _at_nodes(facets, points))
    count = 0
    for block in facets:
        both = np.concatenate([known[block.nodes.shape[1]], block.nodes])
        _, times = np.unique(np.sort(both, axis=1), axis=0, return_counts=True)
        count += int((times > 2).sum())  # twice as a side of cells, once as a given facet
    return count


def oriented(
    cells: tuple[Cells, ...], surfaces: Mapping[str, tuple[Facets, ...]], points: Array
) -> dict[str, tuple[Facets, ...]]:
    """The same facets outwards, each once; raises InvalidInput if one is no side of a cell.

    A facet between two cells takes the direction out of the first.
    """
    blocks = {
        name: [Facets(b.kind, _node_table(b, name, points)) for b in facets if len(b.nodes)]
        for name, facets in surfaces.items()
    }
    near_any = _at_nodes(itertools.chain(*blocks.values()), len(points))
    known = sides(cells, near_any) if near_any.any() else {}  # one pass over all cells
    return {name: _sides_of(some, known, name, points) for name, some in blocks.items()}


def _at_nodes(facets: Iterable[Facets], points: int) -> NDArray[np.bool_]:
    """Which points (n,) facets have."""
    near = np.zeros(points, dtype=bool)
    for block in facets:
        near[block.nodes] = True
    return near


def _sides_of(
    facets: list[Facets], known: dict[int, Index], name: str, points: Array
) -> tuple[Facets, ...]:
    """The facets of one surface as they are in sides of cells by number of nodes."""
    near, out = _at_nodes(facets, len(points)), []
    for block in facets:
        table = known.get(block.nodes.shape[1])
        if table is not None:
            table = table[near[table].all(axis=1)]
        out.append(Facets(block.kind, _looked_up(block.nodes, table, name, points)))
    return tuple(out)


def _node_table(block: Facets, name: str, points: Array) -> Index:
    nodes = integers(f"surface {name!r}", block.nodes)
    dim = points.shape[1]
    kinds = {size: kind for (d, size), kind in FACET_KIND.items() if d == dim}
    if nodes.ndim != 2 or kinds.get(nodes.shape[1]) != block.kind:
        raise InvalidInput(
            f"surface {name!r}: expected facets {', '.join(kinds.values())} in {dim}D, "
            f"got {block.kind!r} with nodes of shape {nodes.shape}"
        )
    if nodes.min() < 0 or nodes.max() >= len(points):
        raise InvalidInput(
            f"surface {name!r}: expected node numbers 0..{len(points) - 1}, "
            f"got {nodes.min()}..{nodes.max()}"
        )
    return nodes


def _looked_up(nodes: ArrayLike, known: Index | None, name: str, points: Array) -> Index:
    """Rows of `known` with the same nodes as the facets, each facet once."""
    wanted = np.unique(np.sort(nodes, axis=1), axis=0)
    if known is None:
        known = np.zeros((0, wanted.shape[1]), dtype=np.int64)
    both = np.concatenate([np.sort(known, axis=1), wanted])
    _, label = np.unique(both, axis=0, return_inverse=True)
    label = label.ravel()
    place = np.full(label.max(initial=-1) + 1, -1)
    place[label[: len(known)][::-1]] = np.arange(len(known))[::-1]  # the first cell wins
    row = place[label[len(known) :]]
    if (row < 0).any():
        where = points[wanted[np.flatnonzero(row < 0)[0]]].mean(axis=0)
        raise InvalidInput(f"surface {name!r}: the facet near {where} is no side of a cell")
    return read_only(known[row])
