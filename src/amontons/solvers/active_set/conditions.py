"""What one step of an active set method asks of every contact: linear conditions on (r, u).

Every contact gets d rows

    G_r r + G_u u = b        (local frames [x_N, x_T1, x_T2])

which are Dirichlet conditions (G_r = 0), natural ones (G_u = 0) or of Robin type, after
[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
Their signs: lambda_n = r_N, u_n - d = -u_N, lambda_tau = -r_T, u_tau = u_T.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...problem.law import Law

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Modification(Enum):
    """How the Robin condition is kept regular away from the solution, [HSW] section 3.2."""

    FIRST = "first"  # (3.11): unsymmetric, positive eigenvalues
    SECOND = "second"  # (3.12): symmetric
    THIRD = "third"  # (3.13): symmetric, positive definite without a factor beta
    UNMODIFIED = "unmodified"  # (3.5b) as it stands, which may be singular: for comparison


class FrictionFunction(Enum):
    """The function that friction makes zero, with s = lambda + c u; [HSW] section 3."""

    PRODUCT = "product"  # (3.1): max(g, |s|) lambda - g s
    QUOTIENT = "quotient"  # (3.14): lambda - g s / max(g, |s|), less robust


@dataclass(frozen=True, eq=False)
class Conditions:
    """G_r, G_u (nc, d, d), b (nc, d); active sets of the normal and of the tangents, (nc,).

    alpha, beta (nc,): cosine between lambda and lambda + c u, and the factor of the
    modification; NaN where no Robin condition holds.
    """

    G_r: Array
    G_u: Array
    b: Array
    normal: Mask
    tangential: Mask
    alpha: Array
    beta: Array


@dataclass(frozen=True, eq=False)
class Robin:
    """-lambda + L u = rhs, (nc, t, t) and (nc, t); v of (7.3); alpha and beta (nc,)."""

    L: Array
    rhs: Array
    v: Array
    alpha: Array
    beta: Array


def robin_of_quotient(lam: Array, u: Array, g: Array, c: Array) -> Robin:
    """The Newton step on (3.14) of contacts with |s| > g > 0, arrays as in `robin`.

    With e = g / |s| and P = I - s s' / |s|^2 it reads (I - e P) lambda - c e P u = e s.
    """
    s = lam + c[:, None] * u
    size = np.linalg.norm(s, axis=1)
    ray, e = s / size[:, None], g / size
    identity = np.eye(lam.shape[1])
    P = identity - np.einsum("ki,kj->kij", ray, ray)
    W = np.linalg.inv(identity - e[:, None, None] * P)
    L = c[:, None, None] * (W - identity)
    return Robin(L, -g[:, None] * ray, ray, _cosine(lam, s), np.ones(len(g)))


def _cosine(lam: Array, s: Array) -> Array:
    """alpha, (nc,): the cosine between lambda and s, 0 where lambda is."""
    size = np.linalg.norm(lam, axis=1) * np.linalg.norm(s, axis=1)
    return (lam * s).sum(axis=1) / np.where(size > 0, size, 1.0)


def robin(lam: Array, u: Array, g: Array, c: Array, modification: Modification) -> Robin:
    """Robin conditions (3.10) of contacts with |lambda + c u| > g > 0.

    lam, u: (nc, t), in the paper's signs; g, c: (nc,).  UNMODIFIED: (3.8), which raises
    SingularOperator where Id - M of (3.5b) has no inverse.
    """
    s = lam + c[:, None] * u
    size, force = np.linalg.norm(s, axis=1), np.linalg.norm(lam, axis=1)
    e, largest = g / size, np.maximum(g, force)
    delta = np.minimum(force / g, 1.0)
    alpha = _cosine(lam, s)
    outer = np.einsum("ki,kj->kij", lam, s)
    beta = np.ones(len(g))
    if modification is Modification.FIRST:
        F = outer / (largest * size)[:, None, None]
        beta = 1 / (1 - np.minimum(alpha, 0) * delta)
    elif modification is Modification.SECOND:
        F = 0.5 * (outer + outer.transpose(0, 2, 1)) / (largest * size)[:, None, None]
        beta = 2 / (2 - (alpha - 1) * delta)
    elif modification is Modification.UNMODIFIED:
        F = outer / (g * size)[:, None, None]
    else:
        F = np.einsum("ki,kj->kij", lam, lam) / largest[:, None, None] ** 2
    identity = np.eye(lam.shape[1])
    try:
        W = np.linalg.inv(identity - (beta * e)[:, None, None] * (identity - F))
    except np.linalg.LinAlgError:
        raise SingularOperator("a Robin condition is singular: modify it") from None
    rhs = -np.einsum("kij,kjl,kl->ki", W, F, e[:, None] * s)
    v = np.einsum("kij,kj->ki", W, s / size[:, None])
    return Robin(c[:, None, None] * (W - identity), rhs, v, alpha, beta)


@dataclass(frozen=True, eq=False)
class Settings:
    """Parameters c_n, c_tau (nc,), unit of r / u, and what friction is linearised by."""

    c_normal: Array
    c_tangential: Array
    modification: Modification
    function: FrictionFunction = FrictionFunction.PRODUCT
    tied: Mask | bool = False  # contacts that are closed and stick, whatever r and u

    def sliding(self, lam: Array, u: Array, g: Array, k: Index) -> Robin:
        """The conditions of the contacts k; lam, u, g: of all."""
        c = self.c_tangential[k]
        if self.function is FrictionFunction.QUOTIENT:
            return robin_of_quotient(lam[k], u[k], g[k], c)
        return robin(lam[k], u[k], g[k], c, self.modification)


def conditions(r: Array, u: Array, g: Array, first: bool, settings: Settings) -> Conditions:
    """The step of [HSW] Algorithms 1 and 2 at (r, u), (nc, d), with a given bound g, (nc,).

    first: no bound is known yet, so all contacts stick, as after zero initial values.
    """
    normal = (r[:, 0] - settings.c_normal * u[:, 0] > 0) | settings.tied  # (4.1)
    lam, slip = -r[:, 1:], u[:, 1:]
    s = lam + settings.c_tangential[:, None] * slip
    tangential = np.linalg.norm(s, axis=1) > g  # (3.4)
    if not first:
        tangential |= g <= 0  # section 3.3: natural conditions
    G_r, G_u, b = _rows(r.shape, normal, tangential)
    alpha, beta = np.full((2, len(r)), np.nan)
    k = np.flatnonzero(tangential & (g > 0))
    part = settings.sliding(lam, slip, g, k)
    G_u[k, 1:, 1:], b[k, 1:] = part.L, part.rhs
    alpha[k], beta[k] = part.alpha, part.beta
    return Conditions(G_r, G_u, b, normal, tangential, alpha, beta)


def newton_conditions(r: Array, u: Array, law: Law, settings: Settings) -> Conditions:
    """The full Newton step of [HSW] section 7, (7.2) and (7.3): the bound moves with r_N.

    With its slope mu of Coulomb's law, 0 at a cap; not for bounds of open contacts.
    """
    pressure = r[:, 0] - settings.c_normal * u[:, 0]
    normal, pressed = (pressure > 0) | settings.tied, pressure[:, None]
    lam, slip, g, mu = -r[:, 1:], u[:, 1:], law.bound(pressed), law.bound_slope(pressed)
    moving = mu * np.maximum(pressure, 0)  # the part of g that moves with r_N: all or nothing
    s = lam + settings.c_tangential[:, None] * slip
    tangential = ~normal | (np.linalg.norm(s, axis=1) >= g)
    G_r, G_u, b = _rows(r.shape, normal, tangential)
    alpha, beta = np.full((2, len(r)), np.nan)
    k = np.flatnonzero(normal & ~tangential)  # (7.2); with (3.14) u_T = 0
    if settings.function is FrictionFunction.QUOTIENT:
        k = k[:0]
    G_r[k, 1:, 0] = (mu[k] / g[k])[:, None] * slip[k]
    b[k, 1:] = (moving[k] / g[k])[:, None] * slip[k]
    k = np.flatnonzero(normal & tangential & (g > 0))  # (7.3)
    part = settings.sliding(lam, slip, g, k)
    G_u[k, 1:, 1:] = part.L
    G_r[k, 1:, 0] = mu[k, None] * part.v
    b[k, 1:] = part.rhs + moving[k, None] * part.v
    alpha[k], beta[k] = part.alpha, part.beta
    return Conditions(G_r, G_u, b, normal, tangential, alpha, beta)


def _rows(shape: tuple[int, int], normal: Mask, tangential: Mask) -> tuple[Array, Array, Array]:
    """u_N = 0 or r_N = 0, u_T = 0 or r_T = 0."""
    free = np.column_stack([~normal, *[tangential] * (shape[1] - 1)]).astype(float)
    identity = np.eye(shape[1])
    return free[:, :, None] * identity, (1 - free)[:, :, None] * identity, np.zeros(shape)
