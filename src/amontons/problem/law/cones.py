"""Projections onto the sets of friction laws, their Jacobians, and De Saxcé's natural map.

Contact vectors are rows [x_N, x_T] in the local frame, shape (nc, d) with d = 2 or 3; u_N >= 0
is open, r_N >= 0 is compression.  K = { r : |r_T| <= mu r_N } is Coulomb's cone, K* contains
u_hat = u + mu |u_T| n, orthogonal to r.

[ABH] V. Acary, M. Brémond, O. Huber, "On solving contact problems with Coulomb friction:
formulations and numerical comparisons", Inria RR-9118 (2018).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def cone_regions(x: Array, mu: Array) -> tuple[Mask, Mask, Array, Array, Array]:
    """Masks (in K, in -K*); elsewhere a = P_N, shrink = |P_T|/|x_T|, s = x_T/|x_T|."""
    t = np.linalg.norm(x[:, 1:], axis=1)
    polar = mu * t <= -x[:, 0]
    inside = (t <= mu * x[:, 0]) & (mu > 0) & ~polar  # mu = 0: K is a ray, no interior
    t_safe = np.where(t > 0, t, 1)
    a = (x[:, 0] + mu * t) / (1 + mu**2)
    return inside, polar, a, np.clip(mu * a, 0, t) / t_safe, x[:, 1:] / t_safe[:, None]


def project_cone(x: Array, mu: Array) -> Array:
    """Euclidean projection P of each row of x onto K; shape (nc, d), unit of x."""
    inside, polar, a, shrink, _ = cone_regions(x, mu)
    p = np.column_stack([a, shrink[:, None] * x[:, 1:]])
    p[inside], p[polar] = x[inside], 0
    return p


def project_cone_jacobian(x: Array, mu: Array) -> Array:
    """One element of the Clarke Jacobian of `project_cone` at x; shape (nc, d, d).

    Symmetric, eigenvalues in [0, 1].  On a kink: zero on -K*, else identity on K.
    """
    inside, polar, _, shrink, s = cone_regions(x, mu)
    d = x.shape[1]
    ss = s[:, :, None] * s[:, None, :]
    c = 1 / (1 + mu**2)
    jac = np.empty((len(x), d, d))
    jac[:, 0, 0] = c
    jac[:, 0, 1:] = jac[:, 1:, 0] = (c * mu)[:, None] * s
    jac[:, 1:, 1:] = (c * mu**2 - shrink)[:, None, None] * ss
    jac[:, 1:, 1:] += shrink[:, None, None] * np.eye(d - 1)
    jac[inside], jac[polar] = np.eye(d), 0
    return jac


def project_disk(t: Array, radius: Array) -> Array:
    """Projection of each tangential row t, shape (nc, d-1), onto the disk |t| <= radius."""
    length = np.linalg.norm(t, axis=1)
    outside = length > radius
    scale = np.where(outside, radius / np.where(length > 0, length, 1), 1.0)
    return t * scale[:, None]


def project_disk_jacobian(t: Array, radius: Array) -> tuple[Array, Array]:
    """Derivatives of `project_disk` in t, (nc, d-1, d-1), and in the radius, (nc, d-1).

    On the circle itself the inner element is taken: identity in t, zero in the radius.
    """
    length = np.linalg.norm(t, axis=1)
    outside = length > radius
    safe = np.where(length > 0, length, 1)
    s = t / safe[:, None]
    k = t.shape[1]
    ratio = np.where(outside, radius / safe, 1.0)
    in_t = ratio[:, None, None] * (
        np.eye(k) - np.where(outside, 1.0, 0.0)[:, None, None] * s[:, :, None] * s[:, None, :]
    )
    return in_t, np.where(outside[:, None], s, 0.0)


def with_de_saxce(u: Array, mu: Array) -> Array:
    """u_hat = u + mu |u_T| n, De Saxcé's change of variable; shape (nc, d), unit of u."""
    u_hat = u.copy()
    u_hat[:, 0] += mu * np.linalg.norm(u[:, 1:], axis=1)
    return u_hat


def natural_map(r: Array, u: Array, mu: Array, rho: Array) -> Array:
    """r - P_K(r - rho u_hat); (nc, d), unit of r.

    Zero exactly where K* ∋ u_hat ⟂ r ∈ K ([ABH] eq. `natural-II`).  rho, shape (nc,), has the
    unit of r / u: never mix units.
    """
    return r - project_cone(r - rho[:, None] * with_de_saxce(u, mu), mu)
