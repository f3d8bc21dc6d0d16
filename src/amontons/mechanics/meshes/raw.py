"""What a mesh file holds, and the step from there to one of our meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError, InvalidInput
from .cells import CELLS
from .facets import Cells, Facets, boundary
from .mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FLAT = 1e-12  # spread in z, relative to the size, below which a mesh counts as plane


@dataclass(frozen=True, eq=False)
class RawBlock:
    """Elements of one kind with the same group names: nodes (k, nodes per element)."""

    kind: str
    nodes: Index
    groups: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Points (n, 3), elements of all dimensions, named sets of nodes."""

    points: Array
    blocks: list[RawBlock]
    node_sets: Mapping[str, Index] = field(default_factory=dict)


def to_mesh(raw: RawMesh, path: str) -> Mesh:
    """Cells of the highest dimension become regions, those one lower surfaces, by group name.

    A cell in several groups takes the smallest; a cell in none is in region "default".  Points
    without cells are dropped.  Errors name the file.
    """
    dim, points = _dimension(raw, path)
    named = [b for b in raw.blocks if len(b.nodes)]
    high = [b.nodes.max() for b in named]
    if named and (max(high) >= len(points) or min(b.nodes.min() for b in named) < 0):
        raise FileFormatError(f"{path}: an element names a node that the file does not define")
    cells = _cells([b for b in named if _dim(b.kind) == dim])
    used = np.unique(np.concatenate([c.nodes.ravel() for c in cells]))
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    cells = tuple(replace(c, nodes=number[c.nodes]) for c in cells)
    surfaces = _surfaces([b for b in named if _dim(b.kind) == dim - 1], number, path)
    for name, nodes in raw.node_sets.items():
        facets = _spanned(cells, number[nodes], len(used))
        if name not in surfaces and facets:
            surfaces[name] = facets
    try:
        return Mesh(points[used], cells, surfaces, name=path)
    except InvalidInput as error:
        raise FileFormatError(f"{path}: {error}") from error


def _dim(kind: str) -> int:
    return CELLS[kind].dim if kind in CELLS else 0


def _dimension(raw: RawMesh, path: str) -> tuple[int, Array]:
    """(2, points without z) for plane meshes, (3, points) where there are solid cells."""
    kinds = {b.kind for b in raw.blocks if len(b.nodes)}
    known = {*CELLS, "vertex"}
    if kinds - known:
        raise FileFormatError(
            f"{path}: expected elements {', '.join(sorted(known))}, got "
            f"{', '.join(sorted(kinds - known))}; in gmsh set Mesh.ElementOrder = 1, or with "
            "wedges and ElementOrder = 2 also Mesh.SecondOrderIncomplete = 1"
        )
    top = max((_dim(kind) for kind in kinds), default=0)
    if top < 2:
        raise FileFormatError(f"{path}: expected cells of a solid in 2D or 3D, got none")
    points = np.asarray(raw.points, dtype=float)
    if not np.isfinite(points).all():
        raise FileFormatError(f"{path}: a node has a coordinate that is not finite")
    if top == 3:
        return 3, points
    size = np.ptp(points, axis=0).max(initial=0.0)
    if np.ptp(points[:, 2]) > FLAT * size:
        raise FileFormatError(
            f"{path}: expected solid cells, or a mesh in a plane of constant z; "
            "got a curved surface only"
        )
    return 2, points[:, :2].copy()


def _cells(blocks: list[RawBlock]) -> tuple[Cells, ...]:
    """Cells with one region each, and once each: gmsh 2.2 repeats cells in several groups."""
    size: dict[str, int] = {}
    for block in blocks:
        for name in block.groups:
            size[name] = size.get(name, 0) + len(block.nodes)
    entries = [
        (min(block.groups, key=lambda name: size[name], default=""), block) for block in blocks
    ]
    out = []
    for kind in dict.fromkeys(block.kind for block in blocks):
        mine = [(name, b.nodes) for name, b in entries if b.kind == kind]
        nodes = np.concatenate([n for _, n in mine])
        names = [name for name, n in mine for _ in range(len(n))]
        rank = np.array([size.get(name, len(names) + 1) for name in names])
        order = np.argsort(rank, kind="stable")
        _, first = np.unique(np.sort(nodes[order], axis=1), axis=0, return_index=True)
        keep = np.sort(order[first])
        labels = np.array(names, dtype=object)[keep]
        for name in dict.fromkeys(labels):
            out.append(Cells(kind, nodes[keep][labels == name], name or "default"))
    return tuple(out)


def _surfaces(blocks: list[RawBlock], number: Index, path: str) -> dict:
    found: dict[str, list[Facets]] = {}
    for block in blocks:
        nodes = number[block.nodes]
        for name in block.groups:
            if (nodes < 0).any():
                raise FileFormatError(
                    f"{path}: surface {name!r} has nodes that belong to no cell of a region"
                )
            found.setdefault(name, []).append(Facets(block.kind, nodes))
    return {name: _merged(parts) for name, parts in found.items()}


def _merged(parts: list[Facets]) -> tuple[Facets, ...]:
    kinds = dict.fromkeys(part.kind for part in parts)
    return tuple(
        Facets(kind, np.concatenate([p.nodes for p in parts if p.kind == kind]))
        for kind in kinds
    )


def _spanned(cells: tuple[Cells, ...], nodes: Index, count: int) -> tuple[Facets, ...]:
    """Boundary facets all of whose nodes are in a set of nodes."""
    inside = np.zeros(count, dtype=bool)
    inside[nodes[nodes >= 0]] = True
    blocks = [Facets(b.kind, b.nodes[inside[b.nodes].all(axis=1)]) for b in boundary(cells)]
    return tuple(b for b in blocks if len(b.nodes))
