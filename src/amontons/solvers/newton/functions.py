"""Complementarity functions: F(r, u) = 0 exactly when a contact obeys its law.

Each gives F, unit of r, and one element of its generalised Jacobian, A = dF/dr and B = dF/du,
shape (nc, d, d).  [ABD] eqs. (8)-(10):

    Alart-Curnier  F_N = r_N - x_N^+,  F_T = r_T - P_disk(mu x_N^+)(x_T)
    Jean-Moreau    the same with radius mu r_N^+
    natural map    F = r - P_K(r - rho û)

and `fischer_burmeister` in a module of its own,

with x_N = r_N - rho_N u_N and x_T = r_T - rho_T u_T: rho is (nc,), or (nc, 2) with columns
rho_N and rho_T.  The natural map takes one rho per contact only: with two, x would have to be
projected in another norm than Euclid's for F to vanish exactly at a solution.  Under other laws
the radius is that of the law (`Law.bound`), and the natural map is Alart and Curnier's.

Jacobians are chosen regular where the law leaves a choice: a contact without friction bound
(open, or mu = 0) has the tangential row F_T = r_T, whatever u_T.

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `gauss_seidel`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...problem.law import Coulomb, Law
from ...problem.law.cones import (
    project_cone,
    project_cone_jacobian,
    project_disk,
    project_disk_jacobian,
    with_de_saxce,
)
from ...problem.law.law import MU

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Linearised = tuple[Array, Array, Array]


class ComplementarityFunction(Protocol):
    """F and its generalised Jacobian; rho as in the module.

    One that takes only one rho per contact has a class variable one_rho = True.
    """

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        ...

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B): F (nc, d), A = dF/dr and B = dF/du (nc, d, d)."""
        ...


def columns(rho: Array, d: int) -> Array:
    """rho for each component of a contact, (nc, 1) or (nc, d), from (nc,) or (nc, 2)."""
    return rho[:, None] if rho.ndim == 1 else rho[:, [0] + [1] * (d - 1)]


def _disk_function(r: Array, u: Array, rho: Array, radius: Array, tied: Mask) -> Array:
    """r - (x_N^+, P_disk(radius)(x_T)); of tied contacts r - x."""
    x = r - columns(rho, r.shape[1]) * u
    normal = np.where(tied, x[:, 0], np.maximum(x[:, 0], 0))
    return r - np.column_stack([normal, project_disk(x[:, 1:], radius)])


def _disk_linearised(  # noqa: PLR0913
    r: Array, u: Array, rho: Array, radius: Array, radius_r: Array, radius_u: Array,
    tied: Mask,
) -> Linearised:  # fmt: skip
    """`_disk_function` with the derivatives of the radius in r_N and u_N, (nc,)."""
    d = r.shape[1]
    each = columns(rho, d)
    x = r - each * u
    closed = ((x[:, 0] > 0) | tied).astype(float)
    in_t, in_radius = project_disk_jacobian(x[:, 1:], radius)
    in_t[radius == 0] = 0  # the disk is a point: exact, and regular also at x_T = 0
    A = np.zeros((len(r), d, d))
    B = np.zeros((len(r), d, d))
    A[:, 0, 0] = 1 - closed
    B[:, 0, 0] = each[:, 0] * closed
    A[:, 1:, 1:] = np.eye(d - 1) - in_t
    B[:, 1:, 1:] = each[:, -1, None, None] * in_t
    A[:, 1:, 0] = -in_radius * radius_r[:, None]
    B[:, 1:, 0] = -in_radius * radius_u[:, None]
    return _disk_function(r, u, rho, radius, tied), A, B


def one_per_contact(rho: Array) -> Array:
    """rho; raises InvalidInput unless it is (nc,)."""
    if rho.ndim != 1:
        raise InvalidInput(
            f"rho: a function of the whole cone needs one per contact, shape (nc,), got "
            f"{rho.shape}; use AlartCurnier or JeanMoreau for rho_N and rho_T apart"
        )
    return rho


@dataclass(frozen=True)
class AlartCurnier:
    """Friction bound from the augmented pressure (r_N - rho u_N)^+."""

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return _disk_function(r, u, rho, self._radius(r, u, law, rho)[0], law.tied)

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        return _disk_linearised(r, u, rho, *self._radius(r, u, law, rho), law.tied)

    def _radius(self, r: Array, u: Array, law: Law, rho: Array) -> tuple[Array, Array, Array]:
        normal = columns(rho, 2)[:, 0]
        x = (r[:, 0] - normal * u[:, 0])[:, None]
        slope = law.bound_slope(x)
        return law.bound(x), slope, -normal * slope


@dataclass(frozen=True)
class JeanMoreau:
    """Friction bound from the reaction r_N^+ itself.

    At r_N = 0, where all open contacts are, the element of the Jacobian is that of pressed
    ones, slope mu: with slope 0 no Newton step knows that friction comes with pressure, and
    where much slides full steps go round.
    """

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        return _disk_function(r, u, rho, law.bound(r), law.tied)

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        touching = (r[:, 0] == 0) & ~law.given(r)
        slope = np.where(touching, law.parameters[:, MU], law.bound_slope(r))
        none = np.zeros(len(r))
        return _disk_linearised(r, u, rho, law.bound(r), slope, none, law.tied)


@dataclass(frozen=True)
class NaturalMap:
    """Projection onto the Coulomb cone after De Saxcé's change of variable."""

    one_rho: ClassVar[bool] = True

    def residual(self, r: Array, u: Array, law: Law, rho: Array) -> Array:
        """F, (nc, d), unit of r."""
        if not isinstance(law, Coulomb):
            return AlartCurnier().residual(r, u, law, one_per_contact(rho))
        return law.natural_map(r, u, one_per_contact(rho))

    def linearise(self, r: Array, u: Array, law: Law, rho: Array) -> Linearised:
        """(F, A, B) at (r, u)."""
        one_per_contact(rho)
        if not isinstance(law, Coulomb):
            return AlartCurnier().linearise(r, u, law, rho)
        d = r.shape[1]
        slip = np.linalg.norm(u[:, 1:], axis=1)
        x = r - rho[:, None] * with_de_saxce(u, law.mu)
        P = project_cone_jacobian(x, law.mu)
        G = np.broadcast_to(np.eye(d), (len(r), d, d)).copy()
        G[:, 0, 1:] = law.mu[:, None] * u[:, 1:] / np.where(slip > 0, slip, 1)[:, None]
        return r - project_cone(x, law.mu), np.eye(d) - P, rho[:, None, None] * (P @ G)
