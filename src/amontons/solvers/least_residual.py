"""Acceleration of any iteration for A x = f whose residuals are known, with a short memory.

Of all points x + sum_k w_k s_k it takes the one with the least residual: s_k are the last
steps, t_k the changes of the residual r = f - A x over them, so that its residual

    r + sum_k w_k t_k,    sum_l (t_k . t_l) w_l = -t_k . r

costs no product with A [OW].  For a linear iteration and a long memory that is GMRES.

[OW] C. W. Oosterlee, T. Washio, "Krylov subspace acceleration of nonlinear multigrid with
application to recirculating flows", SIAM J. Sci. Comput. 21 (2000).
"""

from __future__ import annotations

import numpy as np
from numba import float64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import BLOCK, over_blocks
from ..linear.vectors import blocks_of, copy_both, norm

Array = NDArray[np.float64]
RANK = 1e-13  # is added to the diagonal of the scaled Gram matrix


class LeastResidual:
    """The last `depth` steps, and what residuals changed over them.

    Changes are kept in single precision, in a unit of their own: they choose between points.
    Steps are not, as A may make far more of their rounding than of them.
    """

    def __init__(self, size: int, depth: int) -> None:
        self.depth = depth
        kept = size if depth else 0
        self.steps, self.changes = np.empty((depth, kept)), np.empty((depth, kept), np.float32)
        self.point, self.residual = np.empty(kept), np.empty(kept)  # of the last point kept
        self.gram = np.zeros((depth, depth))
        self.weights = np.zeros(0)
        self.unit = 1.0  # of the changes
        self.count = -1  # steps so far; -1: not even a point

    def forget(self) -> None:
        """Start again from the next point kept."""
        self.count = -1

    def keep(self, x: Array, r: Array) -> None:
        """Of this point, with residual r, the next step begins; flat."""
        if self.depth == 0:
            return
        if self.count < 0:
            self.count, self.unit = 0, _unit(norm(r) / max(len(r), 1) ** 0.5)
        copy_both(x, self.point, r, self.residual)

    def mix(self, x: Array, r: Array) -> bool:
        """x with residual r, one step after the point kept, becomes the best point, in place.

        False where there is nothing to choose from.
        """
        if self.count < 0:
            return False
        slot, used = self.count % self.depth, min(self.count + 1, self.depth)
        sums = np.empty((blocks_of(len(x)), used, 2))
        over_blocks(
            _record, len(x), (3.5 + 0.5 * used) * len(x), x, r, self.point, self.residual,
            self.steps, self.changes, self.unit, slot, sums,
        )  # fmt: skip
        row, dots = np.add.reduce(sums, axis=0).T
        self.count += 1
        self.gram[slot, :used] = self.gram[:used, slot] = row
        scale = 1 / np.sqrt(np.maximum(np.diag(self.gram)[:used], np.finfo(float).tiny))
        gram = self.gram[:used, :used] * np.outer(scale, scale)
        if not (np.isfinite(gram).all() and np.isfinite(dots).all()):
            return False
        self.weights = -scale * np.linalg.solve(gram + RANK * np.eye(used), scale * dots)
        self._add(1.0, x, r)
        return True

    def undo(self, x: Array, r: Array) -> None:
        """x and r as they were before the last `mix`, but for rounding."""
        self._add(-1.0, x, r)

    def _add(self, sign: float, x: Array, r: Array) -> None:
        work = (2.0 + 1.5 * len(self.weights)) * len(x)
        over_blocks(_combine, len(x), work, x, r, self.steps, self.changes,
                    (sign / self.unit) * self.weights, self.unit)  # fmt: skip


def _unit(size: float) -> float:
    """A power of two near a size, 1 where there is none."""
    return 2.0 ** np.frexp(size)[1] if 0 < size < np.inf else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _record(begin, end, x, r, point, residual, steps, changes, unit, slot, sums):  # noqa: PLR0913
    """Store the newest step and change; products of all changes with that and with r.

    Loops run over slices from zero: only these are vectorised, which is six times as fast.
    """
    inverse = 1 / unit
    used = sums.shape[1]
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        x_now, x_old = x[first:last], point[first:last]
        r_now, r_old = r[first:last], residual[first:last]
        step, newest = steps[slot, first:last], changes[slot, first:last]
        for i in range(len(step)):
            step[i] = x_now[i] - x_old[i]
            newest[i] = (r_now[i] - r_old[i]) * inverse
        for k in range(used):
            change = changes[k, first:last]
            a, b = 0.0, 0.0
            for i in range(len(change)):
                a += float64(change[i]) * float64(newest[i])
                b += float64(change[i]) * r_now[i]
            sums[first // BLOCK, k, 0], sums[first // BLOCK, k, 1] = a, b


@njit(cache=True, error_model="numpy", nogil=True)
def _combine(begin, end, x, r, steps, changes, weights, unit):  # noqa: PLR0913
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        x_now, r_now = x[first:last], r[first:last]
        for k in range(len(weights)):
            w, v = weights[k], weights[k] * unit
            step, change = steps[k, first:last], changes[k, first:last]
            for i in range(len(step)):
                x_now[i] += w * step[i]
                r_now[i] += v * change[i]
