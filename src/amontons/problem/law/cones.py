"""Friction laws per contact: projections, their Jacobians, and the natural map of each law.

Contact vectors are rows [x_N, x_T] in the local frame, shape (nc, d) with d = 2 or 3; u_N >= 0
is open, r_N >= 0 is compression.

Coulomb: K = { r : |r_T| <= mu r_N }, K* contains u_hat = u + mu |u_T| n, orthogonal to r.
Tresca:  r_N >= 0 orthogonal to u_N >= 0; |r_T| <= bound, and r_T opposes u_T
         with |r_T| = bound if u_T != 0.

[ABH] V. Acary, M. Brémond, O. Huber, "On solving contact problems with Coulomb friction:
formulations and numerical comparisons", Inria RR-9118 (2018).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import LARGEST, real
from ...core.errors import InvalidInput

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _regions(x: Array, mu: Array) -> tuple[Array, ...]:
    """Masks (in K, in -K*); elsewhere a = P_N, shrink = |P_T|/|x_T|, s = x_T/|x_T|."""
    t = np.linalg.norm(x[:, 1:], axis=1)
    polar = mu * t <= -x[:, 0]
    inside = (t <= mu * x[:, 0]) & (mu > 0) & ~polar  # mu = 0: K is a ray, no interior
    t_safe = np.where(t > 0, t, 1)
    a = (x[:, 0] + mu * t) / (1 + mu**2)
    return inside, polar, a, np.clip(mu * a, 0, t) / t_safe, x[:, 1:] / t_safe[:, None]


def project_cone(x: Array, mu: Array) -> Array:
    """Euclidean projection P of each row of x onto K; shape (nc, d), unit of x."""
    inside, polar, a, shrink, _ = _regions(x, mu)
    p = np.column_stack([a, shrink[:, None] * x[:, 1:]])
    p[inside], p[polar] = x[inside], 0
    return p


def project_cone_jacobian(x: Array, mu: Array) -> Array:
    """One element of the Clarke Jacobian of `project_cone` at x; shape (nc, d, d).

    Symmetric, eigenvalues in [0, 1].  On a kink: zero on -K*, else identity on K.
    """
    inside, polar, _, shrink, s = _regions(x, mu)
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


def _coefficient(name: str, value: ArrayLike) -> Array:
    """A read-only copy, shape (nc,); rejects negative, non-finite and huge values by position.

    The square of a huge one is no number any more.
    """
    array = np.atleast_1d(real(name, value))
    if array.ndim != 1:
        raise InvalidInput(f"{name}: expected shape (nc,), got {array.shape}")
    bad = np.flatnonzero(~np.isfinite(array) | (array < 0))
    if bad.size:
        raise InvalidInput(
            f"{name}[{bad[0]}]: expected a finite number >= 0, got {array[bad[0]]!r}"
        )
    huge = np.flatnonzero(array > LARGEST)
    if huge.size:
        raise InvalidInput(
            f"{name}[{huge[0]}]: expected at most {LARGEST:g}, got {array[huge[0]]:g}"
        )
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class Coulomb:
    """Coulomb friction with coefficient mu, shape (nc,), dimensionless."""

    mu: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", _coefficient("mu", self.mu))

    @property
    def coefficient(self) -> Array:
        """The number per contact that the law needs, shape (nc,)."""
        return self.mu

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """Residual of the law, (nc, d), unit of r; zero exactly at a solution."""
        return natural_map(r, u, self.mu, rho)

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,): the piece of the natural map that holds at (r, u)."""
        inside, polar, *_ = _regions(r - rho[:, None] * with_de_saxce(u, self.mu), self.mu)
        return ~polar, ~polar & ~inside

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r, shape (nc,)."""
        return self.mu * np.maximum(r[:, 0], 0)

    def at(self, index: NDArray[np.integer]) -> Coulomb:
        """The law of a selection of contacts."""
        return replace(self, mu=self.mu[index])


@dataclass(frozen=True, eq=False)
class Tresca:
    """Given friction: |r_T| <= bound, shape (nc,), unit of r, whatever the pressure."""

    limit: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "limit", _coefficient("bound", self.limit))

    @property
    def coefficient(self) -> Array:
        """The number per contact that the law needs, shape (nc,)."""
        return self.limit

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """Residual of the law, (nc, d), unit of r; zero exactly at a solution."""
        x = r - rho[:, None] * u
        normal = np.maximum(x[:, 0], 0)
        return r - np.column_stack([normal, project_disk(x[:, 1:], self.limit)])

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,); an open contact may slide."""
        x = r - rho[:, None] * u
        return x[:, 0] > 0, np.linalg.norm(x[:, 1:], axis=1) > self.limit

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r, shape (nc,)."""
        return self.limit

    def at(self, index: NDArray[np.integer]) -> Tresca:
        """The law of a selection of contacts."""
        return replace(self, limit=self.limit[index])


Law = Coulomb | Tresca


def augmented_reaction(x: Array, law: Law) -> Array:
    """(x_N^+, projection of x_T onto the disk that the law allows at x_N^+), (nc, d).

    Alart and Curnier's form of both laws: r obeys them with u where r = this of x = r - rho u,
    whatever rho > 0.
    """
    normal = np.maximum(x[:, 0], 0.0)
    return np.column_stack([normal, project_disk(x[:, 1:], law.bound(x))])


def augmented_reaction_jacobian(x: Array, law: Law) -> Array:
    """One element of the generalised Jacobian of `augmented_reaction`, (nc, d, d).

    On kinks: zero at x_N = 0, identity in x_T on the rim of the disk.
    """
    radius = law.bound(x)
    in_t, in_radius = project_disk_jacobian(x[:, 1:], radius)
    in_t[radius == 0] = 0.0
    closed = x[:, 0] > 0
    out = np.zeros((*x.shape, x.shape[1]))
    out[:, 0, 0] = closed
    out[:, 1:, 1:] = in_t
    if isinstance(law, Coulomb):
        out[:, 1:, 0] = in_radius * (law.mu * closed)[:, None]
    return out
