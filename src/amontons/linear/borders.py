"""What processes of MPI know of each other's nodes: values and rows beside their own.

A node of another process that an own row couples with is a *ghost*.  Values there come by
PETSc's scatters, once a product; rows of matrices by one exchange of all with all, at set-up.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .node_blocks import slots_of_rows
from .petsc import petsc

Array = NDArray[np.float64]
Index = NDArray[np.integer]


class Borders:
    """Values, `size` of a node, at own nodes and at ghosts.

    own: number of own nodes; ghosts (g,): ascending, in the numbers of all, where processes
    follow one another.
    """

    def __init__(self, comm: Any, own: int, ghosts: Index, size: int) -> None:
        PETSc = petsc()
        self.own, self.size, self.count = own * size, size, len(ghosts) * size
        self.alone = comm.size == 1
        self._mine = PETSc.Vec().createMPI((self.own, None), bsize=size, comm=comm)
        self._theirs = PETSc.Vec().createSeq(self.count)
        wanted = PETSc.IS().createBlock(size, ghosts.astype(PETSc.IntType), comm=comm)
        self._scatter = PETSc.Scatter().create(self._mine, wanted, self._theirs, None)
        wanted.destroy()

    def fetch(self, values: Array) -> None:
        """Put those of ghosts behind own ones, in values (own + g, ...)."""
        if self.alone:
            return
        with self._placed(values):
            self._scatter.scatter(self._mine, self._theirs, mode=petsc().ScatterMode.FORWARD)

    def give(self, values: Array) -> None:
        """Add those at ghosts, of values (own + g, ...), to those of the process that owns."""
        if self.alone:
            return
        PETSc = petsc()
        with self._placed(values):
            self._scatter.scatter(
                self._theirs, self._mine, addv=PETSc.InsertMode.ADD_VALUES,
                mode=PETSc.ScatterMode.REVERSE,
            )  # fmt: skip

    @contextmanager
    def _placed(self, values: Array) -> Iterator[None]:
        """Let PETSc's vectors live in values (own + g, ...), without copies."""
        flat = values.reshape(-1)
        self._mine.placeArray(flat[: self.own])
        self._theirs.placeArray(flat[self.own :])
        yield
        for part in (self._mine, self._theirs):
            part.resetArray()

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        for part in (self._scatter, self._mine, self._theirs):
            part.destroy()


@dataclass(frozen=True)
class Rows:
    """Block rows: pointers (n + 1,), columns (k,) in the numbers of all, blocks (k, ...)."""

    pointers: Index
    columns: Index
    blocks: Array

    def of(self, rows: Index) -> Rows:
        """Some of them, (m,)."""
        slots, ends = slots_of_rows(self.pointers, rows)
        return Rows(ends, self.columns[slots], self.blocks[slots])

    @classmethod
    def under_each_other(cls, parts: list[Rows]) -> Rows:
        """All rows of some, in their order."""
        counts = np.concatenate([np.diff(part.pointers) for part in parts])
        return cls(
            np.concatenate([[0], np.cumsum(counts)]),
            np.concatenate([part.columns for part in parts]),
            np.concatenate([part.blocks for part in parts]),
        )


def starts_of(comm: Any, own: int) -> Index:
    """First number of every process, and the number of all, (processes + 1,)."""
    return np.concatenate([[0], np.cumsum(comm.allgather(own))])


def rows_of_ghosts(comm: Any, starts: Index, ghosts: Index, mine: Rows) -> Rows:
    """The rows of ghosts (g,), which are ascending, of a matrix of which `mine` are own."""
    owner = np.searchsorted(starts, ghosts, side="right") - 1
    asked = comm.alltoall([ghosts[owner == rank] for rank in range(comm.size)])
    first = starts[comm.rank]
    return Rows.under_each_other(comm.alltoall([mine.of(rows - first) for rows in asked]))
