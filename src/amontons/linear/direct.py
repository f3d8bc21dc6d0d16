"""Sparse direct solvers, best installed one first; a factor that fails its check is not used.

Order by evidence (105 000 unknowns of 3D elasticity, one thread): rslab 9 s, MKL Pardiso 8 s
and 1 GB to install (extra `mkl`), SuperLU of SciPy only as a last resort.  Matrices that are
not symmetric go to MUMPS first where it is installed (extra `mumps`): the whole system of a
Newton step on a wall of 7 240 unknowns takes it 0.16 s, rslab 0.30 s.  Every factor is tried on
a known right-hand side before it is trusted.

The LU of rslab pivots within its supernodes only.  In a saddle point matrix [M, -H; G H^T, 0] a
few of ten thousand pivots come out as rounding, and the factor is wrong in as many directions.
They are lifted to SMALL_PIVOT, as usual with static pivots [LD], and GMRES with the factor as
preconditioner, which has to be the flexible one [AD], removes what that does.

The threads of rslab do not survive a fork, and wait for each other forever in the new process:
there SuperLU takes its place, also in factors that were made before.

[AD] M. Arioli, I. Duff, "Using FGMRES to obtain backward stability in mixed precision",
Electronic Transactions on Numerical Analysis 33 (2009).
[LD] X. Li, J. Demmel, "Making sparse Gaussian elimination scalable by static pivoting",
Proceedings of Supercomputing (1998).
"""

from __future__ import annotations

import importlib.util
import os
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import InvalidInput, MissingDependency, SingularOperator
from ..core.options import check_options
from ..core.threads import asked
from .base import by_columns, stored

Array = NDArray[np.float64]
Solve = Callable[[Array], Array]
REFINE_ABOVE = 1e-14  # relative residual of the trial solve above which solves are refined
CORRECT_ABOVE = 1e-12  # the same after a refinement, from which GMRES takes its place
CORRECTED, CORRECTIONS = 1e-15, 30  # residual and steps at which that ends
SMALL = 50_000  # entries up to which threads cost more than they save
INTERRUPTIBLE = 20_000  # unknowns from which a factorisation takes longer than one waits
FAILURES = (ArithmeticError, RuntimeError, MemoryError, ValueError, ImportError)  # of packages
QUICK_ORDER = 30_000  # unknowns up to which nested dissection costs MUMPS more than it saves
SMALL_PIVOT = 1.5e-8  # of the scaled matrix, the root of rounding as in [LD]
NOISE = 8 * np.finfo(float).eps  # relative, of the rows of the trial solve
RESIDUAL_LIMIT = 1e-6  # relative residual of the trial solve above which a factor is refused


class Backend(Enum):
    """Package that does the factorisation; the value is its import name."""

    RSLAB = "rslab"
    PARDISO = "pypardiso"
    MUMPS = "mumps"
    SUPERLU = "scipy"

    @property
    def installed(self) -> bool:
        """True when there is such a package, and not just a folder of that name."""
        found = importlib.util.find_spec(self.value)
        return found is not None and found.origin is not None

    @property
    def alive(self) -> bool:
        """False for rslab in a process that was forked from one that had loaded it."""
        return self is not Backend.RSLAB or not _Forked.from_rslab


EXTRAS = {Backend.PARDISO: "amontons[mkl]", Backend.MUMPS: "amontons[mumps]"}


class _Forked:
    """What this process has inherited."""

    from_rslab = False

    @classmethod
    def mark(cls) -> None:
        """Note in a forked process whether rslab had been loaded: it may have threads."""
        cls.from_rslab = cls.from_rslab or "rslab" in sys.modules


if hasattr(os, "register_at_fork"):  # not on Windows, which can not fork
    os.register_at_fork(after_in_child=_Forked.mark)


@dataclass(frozen=True)
class Direct:
    """Sparse LDL^T or LU; `backend=None` takes the best installed one and falls back."""

    backend: Backend | None = None
    threads: int = 0  # rslab's; 0: what `amontons.threads` was told, else its own choice

    def __post_init__(self) -> None:
        check_options(self)
        if self.threads < 0:
            text = f"expected 0 (automatic) or more, got {self.threads}"
            raise InvalidInput(text, ("threads",))
        if self.backend is not None and not self.backend.installed:
            raise MissingDependency(
                f"linear solver {self.backend.name}: package {self.backend.value!r} is not "
                f'installed; python -m pip install "{EXTRAS.get(self.backend, "amontons")}" or '
                "use another backend"
            )

    def factor(
        self, matrix: sparse.csc_array, near_nullspace: Array | None = None
    ) -> DirectFactor:
        """A trusted factor of `matrix`, (n, n); raises SingularOperator when there is none."""
        matrix = stored(matrix)
        if matrix.shape[0] != matrix.shape[1]:
            raise InvalidInput(f"matrix: expected a square one, got shape {matrix.shape}")
        if not matrix.has_sorted_indices:
            matrix = matrix.sorted_indices()
        empty = np.flatnonzero(np.diff(matrix.indptr) == 0)
        if empty.size:
            raise SingularOperator(
                f"matrix: column {empty[0]} is empty, the operator is singular"
            )
        if self.backend is not None and not self.backend.alive:
            raise InvalidInput(
                f"linear solver {self.backend.name}: its threads have not survived the fork of "
                "this process; use Direct(), or start processes by spawn"
            )
        chosen = [self.backend] if self.backend else _by_merit(matrix)
        chosen = [b for b in chosen if b.alive]
        reasons = []
        for backend in chosen:
            try:
                made, flops = _FACTORISE[backend](matrix, self.threads or asked())
                solve = _Made(matrix, backend, self.threads, made)
                return DirectFactor(checked(matrix, solve), backend, flops=flops)
            except FAILURES as error:
                reasons.append(f"{backend.value}: {error}")
        raise SingularOperator(
            "matrix: no backend could factorise it (" + "; ".join(reasons) + ")"
        )


