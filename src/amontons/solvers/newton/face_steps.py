"""A step of an interior point by the faces that contacts share: its factor and solutions.

(W + E) dr = f by X + K, with dr refined once; the equations are those of `faces`.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit
from .block_lu import found, solve_inplace
from .faces import SIX

REFINED = 2  # solutions with one factor


@njit(cache=True, error_model="numpy")
def _inverted(G, factor, K):
    """K = G^-1 of a positive definite G (6, 6); directions that rounding hides become stiff."""
    for i in range(SIX):
        for j in range(i + 1):
            t = G[i, j]
            for k in range(j):
                t -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = t / factor[j, j]
            else:
                factor[i, i] = math.sqrt(max(t, 1e-15 * G[i, i]))
    for column in range(SIX):
        for i in range(SIX):
            t = 1.0 if i == column else 0.0
            for k in range(i):
                t -= factor[i, k] * K[k, column]
            K[i, column] = t / factor[i, i]
        for i in range(SIX - 1, -1, -1):
            t = K[i, column]
            for k in range(i + 1, SIX):
                t -= factor[k, i] * K[k, column]
            K[i, column] = t / factor[i, i]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def face_matrix_inplace(faces, E, inverse, data, K):
    """X + K in blocks into data, and K (faces, 6, 6); inverse: E^-1 of contacts on faces."""
    data[:] = faces.data
    for i in range(len(faces.face)):
        if faces.face[i] < 0:
            p = faces.place[i]
            data[found(faces.indptr, faces.indices, p, p)] += E[i]
    G, T, factor = np.empty((SIX, SIX)), np.empty((3, SIX)), np.empty((SIX, SIX))
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
        for a in range(faces.rank[g], SIX):
            G[a, a] = 1.0
        _inverted(G, factor, K[g])
        p = faces.place[faces.contacts[faces.first[g]]]
        for a in range(2):
            for b in range(2):
                at = found(faces.indptr, faces.indices, p + a, p + b)
                data[at] += K[g, 3 * a : 3 * a + 3, 3 * b : 3 * b + 3]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def add_step_inplace(faces, inverse, K, factor, rest, h, p, dr):
    """dr (nc, 3) += the solution for rest (nc, 3); h, p (blocks, 3) are working memory."""
    nc = len(rest)
    h[:] = 0.0
    part, gathered, lifted = np.empty(3), np.empty(SIX), np.empty(SIX)
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
    sums = h.copy()
    for g in range(len(faces.first) - 1):
        at = faces.place[faces.contacts[faces.first[g]]]
        for a in range(SIX):
            gathered[a] = h[at + a // 3, a % 3]
        for a in range(SIX):
            t = 0.0
            for b in range(SIX):
                t += K[g, a, b] * gathered[b]
            h[at + a // 3, a % 3] = t
    order, upper_start, upper, lower_start, lower, U, L_, pivots = factor
    solve_inplace(order, upper_start, upper, lower_start, lower, U, L_, pivots, h, p)
    for i in range(nc):
        if faces.face[i] < 0:
            dr[i] += p[faces.place[i]]
    for g in range(len(faces.first) - 1):
        at = faces.place[faces.contacts[faces.first[g]]]
        for a in range(SIX):
            gathered[a] = sums[at + a // 3, a % 3] - p[at + a // 3, a % 3]
        for a in range(SIX):
            t = 0.0
            for b in range(SIX):
                t += K[g, a, b] * gathered[b]
            lifted[a] = t
        for k in range(faces.first[g], faces.first[g + 1]):
            i = faces.contacts[k]
            F, L = inverse[i], faces.levers[i]
            for a in range(3):
                t = rest[i, a]
                for b in range(SIX):
                    t -= L[a, b] * lifted[b]
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


__all__ = ["REFINED", "add_step_inplace", "face_matrix_inplace", "missed_inplace"]
