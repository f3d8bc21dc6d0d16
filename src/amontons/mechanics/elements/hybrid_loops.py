"""Element loops of hybrid cells, compiled; arguments as in `cell_loops`."""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from .cell_loops import _deformation, _gradients, _inverse_transposed, _matrices, _scatter


@njit(cache=True, error_model="numpy")
def volume_ratios_inplace(u, points, nodes, slopes, weights, out, unit):
    """J = det F at the points of integration into out (k, q), at displacements u (n, dim)."""
    F, H, jac, _, _ = _matrices()
    G = np.zeros((len(unit), nodes.shape[1]))
    for k in range(len(nodes)):
        for q in range(len(weights)):
            _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            _deformation(u, nodes[k], G, F, unit)
            out[k, q] = _inverse_transposed(F, H, unit)


@njit(cache=True, error_model="numpy")
def volume_slopes_inplace(u, du, points, nodes, slopes, weights, out, unit):
    """Derivative of J by displacements du (n, dim) into out (k, q), at displacements u."""
    dim = len(unit)
    F, H, jac, _, _ = _matrices()
    G = np.zeros((dim, nodes.shape[1]))
    for k in range(len(nodes)):
        for q in range(len(weights)):
            _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            _deformation(u, nodes[k], G, F, unit)
            J = _inverse_transposed(F, H, unit)
            value = 0.0
            for a in range(len(nodes[k])):
                for i in range(dim):
                    for m in range(dim):
                        value += H[i, m] * G[m, a] * du[nodes[k, a], i]
            out[k, q] = J * value


@njit(cache=True, error_model="numpy")
def volume_terms_inplace(
    u, points, nodes, slopes, weights, modes, curvature, pointers, columns, out, unit
):
    """Add sum_mn N_mn b_m b_n^T of (1) in `hybrid` to the blocks out (m, dim, dim).

    modes (k, M, q): phi; curvature (k, M, M): N; u (n, dim): displacements, 0 at small strains.
    """
    dim, count, most = len(unit), nodes.shape[1], modes.shape[1]
    F, H, jac, _, _ = _matrices()
    G = np.zeros((dim, count))
    b, Nb = np.zeros((most, dim, count)), np.zeros((most, dim, count))
    local = np.zeros((dim, dim, count, count))
    for k in range(len(nodes)):
        b[:], Nb[:], local[:] = 0.0, 0.0, 0.0
        for q in range(len(weights)):
            volume = weights[q] * _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            _deformation(u, nodes[k], G, F, unit)
            volume *= _inverse_transposed(F, H, unit)
            for i in range(dim):
                for a in range(count):
                    value = 0.0
                    for c in range(dim):
                        value += H[i, c] * G[c, a]
                    for m in range(most):
                        b[m, i, a] += volume * modes[k, m, q] * value
        for m in range(most):
            for n in range(most):
                value = curvature[k, m, n]
                for i in range(dim):
                    for a in range(count):
                        Nb[m, i, a] += value * b[n, i, a]
        for m in range(most):
            for i in range(dim):
                for j in range(dim):
                    for a in range(count):
                        value = b[m, i, a]
                        for c in range(a, count):
                            local[i, j, a, c] += value * Nb[m, j, c]
        _scatter(local, nodes[k], pointers, columns, out, unit)
