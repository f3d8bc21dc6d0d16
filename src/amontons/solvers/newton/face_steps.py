"""A step of an interior point by the faces that contacts share: its factor and solutions.

With G_g = sum_i L_i^T E_i^-1 L_i the equations of `faces` are X p = v, v = G^-1 (h - p).
Near the end E^-1 of a contact whose reaction is free exceeds that of one whose velocity is by
twenty powers of ten: G is singular in double precision, and in X + G^-1 the stiff directions
drown the others.  So each face has a basis of its own, from pivots,

    G = B D B^T,   p = B t,   h = B e,   (B^T X B + D^-1) t = D^-1 e,

where they stay on the diagonal; B is a triangle, rows in the order of pivots, with ones on its
diagonal and no larger entry.  D is 0 where rounding hides it: then t = e.  With s = B^T v
a direction has

    s = D^-1 (e - t) where D^-1 is below X, s = B^T X B t where e - t would cancel,

and dr_i = E_i^-1 (f_i - L_i v_g).  Correctors are refined once, predictors are not.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ...linear.block_kernels import velocity_of_rows_inplace
from .block_lu import factorise_inplace, found, solve_inplace
from .faces import SIX

HIDDEN = 1e-15  # of the diagonal of G, what rounding leaves of a direction that it lacks
STIFF = 1e13  # D^-1 at most, of the largest entry of X


@njit(cache=True, error_model="numpy")
def _triangle_inplace(G, rank, stiffest, B, order, stiffness):
    """B, the order of its rows and D^-1 of G (6, 6), which is overwritten."""
    for k in range(SIX):
        order[k] = k
    B[:] = 0.0
    stiffness[:] = stiffest
    whole = np.empty(SIX)
    for a in range(SIX):
        whole[a] = HIDDEN * G[a, a]
    for k in range(SIX):
        best = k
        for i in range(k + 1, rank):
            if G[order[i], order[i]] > G[order[best], order[best]]:
                best = i
        order[k], order[best] = order[best], order[k]
        row = order[k]
        B[row, k] = 1.0
        pivot = G[row, row]
        if k >= rank or not pivot > whole[row]:
            continue
        stiffness[k] = min(1.0 / pivot, stiffest)
        for i in range(k + 1, rank):
            B[order[i], k] = G[order[i], row] / pivot
        for i in range(k + 1, rank):
            for j in range(k + 1, rank):
                G[order[i], order[j]] -= B[order[i], k] * pivot * B[order[j], k]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _bases_inplace(faces, inverse, B, order, stiffness):
    """B, its order and D^-1 of every face; inverse: E^-1 of contacts on faces."""
    largest = 0.0
    for block in faces.data:
        largest = max(largest, block[0, 0], block[1, 1], block[2, 2])
    G, T = np.empty((SIX, SIX)), np.empty((3, SIX))
    for g in range(len(faces.first) - 1):
        G[:] = 0.0
        for k in range(faces.first[g], faces.first[g + 1]):
            i = faces.contacts[k]
            F, L = inverse[i], faces.levers[i]
            for a in range(3):
                for b in range(SIX):
                    T[a, b] = F[a, 0] * L[0, b] + F[a, 1] * L[1, b] + F[a, 2] * L[2, b]
            for a in range(SIX):
                for b in range(SIX):
                    G[a, b] += L[0, a] * T[0, b] + L[1, a] * T[1, b] + L[2, a] * T[2, b]
        _triangle_inplace(G, faces.rank[g], STIFF * largest, B[g], order[g], stiffness[g])


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _turned_inplace(indptr, indices, owner, X, B, data):
    """B^T X B into data, rows of a face two blocks high."""
    block, half = np.empty((SIX, SIX)), np.empty((SIX, SIX))
    for p in range(len(indptr) - 1):
        g = owner[p]
        if g < -1:
            continue
        start, high = indptr[p], 1 if g < 0 else 2
        length = indptr[p + 1] - start
        for k in range(start, start + length):
            h = owner[indices[k]]
            if h < -1:
                continue
            wide = 1 if h < 0 else 2
            if g < 0 and h < 0:
                data[k] = X[k]
                continue
            for a in range(3 * high):
                for b in range(3 * wide):
                    at = k + b // 3 + (length if a >= 3 else 0)
                    block[a, b] = X[at, a % 3, b % 3]
            if h >= 0:
                for a in range(3 * high):
                    for b in range(SIX):
                        t = 0.0
                        for m in range(SIX):
                            t += block[a, m] * B[h, m, b]
                        half[a, b] = t
            else:
                half[: 3 * high, :3] = block[: 3 * high, :3]
            for a in range(3 * high):
                for b in range(3 * wide):
                    t = 0.0
                    if g >= 0:
                        for m in range(SIX):
                            t += B[g, m, a] * half[m, b]
                    else:
                        t = half[a, b]
                    at = k + b // 3 + (length if a >= 3 else 0)
                    data[at, a % 3, b % 3] = t


@njit(cache=True, error_model="numpy")
def face_matrix_inplace(faces, E, inverse, data, extra, B, order, stiffness):  # noqa: PLR0913
    """B^T X B in blocks into data, D^-1 or E in extra (blocks, 3, 3), and the bases of faces.

    inverse: E^-1 of contacts on faces; B (faces, 6, 6), order and stiffness (faces, 6).
    """
    owner = np.full(len(faces.indptr) - 1, -1)
    extra[:] = 0.0
    for i in range(len(faces.face)):
        if faces.face[i] < 0:
            extra[faces.place[i]] = E[i]
    _bases_inplace(faces, inverse, B, order, stiffness)
    for g in range(len(faces.first) - 1):
        p = faces.place[faces.contacts[faces.first[g]]]
        owner[p], owner[p + 1] = g, -2
        for a in range(SIX):
            extra[p + a // 3, a % 3, a % 3] = stiffness[g, a]
    _turned_inplace(faces.indptr, faces.indices, owner, faces.data, B, data)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _velocity(faces, matrix, p, unit, a):
    """Row a of a block of B^T X B t."""
    t = 0.0
    for k in range(faces.indptr[unit], faces.indptr[unit + 1]):
        x, row = p[faces.indices[k]], matrix[k, a]
        t += row[0] * x[0] + row[1] * x[1] + row[2] * x[2]
    return t


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def add_step_inplace(faces, inverse, bases, matrix, factor, rest, h, p, dr):  # noqa: PLR0913
    """dr (nc, 3) += the solution for rest (nc, 3); h, p (blocks, 3) are memory, p ends as t.

    bases: B, its order and D^-1 of the faces; matrix: B^T X B.
    """
    nc, (B, rows, stiffness) = len(rest), bases
    h[:] = 0.0
    part, v = np.empty(3), np.empty(SIX)
    for i in range(nc):
        at = faces.place[i]
        if faces.face[i] < 0:
            h[at] = rest[i]
            continue
        F, L = inverse[i], faces.levers[i]
        for a in range(3):
            part[a] = F[a, 0] * rest[i, 0] + F[a, 1] * rest[i, 1] + F[a, 2] * rest[i, 2]
        for a in range(SIX):
            h[at + a // 3, a % 3] += L[0, a] * part[0] + L[1, a] * part[1] + L[2, a] * part[2]
    sums = np.empty((len(faces.rank), SIX))
    for g in range(len(sums)):
        at = faces.place[faces.contacts[faces.first[g]]]
        for k in range(SIX):
            row = rows[g, k]
            t = h[at + row // 3, row % 3]
            for m in range(k):
                t -= B[g, row, m] * sums[g, m]
            sums[g, k] = t
        for k in range(SIX):
            h[at + k // 3, k % 3] = stiffness[g, k] * sums[g, k]
    order, upper_start, upper, lower_start, lower, U, L_, pivots = factor
    solve_inplace(order, upper_start, upper, lower_start, lower, U, L_, pivots, h, p)
    for i in range(nc):
        if faces.face[i] < 0:
            dr[i] += p[faces.place[i]]
    for g in range(len(sums)):
        at = faces.place[faces.contacts[faces.first[g]]]
        diagonal = found(faces.indptr, faces.indices, at, at)
        below = found(faces.indptr, faces.indices, at + 1, at + 1)
        for k in range(SIX):
            size = matrix[diagonal if k < 3 else below, k % 3, k % 3]
            if stiffness[g, k] <= size:
                v[k] = stiffness[g, k] * (sums[g, k] - p[at + k // 3, k % 3])
            else:
                v[k] = _velocity(faces, matrix, p, at + k // 3, k % 3)
        for k in range(SIX - 1, -1, -1):
            for i in range(k + 1, SIX):
                v[k] -= B[g, rows[g, i], k] * v[i]
        for k in range(faces.first[g], faces.first[g + 1]):
            i = faces.contacts[k]
            F, L = inverse[i], faces.levers[i]
            for a in range(3):
                t = rest[i, a]
                for b in range(SIX):
                    t -= L[a, rows[g, b]] * v[b]
                part[a] = t
            for a in range(3):
                dr[i, a] += F[a, 0] * part[0] + F[a, 1] * part[1] + F[a, 2] * part[2]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def missed_inplace(E, f, dr, du, rest):
    """rest = f - du - E dr, all (nc, 3)."""
    for i in range(len(f)):
        for a in range(3):
            t = E[i, a, 0] * dr[i, 0] + E[i, a, 1] * dr[i, 1] + E[i, a, 2] * dr[i, 2]
            rest[i, a] = f[i, a] - du[i, a] - t


@njit(cache=True, error_model="numpy")
def face_memory(faces):
    """Arrays of a factor by faces: matrix, added, B, order of its rows, D^-1, pivots, work."""
    n, m, count = len(faces.indptr) - 1, len(faces.indices), len(faces.rank)
    return (
        np.empty((m, 3, 3)), np.empty((n, 3, 3)), np.empty((count, SIX, SIX)),
        np.empty((count, SIX), np.int64), np.empty((count, SIX)), np.empty((n, 3, 3)),
        np.zeros((n, 3, 3)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def factorise_faces_inplace(faces, E, inverse, symbolic, U, L, memory):  # noqa: PLR0913
    """False at a singular pivot; symbolic: of X; E and E^-1 (nc, 3, 3) of contacts."""
    matrix, added, B, rows, stiffness, pivots, work = memory
    face_matrix_inplace(faces, E, inverse, matrix, added, B, rows, stiffness)
    order, upper_start, upper, lower_start, lower = symbolic
    return factorise_inplace(
        faces.indptr, faces.indices, matrix, added, order, upper_start, upper, lower_start,
        lower, U, L, pivots, work,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def step_by_faces_inplace(W, faces, E, inverse, symbolic, U, L, memory, f, solutions, dr, du):  # noqa: PLR0913
    """dr = (W + E)^-1 f and du = W dr, (nc, 3), by that factor; W: indptr, indices, data.

    solutions: with the factor, each after the first of what the last one has missed.
    """
    matrix, _, B, rows, stiffness, pivots, _ = memory
    order, upper_start, upper, lower_start, lower = symbolic
    factor = order, upper_start, upper, lower_start, lower, U, L, pivots
    h, t = np.empty((len(pivots), 3)), np.empty((len(pivots), 3))
    zero, rest = np.zeros(f.shape), np.empty(f.shape)
    dr[:] = du[:] = 0.0
    for _ in range(solutions):
        missed_inplace(E, f, dr, du, rest)
        add_step_inplace(faces, inverse, (B, rows, stiffness), matrix, factor, rest, h, t, dr)
        velocity_of_rows_inplace(0, len(f), W[0], W[1], W[2], zero, dr, du)


__all__ = ["face_memory", "factorise_faces_inplace", "step_by_faces_inplace"]
