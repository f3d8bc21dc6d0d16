"""Sums of entries and of products of sparse matrices, compiled: one pass, one result.

A chain of sparse operations makes an object per step; on the matrices of a few hundred rows
that contact between two bodies has, these cost more than all numbers in them.  What is only
multiplied on stays as `Rows`, with columns as they come: sorting them takes as long as the sum.
Entries are added up in the order in which they are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.compiled import njit

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Blocks = tuple[Array, Index, Index]  # values (q, m, w), rows (q, m), columns (q, w)


@dataclass(frozen=True, eq=False)
class Rows:
    """A matrix by rows: pointers (n + 1,), columns (e,), each once in any order, values."""

    indptr: Index
    indices: Index
    data: Array
    shape: tuple[int, int]

    @property
    def matrix(self) -> sparse.csr_array:
        """The same for SciPy, columns sorted."""
        found = _sorted(self.indptr, self.indices, self.data, self.shape[1])
        return _stored((self.indptr, *found), self.shape)

    def times(self, by_row: Array) -> Rows:
        """Rows times factors (n,)."""
        factors = np.repeat(by_row, np.diff(self.indptr))
        return Rows(self.indptr, self.indices, self.data * factors, self.shape)

    def __neg__(self) -> Rows:
        return Rows(self.indptr, self.indices, -self.data, self.shape)


AnyRows = sparse.csr_array | Rows
Product = tuple[AnyRows | None, AnyRows]


def rows_of_blocks(blocks: Sequence[Blocks], shape: tuple[int, int]) -> Rows:
    """Values (q, m, w) added at rows (q, m), < 0 for none, and columns (q, w)."""
    parts = [tuple(map(np.ascontiguousarray, block)) for block in blocks]
    pointers = np.zeros(shape[0] + 1, np.int64)
    for values, rows, _ in parts:
        _count(values, rows, pointers)
    place = np.cumsum(pointers)
    columns, found = np.empty(place[-1], np.int64), np.empty(place[-1])
    pointers[:] = place
    for part in parts:
        _place(*part, place, columns, found)
    end = _merge_inplace(pointers, columns, found, shape[1])
    return Rows(pointers, columns[:end], found[:end], shape)


def sum_of_blocks(blocks: Sequence[Blocks], shape: tuple[int, int]) -> sparse.csr_array:
    """`rows_of_blocks` for SciPy."""
    return rows_of_blocks(blocks, shape).matrix


def rows_of_products(products: Sequence[Product], shape: tuple[int, int]) -> Rows:
    """The sum of products A B of matrices by rows, a pair (A, B) each; None: A is 1."""
    n, last, first = shape[0], 0, 0
    units = np.full(len(products), -1)
    indptr = np.zeros((len(products), n + 1), np.int64)
    indices, data = [np.zeros(0, np.int64)], [np.zeros(0)]
    for t, (left, right) in enumerate(products):
        if left is None:
            units[t] = last
        else:
            indptr[t] = left.indptr
            indptr[t] += first
            indices.append(left.indices + np.int64(last))
            data.append(left.data)
            first += len(left.indices)
        last += right.shape[0]
    ends, columns, values = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    first = 0
    for _, right in products:
        ends.append(right.indptr[1:] + np.int64(first))
        columns.append(right.indices)
        values.append(right.data)
        first += len(right.indices)
    below = (np.concatenate(ends), np.concatenate(columns, dtype=np.int64),
             np.concatenate(values))  # fmt: skip
    above = units, indptr, np.concatenate(indices), np.concatenate(data)
    return Rows(*_multiplied(*above, *below, shape[1]), shape)


def sum_of_products(products: Sequence[Product], shape: tuple[int, int]) -> sparse.csr_array:
    """`rows_of_products` for SciPy."""
    return rows_of_products(products, shape).matrix


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


def among(matrix: AnyRows, chosen: Index) -> sparse.csc_array:
    """Chosen rows and columns (n,), each once, of a square matrix, in this order."""
    number = np.full(matrix.shape[0], -1)
    number[chosen] = np.arange(len(chosen))
    places = (part.astype(np.int64, copy=False) for part in (matrix.indptr, matrix.indices))
    found = _among(*places, matrix.data, chosen, number)
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
def _count(values, rows, pointers):
    """Add how many entries of blocks are not zero in every row, one place on."""
    for q in range(values.shape[0]):
        for i in range(values.shape[1]):
            row = rows[q, i]
            if row < 0:
                continue
            for j in range(values.shape[2]):
                if values[q, i, j] != 0:
                    pointers[row + 1] += 1


@njit(cache=True)
def _place(values, rows, columns, place, out_columns, out):  # noqa: PLR0913
    """Put entries of blocks that are not zero where their rows go on, place (n + 1,)."""
    for q in range(values.shape[0]):
        for i in range(values.shape[1]):
            row = rows[q, i]
            if row < 0:
                continue
            at = place[row]
            for j in range(values.shape[2]):
                if values[q, i, j] != 0:
                    out_columns[at], out[at] = columns[q, j], values[q, i, j]
                    at += 1
            place[row] = at


@njit(cache=True)
def _merge_inplace(pointers, columns, values, m):
    """Add up entries of a row with the same column; how many entries are left."""
    seen, end, first = np.full(m, -1, np.int64), 0, 0  # where a column was put last
    for row in range(len(pointers) - 1):
        start, last = end, pointers[row + 1]
        for k in range(first, last):
            c = columns[k]
            if seen[c] >= start:
                values[seen[c]] += values[k]
            else:
                seen[c] = end
                columns[end], values[end] = c, values[k]
                end += 1
        first, pointers[row + 1] = last, end
    return end


@njit(cache=True)
def _multiplied(units, indptr, indices, data, ends, columns, values, m):  # noqa: PLR0913
    """(row pointers, columns, values) of the sum of products, columns as they come.

    units (t,): where rows of the right matrix begin if the left one is 1, else -1; indptr
    (t, n + 1): rows of the left matrices in indices, rows of all right ones together, and
    data; ends, columns, values: these.
    """
    n, end = indptr.shape[1] - 1, 0
    pointers, seen = np.zeros(n + 1, np.int64), np.full(m, -1, np.int64)
    out_columns, out = np.empty(len(values), np.int64), np.empty(len(values))
    for row in range(n):
        start, most = end, 0
        for t in range(len(units)):
            if units[t] >= 0:
                most += ends[units[t] + row + 1] - ends[units[t] + row]
            for p in range(indptr[t, row], indptr[t, row + 1]):
                most += ends[indices[p] + 1] - ends[indices[p]]
        if end + min(most, m) > len(out):
            room = max(2 * len(out), end + min(most, m))
            wider, more = np.empty(room, np.int64), np.empty(room)
            wider[:end], more[:end] = out_columns[:end], out[:end]
            out_columns, out = wider, more
        for t in range(len(units)):
            first, last = indptr[t, row], indptr[t, row + 1]
            if units[t] >= 0:
                first, last = 0, 1
            for p in range(first, last):
                k, factor = units[t] + row, 1.0
                if units[t] < 0:
                    k, factor = indices[p], data[p]
                for q in range(ends[k], ends[k + 1]):
                    c = columns[q]
                    if seen[c] >= start:
                        out[seen[c]] += factor * values[q]
                    else:
                        seen[c] = end
                        out_columns[end], out[end] = c, factor * values[q]
                        end += 1
        pointers[row + 1] = end
    return pointers, out_columns[:end].copy(), out[:end].copy()


@njit(cache=True)
def _sorted(pointers, columns, values, m):
    """(columns, values) with columns ascending in every row: turned over twice."""
    n, count = len(pointers) - 1, len(columns)
    first = np.zeros(m + 1, np.int64)
    for c in columns:
        first[c + 1] += 1
    for c in range(m):
        first[c + 1] += first[c]
    rows, turned = np.empty(count, np.int64), np.empty(count)
    for row in range(n):
        for k in range(pointers[row], pointers[row + 1]):
            at = first[columns[k]]
            rows[at], turned[at] = row, values[k]
            first[columns[k]] = at + 1  # in the end where the next column begins
    out_columns, out, place = np.empty(count, np.int64), np.empty(count), pointers[:-1].copy()
    start = 0
    for c in range(m):
        for k in range(start, first[c]):
            at = place[rows[k]]
            out_columns[at], out[at] = c, turned[k]
            place[rows[k]] = at + 1
        start = first[c]
    return out_columns, out


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
