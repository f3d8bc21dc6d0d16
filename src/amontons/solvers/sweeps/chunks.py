"""An order of the contacts of a large problem that lets threads share a sweep.

Contacts are cut into chunks that couple to the two beside them only (`linear.chunks`, on the
graph of W).  A sweep visits all even chunks, then all odd ones, and within a chunk goes in the
order that was asked for.  No chunk of one kind knows of another, so threads may work on several
at once, and nothing of the result depends on that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.threads import Range
from ...linear.chunks import LEAST_ENTRIES, near_numbers

if TYPE_CHECKING:
    from ...problem.friction import FrictionProblem

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SUMMED = 256  # contacts of a partial sum; chunks but the last are multiples of it
SPARSE = 0.05  # share of the blocks of W that are stored, at most: else all contacts couple


def in_chunks(problem: FrictionProblem, visits: Index) -> tuple[Index, Array]:
    """(visits in the order of chunks, (nc,), ends of chunks in it, (k,)); k = 0 without any.

    The first half of the chunks, rounded up, does not couple among itself, nor does the rest.
    """
    blocks = problem.blocks
    if len(blocks.indices) < LEAST_ENTRIES or blocks.density > SPARSE:
        return visits, np.empty(0)
    chunk, count = problem.kept(_chunk_of_contacts)
    if count < 2:
        return visits, np.empty(0)
    place = np.where(chunk % 2 == 0, chunk // 2, (count + 1) // 2 + chunk // 2)[visits]
    return visits[np.argsort(place, kind="stable")], np.cumsum(np.bincount(place)).astype(float)


def _chunk_of_contacts(problem: FrictionProblem) -> tuple[Index, int]:
    """The chunk of every contact, (nc,), and their number; the same for all variants."""
    number, chunks = near_numbers(
        problem.blocks.indptr, problem.blocks.indices, multiple=SUMMED
    )
    ends = np.array([last for _, last in chunks])
    return np.searchsorted(ends, number, side="right"), len(chunks)


def stages_of(work: Array) -> list[list[Range]]:
    """Ranges in the order of visits, those of even chunks and those of odd ones; [] of none."""
    ends = work[1:].astype(np.int64).tolist()
    ranges = list(zip([0, *ends[:-1]], ends, strict=True))
    half = (len(ranges) + 1) // 2
    return [ranges[:half], ranges[half:]] if ranges else []
