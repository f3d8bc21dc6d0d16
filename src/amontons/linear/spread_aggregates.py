"""The first coarse level of a spread matrix: aggregates of own nodes, and P' A P without A P.

As in `aggregation`, P = (I - omega D^-1 A) T, with T the near-null motions cut up by aggregate;
here no aggregate has nodes of two processes, and a block of P is that of a node and of all w
motions of an aggregate, (3, w).  The product is made row by row: of A P there is never more
than one row, where other ways need as much memory as for A.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .aggregation import MISSED, OMEGA, STEPS, strong_graph
from .borders import Borders, Rows, rows_of_ghosts, starts_of
from .spread_loops import add, add_blocks, restrict, smooth, triple, units_of_rows
from .spread_rows import SpreadRows

Array = NDArray[np.float64]
Index = NDArray[np.integer]
SLAB = 20_000  # nodes whose couplings of aggregates are found at a time
LONE = 1e-12  # of the largest: a coarse unknown with less on the diagonal is none


@dataclass(frozen=True, eq=False)
class SpreadTransfer:
    """P of own nodes and of ghosts.

    pointers, units (local numbers of aggregates, those of ghosts behind own ones) and blocks
    (k, 3, w) of the rows of all local nodes; numbers (u,): of units in those of all;
    borders: of the units that own rows have; modes (own units w, w): near-null motions below.
    """

    rows: SpreadRows
    pointers: Index
    units: Index
    blocks: Array
    own: int
    numbers: Index
    starts: Index
    borders: Borders
    modes: Array

    @property
    def width(self) -> int:
        """Motions of an aggregate."""
        return int(self.blocks.shape[2])

    @property
    def seen(self) -> int:
        """Units that own rows have: own ones and some of others."""
        return (self.borders.own + self.borders.count) // self.width

    def restrict(self, fine: Array) -> Array:
        """P' of values at own nodes (own, 3), at own units (own units w,)."""
        out = np.zeros((self.seen, self.width))
        restrict(self.rows.own, self.pointers, self.units, self.blocks, fine, out)
        self.borders.give(out)
        return out[: self.own].reshape(-1)

    def add(self, coarse: Array, fine: Array) -> None:
        """fine (own, 3) += P of values at own units (own units w,)."""
        x = np.zeros((self.seen, self.width))
        x[: self.own] = coarse.reshape(-1, self.width)
        self.borders.fetch(x)
        add(self.rows.own, self.pointers, self.units, self.blocks, x, fine)

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        self.borders.destroy()


