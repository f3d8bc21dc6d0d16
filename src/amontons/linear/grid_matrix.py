"""The stiffness of a box of equal hexahedra on its free unknowns, as an operator."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .grid import GridBlocks
from .hierarchy import Hierarchy, Nodes
from .levels import Levels, fine_unknown, free_levels
from .rigid_modes import rigid_modes
from .transfer import Transfer

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class GridMatrix:
    """A symmetric matrix (n, n) that is never stored: products, some rows, multigrid levels.

    cells (nx, ny, nz) of the box; element (24, 24), nodes in VTK order; free (n,): the unknowns
    among all dofs, node by node with x fastest; levels: prolongations of nodal values; points
    (nodes, 3): where the nodes are.
    """

    dtype = np.dtype(float)
    ndim = 2

    def __init__(
        self,
        cells: tuple[int, int, int],
        element: Array,
        free: Index,
        levels: Levels,
        points: Array,
    ) -> None:
        count = int(np.prod([n + 1 for n in cells]))
        used = np.zeros(3 * count, dtype=np.uint8)
        used[free] = 1
        self.blocks = GridBlocks(cells, element, used.reshape(-1, 3))
        self.nodes, self.levels, self.points = Nodes(free, count), levels, points

    @property
    def shape(self) -> tuple[int, int]:
        """(n, n)."""
        n = len(self.nodes.place)
        return n, n

    def __matmul__(self, v: Array) -> Array:
        out = np.empty((self.nodes.count, 3))
        self.blocks.times(self.nodes.spread(v), out)
        return self.nodes.gather(out)

    def on(self, free: Index) -> GridMatrix:
        """The rows and columns of some of all dofs; this matrix has all of them."""
        blocks = self.blocks
        return GridMatrix(blocks.cells, blocks.element, free, self.levels, self.points)

    @property
    def rigid_modes(self) -> Array:
        """Translations and rotations on the unknowns, (n, 6), made anew at every call."""
        return rigid_modes(self.points)[self.nodes.place]

    def part(self, index: Index) -> sparse.csr_array:
        """Rows and columns of some unknowns, (k,) ascending."""
        place = self.nodes.place[index]
        node = np.unique(place // 3)
        rows = self.blocks.rows(node)
        n = 3 * self.nodes.count
        shape = (3 * len(node), n)
        whole = sparse.bsr_array((rows.data, rows.indices, rows.indptr), shape=shape).tocsr()
        local = 3 * np.searchsorted(node, place // 3) + place % 3
        return sparse.csr_array(whole[local][:, place])

    def diagonal(self) -> Array:
        """The diagonal, (n,)."""
        node = np.arange(self.nodes.count)
        blocks = self.blocks.stencils[:, :, :, 1, 1, 1][self.blocks.classes(node)]
        return np.einsum("kii->ki", blocks).ravel()[self.nodes.place]

    def tocsc(self) -> sparse.csc_array:
        """The stored matrix: 27 blocks a node."""
        rows = self.blocks.stored()
        n = 3 * self.nodes.count
        whole = sparse.bsr_array((rows.data, rows.indices, rows.indptr), shape=(n, n)).tocsr()
        out = sparse.csc_array(whole[self.nodes.place][:, self.nodes.place])
        out.sort_indices()
        return out

    def free_levels(self) -> Levels:
        """Prolongations of the free unknowns, finest first."""
        fixed = np.ones(3 * self.nodes.count, dtype=bool)
        fixed[self.nodes.place] = False
        return free_levels([self.levels], [self.nodes.count], 3, fixed)

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """Multigrid levels: the next one is the stiffness of cells of twice the size."""
        fixed = np.ones(3 * self.nodes.count, dtype=bool)
        fixed[self.nodes.place] = False
        transfers, cells = [], np.array(self.blocks.cells)
        for level in self.levels:
            coarse = fixed.reshape(-1, 3)[fine_unknown(level)].ravel()
            if coarse.all():
                break
            nx, ny, nz = (int(n) + 1 for n in cells)
            halved = level.shape[1] == np.prod(cells // 2 + 1) and not (cells % 2).any()
            idle = np.flatnonzero(fixed), np.flatnonzero(coarse)
            transfers.append(Transfer.nodal(level, *idle, (nz, ny, nx) if halved else None))
            fixed, cells = coarse, cells // 2
        return Hierarchy.on(self.blocks, self.nodes, transfers, None)
