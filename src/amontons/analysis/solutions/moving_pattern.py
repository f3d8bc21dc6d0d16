"""One status pattern while load and friction go from one problem to another, with error bounds.

On the pattern u = W R y + c vanishes in some rows, E y = -c[rows], where E, R and c are linear
in t.  Over a span of t, s from -1 to 1, and with X near the inverse of E_0 in its middle,

    E = E_0 + s E_1:   y = y_0 + s y_1,   y_0 = -X c_0,   y_1 = -X (c_1 + E_1 y_0),          (1)

up to e = |X| (what (1) leaves of the equations) and rho / (1 - rho) max e more, |1 - X E| <=
rho < 1 in the maximum norm, as in `piece_solution`.  So every slack P r + Q u is linear in s up
to a bound: rounding where mu is the same, else of the order of the span's square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..multipliers.rounding import gamma
from .piece_solution import REGULAR

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MovingPattern:
    """E y = -c[rows], r = R y, slacks P r + Q u; pairs (x_0, x_1) are x_0 + t x_1."""

    W: Array
    rows: NDArray[np.int64]
    R: tuple[Array, Array]
    P: tuple[Array, Array]
    Q: Array
    c: tuple[Array, Array]

    def reaction(self, t: float) -> Array:
        """Scaled r, (2 nc,)."""
        R, c = (x[0] + t * x[1] for x in (self.R, self.c))
        return R @ np.linalg.solve((self.W @ R)[self.rows], -c[self.rows])

    def slacks(self, a: float, b: float, data: float) -> tuple[Array, Array, Array] | None:
        """(s_0, s_1, bound): slacks are s_0 + s s_1 up to the bound, -1 <= s <= 1 over [a, b].

        None where the matrix may be singular there.  data: relative error of W, c and mu.
        """
        middle, half = (a + b) / 2, (b - a) / 2
        (R0, R1), (P0, P1), (c0, c1) = (
            (x[0] + middle * x[1], half * x[1]) for x in (self.R, self.P, self.c)
        )
        W, Q, rows = self.W, self.Q, self.rows
        E0, E1 = (W @ R0)[rows], (W @ R1)[rows]
        try:
            X = np.linalg.inv(E0)
        except np.linalg.LinAlgError:
            return None
        k, size = len(E0), np.abs(R0) + np.abs(R1)
        fuzz = 3 * data + gamma(k + len(W) + 8)
        spread = np.abs(X @ E1) + fuzz * (np.abs(X) @ (np.abs(W)[rows] @ size))
        rho = float((np.abs(X @ E0 - np.eye(k)) + spread).sum(axis=1).max(initial=0.0))
        if not rho < REGULAR:
            return None
        y0 = -(X @ c0[rows])
        y0 -= X @ (E0 @ y0 + c0[rows])
        y1 = -(X @ (c1[rows] + E1 @ y0))
        terms = np.abs(W)[rows] @ (size @ (np.abs(y0) + np.abs(y1)))
        terms += np.abs(c0[rows]) + np.abs(c1[rows])
        e = np.abs(X @ (E1 @ y1)) + np.abs(X) @ (
            np.abs(E0 @ y0 + c0[rows]) + np.abs(E0 @ y1 + c1[rows] + E1 @ y0) + fuzz * terms
        )
        e += rho / (1 - rho) * float(e.max(initial=0.0))
        r0, r1 = R0 @ y0, R0 @ y1 + R1 @ y0
        off_r = np.abs(R1 @ y1) + size @ e
        off_u = np.abs(W @ (R1 @ y1)) + (np.abs(W @ R0) + np.abs(W @ R1)) @ e
        u0, u1 = W @ r0 + c0, W @ r1 + c1
        s0, s1 = P0 @ r0 + Q @ u0, P0 @ r1 + P1 @ r0 + Q @ u1
        all_P = np.abs(P0) + np.abs(P1)
        of_r = size @ (np.abs(y0) + np.abs(y1))
        of_u = np.abs(W) @ of_r + np.abs(c0) + np.abs(c1)
        bound = np.abs(P1 @ r1) + all_P @ off_r + np.abs(Q) @ off_u
        return s0, s1, bound + fuzz * (all_P @ of_r + np.abs(Q) @ of_u)
