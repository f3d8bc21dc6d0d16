"""Whether two curves cross near a point where the bordered determinant vanishes, and how.

With t the tangent x' there and n the other direction in which the derivatives vanish, every
(a, c) has, by Lyapunov and Schmidt, one (v, beta) with

    H(x + a t + c n + v) + beta b = 0,   v orthogonal to t and n, |b| = 1                  (1)

and the curve is beta(a, c) = 0.  Two curves cross in a saddle of beta at height zero, along the
lines on which its second derivatives vanish.  At another height they pass by each other, and a
walk that saw the determinant change its sign has jumped from one to the other ([G] chapter 6).

[G] W. Govaerts, "Numerical methods for bifurcations of dynamical equilibria", SIAM 2000.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .corrector import Curve, Factored, Spot, Tolerances
from .path import name_of

Array = NDArray[np.float64]
STENCIL = 1e-4  # weighted distance at which heights are compared
ROUNDS = 8  # of Newton's method for the saddle
SETTLED = 1e-9  # its last step
LEVEL = 1e-5  # first derivative that counts as none where second ones do
FLAT = 1e-3  # second derivative, relative to the other one or to size one, that counts as none
SOLVES = 20  # of (1) by Newton steps with the derivatives in the middle


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where two curves cross: the point, and the unit directions (2, n + 1) of both.

    The first is that of the curve that was followed.
    """

    y: Array
    p: float
    lines: Array


def crossing(
    curve: Curve, near: Spot, reach: float, tolerances: Tolerances
) -> Crossing | None:
    """The branch point within reach of a spot, None where curves only pass by each other.

    Where second derivatives vanish, or other pieces are too near to tell them, the spot itself
    is asked: whether it is a solution, and whether first derivatives vanish, too.
    """
    start = np.append(near.y, near.p)
    try:
        plane = _Plane(curve, start, np.append(near.ty, near.tp), tolerances)
        second = np.zeros((2, 2))
        for _ in range(ROUNDS):
            gradient, second = plane.derivatives()
            if _flat(second):
                if np.abs(gradient).max() > LEVEL:
                    return None
                break
            step = -np.linalg.solve(second, gradient)
            x = plane.point(step)
            if _length(curve, x - start) > reach:
                return None
            plane = _Plane(curve, x, plane.frame[0], tolerances)
            if np.abs(step).max() <= SETTLED:
                break
        x, height = plane.solved(np.zeros(2))
    except np.linalg.LinAlgError:
        return None
    if abs(height) > max(tolerances.residual, curve.rounding(x[:-1], float(x[-1]))):
        return None
    lines = _lines(second)
    return None if lines is None else Crossing(x[:-1], float(x[-1]), lines @ plane.frame)


class _Plane:
    """Heights beta over the plane of t and n through a point x (n + 1,)."""

    def __init__(self, curve: Curve, x: Array, t: Array, tolerances: Tolerances) -> None:
        self.curve, self.x, self.tolerances = curve, x, tolerances
        random = np.random.default_rng(0)
        row, column = random.standard_normal(len(x)), random.standard_normal(len(x) - 1)
        self.b = np.append(column / np.linalg.norm(column), 0.0)
        self.A = A = curve.bordered(*curve.jacobian(x[:-1], float(x[-1])), t[:-1], float(t[-1]))
        n = _framed(A, self.b, row).solve(np.append(np.zeros(len(x)), 1.0))[:-1]
        n -= curve.product(n[:-1], float(n[-1]), t[:-1], float(t[-1])) * t
        n /= _length(curve, n)
        self.frame = np.array([t, n])
        self.factor = _framed(A, self.b, np.append(curve.weight * n[:-1], n[-1]))

    def solved(self, place: NDArray[np.floating]) -> tuple[Array, float]:
        """(point, beta) over (a, c) = place; raises LinAlgError without convergence."""
        x, height = self.x + place @ self.frame, 0.0
        for _ in range(SOLVES):
            rest = self.curve.residual(x[:-1], float(x[-1])) + height * self.b[:-1]
            change = self.factor.solve(np.concatenate([-rest, np.zeros(2)]))
            x, height = x + change[:-1], height + float(change[-1])
            if _length(self.curve, change[:-1]) <= self.tolerances.change:
                return x, height
        raise np.linalg.LinAlgError("no height over this place")

    def point(self, place: NDArray[np.floating]) -> Array:
        """The point over a place."""
        return self.solved(place)[0]

    def derivatives(self) -> tuple[Array, Array]:
        """First (2,) and second (2, 2) derivatives of beta, the latter by differences.

        The latter are zero where other pieces begin too close by to tell.
        """
        right = np.vstack([self.A @ self.frame.T, np.zeros((1, 2))])
        right[-2] = 0.0
        first = -self.factor.solve(right)[-1]
        h, second = STENCIL, np.zeros((2, 2))
        places = {(i, j): self.solved(h * np.array([i, j], dtype=float))
                  for i in (-1, 0, 1) for j in (-1, 0, 1)}  # fmt: skip
        if len({self._piece(x) for x, _ in places.values()}) > 1:
            return first, second
        beta = {place: height for place, (_, height) in places.items()}
        second[0, 0] = beta[1, 0] - 2 * beta[0, 0] + beta[-1, 0]
        second[1, 1] = beta[0, 1] - 2 * beta[0, 0] + beta[0, -1]
        mixed = beta[1, 1] - beta[1, -1] - beta[-1, 1] + beta[-1, -1]
        second[0, 1] = second[1, 0] = mixed / 4
        return first, second / h**2

    def _piece(self, x: Array) -> Hashable:
        """The piece whose function is solved at a point."""
        if self.curve.piece is not None:
            return self.curve.piece
        return name_of(self.curve.problem.piece(x[:-1], float(x[-1])))


def _framed(A: Array | sparse.sparray, column: Array, row: Array) -> Factored:
    """[A column; row 0], factorised."""
    if isinstance(A, np.ndarray):
        return Factored(np.block([[A, column[:, None]], [row[None, :], np.zeros((1, 1))]]))
    return Factored(sparse.csc_array(
        sparse.block_array([[A, column[:, None]], [row[None, :], None]])
    ))  # fmt: skip


def _flat(second: Array) -> bool:
    """True where second derivatives do not tell how curves cross."""
    size = np.sort(np.abs(np.linalg.eigvalsh(second)))
    return bool(size[0] <= FLAT * max(1.0, size[1]))


def _lines(second: Array) -> Array | None:
    """Rows (2, 2), of length 1, on which a form vanishes; None where it has one sign.

    The first is nearer to (1, 0).  Both axes where the form tells nothing.
    """
    if _flat(second):
        return np.eye(2)
    values, axes = np.linalg.eigh(second)
    if values[0] * values[1] > 0:
        return None
    slope = np.sqrt(np.abs(values[::-1]))
    rows = np.array([axes @ slope, axes @ (slope * [1.0, -1.0])])
    rows = rows[np.argsort(-np.abs(rows[:, 0]))] / np.linalg.norm(slope)
    return rows * np.where(rows[:, :1] < 0, -1.0, 1.0)


def _length(curve: Curve, x: Array) -> float:
    return curve.length(x[:-1], float(x[-1]))
