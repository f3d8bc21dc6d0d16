"""Sums of entries and of products of sparse matrices, compiled: one pass, one result.

A chain of sparse operations makes an object per step; on the matrices of a few hundred rows
that contact between two bodies has, these cost more than all numbers in them.
Entries are added up in the order in which they are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.compiled import njit

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Blocks = tuple[Array, Index, Index]  # values (q, m, w), rows (q, m), columns (q, w)
Product = tuple[sparse.csr_array | None, sparse.csr_array]


def sum_of_blocks(blocks: Sequence[Blocks], shape: tuple[int, int]) -> sparse.csr_array:
    """Values (q, m, w) added at rows (q, m), < 0 for none, and columns (q, w)."""
    room = sum(values.size for values, _, _ in blocks)
    values, rows, columns = np.empty(room), np.empty(room, np.int64), np.empty(room, np.int64)
    count = 0
    for part in blocks:
        count = _unroll(*map(np.ascontiguousarray, part), values, rows, columns, count)
    return _stored(
        _compressed(values[:count], rows[:count], columns[:count], *shape), shape
    )


def sum_of_products(products: Sequence[Product], shape: tuple[int, int]) -> sparse.csr_array:
    """The sum of products A B of matrices by rows, a pair (A, B) each; None: A is 1."""
    parts, starts, last = [], [0], 0
    for left, right in products:
        rows, k, factors = _rows(left, shape[0])
        parts.append((rows, k + np.int64(last), factors))
        last += right.shape[0]
        starts.append(starts[-1] + len(k))
    indptr = np.stack([p[0] + np.int64(s) for p, s in zip(parts, starts[:-1], strict=True)])
    indices = np.concatenate([p[1] for p in parts])
    data = np.concatenate([p[2] for p in parts])
    ends, columns, values, first = [np.zeros(1, np.int64)], [], [], 0
    for _, right in products:
        ends.append(right.indptr[1:] + np.int64(first))
        columns.append(right.indices)
        values.append(right.data)
        first += len(right.indices)
    below = np.concatenate(ends), np.concatenate(columns), np.concatenate(values)
    return _stored(_multiplied(indptr, indices, data, *below, shape[1]), shape)


def _rows(matrix: sparse.csr_array | None, n: int) -> tuple[Any, Any, Any]:
    """(row pointers, columns, values), of the unit matrix (n, n) for None."""
    if matrix is None:
        return np.arange(n + 1), np.arange(n), np.ones(n)
    return matrix.indptr, matrix.indices, matrix.data


def by_components(matrix: sparse.csr_array, factors: Array) -> sparse.csr_array:
    """The Kronecker product with the unit matrix (d, d), columns times factors (columns, d)."""
    m, d = factors.shape
    shape = (len(matrix.indptr) - 1) * d, m * d
    found = _spread(matrix.indptr, matrix.indices, matrix.data, np.ascontiguousarray(factors))
    return _stored(found, shape)


def in_rows(matrix: sparse.csr_array, rows: Index, count: int) -> sparse.csr_array:
    """The same rows at other places, each once, among `count`."""
    sizes = np.zeros(count + 1, np.int64)
    sizes[rows + 1] = np.diff(matrix.indptr)
    order = np.argsort(rows, kind="stable")
    if (order[1:] > order[:-1]).all():
        data, indices = matrix.data, matrix.indices
    else:
        moved = matrix[order]
        data, indices = moved.data, moved.indices
    return _stored((np.cumsum(sizes), indices, data), (count, matrix.shape[1]))


def among(matrix: sparse.csr_array, chosen: Index) -> sparse.csc_array:
    """Chosen rows and columns (n,), each once, of a square matrix, in this order."""
    number = np.full(matrix.shape[0], -1)
    number[chosen] = np.arange(len(chosen))
    found = _among(matrix.indptr, matrix.indices, matrix.data, chosen, number)
    shape = len(chosen), len(chosen)
    pointers, rows, values = found
    return sparse.csc_array((values, rows, pointers), shape=shape)


def _stored(
    parts: tuple[Any, Any, Any], shape: tuple[int, int]
) -> sparse.csr_array:
    """(row pointers, columns, values) as a matrix, in numbers of the size that SciPy takes."""
    pointers, columns, values = parts
    kind = np.int32 if max(len(values), *shape) < np.iinfo(np.int32).max else np.int64
    pointers, columns = pointers.astype(kind, copy=False), columns.astype(kind, copy=False)
    return sparse.csr_array((values, columns, pointers), shape=shape)


@njit(cache=True)
def _unroll(values, rows, columns, out, out_rows, out_columns, count):  # noqa: PLR0913
    """Entries of blocks that are not zero, from `count` on; how many there are then."""
    for q in range(values.shape[0]):
        for i in range(values.shape[1]):
            if rows[q, i] < 0:
                continue
            for j in range(values.shape[2]):
                if values[q, i, j] != 0:
                    out[count] = values[q, i, j]
                    out_rows[count] = rows[q, i]
                    out_columns[count] = columns[q, j]
                    count += 1
    return count


@njit(cache=True)
def _compressed(values, rows, columns, n, m):
    """(row pointers, columns, values) of the sum of entries, columns sorted."""
    first = np.zeros(n + 1, np.int64)
    for row in rows:
        first[row + 1] += 1
    first = np.cumsum(first)
    order, place = np.empty(len(rows), np.int64), first[:-1].copy()
    for k in range(len(rows)):
        order[place[rows[k]]] = k
        place[rows[k]] += 1
    pointers = np.zeros(n + 1, np.int64)
    out_columns, out = np.empty(len(rows), np.int64), np.empty(len(rows))
    work, seen = np.zeros(m), np.full(m, -1, np.int64)
    end = 0
    for row in range(n):
        start = end
        for k in order[first[row] : first[row + 1]]:
            c = columns[k]
            if seen[c] != row:
                seen[c] = row
                work[c] = 0.0
                out_columns[end] = c
                end += 1
            work[c] += values[k]
        out_columns[start:end].sort()
        for j in range(start, end):
            out[j] = work[out_columns[j]]
        pointers[row + 1] = end
    return pointers, out_columns[:end].copy(), out[:end].copy()


@njit(cache=True)
def _multiplied(indptr, indices, data, ends, columns, values, m):  # noqa: PLR0913
    """(row pointers, columns, values) of the sum of products, columns sorted.

    indptr (t, n + 1): rows of the left matrices in indices, rows of all right ones together,
    and data; ends, columns, values: these.
    """
    n = indptr.shape[1] - 1
    pointers, seen = np.zeros(n + 1, np.int64), np.full(m, -1, np.int64)
    end = 0
    for row in range(n):
        for t in range(indptr.shape[0]):
            for k in indices[indptr[t, row] : indptr[t, row + 1]]:
                for c in columns[ends[k] : ends[k + 1]]:
                    if seen[c] != row:
                        seen[c] = row
                        end += 1
        pointers[row + 1] = end
    out_columns, out, work = np.empty(end, np.int64), np.empty(end), np.zeros(m)
    seen[:] = -1
    for row in range(n):
        end = pointers[row]
        for t in range(indptr.shape[0]):
            for p in range(indptr[t, row], indptr[t, row + 1]):
                k, factor = indices[p], data[p]
                for q in range(ends[k], ends[k + 1]):
                    c = columns[q]
                    if seen[c] != row:
                        seen[c] = row
                        work[c] = 0.0
                        out_columns[end] = c
                        end += 1
                    work[c] += factor * values[q]
        out_columns[pointers[row] : end].sort()
        for j in range(pointers[row], end):
            out[j] = work[out_columns[j]]
    return pointers, out_columns, out


@njit(cache=True)
def _spread(indptr, indices, data, factors):
    """(row pointers, columns, values) of `by_components`; entries by zero are left out."""
    n, d = len(indptr) - 1, factors.shape[1]
    room = d * len(data)
    pointers = np.zeros(n * d + 1, np.int64)
    columns, values = np.empty(room, np.int64), np.empty(room)
    end = 0
    for row in range(n):
        for c in range(d):
            for k in range(indptr[row], indptr[row + 1]):
                factor = factors[indices[k], c]
                if factor != 0 and data[k] != 0:
                    columns[end], values[end] = indices[k] * d + c, data[k] * factor
                    end += 1
            pointers[row * d + c + 1] = end
    return pointers, columns[:end].copy(), values[:end].copy()


@njit(cache=True)
def _among(indptr, indices, data, chosen, number):
    """(column pointers, rows, values) of chosen rows and columns."""
    n = len(chosen)
    pointers = np.zeros(n + 1, np.int32)
    for row in chosen:
        for k in range(indptr[row], indptr[row + 1]):
            if number[indices[k]] >= 0:
                pointers[number[indices[k]] + 1] += 1
    for column in range(n):
        pointers[column + 1] += pointers[column]
    rows, values = np.empty(pointers[n], np.int32), np.empty(pointers[n])
    place = pointers[:-1].copy()
    for i in range(n):
        for k in range(indptr[chosen[i]], indptr[chosen[i] + 1]):
            column = number[indices[k]]
            if column >= 0:
                rows[place[column]], values[place[column]] = i, data[k]
                place[column] += 1
    return pointers, rows, values
