"""Element loops of hyperelasticity, compiled: nodal forces, tangent and energy of a law.

All laws are members of one family, per volume of the reference configuration, with C = F^T F:

    W = a (tr C - 3) + b (tr cof C - 3) + c (J^2 - 1) - d ln J + e/2 (ln J)^2              (1)
    P = dW/dF = 2 a F + 2 b (tr(C) F - F C) + g(J) F^-T,   g = 2 c J^2 - d + e ln J        (2)
    dP = 2 a dF + 2 b (2 (F:dF) F + tr(C) dF - dF C - F (dF^T F + F^T dF))
         + J g' (F^-T : dF) F^-T - g F^-T dF^T F^-T                                       (3)

2D is plane strain: F_33 = 1 adds 1 to tr C and leaves the rest of (2) and (3) as it is.
Nothing is added where J <= 0 at some point of integration: the caller gets the least J.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit


@njit(cache=True, error_model="numpy")
def _inverse_transposed(F, H, dim):
    """F^-T into H (both 3x3, the leading dim x dim part) and det F."""
    if dim == 2:
        J = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
        H[0, 0], H[0, 1] = F[1, 1] / J, -F[1, 0] / J
        H[1, 0], H[1, 1] = -F[0, 1] / J, F[0, 0] / J
        return J
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            p, q = (m + 1) % 3, (m + 2) % 3
            H[i, m] = F[j, p] * F[k, q] - F[j, q] * F[k, p]
    J = F[0, 0] * H[0, 0] + F[0, 1] * H[0, 1] + F[0, 2] * H[0, 2]
    for i in range(3):
        for m in range(3):
            H[i, m] /= J
    return J


@njit(cache=True, error_model="numpy")
def _deformation(u, nodes, G, F, dim):
    """F = I + sum_a u_a G_a^T at one point of integration: u has more digits than X + u."""
    for i in range(dim):
        for k in range(dim):
            F[i, k] = 1.0 if i == k else 0.0
    for a in range(len(nodes)):
        for i in range(dim):
            value = u[nodes[a], i]
            for k in range(dim):
                F[i, k] += value * G[a, k]


@njit(cache=True, error_model="numpy")
def _products(F, C, B, dim):
    """C = F^T F and B = F F^T; returns tr C, with F_33 = 1 in 2D."""
    trace = 1.0 if dim == 2 else 0.0
    for i in range(dim):
        for k in range(dim):
            c = b = 0.0
            for m in range(dim):
                c += F[m, i] * F[m, k]
                b += F[i, m] * F[k, m]
            C[i, k], B[i, k] = c, b
        trace += C[i, i]
    return trace


@njit(cache=True, error_model="numpy")
def _stress(F, C, H, trace, J, law, P, dim):
    """(2) into P."""
    a, b = 2.0 * law[0], 2.0 * law[1]
    g = 2.0 * law[2] * J * J - law[3]
    if law[4] != 0.0:
        g += law[4] * math.log(J)
    for i in range(dim):
        for k in range(dim):
            p = (a + b * trace) * F[i, k] + g * H[i, k]
            for m in range(dim):
                p -= b * F[i, m] * C[m, k]
            P[i, k] = p
    return g


@njit(cache=True, error_model="numpy")
def forces_inplace(u, nodes, gradients, volumes, laws, out):
    """Add nodal forces (n, dim) of displacements u (n, dim) to out; returns the least J.

    nodes (k, a); gradients (k, q, a, dim) in the reference configuration; volumes (k, q);
    laws (k, 5): a, b, c, d, e of (1).
    """
    dim = u.shape[1]
    F, C, B, H, P = np.zeros((5, 3, 3))
    least = np.inf
    for k in range(len(nodes)):
        law = laws[k]
        for q in range(volumes.shape[1]):
            G = gradients[k, q]
            _deformation(u, nodes[k], G, F, dim)
            trace = _products(F, C, B, dim)
            J = _inverse_transposed(F, H, dim)
            least = min(least, J)
            if not J > 0.0:
                return J
            _stress(F, C, H, trace, J, law, P, dim)
            for a in range(nodes.shape[1]):
                for i in range(dim):
                    value = 0.0
                    for m in range(dim):
                        value += P[i, m] * G[a, m]
                    out[nodes[k, a], i] += volumes[k, q] * value
    return least


@njit(cache=True, error_model="numpy")
def energy_of(u, nodes, gradients, volumes, laws):
    """(energy, least J) of displacements u: the integral of (1)."""
    dim = u.shape[1]
    F, C, B, H = np.zeros((4, 3, 3))
    total, least = 0.0, np.inf
    for k in range(len(nodes)):
        law = laws[k]
        for q in range(volumes.shape[1]):
            _deformation(u, nodes[k], gradients[k, q], F, dim)
            trace = _products(F, C, B, dim)
            J = _inverse_transposed(F, H, dim)
            least = min(least, J)
            if not J > 0.0:
                return np.inf, J
            square = 1.0 if dim == 2 else 0.0
            for i in range(dim):
                for m in range(dim):
                    square += C[i, m] * C[i, m]
            log = math.log(J)
            w = law[0] * (trace - 3.0) + law[1] * (0.5 * (trace * trace - square) - 3.0)
            w += law[2] * (J * J - 1.0) - law[3] * log + 0.5 * law[4] * log * log
            total += volumes[k, q] * w
    return total, least


@njit(cache=True, error_model="numpy")
def tangent_inplace(u, nodes, gradients, volumes, laws, places, out, blocks):
    """Add forces to out (n, dim) and the tangent to blocks (m, dim, dim); returns the least J.

    places (k, a, a): the block of every pair of nodes of a cell.  (3) is symmetric: only pairs
    b >= a are summed up, in a local matrix, and mirrored.
    """
    dim, count = u.shape[1], nodes.shape[1]
    F, C, B, H, P = np.zeros((5, 3, 3))
    A = np.zeros((dim, dim, dim, dim))
    half = np.zeros((dim, dim, dim))
    local = np.zeros((count, count, dim, dim))
    least = np.inf
    for k in range(len(nodes)):
        law = laws[k]
        local[:] = 0.0
        for q in range(volumes.shape[1]):
            G, volume = gradients[k, q], volumes[k, q]
            _deformation(u, nodes[k], G, F, dim)
            trace = _products(F, C, B, dim)
            J = _inverse_transposed(F, H, dim)
            least = min(least, J)
            if not J > 0.0:
                return J
            g = _stress(F, C, H, trace, J, law, P, dim)
            _moduli(F, C, B, H, trace, g, J, law, volume, A, dim)
            for a in range(count):
                for i in range(dim):
                    value = 0.0
                    for m in range(dim):
                        value += P[i, m] * G[a, m]
                    out[nodes[k, a], i] += volume * value
                    for j in range(dim):
                        for m in range(dim):
                            s = 0.0
                            for n in range(dim):
                                s += A[i, n, j, m] * G[a, n]
                            half[i, j, m] = s
                for b in range(a, count):
                    for i in range(dim):
                        for j in range(dim):
                            s = 0.0
                            for m in range(dim):
                                s += half[i, j, m] * G[b, m]
                            local[a, b, i, j] += s
        for a in range(count):
            for b in range(a, count):
                to, back = places[k, a, b], places[k, b, a]
                for i in range(dim):
                    for j in range(dim):
                        blocks[to, i, j] += local[a, b, i, j]
                        if b > a:
                            blocks[back, j, i] += local[a, b, i, j]
    return least


@njit(cache=True, error_model="numpy")
def _moduli(F, C, B, H, trace, g, J, law, volume, A, dim):
    """A[i, I, k, K] = dP_iI / dF_kK of (3), times the volume."""
    a, b = 2.0 * law[0] * volume, 2.0 * law[1] * volume
    slope = (4.0 * law[2] * J * J + law[4]) * volume
    g = g * volume
    for i in range(dim):
        for n in range(dim):
            for j in range(dim):
                for m in range(dim):
                    s = 2.0 * F[j, m] * F[i, n] - F[i, m] * F[j, n]
                    if i == j:
                        s -= C[m, n]
                    if n == m:
                        s -= B[i, j]
                    value = b * s + slope * H[j, m] * H[i, n] - g * H[i, m] * H[j, n]
                    if i == j and n == m:
                        value += a + b * trace
                    A[i, n, j, m] = value
