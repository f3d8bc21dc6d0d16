"""The compiled loops of `spread_aggregates`: P of aggregates, P' A P row by row, P and P'.

A is in block rows of nodes (3, 3), P has blocks (3, w) of a node and the w motions of a unit.
"""

from __future__ import annotations

import numpy as np

from ..core.compiled import njit


@njit(cache=True, error_model="numpy")
def units_of_rows(indptr, indices, unit, units):
    """Pointers: how many units the nodes of a row belong to."""
    n = len(indptr) - 1
    mark = np.full(units, -1, np.int64)
    out = np.zeros(n + 1, np.int64)
    for i in range(n):
        count = 0
        for k in range(indptr[i], indptr[i + 1]):
            u = unit[indices[k]]
            if u >= 0 and mark[u] != i:
                mark[u] = i
                count += 1
        out[i + 1] = out[i] + count
    return out


@njit(cache=True, error_model="numpy")
def smooth(indptr, indices, data, inverse, T, unit, omega, units, pointers, out, blocks):  # noqa: PLR0913
    """Rows of T - omega D^-1 A T, units in the order in which they come."""
    width = T.shape[2]
    slot = np.full(units, -1, np.int64)
    for i in range(len(indptr) - 1):
        first = used = pointers[i]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            u = unit[j]
            if u < 0:
                continue
            s = slot[u]
            if s < first or s >= used or out[s] != u:
                s = used
                slot[u] = s
                out[s] = u
                used += 1
            for a in range(3):
                for c in range(3):
                    factor = data[k, a, c]
                    for b in range(width):
                        blocks[s, a, b] += factor * T[j, c, b]
        for s in range(first, used):
            for b in range(width):
                x, y, z = blocks[s, 0, b], blocks[s, 1, b], blocks[s, 2, b]
                for a in range(3):
                    blocks[s, a, b] = -omega * (
                        inverse[i, a, 0] * x + inverse[i, a, 1] * y + inverse[i, a, 2] * z
                    )
        if unit[i] >= 0:
            s = slot[unit[i]]
            for a in range(3):
                for b in range(width):
                    blocks[s, a, b] += T[i, a, b]


@njit(cache=True, error_model="numpy")
def triple(  # noqa: PLR0913
    nodes, indptr, indices, data, p_ptr, p_units, P, column, columns, c_ptr, c_idx, out
):
    """out += P' A P of rows of nodes; p_units: rows of out, column: their units as columns."""
    width = P.shape[2]
    slot = np.full(columns, -1, np.int64)
    most = 0
    for i in range(len(nodes)):
        count = 0
        for k in range(indptr[i], indptr[i + 1]):
            count += p_ptr[indices[k] + 1] - p_ptr[indices[k]]
        most = max(most, count)
    row = np.empty((most, 3, width))
    found = np.empty(most, np.int64)
    for i in range(len(nodes)):
        used = 0
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for t in range(p_ptr[j], p_ptr[j + 1]):
                u = column[t]
                s = slot[u]
                if s < 0:
                    s = used
                    slot[u] = s
                    found[s] = u
                    used += 1
                    row[s] = 0.0
                for a in range(3):
                    x, y, z = data[k, a, 0], data[k, a, 1], data[k, a, 2]
                    for b in range(width):
                        row[s, a, b] += x * P[t, 0, b] + y * P[t, 1, b] + z * P[t, 2, b]
        for t in range(p_ptr[nodes[i]], p_ptr[nodes[i] + 1]):
            first, last = c_ptr[p_units[t]], c_ptr[p_units[t] + 1]
            for s in range(used):
                at = _place(c_idx, first, last, found[s])
                for a in range(width):
                    x, y, z = P[t, 0, a], P[t, 1, a], P[t, 2, a]
                    for b in range(width):
                        out[at, a, b] += x * row[s, 0, b] + y * row[s, 1, b] + z * row[s, 2, b]
        for s in range(used):
            slot[found[s]] = -1


@njit(cache=True, error_model="numpy", inline="always")
def _place(ascending, first, last, wanted):
    """Where `wanted` stands in ascending[first:last]."""
    while last - first > 1:
        middle = (first + last) // 2
        if ascending[middle] <= wanted:
            first = middle
        else:
            last = middle
    return first


@njit(cache=True, error_model="numpy")
def add_blocks(row, column, blocks, c_ptr, c_idx, out):  # noqa: PLR0913
    """Add blocks (k, w, w) at rows and columns (k,)."""
    for k in range(len(row)):
        out[_place(c_idx, c_ptr[row[k]], c_ptr[row[k] + 1], column[k])] += blocks[k]


@njit(cache=True, error_model="numpy", nogil=True)
def restrict(own, pointers, units, blocks, fine, out):  # noqa: PLR0913
    """out += P' fine."""
    width = blocks.shape[2]
    for i in range(own):
        x, y, z = fine[i, 0], fine[i, 1], fine[i, 2]
        for t in range(pointers[i], pointers[i + 1]):
            u = units[t]
            for b in range(width):
                out[u, b] += blocks[t, 0, b] * x + blocks[t, 1, b] * y + blocks[t, 2, b] * z


@njit(cache=True, error_model="numpy", nogil=True)
def add(own, pointers, units, blocks, coarse, fine):  # noqa: PLR0913
    """fine += P coarse."""
    width = blocks.shape[2]
    for i in range(own):
        for t in range(pointers[i], pointers[i + 1]):
            u = units[t]
            for b in range(width):
                x = coarse[u, b]
                fine[i, 0] += blocks[t, 0, b] * x
                fine[i, 1] += blocks[t, 1, b] * x
                fine[i, 2] += blocks[t, 2, b] * x
