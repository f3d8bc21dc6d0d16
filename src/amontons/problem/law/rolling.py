"""Friction that resists sliding, spinning and rolling: a reaction of force and moment.

In the frame of a contact, normal first, with the velocities that do work on them,

    r = (r_N, r_T, m_S, m_R),    u = (u_N, u_T, w_S, w_R),

m_S the moment about the normal (torsion) and m_R about the tangents (rolling), w the angular
velocity of the slave relative to the master.  With lengths `torsion` and `rolling`,

    |r_T| <= mu r_N,  |m_S| <= torsion r_N,  |m_R| <= rolling r_N,

each opposed to its velocity and at its bound where that is not zero.  By De Saxcé's change of
variable that is one cone K, [ABV],

    K* ∋ u + (mu |u_T| + torsion |w_S| + rolling |w_R|) n  ⟂  r ∈ K.

A ball that rolls with v on a floor is slowed by 5/7 rolling g / R; on a slope it stays at rest
where tan(slope) <= rolling / R, and mu.

[ABV] V. Acary, F. Bourrier, B. Viallon, "Coulomb friction with rolling resistance as a cone
complementarity problem", European Journal of Mechanics A 85 (2021).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from .law import MU, Array, Kind, Kinds, Law, columns_of, kinds_of, per_contact, same_length

ROWS = 6  # of kernels: N, T1, T2, S, R1, R2


@dataclass(frozen=True, eq=False)
class RollingFriction(Law):
    """mu (dimensionless), rolling and torsion (lengths), each a number or (nc,)."""

    name: ClassVar[str] = "friction that resists rolling"
    has_moments: ClassVar[bool] = True
    mu: Array
    rolling: Array = 0.0  # type: ignore[assignment]  # numbers are made arrays
    torsion: Array = 0.0  # type: ignore[assignment]

    def __post_init__(self) -> None:
        names = "mu", "rolling", "torsion"
        given = {name: per_contact(name, getattr(self, name)) for name in names}
        if not len(given["mu"]):  # no contacts, of which defaults know nothing
            given |= {name: given[name][:0] for name in names if len(given[name]) == 1}
        for name, value in zip(names, same_length(**given), strict=True):
            object.__setattr__(self, name, value)

    @cached_property
    def kind(self) -> Kinds:
        """COULOMB, (nc,), of the forces."""
        return kinds_of(Kind.COULOMB, len(self.mu))

    @cached_property
    def parameters(self) -> Array:
        """(mu, infinity), (nc, 2), of the forces."""
        return columns_of(self.mu, np.inf, len(self.mu))

    @property
    def coefficients(self) -> Array:
        """(nc, 3) of sliding, spinning and rolling."""
        return np.column_stack([self.mu, self.torsion, self.rolling])

    def shear(self, x: Array) -> Array:
        """x_T: (nc, 1) of three rows, (nc, 2) of five or six."""
        return x[:, 1:2] if x.shape[1] == 3 else x[:, 1:3]

    def at(self, index: NDArray[np.integer]) -> RollingFriction:
        """The law of a selection of contacts."""
        return RollingFriction(self.mu[index], self.rolling[index], self.torsion[index])

    def scaled(self, force: float | Array) -> RollingFriction:
        """Itself: another unit of force changes no coefficient."""
        return self

    def _of(self, kind: Kinds, parameters: Array) -> RollingFriction:
        return RollingFriction(parameters[:, MU], self.rolling, self.torsion)


@njit(cache=True, error_model="numpy")
def sizes_of(z):
    """|z_T|, |z_S| and |z_R| of six rows."""
    return (
        math.sqrt(z[1] * z[1] + z[2] * z[2]), abs(z[3]), math.sqrt(z[4] * z[4] + z[5] * z[5])
    )


@njit(cache=True, error_model="numpy")
def projected_inplace(z, a, p):
    """p (6,) becomes the point of K nearest to z (6,), a (3,) the coefficients; returns p_N.

    p_N = t is the root of t = z_N + sum of a_k (|z_k| - a_k t)_+, or 0; from all parts, those
    that are inside at some t below the root are inside at the root.
    """
    sizes = sizes_of(z)
    out0, out1, out2 = a[0] > 0.0, a[1] > 0.0, a[2] > 0.0
    t = 0.0
    for _ in range(4):
        top, bottom = z[0], 1.0
        if out0:
            top, bottom = top + a[0] * sizes[0], bottom + a[0] * a[0]
        if out1:
            top, bottom = top + a[1] * sizes[1], bottom + a[1] * a[1]
        if out2:
            top, bottom = top + a[2] * sizes[2], bottom + a[2] * a[2]
        t = max(top / bottom, 0.0)
        in0 = out0 and sizes[0] <= a[0] * t
        in1 = out1 and sizes[1] <= a[1] * t
        in2 = out2 and sizes[2] <= a[2] * t
        if not (in0 or in1 or in2):
            break
        out0, out1, out2 = out0 and not in0, out1 and not in1, out2 and not in2
    p[0] = t
    k0 = 1.0 if sizes[0] <= a[0] * t else a[0] * t / sizes[0]
    k1 = 1.0 if sizes[1] <= a[1] * t else a[1] * t / sizes[1]
    k2 = 1.0 if sizes[2] <= a[2] * t else a[2] * t / sizes[2]
    p[1], p[2], p[3] = k0 * z[1], k0 * z[2], k1 * z[3]
    p[4], p[5] = k2 * z[4], k2 * z[5]
    return t


@njit(cache=True, error_model="numpy")
def missed_inplace(r, u, a, rho, z, e):
    """e (6,) becomes (r - P_K(r - rho u_hat)) / rho, unit of u; z (6,) the point projected."""
    slip, spin, roll = sizes_of(u)
    for k in range(6):
        z[k] = r[k] - rho * u[k]
    z[0] -= rho * (a[0] * slip + a[1] * spin + a[2] * roll)
    projected_inplace(z, a, e)
    for k in range(6):
        e[k] = (r[k] - e[k]) / rho


@njit(cache=True, error_model="numpy")
def velocities_inplace(indptr, indices, data, q, r, u):
    """u = W r + q (nc, 6) of rows of 6x6 blocks."""
    for i in range(len(q)):
        for a in range(6):
            u[i, a] = q[i, a]
        for k in range(indptr[i], indptr[i + 1]):
            j, block = indices[k], data[k]
            for a in range(6):
                for b in range(6):
                    u[i, a] += block[a, b] * r[j, b]


@njit(cache=True, error_model="numpy")
def all_missed(r, u, coefficients, rho):
    """(e, z) of `missed_inplace` for all contacts, (nc, 6); where rho is 0 what penetrates."""
    e, z = np.zeros((len(r), 6)), np.zeros((len(r), 6))
    for i in range(len(r)):
        if rho[i] > 0.0:
            missed_inplace(r[i], u[i], coefficients[i], rho[i], z[i], e[i])
        else:
            e[i, 0] = min(u[i, 0], 0.0)
            for k in range(6):
                if r[i, k] != 0.0:
                    e[i, 0] = math.inf
    return e, z


__all__ = [
    "ROWS", "RollingFriction", "all_missed", "missed_inplace", "projected_inplace", "sizes_of",
    "velocities_inplace",
]  # fmt: skip
