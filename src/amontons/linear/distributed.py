"""A stiffness spread over the processes of MPI: everyone holds a part, the first one leads.

Each process has assembled the cells of its own part.  Products with the stiffness are sums over
the parts; for solves PETSc makes a distributed matrix of them.  The first process alone runs
the program: it decides, judges and solves the contact problem, and asks the others to take part
in every product and every solve (`Share.serve`).  So no decision, not even one by the clock,
can differ between processes.  Vectors are whole on the first process.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import UnsupportedForm
from .base import by_columns
from .petsc import Petsc, check_converged, krylov, petsc

Array = NDArray[np.float64]
Index = NDArray[np.int64]
T = TypeVar("T")
PAUSE = 1e-4  # s between looks for the next task: waiting must not take a core from the leader


@dataclass(frozen=True, eq=False)
class Prepared:
    """PETSc's solver, its vectors, and the way (`collect`) to one `whole` on the leader."""

    ksp: Any
    x: Any
    b: Any
    collect: Any
    whole: Any


class Share:
    """What one process holds; all processes of `comm` call the same methods in turn.

    part: the stiffness of its own cells on the unknowns `dofs`, (k,); d unknowns a node.
    owner (nodes,): process that holds the row of a node in PETSc; points (nodes, d).
    """

    def __init__(
        self, comm: Any, part: sparse.csr_array, dofs: Index, owner: Index, points: Array
    ) -> None:
        self.comm, self.part, self.dofs = comm, part, dofs
        self.owner, self.points = owner, points
        self.number = np.empty(len(owner), dtype=np.int64)  # of a node in PETSc
        self.number[np.argsort(owner, kind="stable")] = np.arange(len(owner))
        self.prepared: list[Prepared] = []

    @property
    def size(self) -> int:
        """Unknowns of all parts."""
        return self.points.size

    # ------------------------------------------------------------------ leading, serving
    def lead(self, work: Callable[[], T]) -> T | None:
        """Run `work` on the first process while the others serve it; None on the others."""
        if self.comm.rank:
            self._serve()
            return None
        try:
            return work()
        finally:
            self._task(None)

    def call(self, name: str, *given: Any) -> Any:
        """Let all processes do a method of this class; the first one calls."""
        self._task((name, given))
        return self._do(name, given)

    def _task(self, task: Any) -> Any:
        """Hand a task to all."""
        ready = self.comm.Ibarrier()
        while not ready.Test():
            time.sleep(PAUSE)
        return self.comm.bcast(task)

    def _serve(self) -> None:
        while (task := self._task(None)) is not None:
            self._do(*task)

    def _do(self, name: str, given: tuple) -> Any:
        """One task; all processes end when one fails, as the others wait for it."""
        try:
            return getattr(self, name)(*given)
        except BaseException:
            if self.comm.size > 1:
                traceback.print_exc()
                self.comm.Abort(1)
            raise

    # ------------------------------------------------------------------ tasks
    def times(self, v: Array) -> Array | None:
        """K v for v of shape (size,) on all, on the first process."""
        out = np.zeros(self.size)
        out[self.dofs] = self.part @ v[self.dofs]
        return self._total(out)

    def diagonal(self) -> Array | None:
        """The diagonal, (size,), on the first process."""
        out = np.zeros(self.size)
        out[self.dofs] = self.part.diagonal()
        return self._total(out)

    def coupled(self, inside: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
        """Unknowns in an equation with one of those inside, (size,), on the first process."""
        pattern = (np.ones(self.part.nnz), self.part.indices, self.part.indptr)
        touch = sparse.csr_array(pattern, shape=self.part.shape) @ inside[self.dofs]
        out = np.zeros(self.size)
        out[self.dofs] = touch
        total = self._total(out)
        return None if total is None else total > 0

    def rows(self, index: Index) -> sparse.csr_array | None:
        """Rows and columns of some unknowns, (k,) ascending, on the first process."""
        place = np.full(self.size, -1)
        place[index] = np.arange(len(index))
        local = place[self.dofs]
        kept = np.flatnonzero(local >= 0)
        block = self.part[kept][:, kept].tocoo()
        where = local[kept]
        entries = (block.data, where[block.coords[0]], where[block.coords[1]])
        found = self.comm.gather(entries)
        if found is None:
            return None
        data, i, j = (np.concatenate(column) for column in zip(*found, strict=True))
        return sparse.coo_array((data, (i, j)), shape=(len(index),) * 2).tocsr()

    def prepare(self, fixed: NDArray[np.bool_], options: Petsc) -> int:
        """Make PETSc's matrix, fixed unknowns uncoupled, and its multigrid; their number."""
        PETSc = petsc()
        d = self.points.shape[1]
        own = np.flatnonzero(self.owner == self.comm.rank)
        A = PETSc.Mat().create(self.comm)
        A.setSizes([[own.size * d, self.size]] * 2)
        A.setBlockSize(d)
        A.setType("aij")
        i, j, values = self._entries(fixed, own)
        A.setPreallocationCOO(i.astype(PETSc.IntType), j.astype(PETSc.IntType))
        A.setValuesCOO(values)
        points = PETSc.Vec().createWithArray(self.points[own].ravel(), bsize=d, comm=self.comm)
        A.setNearNullSpace(PETSc.NullSpace().createRigidBody(points))
        x, b = A.createVecs()
        collect, whole = PETSc.Scatter.toZero(x)
        self.prepared.append(Prepared(krylov(A, options), x, b, collect, whole))
        return len(self.prepared) - 1

    def _entries(self, fixed: NDArray[np.bool_], own: Index) -> tuple[Index, Index, Array]:
        """Rows, columns and values of the part in PETSc's numbers, fixed unknowns uncoupled."""
        part = self.part.tocoo()
        i, j = self.dofs[part.coords[0]], self.dofs[part.coords[1]]
        kept = ~(fixed[i] | fixed[j])
        alone = (own[:, None] * self.points.shape[1] + np.arange(self.points.shape[1])).ravel()
        alone = alone[fixed[alone]]
        scale = np.abs(self.part.diagonal()).mean()
        values = np.concatenate([part.data[kept], np.full(len(alone), scale)])
        both = [self._numbers(np.concatenate([side[kept], alone])) for side in (i, j)]
        return both[0], both[1], values

    def _numbers(self, dofs: Index) -> Index:
        """PETSc's numbers of unknowns."""
        d = self.points.shape[1]
        return self.number[dofs // d] * d + dofs % d

    def solve(self, number: int) -> None:
        """Solve with the right-hand side that the first process has put into `whole`."""
        s, modes = self.prepared[number], petsc().ScatterMode
        s.collect.scatter(s.whole, s.b, mode=modes.REVERSE)
        s.ksp.solve(s.b, s.x)
        s.collect.scatter(s.x, s.whole, mode=modes.FORWARD)

    def _total(self, mine: Array) -> Array | None:
        """The sum over all processes, on the first."""
        out = np.empty_like(mine) if self.comm.rank == 0 else None
        self.comm.Reduce(mine, out)
        return out


class DistributedMatrix:
    """The stiffness on some of its unknowns, in the hands of the process that leads.

    free (n,) ascending.  It has products, a factor and some rows; nothing gathers the whole.
    """

    dtype = np.dtype(float)
    ndim = 2

    def __init__(self, share: Share, free: Index, solver: Petsc) -> None:
        self.share, self.free, self.solver = share, free, solver

    @property
    def shape(self) -> tuple[int, int]:
        """(n, n)."""
        n = len(self.free)
        return n, n

    def __matmul__(self, v: Array) -> Array:
        whole = np.zeros(self.share.size)
        whole[self.free] = v
        return self.share.call("times", whole)[self.free]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        raise UnsupportedForm(
            "the stiffness is spread over several processes and can not be stored on one; use "
            "CompressedDelassus or Auto, or problem.condensed() with a solver of the local form"
        )

    def __add__(self, other: object) -> Array:
        return self.__array__()

    def on(self, free: Index) -> DistributedMatrix:
        """The rows and columns of some of all unknowns."""
        return DistributedMatrix(self.share, free, self.solver)

    def part(self, index: Index) -> sparse.csr_array:
        """Rows and columns of some unknowns, (k,) ascending."""
        return self.share.call("rows", self.free[index])

    def coupled(self, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Unknowns in an equation with one of those inside, (n,), these included."""
        whole = np.zeros(self.share.size, dtype=bool)
        whole[self.free] = inside
        return self.share.call("coupled", whole)[self.free]

    def diagonal(self) -> Array:
        """The diagonal, (n,)."""
        return self.share.call("diagonal")[self.free]

    def factor(self) -> DistributedFactor:
        """PETSc's solver, set up on all processes."""
        fixed = np.ones(self.share.size, dtype=bool)
        fixed[self.free] = False
        number = self.share.call("prepare", fixed, self.solver)
        d = self.share.points.shape[1]
        place = self.share.number[self.free // d] * d + self.free % d
        return DistributedFactor(self.share, number, place, self.solver)


@dataclass
class DistributedFactor:
    """A prepared solver of PETSc; place (n,): PETSc's numbers of the unknowns."""

    share: Share
    number: int
    place: Index
    options: Petsc
    exact: bool = False
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b to the options' tolerance, shape of b."""
        return by_columns(self._solve_one, b)

    def _solve_one(self, b: Array) -> Array:
        prepared = self.share.prepared[self.number]
        right = np.zeros(self.share.size)
        right[self.place] = b
        prepared.whole.array = right
        self.share.call("solve", self.number)
        check_converged(prepared.ksp, self.options)
        self.iterations += prepared.ksp.getIterationNumber()
        return prepared.whole.array_r[self.place]
