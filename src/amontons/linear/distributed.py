"""A stiffness whose rows are spread over the processes of MPI, and Newton's steps with it.

Every process holds the rows of its own unknowns; all call the same methods, which PETSc carries
out together.  One matrix A serves products, smoothers and multigrid.  Where a direction is held,
by a support or because a contact has closed there, its row and column in A are those of the
diagonal, so that A is symmetric positive definite and has the same pattern at all times:

    A = [K_FF + L, 0; 0, D],    F: the free directions, L: of contacts that slide, symmetrised.

What A has lost stands in the rows `touched` (k, n), a thin matrix with the rows that have an
entry in the row or column of a direction that may ever be held.  K x is A x with these rows
taken from there.  The matrix of a Newton step,

    J x = A_FF x + (G_r K x + G_u x - A_FF x) in the rows of contacts that slide,

is not symmetric and never stored; GMRES is preconditioned from the right by multigrid (GAMG) for
A.  Its aggregates are made once.  Its coarse matrices are made anew only when they have become
bad: when many directions have changed, or an iteration gains less than it did.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator
from .petsc import PREFIX, Petsc, petsc

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
RESTART = 30  # vectors that GMRES keeps
CHANGED = 0.05  # share of the contact directions that may change before multigrid follows
WORSE = 1.5  # iterations per digit, compared with those of fresh coarse matrices
FIRST_WORSE = 8.0  # iterations per digit that are called bad whatever they were


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

    rows: K of the own unknowns as a CSR matrix (own, n), columns in the numbers of PETSc,
    where processes follow one another; basis: T = I + C (own, n) in which contact is seen on
    one side, C C = 0, None where nobody has one (the same answer on all processes).
    modes (own, k): rigid motions; d: unknowns a node; may_be_held (own,): directions that are
    held, or may be; directions: of all contacts, which may change.
    """

    def __init__(  # noqa: PLR0913  # what a matrix is made of
        self, comm: Any, rows: sparse.csr_array, basis: sparse.csr_array | None, *,
        modes: Array, d: int, may_be_held: Mask, directions: int, options: Petsc,
    ) -> None:  # fmt: skip
        self.comm, self.d, self.options, self.directions = comm, d, options, directions
        self.own = len(may_be_held)
        self.A = _matrix(comm, rows, d)
        self.T = None
        if basis is not None:
            self.T = _matrix(comm, basis, d)
            self.A = self.A.PtAP(self.T)
            self.A.setBlockSize(d)
        self.first, last = self.A.getOwnershipRange()
        assert last - self.first == self.own
        self.A.setOption(petsc().Mat.Option.KEEP_NONZERO_PATTERN, True)
        self.diagonal = self.A.getDiagonal().array.copy()
        self._take_rows(may_be_held)
        self._give_modes(modes)
        self.held = np.zeros(self.own, dtype=bool)
        self.sliding: Sliding | None = None
        self.ksp: Any = None
        self.iterations = self.rebuilt = 0
        self._built = np.zeros(self.own, dtype=bool)
        self._stale, self._rate = False, 0.0

    # ------------------------------------------------------------------ vectors
    def vector(self, values: Array | None = None) -> Any:
        """A vector of PETSc with these own values, (own,), or zeros."""
        v = self.A.createVecRight()
        v.array = 0.0 if values is None else values
        return v

    def total(self, value: float | Array) -> Any:
        """The sum of numbers over all processes."""
        return self.comm.allreduce(value)

    def to_basis(self, v: Array) -> Array:
        """T^-1 v of own values (own,): T = I + C, and C C = 0."""
        if self.T is None:
            return v
        x, y = self.vector(v), self.vector()
        self.T.mult(x, y)
        return 2 * v - y.array_r

    def from_basis(self, v: Array) -> Array:
        """T v of own values (own,)."""
        if self.T is None:
            return v
        x, y = self.vector(v), self.vector()
        self.T.mult(x, y)
        return y.array_r.copy()

    def load_in_basis(self, f: Array) -> Array:
        """T' f of own values (own,)."""
        if self.T is None:
            return f
        x, y = self.vector(f), self.vector()
        self.T.multTranspose(x, y)
        return y.array_r.copy()

    def force_from_basis(self, f: Array) -> Array:
        """T'^-1 f of own values (own,)."""
        return f if self.T is None else 2 * f - self.load_in_basis(f)

    # ------------------------------------------------------------------ set-up
    def _take_rows(self, may_be_held: Mask) -> None:
        """Keep the rows that have an entry in the row or column of a marked direction."""
        PETSc = petsc()
        index = (self.first + np.flatnonzero(may_be_held)).astype(PETSc.IntType)
        own = PETSc.IS().createStride(self.own, self.first, 1, comm=self.comm)
        marked = self.A.createSubMatrix(PETSc.IS().createGeneral(index, comm=self.comm), own)
        columns = np.unique(marked.getValuesCSR()[1])  # symmetric: the rows that touch it
        flags = self.vector()
        flags.setValues(columns.astype(PETSc.IntType), np.ones(len(columns)))
        flags.assemble()
        touched = np.flatnonzero((flags.array_r > 0) | may_be_held)
        rows = (self.first + touched).astype(PETSc.IntType)
        self.touched = self.A.createSubMatrix(
            PETSc.IS().createGeneral(rows, comm=self.comm), own
        )
        self.touched_rows = touched
        pointers, columns, values = self.touched.getValuesCSR()
        self._pattern = pointers, columns, values
        self._of = np.repeat(touched, np.diff(pointers))
        self._on_diagonal = columns == self.first + self._of
        known, place = np.unique(columns, return_inverse=True)
        self._place = place.ravel()
        self._near = PETSc.Vec().createSeq(len(known))
        self._fetch = PETSc.Scatter().create(
            flags, PETSc.IS().createGeneral(known.astype(PETSc.IntType), comm=self.comm),
            self._near, None,
        )  # fmt: skip

    def _give_modes(self, modes: Array) -> None:
        """Rigid motions in the basis, orthonormal, as PETSc asks for."""
        PETSc = petsc()
        kept: list[Any] = []
        for column in modes.T:
            v = self.vector(self.to_basis(np.ascontiguousarray(column)))
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
        pointers, columns, values = self._pattern
        shape = (len(self.touched_rows), self.A.getSize()[1])
        rows = sparse.csr_array((values, columns, pointers), shape=shape)
        at = np.searchsorted(self.touched_rows, dofs)
        d = dofs.shape[1]
        i, j = np.repeat(at, d, axis=1).ravel(), np.tile(dofs + self.first, (1, d)).ravel()
        return np.asarray(rows[i, j]).reshape(-1, d, d)

    def hold(self, held: Mask, sliding: Sliding) -> None:
        """Hold own directions (own,), and let contacts slide by their conditions."""
        PETSc = petsc()
        flags = self.vector(held.astype(float))
        self._fetch.scatter(flags, self._near, mode=PETSc.ScatterMode.FORWARD)
        alone = held[self._of] | (self._near.array_r[self._place] > 0)
        pointers, columns, values = self._pattern
        values = np.where(alone, 0.0, values)
        mine = self._on_diagonal & held[self._of]
        values[mine] = self.diagonal[self._of[mine]]
        index = (self.first + self.touched_rows).astype(PETSc.IntType)
        if len(index):
            self.A.setValuesIJV(pointers, columns, values, rowmap=index)
        self.A.assemble()
        self._add(sliding)
        self.held, self.sliding = held, sliding
        changed = self.total(np.array([(held != self._built).sum(), len(sliding.rows)]))
        self.any_sliding = changed[1] > 0
        self._changed = float(changed[0])

    def _add(self, sliding: Sliding) -> None:
        """Add the symmetric, positive part of G_u in the rows that slide."""
        PETSc = petsc()
        both = sliding.wanted[:, :, None] & sliding.wanted[:, None, :]
        L = np.where(both, sliding.G_u, 0.0)
        L = 0.5 * (L + L.transpose(0, 2, 1))
        sizes, axes = np.linalg.eigh(L)
        L = np.einsum("kia,ka,kja->kij", axes, np.maximum(sizes, 0.0), axes)
        where = (self.first + sliding.rows).astype(PETSc.IntType)
        for rows, block in zip(where, L, strict=True):
            if block.any():
                self.A.setValues(rows, rows, block, addv=PETSc.InsertMode.ADD_VALUES)
        self.A.assemble()

    # ------------------------------------------------------------------ products
    def times(self, x: Any) -> Array:
        """K x, (own,), of a vector of PETSc; held directions included."""
        y, rest = self.A.createVecLeft(), self.touched.createVecLeft()
        self.A.mult(x, y)
        self.touched.mult(x, rest)
        out = y.array_r.copy()
        out[self.touched_rows] = rest.array_r
        return out

    def mult(self, _: Any, x: Any, y: Any) -> None:
        """J x, as PETSc calls it."""
        self.A.mult(x, y)
        if not self.any_sliding:
            return
        s = self.sliding
        assert s is not None
        free = x.copy()
        free.array = np.where(self.held, 0.0, x.array_r)
        rest = self.touched.createVecLeft()
        self.touched.mult(free, rest)
        out = y.array
        whole = np.zeros(self.own)
        whole[self.touched_rows] = rest.array_r
        part = np.einsum("kij,kj->ki", s.G_r, whole[s.rows])
        part += np.einsum("kij,kj->ki", s.G_u, free.array_r[s.rows])
        out[s.rows[s.wanted]] = part[s.wanted]

    # ------------------------------------------------------------------ solving
    def solve(self, b: Array, reduction: float) -> Array:
        """x (own,) with |J x - b| <= reduction |b|, 0 in held directions.

        Raises SingularOperator, on all processes, where GMRES does not get there.
        """
        right = self.vector(np.where(self.held, 0.0, b))
        x = self.vector()
        if right.norm() == 0:
            return x.array_r.copy()
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
        """Make the solver, or let multigrid follow the matrix where it is time to."""
        PETSc = petsc()
        if self.ksp is None:
            J = PETSc.Mat().createPython(self.A.getSizes(), context=self, comm=self.comm)
            J.setUp()
            self.ksp = krylov_of_steps(J, self.A, self.comm)
            self._fresh = True
        else:
            many = self._changed > CHANGED * self.directions
            self._fresh = many or self._stale
            self.ksp.getPC().setReusePreconditioner(not self._fresh)
            self.ksp.setOperators(self.ksp.getOperators()[0], self.A)
        if self._fresh:
            self.rebuilt += 1
            self._built = self.held.copy()
            self.ksp.setUp()


def krylov_of_steps(J: Any, A: Any, comm: Any) -> Any:
    """GMRES for J with multigrid for A, whose aggregates are kept."""
    PETSc = petsc()
    options = PETSc.Options()
    name = PREFIX + "pc_gamg_reuse_interpolation"
    if not options.hasName(name):
        options.setValue(name, True)
    ksp = PETSc.KSP().create(comm)
    ksp.setOperators(J, A)
    ksp.setType("gmres")
    ksp.setPCSide(PETSc.PC.Side.RIGHT)
    ksp.setGMRESRestart(RESTART)
    ksp.getPC().setType("gamg")
    ksp.setOptionsPrefix(PREFIX)
    ksp.setFromOptions()
    return ksp


def _matrix(comm: Any, rows: sparse.csr_array, d: int) -> Any:
    """PETSc's matrix of the own rows (own, n) of all processes."""
    PETSc = petsc()
    own, size = rows.shape
    parts = (rows.indptr.astype(PETSc.IntType), rows.indices.astype(PETSc.IntType), rows.data)
    A = PETSc.Mat().createAIJ(((own, size), (own, size)), bsize=d, csr=parts, comm=comm)
    A.assemble()
    return A
