"""Fischer and Burmeister's function on the friction cone, by the Jordan algebra of its axis.

With x = (mu r_N, r_T) and y = rho (û_N, mu û_T), û as in De Saxcé's change of variable, K and
K* become the self-dual cone L = { |x_T| <= x_N }, and

    F(r, u) = x + y - (x∘x + y∘y)^1/2,      x∘y = (x . y, x_N y_T + y_N x_T)         [FLT]

vanishes exactly when L ∋ x ⟂ y ∈ L.  The root is that of the algebra: with w = x∘x + y∘y and
its spectral values l_1 <= l_2 along e_1, e_2 = (1, -+s) / 2, s = w_T / |w_T|, it is z =
l_1^1/2 e_1 + l_2^1/2 e_2.  Where l_1 > 0, F is smooth and, L_x being the product with x,

    dF/dx = I - L_z^-1 L_x,    dF/dy = I - L_z^-1 L_y.

Kinks.  l_1 = 0 means that x and y both lie along (1, s): there dF/dx is the limit from inside
the cone, x + t e and y + t e with t -> 0, which replaces the ratio along (1, -s) by 1/sqrt 2;
at x = y = 0 it is (1 - 1/sqrt 2) I.  Each is an element of the generalised Jacobian.

A contact without friction has the scalar function of (r_N, rho u_N) and the rows F_T = r_T;
under Tresca's law F_T is that of the disc, as in `functions`; under others F is Alart and
Curnier's.  One rho per contact.

[FLT] M. Fukushima, Z.-Q. Luo, P. Tseng, "Smoothing functions for second-order-cone
complementarity problems", SIAM J. Optim. 12 (2002).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...problem.law import Law
from ...problem.law.cones import project_disk, project_disk_jacobian, with_de_saxce
from ...problem.law.law import BOUND, COULOMB, MU, TRESCA
from .functions import AlartCurnier, Linearised, one_per_contact

Array = NDArray[np.float64]
KINK = 1e-15  # root of l_1, relative to that of l_2, at which it counts as zero


@dataclass(frozen=True)
class FischerBurmeister:
    """x + y - (x∘x + y∘y)^1/2 in the algebra of the cone; see the module."""

    one_rho: ClassVar[bool] = True

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return self.linearise(r, u, law, rho)[0]

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        rho = one_per_contact(rho)
        mu, bound = law.parameters[:, MU], law.parameters[:, BOUND]
        F, A, B = _with_bound(r, u, rho, np.where(law.kind == TRESCA, bound, 0.0))
        cone = np.flatnonzero((law.kind == COULOMB) & (mu > 0))
        F[cone], A[cone], B[cone] = _on_cone(r[cone], u[cone], mu[cone], rho[cone])
        k = np.flatnonzero((law.kind != COULOMB) & (law.kind != TRESCA))
        F[k], A[k], B[k] = AlartCurnier().linearise(r[k], u[k], law.at(k), rho[k])
        return F, A, B


def _on_cone(r: Array, u: Array, mu: Array, rho: Array) -> Linearised:
    """(F, A, B) of contacts with mu > 0."""
    d = r.shape[1]
    first, second = np.ones_like(r), np.tile(mu[:, None], (1, d))
    first[:, 0], second[:, 0] = mu, 1.0
    second *= rho[:, None]
    x, y = first * r, second * with_de_saxce(u, mu)
    F, dx, dy = jordan_fischer_burmeister(x, y)
    slip = np.linalg.norm(u[:, 1:], axis=1)
    change = np.tile(np.eye(d), (len(r), 1, 1))  # d û / d u
    change[:, 0, 1:] = mu[:, None] * u[:, 1:] / np.where(slip > 0, slip, 1)[:, None]
    return F, dx * first[:, None, :], (dy * second[:, None, :]) @ change


def jordan_fischer_burmeister(x: Array, y: Array) -> Linearised:
    """(phi, dphi/dx, dphi/dy) of phi = x + y - (x∘x + y∘y)^1/2 on L; (n, d) and (n, d, d)."""
    w_T = x[:, :1] * x[:, 1:] + y[:, :1] * y[:, 1:]
    size = np.linalg.norm(w_T, axis=1)
    s = np.zeros_like(w_T)
    s[:, 0] = 1.0  # any direction where w has none
    np.divide(w_T, size[:, None], out=s, where=size[:, None] > 0)
    low, high = (np.sqrt(_spectral(x, s, sign) + _spectral(y, s, sign)) for sign in (-1, 1))
    z = 0.5 * np.column_stack([low + high, (high - low)[:, None] * s])
    dx, dy = (np.eye(x.shape[1]) - _ratio(each, s, low, high) for each in (x, y))
    return x + y - z, dx, dy


def _spectral(x: Array, s: Array, sign: int) -> Array:
    """(n,) share of x∘x in the spectral value of w along (1, sign s), without cancellation."""
    along = (x[:, 1:] * s).sum(axis=1)
    across = x[:, 1:] - along[:, None] * s
    return (x[:, 0] + sign * along) ** 2 + (across**2).sum(axis=1)


def _ratio(x: Array, s: Array, low: Array, high: Array) -> Array:
    """L_z^-1 L_x, (n, d, d), by the eigenvectors of L_z; its limit where z is on the border."""
    n, d = x.shape
    kink = low <= KINK * high
    product = x[:, :1, None] * np.eye(d)
    product[:, 0, 1:] = product[:, 1:, 0] = x[:, 1:]
    ones = np.ones((n, 1))
    down, up = (np.hstack([ones, sign * s]) / np.sqrt(2) for sign in (-1, 1))
    ends = [each[:, :, None] * each[:, None, :] for each in (down, up)]
    middle = np.eye(d) - ends[0] - ends[1]
    tops = [_inverse(value) for value in (np.where(kink, 0.0, low), high, 0.5 * (low + high))]
    inverse = sum(
        part * top[:, None, None] for part, top in zip((*ends, middle), tops, strict=True)
    )
    limit = 0.5**0.5 * ends[0]
    out = inverse @ product + np.where(kink, 1.0, 0.0)[:, None, None] * limit
    out[high == 0] = 0.5**0.5 * np.eye(d)
    return out


def _inverse(value: Array) -> Array:
    """1 / value, zero where that is zero."""
    return np.divide(1.0, value, out=np.zeros_like(value), where=value > 0)


def _with_bound(r: Array, u: Array, rho: Array, bound: Array) -> Linearised:
    """(F, A, B) of the scalar function along the normal and the disc of a given bound."""
    d = r.shape[1]
    x, y = r[:, 0], rho * u[:, 0]
    root = np.hypot(x, y)
    A, B = np.zeros((len(r), d, d)), np.zeros((len(r), d, d))
    half = 0.5**0.5
    A[:, 0, 0] = 1 - np.divide(x, root, out=np.full_like(x, half), where=root > 0)
    B[:, 0, 0] = rho * (1 - np.divide(y, root, out=np.full_like(x, half), where=root > 0))
    bound = np.maximum(bound, 0.0)
    tangent = r[:, 1:] - rho[:, None] * u[:, 1:]
    inside, _ = project_disk_jacobian(tangent, bound)
    inside[bound == 0] = 0  # the disc is a point, as in `functions`
    A[:, 1:, 1:] = np.eye(d - 1) - inside
    B[:, 1:, 1:] = rho[:, None, None] * inside
    F = np.column_stack([x + y - root, r[:, 1:] - project_disk(tangent, bound)])
    return F, A, B
