"""Meshes in parts: nodes cut into compact groups, and the cells that touch a group.

The points are bisected again and again along the longest side of their box, which needs no
graph, no library, and n log(parts) operations.  Parts have equally many nodes, to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only
from ...core.compiled import njit
from ...core.errors import InvalidInput
from .mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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


def sorted_by(owner: Index, parts: int) -> tuple[Index, Index]:
    """Numbers (n,) in the order of their part, and where each part starts, (parts + 1,)."""
    sizes = np.bincount(owner, minlength=parts)
    return np.argsort(owner, kind="stable"), np.concatenate([[0], np.cumsum(sizes)])


class Cut:
    """A mesh whose nodes belong to parts, owner (n,); cells sorted by the parts they touch."""

    def __init__(self, mesh: Mesh, owner: Index, parts: int) -> None:
        self.mesh = mesh
        self.cells = [cells_of_parts(block.nodes, owner, parts) for block in mesh.cells]
        self._number = np.full(len(mesh.points), -1)

    def part(self, number: int) -> tuple[Mesh | None, Index]:
        """The cells with a node of a part, as a mesh without surfaces, and its nodes.

        None where there are none.  Nodes (k,) are numbers in the whole mesh, ascending.
        """
        some = [cells[starts[number] : starts[number + 1]] for cells, starts in self.cells]
        return part_of(self.mesh, some, self._number)


def part_of(
    mesh: Mesh, wanted: Sequence[Index], number: Index | None = None
) -> tuple[Mesh | None, Index]:
    """Some cells of a mesh, numbers (k,) in every block, as `Cut.part` gives them.

    number (n,): of -1, which it has again afterwards; for many parts of one mesh.
    """
    blocks = [
        replace(block, nodes=block.nodes[some])
        for block, some in zip(mesh.cells, wanted, strict=True)
        if len(some)
    ]
    if not blocks:
        return None, np.zeros(0, dtype=np.int64)
    number = np.full(len(mesh.points), -1) if number is None else number
    used = np.sort(np.concatenate([first_uses(block.nodes, number) for block in blocks]))
    number[used] = np.arange(len(used))
    cells = tuple(replace(b, nodes=read_only(number[b.nodes])) for b in blocks)
    number[used] = -1
    return Mesh.of_checked(mesh.points[used], cells, axisymmetric=mesh.axisymmetric), used


@njit(cache=True)
def cells_of_parts(nodes: Index, owner: Index, parts: int) -> tuple[Index, Index]:
    """Cells (k, m) that touch each part, part after part, and where it starts, (parts + 1,)."""
    starts = np.zeros(parts + 1, np.int64)
    cells = np.empty(0, np.int64)
    for fill in range(2):
        used = starts[:-1].copy()
        for cell in range(len(nodes)):
            for k in range(nodes.shape[1]):
                part = owner[nodes[cell, k]]
                seen = False
                for other in range(k):
                    seen = seen or owner[nodes[cell, other]] == part
                if seen:
                    continue
                if fill:
                    cells[used[part]] = cell
                    used[part] += 1
                else:
                    starts[part + 1] += 1
        if not fill:
            starts = np.cumsum(starts)
            cells = np.empty(starts[-1], np.int64)
    return cells, starts


@njit(cache=True)
def first_uses(nodes: Index, number: Index) -> Index:
    """Nodes of cells (k, m) where number (n,) is negative; it is 0 there afterwards."""
    out = np.empty(nodes.size, np.int64)
    count = 0
    for cell in range(len(nodes)):
        for k in range(nodes.shape[1]):
            node = nodes[cell, k]
            if number[node] < 0:
                number[node] = 0
                out[count] = node
                count += 1
    return out[:count].copy()
