"""The rows of one process of a matrix that is spread over many: blocks, and what works on them.

Rows and columns are nodes with three unknowns, as in `node_blocks`, whose kernels work on them;
a node in 2D has an idle third one.  Columns have local numbers: own nodes first, then *ghosts*,
nodes of other processes.  Sweeps of Gauss-Seidel leave ghosts as they were before, with the
diagonal made larger at borders, so that the sweeps of all processes together do not diverge
[BFKY].

[BFKY] A. Baker, R. Falgout, T. Kolev, U. Meier Yang, "Multigrid smoothers for ultraparallel
computing", SIAM J. Sci. Comput. 33 (2011).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.threads import over_rows
from .borders import Borders, starts_of
from .node_blocks import NodeBlocks, block_inverse, product, residual, sweep

Array = NDArray[np.float64]
Index = NDArray[np.integer]
HALF = 0.5  # of |entries| beyond borders, which the diagonal gets there


class SpreadRows:
    """Own block rows of a matrix.

    tiles: their blocks, with the inverses of those on the diagonal; d: unknowns of a node;
    own, ghosts (g,): number of own nodes, others' numbers in those of all; starts: see
    `starts_of`.
    """

    def __init__(self, comm: Any, rows: sparse.bsr_array, d: int) -> None:
        self.comm, self.d, self.own = comm, d, rows.shape[0] // d  # type: ignore[index]
        self.starts = starts_of(comm, self.own)
        first, last = self.starts[comm.rank : comm.rank + 2]
        columns = rows.indices
        outside = (columns < first) | (columns >= last)
        self.ghosts = np.unique(columns[outside])
        local = (columns - first).astype(np.int32)
        local[outside] = self.own + np.searchsorted(self.ghosts, columns[outside])
        blocks = rows.data
        if d < 3:
            blocks = np.zeros((len(columns), 3, 3))
            blocks[:, :d, :d] = rows.data
            diagonal = local == np.repeat(np.arange(self.own), np.diff(rows.indptr))
            blocks[diagonal, d:, d:] = np.eye(3 - d)
        self.tiles = NodeBlocks.of(rows.indptr, local, blocks)
        self.size = np.abs(self.tiles.diagonal_blocks).max(axis=(1, 2), initial=0.0)
        self._beyond = self._couplings_with_ghosts()
        self._invert(np.flatnonzero(self._beyond.any(axis=1)))
        self.borders = Borders(comm, self.own, self.ghosts, 3)
        self._none_held = np.zeros(self.own, dtype=bool)
        self._x = self.vector()

    @property
    def local(self) -> int:
        """Nodes of which there are values: own ones and ghosts."""
        return self.own + len(self.ghosts)

    def vector(self) -> Array:
        """Zeros at own nodes and ghosts, (local, 3)."""
        return np.zeros((self.local, 3))

    def put(self, values: Array, out: Array) -> None:
        """Values of own unknowns (own d,) into a vector of nodes, ghosts left out."""
        out[: self.own, : self.d] = values.reshape(-1, self.d)

    def taken(self, x: Array) -> Array:
        """The values of own unknowns (own d,) of a vector of nodes."""
        return x[: self.own, : self.d].reshape(-1).copy()

    def at_local(self, values: Array) -> Array:
        """Values of own unknowns (own d,) at those of ghosts too, (local d,)."""
        x = self.vector()
        self.put(values, x)
        self.borders.fetch(x)
        return x[:, : self.d].reshape(-1)

    def times(self, values: Array) -> Array:
        """A times values of own unknowns (own d,)."""
        self.put(values, self._x)
        self.borders.fetch(self._x)
        out = np.empty((self.own, 3))
        t = self.tiles
        over_rows(product, self.own, t.work, t.indptr, t.indices, t.data, self._x, out)
        return self.taken(out)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x of a vector whose ghosts are up to date."""
        t = self.tiles
        over_rows(residual, self.own, t.work, t.indptr, t.indices, t.data, x, b, out)

    def sweep(self, b: Array, x: Array, *, backward: bool) -> None:
        """A sweep over own nodes, of a vector whose ghosts are up to date, or zero."""
        t = self.tiles
        sweep(0, self.own, t.indptr, t.indices, t.data, t.inverse, b, x, self._none_held,
              backward)  # fmt: skip

    def slots(self, unknowns: Index) -> tuple[Index, Index, Index]:
        """Where the entries of own rows (k,) stand: pointers (k + 1,), columns, flat places.

        Columns are local unknowns; places those in `tiles.data`, flat.
        """
        d, node = self.d, unknowns // self.d
        blocks, ends = self.tiles.slots(node)
        inside = np.arange(d)
        columns = (self.tiles.indices[blocks][:, None] * d + inside).ravel()
        component = np.repeat(unknowns % d, np.diff(ends))
        places = ((9 * blocks + 3 * component)[:, None] + inside).ravel()
        return d * ends, columns, places

    def write(self, places: Index, values: Array, nodes: Index) -> None:
        """Other entries at flat places, all in the rows of some nodes."""
        self.tiles.data.reshape(-1)[places] = values
        self._invert(nodes)

    def add(self, blocks: Index, change: Array, nodes: Index) -> None:
        """Add to blocks (k,), all in the rows of some nodes, (k, 3, 3)."""
        self.tiles.data[blocks] += change
        self._invert(nodes)

    def _couplings_with_ghosts(self) -> Array:
        """HALF the sums of |entries| of own rows in columns of ghosts, (own, 3)."""
        t = self.tiles
        out = np.zeros((self.own, 3))
        there = np.flatnonzero(t.indices >= self.own)
        row = np.searchsorted(t.indptr, there, side="right") - 1
        np.add.at(out, row, HALF * np.abs(t.data[there]).sum(axis=2))
        return out

    def _invert(self, nodes: Index) -> None:
        """The inverses that sweeps take at some nodes: of larger diagonals at borders."""
        blocks, ends = self.tiles.slots(nodes)
        rows = np.repeat(nodes, np.diff(ends))
        diagonal = self.tiles.data[blocks[self.tiles.indices[blocks] == rows]]
        diagonal[:, np.arange(3), np.arange(3)] += self._beyond[nodes]
        self.tiles.inverse[nodes] = block_inverse(diagonal, self.size[nodes])

    def diagonal(self) -> Array:
        """Of own unknowns, (own d,)."""
        own = np.einsum("kii->ki", self.tiles.diagonal_blocks)
        return own[:, : self.d].reshape(-1).copy()

    def numbers(self) -> Index:
        """The numbers of local nodes in those of all, (local,)."""
        first = int(self.starts[self.comm.rank])
        return np.concatenate([np.arange(first, first + self.own), self.ghosts])

    def whole(self) -> sparse.bsr_array:
        """The rows as they are now, (own d, n), columns in the numbers of all."""
        d, t = self.d, self.tiles
        shape = d * self.own, d * int(self.starts[-1])
        columns = self.numbers()[t.indices]
        return sparse.bsr_array((t.data[:, :d, :d], columns, t.indptr), shape=shape)

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        self.borders.destroy()
