"""Coarse matrices of PETSc's multigrid that follow the rows of contacts, not made anew.

The products P' A P of a whole matrix cost as much as some twenty cycles.  From one step of
Newton's method to the next A changes near contacts alone, by dA, and so do its coarse matrices,

    A_1 += P_0' dA P_0,    A_2 += P_1' (P_0' dA P_0) P_1,    ...

where dA has few rows.  So every step has the multigrid of its own matrix; P, and the bounds of
eigenvalues that Chebyshev's smoother works with, stay those of the step that has made them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .petsc import petsc

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DENSE = 64  # processes at most that make rows of a product in a dense one


class FollowingLevels:
    """Levels of GAMG below a matrix A whose rows `rows` change, and what A was when they were.

    rows (k,): own numbers; pattern: CSR pointers (k + 1,) and PETSc's columns of these rows;
    values: their entries in the A of which the levels are made.
    """

    def __init__(  # noqa: PLR0913  # a sparse matrix of few rows
        self, pc: Any, A: Any, rows: Index, pointers: Index, columns: Index, values: Array
    ) -> None:
        PETSc = petsc()
        first, last = A.getOwnershipRange()
        counts = np.zeros(last - first + 1, dtype=PETSc.IntType)
        counts[1 + rows] = np.diff(pointers)
        self._csr = np.cumsum(counts, dtype=PETSc.IntType), columns.astype(PETSc.IntType)
        self._values = values
        self._change = PETSc.Mat().createAIJ(
            A.getSizes(), bsize=A.getBlockSize(), csr=(*self._csr, np.zeros(len(values))),
            comm=A.getComm(),
        )  # fmt: skip
        finest = pc.getMGLevels() - 1
        self._down = [pc.getMGInterpolation(k) for k in range(finest, 0, -1)]
        below = range(finest - 1, -1, -1)
        self._coarse = [pc.getMGSmoother(k).getOperators()[0] for k in below]
        self._products: list[Any] = [None] * finest
        for coarse in self._coarse:
            _forget_product(coarse)

    def follow(self, values: Array) -> None:
        """Let the levels be those of A with other entries in the rows."""
        PETSc = petsc()
        self._change.setValuesCSR(*self._csr, values - self._values)
        self._change.assemble()
        self._values = values
        if not self._change.norm():
            return
        change, subset = self._change, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN
        with chosen_products(change.getComm(), alone="scalable"):
            for k, (P, A) in enumerate(zip(self._down, self._coarse, strict=True)):
                change = self._products[k] = change.PtAP(P, self._products[k])
                A.axpy(1.0, change, subset)

    def destroy(self) -> None:
        """Give the memory back; all processes have to."""
        for part in (self._change, *self._products):
            if part is not None:
                part.destroy()


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
