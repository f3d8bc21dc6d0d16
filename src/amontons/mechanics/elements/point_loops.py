"""Element loops for laws that are given point by point, compiled; arguments as in `cell_loops`.

With S = 2 dW/dC and D = 2 dS/dC at a point, f_a = F G_a and v its volume, the forces are
v F S G_a and each pair of nodes gets

    K_ab = v { (G_a . S G_b) I + F (G_a . D . G_b) F^T },  (G . D . H)_mn = G_k D_mknl H_l.  (1)
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from .cell_loops import _deformation, _gradients, _inverse_transposed, _matrices, _scatter


@njit(cache=True, error_model="numpy")
def deformations_inplace(u, points, nodes, slopes, weights, F, unit):
    """F into F (k, q, 3, 3), whose part across the plane is kept; returns the least det F."""
    dim = len(unit)
    H, jac, at, _, _ = _matrices()
    G = np.zeros((dim, nodes.shape[1]))
    least = np.inf
    for k in range(len(nodes)):
        for q in range(len(weights)):
            _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            _deformation(u, nodes[k], G, at, unit)
            for i in range(dim):
                for j in range(dim):
                    F[k, q, i, j] = at[i, j]
            J = _inverse_transposed(at, H, unit)
            if not J > 0.0:
                return J
            least = min(least, J)
    return least


@njit(cache=True, error_model="numpy")
def forces_of_inplace(points, nodes, slopes, weights, F, S, out, unit):
    """Add nodal forces of stresses S (k, q, 3, 3) at deformations F (k, q, 3, 3) to out."""
    dim, count = len(unit), nodes.shape[1]
    H, jac, _, _, _ = _matrices()
    G = np.zeros((dim, count))
    for k in range(len(nodes)):
        for q in range(len(weights)):
            volume = weights[q] * _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            for i in range(dim):
                for m in range(dim):
                    stress = 0.0
                    for j in range(dim):
                        stress += F[k, q, i, j] * S[k, q, j, m]
                    for a in range(count):
                        out[nodes[k, a], i] += volume * stress * G[m, a]


@njit(cache=True, error_model="numpy")
def tangent_of_inplace(
    points, nodes, slopes, weights, F, S, D, pointers, columns, blocks, unit
):
    """Add (1) to blocks (m, dim, dim); D (k, q, 3, 3, 3, 3), F and S (k, q, 3, 3)."""
    dim, count = len(unit), nodes.shape[1]
    H, jac, _, _, _ = _matrices()
    G, local = np.zeros((dim, count)), np.zeros((dim, dim, count, count))
    pushed, along = np.zeros((dim, dim, dim)), np.zeros(dim)
    for k in range(len(nodes)):
        local[:] = 0.0
        for q in range(len(weights)):
            volume = weights[q] * _gradients(points, nodes[k], slopes[q], jac, H, G, unit)
            for a in range(count):
                _push(volume, G, a, F[k, q], S[k, q], D[k, q], pushed, along, unit)
                for b in range(a, count):
                    value = 0.0
                    for l in range(dim):
                        value += along[l] * G[l, b]
                    for i in range(dim):
                        local[i, i, a, b] += value
                for i in range(dim):
                    for j in range(dim):
                        for l in range(dim):
                            value = pushed[i, j, l]
                            for b in range(a, count):
                                local[i, j, a, b] += value * G[l, b]
        _scatter(local, nodes[k], pointers, columns, blocks, unit)


@njit(cache=True, error_model="numpy")
def _push(volume, G, a, F, S, D, pushed, along, unit):
    """What (1) has of the node a: pushed[i, j, l] and along[l], to be multiplied by G_b."""
    dim = len(unit)
    for l in range(dim):
        value = 0.0
        for m in range(dim):
            value += G[m, a] * S[m, l]
        along[l] = volume * value
    pushed[:] = 0.0
    for m in range(dim):
        for n in range(dim):
            for l in range(dim):
                value = 0.0
                for k in range(dim):
                    value += G[k, a] * D[m, k, n, l]
                value *= volume
                for i in range(dim):
                    for j in range(dim):
                        pushed[i, j, l] += F[i, m] * value * F[j, n]


@njit(cache=True, error_model="numpy")
def add_volume_inplace(inverse, J, slope, bend, S, D):
    """Add a volume term to S (n, 3, 3) and D (n, 3, 3, 3, 3).

    inverse (n, 3, 3): C^-1; J, slope, bend (n,): U' and U'', the latter 0 where it stays.
    """
    for p in range(len(J)):
        I, pressure = inverse[p], slope[p] * J[p]
        both = pressure + bend[p] * J[p] * J[p]
        for i in range(3):
            for j in range(3):
                S[p, i, j] += pressure * I[i, j]
                for k in range(3):
                    for l in range(3):
                        D[p, i, j, k, l] += both * I[i, j] * I[k, l] - pressure * (
                            I[i, k] * I[j, l] + I[i, l] * I[j, k]
                        )


@njit(cache=True, error_model="numpy")
def family_inplace(C, inverse, J, law, W, S, D):
    """W (n,), S and D of the family (2) of `cell_loops`, law (5,): a, b, c, d, e."""
    a, b, c, d, e = law
    for p in range(len(J)):
        A, I, log = C[p], inverse[p], np.log(J[p])
        one, square = A[0, 0] + A[1, 1] + A[2, 2], 0.0
        for i in range(3):
            for j in range(3):
                square += A[i, j] * A[i, j]
        W[p] = a * (one - 3.0) + b * (0.5 * (one * one - square) - 3.0)
        W[p] += c * (J[p] * J[p] - 1.0) - d * log + 0.5 * e * log * log
        pressure = 2.0 * c * J[p] * J[p] - d + e * log
        slope = 4.0 * c * J[p] * J[p] + e
        for i in range(3):
            for j in range(3):
                same = 1.0 if i == j else 0.0
                S[p, i, j] = 2.0 * a * same + 2.0 * b * (one * same - A[i, j])
                S[p, i, j] += pressure * I[i, j]
                for k in range(3):
                    for l in range(3):
                        both = same if k == l else 0.0
                        turned = 0.5 if i == k and j == l else 0.0
                        turned += 0.5 if i == l and j == k else 0.0
                        D[p, i, j, k, l] = 4.0 * b * (both - turned) + (
                            slope * I[i, j] * I[k, l]
                            - pressure * (I[i, k] * I[j, l] + I[i, l] * I[j, k])
                        )


@njit(cache=True, error_model="numpy")
def mooney_rivlin_inplace(C, inverse, J, c10, c01, W, S, D):
    """W (n,), S and D of c10 (J^-2/3 tr C - 3) + c01 (J^-4/3 tr cof C - 3)."""
    eye = np.eye(3)
    for p in range(len(J)):
        A, I = C[p], inverse[p]
        one = A[0, 0] + A[1, 1] + A[2, 2]
        square = 0.0
        for i in range(3):
            for j in range(3):
                square += A[i, j] * A[i, j]
        two = 0.5 * (one * one - square)
        a, b = c10 * J[p] ** (-2.0 / 3.0), c01 * J[p] ** (-4.0 / 3.0)
        W[p] = a * one - 3.0 * c10 + b * two - 3.0 * c01
        for i in range(3):
            for j in range(3):
                first, second = eye[i, j], one * eye[i, j] - A[i, j]
                S[p, i, j] = 2.0 * a * (first - one / 3.0 * I[i, j])
                S[p, i, j] += 2.0 * b * (second - 2.0 / 3.0 * two * I[i, j])
                for k in range(3):
                    for l in range(3):
                        both = 0.5 * (I[i, k] * I[j, l] + I[i, l] * I[j, k])
                        product = I[i, j] * I[k, l]
                        other = one * eye[k, l] - A[k, l]
                        same = 0.5 * (eye[i, k] * eye[j, l] + eye[i, l] * eye[j, k])
                        D[p, i, j, k, l] = 4.0 * a * (
                            one / 9.0 * product + one / 3.0 * both
                            - (first * I[k, l] + I[i, j] * eye[k, l]) / 3.0
                        ) + 4.0 * b * (
                            first * eye[k, l] - same + 2.0 / 3.0 * two * both
                            + 4.0 / 9.0 * two * product
                            - 2.0 / 3.0 * (second * I[k, l] + I[i, j] * other)
                        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _quotient(x, y, power):
    """(x^power - y^power) / (x - y), exact also where both are equal or nearly so."""
    t = np.log1p((x - y) / y)
    ratio = power if t == 0.0 else np.expm1(power * t) / np.expm1(t)
    return ratio * y ** (power - 1.0)


@njit(cache=True, error_model="numpy")
def ogden_inplace(x, axes, shear, powers, W, S, D):
    """W (n,), S and D of sum_p 2 shear_p / powers_p^2 (sum_i l_i^powers_p - 3).

    l_i: principal stretches without the change of volume; x (n, 3): their squares with it,
    eigenvalues of C; axes (n, 3, 3): the eigenvectors as columns.
    """
    stretch, tau, slope, value = np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    for p in range(len(x)):
        X, N = x[p], axes[p]
        J2 = X[0] * X[1] * X[2]
        tau[:], slope[:], W[p], mean_sum = 0.0, 0.0, 0.0, 0.0
        for q in range(len(shear)):
            mean = 0.0
            for i in range(3):
                stretch[i] = (X[i] / J2 ** (1.0 / 3.0)) ** (0.5 * powers[q])
                mean += stretch[i] / 3.0
            share = 2.0 * shear[q] / powers[q]
            W[p] += 3.0 * share / powers[q] * (mean - 1.0)
            mean_sum += share * mean
            for i in range(3):
                tau[i] += share * (stretch[i] - mean)
                slope[i, i] += 2.0 * shear[q] * stretch[i]
                for j in range(3):
                    slope[i, j] += 2.0 * shear[q] * (mean - stretch[i] - stretch[j]) / 3.0
        for i in range(3):
            value[i] = tau[i] / X[i]
            slope[i, i] -= 2.0 * tau[i]
        _from_axes(X, N, value, slope, S[p], D[p])
        for i in range(3):
            for j in range(i + 1, 3):
                change = mean_sum / (X[i] * X[j])
                for q in range(len(shear)):
                    share = 2.0 * shear[q] / powers[q] * J2 ** (-powers[q] / 6.0)
                    change += share * _quotient(X[i], X[j], 0.5 * powers[q] - 1.0)
                _add_shear(N, i, j, change, D[p])


@njit(cache=True, error_model="numpy")
def _from_axes(X, N, value, slope, S, D):
    """S of its principal values, D of slope[i, j] / (x_i x_j), the part without shear."""
    S[:], D[:] = 0.0, 0.0
    for i in range(3):
        for a in range(3):
            for b in range(3):
                S[a, b] += value[i] * N[a, i] * N[b, i]
                for j in range(3):
                    part = slope[i, j] / (X[i] * X[j]) * N[a, i] * N[b, i]
                    for c in range(3):
                        for d in range(3):
                            D[a, b, c, d] += part * N[c, j] * N[d, j]


@njit(cache=True, error_model="numpy")
def _add_shear(N, i, j, change, D):
    """Add change to the modulus of the shear between the axes i and j."""
    for a in range(3):
        for b in range(3):
            first = N[a, i] * N[b, j] + N[a, j] * N[b, i]
            for c in range(3):
                for d in range(3):
                    second = N[c, i] * N[d, j] + N[c, j] * N[d, i]
                    D[a, b, c, d] += change * first * second
