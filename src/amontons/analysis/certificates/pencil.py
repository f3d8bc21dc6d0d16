"""Multipliers x for which A(x) - t B(x) stays positive definite up to the largest t.

A is to be positive definite, B may be indefinite; both depend smoothly on x.  Minimised is the
largest L of B v = L A v, t = 1 / L, smoothed over the largest few: log L + log(sum exp(soft
(L_i / L - 1))) / soft, whose derivative comes from the eigenvectors.  All of it is floating
point, of the precision in which A and B come; what was found has to be proved.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular

from ...core.clock import Deadline
from ...core.errors import TimeUp
from .descent import Descent, Point

Array = NDArray[np.float64]
INDEFINITE = 1e3  # the value where A is not positive definite
FARTHEST = 300.0  # size of x, logarithms among them, beyond which nothing is tried
DENSE = 400  # rows up to which all eigenvalues are computed
KEPT, PART = 40, 40  # largest ones that count beyond, at least; rows of which one more counts
NEW = 8  # random directions among those where the block begins
DEPTH = 3  # products of the block Krylov space in which they are looked for
TILE = 256  # rows of a matrix and its transpose that fit into the cache together
EIGENVALUES = (2e6, 2e3, 1.0)  # operations: always, per square and cube of rows
SHARPENED = 4  # times that the largest eigenvalue is looked for before a proof


class Pencil(ABC):
    """A(x) and B(x) of `size` rows, and the search for x."""

    subspace: Array | None = None  # of the largest eigenvalues at the last x

    @property
    @abstractmethod
    def size(self) -> int:
        """Rows of A and B."""

    @abstractmethod
    def energy(self, x: Array) -> Array:
        """A (size, size)."""

    @abstractmethod
    def times(self, x: Array, v: Array) -> Array:
        """B v for columns v."""

    @abstractmethod
    def slope(self, x: Array, w: Array, v: Array, p: Array) -> Array:
        """Gradient of sum p_i v_i (B - w_i A) v_i by x, v_i the columns of v."""

    @property
    def operations(self) -> float:
        """Of one evaluation: all eigenvalues, or a factorisation and products with it."""
        n = float(self.size)
        if n > DENSE:
            return n**3 / 3 + 5.0 * DEPTH * (self.kept + NEW) * n**2
        always, square, cube = EIGENVALUES
        return always + square * n**2 + cube * n**3

    @property
    def kept(self) -> int:
        """Largest eigenvalues that count: more contacts have more places where one is large."""
        return max(KEPT, self.size // PART)

    @cached_property
    def chance(self) -> np.random.Generator:
        """The same numbers in every run."""
        return np.random.default_rng(0)

    @cached_property
    def remembered(self) -> list[tuple[Array, Array, float]]:
        """Of the last search: what bends one value bends a sharper one too."""
        return []

    def factor(self, x: Array) -> Array | None:
        """L (size, size) of A = L L^T, None where A is indefinite."""
        try:  # A.T is A, and what Cholesky's method overwrites without a copy
            return cholesky(self.energy(x).T, lower=True, overwrite_a=True, check_finite=False)
        except LinAlgError:
            return None

    def largest(self, x: Array, root: Array) -> tuple[Array, Array] | None:
        """(L, v) of the largest few of B v = L A v, ascending; None without finite ones.

        root: of A at x.
        """

        def product(y: Array) -> Array:
            v = solve_triangular(root, y, lower=True, trans=1, check_finite=False)
            return solve_triangular(root, self.times(x, v), lower=True, check_finite=False)

        size = self.size
        if size <= DENSE:
            C = product(np.eye(size, dtype=root.dtype))
            few = (max(0, size - self.kept), size - 1)
            w, y = eigh((C + C.T) / 2, check_finite=False, subset_by_index=few)
        else:
            w, y = self._in_subspace(product, root)
        if not (len(w) and np.isfinite(w).all()):  # A is singular to rounding
            return None
        return w, solve_triangular(root, y, lower=True, trans=1, check_finite=False)

    def _in_subspace(
        self, product: Callable[[Array], Array], root: Array
    ) -> tuple[Array, Array]:
        """Ritz values and vectors of a block Krylov space that begins with the last ones.

        And with random directions: what the last ones are across is not missed for long.
        """
        new = NEW if self.subspace is not None else self.kept
        begin = self.chance.standard_normal((len(root), new))
        depth = DEPTH
        if self.subspace is None:
            depth = 3 * DEPTH
        else:
            begin = np.hstack([self.subspace, begin])
        Q = np.linalg.qr(begin.astype(root.dtype, copy=False))[0]
        blocks, images = [Q], []
        for k in range(depth):
            images.append(product(blocks[-1]))
            if k + 1 < depth:
                basis = np.hstack(blocks)
                new = images[-1] - basis @ (basis.T @ images[-1])
                new -= basis @ (basis.T @ new)
                blocks.append(np.linalg.qr(new)[0])
        basis, image = np.hstack(blocks), np.hstack(images)
        H = basis.T @ image
        if not np.isfinite(H).all():
            return np.full(1, np.nan), basis[:, :1]  # told as none
        w, s = eigh((H + H.T) / 2)
        y = basis @ s[:, -self.kept :]
        self.subspace = y
        return w[-self.kept :].astype(float), y

    def sharpened(self, x: Array) -> float:
        """t = 1 / L at x, as well as can be told; inf without an L > 0, 0 without A."""
        root = self.factor(x)
        found = None if root is None else self.largest(x, root)
        for _ in range(SHARPENED if found is not None and self.size > DENSE else 0):
            assert root is not None
            found = self.largest(x, root)  # each goes on from the subspace of the last
        if found is None:
            return 0.0
        return float(1 / found[0][-1]) if found[0][-1] > 0 else np.inf

    def value(self, x: Array, soft: float, *, gradient: bool = True) -> tuple[float, Array]:
        """(smoothed log of the largest L, its gradient); INDEFINITE where A is.

        Minus INDEFINITE where no L is positive: every t is good.
        """
        return self._value(x, self.factor(x), soft, gradient=gradient)

    def _value(
        self, x: Array, root: Array | None, soft: float, *, gradient: bool = True
    ) -> tuple[float, Array]:
        """The same with the root of A."""
        found = None if root is None else self.largest(x, root)
        if found is None:
            return INDEFINITE, np.zeros_like(x)
        w, v = found
        L = w[-1]
        if L <= 0:
            return -INDEFINITE, np.zeros_like(x)
        p = np.exp(soft * (w / L - 1))
        value = float(np.log(L) + np.log(p.sum()) / soft)
        p /= p.sum()
        if not gradient:
            return value, np.zeros(0)
        keep = p > 1e-8
        return value, self.slope(x, w[keep], v[:, keep], p[keep] / L)

    def improved(
        self, x: Array, soft: float, steps: int, deadline: Deadline, enough: float
    ) -> Array:
        """x after so many steps, or when the value is below -log(enough), or in time."""
        goal = -np.log(enough) if enough > 0 else np.inf

        def point(y: Array, root: Array | None) -> Point[Array | None]:
            value, gradient = self._value(y, root, soft)
            return Point(y, value if value < INDEFINITE else np.inf, gradient, root)

        def at(y: Array) -> Point[Array | None]:
            deadline.pay(self.operations)
            return point(y, self.factor(y) if np.abs(y).max(initial=0.0) <= FARTHEST else None)

        def again(known: Point[Array | None]) -> Point[Array | None]:
            deadline.pay(self.operations - float(self.size) ** 3 / 3)
            return point(known.x, known.kept)

        descent = Descent(
            at, again if self.size > DENSE else None, goal, memory=self.remembered
        )
        try:
            descent.run(x, steps)
        except TimeUp:
            pass
        return x if descent.best is None else descent.best.x


def symmetrised(A: Array) -> Array:
    """(A + A^T) / 2 in the place of A."""
    parts = [slice(i, i + TILE) for i in range(0, len(A), TILE)]
    for k, rows in enumerate(parts):
        for columns in parts[: k + 1]:
            block = A[rows, columns] + A[columns, rows].T
            block *= 0.5
            A[rows, columns], A[columns, rows] = block, block.T
    return A
