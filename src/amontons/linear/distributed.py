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
A is stored once, as own block rows (`spread_rows`); PETSc has a copy only where another
preconditioner of its own is asked for.

Flexible GMRES is preconditioned from the right by multigrid.  Its aggregates are made once.
Its coarse matrices follow (`spread_levels`), and are made anew only when an iteration gains far
less than it did; another preconditioner also when many directions have changed.

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
from .spread_levels import SpreadCycle, chosen_products, give_modes, set_gamg, spread_matrix
from .spread_rows import SpreadRows

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
RESTART = 30  # vectors that GMRES keeps
CHANGED = 0.2  # share of the contact directions that may change before multigrid follows
WORSE = 3.0  # iterations per digit, compared with those of fresh coarse matrices
FAINT = 1e-6  # of the diagonal: keeps a coarse matrix regular whose functions are all cut off
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

    rows: gives K of the own unknowns in blocks (own, n), columns in the numbers of PETSc,
    where processes follow one another, and keeps no copy; basis: T = I + C (own, n) in which
    contact is seen on one side, C C = 0, None where nobody has one (the same on all processes).
    modes: makes the rigid motions (own, k), which are long; d: unknowns a node; fixed, contact
    (own,): directions that supports hold, and those of contacts, whose rows and columns change
    from step to step.
    """

    def __init__(  # noqa: PLR0913  # what a matrix is made of
        self, comm: Any, rows: Callable[[], sparse.bsr_array], basis: sparse.bsr_array | None,
        *, modes: Callable[[], Array], d: int, fixed: Mask, contact: Mask, options: Petsc,
    ) -> None:  # fmt: skip
        self.comm, self.d, self.options, self._modes = comm, d, options, modes
        self.own, self.directions = len(fixed), int(comm.allreduce(int(contact.sum())))
        self.T = None if basis is None else spread_matrix(comm, basis, d)
        own = rows() if self.T is None else _in_basis(comm, rows(), self.T, d)
        self.A = SpreadRows(comm, own, d)
        del own
        size = (self.own, d * int(self.A.starts[-1]))
        self.product = petsc().Mat().createPython((size, size), Product(self.A), comm=comm)
        self.product.setUp()
        self._x, self._y = self.product.createVecs()
        self._take_rows(fixed | contact)
        self.diagonal = self.A.diagonal()
        self._in_matrix = np.where(fixed, FAINT, 1.0) * self.diagonal
        self._changing = self._beside(contact)
        self.held = np.zeros(self.own, dtype=bool)
        self.ksp: Any = None
        self.cycle: SpreadCycle | None = None
        self.other: Any = None
        self._fresh = True
        self.iterations = self.rebuilt = 0
        self._built = np.zeros(self.own, dtype=bool)
        self._stale, self._rate = False, 0.0

    def destroy(self) -> None:
        """Give the memory back; all processes have to, and have no use of this object then."""
        for part in (self.cycle, self.ksp, self.other, self.product, self.A, self.T, self._x,
                     self._y):  # fmt: skip
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
    def _beside(self, marked: Mask) -> Index:
        """Own nodes in whose rows or columns a marked direction has an entry."""
        A = self.A
        nodes = np.asarray(self._at_local(marked).reshape(-1, self.d).any(axis=1))
        near = np.logical_or.reduceat(nodes[A.tiles.indices], A.tiles.indptr[:-1])
        return np.flatnonzero(near)  # symmetric: who is in my rows has me in its own

    def _take_rows(self, may_be_held: Mask) -> None:
        """Keep the rows that have an entry in the row or column of a marked direction."""
        inside = np.arange(self.d)
        rows = (self._beside(may_be_held)[:, None] * self.d + inside).ravel()
        pointers, columns, self._places = self.A.slots(rows)
        values = self.A.tiles.data.reshape(-1)[self._places]
        self.touched_rows, self._pattern = rows, (pointers, columns, values)
        self._of = np.repeat(rows.astype(np.int32), np.diff(pointers))
        self._on_diagonal = columns == self._of
        shape = len(rows), self.d * self.A.local
        self.touched = sparse.csr_array((values, columns, pointers), shape=shape)

    def _at_local(self, mine: Mask) -> Mask:
        """A mask of own directions with those of ghosts behind, (local d,)."""
        return self.A.at_local(mine.astype(float)) > 0

    def blocks(self, dofs: Index) -> Array:
        """K in the blocks of own unknowns dofs (k, d) that may be held, (k, d, d)."""
        if not len(dofs):
            return np.zeros((0, self.d, self.d))
        at = np.searchsorted(self.touched_rows, dofs)
        d = dofs.shape[1]
        i, j = np.repeat(at, d, axis=1).ravel(), np.tile(dofs, (1, d)).ravel()
        return np.asarray(self.touched[i, j]).reshape(len(dofs), d, d)

    def hold(self, held: Mask, sliding: Sliding) -> None:
        """Hold own directions (own,), and let contacts slide by their conditions."""
        _, columns, values = self._pattern
        free = np.where(self._at_local(held)[columns], 0.0, values)
        values = np.where(held[self._of], 0.0, free)
        mine = self._on_diagonal & held[self._of]
        values[mine] = self._in_matrix[self._of[mine]]
        self.held = held
        self._let_slide(values, free, sliding)
        self.A.write(self._places, values, self.touched_rows[:: self.d] // self.d)
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
        beside = columns[entry[0]] - rows[of, 0]  # direction of the same node
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
        out = self.A.times(x)
        out[self.touched_rows] = self.touched @ self.A.at_local(x)
        return out

    # ------------------------------------------------------------------ solving
    def solve(self, b: Array, reduction: float) -> Array:
        """x (own,) with |A x - b| <= reduction |b|, 0 in held directions.

        Raises SingularOperator, on all processes, where GMRES does not get there.
        """
        right, x = self._y, self._x
        b = np.where(self.held, 0.0, b)
        right.array = b
        if right.norm() == 0:
            return np.zeros(self.own)
        self._prepare()
        right.array = b  # levels that were made have used the vector
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
            self.ksp = krylov_of_steps(self.product, OfFree(self))
            self._fresh = True
        else:
            many = self.cycle is None and self._changed > CHANGED * self.directions
            self._fresh = many or self._stale
        if self._fresh:
            self._make_levels()
        if self.cycle is not None:
            self.cycle.follow(self._below())

    def _make_levels(self) -> None:
        """Multigrid of the matrix as it is now, or what else the preconditioner is."""
        self.rebuilt += 1
        self._built = self.held.copy()
        for part in (self.cycle, self.other):
            if part is not None:
                part.destroy()
        self.cycle = self.other = None
        modes = self._modes()
        if self.T is not None:
            modes = np.stack([self.to_basis(v) for v in modes.T.copy()], axis=1)
        if petsc().Options().getString(PREFIX + "pc_type", "gamg") == "gamg":
            self.cycle = SpreadCycle(self.A, modes, self._changing)
        else:
            self.other = preconditioner(self.A, modes)

    def _below(self) -> Array:
        """Blocks of what coarse matrices are made of, in rows that contacts change."""
        assert self.cycle is not None
        t, at = self.A.tiles, self.cycle.blocks
        blocks = t.data[at]
        nodes = self._changing
        row = np.repeat(nodes, np.diff(t.indptr)[nodes])
        own = np.flatnonzero(t.indices[at] == row)  # one a node, in the order of nodes
        held = self.held.reshape(-1, self.d)[nodes]
        faint = FAINT * self.diagonal.reshape(-1, self.d)[nodes]
        for k in range(self.d):
            blocks[own[held[:, k]], k, k] = faint[held[:, k], k]
        return blocks


class Product:
    """The matrix as PETSc's Krylov methods call it."""

    def __init__(self, rows: SpreadRows) -> None:
        self.rows = rows

    def mult(self, _: Any, x: Any, y: Any) -> None:
        """Put A x into y."""
        y.array = self.rows.times(x.array_r)


