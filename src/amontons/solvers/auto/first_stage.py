"""The first stage of `Auto` on small problems, compiled: sweeps and judge in one call.

Most problems of a simulator end in the first chunks of the first track, accelerated sweeps
(`portfolio`), whose arithmetic takes some microseconds and whose way through the driver fifty.
Here all problems stand one behind the other in shared arrays, and one call without Python's
lock goes through a range of them: the same sweeps, judge and reactions, bit by bit, for one
problem and for many.  What does not end here goes on in the race from where it is (`Begun`).

Where the sum of all errors will do but not the weakest contact, contacts are looked at after
every sweep, that one first, until one will not do, and all are judged again where all will.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only
from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from ...problem.friction import FrictionProblem
from ...problem.judge.contacts import assess, weak_contact
from ...problem.judge.measures import natural_error
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
    Begun,
    Swept,
    chunks_alone,
    is_brief,
    is_light,
    nanoseconds_of_sweep,
    visits,
)
from .tracks import DEPTH, LEAST, sweeps_on_stacks

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
# Columns of the table of problems.  Given: sweeps at most, errors that will do, of all and of
# the weakest contact.  Told: sweeps, error at the start and now, error of the weakest contact,
# which it is, what rounding hides, whether reactions were made to keep to their statuses,
# operations on single contacts and of judgements.  Errors of all in the unit of u.
LIMIT, GOAL, WEAKEST, SWEEPS, START, ERROR, WORST, CONTACT, HIDDEN, CHANGED, WORK = range(11)
NO_NUMBERS = read_only(np.empty(0))
GRAM = (DEPTH + 1) * DEPTH
# numbers of a memory beside its vectors: gram, watch (3,), count (2,), whether it is weak
OWN = GRAM + 6
VECTORS = 2 * (DEPTH + 1) + 1  # in it: the history and the next point


@lru_cache(maxsize=SIZES)
def first_chunks(blocks: int, contacts: int) -> tuple[int, ...]:
    """Sweeps of each of the chunks that the first track has before all others."""
    cost, total, out = nanoseconds_of_sweep(blocks, contacts, HISTORY_CONTACT), 0.0, []
    for _ in range(FIRST_CHUNKS):
        sweeps = max(LEAST, int(max(GROWTH * total, SHORTEST) / cost))
        total += sweeps * cost + CALL
        out.append(sweeps)
    return tuple(out)


@njit(cache=True, error_model="numpy", nogil=True)
def _until_settled(s, x, after, history, gram, count, sweeps, floor, u, weak, weakest):  # noqa: PLR0913
    """Sweeps until all contacts will do: (how many, one that will not or -1).

    weak: one that will not do at first; u (nc, 3) is memory.
    """
    never = np.array([0.0, -1.0, math.inf])
    for k in range(sweeps):
        anderson_inplace(s, x, after, history, gram, count, 1, never)
        weak = weak_contact(
            s.indptr, s.indices, s.rows, s.q, s.kind, s.parameters, s.rho, x, floor, u, weak,
            weakest,
        )  # fmt: skip
        if weak < 0:
            return k + 1, weak
    return sweeps, weak


@njit(cache=True, error_model="numpy", nogil=True)
def _begin(s, row, x, after, gram, watch, stored):
    """Begin anew with a problem: nothing is stored, the error of its start is told."""
    gram[:, :] = stored[:] = 0.0
    copy_rows_inplace(x, after)
    watch[0], watch[1], watch[2] = row[GOAL], FIRST_JUDGED * row[GOAL], math.inf
    row[SWEEPS], row[CHANGED] = 0.0, 0.0
    row[START] = row[ERROR] = natural_error(
        s.indptr, s.indices, s.rows, s.q, s.kind, s.parameters, s.rho, x
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _assess(s, row, floor, x, after, u, status, sliding):
    """All that is asked of x, (nc, 3), made to keep to its statuses; True where all will do."""
    kept = np.empty_like(x)
    while True:
        found, worst, contact, hidden, changed = assess(
            s.indptr, s.indices, s.rows, s.q, s.kind, s.parameters, s.rho, x, floor, u, kept,
            status, sliding,
        )  # fmt: skip
        row[WORST], row[CONTACT], row[HIDDEN] = worst, contact, hidden
        if row[CHANGED] > 0.0:
            row[ERROR] = found
        if not changed or not row[ERROR] <= row[GOAL]:
            return row[ERROR] <= row[GOAL] and not worst > row[WEAKEST]
        row[CHANGED] = 1.0
        copy_rows_inplace(kept, x)
        copy_rows_inplace(x, after)


@njit(cache=True, error_model="numpy", nogil=True)
def _solve(s, row, floor, x, u, status, sliding, after, history, gram, watch, stored):  # noqa: PLR0913
    """Go on with one problem until it is solved or its limit; arguments as of `solve_range`."""
    weak, goal, left = stored[2] > 0.0, row[GOAL], int(row[LIMIT] - row[SWEEPS])
    count = np.array([int(stored[0]), int(stored[1])])
    while True:
        if weak or not row[ERROR] <= goal:
            if weak:
                done, contact = _until_settled(
                    s, x, after, history, gram, count, left, floor, u, int(row[CONTACT]),
                    row[WEAKEST],
                )  # fmt: skip
                content, row[CONTACT] = contact < 0, contact
            else:
                done = anderson_inplace(s, x, after, history, gram, count, left, watch)
                content = watch[2] < math.inf
            left -= done
            row[SWEEPS] += done
            row[ERROR] = watch[2]
            if weak or not content:
                row[ERROR] = natural_error(
                    s.indptr, s.indices, s.rows, s.q, s.kind, s.parameters, s.rho, x
                )
            if not content:
                row[WORST] = math.inf
                break
            watch[0], watch[1], watch[2] = goal, FIRST_JUDGED * goal, math.inf
            if not row[ERROR] <= goal:
                weak = False
                continue
        good = _assess(s, row, floor, x, after, u, status, sliding)
        if good or row[CONTACT] < 0 or row[ERROR] == 0.0:
            weak = False
            break
        weak = row[ERROR] <= goal
        row[CHANGED] = 0.0
    row[WORK] = s.work[0]
    stored[0], stored[1], stored[2] = count[0], count[1], 1.0 if weak else 0.0


@njit(cache=True, error_model="numpy", nogil=True)
def solve_range(first, last, sizes, table, data, floor, r, u, states, memory):  # noqa: PLR0913
    """Go on with problems first to last - 1 from r, until they are solved or their limits.

    sizes (problems + 1, 3): contacts, blocks and numbers in full rows of W of all before a
    problem; table (problems, 11): see the columns.  data: arrays of all problems one behind the
    other, a row of indptr more for each.  Fills r, u (contacts, 3), states (2, contacts), the
    status and whether a contact may slide, and what is told; error of the weakest contact inf
    where a limit was met.  memory: of the sweeps, with room for the largest problem; where one
    problem goes on, as it was left.
    """
    indptr, indices, blocks, full, q, kind, parameters, rho, diagonal, eliminated, order = data
    gram = memory[:GRAM].reshape(DEPTH + 1, DEPTH)
    watch, stored = memory[GRAM : GRAM + 3], memory[GRAM + 3 : OWN]
    for p in range(first, last):
        a, b, c, d = sizes[p, 0], sizes[p + 1, 0], sizes[p, 1], sizes[p + 1, 1]
        row, size = table[p], 3 * (b - a)
        by_rows = full[sizes[p, 2] : sizes[p + 1, 2]]
        rows = by_rows.reshape(b - a, 3, size) if len(by_rows) else blocks[c:d]
        s = Sweep(
            indptr[a + p : b + p + 1], indices[c:d], blocks[c:d], rows, q[a:b], kind[a:b],
            parameters[a:b], rho[a:b], diagonal[a:b], eliminated[a:b], order[a:b], EXACT, 1.0,
            CLOSE, STEPS, np.zeros(1),
        )  # fmt: skip
        after = memory[OWN : OWN + size].reshape(b - a, 3)
        history = memory[OWN + size : OWN + VECTORS * size].reshape(2, DEPTH + 1, size)
        if not row[SWEEPS] < math.inf:
            _begin(s, row, r[a:b], after, gram, watch, stored)
        else:
            s.work[0] = row[WORK]
            if not stored[2] > 0.0:
                row[ERROR] = math.inf  # the sweeps ask for it, as they would have
        _solve(
            s, row, floor[a:b], r[a:b], u[a:b], states[0, a:b], states[1, a:b], after, history,
            gram, watch, stored,
        )  # fmt: skip


class Read(NamedTuple):
    """What `solve_range` reads of a problem; sizes (2, 3).

    flops: operations of an accelerated sweep, without those on single contacts.  light: whether
    all of it is made here (`is_light`).
    """

    sizes: Counts
    data: tuple[Any, ...]
    floor: Array
    flops: float
    light: bool


def read_of(problem: FrictionProblem) -> Read:
    """The arrays of a problem in Delassus form, all read-only: kernels are compiled once."""
    blocks, data = problem.blocks, problem.kernel_data
    full = blocks.rows.reshape(-1) if blocks.rows is not blocks.data else NO_NUMBERS
    order = read_only(visits(data[3], len(blocks.indices)))
    arrays = *data[:3], full, *data[3:], blocks.diagonal, blocks.eliminated, order
    contacts, count = problem.contacts, len(blocks.indices)
    sizes = np.array([(0, 0, 0), (contacts, count, full.size)], np.int64)
    flops = flops_of_sweep(count, contacts) + flops_of_acceleration(3 * contacts, DEPTH)
    floor = read_only(np.array(problem.floor))
    return Read(sizes, arrays, floor, flops, is_light(problem))


def _joined(arrays: Sequence[NDArray]) -> NDArray:
    """Arrays one behind the other, read-only as theirs are."""
    return read_only(np.concatenate(arrays))


def chunks_of(problem: FrictionProblem, tolerance: float) -> Iterator[int]:
    """Sweeps of each of the chunks that are made of a problem here."""
    blocks, contacts = len(problem.blocks.indices), problem.contacts
    if is_brief(problem, tolerance) or chunks_alone(problem) > 1:
        yield from first_chunks(blocks, contacts)
    else:
        yield sweeps_on_stacks(nanoseconds_of_sweep(blocks, contacts, HISTORY_CONTACT))


@dataclass(eq=False)
class Together:
    """Problems in Delassus form one behind the other, with room for what is found.

    sizes (problems + 1, 3): contacts, blocks and numbers in full rows of all before a problem;
    table (problems, 11): see its columns.
    """

    problems: Sequence[FrictionProblem]
    tolerance: float
    r: Array  # starts, then reactions, (contacts, 3)
    weakest: float = math.inf  # error of a contact from which those that are light go on

    def __post_init__(self) -> None:
        self.reads = reads = [problem.kept_alone(read_of) for problem in self.problems]
        if len(reads) == 1:
            self.sizes, self.data, self.floor = reads[0][:3]
        else:
            ends = np.cumsum([read.sizes[1] for read in reads], axis=0)
            self.sizes = np.concatenate([reads[0].sizes[:1], ends])
            self.data = tuple(
                _joined(same) for same in zip(*(read.data for read in reads), strict=True)
            )
            self.floor = _joined([read.floor for read in reads])
        self.table = np.empty((len(reads), WORK + 1))
        self.table.fill(math.inf)  # nothing is told yet
        for row, problem, read in zip(self.table, self.problems, reads, strict=True):
            row[LIMIT], row[GOAL] = 0.0, self.tolerance * problem.q_norm
            row[WEAKEST] = self.weakest if read.light else math.inf
        self.u, self.states = np.empty((len(self.r), 3)), np.empty((2, len(self.r)), np.int8)

    def solve(self, first: int, last: int) -> None:
        """Solve some of the problems as far as the first stage goes."""
        for p in range(first, last):
            self.table[p, LIMIT] = sum(chunks_of(self.problems[p], self.tolerance))
        largest = max(problem.contacts for problem in self.problems[first:last])
        self._go_on(first, last, np.empty(OWN + 3 * VECTORS * largest))

    @cached_property
    def memory(self) -> Array:
        """That of the sweeps of a problem that is alone."""
        return np.empty(OWN + VECTORS * self.r.size)

    def _go_on(self, first: int, last: int, memory: Array) -> None:
        solve_range(
            first, last, self.sizes, self.table, self.data, self.floor, self.r, self.u,
            self.states, memory,
        )  # fmt: skip

    def chunks(self) -> Iterator[None]:
        """Solve a problem that is alone, chunk by chunk."""
        for sweeps in chunks_of(self.problems[0], self.tolerance):
            self.table[0, LIMIT] += sweeps
            self._go_on(0, 1, self.memory)
            yield

    def swept(self, before: Sequence[Swept]) -> Swept:
        """The last chunk of a problem that is alone, after those before it."""
        sweeps = int(self.table[0, SWEEPS]) - sum(chunk.sweeps for chunk in before)
        flops = self.flops(0) - sum(chunk.flops for chunk in before)
        return Swept(self.r.copy(), sweeps, flops, float(self.table[0, ERROR]))

    def begun(self, start: Array, chunks: list[Swept]) -> Begun:
        """What there is to go on from, of a problem that is alone."""
        own, size = self.memory[:OWN], self.r.size
        vectors = self.memory[OWN:].reshape(VECTORS, size)
        return Begun(
            start, chunks, vectors[0].reshape(-1, 3), vectors[1:].reshape(2, DEPTH + 1, size),
            own[:GRAM].reshape(DEPTH + 1, DEPTH), own[GRAM + 3 : OWN - 1].astype(np.int64),
            own[GRAM : GRAM + 3],
        )  # fmt: skip

    def flops(self, p: int) -> float:
        """Floating point operations of the sweeps on a problem, once they are done."""
        return float(self.table[p, SWEEPS]) * self.reads[p].flops + float(self.table[p, WORK])
