"""Pressure over overclosure, where it is no straight line: tables and the exponential law.

A curve gives the overclosure D(p) that a pressure p needs, which grows with p, D(0) being where
pressure begins (< 0: the sides feel each other across a gap).  A contact then obeys

    0 <= u_N + D(r_N / area)  ⟂  r_N >= 0

No kernel knows this law: it is solved by Newton's method on the curve
(`solvers.varying_overclosure`), each step a law with a fixed compliance and offset
(`compliant`), the tangent

    D(p) = D(p_0) + D'(p_0) (p - p_0)

The judge takes the tangent at the state that it judges, where it is the curve itself, so that
an iteration which has not ended is not taken for a solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import number, read_only, real
from ...core.errors import InvalidInput, UnsupportedLaw, shown
from .compliant import Compliant
from .law import Array, Kinds, Law, Mask, per_contact

Index = NDArray[np.intp]
TOE = 1e-6  # share of p0 below which the exponential law is its tangent, down to no pressure
HUNDREDTH = float(np.log(100.0))


@runtime_checkable
class Overclosure(Protocol):
    """What a curve of pressure over overclosure answers, for arrays (n,)."""

    @property
    def typical(self) -> float:
        """A pressure at which Newton's method may begin."""
        ...

    def needed(self, pressure: Array) -> tuple[Array, Array]:
        """(D, D') at pressures >= 0."""
        ...

    def pressure_at(self, overclosure: Array) -> Array:
        """The pressure at overclosures, 0 before it begins."""
        ...

    def energy(self, pressure: Array) -> Array:
        """What the contact stores per area, the integral of p dD from 0."""
        ...


@dataclass(frozen=True, eq=False)
class OverclosureCurve:
    """Pressure over overclosure, straight between points, on along the last line beyond them.

    pressure (k,) grows from 0, a stress; overclosure (k,) grows too, a length, < 0 for a gap.
    Raises InvalidInput for what is no such curve: sides that were pressed less the deeper they
    overlap would have several states.
    """

    pressure: ArrayLike
    overclosure: ArrayLike

    def __post_init__(self) -> None:
        pressure = per_contact("pressure", self.pressure)
        overclosure = real("overclosure", self.overclosure)
        if overclosure.shape != pressure.shape or len(pressure) < 2:
            raise InvalidInput(
                "overclosure: expected as many numbers as there are pressures, two or more, "
                f"got {overclosure.shape} and {pressure.shape}"
            )
        if pressure[0] != 0:
            raise InvalidInput(f"pressure[0]: expected 0, where it begins, got {pressure[0]:g}")
        for name, values in (("pressure", pressure), ("overclosure", overclosure)):
            if not np.isfinite(values).all() or (np.diff(values) <= 0).any():
                raise InvalidInput(f"{name}: expected growing numbers, got {values.tolist()}")
            object.__setattr__(self, name, read_only(np.array(values, dtype=float)))

    @property
    def typical(self) -> float:
        """No pressure: where the first line begins."""
        return 0.0

    def needed(self, pressure: Array) -> tuple[Array, Array]:
        """(D, D') at pressures >= 0."""
        p, d, slope, _ = self._lines
        k = np.clip(np.searchsorted(p, pressure, side="right") - 1, 0, len(slope) - 1)
        return d[k] + slope[k] * (pressure - p[k]), slope[k]

    def pressure_at(self, overclosure: Array) -> Array:
        """The pressure at overclosures."""
        p, d, slope, _ = self._lines
        k = np.clip(np.searchsorted(d, overclosure, side="right") - 1, 0, len(slope) - 1)
        return np.maximum(p[k] + (overclosure - d[k]) / slope[k], 0.0)

    def energy(self, pressure: Array) -> Array:
        """What the contact stores per area: along a line its slope times p^2 / 2."""
        p, _, slope, stored = self._lines
        k = np.clip(np.searchsorted(p, pressure, side="right") - 1, 0, len(slope) - 1)
        return stored[k] + 0.5 * slope[k] * (pressure**2 - p[k] ** 2)

    @property
    def _lines(self) -> tuple[Array, Array, Array, Array]:
        """Points p, d (k,), slopes dD/dp and the energy stored before each line, (k-1,)."""
        p, d = np.asarray(self.pressure), np.asarray(self.overclosure)
        slope = np.diff(d) / np.diff(p)
        steps = 0.5 * slope * np.diff(p**2)
        return p, d, slope, np.concatenate([[0.0], np.cumsum(steps)[:-1]])


