"""Friction whose coefficient follows the pressure or the speed of the slip.

    |r_T| <= mu r_N,  r_T = -mu r_N u_T / |u_T| where u_T != 0,    mu = mu(p, s)
    p = max(r_N, 0) / area,    s = |u_T| / duration

as of polymers (mu falls with the pressure) and of lubricated or rate-weakening surfaces (a
Stribeck curve).  `area` makes a pressure of r_N, `duration` a speed of u_T: 1 where u are
velocities, the step where they are displacements.  What gives way (`compliant`) slips by u' =
u + C r.

No kernel knows this law: it is solved by an outer loop (`solvers.varying_law`) over laws
with fixed coefficients, those of `frozen` at a state.  The judge freezes them at the state that
it judges, so that a loop which has not settled is not taken for a solution.  Where mu falls
with the speed, or steeply with the pressure, there may be several solutions, or none that the
loop finds: friction then depends on what it causes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import read_only, real
from ...core.errors import InvalidInput, UnsupportedLaw, shown
from .coulomb import Coulomb
from .law import Array, Kind, Kinds, Law, Mask, per_contact

Curve = Callable[[Array, Array], ArrayLike]


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """mu over the pressure, over the slip speed, or over both.

    mu: numbers (k,) at ascending `pressure` (k,) or `speed` (k,), or (k, m) at both, linear in
    between and constant beyond; or a function of pressures and speeds, (n,) each, to (n,).
    """

    mu: ArrayLike | Curve
    pressure: ArrayLike | None = None
    speed: ArrayLike | None = None

    def __post_init__(self) -> None:
        axes = {"pressure": self.pressure, "speed": self.speed}
        if callable(self.mu):
            given = [name for name, values in axes.items() if values is not None]
            if given:
                raise InvalidInput(f"{given[0]}: expected none beside a function for mu")
            return
        shape = []
        for name, values in axes.items():
            if values is None:
                continue
            array = per_contact(name, values)
            if not len(array) or (np.diff(array) <= 0).any():
                raise InvalidInput(f"{name}: expected ascending numbers, got {array.tolist()}")
            object.__setattr__(self, name, array)
            shape.append(len(array))
        if not shape:
            raise InvalidInput("mu: expected pressure or speed beside it, or a function")
        mu = real("mu", self.mu)
        if mu.shape != tuple(shape):
            raise InvalidInput(
                f"mu: expected one number for each pressure and speed, {tuple(shape)}, got "
                f"shape {mu.shape}"
            )
        per_contact("mu", mu.ravel())
        object.__setattr__(self, "mu", read_only(mu.copy()))

    def __call__(self, pressure: Array, speed: Array) -> Array:
        """mu, (n,), at pressures and speeds (n,); raises InvalidInput for what is no mu."""
        if callable(self.mu):
            found = real("mu", self.mu(pressure, speed))
            if found.shape not in ((), pressure.shape):
                raise InvalidInput(
                    f"mu: expected a function of pressures and speeds (n,) that returns (n,), "
                    f"got shape {found.shape} for n = {len(pressure)}"
                )
            return per_contact("mu", np.broadcast_to(found, pressure.shape).copy())
        mu: Any = self.mu
        if self.speed is None:
            return np.interp(pressure, self.pressure, mu)  # type: ignore[arg-type]
        if self.pressure is None:
            return np.interp(speed, self.speed, mu)  # type: ignore[arg-type]
        (i, a), (j, b) = _place(pressure, self.pressure), _place(speed, self.speed)  # type: ignore[arg-type]
        low = (1 - b) * mu[i, j] + b * mu[i, np.minimum(j + 1, mu.shape[1] - 1)]
        i = np.minimum(i + 1, mu.shape[0] - 1)
        high = (1 - b) * mu[i, j] + b * mu[i, np.minimum(j + 1, mu.shape[1] - 1)]
        return (1 - a) * low + a * high


def _place(x: Array, at: Array) -> tuple[NDArray[np.intp], Array]:
    """(interval, share of it from its start) of points x (n,), within those of `at`."""
    x = np.clip(x, at[0], at[-1])
    k = np.clip(np.searchsorted(at, x, side="right") - 1, 0, max(len(at) - 2, 0))
    if len(at) == 1:
        return k, np.zeros(len(x))
    return k, (x - at[k]) / (at[k + 1] - at[k])


@dataclass(frozen=True, eq=False)
class VaryingFriction(Law):
    """A law whose coefficients follow a curve, `contacts` contacts or those of `law`.

    area: r_N over the pressure, (nc,) or one number; duration: u_T over the speed of the slip.
    law: Coulomb's, or one with a cap, cohesion or compliance; its coefficients do not count.
    """

    curve: FrictionCurve | Curve
    area: Array = 1.0  # type: ignore[assignment]
    duration: Array = 1.0  # type: ignore[assignment]
    law: Law | None = None
    pieces: tuple[tuple[NDArray[np.intp], FrictionCurve], ...] = ()  # of joined laws

    name = "friction that follows pressure or slip speed"
    varies = True

    def __post_init__(self) -> None:
        curve = self.curve
        if not isinstance(curve, FrictionCurve):
            if not callable(curve):
                raise InvalidInput(
                    f"curve: expected a FrictionCurve or a function, got {shown(curve)}"
                )
            curve = FrictionCurve(curve)
            object.__setattr__(self, "curve", curve)
        area, duration = per_contact("area", self.area), per_contact("duration", self.duration)
        size = max(len(area), len(duration), 1 if self.law is None else len(self.law))
        law = Coulomb(np.zeros(size)) if self.law is None else self.law
        if not isinstance(law, Law) or law.varies or law.stretch is not None:
            raise InvalidInput(
                "law: expected Coulomb or CappedCoulomb, with or without cohesion and "
                f"compliance, got {shown(law)}"
            )
        for name, values in (("area", area), ("duration", duration)):
            if len(values) not in (1, size) or (values <= 0).any():
                raise InvalidInput(f"{name}: expected one number > 0, or {size} of them")
            object.__setattr__(self, name, read_only(np.broadcast_to(values, size).copy()))
        if len(law) == 1 != size:
            law = law.at(np.zeros(size, dtype=int))
        pieces = self.pieces or ((np.arange(size), curve),)
        object.__setattr__(self, "pieces", pieces)
        own = np.concatenate([index for index, _ in pieces])
        if np.isin(law.kind[own], (Kind.TRESCA, Kind.TIED)).any():
            raise InvalidInput("law: expected one with a coefficient, Coulomb or CappedCoulomb")
        at_rest = np.zeros(size)
        object.__setattr__(self, "law", law.with_mu(self._mu(law, at_rest, at_rest)))

    def _mu(self, law: Law, pressure: Array, speed: Array) -> Array:
        """Coefficients, (nc,); those of the law where no curve is."""
        mu = law.parameters[:, 0].copy()
        for index, curve in self.pieces:
            mu[index] = curve(pressure[index], speed[index])
        return mu

    @property
    def inner(self) -> Law:
        """The law with the coefficients of no pressure and no slip."""
        assert self.law is not None
        return self.law

    def coefficients(self, r: Array, u: Array) -> Array:
        """mu, (nc,), at reactions r and motions u, (nc, d)."""
        pressure: Array = np.maximum(r[:, 0], 0.0) / self.area
        slip = np.linalg.norm(self.inner.stretched(u, r)[:, 1:], axis=1)
        return self._mu(self.inner, pressure, np.asarray(slip / self.duration, dtype=float))

    def frozen(self, r: Array, u: Array) -> Law:
        """The law with the coefficients that belong to r and u, (nc, d)."""
        return self.inner.with_mu(self.coefficients(r, u))

    def lasting(self, duration: float) -> VaryingFriction:
        """The law of displacements in a step of that duration."""
        return replace(self, duration=np.array(duration))

    @property
    def widest(self) -> Law | None:
        """The law with the largest coefficients; None with a function."""
        mu = self.parameters[:, 0].copy()
        for index, curve in self.pieces:
            if callable(curve.mu):
                return None
            mu[index] = np.max(curve.mu)
        return self.inner.with_mu(mu)

    # ---------------------------------------------------------------- as of the law at rest
    @property
    def kind(self) -> Kinds:  # type: ignore[override]
        """Kinds of the inner law."""
        return self.inner.kind

    @property
    def parameters(self) -> Array:  # type: ignore[override]
        """Parameters of the inner law."""
        return self.inner.parameters

    @cached_property
    def cohesion(self) -> Array:
        """That of the inner law."""
        return self.inner.cohesion

    @property
    def give(self) -> Array | None:  # type: ignore[override]
        """That of the inner law."""
        return self.inner.give

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """That of the frozen law at (r, u)."""
        return self.frozen(r, u).natural_map(r, u, rho)

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Those of the frozen law at (r, u)."""
        return self.frozen(r, u).regions(r, u, rho)

    def stretched(self, u: Array, r: Array | None = None) -> Array:
        """That of the inner law: friction moves nothing."""
        return self.inner.stretched(u, r)

    def bound(self, r: Array) -> Array:
        """Largest |r_T| at r without slip, (nc,)."""
        return self.frozen(r, np.zeros_like(r)).bound(r)

    def augmented_reaction(self, x: Array) -> Array:
        """Raises UnsupportedLaw: x alone does not tell the speed."""
        raise UnsupportedLaw(f"{self.name} needs reactions and small strains")

    def augmented_reaction_jacobian(self, x: Array) -> Array:
        """Raises UnsupportedLaw."""
        raise UnsupportedLaw(f"{self.name} needs reactions and small strains")

    # ---------------------------------------------------------------- variants
    def at(self, index: NDArray[np.integer]) -> VaryingFriction:
        """The law of a selection of contacts."""
        chosen = np.arange(len(self))[index]
        place = {int(old): new for new, old in enumerate(chosen)}
        if len(place) < len(chosen):  # repeated: of one contact
            pieces = ((np.arange(len(chosen)), self.pieces[0][1]),)
        else:
            pieces = tuple(
                (np.array([place[int(i)] for i in own if int(i) in place], dtype=int), curve)
                for own, curve in self.pieces
            )
        area, duration = self.area[chosen], self.duration[chosen]
        return VaryingFriction(self.curve, area, duration, self.inner.at(chosen), pieces)

    def scaled(self, force: float | Array) -> VaryingFriction:
        """The law in another unit of r."""
        return replace(self, area=self.area * force, law=self.inner.scaled(force))

    def lost(self, gone: Mask) -> VaryingFriction:
        """The law where contacts gone (nc,) have lost what holds them without pressure."""
        return replace(self, law=self.inner.lost(gone))

    def with_bounds(self, bounds: Array) -> VaryingFriction:
        """The law with other bounds tau, (nc,)."""
        return replace(self, law=self.inner.with_bounds(bounds))


def joined_varying(laws: Sequence[Law], inner: Law) -> VaryingFriction:
    """One law of several, some of which vary; inner: the others and the inner laws, joined."""
    start, pieces, area, duration = 0, [], [], []
    for law in laws:
        varies = isinstance(law, VaryingFriction)
        if varies:
            pieces += [(index + start, curve) for index, curve in law.pieces]
        for values, name in ((area, "area"), (duration, "duration")):
            values.append(getattr(law, name) if varies else np.ones(len(law)))
        start += len(law)
    return VaryingFriction(
        pieces[0][1], np.concatenate(area), np.concatenate(duration), inner, tuple(pieces)
    )
