"""Orthotropic linear elasticity: three axes of symmetry of the material, turned in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number, real
from ...core.errors import InvalidInput, shown
from ...core.words import helpful

Array = NDArray[np.float64]
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # strains; the last three are halved
X_AND_Y = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@helpful
@dataclass(frozen=True)
class OrthotropicElastic:
    """Elasticity along three perpendicular axes 1, 2, 3 of the material, small strains.

    young: E1, E2, E3, unit of stress, > 0; poisson: nu12, nu13, nu23, nu12 being the strain
    along 2 over that along 1, with the other sign, under a stress along 1; shear: G12, G13,
    G23, > 0.  axes: a vector along 1 and one in the plane of 1 and 2, by default x and y.
    plane: "strain" or "stress", read in 2D only; the third axis is then across the plane.
    density: mass per volume.  expansion: strain per temperature along the axes, three numbers
    or one.
    """

    young: Sequence[float]
    poisson: Sequence[float]
    shear: Sequence[float]
    axes: Sequence[Sequence[float]] = X_AND_Y
    plane: str = "strain"
    density: float | None = None
    expansion: Sequence[float] | float = 0.0

    def __post_init__(self) -> None:
        for name in ("young", "poisson", "shear"):
            values = _three(name, getattr(self, name))
            if name != "poisson" and min(values) <= 0:
                raise InvalidInput(f"{name}: expected stresses > 0, got {values}")
            object.__setattr__(self, name, values)
        expansion = self.expansion
        if not isinstance(expansion, Sequence | np.ndarray):
            expansion = (number("expansion", expansion),) * 3
        object.__setattr__(self, "expansion", _three("expansion", expansion))
        least = float(np.linalg.eigvalsh(self._compliance[:3, :3]).min())
        if least <= 0:
            raise InvalidInput(
                f"poisson: {self.poisson} are too large for {self.young}: a stress would gain "
                "energy; expected a compliance with positive eigenvalues"
            )
        object.__setattr__(self, "axes", _axes(self.axes))
        if self.plane not in ("strain", "stress"):
            raise InvalidInput(f'plane: expected "strain" or "stress", got {self.plane!r}')
        if self.density is not None and not number("density", self.density) > 0:
            raise InvalidInput(f"density: expected a finite number > 0, got {self.density!r}")

    @property
    def _compliance(self) -> Array:
        """Strains (6,) of stresses (6,) in the material's axes, shear strains doubled."""
        out = np.diag(1 / np.array([*self.young, *self.shear]))
        for nu, (a, b) in zip(self.poisson, ((0, 1), (0, 2), (1, 2)), strict=True):
            out[a, b] = out[b, a] = -nu / self.young[a]
        return out

    @property
    def rotation(self) -> Array:
        """Axes 1, 2, 3 of the material as rows, (3, 3)."""
        return np.array(self.axes)

    def moduli(self, dim: int) -> Array:
        """d stress_ik / d gradient_jl at [i, j, k, l], (dim, dim, dim, dim), unit of stress."""
        stiff = np.linalg.inv(self._compliance)
        local = np.zeros((3, 3, 3, 3))  # d stress_ab / d strain_cd at [a, b, c, d]
        for p, (a, b) in enumerate(PAIRS):
            for q, (c, d) in enumerate(PAIRS):
                for i, k in {(a, b), (b, a)}:
                    for j, l in {(c, d), (d, c)}:
                        local[i, k, j, l] = stiff[p, q]
        R = self.rotation
        C = np.einsum("abcd,ai,bk,cj,dl->ikjl", local, R, R, R, R)
        if dim == 2:
            C = _without_stress_across(C) if self.plane == "stress" else C
            C = C[:2, :2, :2, :2]
        return np.einsum("ikjl->ijkl", C)

    def stress(self, gradient: Array) -> Array:
        """Stress (k, 3, 3) of displacement gradients (k, dim, dim); see `cell_stress`."""
        dim = gradient.shape[1]
        out, inside = np.zeros((len(gradient), 3, 3)), np.zeros((len(gradient), 3, 3))
        if dim == 2 and self.plane == "stress":
            out[:, :2, :2] = np.einsum("ijkl,qjl->qik", self.moduli(2), gradient)
            return out
        inside[:, :dim, :dim] = gradient
        return np.einsum("ijkl,qjl->qik", self.moduli(3), inside)


def _three(name: str, values: object) -> tuple[float, float, float]:
    found = real(name, values)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise InvalidInput(f"{name}: expected three finite numbers, got {shown(values)}")
    first, second, third = found.tolist()
    return first, second, third


def _axes(given: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Three perpendicular unit vectors, of one along 1 and one in the plane of 1 and 2."""
    vectors = [np.append(real("axes", v), [0.0] * (3 - len(v))) for v in given]
    if len(vectors) not in (2, 3) or any(v.shape != (3,) for v in vectors):
        raise InvalidInput(
            f"axes: expected a vector along axis 1 and one beside it, got {shown(given)}"
        )
    first, second = vectors[:2]
    third = np.cross(first, second)
    size = np.linalg.norm(first) * np.linalg.norm(second)
    if not np.isfinite(size) or np.linalg.norm(third) <= 1e-9 * size:
        raise InvalidInput(f"axes: expected two vectors that span a plane, got {shown(given)}")
    first, third = first / np.linalg.norm(first), third / np.linalg.norm(third)
    return tuple(tuple(v.tolist()) for v in (first, np.cross(third, first), third))


def _without_stress_across(C: Array) -> Array:
    """C [i, k, j, l] of the plane 1, 2 with stresses 33, 13 and 23 zero."""
    pairs = [*PAIRS[:2], PAIRS[3], PAIRS[2], *PAIRS[4:]]  # 11, 22, 12, and those that vanish
    twice = np.array([1, 1, 2, 1, 2, 2])  # gradients come in both orders
    M = np.array([[C[a, b, c, d] for c, d in pairs] for a, b in pairs]) * twice
    inside = M[:3, :3] - M[:3, 3:] @ np.linalg.solve(M[3:, 3:], M[3:, :3])
    out = np.zeros_like(C)
    for p, (a, b) in enumerate(pairs[:3]):
        for q, (c, d) in enumerate(pairs[:3]):
            for i, k in {(a, b), (b, a)}:
                for j, l in {(c, d), (d, c)}:
                    out[i, k, j, l] = inside[p, q] / twice[q]
    return out