@dataclass(frozen=True, eq=False)
class ExponentialOverclosure:
    """p = p0 exp(ln(100) d / c0) at an overclosure d: p0 at d = 0, a hundredth at the gap c0.

    Below 1e-6 of p0 (at gaps beyond 3 c0) the curve is its tangent, which ends at no pressure.
    """

    p0: float
    c0: float

    def __post_init__(self) -> None:
        for name in ("p0", "c0"):
            value = number(name, getattr(self, name))
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"{name}: expected a number > 0, got {value:g}")
            object.__setattr__(self, name, float(value))

    @property
    def typical(self) -> float:
        """The pressure of sides that touch."""
        return self.p0

    def needed(self, pressure: Array) -> tuple[Array, Array]:
        """(D, D') at pressures >= 0."""
        length, toe = self.c0 / HUNDREDTH, TOE * self.p0
        at = np.maximum(pressure, toe)
        slope = length / at
        return length * np.log(at / self.p0) + slope * np.minimum(pressure - toe, 0.0), slope

    def pressure_at(self, overclosure: Array) -> Array:
        """The pressure at overclosures, at most LARGEST."""
        length, toe = self.c0 / HUNDREDTH, TOE * self.p0
        begin = length * np.log(TOE)
        with np.errstate(over="ignore"):
            grown = self.p0 * np.exp(np.minimum(overclosure / length, 300.0))
        line = np.maximum(toe * (1 + (overclosure - begin) / length), 0.0)
        return np.where(overclosure > begin, grown, line)

    def energy(self, pressure: Array) -> Array:
        """What the contact stores per area."""
        length, toe = self.c0 / HUNDREDTH, TOE * self.p0
        low = 0.5 * length / toe * np.minimum(pressure, toe) ** 2
        return low + length * np.maximum(pressure - toe, 0.0)


