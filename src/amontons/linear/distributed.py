"""A stiffness whose rows are spread over the processes of MPI, and Newton's steps with it.

Every process holds the rows of its own unknowns; all call the same methods, which PETSc carries
out together.  One matrix A serves products, smoothers and multigrid.  It is the matrix of a
Newton step: with the free directions F and the held ones D, held by a support or because a
contact has closed there,

    A = [K_FF, 0; 0, diag K_DD],    rows i of contacts that slide: sum_j G_r,ij K_jF + G_u,iF

j the directions of the same node, and a FAINT part of diag K_DD where a support holds.  So it
has the same pattern at all times, and is symmetric unless contacts slide.  What A has lost
stands in the rows `touched` (k, n), a thin matrix with the rows that have an entry in the row
or column of a direction that may ever be held: K x is A x with these rows taken from there.

Flexible GMRES is preconditioned from the right by multigrid (GAMG).  Its aggregates are made
once.  Its coarse matrices follow (`spread_levels`), and are made anew only when an iteration
gains far less than it did; another preconditioner also when many directions have changed.

Coarse functions are cut off at held directions, as in truncated multigrid [KK]: coarse matrices
are P' A P with the FAINT diagonal in all of D, and what a cycle gives to D is dropped; with all
of the diagonal they would cost energy for what is cut off, and multigrid do little there.

[KK] R. Kornhuber, R. Krause, "Adaptive multigrid methods for Signorini's problem in linear
elasticity", Comput. Visual. Sci. 4 (2001).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator
from .petsc import PREFIX, Petsc, petsc
from .spread_levels import FollowingLevels, chosen_products

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
RESTART = 30  # vectors that GMRES keeps
CHANGED = 0.2  # share of the contact directions that may change before multigrid follows
WORSE = 3.0  # iterations per digit, compared with those of fresh coarse matrices
SLAB = 2_000  # nodes whose rows are handed over at a time
FAINT = 1e-6  # of the diagonal: keeps a coarse matrix regular whose functions are all cut off
FIRST_WORSE = 8.0  # iterations per digit that are called bad whatever they were
GAMG = {
    "pc_gamg_reuse_interpolation": True,
    # Directions that supports hold keep zeros.  With these as couplings two processes got a
    # level of tetrahedra with 2e15 as its largest eigenvalue, not 1.8: no smoother at all.
    "pc_gamg_threshold": 0.0,
}


@dataclass(frozen=True, eq=False)
class Sliding:
    """Rows (k, t) of own unknowns with conditions G_r (K x) + G_u x in node blocks (k, d, d).

    rows (k, d): own numbers of the unknowns of k contacts; wanted (k, d): rows that are
    replaced; G_r, G_u (k, d, d).
    """

    rows: Index
    wanted: Mask
    G_r: Array
    G_u: Array


class SpreadMatrix:
    """K on all processes of `comm`, its held directions and the solver of Newton's steps.

    rows: gives K of the own unknowns in blocks (own, n), columns in the numbers of PETSc,
    where processes follow one another, and keeps no copy; basis: T = I + C (own, n) in which
    contact is seen on one side, C C = 0, None where nobody has one (the same on all processes).
    modes (own, k): rigid motions; d: unknowns a node; fixed, contact (own,): directions that
    supports hold, and those of contacts, whose rows and columns change from step to step.
    """

    def __init__(  # noqa: PLR0913  # what a matrix is made of
        self, comm: Any, rows: Callable[[], sparse.bsr_array], basis: sparse.bsr_array | None,
        *, modes: Array, d: int, fixed: Mask, contact: Mask, options: Petsc,
    ) -> None:  # fmt: skip
        self.comm, self.d, self.options = comm, d, options
        self.own, self.directions = len(fixed), int(comm.allreduce(int(contact.sum())))
        self.A = _matrix(comm, rows(), d)
        self.T = None
        if basis is not None:
            self.T = _matrix(comm, basis, d)
            plain, self.A = self.A, self.A.PtAP(self.T)
            plain.destroy()
            self.A.setBlockSize(d)
        self.first, last = self.A.getOwnershipRange()
        assert last - self.first == self.own
        self.A.setOption(petsc().Mat.Option.KEEP_NONZERO_PATTERN, True)
        self._x, self._y = self.A.createVecs()
        self.A.getDiagonal(self._x)
        self.diagonal = self._x.array_r.copy()
        self._in_matrix = np.where(fixed, FAINT, 1.0) * self.diagonal
        self._take_rows(fixed | contact, contact)
        self._give_modes(modes)
        self.held = np.zeros(self.own, dtype=bool)
        self.ksp: Any = None
        self.preconditioner: Any = None
        self.levels: FollowingLevels | None = None
        self._fresh = True
        self.iterations = self.rebuilt = 0
        self._built = np.zeros(self.own, dtype=bool)
        self._stale, self._rate = False, 0.0

    def destroy(self) -> None:
        """Give the memory back; all processes have to, and have no use of this object then."""
        for part in (self.levels, self.ksp, self.preconditioner, self.A, self.T, self.touched,
                     self._fetch, self._near, self._x, self._y, self._rest):  # fmt: skip
            if part is not None:
                part.destroy()

    # ------------------------------------------------------------------ vectors
    def total(self, value: float | Array) -> Any:
        """The sum of numbers over all processes."""
        return self.comm.allreduce(value)

    def to_basis(self, v: Array) -> Array:
        """T^-1 v of own values (own,): T = I + C, and C C = 0."""
        return v if self.T is None else 2 * v - self.from_basis(v)

    def from_basis(self, v: Array) -> Array:
        """T v of own values (own,)."""
        return v if self.T is None else self._product(self.T.mult, v)

    def load_in_basis(self, f: Array) -> Array:
        """T' f of own values (own,)."""
        return f if self.T is None else self._product(self.T.multTranspose, f)

    def _product(self, times: Callable[[Any, Any], None], v: Array) -> Array:
        self._x.array = v
        times(self._x, self._y)
        return self._y.array_r.copy()

    def force_from_basis(self, f: Array) -> Array:
        """T'^-1 f of own values (own,)."""
        return f if self.T is None else 2 * f - self.load_in_basis(f)

    # ------------------------------------------------------------------ set-up
    def _take_rows(self, may_be_held: Mask, changing: Mask) -> None:
        """Keep the rows that have an entry in the row or column of a marked direction."""
        PETSc = petsc()
        index = (self.first + np.flatnonzero(may_be_held)).astype(PETSc.IntType)
        own = PETSc.IS().createStride(self.own, self.first, 1, comm=self.comm)
        marked = self.A.createSubMatrix(PETSc.IS().createGeneral(index, comm=self.comm), own)
        columns = np.unique(marked.getValuesCSR()[1])  # symmetric: the rows that touch it
        marked.destroy()
        flags = self.A.createVecRight()
        flags.setValues(columns.astype(PETSc.IntType), np.ones(len(columns)))
        flags.assemble()
        touched = np.flatnonzero((flags.array_r > 0) | may_be_held)
        rows = (self.first + touched).astype(PETSc.IntType)
        self.touched = self.A.createSubMatrix(
            PETSc.IS().createGeneral(rows, comm=self.comm), own
        )
        self.touched_rows = touched
        self._rest = self.touched.createVecLeft()
        pointers, columns, values = self.touched.getValuesCSR()
        self._pattern = pointers, columns, values
        self._of = np.repeat(touched.astype(np.int32), np.diff(pointers))
        self._on_diagonal = columns == self.first + self._of
        known, place = np.unique(columns, return_inverse=True)
        self._place = place.ravel().astype(np.int32)
        self._near = PETSc.Vec().createSeq(len(known))
        self._fetch = PETSc.Scatter().create(
            flags, PETSc.IS().createGeneral(known.astype(PETSc.IntType), comm=self.comm),
            self._near, None,
        )  # fmt: skip
        flags.destroy()
        self._find_changing(changing)

    def _find_changing(self, changing: Mask) -> None:
        """Which of the touched rows have an entry in the row or column of such a direction."""
        pointers, columns, _ = self._pattern
        entries = self._fetched(changing)[self._place] | changing[self._of]
        near = np.repeat(np.arange(len(self.touched_rows)), np.diff(pointers))[entries]
        some = np.unique(near)
        counts = np.diff(pointers)[some]
        ends = np.concatenate([[0], np.cumsum(counts)])
        slots = np.arange(ends[-1]) + np.repeat(pointers[some] - ends[:-1], counts)
        self._changing = slots, (self.touched_rows[some], ends, columns[slots])

    def _fetched(self, mine: Mask) -> Mask:
        """A mask of own directions at the columns of the touched rows, of all processes."""
        self._x.array = mine.astype(float)
        self._fetch.scatter(self._x, self._near, mode=petsc().ScatterMode.FORWARD)
        return self._near.array_r > 0

    def _give_modes(self, modes: Array) -> None:
        """Rigid motions in the basis, orthonormal, as PETSc asks for."""
        PETSc = petsc()
        kept: list[Any] = []
        for column in modes.T:
            v = self.A.createVecRight()
            v.array = self.to_basis(np.ascontiguousarray(column))
            size = v.norm()
            for _ in range(2):  # the second time takes off what rounding left
                for other in kept:
                    v.axpy(-v.dot(other), other)
            if v.norm() > 1e-8 * size > 0:
                v.normalize()
                kept.append(v)
        self.A.setNearNullSpace(PETSc.NullSpace().create(vectors=kept, comm=self.comm))

    def blocks(self, dofs: Index) -> Array:
        """K in the blocks of own unknowns dofs (k, d) that may be held, (k, d, d)."""
        if not len(dofs):
            return np.zeros((0, self.d, self.d))
        pointers, columns, values = self._pattern
        shape = (len(self.touched_rows), self.A.getSize()[1])
        rows = sparse.csr_array((values, columns, pointers), shape=shape)
        at = np.searchsorted(self.touched_rows, dofs)
        d = dofs.shape[1]
        i, j = np.repeat(at, d, axis=1).ravel(), np.tile(dofs + self.first, (1, d)).ravel()
        return np.asarray(rows[i, j]).reshape(len(dofs), d, d)

    def hold(self, held: Mask, sliding: Sliding) -> None:
        """Hold own directions (own,), and let contacts slide by their conditions."""
        PETSc = petsc()
        pointers, columns, values = self._pattern
        free = np.where(self._fetched(held)[self._place], 0.0, values)  # columns
        values = np.where(held[self._of], 0.0, free)
        mine = self._on_diagonal & held[self._of]
        values[mine] = self._in_matrix[self._of[mine]]
        self.held = held
        self._let_slide(values, free, sliding)
        index = (self.first + self.touched_rows).astype(PETSc.IntType)
        if len(index):
            self.A.setValuesIJV(pointers, columns, values, rowmap=index)
        self.A.assemble()
        slots = self._changing[0]
        self._values = values[slots]
        faint = FAINT * self.diagonal[self._of[slots]]
        self._below = np.where(mine[slots], faint, self._values)
        self._changed = float(self.total(int((held != self._built).sum())))

    def _let_slide(self, values: Array, free: Array, sliding: Sliding) -> None:
        """Write the rows of contacts that slide into the values of the touched rows.

        The rows of one node have the same columns, so that an entry of another direction of it
        stands a whole number of rows further on.
        """
        pointers, columns, _ = self._pattern
        d, rows = self.d, sliding.rows
        starts = pointers[np.searchsorted(self.touched_rows, rows)]
        count = pointers[1 + np.searchsorted(self.touched_rows, rows[:, 0])] - starts[:, 0]
        of = np.repeat(np.arange(len(rows)), count)
        entry = starts[of].T + np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        beside = columns[entry[0]] - self.first - rows[of, 0]  # direction of the same node
        own = np.flatnonzero((beside >= 0) & (beside < d))
        G_u = np.where(self.held[rows][:, None, :], 0.0, sliding.G_u)
        for a in range(d):
            out = np.einsum("kb,bk->k", sliding.G_r[of, a], free[entry])
            out[own] += G_u[of[own], a, beside[own]]
            wanted = sliding.wanted[of, a]
            values[entry[a, wanted]] = out[wanted]

    # ------------------------------------------------------------------ products
    def times(self, x: Array) -> Array:
        """K x of own values (own,), held directions included."""
        out = self._product(self.A.mult, x)
        self.touched.mult(self._x, self._rest)
        out[self.touched_rows] = self._rest.array_r
        return out

    # ------------------------------------------------------------------ solving
    def solve(self, b: Array, reduction: float) -> Array:
        """x (own,) with |A x - b| <= reduction |b|, 0 in held directions.

        Raises SingularOperator, on all processes, where GMRES does not get there.
        """
        right, x = self._y, self._x
        right.array = np.where(self.held, 0.0, b)
        if right.norm() == 0:
            return np.zeros(self.own)
        self._prepare()
        self.ksp.setTolerances(rtol=reduction, atol=0.0, max_it=self.options.max_iterations)
        self.ksp.solve(right, x)
        steps = self.ksp.getIterationNumber()
        self.iterations += steps
        reason = self.ksp.getConvergedReason()
        if reason <= 0:
            raise SingularOperator(
                f"PETSc: no convergence in {self.options.max_iterations} iterations (reason "
                f"{reason}); are all bodies held by supports, and by contacts that do not open?"
            )
        rate = steps / max(-np.log10(reduction), 0.5)
        if self._fresh:
            self._rate = rate
        self._stale = rate > max(WORSE * self._rate, FIRST_WORSE)
        return np.where(self.held, 0.0, x.array_r)

    def _prepare(self) -> None:
        """Make the solver, or let multigrid follow the matrix, anew where it is time to."""
        if self.ksp is None:
            self.preconditioner = preconditioner(self.A)
            self.ksp = krylov_of_steps(self.A, OfFree(self))
            self._fresh = True
        else:
            many = self.levels is None and self._changed > CHANGED * self.directions
            self._fresh = many or self._stale
            self.preconditioner.setReusePreconditioner(not self._fresh)
            self.preconditioner.setOperators(self.A)
            self.ksp.setOperators(self.A)
        if self._fresh:
            self._make_levels()
        if self.levels is not None:
            self.levels.follow(self._below)

    def _make_levels(self) -> None:
        """Multigrid of the matrix as it is now, or what else the preconditioner is."""
        self.rebuilt += 1
        self._built = self.held.copy()
        if self.levels is not None:
            self.levels.destroy()
        pc = self.preconditioner
        with chosen_products(self.comm):
            pc.setUp()
        if pc.getType() == "gamg":
            self.levels = FollowingLevels(pc, self.A, *self._changing[1], self._values)


