"""Meshes of second order, made from those of first order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from .cells import CELLS, SECOND, SERENDIPITY
from .facets import Cells, Facets
from .mesh import Mesh

Index = NDArray[np.int64]
Parents = tuple[tuple[int, ...], ...]

INSIDE = 1e-9  # rounding of a sum of weights


def second_order(mesh: Mesh, *, serendipity: bool = False) -> Mesh:
    """The same mesh with nodes also in the middle of edges, quadrilaterals and hexahedra.

    serendipity: on edges only, as most codes have it: quad8, hex20 and wedge15.
    Sides stay straight.  The points of the mesh keep their numbers, the new ones follow.  The
    given mesh is the first of its coarser `levels`.  A mesh of second order is returned as it
    is.
    """
    if mesh.order == 2:
        return mesh
    seconds = SERENDIPITY if serendipity else SECOND
    for block in mesh.cells:
        if block.kind not in seconds:
            raise InvalidInput(
                f"order: expected 1 for a mesh with {block.kind} cells, got 2 (which exists "
                f"for {', '.join(kind for kind in seconds if kind != 'line')})"
            )
    blocks = [*mesh.cells, *(facets for group in mesh.surfaces.values() for facets in group)]
    parents = {first: CELLS[second].parents for first, second in seconds.items()}
    prolongation, tables = with_middles(len(mesh.points), blocks, parents)
    cells = tuple(
        Cells(seconds[b.kind], nodes, b.region, _kept(b.integration))
        for b, nodes in zip(mesh.cells, tables, strict=False)
    )
    rest = iter(tables[len(mesh.cells) :])
    surfaces = {
        name: tuple(Facets(seconds[facets.kind], next(rest)) for facets in group)
        for name, group in mesh.surfaces.items()
    }
    points = prolongation @ mesh.points
    return Mesh(points, cells, surfaces, name=mesh.name, levels=(prolongation, *mesh.levels),
                node_sets=carried(mesh.node_sets, prolongation),
                axisymmetric=mesh.axisymmetric)  # fmt: skip


def _kept(integration: str) -> str:
    """What cells of second order keep of it: others are integrated in ways of their own."""
    return integration if integration in ("full", "hybrid") else "auto"


def carried(sets: Mapping[str, Index], prolongation: sparse.csr_array) -> dict[str, Index]:
    """Node sets of a finer mesh: a middle belongs to one if all that it lies between do."""
    found = {}
    for name, nodes in sets.items():
        inside = np.zeros(prolongation.shape[1])
        inside[nodes] = 1.0
        found[name] = np.flatnonzero(prolongation @ inside > 1 - INSIDE)
    return found


def with_middles(
    count: int, blocks: list[Cells | Facets], parents: Mapping[str, Parents]
) -> tuple[sparse.csr_array, list[Index]]:
    """Number the middles of edges, quadrilaterals and hexahedra after `count` points.

    parents: of every kind, the corners that each of its middles lies between.  Returns the
    matrix (points with middles, count) that takes means over them, and the nodes of every block
    with its middles appended.
    """
    tables = [[block.nodes] for block in blocks]
    rows = [sparse.eye_array(count, format="csr")]
    total = count
    for size in (2, 4, 8):  # edges, quadrilaterals, hexahedra
        wanted = [
            (k, np.sort(block.nodes[:, ends], axis=1))
            for k, block in enumerate(blocks)
            for ends in parents[block.kind]
            if len(ends) == size
        ]
        if not wanted:
            continue
        keys, number = np.unique(
            np.concatenate([key for _, key in wanted]), axis=0, return_inverse=True
        )
        ends = np.cumsum([len(key) for _, key in wanted])[:-1]
        for (k, _), mine in zip(wanted, np.split(number.ravel() + total, ends), strict=True):
            tables[k].append(mine[:, None])
        start = np.arange(0, keys.size + 1, size)
        mean = (np.full(keys.size, 1 / size), keys.ravel(), start)
        rows.append(sparse.csr_array(mean, shape=(len(keys), count)))
        total += len(keys)
    means = sparse.csr_array(sparse.vstack(rows, format="csr"))
    return means, [np.hstack(parts) for parts in tables]