@dataclass(frozen=True, eq=False)
class VaryingCompliance(Law):
    """A law whose contacts overlap along a curve of pressure over overclosure.

    curve: OverclosureCurve or ExponentialOverclosure; area: r_N over the pressure, (nc,) or one
    number.  law: Coulomb, Tresca, … with or without a cap, or Compliant(law, 0,
    stick_compliance) for contacts that also stick elastically.  length: u over the overclosure
    of the curve, where u is in another unit.
    """

    curve: Any
    area: Array = 1.0  # type: ignore[assignment]
    law: Law | None = None
    length: Array = 1.0  # type: ignore[assignment]
    pieces: tuple[tuple[Index, Any], ...] = ()  # of joined laws

    name = "contact whose pressure follows a curve over the overclosure"
    varies = True

    def __post_init__(self) -> None:
        if not isinstance(self.curve, Overclosure) or isinstance(self.curve, type):
            raise InvalidInput(
                "curve: expected OverclosureCurve or ExponentialOverclosure, got "
                f"{shown(self.curve)}"
            )
        if not isinstance(self.law, Law) or self.law.varies:
            raise InvalidInput(f"law: expected Coulomb, Tresca, …, got {shown(self.law)}")
        if self.law.cohesion.any() or self.law.tied.any():
            raise InvalidInput("law: expected one without cohesion and ties beside a curve")
        area, length = per_contact("area", self.area), per_contact("length", self.length)
        size = max(len(area), len(length), len(self.law))
        for name, values in (("area", area), ("length", length)):
            if len(values) not in (1, size) or (values <= 0).any():
                raise InvalidInput(f"{name}: expected one number > 0, or {size} of them")
            object.__setattr__(self, name, read_only(np.broadcast_to(values, size).copy()))
        law = self.law if len(self.law) == size else self.law.at(np.zeros(size, dtype=int))
        if not isinstance(law, Compliant):
            law = Compliant(law, np.zeros(size), np.zeros(size))
        object.__setattr__(self, "law", law)
        object.__setattr__(self, "pieces", self.pieces or ((np.arange(size), self.curve),))

    @property
    def inner(self) -> Compliant:
        """The law without the curve: friction, and the compliance of contacts without one."""
        assert isinstance(self.law, Compliant)
        return self.law

    def tangent(self, pressure: Array) -> Compliant:
        """The law whose curve is its tangent at pressures (nc,) >= 0."""
        give, offset = self.inner.compliance.copy(), self.inner.offset.copy()
        for index, curve in self.pieces:
            d, slope = curve.needed(pressure[index])
            unit = self.length[index]
            give[index] = slope / (self.area[index] * unit)
            offset[index] = (d - slope * pressure[index]) / unit
        return Compliant(self.inner.law, give, self.inner.stick_compliance, offset)

    def pressures(self, r: Array) -> Array:
        """Of reactions (nc, d): r_N / area where pressed, (nc,)."""
        return np.asarray(np.maximum(r[:, 0], 0.0) / self.area, dtype=float)

    def typical(self) -> Array:
        """Pressures at which Newton's method may begin, (nc,)."""
        out = np.zeros(len(self))
        for index, curve in self.pieces:
            out[index] = curve.typical
        return out

    def at_overclosure(self, u: Array) -> Array:
        """Pressures of motions u (nc, d) by the curve, (nc,)."""
        out = np.zeros(len(self))
        for index, curve in self.pieces:
            out[index] = curve.pressure_at(-u[index, 0] * self.length[index])
        return out

    def energy(self, r: Array) -> Array:
        """What the contacts with a curve store in their normal, (nc,), 0 for the others."""
        out, pressure = np.zeros(len(self)), self.pressures(r)
        for index, curve in self.pieces:
            out[index] = self.area[index] / self.length[index] * curve.energy(pressure[index])
        return out

    def frozen(self, r: Array, u: Array) -> Compliant:
        """The law with the tangent at reactions r, (nc, d)."""
        return self.tangent(self.pressures(r))

    @property
    def curved(self) -> Mask:
        """Contacts that have a curve, (nc,)."""
        out = np.zeros(len(self), dtype=bool)
        for index, _ in self.pieces:
            out[index] = True
        return out

    # ---------------------------------------------------------------- as of the law at rest
    @property
    def kind(self) -> Kinds:  # type: ignore[override]
        """Kinds of the inner law."""
        return self.inner.kind

    @property
    def parameters(self) -> Array:  # type: ignore[override]
        """Parameters of the inner law."""
        return self.inner.parameters

    @property
    def stretch(self) -> Array | None:  # type: ignore[override]
        """That of the inner law."""
        return self.inner.stretch

    @property
    def give(self) -> Array | None:  # type: ignore[override]
        """Diagonal of C, (nc, 3), as pressure begins."""
        return self.tangent(np.zeros(len(self))).give

    @property
    def widest(self) -> Law | None:
        """That of the inner law."""
        return self.inner.widest

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """That of the tangent at r."""
        return self.frozen(r, u).natural_map(r, u, rho)

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Those of the tangent at r."""
        return self.frozen(r, u).regions(r, u, rho)

    def stretched(self, u: Array, r: Array | None = None) -> Array:
        """That of the tangent at r; without r, of the inner law."""
        law = self.inner if r is None else self.frozen(r, u)
        return law.stretched(u, r)

    def augmented_reaction(self, x: Array) -> Array:
        """Raises UnsupportedLaw."""
        raise UnsupportedLaw(f"{self.name} needs reactions and small strains")

    def augmented_reaction_jacobian(self, x: Array) -> Array:
        """Raises UnsupportedLaw."""
        raise UnsupportedLaw(f"{self.name} needs reactions and small strains")

    # ---------------------------------------------------------------- variants
    def at(self, index: NDArray[np.integer]) -> VaryingCompliance:
        """The law of a selection of contacts."""
        chosen = np.arange(len(self))[index]
        pieces = tuple(
            (np.flatnonzero(np.isin(chosen, own)), curve) for own, curve in self.pieces
        )
        return VaryingCompliance(
            self.curve, self.area[chosen], self.inner.at(chosen), self.length[chosen], pieces
        )

    def scaled(self, force: float | Array) -> VaryingCompliance:
        """The law in another unit of r."""
        return replace(self, area=self.area * force, law=self.inner.scaled(force))

    def with_mu(self, mu: Array) -> VaryingCompliance:
        """The law with other coefficients mu, (nc,)."""
        return replace(self, law=self.inner.with_mu(mu))

    def lost(self, gone: Mask) -> VaryingCompliance:
        """The law where contacts gone (nc,) have lost what holds them without pressure."""
        return replace(self, law=self.inner.lost(gone))

    def with_bounds(self, bounds: Array) -> VaryingCompliance:
        """The law with other bounds tau, (nc,)."""
        return replace(self, law=self.inner.with_bounds(bounds))


def joined_compliances(laws: Sequence[Law], inner: Law) -> VaryingCompliance:
    """One law of several, some of which have a curve; inner: all the others, joined."""
    start, pieces, area, length = 0, [], [], []
    for law in laws:
        has = isinstance(law, VaryingCompliance)
        if has:
            pieces += [(index + start, curve) for index, curve in law.pieces]
        area.append(law.area if has else np.ones(len(law)))
        length.append(law.length if has else np.ones(len(law)))
        start += len(law)
    return VaryingCompliance(
        pieces[0][1], np.concatenate(area), inner, np.concatenate(length), tuple(pieces)
    )
