"""Sums of `couples` over pairs of facets, compiled.

Arguments of all loops, in the notation there: rows (k, a), p of every pair of facets and
corner of its slave, -1 for none; w (k, a, b), their parts of w_pq; axes R (r, d, d); arms
(k, a, b, d), d_pq.  Of every p there are m = d + r values: of x_p, then of omega_p.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit


@njit(cache=True)
def arms_inplace(x, nodes, rows, w, by_weight, axes, arms, inertia):  # noqa: PLR0913
    """Put d_pq into arms, and add J to inertia (nc, r, r).

    x (nodes, d); nodes (k, b): q; by_weight (nc,): 1 / sum_q w_pq.
    """
    (k, a, b), (r, d, _) = w.shape, axes.shape
    means = np.zeros((len(inertia), d))
    for q in range(k):
        for i in range(a):
            p = rows[q, i]
            for j in range(b):
                for c in range(d):
                    if p >= 0:
                        means[p, c] += w[q, i, j] * x[nodes[q, j], c]
    turned = np.empty((r, d))
    for q in range(k):
        for i in range(a):
            p = rows[q, i]
            for j in range(b):
                for c in range(d):
                    arms[q, i, j, c] = x[nodes[q, j], c]
                    if p >= 0:
                        arms[q, i, j, c] -= means[p, c] * by_weight[p]
                if p < 0:
                    continue
                _turn(axes, arms[q, i, j], turned)
                for s in range(r):
                    for t in range(r):
                        for c in range(d):
                            inertia[p, s, t] += w[q, i, j] * turned[s, c] * turned[t, c]


@njit(cache=True)
def _turn(axes, arm, out):
    """R_r arm into out (r, d)."""
    for s in range(len(axes)):
        for c in range(len(arm)):
            out[s, c] = 0.0
            for e in range(len(arm)):
                out[s, c] += axes[s, c, e] * arm[e]


@njit(cache=True)
def forces_inplace(w, rows, arms, levers, axes, out):  # noqa: PLR0913
    """Add forces w_pq omega_p x d_pq per lambda_p to out (k, b d, a d).

    levers (nc, r, d): -omega_p per force.
    """
    (k, a, b), (r, d, _) = w.shape, axes.shape
    turned = np.empty((r, d))
    for q in range(k):
        for i in range(a):
            p = rows[q, i]
            if p < 0:
                continue
            for j in range(b):
                _turn(axes, arms[q, i, j], turned)
                for c in range(d):
                    for e in range(d):
                        for s in range(r):
                            out[q, j * d + c, i * d + e] -= (
                                w[q, i, j] * turned[s, c] * levers[p, s, e]
                            )


@njit(cache=True)
def slopes_inplace(  # noqa: PLR0913
    w, by_w, rows, arms, axes, omega, by_weight, inverse, held, changes, onto
):
    """Add what derivatives of held forces are made of, all over the same dofs, W of them.

    by_w (k, a, b, W): derivatives of w, the last b d dofs being those of the nodes q; omega
    (nc, r); by_weight (nc,): 1 / sum_q w_pq; inverse (nc, r, r): J^-1.  held (k, b d, W): of
    forces at q with x_p and omega_p held; changes (k, a m, W): of these, without G; onto
    (k, b d, a m): of the forces by these.
    """
    (k, a, b), (r, d, _), ways = w.shape, axes.shape, by_w.shape[3]
    m, first = d + r, ways - b * d
    spin, turned, pushed = np.empty((d, d)), np.empty((r, d)), np.empty(d)
    along, change = np.empty((r, d)), np.empty((r, ways))
    for q in range(k):
        for i in range(a):
            p = rows[q, i]
            if p < 0:
                continue
            share = by_weight[p]
            spin[:] = 0.0
            for s in range(r):
                spin += omega[p, s] * axes[s]
            change[:] = 0.0
            for j in range(b):
                arm, weight, slope = arms[q, i, j], w[q, i, j], by_w[q, i, j]
                _turn(axes, arm, turned)
                for c in range(d):
                    pushed[c] = 0.0
                    for e in range(d):
                        pushed[c] += spin[c, e] * arm[e]
                here = first + j * d
                for c in range(d):
                    for v in range(ways):
                        held[q, j * d + c, v] += pushed[c] * slope[v]
                        changes[q, i * m + c, v] += share * arm[c] * slope[v]
                    changes[q, i * m + c, here + c] += share * weight
                    for e in range(d):
                        held[q, j * d + c, here + e] += weight * spin[c, e]
                        onto[q, j * d + c, i * m + e] = -weight * spin[c, e]
                    for s in range(r):
                        onto[q, j * d + c, i * m + d + s] = weight * turned[s, c]
                _directly(axes, spin, turned, pushed, along)
                for s in range(r):
                    grown = 0.0
                    for c in range(d):
                        grown += turned[s, c] * pushed[c]
                        change[s, here + c] += weight * along[s, c]
                    for v in range(ways):
                        change[s, v] += grown * slope[v]
            for s in range(r):
                for t in range(r):
                    for v in range(ways):
                        changes[q, i * m + d + s, v] -= inverse[p, s, t] * change[t, v]


@njit(cache=True)
def _directly(axes, spin, turned, pushed, out):
    """Derivatives (r, d) of (R_s d) . (spin d) by d."""
    for s in range(len(axes)):
        for c in range(len(pushed)):
            out[s, c] = 0.0
            for e in range(len(pushed)):
                out[s, c] += axes[s, e, c] * pushed[e] + turned[s, e] * spin[e, c]
