"""Many small problems in one call, on several threads: `solve_many`.

What most of them need, the first chunks of `Auto`, runs compiled and without Python's lock on
ranges of problems (`auto.first_stage`); what is left goes to `drive`.  No problem knows of
another, so answers have the same bits for any number of threads, and those of `drive`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.clock import TimeLimit
from ..core.errors import AmontonsError, InvalidInput, shown
from ..core.threads import threads as allowed
from ..problem.friction import FrictionProblem
from ..problem.solution import FrictionSolution
from . import Auto
from .asked import Asked
from .at_once import begin_of, local_form, told
from .auto.first_stage import SWEEPS, Together
from .contract import Iterate
from .driver import drive_as_asked

Array = NDArray[np.float64]
Start = Iterate | FrictionSolution | None
RANGE = 3_000  # contacts of a range that a thread takes at once: some milliseconds
LEAST_LIMIT = 1e-9  # seconds: to `drive`, what comes too late


def solve_many(
    problems: Iterable[FrictionProblem],
    *,
    tolerance: float = 1e-8,
    contact_tolerance: float | None = None,
    time_limit: TimeLimit = None,
    starts: Sequence[Start] | None = None,
    threads: int | None = None,
) -> list[FrictionSolution]:
    """Solve many problems; a solution of each, in order, whatever its outcome.

    tolerance, contact_tolerance: as of `solve`, for every problem.  time_limit: seconds for all
    together; what is not solved then has the outcome TIME_LIMIT.  starts: one start or None for
    each problem, such as the solutions of the step before.  threads: by default as many as
    `am.threads()` says; they change no bit of any answer.
    Never raises for a solve that fails: look at `converged`.  Raises InvalidInput, which names
    the problem by its number, for what is no problem or no start, and other errors of a solve
    with that number too.
    """
    asked = Asked(tolerance, contact_tolerance, time_limit=time_limit, condense=True)
    if isinstance(problems, FrictionProblem):
        raise InvalidInput("expected a list, got one alone; write [it]", ("problems",))
    problems = list(problems)
    begins = _starts(starts, problems)
    workers = _workers(threads)
    local = {}
    for k, problem in enumerate(problems):
        with _named("problems", k):
            mine = local_form(problem)
        if mine is not None:
            local[k] = mine
    out: list[FrictionSolution | None] = [None] * len(problems)
    end = time.monotonic() + asked.deadline.left  # the clock of a thread is its own
    with ThreadPoolExecutor(workers) as pool:
        if local:
            rows = []
            for k, mine in local.items():
                with _named("starts", k):
                    rows.append(begin_of(mine, begins[k]))
            together = Together(
                list(local.values()), asked.tolerance, np.concatenate(rows), asked.of_contacts
            )
            seconds = _in_ranges(pool, together, end)
            for p, k in enumerate(local):
                out[k] = told(together, p, problems[k], asked, float(seconds[p]))
        left = [k for k, found in enumerate(out) if found is None]
        driven = pool.map(lambda k: _driven(problems[k], k, begins[k], asked, end), left)
        for k, found in zip(left, driven, strict=True):
            out[k] = found
    return [found for found in out if found is not None]


def _in_ranges(pool: ThreadPoolExecutor, together: Together, end: float) -> Array:
    """Solve all, in ranges of about equal size; seconds that each took by its operations."""
    before = together.sizes[:, 0]
    cuts = np.unique(np.searchsorted(before, np.arange(0, before[-1], RANGE)))
    cuts = np.append(cuts, len(before) - 1)

    def solve(first: int, last: int) -> float:
        began = time.perf_counter()
        if time.monotonic() < end:
            together.solve(first, last)
        return time.perf_counter() - began

    took = sum(pool.map(solve, cuts[:-1].tolist(), cuts[1:].tolist()))
    work = together.table[:, SWEEPS] * np.diff(together.sizes[:, 1])
    work = np.where(np.isfinite(work), work, 0.0)
    return took * work / max(work.sum(), 1.0)


def _driven(
    problem: FrictionProblem, k: int, start: Start, asked: Asked, end: float
) -> FrictionSolution:
    """What `drive` makes of problem k in the time that is left."""
    if asked.deadline.work is None and end < math.inf:
        asked = replace(asked, time_limit=max(end - time.monotonic(), LEAST_LIMIT))
    with _named("problems", k):
        return drive_as_asked(problem, asked, start, Auto())


@contextmanager
def _named(*place: str | int) -> Iterator[None]:
    """Say in an error to which of the many it belongs."""
    try:
        yield
    except AmontonsError as error:
        inside = error.at if error.at != ("start",) else ()
        raise type(error)(error.text, (*place, *inside)) from error


# ---------------------------------------------------------------- what is given
def _starts(starts: Sequence[Start] | None, problems: list[FrictionProblem]) -> list[Start]:
    """A start or None for each problem."""
    if starts is None:
        return [None] * len(problems)
    starts = list(starts)
    if len(starts) != len(problems):
        raise InvalidInput(
            f"expected one start for each of {len(problems)} problems, got {len(starts)}",
            ("starts",),
        )
    return starts


def _workers(threads: int | None) -> int:
    """How many threads work."""
    if threads is None:
        return allowed()
    if not isinstance(threads, int) or isinstance(threads, bool) or threads < 1:
        raise InvalidInput(
            f"expected a whole number >= 1, or None, got {shown(threads)}", ("threads",)
        )
    return threads