def _by_merit(matrix: sparse.csc_array) -> list[Backend]:
    """The installed packages, the best one for the matrix first."""
    found = [backend for backend in Backend if backend.installed]
    if Backend.MUMPS in found and not _symmetric(matrix):
        found.insert(0, found.pop(found.index(Backend.MUMPS)))
    return found


@dataclass(frozen=True, eq=False)
class _Made:
    """Solves with a factor as a package has made it; it stays in the process that made it.

    A copy, and a forked process where the package is not alive, make one of their own.
    """

    matrix: sparse.csc_array
    backend: Backend
    threads: int
    solve: Solve | None

    def __call__(self, b: Array) -> Array:
        """The solution x, shape of b."""
        if self.solve is None or not self.backend.alive:
            return self._again(b)
        return self.solve(b)

    @cached_property
    def _again(self) -> Solve:
        return Direct(threads=self.threads).factor(self.matrix).apply

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.matrix, self.backend, self.threads, None)


@dataclass(frozen=True)
class DirectFactor:
    """A checked sparse factor."""

    apply: Solve
    backend: Backend
    exact: bool = True
    iterations: int = 0
    flops: float | None = None  # floating point operations of the factor, where they are told

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b, shape of b."""
        return self.apply(b)


def checked(matrix: sparse.csc_array, solve: Solve) -> Solve:
    """`solve`, refined or corrected where it is inexact, after a trial with a known solution.

    A singular matrix shows here, whatever the backend says: it makes much of the noise that b
    has, which is there by intent, for sums of round numbers leave none.  So do perturbed
    pivots, which lose digits of indefinite matrices.
    """
    count = np.arange(matrix.shape[0], dtype=float)
    x = np.cos(count)
    rows = abs(matrix) @ np.abs(x)
    b = matrix @ x + NOISE * rows * np.cos(count**2)  # without order
    scale = max(rows.max(initial=0.0), np.finfo(float).tiny)

    def residual_of(found: Array) -> float:
        return float(np.abs(matrix @ found - b).max(initial=0.0) / scale)

    plain, found = solve, solve(b)
    for better, above in ((_Refined, REFINE_ABOVE), (_Corrected, CORRECT_ABOVE)):
        if np.isfinite(found).all() and residual_of(found) > above:
            solve = better(matrix, plain)
            found = solve(b)
    residual = residual_of(found)
    if not np.isfinite(found).all() or residual > RESIDUAL_LIMIT:
        raise SingularOperator(f"trial solve failed with relative residual {residual:.1e}")
    growth = np.abs(found - x).max()
    if growth > 1e-2:  # cond(A) eps of that size: no digit of a solution could be trusted
        raise SingularOperator(f"singular to working precision (trial error {growth:.1e})")
    return solve


@dataclass(frozen=True, eq=False)
class _Refined:
    """`solve` with one step of iterative refinement."""

    matrix: sparse.csc_array
    solve: Solve

    def __call__(self, b: Array) -> Array:
        """The solution x, shape of b."""
        x = self.solve(b)
        return x + self.solve(b - self.matrix @ x)


@dataclass(frozen=True, eq=False)
class _Corrected:
    """Flexible GMRES with `solve`, which is wrong in a few directions, as preconditioner [AD].

    A solve with small pivots is rounded more than a product; it is only used as it came out.
    """

    matrix: sparse.csc_array
    solve: Solve

    def __call__(self, b: Array) -> Array:
        """The solution x, shape of b."""
        return by_columns(self._one, b)

    def _one(self, b: Array) -> Array:
        from scipy.sparse import linalg as sparse_linalg

        factor = sparse_linalg.LinearOperator(self.matrix.shape, self.solve, dtype=float)
        x, _ = sparse_linalg.gcrotmk(
            self.matrix, b, rtol=CORRECTED, atol=0.0, M=factor, m=CORRECTIONS, maxiter=2
        )
        return x


def _symmetric(matrix: sparse.csc_array) -> bool:
    """True when A equals its transpose to a few roundings."""
    least = 1e-13 * np.abs(matrix.data).max(initial=0.0)
    x = np.cos(np.arange(matrix.shape[0]))
    if np.abs(matrix @ x - matrix.T @ x).max(initial=0.0) > least * (1 + len(x)):
        return False  # sums of as many differences: a product tells most matrices apart
    return bool(abs(matrix - matrix.T).max() <= least)


def _rslab(matrix: sparse.csc_array, threads: int) -> tuple[Solve, float | None]:
    import rslab

    rslab.set_log_level("error")  # a singular matrix is reported by our own check
    if _symmetric(matrix):
        return _rslab_factor(rslab.ldlt, matrix, threads)[:2]
    solve, flops, lifted = _rslab_factor(rslab.lu, matrix, threads, SMALL_PIVOT)
    if lifted:
        try:
            checked(matrix, solve)
        except SingularOperator:  # small pivots that were none of rounding
            return _rslab_factor(rslab.lu, matrix, threads)[:2]
    return solve, flops


def _rslab_factor(
    factorise: Callable[..., Any], matrix: sparse.csc_array, threads: int, least: float = 0.0
) -> tuple[Solve, float | None, int]:
    """Solves, operations, and how many pivots were below `least` and lifted to it."""
    from rslab import Interrupt

    stop = Interrupt()
    threads = threads or int(matrix.nnz <= SMALL)  # the factor is the same for any number
    options: dict[str, Any] = {"threads": threads} if threads else {}
    options |= {"preconditioner": least} if least else {}
    if matrix.shape[0] > INTERRUPTIBLE:
        run = partial(factorise, matrix, interrupt=stop, **options)
        factor = _cancelled_by_ctrl_c(run, stop.cancel)
    else:
        factor = factorise(matrix, **options)

    def solve(b: Array) -> Array:
        b = np.ascontiguousarray(b, dtype=float)
        return factor.solve(b) if b.ndim == 1 else factor.solve_many(b)

    found = getattr(factor, "diagnostics", lambda: {})()
    told = [
        stage["flops"] for stage in found.get("stages", []) if stage.get("name") == "factor"
    ]
    lifted = int(found.get("numeric", {}).get("perturbed") or 0)
    return solve, float(told[0]) if told else None, lifted


def _cancelled_by_ctrl_c(run: Callable[[], Any], cancel: Callable[[], None]) -> Any:
    """The result of a long compiled call that would not see Ctrl-C before its end."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        future = pool.submit(run)
        try:
            while not future.done():
                wait([future], timeout=0.1)
        except KeyboardInterrupt:
            cancel()
            raise
        return future.result()