class OfFree:
    """A preconditioner, as PETSc calls it, that leaves held directions at zero."""

    def __init__(self, matrix: SpreadMatrix) -> None:
        self.matrix = matrix

    def apply(self, _: Any, x: Any, y: Any) -> None:
        """Put the preconditioner of x into y."""
        self.matrix.preconditioner.apply(x, y)
        y.array[self.matrix.held] = 0.0


def preconditioner(A: Any) -> Any:
    """Multigrid whose aggregates are kept, or what else the options ask for; not yet set up."""
    PETSc = petsc()
    options = PETSc.Options()
    for name, value in GAMG.items():
        if not options.hasName(PREFIX + name):
            options.setValue(PREFIX + name, value)
    pc = PETSc.PC().create(A.getComm())
    pc.setOperators(A)
    pc.setType("gamg")
    pc.setOptionsPrefix(PREFIX)
    pc.setFromOptions()
    return pc


def krylov_of_steps(A: Any, given: OfFree) -> Any:
    """Flexible GMRES, which spares a last call of the preconditioner, one of some five."""
    PETSc = petsc()
    ksp = PETSc.KSP().create(A.getComm())
    ksp.setOperators(A)
    ksp.setType("fgmres")
    ksp.setGMRESRestart(RESTART)
    ksp.setOptionsPrefix(PREFIX)
    pc = ksp.getPC()
    pc.setType("python")
    pc.setPythonContext(given)
    pc.setOptionsPrefix(PREFIX + "free_")  # options of the preconditioner are the other's
    ksp.setFromOptions()
    return ksp


def _matrix(comm: Any, rows: sparse.bsr_array, d: int) -> Any:
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
    for first in range(0, own // d, SLAB):
        ends = rows.indptr[first : first + SLAB + 1]
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
    return A
