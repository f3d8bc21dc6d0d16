"""Kernels on all cores: parts of their rows in the threads of one team, the same bits always.

A kernel that is to be shared takes (first, last, ...), writes nothing outside of its rows that
another part reads or writes, and computes a row alike whatever `first` and `last` are; it is
compiled with nogil=True.  Then neither the number of threads nor who was quicker can be seen in
the result.  Sums over all rows are those of blocks of fixed length (`BLOCK`), added in order.

The caller works as well, and takes what no thread has begun with (`team`), so that any number
of solves at the same time, each in a thread of its user, can not wait for each other.  What
takes less than some hundred microseconds is not shared at all.

Numba's own threads are not used: of its layers the one that comes with every wheel ends the
process when two threads use it at the same time.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from .errors import InvalidInput
from .team import MOST, together

Kernel = Callable[..., None]
Range = tuple[int, int]
BLOCK = 8192  # rows of a partial sum
GRAIN = 50_000  # numbers that a part touches at least: 20 µs; to wake a thread takes 40
WORTH = 5  # such parts in a loop: half of it outweighs waking a helper, and then the caller
FINER = 2  # parts for each thread where these cost nothing: who comes late leaves one to others
DEFAULT_MOST = 16  # threads without being told: then memory is the limit, not the cores
VARIABLE = "AMONTONS_THREADS"
_started: set[Kernel] = set()  # kernels that have run in this process: these are compiled


class _Given:
    """What was asked for."""

    asked: int | None = None


def threads(count: int | None = None) -> int:
    """How many threads a solve may use from now on in this process; `count` sets it.

    Without being told it is AMONTONS_THREADS, else OMP_NUM_THREADS, else the physical cores
    that this process may use, 16 at most.  Results do not depend on it, to the last bit.
    Raises InvalidInput for a count below 1.
    """
    if count is not None:
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST:
            text = f"expected a whole number from 1 to {MOST}, got {count!r}"
            raise InvalidInput(text, ("threads",))
        _Given.asked = count
    return _Given.asked or _default()


def asked() -> int:
    """The number of threads that the user has set by `threads` or AMONTONS_THREADS, else 0."""
    return _Given.asked or _from_environment(VARIABLE) or 0


@cache
def _default() -> int:
    return (
        _from_environment(VARIABLE)
        or _from_environment("OMP_NUM_THREADS")
        or min(_cores(), DEFAULT_MOST)
    )


def _from_environment(name: str) -> int | None:
    """A count from 1; what OpenMP takes too, "4,2", is the first of them.  None without one.

    Raises InvalidInput where our own variable is no such count.
    """
    text = os.environ.get(name, "").strip()
    first = text.split(",")[0].strip()
    if first.isdecimal() and 1 <= int(first) <= MOST:
        return int(first)
    if text and name == VARIABLE:
        raise InvalidInput(f"{name}: expected a whole number from 1 to {MOST}, got {text!r}")
    return None


def _cores() -> int:
    """Physical cores that this process may use, by its affinity and its group's quota."""
    try:
        logical = os.sched_getaffinity(0)  # type: ignore[attr-defined]
    except (AttributeError, OSError):  # macOS, Windows
        return os.cpu_count() or 1
    siblings = set()
    for k in logical:
        path = Path(f"/sys/devices/system/cpu/cpu{k}/topology/thread_siblings_list")
        try:
            siblings.add(path.read_text().strip())
        except OSError:
            siblings.add(str(k))
    return max(1, min(len(siblings), _quota()))


def _quota() -> int:
    """Processors that a container may keep busy on the average, at least 1."""
    try:
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        return MOST if quota == "max" else max(1, round(int(quota) / int(period)))
    except (OSError, ValueError):
        return MOST


def split(rows: int, work: float, least: int = 1, finer: int = 1) -> list[Range]:
    """Ranges of rows for as many threads as `work`, numbers that are touched, is worth.

    least: rows of a range, where there are more ranges than one; finer: ranges for each thread.
    """
    count = int(min(work // GRAIN, rows // least)) if work >= WORTH * GRAIN else 1
    allowed = threads() if count > 1 else 1
    if allowed == 1:
        return [(0, rows)]
    count = min(finer * allowed, count)
    ends = [rows * k // count for k in range(count + 1)]
    return list(zip(ends[:-1], ends[1:], strict=True))


def over_rows(kernel: Kernel, rows: int, work: float, *arguments: Any) -> None:
    """kernel(first, last, *arguments) for all of range(rows), in parts."""
    if work < WORTH * GRAIN:  # of small problems the Python around kernels is what takes time
        kernel(0, rows, *arguments)
    else:
        shared(kernel, split(rows, work, finer=FINER), arguments)


def over_blocks(kernel: Kernel, rows: int, work: float, *arguments: Any) -> None:
    """The same with parts that begin at multiples of BLOCK, for partial sums."""
    parts = split(-(-rows // BLOCK), work, finer=FINER)
    ranges = [(first * BLOCK, min(last * BLOCK, rows)) for first, last in parts]
    shared(kernel, ranges, arguments)


def over_chunks(
    kernel: Kernel, chunks: Sequence[Range], work: float, *arguments: Any
) -> None:
    """kernel(first, last, *arguments) for every one of some ranges of rows, in any order."""
    parts = [] if work < WORTH * GRAIN else split(len(chunks), work, finer=FINER)
    if len(parts) > 1:
        _in_threads(kernel, [chunks[first:last] for first, last in parts], arguments)
    else:
        _each(kernel, chunks, arguments)


def over_stages(
    kernel: Kernel,
    chunks: Sequence[Range],
    work: float,
    *arguments: Any,
    backward: bool = False,
) -> None:
    """kernel(first, last, *arguments) on all even chunks, then on all odd ones.

    backward: the other way round.
    """
    if len(chunks) == 1:
        kernel(*chunks[0], *arguments)
        return
    for odd in (True, False) if backward else (False, True):
        over_chunks(kernel, chunks[odd::2], 0.5 * work, *arguments)


def shared(kernel: Kernel, ranges: Sequence[Range], arguments: tuple[Any, ...]) -> None:
    """kernel(first, last, *arguments) for some ranges, at once."""
    if len(ranges) == 1:
        kernel(*ranges[0], *arguments)
    else:
        _in_threads(kernel, [[part] for part in ranges], arguments)


def _in_threads(
    kernel: Kernel, groups: Sequence[Sequence[Range]], arguments: tuple[Any, ...]
) -> None:
    """A part for each group.  Errors of any part are raised when all have ended."""
    groups = list(groups)
    if kernel not in _started:  # compiled by this thread, whose clock knows of it
        _each(kernel, groups.pop(0), arguments)
        _started.add(kernel)
        if len(groups) == 1:
            _each(kernel, groups[0], arguments)
            return
    together(lambda group: _each(kernel, group, arguments), groups, threads())


def _each(kernel: Kernel, group: Iterable[Range], arguments: tuple[Any, ...]) -> None:
    for first, last in group:
        kernel(first, last, *arguments)
