"""Newton's method for two eigenvalues that meet, with bordered systems; see `coalescence`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from .sliding import factor

Array = NDArray[np.float64]
STEPS = 40  # of Newton's method
DONE = 1e-13  # relative step at which it ends


@dataclass(frozen=True)
class Point:
    """Where two eigenvalues meet; begins: they are real before p and complex beyond."""

    l: float
    p: float
    begins: bool


def same(a: Point, b: Point, distance: float) -> bool:
    """Whether l and p of a are as near to those of b, relative."""
    return abs(a.p - b.p) <= distance * b.p and abs(a.l - b.l) <= distance * b.l


class Sparse:
    """The bordered matrix, with borders near the null vectors of Q."""

    def __init__(self, Q: sparse.csc_array, b: Array, c: Array) -> None:
        n = Q.shape[0]
        for _ in range(1 if b is not c else 2):  # the solutions are better borders
            self.b, self.c = b / np.linalg.norm(b), c / np.linalg.norm(c)
            whole = sparse.block_array(
                [[Q, self.b[:, None]], [self.c[None], None]], format="csc"
            )
            self.forward = factor(sparse.csc_array(whole))
            self.backward = factor(sparse.csc_array(whole.T))
            e = np.zeros(n + 1)
            e[n] = 1.0
            c, b = self.forward.solve(e)[:n], self.backward.solve(e)[:n]

    def solve(self, b: Array, *, transposed: bool) -> Array:
        """Of the bordered matrix or of its transpose."""
        return (self.backward if transposed else self.forward).solve(b)


def iterate(
    solver: Any, by_l: Any, by_p: Any, by_p_transposed: Any, l: float, p: float
) -> Point | None:
    """Newton's method for g = 0, dg/dl = 0; by_l, by_p: products with derivatives of Q."""
    size, grows = np.inf, False
    for _ in range(STEPS):
        try:
            system = solver(l, p)
        except (SingularOperator, np.linalg.LinAlgError):
            return None
        n = len(system.b)
        e = np.zeros(n + 1)
        e[n] = 1.0
        x, y = system.solve(e, transposed=False), system.solve(e, transposed=True)
        g, x, y = x[n], x[:n], y[:n]

        def shifted(of: Any, vector: Array, *, transposed: bool, system: Any = system) -> Array:
            right = np.append(-of(vector), 0.0)
            return system.solve(right, transposed=transposed)[: len(vector)]

        x_l, y_l = shifted(by_l, x, transposed=False), shifted(by_l, y, transposed=True)
        x_p, y_p = shifted(by_p, x, transposed=False), shifted(
            by_p_transposed, y, transposed=True
        )
        g_l, g_p = -y @ by_l(x), -y @ by_p(x)
        g_ll = -(y_l @ by_l(x) + y @ by_l(x_l))
        g_lp = -(y_p @ by_l(x) + y @ by_l(x_p))
        J = np.array([[g_l, g_p], [g_ll, g_lp]])
        grows = bool(g_p * g_ll > 0)  # g = g_ll (l - l_0)^2 / 2 + g_p (p - p_0)
        scale = np.array([max(abs(l), 1e-300), max(abs(p), 1e-300)])
        try:
            step = -np.linalg.solve(J * scale, np.array([g, g_l]))
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(step).max())
        if not np.isfinite(size):
            return None
        step *= min(1.0, 0.3 / size) if size > 0 else 1.0
        l, p = float(l * (1 + step[0])), float(p * (1 + step[1]))
        if size <= DONE:
            break
    else:
        if size > 1e-8:  # rounding ends it before DONE
            return None
    return Point(float(l), float(p), grows) if l > 0 and p > 0 else None
