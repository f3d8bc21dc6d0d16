"""Element loops, compiled: gradients of shape functions on the fly, one accumulation a pair.

With G_a the gradients of the shape functions in the reference configuration and v the volumes
of the points of integration, the stiffness of small strains is a fixed combination of

    D_ab = sum_q v G_a G_b^T,    K_ab,ij = sum_kl T_ij,kl D_ab,kl                           (1)

for each pair of nodes of a cell, T the moduli of the law.  Laws of finite strains are members
of one family, per volume of the reference configuration, with C = F^T F and J = det F:

    W = a (tr C - 3) + b (tr cof C - 3) + c (J^2 - 1) - d ln J + e/2 (ln J)^2              (2)
    P = dW/dF = 2 a F + 2 b (tr(C) F - F C) + p(J) F^-T,   p = 2 c J^2 - d + e ln J        (3)

With f_a = F G_a, g_a = F^-T G_a and B = F F^T the derivative of (3) gives each pair

    K_ab = sum_q v { [(2 a + 2 b tr C) G_a.G_b - 2 b f_a.f_b] I - 2 b (G_a.G_b) B
           + 2 b (2 f_a f_b^T - f_b f_a^T) + J p' g_a g_b^T - p g_b g_a^T }                (4)

2D is plane strain: F_33 = 1 adds 1 to tr C and leaves the rest of (3) and (4) as it is.  Only
pairs b >= a are summed up, with b the innermost index, and mirrored.  The first J <= 0 ends a
loop: the caller gets it and drops what was added.

Arguments of all loops: points (n, dim), nodes (k, a), slopes (q, a, dim) of the shape functions
on the reference cell and weights (q,); `unit` is a tuple of dim numbers, whose length the
compiler knows and unrolls.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit
from .pattern import place_of


@njit(cache=True, error_model="numpy")
def _inverse_transposed(F, H, unit):
    """F^-T into H (the leading dim x dim part) and det F."""
    if len(unit) == 2:
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
def _gradients(points, cell, slopes, jac, H, G, unit):
    """Gradients of the shape functions of a cell at one point into G (dim, a); det dx/dxi."""
    dim = len(unit)
    for i in range(dim):
        for m in range(dim):
            value = 0.0
            for a in range(len(cell)):
                value += points[cell[a], i] * slopes[a, m]
            jac[i, m] = value
    volume = _inverse_transposed(jac, H, unit)
    for i in range(dim):
        for a in range(len(cell)):
            value = 0.0
            for m in range(dim):
                value += H[i, m] * slopes[a, m]
            G[i, a] = value
    return volume


@njit(cache=True)
def _scatter(local, cell, pointers, columns, out, unit):
    """Add the blocks b >= a of local (dim, dim, a, b), and their mirror images, to a matrix."""
    dim = len(unit)
    for a in range(len(cell)):
        to = place_of(pointers, columns, cell[a], cell[a])
        for i in range(dim):
            for j in range(i, dim):
                out[to, i, j] += local[i, j, a, a]
                if j > i:
                    out[to, j, i] += local[i, j, a, a]
        for b in range(a + 1, len(cell)):
            to = place_of(pointers, columns, cell[a], cell[b])
            back = place_of(pointers, columns, cell[b], cell[a])
            for i in range(dim):
                for j in range(dim):
                    out[to, i, j] += local[i, j, a, b]
                    out[back, j, i] += local[i, j, a, b]


@njit(cache=True, error_model="numpy", nogil=True)
def stiffness_inplace(
    begin, end, points, nodes, slopes, weights, moduli, pointers, columns, out, unit
):
    """Add (1) of cells begin to end to the blocks out (m, dim, dim) of (pointers, columns).

    moduli (dim, dim, dim, dim): T[i, j, k, l] = d stress_ik / d gradient_jl.
    """
    dim, count = len(unit), nodes.shape[1]
    jac, H = np.zeros((3, 3)), np.zeros((3, 3))
    G, D = np.zeros((dim, count)), np.zeros((dim, dim, count, count))
    local = np.zeros(D.shape)
    pairs, sums = D.reshape(dim, dim, -1), local.reshape(dim, dim, -1)
    for c in range(begin, end):
        cell = nodes[c]
        D[:] = 0.0
        for q in range(len(weights)):
            volume = weights[q] * _gradients(points, cell, slopes[q], jac, H, G, unit)
            for i in range(dim):
                for a in range(count):
                    value = volume * G[i, a]
                    for j in range(dim):
                        for b in range(a, count):
                            D[i, j, a, b] += value * G[j, b]
        local[:] = 0.0
        for i in range(dim):
            for j in range(dim):
                for k in range(dim):
                    for l in range(dim):
                        value = moduli[i, j, k, l]
                        if value != 0.0:
                            for pair in range(count * count):
                                sums[i, j, pair] += value * pairs[k, l, pair]
        _scatter(local, cell, pointers, columns, out, unit)


@njit(cache=True, error_model="numpy")
def nodal_gradients_inplace(u, points, nodes, slopes, out, weights, unit):
    """Add displacement gradients of cells at their own nodes to out (n, dim, dim), by volume.

    u (n, dim); slopes (a, a, dim) at the nodes of the reference cell; weights (n,) gets the sum
    of the volumes.  Corners where a cell has no volume are left out.
    """
    dim, count = len(unit), nodes.shape[1]
    jac, H, G = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((dim, count))
    for cell in nodes:
        for q in range(count):
            volume = _gradients(points, cell, slopes[q], jac, H, G, unit)
            if not volume > 0.0:
                continue
            node = cell[q]
            weights[node] += volume
            for i in range(dim):
                for m in range(dim):
                    value = 0.0
                    for a in range(count):
                        value += u[cell[a], i] * G[m, a]
                    out[node, i, m] += volume * value


@njit(cache=True)
def _matrices():
    """Five 3x3 matrices, apart: the compiler knows the strides of each."""
    zero = np.zeros((3, 3))
    return zero, zero.copy(), zero.copy(), zero.copy(), zero.copy()


@njit(cache=True, error_model="numpy")
def _deformation(u, cell, G, F, unit):
    """F = I + sum_a u_a G_a^T at one point of integration: u has more digits than X + u."""
    dim = len(unit)
    for i in range(dim):
        for m in range(dim):
            value = 1.0 if i == m else 0.0
            for a in range(len(cell)):
                value += u[cell[a], i] * G[m, a]
            F[i, m] = value


@njit(cache=True, error_model="numpy")
def _products(F, C, B, unit):
    """C = F^T F and B = F F^T; returns tr C, with F_33 = 1 in 2D."""
    dim = len(unit)
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
def _deformed(u, points, cell, slopes, weight, jac, G, F, C, B, H, unit):
    """(volume, tr C, J) of a point of a cell; fills G, F, C = F^T F, B = F F^T, H = F^-T."""
    volume = weight * _gradients(points, cell, slopes, jac, H, G, unit)
    _deformation(u, cell, G, F, unit)
    trace = _products(F, C, B, unit)
    return volume, trace, _inverse_transposed(F, H, unit)


@njit(cache=True, error_model="numpy")
def _add_forces(cell, G, F, C, H, trace, J, law, held, volume, out, unit):
    """Add the nodal forces of (3) at one point to out (n, dim); returns p.

    held: a pressure dU/dJ that does not change at the point, unit of stress.
    """
    dim = len(unit)
    two_a, two_b = 2.0 * law[0], 2.0 * law[1]
    p = 2.0 * law[2] * J * J - law[3] + held * J
    if law[4] != 0.0:
        p += law[4] * math.log(J)
    for i in range(dim):
        for k in range(dim):
            stress = (two_a + two_b * trace) * F[i, k] + p * H[i, k]
            for m in range(dim):
                stress -= two_b * F[i, m] * C[m, k]
            for a in range(len(cell)):
                out[cell[a], i] += volume * stress * G[k, a]
    return p


@njit(cache=True, error_model="numpy")
def forces_inplace(u, points, nodes, slopes, weights, law, held, out, unit):
    """Add nodal forces (n, dim) of displacements u (n, dim) to out; returns the least J.

    law (5,): a, b, c, d, e of (2); held (k, q): pressures of hybrid cells, or none, (0, q).
    """
    F, C, B, H, jac = _matrices()
    G = np.zeros((len(unit), nodes.shape[1]))
    least = np.inf
    for k in range(len(nodes)):
        cell = nodes[k]
        for q in range(len(weights)):
            volume, trace, J = _deformed(
                u, points, cell, slopes[q], weights[q], jac, G, F, C, B, H, unit
            )
            least = min(least, J)
            if not J > 0.0:
                return J
            pressure = held[k, q] if len(held) else 0.0
            _add_forces(cell, G, F, C, H, trace, J, law, pressure, volume, out, unit)
    return least


@njit(cache=True, error_model="numpy")
def energy_of(u, points, nodes, slopes, weights, law, unit):
    """(energy, least J) of displacements u (n, dim): the integral of (2)."""
    dim = len(unit)
    F, C, B, H, jac = _matrices()
    G = np.zeros((dim, nodes.shape[1]))
    total, least = 0.0, np.inf
    for cell in nodes:
        for q in range(len(weights)):
            volume, trace, J = _deformed(
                u, points, cell, slopes[q], weights[q], jac, G, F, C, B, H, unit
            )
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
            total += volume * w
    return total, least


@njit(cache=True, error_model="numpy")
def tangent_inplace(
    u, points, nodes, slopes, weights, law, held, pointers, columns, out, blocks, unit
):
    """Add forces to out (n, dim) and (4) to blocks (m, dim, dim); returns the least J."""
    dim, count = len(unit), nodes.shape[1]
    F, C, B, H, jac = _matrices()
    G, f, g = np.zeros((dim, count)), np.zeros((dim, count)), np.zeros((dim, count))
    local, dots = np.zeros((dim, dim, count, count)), np.zeros(count)
    least = np.inf
    for k in range(len(nodes)):
        cell, local[:] = nodes[k], 0.0
        for q in range(len(weights)):
            volume, trace, J = _deformed(
                u, points, cell, slopes[q], weights[q], jac, G, F, C, B, H, unit
            )
            least = min(least, J)
            if not J > 0.0:
                return J
            pressure = held[k, q] if len(held) else 0.0
            p = volume * _add_forces(
                cell, G, F, C, H, trace, J, law, pressure, volume, out, unit
            )
            bulk = volume * (4.0 * law[2] * J * J + law[4] + pressure * J)  # J p'
            _pushed(F, G, f, unit)
            _pushed(H, G, g, unit)
            two_b = 2.0 * law[1] * volume
            whole = 2.0 * law[0] * volume + two_b * trace
            for a in range(count):
                _dots(G, a, dots, unit)
                for i in range(dim):
                    for b in range(a, count):
                        local[i, i, a, b] += whole * dots[b]
                    for j in range(dim):
                        ahead, across = bulk * g[i, a], p * g[j, a]
                        for b in range(a, count):
                            local[i, j, a, b] += ahead * g[j, b] - across * g[i, b]
                if two_b != 0.0:
                    _add_second(f, a, dots, B, two_b, local, unit)
        _scatter(local, cell, pointers, columns, blocks, unit)
    return least


@njit(cache=True, error_model="numpy")
def _pushed(A, G, out, unit):
    """A G_a of all nodes into out, both (dim, a)."""
    dim = len(unit)
    for i in range(dim):
        for a in range(G.shape[1]):
            value = 0.0
            for m in range(dim):
                value += A[i, m] * G[m, a]
            out[i, a] = value


@njit(cache=True, error_model="numpy")
def _dots(G, a, out, unit):
    """G_a . G_b of all b >= a into out."""
    for b in range(a, G.shape[1]):
        value = 0.0
        for i in range(len(unit)):
            value += G[i, a] * G[i, b]
        out[b] = value


@njit(cache=True, error_model="numpy")
def _add_second(f, a, dots, B, two_b, local, unit):
    """The terms of (4) that come from tr cof C, but for tr C, of the pairs (a, b >= a)."""
    dim, count = len(unit), f.shape[1]
    for i in range(dim):
        for m in range(dim):
            value = two_b * f[m, a]
            for b in range(a, count):
                local[i, i, a, b] -= value * f[m, b]
    for i in range(dim):
        for j in range(dim):
            value, ahead, across = two_b * B[i, j], 2.0 * two_b * f[i, a], two_b * f[j, a]
            for b in range(a, count):
                local[i, j, a, b] += ahead * f[j, b] - across * f[i, b] - value * dots[b]