def _pardiso(matrix: sparse.csc_array, threads: int) -> tuple[Solve, float | None]:
    import pypardiso  # pyright: ignore[reportMissingImports]

    solver = pypardiso.PyPardisoSolver()
    # without this every further solver searches the disk for the library, a tenth of a second
    os.environ.setdefault("PYPARDISO_MKL_RT", solver.libmkl._name)
    rows = sparse.csr_matrix(matrix)
    solver.factorize(rows)
    return lambda b: solver.solve(rows, np.asfortranarray(b, dtype=float)), None


def _mumps(matrix: sparse.csc_array, threads: int) -> tuple[Solve, float | None]:
    import mumps

    context = mumps.Context()
    ordering = "amd" if matrix.shape[0] <= QUICK_ORDER else "auto"
    context.factor(sparse.csc_matrix(matrix), ordering=ordering)
    flops = float(context.factor_stats.flops)
    return lambda b: np.asarray(context.solve(np.array(b, dtype=float))), flops


def _superlu(matrix: sparse.csc_array, threads: int) -> tuple[Solve, float | None]:
    from scipy.sparse import csgraph
    from scipy.sparse import linalg as sparse_linalg

    pivots = csgraph.structural_rank(sparse.csc_matrix(matrix))
    if pivots < matrix.shape[0]:  # its kernels would print complaints about their arguments
        raise RuntimeError(f"at most {pivots} of {matrix.shape[0]} pivots are not zero")
    with warnings.catch_warnings():
        warnings.simplefilter("error", sparse_linalg.MatrixRankWarning)
        factor = sparse_linalg.splu(sparse.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A")
    # as floats: the sum of some 10 000 unknowns is beyond the integers of an indptr
    columns, rows = np.diff(factor.L.indptr), np.diff(factor.U.tocsr().indptr)
    flops = 2.0 * float(columns.astype(float) @ rows.astype(float))
    return lambda b: factor.solve(np.asarray(b, dtype=float)), flops


_FACTORISE = {
    Backend.RSLAB: _rslab, Backend.PARDISO: _pardiso, Backend.MUMPS: _mumps,
    Backend.SUPERLU: _superlu,
}  # fmt: skip
