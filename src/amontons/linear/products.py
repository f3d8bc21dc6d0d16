"""Products of matrices in blocks on all threads, the same bits always.

A row of a product needs one row of the left matrix, so parts of these rows are multiplied by
scipy, which lets other threads work meanwhile, and put one under the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.threads import over_rows

Array = NDArray[np.float64]
Index = NDArray[np.integer]


def product(left: sparse.bsr_array, right: sparse.bsr_array) -> sparse.bsr_array:
    """left (n, m) times right (m, k), both in square blocks of one size."""
    size = left.blocksize[0]
    rows, inner = left.shape[0] // size, max(right.shape[0] // size, 1)
    work = 2.0 * size**3 * len(left.indices) * len(right.indices) / inner
    parts: dict[int, sparse.bsr_array] = {}
    over_rows(_multiply, rows, work, left, right, parts)
    if len(parts) == 1:
        return next(iter(parts.values()))
    found = [parts[first] for first in sorted(parts)]
    ends = np.cumsum([0, *(len(part.indices) for part in found)])
    data = np.empty((ends[-1], size, size), dtype=found[0].data.dtype)
    indices = np.empty(ends[-1], dtype=found[0].indices.dtype)
    over_rows(_place, len(found), data.size, found, ends, data, indices)
    pointers = [part.indptr[1:] + end for part, end in zip(found, ends, strict=False)]
    kind = np.int32 if ends[-1] <= np.iinfo(np.int32).max else np.int64
    pointers = np.concatenate([np.zeros(1), *pointers]).astype(kind)
    shape = left.shape[0], right.shape[1]
    return sparse.bsr_array((data, indices, pointers), shape=shape)


def _multiply(
    first: int, last: int, left: sparse.bsr_array, right: sparse.bsr_array,
    parts: dict[int, sparse.bsr_array],
) -> None:  # fmt: skip
    """Block rows first to last of the product, under their first number."""
    start, end = left.indptr[first], left.indptr[last]
    size = left.blocksize[0]
    rows = sparse.bsr_array(
        (left.data[start:end], left.indices[start:end], left.indptr[first : last + 1] - start),
        shape=(size * (last - first), left.shape[1]),
    )
    parts[first] = sparse.bsr_array(rows @ right)


def _place(  # noqa: PLR0913  # as kernels are
    first: int, last: int, found: list[sparse.bsr_array], ends: Index, data: Array,
    indices: Index,
) -> None:  # fmt: skip
    """The blocks of parts first to last where they stand in the whole."""
    for part, start in zip(found[first:last], ends[first:last], strict=True):
        data[start : start + len(part.indices)] = part.data
        indices[start : start + len(part.indices)] = part.indices
