"""Complementarity functions: F(r, u) = 0 exactly when a contact obeys its law.

Each gives F, unit of r, and one element of its generalised Jacobian, A = dF/dr and B = dF/du,
shape (nc, d, d).  With x = r - rho u, [ABD] eqs. (8)-(10):

    Alart-Curnier  F_N = r_N - x_N^+,  F_T = r_T - P_disk(mu x_N^+)(x_T)
    Jean-Moreau    the same with radius mu r_N^+
    natural map    F = r - P_K(r - rho û)

Under Tresca's law the radius is the given bound and all three are the same function.

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `gauss_seidel`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..cones import (
    Law,
    Tresca,
    project_cone,
    project_cone_jacobian,
    project_disk,
    project_disk_jacobian,
    with_de_saxce,
)

Array = NDArray[np.float64]
Linearised = tuple[Array, Array, Array]


class ComplementarityFunction(Protocol):
    """F and its generalised Jacobian."""

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        ...

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B): F (nc, d), A = dF/dr and B = dF/du (nc, d, d)."""
        ...


def _disk_function(r: Array, u: Array, rho: Array, radius: Array) -> Array:
    """r - (x_N^+, P_disk(radius)(x_T))."""
    x = r - rho[:, None] * u
    return r - np.column_stack([np.maximum(x[:, 0], 0), project_disk(x[:, 1:], radius)])


def _disk_linearised(  # noqa: PLR0913
    r: Array, u: Array, rho: Array, radius: Array, radius_r: Array, radius_u: Array
) -> Linearised:
    """`_disk_function` with the derivatives of the radius in r_N and u_N, (nc,)."""
    x = r - rho[:, None] * u
    d = r.shape[1]
    closed = (x[:, 0] > 0).astype(float)
    in_t, in_radius = project_disk_jacobian(x[:, 1:], radius)
    A = np.zeros((len(r), d, d))
    B = np.zeros((len(r), d, d))
    A[:, 0, 0] = 1 - closed
    B[:, 0, 0] = rho * closed
    A[:, 1:, 1:] = np.eye(d - 1) - in_t
    B[:, 1:, 1:] = rho[:, None, None] * in_t
    A[:, 1:, 0] = -in_radius * radius_r[:, None]
    B[:, 1:, 0] = -in_radius * radius_u[:, None]
    return _disk_function(r, u, rho, radius), A, B


@dataclass(frozen=True)
class AlartCurnier:
    """Friction bound from the augmented pressure (r_N - rho u_N)^+."""

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return _disk_function(r, u, rho, self._radius(r, u, law, rho)[0])

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        return _disk_linearised(r, u, rho, *self._radius(r, u, law, rho))

    def _radius(self, r: Array, u: Array, law: Law, rho: Array) -> tuple[Array, Array, Array]:
        zero = np.zeros(len(r))
        if isinstance(law, Tresca):
            return law.limit, zero, zero
        x = r[:, 0] - rho * u[:, 0]
        slope = np.where(x > 0, law.mu, 0.0)
        return law.mu * np.maximum(x, 0), slope, -rho * slope


@dataclass(frozen=True)
class JeanMoreau:
    """Friction bound from the reaction r_N^+ itself."""

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return _disk_function(r, u, rho, law.bound(r))

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        zero = np.zeros(len(r))
        slope = zero if isinstance(law, Tresca) else np.where(r[:, 0] > 0, law.mu, 0.0)
        return _disk_linearised(r, u, rho, law.bound(r), slope, zero)


@dataclass(frozen=True)
class NaturalMap:
    """Projection onto the Coulomb cone after De Saxcé's change of variable."""

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return law.natural_map(r, u, rho)

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        if isinstance(law, Tresca):
            return AlartCurnier().linearise(r, u, law, rho)
        d = r.shape[1]
        slip = np.linalg.norm(u[:, 1:], axis=1)
        x = r - rho[:, None] * with_de_saxce(u, law.mu)
        P = project_cone_jacobian(x, law.mu)
        G = np.broadcast_to(np.eye(d), (len(r), d, d)).copy()
        G[:, 0, 1:] = law.mu[:, None] * u[:, 1:] / np.where(slip > 0, slip, 1)[:, None]
        return r - project_cone(x, law.mu), np.eye(d) - P, rho[:, None, None] * (P @ G)
