"""J2 plasticity with isotropic hardening at small strains, by radial return ([SH] chapter 3).

The strain is elastic and plastic, eps = eps_e + eps_p, and with the deviator s of the stress

    q = sqrt(3/2) |s| <= yield(p),    d eps_p = 3/2 s / q dp,    dp >= 0, zero where q < yield,

p being the equivalent plastic strain.  A step ends on the yield surface: with the deviator
2 shear (dev eps - eps_p) of a step without flow and its q*, p follows from

    yield(p) + 3 shear (p - p_0) = q*,                                                      (1)

whose left side is piecewise linear, so that (1) is solved exactly.  Stress and moduli are

    sigma = C eps - 2 shear eps_p,
    C - 2 shear (1 - beta) I_dev - 2 shear (1 / (1 + H / (3 shear)) - 1 + beta) n (x) n,    (2)

beta = 1 - 3 shear dp / q*, n = s / |s|, H the slope of the yield stress at p.

[SH] J. C. Simo, T. J. R. Hughes, "Computational Inelasticity", Springer 1998.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number, real
from ...core.errors import InvalidInput, shown
from ...core.words import helpful
from .elasticity import LinearElastic

Array = NDArray[np.float64]
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # what is kept of a symmetric tensor
NUMBERS = 1 + len(PAIRS)  # of a point of integration: p, then eps_p


class Flow(NamedTuple):
    """What points of integration answer.

    strain (n, 3, 3): eps_p; p (n,); q (n,): von Mises stress; normal (n, 3, 3): n of (2);
    round, along (n,): factors of I_dev and n (x) n that (2) takes off, zero without flow.
    """

    strain: Array
    p: Array
    q: Array
    normal: Array
    round: Array
    along: Array


@helpful
@dataclass(frozen=True)
class ElastoPlastic(LinearElastic):
    """Linear elasticity up to a yield stress that grows with the plastic strain.

    yield_stress: one stress > 0, or rows (stress, equivalent plastic strain) from strain 0 on,
    between which it is linear, with stresses that do not fall; hardening: slope beyond the last
    row (or from the one stress on), unit of stress, >= 0.  Von Mises, associated, isotropic.
    Small strains; in 2D plane strain or around an axis.  Stress and strain are true ones.

    What is flown is remembered from step to step: loads that come and go need `evolve`, where
    steps should be small beside the load at which the body gives way.
    """

    yield_stress: Any = None
    hardening: float = 0.0
    keeps_volume: ClassVar[bool] = True  # flow does

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.plane != "strain":
            raise InvalidInput(
                "plane: elasto-plastic bodies are in plane strain (or 3D, or around an axis), "
                f"got {self.plane!r}"
            )
        if not number("hardening", self.hardening) >= 0:
            raise InvalidInput(
                f"hardening: expected a slope >= 0, got {self.hardening!r}: softening has "
                "solutions that depend on the mesh"
            )
        object.__setattr__(self, "yield_stress", _rows(self.yield_stress))

    @property
    def bulk(self) -> float:
        """Bulk modulus; unit of stress."""
        return self.lame_lambda() + 2 * self.shear / 3

    def shape_moduli(self, dim: int) -> Array:
        """`moduli` of the deviator: hybrid cells have the whole pressure on the mean.

        A part of it at points would grow with the flow, without end.
        """
        eye = np.eye(dim)
        return super().shape_moduli(dim) - 2 * self.shear / 3 * np.einsum(
            "ik,jl->ijkl", eye, eye
        )

    def moduli(self, dim: int) -> Array:
        """d stress_ik / d gradient_jl at [i, j, k, l] without flow, unit of stress."""
        eye = np.eye(dim)
        return self.shape_moduli(dim) + self.bulk * np.einsum("ik,jl->ijkl", eye, eye)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """bulk / 2 (J - 1)^2, and its derivatives, of J = 1 + tr eps of any shape."""
        change = J - 1
        return self.bulk / 2 * change**2, self.bulk * change, np.full_like(change, self.bulk)

    def shape_stress(self, gradient: Array) -> Array:
        """Deviator of the stress without flow, (k, 3, 3)."""
        out = super().shape_stress(gradient)
        return out - np.trace(out, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)

    def stress(self, gradient: Array) -> Array:
        """Stress without flow (k, 3, 3) of displacement gradients (k, dim, dim)."""
        pressure = self.bulk * np.trace(gradient, axis1=1, axis2=2)
        return self.shape_stress(gradient) + pressure[:, None, None] * np.eye(3)

    @property
    def _table(self) -> tuple[Array, Array]:
        """Stresses and plastic strains of the rows."""
        rows = np.array(self.yield_stress)
        return rows[:, 0], rows[:, 1]

    def yields_at(self, p: Array) -> Array:
        """Yield stress at equivalent plastic strains p of any shape."""
        stress, strain = self._table
        return np.interp(p, strain, stress) + self.hardening * np.maximum(p - strain[-1], 0)

    def rows_to(self, strain: float) -> list[tuple[float, float]]:
        """The rows, with one more at a plastic strain beyond them where it hardens there."""
        rows = list(self.yield_stress)
        last = rows[-1][1]
        if self.hardening and last < strain:
            rows.append((float(self.yields_at(np.array(strain))), strain))
        return rows

    def _slope(self, p: Array) -> Array:
        """Slope of the yield stress just beyond p."""
        stress, strain = self._table
        slopes = np.append(np.diff(stress) / np.diff(strain), self.hardening)
        return slopes[np.searchsorted(strain, p, side="right") - 1]

    def _flown(self, trial: Array) -> Array:
        """The p of (1), where trial = q* + 3 shear p_0 is at least the yield stress at 0."""
        stress, strain = self._table
        left = stress + 3 * self.shear * strain
        beyond = np.maximum(trial - left[-1], 0) / (3 * self.shear + self.hardening)
        return np.interp(trial, left, strain) + beyond

    def flow(self, strain: Array, before: Array, p: Array) -> Flow:
        """The end of a step at strains (n, 3, 3), from eps_p before (n, 3, 3) and p (n,)."""
        eye, shear = np.eye(3), self.shear
        mean = np.trace(strain, axis1=1, axis2=2)[:, None, None] / 3
        s = 2 * shear * (strain - mean * eye - before)
        size = np.sqrt((s * s).sum(axis=(1, 2)))
        q = np.sqrt(1.5) * size
        flows = q > self.yields_at(p)
        after = np.where(flows, self._flown(q + 3 * shear * p), p)
        step = np.maximum(after - p, 0.0)
        normal = s / np.where(size > 0, size, 1.0)[:, None, None]
        share = 3 * shear * step / np.where(flows, q, 1.0)  # 1 - beta
        along = np.where(flows, 1 / (1 + self._slope(after) / (3 * shear)) - share, 0.0)
        new = before + np.sqrt(1.5) * step[:, None, None] * normal
        return Flow(new, p + step, q - 3 * shear * step, normal, 2 * shear * share,
                    2 * shear * along)  # fmt: skip


def _rows(given: Any) -> tuple[tuple[float, float], ...]:
    """Rows (stress, plastic strain) of what was given."""
    what = "yield_stress: expected a stress > 0 or rows (stress, plastic strain)"
    if given is None:
        raise InvalidInput(f"{what}, got none")
    rows = real("yield_stress", given)
    if rows.ndim == 0:
        rows = np.array([[float(rows), 0.0]])
    if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or not np.isfinite(rows).all():
        raise InvalidInput(f"{what}, got {shown(given)}")
    stress, strain = rows.T
    if not stress[0] > 0:
        raise InvalidInput(f"yield_stress: expected a stress > 0, got {stress[0]:g}")
    if strain[0] != 0:
        raise InvalidInput(
            f"yield_stress: expected plastic strain 0 in the first row, got {strain[0]:g}"
        )
    for name, values, ok in (
        ("plastic strains that grow", strain, np.diff(strain) > 0),
        ("stresses that do not fall", stress, np.diff(stress) >= 0),
    ):
        if not ok.all():
            k = int(np.argmin(ok)) + 1
            raise InvalidInput(
                f"yield_stress: row {k + 1}: expected {name}, got {values[k]:g} after "
                f"{values[k - 1]:g}"
            )
    return tuple((float(a), float(b)) for a, b in rows)


def is_plastic(material: object) -> bool:
    """True for a law that yields, or a table of regions that holds one."""
    if isinstance(material, Mapping):
        return any(isinstance(law, ElastoPlastic) for law in material.values())
    return isinstance(material, ElastoPlastic)


def packed(p: Array, strain: Array) -> Array:
    """History (..., 7) of p (...) and eps_p (..., 3, 3)."""
    return np.concatenate(
        [p[..., None], np.stack([strain[..., i, j] for i, j in PAIRS], axis=-1)], axis=-1
    )


def unpacked(history: Array) -> tuple[Array, Array]:
    """p (...) and eps_p (..., 3, 3) of a history (..., 7)."""
    strain = np.empty((*history.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        strain[..., i, j] = strain[..., j, i] = history[..., 1 + k]
    return history[..., 0], strain
