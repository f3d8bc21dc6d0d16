"""The cone program behind `opening`, solved by an interior-point method.

With A (n, m), unit vectors e and the cone C = Lorentz cones and a half-line for each of the
other unknowns, all of them self-dual, it is the pair

    min |A x|^2 / 2,                       x in C,  e . x = 1,
    max lam - |z|^2 / 2,   y = A^T z - lam e in C.

Both have points inside, so both have solutions, and at them z = A x, lam = |z|^2: either lam >
0 and A^T z is inside C where e is, or A x = 0.  A step of Mehrotra's predictor-corrector method
with the scaling D x = y of Nesterov and Todd, D = F F, l = F x solves

    (I + A D^-1 A^T) dz = A D^-1 (F p - R + e dlam) + A x - z,  p as in `interior_point`,

R the residual of y: a matrix of the size of z, sparse where A is, and no larger with more
contacts.

[M] S. Mehrotra, SIAM J. Optim. 2 (1992); [NT] Y. Nesterov, M. Todd, SIAM J. Optim. 8 (1998).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

from ...core.clock import Deadline

Array = NDArray[np.float64]
Solve = Callable[[Array], Array]
Point = tuple[Array, Array, Array, float]  # x, y, z, lam
BOUNDARY = 0.99  # part of the way to the boundary of the cones that a step goes
STEPS = 80
SHORT = 1e-6  # length of a step that gets nowhere
FULL = 0.2  # share of entries from which A is stored in full
DENSE = 1500  # unknowns z up to which the matrix is stored in full


@dataclass(frozen=True, eq=False)
class Cones:
    """C: Lorentz cones of size d for the rows in `lorentz` (k, d), x >= 0 for `rays` (p,)."""

    lorentz: NDArray[np.int64]
    rays: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of cones."""
        return len(self.lorentz) + len(self.rays)

    def identity(self, m: int) -> Array:
        """The unit of the algebra, (m,): 1 for each cone, along its axis."""
        out = np.zeros(m)
        out[self.lorentz[:, 0]] = 1.0
        out[self.rays] = 1.0
        return out

    def product(self, a: Array, b: Array) -> Array:
        """The Jordan product a o b."""
        out = a * b
        p, q = a[self.lorentz], b[self.lorentz]
        out[self.lorentz[:, 0]] = (p * q).sum(axis=1)
        out[self.lorentz[:, 1:]] = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:]
        return out

    def divide(self, a: Array, c: Array) -> Array:
        """b with a o b = c, a inside."""
        out = c / np.where(a == 0, 1.0, a)
        p, q = a[self.lorentz], c[self.lorentz]
        size = np.linalg.norm(p[:, 1:], axis=1)
        first = (p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(axis=1)) / (
            (p[:, 0] - size) * (p[:, 0] + size)
        )
        out[self.lorentz[:, 0]] = first
        out[self.lorentz[:, 1:]] = (q[:, 1:] - first[:, None] * p[:, 1:]) / p[:, :1]
        return out

    def room(self, x: Array, dx: Array) -> float:
        """Largest a <= 1 with x + a dx in C."""
        room = 1.0
        falling = dx[self.rays] < 0
        if falling.any():
            at = self.rays[falling]
            room = min(room, float((-x[at] / dx[at]).min()))
        p, q = x[self.lorentz], dx[self.lorentz]
        size = np.linalg.norm(p[:, 1:], axis=1)
        a = q[:, 0] ** 2 - (q[:, 1:] ** 2).sum(axis=1)
        b = p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(axis=1)
        c = (p[:, 0] - size) * (p[:, 0] + size)
        root = np.sqrt(np.maximum(b * b - a * c, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            to_cone = np.where(b < 0, c / (root - b), np.where(a < 0, -(b + root) / a, np.inf))
            to_zero = np.where(q[:, 0] < 0, -p[:, 0] / q[:, 0], np.inf)
        leaves = (a < 0) | ((b < 0) & (b * b >= a * c))
        for length, holds in ((to_cone, leaves), (to_zero, q[:, 0] < 0)):
            if holds.any():
                room = min(room, float(length[holds].min()))
        return room


@dataclass(frozen=True, eq=False)
class _Scaling:
    """F with F x = F^-1 y: beta and w of the Lorentz cones, factor of the rays."""

    cones: Cones
    beta: Array
    w: Array
    factor: Array

    @classmethod
    def of(cls, cones: Cones, x: Array, y: Array) -> _Scaling:
        p, q = x[cones.lorentz], y[cones.lorentz]
        sizes = []
        for part in (p, q):
            t = np.linalg.norm(part[:, 1:], axis=1)
            sizes.append(np.sqrt((part[:, 0] - t) * (part[:, 0] + t)))
        sx, sy = sizes
        inner = (p * q).sum(axis=1) / (sx * sy)
        mirrored = p / sx[:, None]
        mirrored[:, 1:] *= -1
        w = (q / sy[:, None] + mirrored) / (2 * np.sqrt(0.5 * (1 + inner)))[:, None]
        return cls(cones, np.sqrt(sy / sx), w, np.sqrt(y[cones.rays] / x[cones.rays]))

    def apply(self, v: Array, *, inverse: bool = False) -> Array:
        """F v or its inverse."""
        out = np.zeros_like(v)
        c, sign = self.cones, -1.0 if inverse else 1.0
        out[c.rays] = v[c.rays] * self.factor if not inverse else v[c.rays] / self.factor
        p, w = v[c.lorentz], self.w
        z = (w[:, 1:] * p[:, 1:]).sum(axis=1)
        first = w[:, 0] * p[:, 0] + sign * z
        rest = p[:, 1:] + w[:, 1:] * (z / (1 + w[:, 0]) + sign * p[:, 0])[:, None]
        size = self.beta if not inverse else 1 / self.beta
        out[c.lorentz[:, 0]] = size * first
        out[c.lorentz[:, 1:]] = size[:, None] * rest
        return out

    def inverse_square(self, m: int) -> sparse.csr_array:
        """D^-1 as a matrix (m, m)."""
        k, d = self.w.shape
        mirror = self.w.copy()
        mirror[:, 1:] *= -1
        blocks = 2 * mirror[:, :, None] * mirror[:, None, :]
        blocks[:, 0, 0] -= 1
        for j in range(1, d):
            blocks[:, j, j] += 1
        blocks /= (self.beta**2)[:, None, None]
        rows = np.broadcast_to(self.cones.lorentz[:, :, None], (k, d, d))
        columns = np.broadcast_to(self.cones.lorentz[:, None, :], (k, d, d))
        rays = self.cones.rays
        data = np.concatenate([blocks.ravel(), 1 / self.factor**2])
        at = (np.concatenate([rows.ravel(), rays]), np.concatenate([columns.ravel(), rays]))
        return sparse.csr_array(sparse.coo_array((data, at), shape=(m, m)))


def iterates(
    matrix: sparse.csr_array, cones: Cones, e: Array, deadline: Deadline
) -> Iterator[tuple[Array, Array, float]]:
    """(x, z, lam) of the program, better and better; ends where steps get nowhere.

    e (m,): positive along the axes of some cones, else zero.  Raises TimeUp.
    """
    n, m = matrix.shape  # type: ignore[misc]  # scipy: may be None
    is_full = matrix.nnz > FULL * n * m and n <= DENSE
    A = matrix.toarray() if is_full else matrix
    unit = cones.identity(m)
    x = unit / float(e @ unit)
    y, z, lam = unit.copy(), np.zeros(n), 0.0
    for _ in range(STEPS):
        deadline.pay(_cost(matrix, is_full))
        step = _step(A, cones, e, (x, y, z, lam))
        if step is None:
            return
        (dx, dy, dz, d_lam), length = step
        length = min(1.0, BOUNDARY * length)
        if not (np.isfinite(dx).all() and np.isfinite(dy).all()) or length < SHORT:
            return
        x, y, z, lam = x + length * dx, y + length * dy, z + length * dz, lam + length * d_lam
        yield x, z, lam


def _step(A: Any, cones: Cones, e: Array, point: Point) -> tuple[Point, float] | None:
    """The step from (x, y, z, lam) and the part of it up to the cones; None: A is singular."""
    x, y, z, lam = point
    m = len(e)
    F = _Scaling.of(cones, x, y)
    lamda = F.apply(x)
    inverse = F.inverse_square(m)
    factor = _factor(A @ (inverse @ A.T))
    if factor is None:
        return None
    b = factor(A @ (inverse @ e))
    turned = inverse @ (e - A.T @ b)
    off, miss, left = A.T @ z - lam * e - y, A @ x - z, 1.0 - float(e @ x)

    def direction(goal: Array, keep: float) -> Point:
        """To complementarity `goal`, and `keep` of what is missing taken away."""
        g = F.apply(cones.divide(lamda, goal)) - keep * off
        a = factor(A @ (inverse @ g) + keep * miss)
        d_lam = (keep * left - float(e @ (inverse @ (g - A.T @ a)))) / float(e @ turned)
        dz = a + d_lam * b
        dx = inverse @ (g - A.T @ dz + d_lam * e)
        return dx, A.T @ dz - d_lam * e + keep * off, dz, d_lam

    square = cones.product(lamda, lamda)
    dx, dy, _, _ = direction(-square, 1.0)
    length = min(cones.room(x, dx), cones.room(y, dy))
    end = float((x + length * dx) @ (y + length * dy))
    sigma = min(max(end / float(x @ y), 0.0), 1.0) ** 3
    corrector = cones.product(F.apply(dx), F.apply(dy, inverse=True))
    mean = float(x @ y) / cones.count
    goal = sigma * mean * cones.identity(m) - square - corrector
    dx, dy, dz, d_lam = direction(goal, 1.0 - sigma)
    return (dx, dy, dz, d_lam), min(cones.room(x, dx), cones.room(y, dy))


def _factor(N: sparse.csr_array | Array) -> Solve | None:
    """A solver for I + N, N positive semidefinite; None where rounding has made it singular."""
    n = N.shape[0]
    matrix = N + sparse.eye_array(n)
    try:
        if n <= DENSE:
            full = matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)
            factor = cho_factor(full, check_finite=False)
            return lambda right: cho_solve(factor, right, check_finite=False)
        return splu(sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A",
                    diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve  # fmt: skip
    except (np.linalg.LinAlgError, RuntimeError):
        return None


def _cost(A: sparse.csr_array, is_full: bool) -> float:
    """Operations of a step, roughly."""
    n, m = A.shape  # type: ignore[misc]  # scipy: may be None
    dense = float(n) ** 3 / 3
    product = 2.0 * n * n * m if is_full else 40.0 * A.nnz
    return product + (dense if n <= DENSE else min(dense, 30.0 * float(n) ** 2))
