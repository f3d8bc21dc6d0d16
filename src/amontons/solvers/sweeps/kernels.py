"""Compiled Gauss-Seidel sweeps: the order of the contacts, Anderson acceleration, the judging.

A sweep solves one contact after another given all others,

    r_i <- r_i + relaxation (solution of contact i - r_i),

and reports |W_ii (r_i' - r_i)| over all contacts, the *change*, unit of u.  The error is about
a constant times the change, so the judge, which costs half a sweep, is asked only when the
change has fallen to where the last answer promises success (the idea of [ABD] eq. (14)).

Order.   Sweeps converge in fewer steps when contacts that approach fast come first, as impacts
travel outward from them; contacts that approach alike (the corners of one face, a layer at
rest) are spread by the golden ratio, so that neighbours do not follow one another.  Measured
on real problems that takes 0.5 to 1.3 times the sweeps of the stored order, 0.85 on average.
Of large sparse problems the order is one of chunks first, which threads share (`chunks`); the
stored order stays as it is, since that of the memory is what one thread is quick in.

[ABD] see `gauss_seidel`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from ...linear.block_kernels import full_product
from ...linear.block_products import product_of_blocks
from ...problem.equations import JUDGE_FLOPS
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ...problem.law.law import COULOMB, MU
from ...problem.law.one_contact import solve_eliminated
from ...problem.law.single import solve_contact
from .chunks import SUMMED, in_chunks
from .local_contact import (
    CLOSE,
    EXACT_FLOPS,
    PROJECTIONS,
    STEPS,
    LocalSolver,
    newton_contact,
    projection_contact,
)
from .mixing import mix_inplace

Array = NDArray[np.float64]
T = TypeVar("T", int, tuple[int, float])
EXACT, NEWTON = int(LocalSolver.EXACT), int(LocalSolver.NEWTON)
GOLDEN = 0.6180339887498949
SLOWEST = 1e-9  # approach, relative to the fastest, below which contacts count as alike
FIRST_JUDGED = 10.0  # change, in goals, at which the judge is asked first: sweeps may be quick
SAFETY = 0.95  # of the change at which the judge is asked again
BLOCK_FLOPS, CONTACT_FLOPS = 18, 16  # of a sweep: per block of W, per contact besides
WAITING = 1.02  # growth of that change with every sweep: error and change may part on plateaus
LEAST = 1e-3  # factor by which that change falls at most from one judgement to the next


class SweepOrder(Enum):
    """In which order a sweep visits the contacts."""

    STORED = "stored"  # as the problem has them
    APPROACH = "approach"  # the fastest approaching first, see the module's text


class Sweep(NamedTuple):
    """What compiled sweeps read; arrays as in `FrictionProblem.kernel_data` and `BlockRows`."""

    indptr: Any
    indices: Any
    data: Any
    rows: Any  # `BlockRows.rows`
    q: Any
    kind: Any
    parameters: Any
    rho: Any
    diagonal: Any
    eliminated: Any
    order: Any  # (nc,) contacts in the order of visits
    local: int
    relaxation: float
    close: float  # relative change at which iterations on one contact end
    steps: int  # of them at most
    # (1 + chunks,): floating point operations on single contacts and of judgements, added up;
    # then where chunks end in the order that threads can work on, see `chunks`
    work: Any


def sweep_data(
    problem: FrictionProblem,
    local: LocalSolver = LocalSolver.EXACT,
    relaxation: float = 1.0,
    order: SweepOrder = SweepOrder.STORED,
    *,
    close: float = CLOSE,
    steps: int | None = None,
) -> Sweep:
    """Sweeps of a problem in Delassus form."""
    if steps is None:
        steps = PROJECTIONS if local is LocalSolver.PROJECTION else STEPS
    b = problem.blocks
    _, _, _, q, kind, parameters, rho = problem.kernel_data
    visits, ends = np.arange(len(q)), np.empty(0)
    if order is SweepOrder.APPROACH:
        visits, ends = problem.kept_alone(_visits_by_approach)
    return Sweep(
        b.indptr, b.indices, b.data, b.rows, q, kind, parameters, rho, b.diagonal, b.eliminated,
        visits, int(local), float(relaxation), float(close), int(steps), np.append(0.0, ends),
    )  # fmt: skip


def _visits_by_approach(problem: FrictionProblem) -> tuple[NDArray[np.int64], Array]:
    """See `in_chunks`."""
    return in_chunks(problem, by_approach(problem.kernel_data[3]))


def sweep_flops(s: Sweep, sweeps: int, local: float) -> float:
    """Floating point operations of some sweeps, `local` being what they added to s.work.

    A block of W takes nine products and nine sums; then there are the solution of each contact
    and what tells its change.
    """
    return sweeps * flops_of_sweep(len(s.indices), len(s.order), s.local) + local


def flops_of_sweep(blocks: int, contacts: int, local: int = EXACT) -> float:
    """Of a sweep, so many stored blocks of W; beyond what iterations on contacts count."""
    own = CONTACT_FLOPS + (EXACT_FLOPS if local == EXACT else 0.0)
    return BLOCK_FLOPS * (blocks - contacts) + own * contacts


def counted(s: Sweep, run: Callable[[], T]) -> tuple[T, float]:
    """What a call returns, sweeps made or (sweeps made, …), and their operations."""
    before, found = float(s.work[0]), run()
    done = found[0] if isinstance(found, tuple) else found
    return found, sweep_flops(s, done, float(s.work[0]) - before)


@njit(cache=True, error_model="numpy")
def by_approach(q):
    """Contacts by octaves of -q_N, the largest first, spread by the golden ratio in each."""
    nc = len(q)
    fastest = 0.0
    for i in range(nc):
        fastest = max(fastest, -q[i, 0])
    key = np.empty(nc)
    for i in range(nc):
        approach = max(-q[i, 0], SLOWEST * fastest)
        octave = math.floor(math.log2(fastest / approach)) if approach > 0.0 else 0.0
        key[i] = octave + (i * GOLDEN) % 1.0
    return np.argsort(key)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def visit_inplace(s, first, last, backward, r):
    """Visit contacts, the first to the last - 1 in the order; returns their change squared."""
    nc, full, flat, change = len(s.order), s.rows.shape[2] > 3, r.reshape(r.size), 0.0
    W = s.data  # views of a block would count references in the loop
    for step in range(first, last):
        i = uint64(s.order[nc - 1 - step if backward else step])
        b0, b1, b2 = s.q[i, 0], s.q[i, 1], s.q[i, 2]
        mu, r0, r1, r2 = s.parameters[i, MU], r[i, 0], r[i, 1], r[i, 2]
        own = uint64(s.diagonal[i])
        if full:
            u0, u1, u2 = full_product(s.rows, i, flat)
            b0 += u0 - (W[own, 0, 0] * r0 + W[own, 0, 1] * r1 + W[own, 0, 2] * r2)
            b1 += u1 - (W[own, 1, 0] * r0 + W[own, 1, 1] * r1 + W[own, 1, 2] * r2)
            b2 += u2 - (W[own, 2, 0] * r0 + W[own, 2, 1] * r1 + W[own, 2, 2] * r2)
        else:
            u0, u1, u2 = product_of_blocks(
                W, s.indices, r, uint64(s.indptr[i]), uint64(s.indptr[i + uint64(1)]), own
            )
            b0, b1, b2 = b0 + u0, b1 + u1, b2 + u2
        if s.local == EXACT:
            if s.kind[i] == COULOMB:
                x0, x1, x2 = solve_eliminated(
                    s.eliminated, s.data, i, own, b0, b1, b2, mu, r1, r2
                )
            else:
                x0, x1, x2, _ = solve_contact(
                    s.data[own], b0, b1, b2, s.kind[i], s.parameters[i], r1, r2
                )
        elif s.local == NEWTON:
            x0, x1, x2 = newton_contact(
                s.data[own], b0, b1, b2, mu, r0, r1, r2, s.close, s.steps, s.work
            )
        else:
            x0, x1, x2 = projection_contact(
                s.data[own], b0, b1, b2, mu, r0, r1, r2, s.close, s.steps, s.work
            )
        d0, d1, d2 = x0 - r0, x1 - r1, x2 - r2
        w = s.relaxation if x0 > 0.0 else 1.0  # open at once: else r fades into denormals
        r[i, 0], r[i, 1], r[i, 2] = r0 + w * d0, r1 + w * d1, r2 + w * d2
        change += s.eliminated[i, 16] * (d0 * d0 + d1 * d1 + d2 * d2)
    return change


@njit(cache=True, error_model="numpy", inline="always")
def sweep_inplace(s, backward, r):
    """One sweep over all contacts on r (nc, 3); returns the change."""
    nc, change = len(s.order), 0.0
    for first in range(0, nc, SUMMED):
        change += visit_inplace(s, first, min(first + SUMMED, nc), backward, r)
    return math.sqrt(change)


@njit(cache=True, error_model="numpy", inline="always")
def content(s, r, change, watch):
    """True when the error is at most watch[0]; see `watch_for`."""
    if not change <= watch[1]:
        watch[1] *= WAITING
        return False
    if watch[0] > 0.0:
        s.work[0] += JUDGE_FLOPS[0] * len(s.indices) + JUDGE_FLOPS[1] * len(s.kind)
    error = natural_error(s.indptr, s.indices, s.rows, s.q, s.kind, s.parameters, s.rho, r)
    if error <= watch[0]:
        watch[2] = error
        return True
    watch[1] = change * max(min(SAFETY * watch[0] / error, 0.8), LEAST)
    return False


@njit(cache=True, error_model="numpy")
def sweeps_inplace(s, r, sweeps, watch):
    """Up to `sweeps` sweeps, fewer when the judge is content; returns how many.

    watch: see `watch_for`.
    """
    for k in range(sweeps):
        if content(s, r, sweep_inplace(s, False, r), watch):
            return k + 1
    return sweeps


@njit(cache=True, error_model="numpy")
def sweeps_until_inplace(s, r, before, sweeps, tau):
    """Up to `sweeps` sweeps, fewer when [ABD] eq. (14) holds; returns (sweeps done, left side).

    before (nc, 3) is working memory.
    """
    change = math.inf
    for k in range(sweeps):
        copy_rows_inplace(r, before)
        sweep_inplace(s, False, r)
        moved = size = 0.0
        for i in range(len(r)):
            for j in range(3):
                moved += (r[i, j] - before[i, j]) ** 2
                size += r[i, j] ** 2
        change = math.sqrt(moved / size) if size > 0.0 else math.sqrt(moved)
        if change < tau or moved == 0.0:
            return k + 1, change
    return sweeps, change


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def anderson_inplace(s, r, x, history, gram, count, sweeps, watch):  # noqa: PLR0913
    """Accelerated sweeps; r ends as the last plain sweep.  Returns sweeps done.

    x (nc, 3) is the next point to sweep from and history (2, depth + 1, 3 nc) holds differences
    of G(r) and of the residual f = G(r) - r, the last row of each the values themselves; gram
    (depth + 1, depth) the products of the differences of f, and with f in the last row;
    count (2,) how many are stored and whether there are values.  So a call goes on where the
    last one ended.  The history is dropped when the residual doubles; `watch` as above.
    """
    for k in range(sweeps):
        copy_rows_inplace(x, r)
        if content(s, r, sweep_inplace(s, False, r), watch):
            copy_rows_inplace(r, x)
            return k + 1
        mix_inplace(r, x, history, gram, count)
    return sweeps


def watch_for(goal: float) -> Array:
    """When sweeps ask the judge: [goal, change, error], all unit of u; goal = 0: never.

    The error is formed when a sweep changes less than `change`, which adapts; once it is at
    most `goal` the sweeps end, and `error` has it, infinite until then.
    """
    return np.array([goal, FIRST_JUDGED * goal, math.inf])


def flops_of_acceleration(size: int, depth: int) -> float:
    """Of Anderson's memory per sweep, for so many components of r."""
    return size * (8.0 + 4.0 * depth) + depth**3 / 3


@dataclass(eq=False)
class Acceleration:
    """Anderson's memory between two calls: see `anderson_inplace`."""

    data: Sweep
    r: Array  # the last plain sweep, (nc, 3)
    depth: int

    def __post_init__(self) -> None:
        self.x = self.r.copy()
        self.r = self.r.copy()
        self.history = np.empty((2, self.depth + 1, self.r.size))
        self.gram = np.zeros((self.depth + 1, self.depth))
        self.count = np.zeros(2, dtype=np.int64)

    @property
    def flops(self) -> float:
        """Floating point operations of a sweep beyond the sweep itself."""
        return flops_of_acceleration(self.r.size, self.depth)

    def sweep(self, sweeps: int, watch: Array) -> tuple[int, float]:
        """Go on for `sweeps` sweeps or until the judge is content; sweeps done, operations."""
        from .shared import anderson

        s, before = self.data, float(self.data.work[0])
        memory = self.x, self.history, self.gram, self.count
        done = anderson(s, self.r, *memory, sweeps, watch)
        return done, sweep_flops(s, done, float(s.work[0]) - before) + done * self.flops
