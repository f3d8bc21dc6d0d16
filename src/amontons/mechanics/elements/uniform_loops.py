"""Element loops of cells with one mean gradient, compiled; see `uniform`.

With g_a = F^-T G_a, c_ma = gamma_ma - G_a . y_m and w_m = F^-T sum_n K_mn y_n the modes give

    forces   f_a = sum_m c_ma w_m
    tangent  K_ab = sum_mn c_ma c_nb F^-T K_mn F^-1 - sum_m (c_mb w_m g_a^T + c_ma g_b w_m^T).

The rest is (1) of `point_loops` at one point.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from .cell_loops import _inverse_transposed, _matrices, _scatter
from .point_loops import _push


@njit(cache=True, error_model="numpy")
def gradients_of_inplace(u, nodes, mean, F, unit):
    """F = I + sum_a u_a G_a^T into F (k, 3, 3), whose part across the plane is kept.

    mean (k, a, dim): G.  Returns the least det F.
    """
    H, at, _, _, _ = _matrices()
    least = np.inf
    for k in range(len(nodes)):
        for i in range(len(unit)):
            for j in range(len(unit)):
                value = 1.0 if i == j else 0.0
                for a in range(nodes.shape[1]):
                    value += u[nodes[k, a], i] * mean[k, a, j]
                F[k, i, j], at[i, j] = value, value
        J = _inverse_transposed(at, H, unit)
        if not J > 0.0:
            return J
        least = min(least, J)
    return least


@njit(cache=True, error_model="numpy")
def _modes(u, cell, gamma, K, H, y, w, unit):
    """y_m and w_m (m, dim) of a cell; H = F^-T."""
    dim, count = len(unit), len(gamma)
    z = np.zeros((count, dim))
    y[:], w[:] = 0.0, 0.0
    for m in range(count):
        for a in range(len(cell)):
            for i in range(dim):
                for j in range(dim):
                    y[m, i] += H[j, i] * gamma[m, a] * u[cell[a], j]
    for m in range(count):
        for i in range(dim):
            for n in range(count):
                for j in range(dim):
                    z[m, i] += K[m, i, n, j] * y[n, j]
            for j in range(dim):
                w[m, j] += H[j, i] * z[m, i]


@njit(cache=True, error_model="numpy")
def modes_energy(u, nodes, gamma, K, F, unit):
    """Energy of the modes: sum 1/2 y_m . K_mn y_n."""
    dim, count = len(unit), gamma.shape[1]
    H, at, _, _, _ = _matrices()
    y, w = np.zeros((count, dim)), np.zeros((count, dim))
    total = 0.0
    for k in range(len(nodes)):
        copy_rows_inplace(F[k], at)
        _inverse_transposed(at, H, unit)
        _modes(u, nodes[k], gamma[k], K[k], H, y, w, unit)
        for m in range(count):
            for a in range(nodes.shape[1]):
                for i in range(dim):
                    total += 0.5 * w[m, i] * gamma[k, m, a] * u[nodes[k, a], i]
    return total


@njit(cache=True, error_model="numpy")
def least_ratio(u, nodes, gamma, slopes, F, unit):
    """The least det (I + sum_m y_m g_m^T), of F at the points to its mean.

    slopes (q, k, m, dim): gradients g of the modes at the points.
    """
    dim, count = len(unit), gamma.shape[1]
    H, at, local, _, _ = _matrices()
    y, w = np.zeros((count, dim)), np.zeros((count, dim))
    none = np.zeros((count, dim, count, dim))
    least = np.inf
    for k in range(len(nodes)):
        copy_rows_inplace(F[k], at)
        _inverse_transposed(at, H, unit)
        _modes(u, nodes[k], gamma[k], none, H, y, w, unit)
        for q in range(len(slopes)):
            for i in range(dim):
                for j in range(dim):
                    value = 1.0 if i == j else 0.0
                    for m in range(count):
                        value += y[m, i] * slopes[q, k, m, j]
                    local[i, j] = value
            ratio = _inverse_transposed(local, H, unit)
            if not ratio > 0.0:
                return ratio
            least = min(least, ratio)
    return least


@njit(cache=True, error_model="numpy")
def uniform_forces_inplace(u, nodes, mean, volumes, gamma, K, F, S, out, unit):
    """Add nodal forces of stresses S (k, 3, 3) and of the modes to out (n, dim)."""
    dim, count = len(unit), gamma.shape[1]
    H, at, P, _, _ = _matrices()
    y, w = np.zeros((count, dim)), np.zeros((count, dim))
    for k in range(len(nodes)):
        copy_rows_inplace(F[k], at)
        _inverse_transposed(at, H, unit)
        _modes(u, nodes[k], gamma[k], K[k], H, y, w, unit)
        for i in range(dim):
            for j in range(dim):
                P[i, j] = 0.0
                for m in range(dim):
                    P[i, j] += volumes[k] * at[i, m] * S[k, m, j]
        for a in range(nodes.shape[1]):
            for i in range(dim):
                value = 0.0
                for j in range(dim):
                    value += P[i, j] * mean[k, a, j]
                for m in range(count):
                    value += _share(gamma, mean, y, k, m, a, unit) * w[m, i]
                out[nodes[k, a], i] += value


@njit(cache=True, error_model="numpy")
def _share(gamma, mean, y, k, m, a, unit):
    """c_ma of a cell k."""
    value = gamma[k, m, a]
    for j in range(len(unit)):
        value -= mean[k, a, j] * y[m, j]
    return value


@njit(cache=True, error_model="numpy")
def uniform_tangent_inplace(
    u, nodes, mean, volumes, gamma, K, F, S, D, pointers, columns, blocks, unit
):
    """Add the tangent to blocks (m, dim, dim); D (k, 3, 3, 3, 3)."""
    dim, count, nodes_of = len(unit), gamma.shape[1], nodes.shape[1]
    H, at, _, _, _ = _matrices()
    y, w = np.zeros((count, dim)), np.zeros((count, dim))
    G, g = np.zeros((dim, nodes_of)), np.zeros((dim, nodes_of))
    c, moved = np.zeros((count, nodes_of)), np.zeros((count, dim, count, dim))
    local = np.zeros((dim, dim, nodes_of, nodes_of))
    pushed, along = np.zeros((dim, dim, dim)), np.zeros(dim)
    for k in range(len(nodes)):
        local[:] = 0.0
        copy_rows_inplace(F[k], at)
        _inverse_transposed(at, H, unit)
        _modes(u, nodes[k], gamma[k], K[k], H, y, w, unit)
        for a in range(nodes_of):
            for i in range(dim):
                G[i, a], g[i, a] = mean[k, a, i], 0.0
                for j in range(dim):
                    g[i, a] += H[i, j] * mean[k, a, j]
            for m in range(count):
                c[m, a] = _share(gamma, mean, y, k, m, a, unit)
        _push_modes(K[k], H, moved, unit)
        for a in range(nodes_of):
            _push(volumes[k], G, a, at, S[k], D[k], pushed, along, unit)
            for b in range(a, nodes_of):
                for l in range(dim):
                    for i in range(dim):
                        local[i, i, a, b] += along[l] * G[l, b]
                        for j in range(dim):
                            local[i, j, a, b] += pushed[i, j, l] * G[l, b]
            _add_modes(a, c, g, w, moved, local, unit)
        _scatter(local, nodes[k], pointers, columns, blocks, unit)


@njit(cache=True, error_model="numpy")
def _push_modes(K, H, moved, unit):
    """F^-T K_mn F^-1 into moved (m, dim, n, dim)."""
    dim, count = len(unit), len(K)
    for m in range(count):
        for n in range(count):
            for i in range(dim):
                for j in range(dim):
                    value = 0.0
                    for p in range(dim):
                        for q in range(dim):
                            value += H[i, p] * K[m, p, n, q] * H[j, q]
                    moved[m, i, n, j] = value


@njit(cache=True, error_model="numpy")
def _add_modes(a, c, g, w, moved, local, unit):
    """The tangent of the modes for the pairs (a, b >= a)."""
    dim, count = len(unit), len(c)
    for m in range(count):
        for i in range(dim):
            for j in range(dim):
                for n in range(count):
                    value = c[m, a] * moved[m, i, n, j]
                    for b in range(a, c.shape[1]):
                        local[i, j, a, b] += value * c[n, b]
                one, two = w[m, i] * g[j, a], c[m, a] * w[m, j]
                for b in range(a, c.shape[1]):
                    local[i, j, a, b] -= c[m, b] * one + two * g[i, b]
