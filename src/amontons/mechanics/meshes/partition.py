"""Meshes in parts: nodes cut into compact groups, and the cells that touch a group.

The points are bisected again and again along the longest side of their box, which needs no
graph, no library, and n log(parts) operations.  Parts have equally many nodes, to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from .mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


def partition(points: Array, parts: int) -> Index:
    """The part of every point (n, dim), 0 to parts - 1, (n,).

    Equal points, as of two sides in contact, may be in different parts.  Raises InvalidInput
    for fewer points than parts.
    """
    if len(points) < parts:
        raise InvalidInput(
            f"mesh: {len(points)} nodes do not give {parts} parts; use fewer processes"
        )
    out = np.zeros(len(points), dtype=np.int64)
    _bisect(points, np.arange(len(points)), 0, parts, out)
    return out


def _bisect(points: Array, index: Index, first: int, parts: int, out: Index) -> None:
    """Give the points `index` to the parts from `first` on, in place of out (n,)."""
    if parts == 1:
        out[index] = first
        return
    x = points[index]
    along = x[:, int(np.argmax(np.ptp(x, axis=0)))]
    left = parts // 2
    count = len(index) * left // parts
    order = np.argsort(along, kind="stable")  # ties by number: the same cut everywhere
    _bisect(points, np.sort(index[order[:count]]), first, left, out)
    _bisect(points, np.sort(index[order[count:]]), first + left, parts - left, out)


def touching(mesh: Mesh, mine: Mask) -> tuple[Mesh | None, Index]:
    """The cells of a mesh with a node in mine (n,), as `part_of` gives them."""
    return part_of(mesh, [np.any(mine[block.nodes], axis=1) for block in mesh.cells])


def part_of(mesh: Mesh, wanted: Sequence[Mask]) -> tuple[Mesh | None, Index]:
    """Some cells of a mesh, (cells,) of every block, without surfaces, and the nodes they use.

    None where there are none.  Nodes (k,) are numbers in the whole mesh, ascending.
    """
    blocks = [
        replace(block, nodes=block.nodes[some])
        for block, some in zip(mesh.cells, wanted, strict=True)
        if some.any()
    ]
    if not blocks:
        return None, np.zeros(0, dtype=np.int64)
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in blocks:
        used[block.nodes] = True
    place = np.cumsum(used) - 1
    cells = tuple(replace(b, nodes=place[b.nodes]) for b in blocks)
    return Mesh(mesh.points[used], cells, axisymmetric=mesh.axisymmetric), np.flatnonzero(used)
