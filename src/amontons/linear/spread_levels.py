"""Multigrid for a spread matrix: levels of our own above PETSc's.

A level of ours is swept by Gauss-Seidel on the rows of each process, and coarsened by
aggregates of one process each (`spread_aggregates`), which takes little memory.  An aggregate
is one or two nodes of the level below, which is of the same kind while processes have enough of
it; at last PETSc has a matrix of few unknowns, and factors or GAMG for it.

From one step of Newton's method to the next A changes near contacts alone, by dA, and so do
the coarse matrices,

    A_1 += P_0' dA P_0,    A_2 += P_1' (P_0' dA P_0) P_1,    ...

where dA has few rows.  So every step has the multigrid of its own matrix; P, and the bounds of
eigenvalues that Chebyshev's smoother works with, stay those of the step that has made them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.memory import trim
from .petsc import PREFIX, petsc
from .spread_aggregates import (
    CoarseProduct,
    SpreadTransfer,
    let_lone_rest,
    transfer_to_aggregates,
)
from .spread_rows import SpreadRows

Array = NDArray[np.float64]
Index = NDArray[np.integer]
DENSE = 64  # processes at most that make rows of a product in a dense one
SLAB = 200_000  # entries that are handed over at a time, some three times in memory
DIRECT = 1_000  # unknowns of a coarse matrix that every process factors, at most
OURS = 100  # unknowns a process, in the mean, of a coarse matrix that PETSc gets, at most
GAMG = {
    "pc_gamg_reuse_interpolation": True,
    # Directions that supports hold keep zeros.  With these as couplings two processes got a
    # level of tetrahedra with 2e15 as its largest eigenvalue, not 1.8: no smoother at all.
    "pc_gamg_threshold": 0.0,
}


class SpreadCycle:
    """One V(1,1) cycle for a matrix as it is now, whose rows at `changing` nodes may change.

    modes (own d, w): near-null motions; together: as of `transfer_to_aggregates`.
    """

    def __init__(
        self, rows: SpreadRows, modes: Array, changing: Index, together: int = 1
    ) -> None:
        self.rows, self.P = rows, transfer_to_aggregates(rows, modes, together)
        self.below: SpreadCycle | CoarseLevels | None = None
        self._x, self._b, self._r = rows.vector(), *np.zeros((2, rows.own, 3))
        self.changing, (self.blocks, ends) = changing, rows.tiles.slots(changing)
        self._places: Index | None = None
        if self.P is None:
            return
        t = rows.tiles
        self.change = CoarseProduct(self.P, changing, ends, t.indices[self.blocks])
        self._data = t.data[self.blocks]
        trim()
        self.below = level_below(self.P, self.change)
        trim()

    def follow(self, data: Array) -> None:
        """Let coarse levels be those of a matrix with other blocks (k, 3, 3) at `blocks`."""
        if self.below is not None:
            change, self._data = data - self._data, data
            if self.rows.comm.allreduce(int(change.any())):
                self.below.add(self.change.of(change))

    def add(self, rows: sparse.bsr_array) -> None:
        """Add own rows, which are empty but at `changing`, and what they are to those below."""
        blocks, columns, pointers = in_threes(rows)
        if self._places is None:
            self._places = self._found(columns, pointers)
        change = np.zeros((len(self.blocks), 3, 3))
        change[self._places] = blocks
        self.rows.add(self.blocks, change, self.changing)
        if self.below is not None:
            self.below.add(self.change.of(change))

    def _found(self, columns: Index, pointers: Index) -> Index:
        """Where entries with columns in the numbers of all stand among `blocks`."""
        t, count = self.rows.tiles, int(self.rows.starts[-1])
        mine = np.repeat(self.changing, np.diff(t.indptr)[self.changing])
        keys = mine * count + self.rows.numbers()[t.indices[self.blocks]]
        order = np.argsort(keys)
        row = np.repeat(np.arange(len(pointers) - 1), np.diff(pointers))
        return order[np.searchsorted(keys, row * count + columns, sorter=order)]

    def apply(self, b: Array) -> Array:
        """What the cycle makes of own values (own d,), from zero."""
        rows, x, right, r = self.rows, self._x, self._b, self._r
        rows.put(b, right)
        x[:] = 0.0
        rows.sweep(right, x, backward=False)
        if self.P is not None and self.below is not None:
            rows.borders.fetch(x)
            rows.residual(x, right, r)
            self.P.add(self.below.apply(self.P.restrict(r)), x)
        rows.borders.fetch(x)
        rows.sweep(right, x, backward=True)
        return rows.taken(x)

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        rows_below = self.below.rows if isinstance(self.below, SpreadCycle) else None
        for part in (self.P, self.below, rows_below):
            if part is not None:
                part.destroy()


def level_below(P: SpreadTransfer, change: CoarseProduct) -> SpreadCycle | CoarseLevels:
    """The level of P' A P, in whose rows `change` has entries later."""
    t, comm, width = P.rows.tiles, P.rows.comm, P.width
    rows = CoarseProduct(P, np.arange(P.rows.own), t.indptr, t.indices).of(t.data)
    let_lone_rest(comm, rows, int(P.starts[comm.rank]))
    size = width * int(P.starts[-1])
    if size <= max(DIRECT, OURS * comm.size):
        return CoarseLevels(spread_matrix(comm, rows, width), P.modes)
    blocks, columns, pointers = in_threes(rows)
    shape = rows.shape
    del rows
    below = SpreadRows(comm, sparse.bsr_array((blocks, columns, pointers), shape=shape), 3)
    units = np.flatnonzero(np.diff(change.pointers[: P.own + 1]))
    together = width // 3
    nodes = (together * units[:, None] + np.arange(together)).ravel()
    return SpreadCycle(below, P.modes, nodes, together)


