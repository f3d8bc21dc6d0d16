"""One compiled pass from a matrix to rows of 3x3 blocks, and what sweeps need of W_ii."""

from __future__ import annotations

import math

import numpy as np
from numba import uint64

from ..core.compiled import njit
from .block_products import product_of_blocks

WELL_CONDITIONED = 1e-6  # |det A| / max|A|^3 from which A^-1 loses no digits that matter
TURNS = 12  # of Jacobi's method at most; three or four do
TWICE = -0.99  # cosine of three times the angle, -1 where the two largest are one
ALIKE = 1e-17  # entry beside the diagonal, relative to it, that is none
WHOLE = 0  # rows of a contact that are whole blocks in ascending order
NEXT, AFTER = (1, 2, 0), (2, 0, 1)  # of the three axes
# Share of the blocks of W that are stored from which products take them by full rows, and how
# many contacts: fewer have nothing to gain, the rows of more leave the cache.
FULL, FEWEST, MOST = 0.6, 12, 1000


@njit(cache=True, error_model="numpy", nogil=True)
def is_full(blocks, contacts):
    """True where products with a W of so many stored blocks take it by full rows."""
    return FEWEST <= contacts <= MOST and blocks >= FULL * contacts * contacts


@njit(cache=True, error_model="numpy", nogil=True)
def full_rows(indptr, indices, data):
    """W by the rows of contacts, (nc, 3, 3 nc), with all its zeros."""
    nc = len(indptr) - 1
    rows = np.zeros((nc, 3, 3 * nc))
    for i in range(nc):
        for k in range(indptr[i], indptr[i + 1]):
            j = 3 * indices[k]
            for a in range(3):
                for b in range(3):
                    rows[i, a, j + b] = data[k, a, b]
    return rows


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def full_product(rows, i, r):
    """Row i of `full_rows` times r (3 nc,); summed in any order, so that it is vectorised."""
    u0 = u1 = u2 = 0.0
    for k in range(len(r)):
        u0 += rows[i, 0, k] * r[k]
        u1 += rows[i, 1, k] * r[k]
        u2 += rows[i, 2, k] * r[k]
    return u0, u1, u2


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def velocity_of_rows_inplace(begin, end, indptr, indices, rows, q, r, u):  # noqa: PLR0913
    """u = W r + q of contacts begin to end - 1; rows: `BlockRows.rows`, or its data."""
    if rows.shape[2] > 3:
        flat = r.reshape(r.size)
        for i in range(begin, end):
            u0, u1, u2 = full_product(rows, i, flat)
            u[i, 0], u[i, 1], u[i, 2] = q[i, 0] + u0, q[i, 1] + u1, q[i, 2] + u2
        return
    for i in range(begin, end):
        first, last = uint64(indptr[i]), uint64(indptr[i + 1])
        u0, u1, u2 = product_of_blocks(rows, indices, r, first, last, last)
        u[i, 0], u[i, 1], u[i, 2] = q[i, 0] + u0, q[i, 1] + u1, q[i, 2] + u2


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
def _contact_of(k, d):
    """k // d of an index k >= 0, d = 2 or 3: a division by a constant is no division."""
    return np.int64(uint64(k) // uint64(3)) if d == 3 else np.int64(uint64(k) >> uint64(1))


@njit(cache=True, error_model="numpy")
def _distinct_rows(indptr, indices, first, d):
    """How many of the d rows from `first` on have to be looked at for columns: 1 or d."""
    begin, size = indptr[first], indptr[first + 1] - indptr[first]
    for a in range(1, d):
        shift = indptr[first + a] - begin
        if indptr[first + a + 1] - indptr[first + a] != size:
            return d
        for k in range(begin, begin + size):
            if indices[k + shift] != indices[k]:
                return d
    return 1


@njit(cache=True, error_model="numpy")
def _has_whole_blocks(indptr, indices, i):
    """True where the three alike rows of contact i are whole blocks in ascending order."""
    begin, end, last, own = indptr[3 * i], indptr[3 * i + 1], -1, False
    if uint64(end - begin) % uint64(3):
        return False
    for k in range(begin, end, 3):
        first = indices[k]
        if first <= last or first != 3 * _contact_of(first, 3):
            return False
        if indices[k + 1] != first + 1 or indices[k + 2] != first + 2:
            return False
        own |= first == 3 * i
        last = first + 2
    return own


@njit(cache=True, error_model="numpy")
def _whole_blocks_inplace(indptr, indices, values, i, first, column, data):
    """Columns and blocks of the rows of such a contact, from place `first` on."""
    for b in range((indptr[3 * i + 1] - indptr[3 * i]) // 3):
        column[first + b] = _contact_of(indices[indptr[3 * i] + 3 * b], 3)
        for a in range(3):
            k = indptr[3 * i + a] + 3 * b
            for c in range(3):
                data[first + b, a, c] = values[k + c]


@njit(cache=True, error_model="numpy")
def blocks_of_rows(indptr, indices, values, d):
    """Block rows of a matrix (nc d, nc d) in compressed rows, in any order, summed if double.

    Returns (indptr, indices, data, diagonal) of `BlockRows`.
    """
    nc = (len(indptr) - 1) // d
    mark = np.full(nc, -1, np.int32)
    start = np.zeros(nc + 1, np.int32)
    rows = np.empty(nc, np.int8)
    for i in range(nc):
        count, end = 1, 0
        mark[i] = i
        rows[i] = _distinct_rows(indptr, indices, d * i, d)
        if d == 3 and rows[i] == 1 and _has_whole_blocks(indptr, indices, i):
            rows[i] = WHOLE
            start[i + 1] = start[i] + (indptr[3 * i + 1] - indptr[3 * i]) // 3
            continue
        for k in range(indptr[d * i], indptr[d * i + rows[i]]):
            if end - d <= indices[k] < end:  # the block of the entry before
                continue
            j = _contact_of(indices[k], d)
            end = d * j + d
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
        if rows[i] == WHOLE:
            _whole_blocks_inplace(indptr, indices, values, i, first, column, data)
            continue
        count, end = 1, 0
        mark[i] = i
        column[first] = i
        for k in range(indptr[d * i], indptr[d * i + rows[i]]):
            if end - d <= indices[k] < end:
                continue
            j = _contact_of(indices[k], d)
            end = d * j + d
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
                j = _contact_of(indices[k], d)
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
def _turn(x, y, z):
    """(c, s, t) of the rotation that makes z, between the diagonal entries x and y, vanish."""
    theta = (y - x) / (2.0 * z)  # at most 1 / ALIKE
    t = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    c = 1.0 / math.sqrt(t * t + 1.0)
    return c, t * c, t


@njit(cache=True, error_model="numpy")
def _largest_eigenvalue(x, y, z, xy, xz, yz):
    """Of the symmetric [[x, xy, xz], [xy, y, yz], [xz, yz, z]], all its digits.

    In closed form [Smith, Comm. ACM 4 (1961) 168], in a fifth of the time of rotations; these
    where the two largest are so near one another that the angle loses digits.
    """
    beside = xy * xy + xz * xz + yz * yz
    if beside <= (ALIKE * max(x, y, z)) ** 2:
        return max(x, y, z)
    mean = (x + y + z) / 3.0
    a, b, c = x - mean, y - mean, z - mean
    square = (a * a + b * b + c * c + 2.0 * beside) / 6.0
    size = math.sqrt(square)
    det = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    cosine = det / (2.0 * square * size)
    if not cosine > TWICE:
        return _by_rotations(x, y, z, xy, xz, yz)
    return mean + 2.0 * size * math.cos(math.acos(min(cosine, 1.0)) / 3.0)


@njit(cache=True, error_model="numpy")
def _by_rotations(x, y, z, xy, xz, yz):
    """The same by Jacobi's method."""
    for _ in range(TURNS):
        rest = max(abs(xy), abs(xz), abs(yz))
        if abs(xy) > ALIKE * max(x, y):
            c, s, t = _turn(x, y, xy)
            x, y, xy = x - t * xy, y + t * xy, 0.0
            xz, yz = c * xz - s * yz, s * xz + c * yz
        if abs(xz) > ALIKE * max(x, z):
            c, s, t = _turn(x, z, xz)
            x, z, xz = x - t * xz, z + t * xz, 0.0
            xy, yz = c * xy - s * yz, s * xy + c * yz
        if abs(yz) > ALIKE * max(y, z):
            c, s, t = _turn(y, z, yz)
            y, z, yz = y - t * yz, z + t * yz, 0.0
            xy, xz = c * xy - s * xz, s * xy + c * xz
        if rest <= ALIKE * max(x, y, z):
            break
    return max(x, y, z)


@njit(cache=True, error_model="numpy")
def contact_data(data, diagonal):
    """(eliminated (nc, 17), 1 / |W_ii|_2 (nc,)), see `BlockRows`; 0 where W_ii is 0."""
    nc = len(diagonal)
    out, rho = np.zeros((nc, 17)), np.zeros(nc)
    B, c = np.empty((3, 3)), np.empty((3, 3))
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
                B[a, b] = A[a, b] / size  # so that no product leaves the range of floats
        rho[i] = 1.0 / (size * math.sqrt(_largest_eigenvalue(
            B[0, 0] * B[0, 0] + B[1, 0] * B[1, 0] + B[2, 0] * B[2, 0],
            B[0, 1] * B[0, 1] + B[1, 1] * B[1, 1] + B[2, 1] * B[2, 1],
            B[0, 2] * B[0, 2] + B[1, 2] * B[1, 2] + B[2, 2] * B[2, 2],
            B[0, 0] * B[0, 1] + B[1, 0] * B[1, 1] + B[2, 0] * B[2, 1],
            B[0, 0] * B[0, 2] + B[1, 0] * B[1, 2] + B[2, 0] * B[2, 2],
            B[0, 1] * B[0, 2] + B[1, 1] * B[1, 2] + B[2, 1] * B[2, 2],
        )))  # fmt: skip
        for a in range(3):
            for b in range(3):
                p, q, r, s = NEXT[a], AFTER[a], NEXT[b], AFTER[b]
                c[a, b] = B[p, r] * B[q, s] - B[p, s] * B[q, r]  # cofactors
        det = 0.0
        for b in range(3):
            det += B[0, b] * c[0, b]
        if abs(det) > WELL_CONDITIONED and A[0, 0] > 0.0:
            e[0], share = 1.0, 1.0 / det / size
            for a in range(3):
                for b in range(3):
                    e[1 + 3 * a + b] = c[b, a] * share
        own = A[0, 0] if A[0, 0] > 0.0 else 1.0
        e[10], e[11] = A[1, 0] / own, A[2, 0] / own
        e[12], e[13] = A[1, 1] - e[10] * A[0, 1], A[1, 2] - e[10] * A[0, 2]
        e[14], e[15] = A[2, 1] - e[11] * A[0, 1], A[2, 2] - e[11] * A[0, 2]
        e[16] = (abs(A[0, 0]) + abs(A[1, 1]) + abs(A[2, 2])) ** 2
    return out, rho
