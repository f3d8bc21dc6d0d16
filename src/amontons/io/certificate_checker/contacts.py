"""Proofs by a few numbers of every contact, in 2D and 3D."""

from math import hypot

import numpy as np

from .numbers import U, bound, need, reference


def coupled(tau, sigma, right, below):
    """V (nc, 2 d, 2 d) with z V z = r E u, z = (r, u), E = [[tau, right], [below, sigma]]."""
    nc, d = len(tau), right.shape[1] + 1
    E = np.zeros((nc, d, d))
    E[:, 0, 0], E[:, 0, 1:], E[:, 1:, 0] = tau, right, below
    E[:, range(1, d), range(1, d)] = sigma[:, None]
    V = np.zeros((nc, 2 * d, 2 * d))
    V[:, :d, d:], V[:, d:, :d] = E / 2, E.transpose(0, 2, 1) / 2
    return V


def every_load(W, q, mu, tau, sigma, alpha, f):
    """Refuse unless these multipliers prove one solution for every load."""
    need(min(tau.min(), sigma.min(), alpha.min()) > 0, "a multiplier is not positive")
    V, d = coupled(tau, sigma, 0 * f, f), q.shape[1]
    V[:, 0, 0] = -mu * sigma * alpha / 2
    V[:, range(d + 1, 2 * d), range(d + 1, 2 * d)] = -(mu * sigma / alpha / 2)[:, None]
    bound(W, V, abs(V), np.eye(len(W)))


def about(W, q, mu, r0, statuses, tau, sigma, eta, pinned, **_):
    """Bound of |r - r0| for all solutions, by one tau, sigma and eta of every contact."""
    letters, limit = [bytes(x).decode() for x in statuses], sigma * mu
    need(min(tau.min(), sigma.min()) > 0, "a multiplier is not positive")
    u, t, moved, off = reference(W, q, mu, r0, letters)
    for i in np.flatnonzero(pinned == 0):
        size, speed = hypot(*eta[i]), hypot(*u[i, 1:])
        need(letters[i] == "f" and size <= limit[i] * (1 - 8 * U), f"eta of contact {i}")
        room = limit[i] * speed - eta[i].dot(u[i, 1:]) + 32 * U * (limit[i] + size) * speed
        need(room <= tau[i] * u[i, 0] * (1 - 8 * U), f"contact {i} can gain")
    pinned, most = (pinned != 0)[:, None], limit[:, None] + 0 * eta
    V = coupled(tau, sigma, np.where(pinned, limit[:, None] * t, eta), 0 * eta)
    size = coupled(tau, sigma, np.where(pinned, most, abs(eta)), 0 * eta)
    left = np.column_stack([mu >= 0, *[mu > 0] * (q.shape[1] - 1)]).ravel()
    return bound(W, V, size, np.eye(len(W))[:, left], off) + float(moved.max(initial=0.0))
