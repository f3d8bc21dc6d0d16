"""Non-smooth Gauss-Seidel (NSGS): contact after contact, each solved exactly.

    r_i <- r_i + relaxation (exact solution of contact i given all others - r_i)  [ABD] eq. (12)

A judgement costs nearly as much as a sweep.  With batch=ADAPTIVE one is due only when

    |r_{k+1} - r_k| / |r_{k+1}| < tau,                                            [ABD] eq. (14)

where tau is adapted: from each judged sweep to the change at which the error, falling in
proportion, will be the tolerance.

Optionally with Anderson acceleration: the sweep G is a fixed-point map, and the next iterate is
the combination of the last ones whose residual G(r) - r is smallest.  A mixed iterate may leave
the cone; the next sweep brings it back, so only sweeps are ever handed out.

[ABD] V. Acary, M. Brémond, F. Dubois, "Méthodes de Newton non-lisses pour les problèmes de
contact frottant dans les systèmes de multi-corps flexibles", CSMA 2017.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..blocks import spatial
from ..cones import Tresca
from ..errors import InvalidInput, UnsupportedForm
from ..one_contact import solve_contact
from ..problem import Form, FrictionProblem
from .base import Iterate, Target, check_at_least
from .local_contact import LocalSolver, newton_contact, projection_contact

Array = NDArray[np.float64]
FIRST = 10  # sweeps before criterion (14) is first compared with the error
LONGEST = 100  # sweeps without an iterate at most: the driver has a clock and a callback
EXACT, NEWTON = int(LocalSolver.EXACT), int(LocalSolver.NEWTON)


def sweep_data(
    problem: FrictionProblem, local: LocalSolver = LocalSolver.EXACT, relaxation: float = 1.0
) -> tuple[Any, ...]:
    """What a sweep takes before r: W, q, the law, diagonal blocks, local solver, relaxation."""
    return (*problem.kernel_data[:6], problem.blocks.diagonal, int(local), float(relaxation))


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def sweep_inplace(
    indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, backward, r
):  # noqa: PLR0913
    """One Gauss-Seidel sweep over all contacts; returns |W_ii (r_i' - r_i)|, unrelaxed."""
    nc = len(coefficient)
    change = 0.0
    for step in range(nc):
        i = nc - 1 - step if backward else step
        b0, b1, b2 = q[i, 0], q[i, 1], q[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j == i:
                continue
            b = data[k]
            r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
            b0 += b[0, 0] * r0 + b[0, 1] * r1 + b[0, 2] * r2
            b1 += b[1, 0] * r0 + b[1, 1] * r1 + b[1, 2] * r2
            b2 += b[2, 0] * r0 + b[2, 1] * r1 + b[2, 2] * r2
        A = data[diagonal[i]]
        c, r0, r1, r2 = coefficient[i], r[i, 0], r[i, 1], r[i, 2]
        if local == EXACT:
            x0, x1, x2, _ = solve_contact(A, b0, b1, b2, c, tresca, r1, r2)
        elif local == NEWTON:
            x0, x1, x2 = newton_contact(A, b0, b1, b2, c, r0, r1, r2)
        else:
            x0, x1, x2 = projection_contact(A, b0, b1, b2, c, r0, r1, r2)
        d0, d1, d2 = x0 - r0, x1 - r1, x2 - r2
        r[i, 0], r[i, 1], r[i, 2] = r0 + omega * d0, r1 + omega * d1, r2 + omega * d2
        size = abs(A[0, 0]) + abs(A[1, 1]) + abs(A[2, 2])
        change += size * size * (d0 * d0 + d1 * d1 + d2 * d2)
    return math.sqrt(change)


@njit(cache=True, error_model="numpy")
def sweeps_inplace(
    indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, r, sweeps, small
):  # noqa: PLR0913
    """Up to `sweeps` sweeps, fewer when one changes less than `small`; returns how many."""
    for k in range(sweeps):
        change = sweep_inplace(
            indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, False, r
        )
        if change <= small:
            return k + 1
    return sweeps


@njit(cache=True, error_model="numpy")
def _least_squares(gram, target, k, weights):
    """Solve (gram + tiny I) w = target for the leading k unknowns, by Gauss with pivots."""
    a = gram[:k, :k].copy()
    b = target[:k].copy()
    shift = 0.0
    for i in range(k):
        shift = max(shift, a[i, i])
    for i in range(k):
        a[i, i] += 1e-13 * shift
    for i in range(k):
        p = i
        for j in range(i + 1, k):
            if abs(a[j, i]) > abs(a[p, i]):
                p = j
        if a[p, i] == 0.0:
            return False
        if p != i:
            for j in range(k):
                a[i, j], a[p, j] = a[p, j], a[i, j]
            b[i], b[p] = b[p], b[i]
        for j in range(i + 1, k):
            factor = a[j, i] / a[i, i]
            for l in range(i, k):
                a[j, l] -= factor * a[i, l]
            b[j] -= factor * b[i]
    for i in range(k - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, k):
            total -= a[i, j] * weights[j]
        weights[i] = total / a[i, i]
    return True


@njit(cache=True, error_model="numpy")
def anderson_inplace(  # noqa: PLR0913
    indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, r, x, history, gram,
    count, sweeps, small,
):  # fmt: skip
    """Accelerated sweeps; r ends as the last plain sweep.  Returns (sweeps done, last change).

    x (nc, 3) is the next point to sweep from and history (2, depth + 1, 3 nc) holds differences
    of G(r) and of the residual G(r) - r, the last row of each the values themselves; gram
    (depth, depth) the products of the latter; count (2,) how many are stored and whether there
    are values.  So a call goes on where the last one ended.  The history is dropped when the
    residual doubles; `small` as above.
    """
    depth = history.shape[1] - 1
    m = history.shape[2]
    steps, slopes = history[0], history[1]
    target, weights = np.zeros(depth), np.zeros(depth)
    g, xf = r.reshape(m), x.reshape(m)
    change = math.inf
    for k in range(sweeps):
        r[:, :] = x
        change = sweep_inplace(
            indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, False, r
        )
        if change <= small:
            x[:, :] = r
            return k + 1, change
        size = old_size = 0.0
        for i in range(m):
            size += (g[i] - xf[i]) ** 2
            old_size += slopes[depth, i] ** 2
        if count[1] == 0 or size > 4.0 * old_size:
            count[0] = 0
        else:
            slot = count[0] % depth
            count[0] += 1
            for i in range(m):
                steps[slot, i] = g[i] - steps[depth, i]
                slopes[slot, i] = g[i] - xf[i] - slopes[depth, i]
            for a in range(min(count[0], depth)):
                gram[a, slot] = gram[slot, a] = np.dot(slopes[a], slopes[slot])
        count[1] = 1
        filled = min(count[0], depth)
        for i in range(m):
            steps[depth, i] = g[i]
            slopes[depth, i] = g[i] - xf[i]
        x[:, :] = r
        for a in range(filled):
            target[a] = np.dot(slopes[a], slopes[depth])
        if filled > 0 and _least_squares(gram, target, filled, weights):
            for a in range(filled):
                for i in range(m):
                    xf[i] -= weights[a] * steps[a, i]
    return sweeps, change


@njit(cache=True, error_model="numpy")
def sweeps_until_inplace(
    indptr,
    indices,
    data,
    q,
    coefficient,
    tresca,
    diagonal,
    local,
    omega,
    r,
    before,
    sweeps,
    tau,
):  # noqa: PLR0913
    """Up to `sweeps` sweeps, fewer when [ABD] eq. (14) holds; returns (sweeps done, left side).

    before (nc, 3) is working memory.
    """
    change = math.inf
    for k in range(sweeps):
        before[:, :] = r
        sweep_inplace(
            indptr, indices, data, q, coefficient, tresca, diagonal, local, omega, False, r
        )
        moved = size = 0.0
        for i in range(len(coefficient)):
            for j in range(3):
                moved += (r[i, j] - before[i, j]) ** 2
                size += r[i, j] ** 2
        change = math.sqrt(moved / size) if size > 0.0 else math.sqrt(moved)
        if change < tau or moved == 0.0:
            return k + 1, change
    return sweeps, change


class Batch(Enum):
    """When Gauss-Seidel hands out an iterate, other than after a number of sweeps."""

    ADAPTIVE = "adaptive"


@dataclass(eq=False)
class Acceleration:
    """Anderson's memory between two calls: see `anderson_inplace`."""

    kernel: tuple
    r: Array  # the last plain sweep, (nc, 3)
    depth: int

    def __post_init__(self) -> None:
        self.x = self.r.copy()
        self.r = self.r.copy()
        self.history = np.zeros((2, self.depth + 1, self.r.size))
        self.gram = np.zeros((self.depth, self.depth))
        self.count = np.zeros(2, dtype=np.int64)

    def sweep(self, sweeps: int, small: float) -> tuple[int, float]:
        """Go on for `sweeps` sweeps; (sweeps done, last change)."""
        return anderson_inplace(
            *self.kernel, self.r, self.x, self.history, self.gram, self.count, sweeps, small
        )


@dataclass(frozen=True)
class GaussSeidel:
    """NSGS on the Delassus form; one iterate per `batch` sweeps.

    anderson_depth > 0 accelerates: the window of past sweeps, 5 to 10 is usual.
    batch=Batch.ADAPTIVE judges when the cheap criterion [ABD] eq. (14) says so.
    """

    form: ClassVar[Form] = Form.DELASSUS
    local: LocalSolver = LocalSolver.EXACT  # how one contact is solved
    relaxation: float = 1.0  # below 2; 1.3 to 1.6 is often much faster on packings
    anderson_depth: int = 0  # past sweeps that are combined; 0: plain sweeps
    batch: int | Batch = 1  # sweeps between two judgements

    def __post_init__(self) -> None:
        check_at_least(0, anderson_depth=self.anderson_depth)
        if not 0 < self.relaxation < 2:
            raise InvalidInput(f"relaxation: expected between 0 and 2, got {self.relaxation}")
        if not isinstance(self.batch, Batch):
            check_at_least(1, batch=self.batch)
        elif self.anderson_depth:
            raise InvalidInput(
                "batch: ADAPTIVE compares plain sweeps, with anderson_depth give a number"
            )

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Sweeps from `start`, for ever."""
        d = problem.dimension
        if isinstance(problem.law, Tresca) and self.local is not LocalSolver.EXACT:
            raise UnsupportedForm(f"local={self.local.name}: needs Coulomb friction; use EXACT")
        kernel = sweep_data(problem, self.local, self.relaxation)
        r = spatial(start.r)
        if isinstance(self.batch, Batch):
            yield from _adaptive(problem, kernel, r, target)
            return
        if self.anderson_depth:
            memory = Acceleration(kernel, r, self.anderson_depth)
            while True:
                done, _ = memory.sweep(self.batch, 0.0)
                yield Iterate(memory.r[:, :d].copy(), iterations=done)
        while True:
            done = sweeps_inplace(*kernel, r, self.batch, 0.0)
            yield Iterate(r[:, :d].copy(), iterations=done)


def _adaptive(
    problem: FrictionProblem, kernel: tuple[Any, ...], r: Array, target: Target
) -> Iterator[Iterate]:
    """Sweeps from r, an iterate where [ABD] eq. (14) holds or after LONGEST of them."""
    before, d = np.empty_like(r), problem.dimension
    sweeps, tau = FIRST, target.tolerance
    while True:
        done, change = sweeps_until_inplace(*kernel, r, before, sweeps, tau)
        iterate = Iterate(r[:, :d].copy(), iterations=done)
        error = problem.error(iterate.r)
        yield iterate  # whoever asks for more was not content
        if 0 < error < math.inf:
            tau = change * min(target.tolerance / error, 0.5)
        sweeps = LONGEST
