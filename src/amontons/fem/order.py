"""Meshes of second order, made from those of first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidInput
from .cells import CELLS, SECOND
from .facets import Cells, Facets
from .mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def second_order(mesh: Mesh) -> Mesh:
    """The same mesh with nodes also in the middle of edges, quadrilaterals and hexahedra.

    Sides stay straight.  The points of the mesh keep their numbers, the new ones follow.  A
    mesh of second order is returned as it is.
    """
    if mesh.order == 2:
        return mesh
    for block in mesh.cells:
        if block.kind not in SECOND:
            raise InvalidInput(
                f"order: expected 1 for a mesh with {block.kind} cells, got 2 (which exists "
                f"for {', '.join(kind for kind in SECOND if kind != 'line')})"
            )
    blocks = [*mesh.cells, *(facets for group in mesh.surfaces.values() for facets in group)]
    points, tables = _with_middles(mesh.points, blocks)
    cells = tuple(
        Cells(SECOND[b.kind], nodes, b.region)
        for b, nodes in zip(mesh.cells, tables, strict=False)
    )
    rest = iter(tables[len(mesh.cells) :])
    surfaces = {
        name: tuple(Facets(SECOND[facets.kind], next(rest)) for facets in group)
        for name, group in mesh.surfaces.items()
    }
    return Mesh(points, cells, surfaces, name=mesh.name)


def _with_middles(points: Array, blocks: list[Cells | Facets]) -> tuple[Array, list[Index]]:
    """Points with the middles appended, and the nodes of every block with them."""
    tables = [[block.nodes] for block in blocks]
    all_points = [points]
    count = len(points)
    for size in (2, 4, 8):  # edges, quadrilaterals, hexahedra
        wanted = [
            (k, np.sort(block.nodes[:, parents], axis=1))
            for k, block in enumerate(blocks)
            for parents in CELLS[SECOND[block.kind]].parents
            if len(parents) == size
        ]
        if not wanted:
            continue
        keys, number = np.unique(
            np.concatenate([key for _, key in wanted]), axis=0, return_inverse=True
        )
        ends = np.cumsum([len(key) for _, key in wanted])[:-1]
        for (k, _), mine in zip(wanted, np.split(number.ravel() + count, ends), strict=True):
            tables[k].append(mine[:, None])
        all_points.append(points[keys].mean(axis=1))
        count += len(keys)
    return np.concatenate(all_points), [np.hstack(parts) for parts in tables]
