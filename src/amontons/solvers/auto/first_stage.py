"""The first stage of `Auto` on many small problems, compiled: sweeps and judge in one call.

Most problems of a simulator end in the first chunks of the first track, accelerated sweeps
(`portfolio`), whose arithmetic takes some microseconds and whose way through the driver fifty.
Here all problems stand one behind the other in shared arrays, and one call without Python's
lock goes through a range of them: the same sweeps, judge and reactions, bit by bit, as those of
`drive` where that ends in these chunks; where it does not, it is asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only
from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from ...problem.friction import FrictionProblem
from ...problem.judge.contacts import assess
from ...problem.judge.measures import natural_error
from ..judging import TIGHTER
from ..sweeps.kernels import (
    EXACT,
    FIRST_JUDGED,
    Sweep,
    anderson_inplace,
    flops_of_acceleration,
    flops_of_sweep,
)
from ..sweeps.local_contact import CLOSE, STEPS
from .race import CALL, GROWTH, SHORTEST
from .state import (
    FIRST_CHUNKS,
    HISTORY_CONTACT,
    SIZES,
    chunks_alone,
    is_brief,
    nanoseconds_of_sweep,
    visits,
)
from .tracks import DEPTH, LEAST

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
# Columns of what is told of a problem.
SWEEPS, START, ERROR, WORST, CONTACT, HIDDEN, CHANGED, WORK = range(8)
NO_NUMBERS = read_only(np.empty(0))


@lru_cache(maxsize=SIZES)
def sweeps_of_first_chunks(blocks: int, contacts: int, chunks: int = FIRST_CHUNKS) -> int:
    """Sweeps of so many first chunks, those that the first track has before all others."""
    cost, total, done = nanoseconds_of_sweep(blocks, contacts, HISTORY_CONTACT), 0.0, 0
    for _ in range(chunks):
        sweeps = max(LEAST, int(max(GROWTH * total, SHORTEST) / cost))
        total, done = total + sweeps * cost + CALL, done + sweeps
    return done


@njit(cache=True, error_model="numpy", nogil=True)
def solve_range(  # noqa: PLR0913
    first, last, sizes, limits, goals, weakest, data, floor, r, u, kept, status, sliding, told
):
    """Solve problems first to last - 1, from r; those that are not solved have error inf.

    sizes (problems + 1, 3): contacts, blocks and numbers in full rows of W of all before a
    problem; limits (problems,): sweeps at most; goals: errors; weakest (problems,): error of a
    contact beyond which the goal is made tighter, as the driver does.  data: arrays of all
    problems one behind the other, a row of indptr more for each.  Fills r, u, kept (contacts,
    3), status, sliding (contacts,) and told (problems, 8), see the columns; errors unit of u.
    """
    indptr, indices, blocks, full, q, kind, parameters, rho, diagonal, eliminated = data
    for p in range(first, last):
        a, b, c, d = sizes[p, 0], sizes[p + 1, 0], sizes[p, 1], sizes[p + 1, 1]
        goal, work, nc = goals[p], np.zeros(1), b - a
        by_rows = full[sizes[p, 2] : sizes[p + 1, 2]]
        rows = by_rows.reshape(nc, 3, 3 * nc) if len(by_rows) else blocks[c:d]
        s = Sweep(
            indptr[a + p : b + p + 1], indices[c:d], blocks[c:d], rows, q[a:b], kind[a:b],
            parameters[a:b], rho[a:b], diagonal[a:b], eliminated[a:b],
            visits(q[a:b], d - c), EXACT, 1.0, CLOSE, STEPS, work,
        )  # fmt: skip
        x = r[a:b]
        error = natural_error(s.indptr, s.indices, rows, s.q, s.kind, s.parameters, s.rho, x)
        told[p, SWEEPS], told[p, START], told[p, CHANGED] = 0.0, error, 0.0
        history = np.empty((2, DEPTH + 1, 3 * nc))
        gram, count = np.zeros((DEPTH + 1, DEPTH)), np.zeros(2, dtype=np.int64)
        left, after = limits[p], x.copy()
        while True:
            if not error <= goal and left > 0:
                watch = np.array([goal, FIRST_JUDGED * goal, math.inf])
                done = anderson_inplace(s, x, after, history, gram, count, left, watch)
                left -= done
                told[p, SWEEPS] += done
                error = watch[2]
            told[p, ERROR], told[p, WORK] = error, work[0]
            if not error <= goal:
                break
            while True:
                found, worst, contact, hidden, changed = assess(
                    s.indptr, s.indices, rows, s.q, s.kind, s.parameters, s.rho, x,
                    floor[a:b], u[a:b], kept[a:b], status[a:b], sliding[a:b],
                )  # fmt: skip
                told[p, WORST], told[p, CONTACT], told[p, HIDDEN] = worst, contact, hidden
                if told[p, CHANGED] > 0.0:
                    error = told[p, ERROR] = found
                if not changed or not error <= goal:
                    break
                told[p, CHANGED] = 1.0
                copy_rows_inplace(kept[a:b], x)
                copy_rows_inplace(x, after)
            if not worst > weakest[p] or left <= 0 or error == 0.0:
                break
            goal = min(error * TIGHTER * weakest[p] / worst, TIGHTER * goal)


def _full(problem: FrictionProblem) -> Array:
    """Numbers of W by full rows, one behind the other; none of another W."""
    blocks = problem.blocks
    return blocks.rows.reshape(-1) if blocks.rows is not blocks.data else NO_NUMBERS


def _joined(arrays: Sequence[NDArray]) -> NDArray:
    """Arrays one behind the other, read-only as theirs are."""
    return read_only(np.concatenate(arrays))


@dataclass(eq=False)
class Together:
    """Problems in Delassus form one behind the other, with room for what is found.

    sizes (problems + 1, 3): contacts, blocks and numbers in full rows of all before a problem.
    """

    problems: Sequence[FrictionProblem]
    tolerance: float
    r: Array  # starts, then reactions, (contacts, 3)
    weakest: float = math.inf  # error of a contact from which those that are `brief` go on

    def __post_init__(self) -> None:
        problems = self.problems
        ends, limits = [(0, 0, 0)], []
        for p in problems:
            contacts, blocks = p.contacts, len(p.blocks.indices)
            before, full = ends[-1], _full(p).size
            ends.append((before[0] + contacts, before[1] + blocks, before[2] + full))
            brief = is_brief(p, self.tolerance)
            chunks = FIRST_CHUNKS if brief else chunks_alone(p)
            limits.append(sweeps_of_first_chunks(blocks, contacts, chunks))
        self.sizes, self.limits = np.array(ends, np.int64), np.array(limits, np.int64)
        self.beyond = np.array(
            [self.weakest if is_brief(p, self.tolerance) else math.inf for p in problems]
        )
        self.norms = np.array([p.q_norm for p in problems])
        kernels = [
            (*p.kernel_data[:3], _full(p), *p.kernel_data[3:], p.blocks.diagonal,
             p.blocks.eliminated) for p in problems
        ]  # fmt: skip
        if len(kernels) == 1:
            self.data = kernels[0]
        else:
            self.data = tuple(_joined(x) for x in zip(*kernels, strict=True))
        # of one type for one problem and for many: two compilations may round differently
        self.floor = np.concatenate([p.floor for p in problems])
        total = len(self.r)
        self.u, self.kept = np.empty((2, total, 3))
        self.status, self.sliding = np.empty((2, total), np.int8)
        self.told = np.empty((len(problems), 8))
        self.told.fill(math.inf)

    def solve(self, first: int, last: int) -> None:
        """Solve some of the problems."""
        solve_range(
            first, last, self.sizes, self.limits, self.tolerance * self.norms, self.beyond,
            self.data, self.floor, self.r, self.u, self.kept, self.status, self.sliding,
            self.told,
        )  # fmt: skip

    def flops(self, p: int) -> float:
        """Floating point operations of the sweeps on a problem, once they are done."""
        contacts, blocks = self.problems[p].contacts, len(self.problems[p].blocks.indices)
        each = flops_of_sweep(blocks, contacts) + flops_of_acceleration(3 * contacts, DEPTH)
        return float(self.told[p, SWEEPS]) * each + float(self.told[p, WORK])
