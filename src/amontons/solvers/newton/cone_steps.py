"""What steps of interior points in the cones of friction share, whatever solves for dr.

Scalings F of a contact and their inverses, the right side of predictor and corrector, dx and dy
of dr and du, how far a step may go, and sigma for the corrector; see `interior_point`.
Where they begin and how much of the way to the boundary of the cones they leave.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import njit

# The start, on the axes of the cones: reactions in those that stop a mean approach at a contact
# alone (those under others carry more), velocities in mean approaches.
FIRST_REACTION, FIRST_VELOCITY = 10.0, 0.1
# Part of the way to the boundary that a step leaves: at most, and of what the predictor leaves
# of x . y, but not less than the last; near the end the convergence is superlinear by that.
LEFT, LEFT_OF_GAP, LEAST_LEFT = 1e-2, 0.1, 1e-4


@njit(cache=True, error_model="numpy")
def scale(b, w, v, out):
    """out = F v with F = b [[w_0, w'], [w, I + w w' / (1 + w_0)]]."""
    z = w[1] * v[1] + w[2] * v[2]
    k = v[0] + z / (1.0 + w[0])
    out[0], out[1], out[2] = b * (w[0] * v[0] + z), b * (v[1] + w[1] * k), b * (v[2] + w[2] * k)


@njit(cache=True, error_model="numpy")
def unscale(b, w, v, out):
    """out = F^-1 v."""
    z = w[1] * v[1] + w[2] * v[2]
    k = z / (1.0 + w[0]) - v[0]
    out[0], out[1], out[2] = (w[0] * v[0] - z) / b, (v[1] + w[1] * k) / b, (v[2] + w[2] * k) / b


@njit(cache=True, error_model="numpy")
def nesterov_todd_inplace(x, y, i, beta, w, lam):
    """Scaling (beta, w) of contact i and lambda = F x; returns beta^2."""
    tx, ty = math.sqrt(x[i, 1] ** 2 + x[i, 2] ** 2), math.sqrt(y[i, 1] ** 2 + y[i, 2] ** 2)
    sx = math.sqrt((x[i, 0] - tx) * (x[i, 0] + tx))
    sy = math.sqrt((y[i, 0] - ty) * (y[i, 0] + ty))
    inner = (x[i, 0] * y[i, 0] + x[i, 1] * y[i, 1] + x[i, 2] * y[i, 2]) / (sx * sy)
    g = 2.0 * math.sqrt(0.5 * (1.0 + inner))
    beta[i] = math.sqrt(sy / sx)
    w[i, 0] = (y[i, 0] / sy + x[i, 0] / sx) / g
    w[i, 1] = (y[i, 1] / sy - x[i, 1] / sx) / g
    w[i, 2] = (y[i, 2] / sy - x[i, 2] / sx) / g
    scale(beta[i], w[i], x[i], lam[i])
    return sy / sx


@njit(cache=True, error_model="numpy")
def scaled_blocks_inplace(x, y, mu, shift, i, beta, w, lam, E, inverse):
    """Scaling (beta, w) and lambda of contact i, and its blocks E = S^-1 (D + e 1) S^-1, E^-1.

    D = k (2 w w^T - J), J = diag(1, -1, -1), has the eigenvalues k g^2, k / g^2 and k, with
    g = w_0 + |w_T|, on (1, n), (1, -n) and across, n along w_T: nothing cancels, in the inverse
    neither.  S = diag(1 / mu, 1, 1); e: at least shift on each component of E.  Where mu = 0
    both blocks are zero on the tangents.
    """
    k = nesterov_todd_inplace(x, y, i, beta, w, lam)
    along = math.sqrt(w[i, 1] ** 2 + w[i, 2] ** 2)
    n, m = (w[i, 1] / along, w[i, 2] / along) if along > 0.0 else (1.0, 0.0)
    g = w[i, 0] + along
    e = shift / min(mu * mu, 1.0) if mu > 0.0 else shift
    most, least, across = k * g * g + e, k / (g * g) + e, k + e
    if mu == 0.0:
        E[i] = inverse[i] = 0.0
        E[i, 0, 0], inverse[i, 0, 0] = most, 1.0 / most
        return
    for block, p, r, c, unit in (
        (E[i], most, least, across, mu),
        (inverse[i], 1.0 / most, 1.0 / least, 1.0 / across, 1.0 / mu),
    ):
        mean, half = 0.5 * (p + r), 0.5 * (p - r)
        block[0, 0] = mean * unit * unit
        block[0, 1] = block[1, 0] = half * n * unit
        block[0, 2] = block[2, 0] = half * m * unit
        block[1, 1] = mean * n * n + c * m * m
        block[2, 2] = mean * m * m + c * n * n
        block[1, 2] = block[2, 1] = (mean - c) * n * m


@njit(cache=True, error_model="numpy")
def room(x, dx, rho):
    """Largest a with x + a dx in all cones, of the contacts that can react."""
    room = math.inf
    for i in range(len(x)):
        if rho[i] <= 0.0:
            continue
        d0, d1, d2 = dx[i, 0], dx[i, 1], dx[i, 2]
        t = math.sqrt(x[i, 1] ** 2 + x[i, 2] ** 2)
        a = d0 * d0 - d1 * d1 - d2 * d2
        b = x[i, 0] * d0 - x[i, 1] * d1 - x[i, 2] * d2
        c = (x[i, 0] - t) * (x[i, 0] + t)
        root = b * b - a * c
        if a < 0.0:
            root = math.sqrt(max(root, 0.0))
            room = min(room, c / (root - b) if b < 0.0 else (-b - root) / a)
        elif b < 0.0 and root >= 0.0:
            room = min(room, c / (math.sqrt(root) - b))
        if d0 < 0.0:
            room = min(room, -x[i, 0] / d0)
    return room


@njit(cache=True, error_model="numpy")
def residual_inplace(x, y, u, s, mu, able, rho, residual):  # noqa: PLR0913
    """residual = y - S u - s e_N, S = diag(1/mu, 1, 1), of the contacts with able above 0.

    Returns the sum of its squares and of what x . y leaves in the unit of u, x . y, and how
    many contacts these are.
    """
    left = total = 0.0
    count = 0
    for i in range(len(mu)):
        if able[i] <= 0.0:
            continue
        count += 1
        unit = 1.0 / mu[i] if mu[i] > 0.0 else 1.0
        residual[i, 0] = y[i, 0] - unit * u[i, 0] - s[i]
        for a in range(1, 3):
            residual[i, a] = y[i, a] - u[i, a] if mu[i] > 0.0 else 0.0
        for a in range(3):
            total += x[i, a] * y[i, a]
            left += max(x[i, a] * y[i, a], 0.0) / rho[i] + residual[i, a] ** 2
    return left, total, count


@njit(cache=True, error_model="numpy")
def right_side_inplace(phase, sigma, mean, mu, able, lam, beta, w, dx, dy, residual, f):  # noqa: PLR0913
    """f (n, 3) of the predictor (phase 0) or, with its dx and dy, of the corrector.

    able (n,): above 0 where a contact has a cone.
    """
    keep = 1.0 - sigma
    p, fa, fb = np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(f)):
        if able[i] <= 0.0:
            for a in range(3):
                f[i, a] = keep * residual[i, a]
            continue
        l0, l1, l2 = lam[i, 0], lam[i, 1], lam[i, 2]
        c0 = sigma * mean - (l0 * l0 + l1 * l1 + l2 * l2)
        c1, c2 = -2.0 * l0 * l1, -2.0 * l0 * l2
        if phase == 1:
            scale(beta[i], w[i], dx[i], fa)
            unscale(beta[i], w[i], dy[i], fb)
            c0 -= fa[0] * fb[0] + fa[1] * fb[1] + fa[2] * fb[2]
            c1 -= fa[0] * fb[1] + fb[0] * fa[1]
            c2 -= fa[0] * fb[2] + fb[0] * fa[2]
        t = math.sqrt(l1 * l1 + l2 * l2)
        p[0] = (l0 * c0 - l1 * c1 - l2 * c2) / ((l0 - t) * (l0 + t))
        p[1], p[2] = (c1 - l1 * p[0]) / l0, (c2 - l2 * p[0]) / l0
        scale(beta[i], w[i], p, fa)
        f[i, 0] = fa[0] + keep * residual[i, 0]
        if mu[i] > 0.0:
            f[i, 0] *= mu[i]
            f[i, 1] = fa[1] + keep * residual[i, 1]
            f[i, 2] = fa[2] + keep * residual[i, 2]


@njit(cache=True, error_model="numpy")
def changes_inplace(keep, mu, able, residual, dr, du, dx, dy):  # noqa: PLR0913
    """dx and dy, (n, 3), of changes of the reactions dr and of the velocities du."""
    for i in range(len(dr)):
        if able[i] <= 0.0:
            continue
        unit = mu[i] if mu[i] > 0.0 else 1.0
        dx[i, 0] = unit * dr[i, 0]
        dy[i, 0] = du[i, 0] / unit - keep * residual[i, 0]
        for a in range(1, 3):
            if mu[i] > 0.0:
                dx[i, a], dy[i, a] = dr[i, a], du[i, a] - keep * residual[i, a]


@njit(cache=True, error_model="numpy")
def gap_left(x, y, dx, dy, able, length, total):  # noqa: PLR0913
    """Part of x . y, `total`, that a step of a length leaves; its cube is Mehrotra's sigma."""
    if not total > 0.0:
        return 0.0
    left = 0.0
    for i in range(len(x)):
        if able[i] > 0.0:
            for a in range(3):
                end = x[i, a] + length * dx[i, a]
                left += end * (y[i, a] + length * dy[i, a])
    return min(max(left / total, 0.0), 1.0)


@njit(cache=True, error_model="numpy")
def part_of_way(gap):
    """Part of the way to the boundary that a corrector goes whose predictor leaves that gap."""
    return 1.0 - min(LEFT, max(LEFT_OF_GAP * gap, LEAST_LEFT))


@njit(cache=True, error_model="numpy")
def advance_inplace(x, y, r, dx, dy, mu, able, length):  # noqa: PLR0913
    """Go a step; r are the reactions of x."""
    for i in range(len(x)):
        if able[i] > 0.0:
            for a in range(3):
                x[i, a] += length * dx[i, a]
                y[i, a] += length * dy[i, a]
                r[i, a] = x[i, a]
            r[i, 0] /= mu[i] if mu[i] > 0.0 else 1.0
