"""One compiled pass from a matrix to rows of 3x3 blocks, and what sweeps need of W_ii."""

from __future__ import annotations

import math

import numpy as np

from ..core.compiled import njit

WELL_CONDITIONED = 1e-6  # |det A| / max|A|^3 from which A^-1 loses no digits that matter
TURNS = 12  # of Jacobi's method at most; three or four do
ALIKE = 1e-17  # entry beside the diagonal, relative to it, that is none


@njit(cache=True, error_model="numpy")
def _finished(start, column, data, d):
    """The tangent that a 2D contact lacks, and where each diagonal block is."""
    nc = len(start) - 1
    diagonal = np.empty(nc, np.int32)
    for i in range(nc):
        for k in range(start[i], start[i + 1]):
            if column[k] == i:
                diagonal[i] = k
                if d == 2:
                    own = data[k, 1, 1]
                    data[k, 2, 2] = own if own > 0.0 else data[k, 0, 0]
    return diagonal


@njit(cache=True, error_model="numpy")
def blocks_of_rows(indptr, indices, values, d):
    """Block rows of a matrix (nc d, nc d) in compressed rows, in any order, summed if double.

    Returns (indptr, indices, data, diagonal) of `BlockRows`.
    """
    nc = (len(indptr) - 1) // d
    mark = np.full(nc, -1, np.int32)
    start = np.zeros(nc + 1, np.int32)
    for i in range(nc):
        count = 1
        mark[i] = i
        for k in range(indptr[d * i], indptr[d * i + d]):
            j = indices[k] // d
            if mark[j] != i:
                mark[j] = i
                count += 1
        start[i + 1] = start[i] + count
    column = np.empty(start[nc], np.int32)
    data = np.zeros((start[nc], 3, 3))
    place = np.empty(nc, np.int32)
    mark[:] = -1
    for i in range(nc):
        first = start[i]
        count = 1
        mark[i] = i
        column[first] = i
        for k in range(indptr[d * i], indptr[d * i + d]):
            j = indices[k] // d
            if mark[j] != i:
                mark[j] = i
                at = first + count
                while at > first and column[at - 1] > j:  # nearly sorted already
                    column[at] = column[at - 1]
                    at -= 1
                column[at] = j
                count += 1
        for at in range(first, first + count):
            place[column[at]] = at
        for a in range(d):
            for k in range(indptr[d * i + a], indptr[d * i + a + 1]):
                j = indices[k] // d
                data[place[j], a, indices[k] - d * j] += values[k]
    return start, column, data, _finished(start, column, data, d)


@njit(cache=True, error_model="numpy")
def _is_there(W, i, j, d):
    """True for a diagonal block and for one that is not all zero."""
    if i == j:
        return True
    for a in range(d):
        for b in range(d):
            if W[d * i + a, d * j + b] != 0.0:
                return True
    return False


@njit(cache=True, error_model="numpy")
def blocks_of_dense(W, d):
    """Block rows of a full matrix, as `blocks_of_rows`; blocks of zeros are left out."""
    nc = len(W) // d
    start = np.zeros(nc + 1, np.int32)
    for i in range(nc):
        count = 0
        for j in range(nc):
            if _is_there(W, i, j, d):
                count += 1
        start[i + 1] = start[i] + count
    column = np.empty(start[nc], np.int32)
    data = np.zeros((start[nc], 3, 3))
    at = 0
    for i in range(nc):
        for j in range(nc):
            if _is_there(W, i, j, d):
                column[at] = j
                for a in range(d):
                    for b in range(d):
                        data[at, a, b] = W[d * i + a, d * j + b]
                at += 1
    return start, column, data, _finished(start, column, data, d)


@njit(cache=True, error_model="numpy")
def _largest_eigenvalue(B):
    """Of a symmetric (3, 3) matrix, by Jacobi's rotations; B is overwritten."""
    for _ in range(TURNS):
        rest = 0.0
        for p in range(2):
            for q in range(p + 1, 3):
                rest = max(rest, abs(B[p, q]))
                if abs(B[p, q]) <= ALIKE * max(B[p, p], B[q, q]):
                    continue
                theta = (B[q, q] - B[p, p]) / (2.0 * B[p, q])  # at most 1 / ALIKE
                t = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    x, y = B[p, k], B[q, k]
                    B[p, k], B[q, k] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = B[k, p], B[k, q]
                    B[k, p], B[k, q] = c * x - s * y, s * x + c * y
        if rest <= ALIKE * max(B[0, 0], B[1, 1], B[2, 2]):
            break
    return max(B[0, 0], B[1, 1], B[2, 2])


@njit(cache=True, error_model="numpy")
def contact_data(data, diagonal):
    """(eliminated (nc, 17), 1 / |W_ii|_2 (nc,)), see `BlockRows`; 0 where W_ii is 0."""
    nc = len(diagonal)
    out, rho = np.zeros((nc, 17)), np.zeros(nc)
    square = np.empty((3, 3))
    for i in range(nc):
        A = data[diagonal[i]]
        e = out[i]
        size = 0.0
        for a in range(3):
            for b in range(3):
                size = max(size, abs(A[a, b]))
        if size == 0.0:
            continue
        for a in range(3):
            for b in range(3):
                total = 0.0
                for k in range(3):
                    total += (A[k, a] / size) * (A[k, b] / size)
                square[a, b] = total
        rho[i] = 1.0 / (size * math.sqrt(_largest_eigenvalue(square)))
        # cofactors of A / size, so that no product leaves the range of floats
        c = square
        for a in range(3):
            for b in range(3):
                p, q, r, s = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
                c[a, b] = (A[p, r] / size) * (A[q, s] / size) - (A[p, s] / size) * (
                    A[q, r] / size
                )
        det = 0.0
        for b in range(3):
            det += A[0, b] / size * c[0, b]
        if abs(det) > WELL_CONDITIONED and A[0, 0] > 0.0:
            e[0] = 1.0
            for a in range(3):
                for b in range(3):
                    e[1 + 3 * a + b] = c[b, a] / det / size
        own = A[0, 0] if A[0, 0] > 0.0 else 1.0
        e[10], e[11] = A[1, 0] / own, A[2, 0] / own
        e[12], e[13] = A[1, 1] - e[10] * A[0, 1], A[1, 2] - e[10] * A[0, 2]
        e[14], e[15] = A[2, 1] - e[11] * A[0, 1], A[2, 2] - e[11] * A[0, 2]
        e[16] = (abs(A[0, 0]) + abs(A[1, 1]) + abs(A[2, 2])) ** 2
    return out, rho