def transfer_to_aggregates(
    rows: SpreadRows, modes: Array, together: int = 1
) -> SpreadTransfer | None:
    """P of a matrix as it is now; modes (own d, w): near-null motions.  None without any.

    together: nodes that follow one another and stay together, as those of an aggregate do.
    """
    from pyamg.aggregation import fit_candidates, standard_aggregation

    comm, given = rows.comm, modes.shape[1]
    width = given + -given % 3  # of aggregates too nodes have three unknowns
    unit, count, joined = np.full(rows.own // together, -1), 0, None
    if len(unit):
        joined, _ = standard_aggregation(_couplings_inside(rows, together))
        unit[np.diff(joined.indptr) > 0] = joined.indices
        count = int(joined.shape[1]) if joined.nnz else 0
    unit = np.repeat(unit, together)
    padded = np.zeros((rows.own, 3, width))
    padded[:, : rows.d, :given] = modes.reshape(rows.own, rows.d, given)
    starts = starts_of(comm, count)
    if not starts[-1]:
        return None
    T, coarse = np.zeros((rows.own, 3, width)), np.zeros((0, width))
    if joined is not None and count:
        pieces, coarse = fit_candidates(joined, padded.reshape(-1, width))
        T[unit >= 0] = sparse.bsr_array(pieces).data.reshape(-1, 3, width)
    whose = np.full(rows.local, -1.0)
    whose[: rows.own] = np.where(unit >= 0, unit + starts[comm.rank], -1)
    T = np.concatenate([T, np.zeros((len(rows.ghosts), 3, width))])
    for values in (whose, T):
        around = Borders(comm, rows.own, rows.ghosts, values[0].size)
        around.fetch(values)
        around.destroy()
    omega = OMEGA / (MISSED * largest(rows))
    mine = _smoothed(rows, T, whose.astype(np.int64), omega)
    return _transfer(rows, mine, starts, np.asarray(coarse))


def _couplings_inside(rows: SpreadRows, together: int) -> sparse.csr_array:
    """The graph of own nodes, so many together, without weak couplings and zeros."""
    t, count = rows.tiles, rows.own // together
    squares = np.einsum("kij,kij->k", t.data, t.data)
    row = np.repeat(np.arange(rows.own, dtype=np.int32), np.diff(t.indptr)) // together
    column = t.indices // together
    some = (column < count) & (column != row) & (squares > 0)
    row, column, squares = row[some], column[some], squares[some]
    if together > 1:
        sums = sparse.coo_array((squares, (row, column)), shape=(count, count)).tocsr().tocoo()
        (row, column), squares = sums.coords, sums.data
    most = np.zeros(count)
    np.maximum.at(most, row, squares)
    return strong_graph(row, column, squares, most)


def _transfer(rows: SpreadRows, mine: Rows, starts: Index, modes: Array) -> SpreadTransfer:
    """P with the rows of ghosts, its units in local numbers."""
    comm = rows.comm
    first, last = starts[comm.rank : comm.rank + 2]
    theirs = rows_of_ghosts(comm, rows.starts, rows.ghosts, mine)

    def others(units: Index) -> Index:
        return np.unique(units[(units < first) | (units >= last)])

    seen = others(mine.columns)
    more = np.setdiff1d(others(theirs.columns), seen)
    numbers = np.concatenate([np.arange(first, last), seen, more])
    pointers = np.concatenate([mine.pointers, mine.pointers[-1] + theirs.pointers[1:]])
    units = _local(numbers, np.concatenate([mine.columns, theirs.columns]))
    blocks = mine.blocks
    if len(rows.ghosts):
        blocks.resize((len(units), *blocks.shape[1:]), refcheck=False)  # without a second copy
        blocks[mine.pointers[-1] :] = theirs.blocks
    seen_by_own = Borders(comm, int(last - first), seen, blocks.shape[2])
    return SpreadTransfer(
        rows, pointers, units, blocks, int(last - first), numbers, starts, seen_by_own, modes
    )


def _local(numbers: Index, columns: Index) -> NDArray[np.int32]:
    """Places of columns in numbers, which need not be ascending."""
    order = np.argsort(numbers)
    return order[np.searchsorted(numbers[order], columns)].astype(np.int32)


def largest(rows: SpreadRows) -> float:
    """The size of D^-1 A, D the diagonal blocks, by power iterations."""
    comm, d = rows.comm, rows.d
    x = np.cos(np.arange(float(d * rows.own)) + d * rows.starts[comm.rank])
    inverse, size, rho = rows.tiles.inverse[:, :d, :d], 0.0, 1.0
    size = np.sqrt(comm.allreduce(float(x @ x)))
    for _ in range(STEPS):
        y = rows.times(x / size).reshape(-1, d)
        x = np.einsum("kij,kj->ki", inverse, y).ravel()
        size = np.sqrt(comm.allreduce(float(x @ x)))
        if not 0 < size < np.inf:
            return 1.0
        rho = size
    return float(rho)


def _smoothed(rows: SpreadRows, T: Array, whose: Index, omega: float) -> Rows:
    """Own rows of (I - omega D^-1 A) T, T with a block (3, w) of unit `whose` a node, or -1."""
    t = rows.tiles
    known, unit = np.unique(whose, return_inverse=True)
    unit = unit.astype(np.int64) - np.count_nonzero(known < 0)
    pointers = units_of_rows(t.indptr, t.indices, unit, len(known))
    units = np.empty(pointers[-1], dtype=np.int32)
    blocks = np.zeros((pointers[-1], 3, T.shape[2]))
    smooth(t.indptr, t.indices, t.data, t.inverse, T, unit, omega, len(known), pointers,
           units, blocks)  # fmt: skip
    return Rows(pointers, known[known >= 0][units], blocks)


class CoarseProduct:
    """P' A P for block rows of own nodes (k,) in one pattern, whatever their entries are.

    indptr, indices: of these rows of A, columns local nodes.
    """

    def __init__(self, P: SpreadTransfer, nodes: Index, indptr: Index, indices: Index) -> None:
        self.P, self.nodes = P, nodes
        self.indptr, self.indices = indptr.astype(np.int64), indices
        mine = _pattern(P, nodes, indptr, indices)
        entries = mine.tocoo()
        theirs = _sent(P, Rows(mine.indptr, P.numbers[mine.indices], np.zeros(mine.nnz)))
        numbers = [P.numbers, *(rows.columns for _, rows in theirs)]
        self.known = np.unique(np.concatenate(numbers))
        self.column = np.searchsorted(self.known, P.numbers).astype(np.int32)
        where = [(entries.coords[0], self.column[entries.coords[1]])]
        where += [(self._rows(*part), self._columns(part[1])) for part in theirs]
        row, column = (np.concatenate(part) for part in zip(*where, strict=True))
        ones = np.ones(len(row), dtype=np.float32)
        shape = len(P.numbers), len(self.known)
        pattern = sparse.coo_array((ones, (row, column)), shape=shape).tocsr()
        pattern.sort_indices()
        self.pointers = pattern.indptr.astype(np.int64)  # of one type, for compiled loops
        self.columns = pattern.indices.astype(np.int32)

    def _rows(self, numbers: Index, rows: Rows) -> Index:
        return np.repeat(numbers - self.P.starts[self.P.rows.comm.rank], np.diff(rows.pointers))

    def _columns(self, rows: Rows) -> Index:
        return np.searchsorted(self.known, rows.columns)

    def of(self, data: Array) -> sparse.bsr_array:
        """Own rows (own units w, n), columns in the numbers of all units; data (nnz, 3, 3)."""
        P, pointers, width = self.P, self.pointers, self.P.width
        values = np.zeros((len(self.columns), width, width))
        triple(self.nodes, self.indptr, self.indices, data, P.pointers, P.units, P.blocks,
               self.column[P.units], len(self.known), pointers, self.columns,
               values)  # fmt: skip
        columns = self.known[self.columns]
        for numbers, rows in _sent(P, Rows(pointers, columns, values)):
            add_blocks(self._rows(numbers, rows), self._columns(rows), rows.blocks, pointers,
                       self.columns, values)  # fmt: skip
        end = pointers[P.own]
        shape = width * P.own, width * int(P.starts[-1])
        own = values[:end], columns[:end], pointers[: P.own + 1]
        return sparse.bsr_array(own, shape=shape)


def _pattern(
    P: SpreadTransfer, nodes: Index, indptr: Index, indices: Index
) -> sparse.csr_array:
    """Which units some rows of A couple, (units, units), local numbers."""
    count = len(P.numbers)
    ones = np.ones(len(P.units), dtype=np.float32)
    motions = sparse.csr_array((ones, P.units, P.pointers), shape=(P.rows.local, count))
    out = sparse.csr_array((count, count), dtype=np.float32)
    for begin in range(0, len(nodes), SLAB):
        pointers = indptr[begin : begin + SLAB + 1]
        columns = indices[pointers[0] : pointers[-1]]
        some = np.ones(len(columns), dtype=np.float32), columns, pointers - pointers[0]
        near = sparse.csr_array(some, shape=(len(pointers) - 1, P.rows.local))
        rows = motions[nodes[begin : begin + SLAB]]
        out = sparse.csr_array(out + rows.T @ (near @ motions))
        out.data[:] = 1.0  # no sum of such can be lost
    return out


def _sent(P: SpreadTransfer, rows: Rows) -> list[tuple[Index, Rows]]:
    """What others have for own units, their numbers and rows, of rows of all local units."""
    comm = P.rows.comm
    owner = np.searchsorted(P.starts, P.numbers, side="right") - 1
    owner[: P.own] = -1
    units = [np.flatnonzero(owner == rank) for rank in range(comm.size)]
    parts = comm.alltoall([(P.numbers[some], rows.of(some)) for some in units])
    return [part for part in parts if len(part[0])]


def let_lone_rest(comm: Any, rows: sparse.bsr_array, first: int) -> None:
    """Motions that an aggregate of few nodes lacks get a diagonal; their rows are zero.

    rows: of a coarse matrix, whose first own unit has this number.
    """
    number = np.repeat(np.arange(len(rows.indptr) - 1), np.diff(rows.indptr))
    diagonal = np.flatnonzero(number == rows.indices - first)
    own = np.einsum("kii->ki", rows.data[diagonal])
    most = max(comm.allgather(float(own.max(initial=0.0)))) or 1.0
    lacking = np.where(own <= LONE * most, most, 0.0)
    rows.data[diagonal] += np.eye(rows.data.shape[1]) * lacking[:, None, :]
