"""The linear system of a linearised solution, solved for changes or, transposed, for adjoints.

With F the change of the load, c that of the law (`linearised`) and h a change of u at rest,

    M dv - H dr = F,   A dr + B (H^T dv + h) = c,   du = H^T dv + h                   (1)

in the global form; dr alone with W in the place of H^T M^-1 H in the Delassus form.  For
cotangents v~, r~, u~ of v, r and u the transposed system

    M x + H B^T y = v~ + H u~,   A^T y - H^T x = r~                                   (2)

has the adjoints x (n,) of F and y (nc, d) of c: v~.dv + r~.dr + u~.du = x.F + y.c + z.h with
z = u~ - B^T y.  A cotangent of any size costs one solve of (2), a direction one of (1).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.arrays import expect_shape, finite, sparse_matrix
from ...core.errors import InvalidInput, SingularOperator
from ...linear import Direct
from ...linear.dense import DENSE_LIMIT
from ...problem.friction import Form, FrictionProblem
from ...problem.matrices import OPERATORS
from .linearised import Linearised

Array = NDArray[np.float64]
LARGE = 60_000  # unknowns of a mesh from which cycles take the place of a factor
DENSE = 3_000  # rows of W up to which the system is dense
PROBES = 3  # solves by which the distance of a sparse system is estimated
ROUNDING = 1e-14  # relative distance to a singular system up to which it is one


class Change(NamedTuple):
    """dr, du (nc, d) and dv (n,), None in the Delassus form."""

    r: Array
    u: Array
    v: Array | None


class Adjoint(NamedTuple):
    """y, z (nc, d) and x (n,), None in the Delassus form; see the module."""

    y: Array
    z: Array
    x: Array | None


class System(ABC):
    """Solves (1) and (2)."""

    @cached_property
    @abstractmethod
    def distance(self) -> float | None:
        """To the nearest singular system, in scaled variables of norm near 1; None: unknown.

        Of a dense system an estimate of |J| |J^-1|, else a bound from above by some solves.
        """

    @abstractmethod
    def change(self, F: Array | None, c: Array, h: Array) -> Change:
        """(1); F (n,), None in the Delassus form."""

    @abstractmethod
    def adjoint(self, v: Array | None, r: Array, u: Array) -> Adjoint:
        """(2)."""


def system_of(at: Linearised) -> System:
    """The system of a solution, by size: dense, factorised, or by multigrid cycles."""
    problem = at.problem
    if problem.form is Form.DELASSUS:
        return DelassusSystem(at)
    if problem.law.plain is problem.law and (
        isinstance(problem.M, OPERATORS) or problem.unknowns > LARGE
    ):
        from .cycles import CycleSystem

        return CycleSystem(at)
    return GlobalSystem(at)


class DelassusSystem(System):
    """(1) without v: (A + B W) dr = c - B h, du = W dr + h."""

    def __init__(self, at: Linearised) -> None:
        self.at, problem = at, at.problem
        assert problem.W is not None
        self.W: Any = problem.W
        root = np.sqrt(np.where(problem.rho > 0, problem.rho, 1.0))
        m = self.W.shape[0]
        if sparse.issparse(self.W) and m <= DENSE and 8.0 * m * m <= DENSE_LIMIT:
            self.W = self.W.toarray()
        of_r = (at.A != 0).any(axis=2)  # rows in the unit of r, others in that of u
        self.rows = np.where(of_r, 1 / root[:, None], root[:, None]).ravel()
        self.columns = np.repeat(root, problem.dimension)
        A, B = _diagonal(at.A), _diagonal(at.B)
        if sparse.issparse(self.W):
            J: Any = sparse.csr_array(A + B @ self.W)
            J = sparse.diags_array(self.rows) @ J @ sparse.diags_array(self.columns)
            self.factors: Any = _Sparse(sparse.csc_array(J))
        else:
            J = A.toarray() + B @ self.W
            self.factors = _Dense(self.rows[:, None] * J * self.columns)

    @cached_property
    def distance(self) -> float | None:
        """See `System`."""
        if isinstance(self.factors, _Dense):
            return self.factors.distance
        return self.factors.probed(self._inverse, len(self.rows))

    def _inverse(self, c: Array, transposed: bool) -> Array:
        return self.factors.solve(c, transposed=transposed)

    def change(self, F: Array | None, c: Array, h: Array) -> Change:
        """See `System`."""
        right = (c - np.einsum("kij,kj->ki", self.at.B, h)).ravel()
        r = self.columns * self.factors.solve(self.rows * right, transposed=False)
        return Change(r.reshape(h.shape), (self.W @ r).reshape(h.shape) + h, None)

    def adjoint(self, v: Array | None, r: Array, u: Array) -> Adjoint:
        """See `System`."""
        right = r.ravel() + self.W.T @ u.ravel()
        y = self.rows * self.factors.solve(self.columns * right, transposed=True)
        y = y.reshape(r.shape)
        return Adjoint(y, u - np.einsum("kji,kj->ki", self.at.B, y), None)


class GlobalSystem(System):
    """(1) as one sparse matrix: M may be singular, where contact alone holds a body."""

    def __init__(self, at: Linearised) -> None:
        self.at, p = at, at.problem.assembled()
        assert p.M is not None and p.H is not None
        self.problem: FrictionProblem = p
        M: Any = p.M
        diagonal = np.abs(M.diagonal())
        typical = float(np.median(diagonal[diagonal > 0])) if (diagonal > 0).any() else 1.0
        own = 1 / np.sqrt(np.where(diagonal > 0, diagonal, typical))
        root = np.sqrt(np.where(p.rho > 0, p.rho, 1.0))
        of_r = (at.A != 0).any(axis=2)
        rows = np.where(of_r, 1 / root[:, None], root[:, None]).ravel()
        self.rows = np.concatenate([own, rows])
        self.columns = np.concatenate([own, np.repeat(root, p.dimension)])
        A, B = _diagonal(at.A), _diagonal(at.B)
        J: Any = sparse.block_array([[M, -p.H], [B @ p.H.T, A]], format="csr")
        J = sparse.diags_array(self.rows) @ J @ sparse.diags_array(self.columns)
        self.factors = _Sparse(sparse.csc_array(J))

    @cached_property
    def distance(self) -> float | None:
        """See `System`."""
        return self.factors.probed(self._inverse, self.at.A.shape[0] * self.problem.dimension)

    def _inverse(self, c: Array, transposed: bool) -> Array:
        """Of the system in reactions alone, scaled."""
        n = self.problem.unknowns
        full = np.concatenate([np.zeros(n), c])
        return self.factors.solve(full, transposed=transposed)[n:]

    def change(self, F: Array | None, c: Array, h: Array) -> Change:
        """See `System`."""
        assert F is not None and self.problem.H is not None
        right = c - np.einsum("kij,kj->ki", self.at.B, h)
        full = self.rows * np.concatenate([F, right.ravel()])
        x = self.columns * self.factors.solve(full, transposed=False)
        v, r = x[: len(F)], x[len(F) :].reshape(h.shape)
        return Change(r, (self.problem.H.T @ v).reshape(h.shape) + h, v)

    def adjoint(self, v: Array | None, r: Array, u: Array) -> Adjoint:
        """See `System`."""
        H: Any = self.problem.H
        load = H @ u.ravel() + (0.0 if v is None else v)
        full = self.columns * np.concatenate([load, r.ravel()])
        found = self.rows * self.factors.solve(full, transposed=True)
        x, y = found[: len(load)], found[len(load) :].reshape(r.shape)
        return Adjoint(y, u - np.einsum("kji,kj->ki", self.at.B, y), x)


class _Dense:
    """An LU factor, in scaled variables."""

    def __init__(self, J: Array) -> None:
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", linalg.LinAlgWarning)  # told by the distance
            self.lu = linalg.lu_factor(J)
        self.J = J
        gecon: Any = linalg.get_lapack_funcs("gecon", (J,))
        size = float(np.abs(J).sum(axis=0).max(initial=0.0))
        self.distance = float(gecon(self.lu[0], size)[0]) if len(J) else 1.0
        if not self.distance > ROUNDING:
            raise SingularOperator(SINGULAR)

    def solve(self, b: Array, *, transposed: bool) -> Array:
        found: Any = linalg.lu_solve(self.lu, b, trans=int(transposed))
        return found


class _Sparse:
    """Factors of a sparse matrix, and of its transpose, each when it is needed."""

    def __init__(self, J: sparse.csc_array) -> None:
        self.J = J

    @cached_property
    def _factor(self) -> Any:
        return _factor(self.J)

    @cached_property
    def _transposed(self) -> Any:
        return _factor(sparse.csc_array(self.J.T))

    def solve(self, b: Array, *, transposed: bool) -> Array:
        found = (self._transposed if transposed else self._factor).solve(b)
        if not np.isfinite(found).all():
            raise SingularOperator(SINGULAR)
        return found

    def probed(self, apply: Callable[[Array, bool], Array], size: int) -> float:
        """1 / growth of a vector under J^-1, of which |J^-1| is not less: see `System`.

        apply(c, transposed) is the inverse in scaled variables of the contacts.
        """
        transposed = "_transposed" in self.__dict__
        c = np.cos(np.arange(1.0, size + 1.0))
        growth = 1.0
        for _ in range(PROBES if size else 0):
            c = apply(c / np.linalg.norm(c), transposed)
            growth = max(growth, float(np.linalg.norm(c)))
        return 1 / growth


SINGULAR = (
    "gradient: the linearised problem is singular: at a fold of the curve of solutions, or "
    "where reactions are not unique (more contacts than the bodies can tell apart)"
)


def _factor(J: sparse.csc_array) -> Any:
    try:
        return Direct().factor(J)
    except SingularOperator as reason:
        raise SingularOperator(f"{SINGULAR}: {reason}") from reason


def _diagonal(blocks: Array) -> sparse.csr_array:
    """The block diagonal matrix of blocks (nc, d, d)."""
    k, d, _ = blocks.shape
    tiles = sparse.bsr_array((blocks, np.arange(k), np.arange(k + 1)), shape=(k * d, k * d))
    out = sparse.csr_array(tiles)
    out.eliminate_zeros()
    return out


def rows(name: str, given: Any, shape: tuple[int, ...]) -> Array:
    """A change or cotangent as an array; None is zero.  Raises InvalidInput for others."""
    if given is None:
        return np.zeros(shape)
    try:
        out = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name}: expected numbers of shape {shape}") from None
    if out.shape != shape:
        raise InvalidInput(f"{name}: expected shape {shape}, got {out.shape}")
    if not np.isfinite(out).all():
        raise InvalidInput(f"{name}: holds a number that is not finite")
    return out


def operator(name: str, given: Any, shape: tuple[int, int]) -> Any:
    """A change of a matrix: an array, a sparse matrix, or what has a shape and @."""
    if sparse.issparse(given) or not hasattr(given, "__matmul__"):
        given = sparse_matrix(name, given) if sparse.issparse(given) else finite(name, given, 2)
    elif isinstance(given, np.ndarray):
        given = finite(name, given, 2)
    expect_shape(name, getattr(given, "shape", shape), shape)
    return given