def in_threes(rows: sparse.bsr_array) -> tuple[Array, Index, Index]:
    """Blocks (k, 3, 3), columns and pointers of rows in blocks (w, w), w / 3 whole."""
    m, counts = rows.data.shape[1] // 3, np.diff(rows.indptr)
    if m == 1:
        return rows.data, rows.indices, rows.indptr
    pointers = np.concatenate([[0], np.cumsum(np.repeat(m * counts, m))])
    ends = m * m * np.asarray(rows.indptr)
    blocks = np.empty((ends[-1], 3, 3))
    columns: Index = np.empty_like(rows.indices, shape=(ends[-1],))
    row = np.repeat(np.arange(len(counts)), counts)
    at = ends[row] + m * (np.arange(len(row)) - rows.indptr[row])
    for i in range(m):
        for j in range(m):
            place = at + i * m * counts[row] + j
            blocks[place] = rows.data[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
            columns[place] = m * rows.indices + j
    return blocks, columns, pointers


class CoarseLevels:
    """PETSc's solver of a coarse matrix, which follows its changes: GAMG, or factors.

    modes (own, w): near-null motions, whose number is that of the unknowns of an aggregate.
    """

    def __init__(self, A: Any, modes: Array) -> None:
        self.A, self.width, self.comm = A, modes.shape[1], A.getComm().tompi4py()
        give_modes(A, modes)
        self._x, self._b = self.A.createVecs()
        self.pc = petsc().PC().create(self.comm)
        self.pc.setOperators(self.A)
        self._down: list[Any] = []
        self._coarse: list[Any] = []
        self._changes: list[Any] = []  # of A and of those below, in patterns that stay
        if self.A.getSize()[0] <= DIRECT:
            self.pc.setType("redundant")
            self.pc.setUp()
            return
        set_gamg(self.pc)
        with chosen_products(self.comm):
            self.pc.setUp()
        self.pc.setReusePreconditioner(True)
        finest = self.pc.getMGLevels() - 1
        self._down = [self.pc.getMGInterpolation(k) for k in range(finest, 0, -1)]
        below = range(finest - 1, -1, -1)
        self._coarse = [self.pc.getMGSmoother(k).getOperators()[0] for k in below]
        for coarse in self._coarse:
            _forget_product(coarse)

    def apply(self, b: Array) -> Array:
        """What one cycle makes of own values."""
        self._b.array = b
        self.pc.apply(self._b, self._x)
        return self._x.array_r

    def add(self, rows: sparse.bsr_array) -> None:
        """Add own rows, within the pattern, to the matrix, and what they are to those below."""
        changes = self._changes
        if changes:
            fill(changes[0], rows)
            for P, (above, below) in zip(self._down, pairwise(changes), strict=True):
                above.PtAP(P, result=below)
        else:
            changes.append(spread_matrix(self.comm, rows, self.width))
            with chosen_products(self.comm, alone="scalable"):
                for P in self._down:
                    changes.append(changes[-1].PtAP(P))
        subset = petsc().Mat.Structure.SUBSET_NONZERO_PATTERN
        for A, change in zip((self.A, *self._coarse), changes, strict=True):
            A.axpy(1.0, change, subset)
        self.pc.setOperators(self.A)

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        for part in (self.pc, self.A, self._x, self._b, *self._changes):
            part.destroy()


def set_gamg(pc: Any) -> None:
    """Multigrid whose aggregates are kept, or what else the options ask for; not yet set up."""
    options = petsc().Options()
    for name, value in GAMG.items():
        if not options.hasName(PREFIX + name):
            options.setValue(PREFIX + name, value)
    pc.setType("gamg")
    pc.setOptionsPrefix(PREFIX)
    pc.setFromOptions()


def give_modes(A: Any, modes: Array) -> None:
    """Give a matrix its near-null motions (own, k), orthonormal, as PETSc asks for."""
    kept: list[Any] = []
    for column in modes.T:
        v = A.createVecRight()
        v.array = np.ascontiguousarray(column)
        size = v.norm()
        for _ in range(2):  # the second time takes off what rounding left
            for other in kept:
                v.axpy(-v.dot(other), other)
        if v.norm() > 1e-8 * size > 0:
            v.normalize()
            kept.append(v)
    A.setNearNullSpace(petsc().NullSpace().create(vectors=kept, comm=A.getComm()))


def spread_matrix(comm: Any, rows: sparse.bsr_array, d: int) -> Any:
    """PETSc's matrix of the own rows (own, n) of all processes, filled slab by slab."""
    PETSc = petsc()
    own, size = rows.shape  # type: ignore[misc]  # scipy: may be None
    last = comm.scan(own)
    inside = (rows.indices >= (last - own) // d) & (rows.indices < last // d)
    nodes = np.repeat(np.arange(own // d), np.diff(rows.indptr))
    counts = [
        np.repeat(d * np.bincount(nodes[some], minlength=own // d), d).astype(PETSc.IntType)
        for some in (inside, ~inside)
    ]
    A = PETSc.Mat().create(comm)
    A.setSizes(((own, size), (own, size)), bsize=d)
    A.setType("aij")
    A.setPreallocationNNZ(counts)
    A.setOption(PETSc.Mat.Option.USE_INODES, False)  # which take longer in blocks of 6
    fill(A, rows)
    return A


def fill(A: Any, rows: sparse.bsr_array) -> None:
    """Give a matrix of PETSc the entries of own rows (own, n), in the pattern that it has."""
    PETSc = petsc()
    d, (own, size) = A.getBlockSize(), rows.shape  # type: ignore[misc]  # scipy: may be None
    last = A.getOwnershipRange()[1]
    step = max(1, SLAB * (own // d) // max(rows.data.size, 1))
    for first in range(0, own // d, step):
        ends = rows.indptr[first : first + step + 1]
        some = slice(ends[0], ends[-1])
        parts = (rows.data[some], rows.indices[some], ends - ends[0])
        slab = sparse.bsr_array(parts, shape=(d * (len(ends) - 1), size)).tocsr()
        slab.sort_indices()
        numbers = np.arange(last - own + d * first, last - own + d * first + slab.shape[0])
        A.setValuesIJV(
            slab.indptr.astype(PETSc.IntType), slab.indices.astype(PETSc.IntType), slab.data,
            rowmap=numbers.astype(PETSc.IntType),
        )  # fmt: skip
    A.assemble()


def _forget_product(A: Any) -> None:
    """Free what PETSc has kept in a product for making it again: A P, and rows of others' P.

    petsc4py has no method for MatProductClear; its module is linked against PETSc.
    """
    clear = ctypes.PyDLL(petsc().__file__).MatProductClear
    clear.argtypes, clear.restype = [ctypes.c_void_p], ctypes.c_int
    if clear(A.handle):
        raise RuntimeError("PETSc: MatProductClear has failed")


@contextmanager
def chosen_products(comm: Any, alone: str = "rap") -> Iterator[None]:
    """Let PETSc make P' A P by A P and, in a spread matrix, rows of it by a dense one.

    A P takes the room of A and more, for a while.  PETSc's ways without it save that room and
    take ten times as long on two processes (353 000 unknowns of tetrahedra: 21 s, with sparse
    rows of A P 4.8, dense ones 2.1).  A dense row has an entry for every column of P: on many
    processes it would be larger than their parts.  alone: PETSc's name of the way on one.
    """
    options, name = petsc().Options(), "matptap_via"
    ours = not options.hasName(name)
    if ours:
        spread = "nonscalable" if comm.size <= DENSE else "scalable"
        options.setValue(name, spread if comm.size > 1 else alone)
    try:
        yield
    finally:
        if ours:
            options.delValue(name)
