"""The corrector of Moore-Penrose continuation, on one smooth piece or on whatever is active.

    J (dy) + Jp dp = -H,   (T, d)_w = 0        one Newton step d = (dy, dp)
    J T'y + Jp T'p = 0,    (T, T')_w = 1       and the tangent with it

Both systems share one bordered matrix, so a step costs one factorisation ([LR] algorithm 1,
step 4; the weighted product stands in both conditions here).

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from .path import Matrix, PathProblem, resolution_of, weight_of

Array = NDArray[np.float64]
ROUNDED = 1e-12  # residual of a trial solve, relative, of a factor that is good enough
UNIT = 4 * float(np.finfo(float).eps)  # relative, what no corrector can go below


@dataclass(frozen=True, eq=False)
class Spot:
    """A point (y, p) and the unit tangent (ty, tp) there.

    sign: of the determinant of the bordered matrix, which changes at branch points only; 0
    where it is not known.
    """

    y: Array
    p: float
    ty: Array
    tp: float
    sign: int = 0

    def ahead(self, step: float) -> tuple[Array, float]:
        """The point at a distance along the tangent."""
        return self.y + step * self.ty, self.p + step * self.tp


@dataclass(frozen=True, eq=False)
class Tolerances:
    """When the corrector has converged, and when it has failed.

    residual bounds |H|, change the weighted length of the last correction; both at least what
    rounding resolves.
    """

    residual: float
    change: float
    corrections: int


class Curve:
    """H = 0 with the selection functions of one piece, or with the active ones (piece None)."""

    def __init__(self, problem: PathProblem, n: int, piece: Hashable | None = None) -> None:
        self.problem, self.piece = problem, piece
        self.weight = weight_of(problem, n)

    def residual(self, y: Array, p: float) -> Array:
        """H, (n,)."""
        if self.piece is None:
            return self.problem.residual(y, p)
        return self.problem.residual_of(self.piece, y, p)

    def jacobian(self, y: Array, p: float) -> tuple[Matrix, Array]:
        """Its derivatives by y and p."""
        if self.piece is None:
            return self.problem.jacobian(y, p)
        return self.problem.jacobian_of(self.piece, y, p)

    def product(self, ay: Array, ap: float, by: Array, bp: float) -> float:
        """The weighted product."""
        return float(self.weight * (ay @ by) + ap * bp)

    def length(self, y: Array, p: float) -> float:
        """The weighted length."""
        return float(np.sqrt(self.product(y, p, y, p)))

    def unit(self, ty: Array, tp: float) -> tuple[Array, float]:
        """A direction made one of length 1."""
        size = self.length(ty, tp)
        return ty / size, tp / size

    def tangent(self, y: Array, p: float, ty: Array, tp: float) -> tuple[Array, float]:
        """The unit tangent at (y, p) that agrees in sense with a given direction.

        Raises LinAlgError where it is not unique, or orthogonal to that direction.
        """
        right = np.zeros(len(y) + 1)
        right[-1] = 1.0
        answer = Factored(self.bordered(*self.jacobian(y, p), ty, tp)).solve(right)
        return self.unit(answer[:-1], float(answer[-1]))

    def any_tangent(self, y: Array, p: float) -> tuple[Array, float]:
        """The unit tangent with growing parameter, where it grows or falls along the curve."""
        try:
            ty, tp = self.tangent(y, p, np.zeros_like(y), 1.0)
            if tp > 1e-8:
                return ty, tp
        except np.linalg.LinAlgError:
            pass
        border = np.random.default_rng(0).standard_normal(len(y) + 1)
        ty, tp = self.tangent(y, p, border[:-1], float(border[-1]))
        sign = -1.0 if tp < 0 else 1.0
        return sign * ty, sign * tp

    def correct(
        self, y: Array, p: float, ty: Array, tp: float, tolerances: Tolerances
    ) -> tuple[Spot, int] | None:
        """(point and tangent, Newton steps) from a prediction; None without convergence."""
        for count in range(1, tolerances.corrections + 2):
            H = self.residual(y, p)
            right = np.zeros((len(y) + 1, 2))
            right[:-1, 0], right[-1, 1] = -H, 1.0
            try:
                factor = Factored(self.bordered(*self.jacobian(y, p), ty, tp))
                answer = factor.solve(right)
            except np.linalg.LinAlgError:
                return None
            dy, dp = answer[:-1, 0], float(answer[-1, 0])
            y, p = y + dy, p + dp
            ty, tp = self.unit(answer[:-1, 1], float(answer[-1, 1]))
            if self.length(dy, dp) <= max(tolerances.change, UNIT * self.length(y, p)):
                rest = float(np.linalg.norm(self.residual(y, p)))
                if not np.isfinite(rest):  # nor are derivatives, as in inverted cells
                    return None
                if rest <= tolerances.residual or rest <= self.rounding(y, p):
                    return Spot(y, p, ty, tp, factor.sign), count
        return None

    def rounding(self, y: Array, p: float) -> float:
        """What the last digits of y and p change in H, or its resolution if that is more."""
        J, Jp = self.jacobian(y, p)
        least = resolution_of(self.problem)
        return least + UNIT * float(np.linalg.norm(abs(J) @ np.abs(y) + np.abs(Jp * p)))

    def orientation(self, y: Array, p: float, ty: Array, tp: float) -> int:
        """Sign of the determinant of the matrix bordered by a direction, 0 if singular."""
        return determinant_sign(self.bordered(*self.jacobian(y, p), ty, tp))

    def at_parameter(self, y: Array, p: float, tolerances: Tolerances) -> Array | None:
        """y after Newton steps at a fixed parameter, None without convergence."""
        for _ in range(2 * tolerances.corrections):
            try:
                change = Factored(self.jacobian(y, p)[0]).solve(-self.residual(y, p))
            except np.linalg.LinAlgError:
                return None
            y = y + change
            if self.length(change, 0.0) <= max(tolerances.change, UNIT * self.length(y, p)):
                return y
        return None

    def on_plane(
        self, y: Array, p: float, ty: Array, tp: float, tolerances: Tolerances
    ) -> tuple[Array, float] | None:
        """The point (y, p) of the curve on the plane through a point across a direction.

        By Newton steps; None without convergence.
        """
        for _ in range(2 * tolerances.corrections):
            right = np.append(-self.residual(y, p), 0.0)
            try:
                change = Factored(self.bordered(*self.jacobian(y, p), ty, tp)).solve(right)
            except np.linalg.LinAlgError:
                return None
            y, p = y + change[:-1], p + float(change[-1])
            size = self.length(change[:-1], float(change[-1]))
            if size <= max(tolerances.change, UNIT * self.length(y, p)):
                return y, p
        return None

    def bordered(self, J: Matrix, Jp: Array, ty: Array, tp: float) -> Matrix:
        """[J Jp; w T], (n + 1, n + 1), of derivatives and a tangent."""
        row = self.weight * ty
        if isinstance(J, np.ndarray):
            return np.block([[J, Jp[:, None]], [row[None, :], np.array([[tp]])]])
        return sparse.csc_array(
            sparse.block_array([[J, sparse.csc_array(Jp[:, None])],
                                [sparse.csc_array(row[None, :]), sparse.csc_array([[tp]])]])
        )  # fmt: skip


class Factored:
    """LU factors of a dense or sparse matrix; raises LinAlgError for a singular one.

    Of a sparse one the last row and column are kept apart, and the rest is factorised: in a
    bordered matrix they are full and would fill the factors.  Where the rest is singular, as at
    a smooth fold, the whole is factorised.
    """

    def __init__(self, matrix: Matrix) -> None:
        self._dense = isinstance(matrix, np.ndarray)
        if isinstance(matrix, np.ndarray):
            if not np.isfinite(matrix).all():
                raise np.linalg.LinAlgError("the matrix is not finite")
            self._lu, self._pivots, info = lapack.dgetrf(matrix)
            if info > 0:
                raise np.linalg.LinAlgError("the matrix is singular")
        else:
            self._matrix = sparse.csc_array(matrix)
            self._split = len(self._matrix.indptr) > 2 and self._apart()
            if not self._split:
                self._factorise_whole()

    def _apart(self) -> bool:
        """Factorise all but the last row and column; False where that is singular."""
        A = self._matrix
        column, row = A[:-1, [-1]].toarray().ravel(), A[[-1], :-1].toarray().ravel()
        try:
            self._factor: Any = splu(sparse.csc_array(A[:-1, :-1]), permc_spec="MMD_AT_PLUS_A")
        except RuntimeError:
            return False
        self._z, self._row = self._factor.solve(column), row
        self._corner = float(A[-1, -1] - row @ self._z)
        trial = np.cos(np.arange(len(A.indptr) - 1.0))
        size = float((abs(A) @ np.abs(trial)).max())
        answer = self._solve_split(A @ trial)
        if not np.isfinite(answer).all():
            return False
        return float(np.abs(A @ (trial - answer)).max()) <= ROUNDED * size

    def _factorise_whole(self) -> None:
        try:
            self._factor = splu(self._matrix)
        except RuntimeError as reason:  # "Factor is exactly singular"
            raise np.linalg.LinAlgError(str(reason)) from reason

    @np.errstate(all="ignore")  # a singular rest shows in the trial solve
    def _solve_split(self, right: Array) -> Array:
        """By block elimination, refined once."""
        answer = self._eliminated(right)
        return answer + self._eliminated(right - self._matrix @ answer)

    def _eliminated(self, right: Array) -> Array:
        x = self._factor.solve(right[:-1])
        last = (right[-1] - self._row @ x) / self._corner
        return np.concatenate([x - np.multiply.outer(self._z, last), np.asarray(last)[None]])

    def solve(self, right: Array) -> Array:
        """The solution, finite."""
        if self._dense:
            answer = lapack.dgetrs(self._lu, self._pivots, right)[0]
        else:
            answer = (self._solve_split if self._split else self._factor.solve)(right)
        if not np.isfinite(answer).all():
            raise np.linalg.LinAlgError("the matrix is singular")
        return answer

    @property
    def sign(self) -> int:
        """Sign of the determinant."""
        if self._dense:
            moved = int((self._pivots != np.arange(len(self._pivots))).sum())
            return int(np.sign(np.diagonal(self._lu)).prod()) * (-1) ** moved
        factor = self._factor
        signs = np.sign(factor.U.diagonal()).prod()
        signs *= np.sign(self._corner) if self._split else 1.0
        return int(signs * _parity(factor.perm_r) * _parity(factor.perm_c))


def determinant_sign(matrix: Matrix) -> int:
    """Sign of the determinant of a dense or sparse matrix, 0 where it is singular."""
    try:
        return Factored(matrix).sign
    except np.linalg.LinAlgError:
        return 0


def _parity(permutation: NDArray[np.int64]) -> int:
    """1 for an even permutation, -1 for an odd one: by the number of its cycles."""
    n = len(permutation)
    graph = sparse.csr_array((np.ones(n), (np.arange(n), permutation)), shape=(n, n))
    cycles = connected_components(graph, directed=False, return_labels=False)
    return (-1) ** int(n - cycles)