class OfFree:
    """A preconditioner, as PETSc calls it, that leaves held directions at zero."""

    def __init__(self, matrix: SpreadMatrix) -> None:
        self.matrix = matrix

    def apply(self, _: Any, x: Any, y: Any) -> None:
        """Put the preconditioner of x into y."""
        if self.matrix.cycle is not None:
            y.array = self.matrix.cycle.apply(x.array_r)
        else:
            self.matrix.other.apply(x, y)
        y.array[self.matrix.held] = 0.0


def preconditioner(rows: SpreadRows, modes: Array) -> Any:
    """One of PETSc that the options ask for instead of multigrid, of a copy of the matrix."""
    A = spread_matrix(rows.comm, rows.whole(), rows.d)
    give_modes(A, modes)
    pc = petsc().PC().create(rows.comm)
    pc.setOperators(A)
    set_gamg(pc)
    with chosen_products(rows.comm):
        pc.setUp()
    A.destroy()  # the preconditioner has it
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


def _in_basis(comm: Any, rows: sparse.bsr_array, T: Any, d: int) -> sparse.bsr_array:
    """Own rows of T' K T, of K in the coordinates of nodes."""
    K = spread_matrix(comm, rows, d)
    A = K.PtAP(T)
    pointers, columns, values = A.getValuesCSR()
    shape = len(pointers) - 1, rows.shape[1]
    for part in (K, A):
        part.destroy()
    return sparse.csr_array((values, columns, pointers), shape=shape).tobsr((d, d))
