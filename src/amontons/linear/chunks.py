"""Chunks of consecutive nodes that threads can sweep at once, and numbers that allow it.

Nodes are cut into chunks so long that a node couples to its own chunk and to the two beside it
only.  Gauss-Seidel visits all even chunks, then all odd ones, and goes through each in order:
chunks of one kind know nothing of each other, so no bit depends on whether they are visited one
after the other or at once.  As an order of Gauss-Seidel it is as good as any; chunks are long,
so it hardly differs from that of the numbers.

Where the numbers of nodes do not allow it, as with meshes of a mesh generator, nodes get other
ones, level by level, by the reverse Cuthill-McKee order [GL], which also keeps what is near in
the mesh near in memory.

[GL] A. George, J. Liu, "Computer solution of large sparse positive definite systems",
Prentice-Hall (1981), chapter 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.threads import Range

Index = NDArray[np.int64]
Integers = NDArray[np.integer]
COUNTS = (64, 32, 16, 8, 4)  # chunks that are tried
FEW = 8  # chunks of some rows only: little to share, and each takes a call
LEAST_ENTRIES = 50_000  # blocks of a matrix that is not cut: a sweep takes less than a thread
LEAST_ROWS = 128  # of a chunk


def chunks_of(
    indptr: Integers, first: Integers, last: Integers, multiple: int = 1, most: int = COUNTS[0]
) -> list[Range]:
    """Chunks of rows whose least and greatest columns are first and last, (n,); one if need be.

    How many depends on the matrix alone; they have alike many entries, as threads share them.
    multiple: all but the last have so many rows, or a multiple of that; most: chunks.
    """
    rows = len(indptr) - 1
    if indptr[-1] < LEAST_ENTRIES:
        return [(0, rows)]
    for count in COUNTS[COUNTS.index(most) :]:
        wanted = np.searchsorted(indptr, indptr[-1] / count * np.arange(1, count))
        inner = multiple * np.rint(wanted / multiple).astype(np.int64)
        ends = np.concatenate([[0], inner, [rows]])
        if np.diff(ends).min() < LEAST_ROWS:
            continue
        low = np.minimum.reduceat(first, ends[:-1])
        high = np.maximum.reduceat(last, ends[:-1])
        k = np.arange(count)
        near = low >= ends[np.maximum(k - 1, 0)]
        if (near & (high < ends[np.minimum(k + 2, count)])).all():
            return [(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    return [(0, rows)]


def chunks_of_sorted(indptr: Integers, indices: Integers) -> list[Range]:
    """The same for a pattern with a diagonal and ascending columns.

    Columns beyond the last row couple no rows: nobody writes there.
    """
    rows = len(indptr) - 1
    if indptr[-1] < LEAST_ENTRIES:
        return [(0, rows)]
    last = indices[indptr[1:] - 1]
    if last.max() >= rows:
        return chunks_among(np.arange(rows), indptr, indices, COUNTS[0])
    return chunks_of(indptr, indices[indptr[:-1]], last)


def chunks_among(
    node: Integers, indptr: Integers, indices: Integers, most: int = FEW
) -> list[Range]:
    """The same for the rows of some nodes (k,), in this order, by couplings among these."""
    rows = len(node)
    if indptr[-1] < LEAST_ENTRIES:
        return [(0, rows)]
    number = np.full(max(int(node.max()), int(indices.max())) + 1, -1, dtype=np.int64)
    number[node] = np.arange(rows)
    own = number[indices]
    first = np.minimum.reduceat(np.where(own < 0, rows, own), indptr[:-1])
    last = np.maximum.reduceat(own, indptr[:-1])
    return chunks_of(indptr, first, last, most=most)


def better_numbers(indptr: Integers, indices: Integers, width: int = 1) -> Index | None:
    """New numbers of nodes, (n,), with which they come in chunks.

    None where they do already, where the matrix is small, and where none are found.  width:
    nodes that stay together.
    """
    if indptr[-1] < LEAST_ENTRIES or len(chunks_of_sorted(indptr, indices)) > 1:
        return None
    number, chunks = near_numbers(indptr, indices, width)
    return number if len(chunks) > 1 else None


def near_numbers(
    indptr: Integers, indices: Integers, width: int = 1, multiple: int = 1
) -> tuple[Index, list[Range]]:
    """The reverse Cuthill-McKee numbers of nodes, (n,), and the chunks that they give."""
    from scipy.sparse import csgraph

    n = len(indptr) - 1
    graph = units_of(indptr, indices, width)
    order = csgraph.reverse_cuthill_mckee(sparse.csr_matrix(graph), symmetric_mode=True)
    order = (width * order.astype(np.int64)[:, None] + np.arange(width)).ravel()
    number = np.empty(n, dtype=np.int64)
    number[order] = np.arange(n)
    columns = number[indices]
    first = np.minimum.reduceat(columns, indptr[:-1])[order]
    last = np.maximum.reduceat(columns, indptr[:-1])[order]
    pointers = np.concatenate([[0], np.cumsum(np.diff(indptr)[order])])
    return number, chunks_of(pointers, first, last, multiple)


def units_of(
    indptr: NDArray[np.integer], indices: NDArray[np.integer], width: int
) -> sparse.csr_array:
    """The graph of units of `width` block rows each, (n / width, n / width), sorted."""
    n = len(indptr) - 1
    graph = sparse.csr_array((np.ones(len(indices), np.int8), indices, indptr), shape=(n, n))
    if width > 1:
        unit = np.arange(n) // width
        join = sparse.csr_array((np.ones(n, np.int8), (np.arange(n), unit)))
        graph = sparse.csr_array(join.T @ graph @ join)
        graph.sort_indices()
    return sparse.csr_array((np.ones(graph.nnz), graph.indices, graph.indptr), graph.shape)
