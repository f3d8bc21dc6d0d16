"""Laws of finite strains that are given point by point, as functions of C = F^T F.

    W = w(C) + U(J),    S = 2 dW/dC,    D = 2 dS/dC,

per volume of the reference configuration.  U is the volume term of hybrid cells.  With
C_ = J^(-2/3) C, whose principal stretches l_i have the product 1,

    Mooney-Rivlin    w = c10 (tr C_ - 3) + c01 (tr cof C_ - 3)
    reduced          w = sum_k c_k (tr C_ - 3)^k, k = 1 .. N; N = 3: Yeoh
    Ogden            w = sum_p 2 shear_p / exponent_p^2 (l_1^e_p + l_2^e_p + l_3^e_p - 3)
    all three        U = bulk / 2 (J - 1)^2
    Saint Venant-Kirchhoff    W = lame_lambda / 2 (tr E)^2 + shear E : E,  2 E = C - I.

Abaqus writes D1 = 2 / bulk.  Equal principal stretches need no care: quotients of differences
of powers are evaluated by log1p and expm1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number, real
from ...core.errors import InvalidInput, InvertedCells
from ...core.words import helpful
from .elasticity import Isotropic, LinearElastic
from .plane_stress import check_plane, is_thin_at, thin_stress
from .point_loops import add_volume_inplace, mooney_rivlin_inplace, ogden_inplace

Array = NDArray[np.float64]
Response = tuple[Array, Array, Array]


class PointLaw(Isotropic):
    """A law that says energy, stress and moduli of any C.

    plane: "strain" or "stress", read in 2D only, see `plane_stress`.
    """

    finite: ClassVar[bool] = True
    plane: str = "strain"

    def respond(self, C: Array) -> Response:
        """w (n,), S (n, 3, 3) and D (n, 3, 3, 3, 3) of C (n, 3, 3), without the volume term."""
        raise NotImplementedError

    def whole(self, C: Array, J: Array, held: Array | None = None) -> Response:
        """The same with the volume term at J (n,), or with a pressure held (n,) instead."""
        W, S, D = self.respond(C)
        if self.volume is None:
            return W, S, D
        if held is None:
            U, slope, bend = self.volume(J)
            W = W + U
        else:
            slope, bend = held, np.zeros_like(held)
        add_volume_inplace(np.linalg.inv(C), J, slope, bend, S, D)
        return W, S, D

    def stress(self, gradient: Array) -> Array:
        """Cauchy stress F S F^T / J (k, 3, 3) of displacement gradients (k, dim, dim).

        Raises InvertedCells where J <= 0.
        """
        if is_thin_at(self, gradient):
            return thin_stress(self, gradient)
        F, J = deformation(gradient)
        return pushed(F, J, self.whole(F.swapaxes(1, 2) @ F, J)[1])

    def shape_stress(self, gradient: Array) -> Array:
        """`stress` without that of the volume term of hybrid cells."""
        F, J = deformation(gradient)
        return pushed(F, J, self.respond(F.swapaxes(1, 2) @ F)[1])

    def moduli(self, dim: int) -> Array:
        """d stress_ik / d gradient_jl at [i, j, k, l] at F = I, unit of stress."""
        D = self.whole(np.eye(3)[None], np.ones(1))[2][0]
        if dim == 2 and self.plane == "stress":
            across = D[:, :, 2, 2]
            D = D - np.einsum("ij,kl->ijkl", across, across / D[2, 2, 2, 2])
        return np.ascontiguousarray(np.einsum("ikjl->ijkl", D[:dim, :dim, :dim, :dim]))

    def shape_moduli(self, dim: int) -> Array:
        """`moduli` without those of the volume term of hybrid cells."""
        D = self.respond(np.eye(3)[None])[2][0]
        return np.ascontiguousarray(np.einsum("ikjl->ijkl", D[:dim, :dim, :dim, :dim]))


def deformation(gradient: Array) -> tuple[Array, Array]:
    """F (k, 3, 3) and J (k,) of gradients (k, dim, dim); raises InvertedCells where J <= 0."""
    dim = gradient.shape[1]
    F = np.tile(np.eye(3), (len(gradient), 1, 1))
    F[:, :dim, :dim] += gradient
    J = np.linalg.det(F)
    check_least(float(J.min(initial=np.inf)))
    return F, J


def check_least(least: float) -> None:
    """Raise InvertedCells where J is not positive (or not a number)."""
    if not least > 0:
        raise InvertedCells(f"cells are inverted: the least det F is {least:.3g}")


def pushed(F: Array, J: Array, S: Array) -> Array:
    """F S F^T / J."""
    return F @ S @ F.swapaxes(1, 2) / J[:, None, None]


def check_density(density: float | None) -> None:
    """Raise InvalidInput for a density that is no mass per volume."""
    if density is not None and not number("density", density) > 0:
        raise InvalidInput(f"density: expected a finite number > 0, got {density!r}")


class _Isochoric(PointLaw):
    """w of C_ alone and U = bulk / 2 (J - 1)^2."""

    bulk: float
    density: float | None

    @property
    def young(self) -> float:  # type: ignore[override]  # follows from what is given
        """Young's modulus at F = I."""
        return 9 * self.bulk * self.shear / (3 * self.bulk + self.shear)

    @property
    def poisson(self) -> float:  # type: ignore[override]
        """Poisson's ratio at F = I."""
        return (3 * self.bulk - 2 * self.shear) / (2 * (3 * self.bulk + self.shear))

    def lame_lambda(self, dim: int = 3) -> float:
        """First Lamé constant at F = I, in 2D that of the plane state; unit of stress."""
        return self.plane_lambda(self.bulk - 2 * self.shear / 3, dim)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U = bulk / 2 (J - 1)^2, U' and U'' of J of any shape."""
        change = J - 1
        return self.bulk / 2 * change**2, self.bulk * change, np.full_like(change, self.bulk)

    def _check(self) -> None:
        if not number("bulk", self.bulk) > 0:
            raise InvalidInput(f"bulk: expected a stress > 0, got {self.bulk!r}")
        if not self.shear > 0:
            raise InvalidInput(
                f"expected constants with a shear modulus > 0 at rest, got {self.shear:g}"
            )
        check_density(self.density)
        check_plane(self.plane)
        if not self.poisson > 0:
            raise InvalidInput(
                f"bulk: expected more than two thirds of the shear modulus {self.shear:g}, "
                f"got {self.bulk:g}"
            )


@helpful
@dataclass(frozen=True)
class MooneyRivlin(_Isochoric):
    """W = c10 (tr C_ - 3) + c01 (tr cof C_ - 3) + bulk / 2 (J - 1)^2, C_ = J^(-2/3) C.

    c10, c01, bulk: unit of stress; the shear modulus at rest is 2 (c10 + c01).  c01 = 0 is the
    neo-Hookean law of Abaqus, with bulk = 2 / D1.  density: mass per volume of the reference
    configuration, read by dynamics only; plane: "strain" or "stress", read in 2D only
    (`plane_stress`); both also in the laws below.
    """

    c10: float
    c01: float
    bulk: float
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        number("c10", self.c10)
        number("c01", self.c01)
        self._check()

    @property
    def shear(self) -> float:
        """Shear modulus at F = I."""
        return 2 * (self.c10 + self.c01)

    def respond(self, C: Array) -> Response:
        """Energy, stress and moduli, see `PointLaw`."""
        W, S, D = _empty(len(C))
        J = np.sqrt(np.linalg.det(C))
        mooney_rivlin_inplace(
            np.ascontiguousarray(C), np.linalg.inv(C), J, float(self.c10), float(self.c01),
            W, S, D,
        )  # fmt: skip
        return W, S, D


@helpful
@dataclass(frozen=True)
class ReducedPolynomial(_Isochoric):
    """W = sum_k coefficients[k] (tr C_ - 3)^(k + 1) + bulk / 2 (J - 1)^2, C_ = J^(-2/3) C.

    coefficients, bulk: unit of stress; the shear modulus at rest is twice the first, > 0.
    Three of them: the law of Yeoh.
    """

    coefficients: Sequence[float]
    bulk: float
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        values = np.atleast_1d(real("coefficients", self.coefficients))
        if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
            raise InvalidInput(
                f"coefficients: expected finite numbers, got {values.tolist()}"
            )
        object.__setattr__(self, "coefficients", tuple(values.tolist()))
        self._check()

    @property
    def shear(self) -> float:
        """Shear modulus at F = I."""
        return 2 * float(self.coefficients[0])

    def respond(self, C: Array) -> Response:
        """Energy, stress and moduli, see `PointLaw`."""
        x, S, D = _empty(len(C))
        J = np.sqrt(np.linalg.det(C))
        mooney_rivlin_inplace(
            np.ascontiguousarray(C), np.linalg.inv(C), J, 1.0, 0.0, x, S, D
        )
        powers = np.polynomial.Polynomial([0.0, *self.coefficients])
        slope, bend = powers.deriv()(x), powers.deriv(2)(x)
        D = slope[:, None, None, None, None] * D
        D += np.einsum("n,nij,nkl->nijkl", bend, S, S)
        return powers(x), slope[:, None, None] * S, D


@helpful
@dataclass(frozen=True)
class Ogden(_Isochoric):
    """W = sum 2 shears / exponents^2 (sum l^exponents - 3) + bulk / 2 (J - 1)^2.

    l: principal stretches times J^(-1/3); shears: unit of stress, their sum is the shear
    modulus at rest; exponents: as many, not zero.  bulk: unit of stress.
    """

    shears: Sequence[float]
    exponents: Sequence[float]
    bulk: float
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        for name in ("shears", "exponents"):
            values = np.atleast_1d(real(name, getattr(self, name)))
            if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
                raise InvalidInput(f"{name}: expected finite numbers, got {values.tolist()}")
            object.__setattr__(self, name, tuple(values.tolist()))
        if len(self.shears) != len(self.exponents):
            raise InvalidInput(
                f"exponents: expected one for each of {len(self.shears)} shears, got "
                f"{len(self.exponents)}"
            )
        if 0 in self.exponents:
            raise InvalidInput(f"exponents: expected none that is zero, got {self.exponents}")
        self._check()

    @property
    def shear(self) -> float:
        """Shear modulus at F = I."""
        return float(sum(self.shears))

    def respond(self, C: Array) -> Response:
        """Energy, stress and moduli, see `PointLaw`."""
        W, S, D = _empty(len(C))
        squares, axes = np.linalg.eigh(C)
        squares = np.maximum(squares, np.finfo(float).tiny)  # of a singular C: J says so
        ogden_inplace(squares, np.ascontiguousarray(axes), np.array(self.shears),
                      np.array(self.exponents), W, S, D)  # fmt: skip
        return W, S, D


@helpful
@dataclass(frozen=True)
class SaintVenantKirchhoff(PointLaw):
    """W = lame_lambda / 2 (tr E)^2 + shear E : E of Green's strain E = (C - I) / 2.

    young, unit of stress, > 0; 0 <= poisson < 0.5.  Linear in E: for large rotations with
    strains of some percent; it gives way under strong compression, where it loses its sense.
    Cells can not be hybrid, since it has no term of the volume alone.
    """

    young: float
    poisson: float
    density: float | None = None
    plane: str = "strain"
    volume: ClassVar[None] = None  # type: ignore[assignment]  # no such term

    def __post_init__(self) -> None:
        LinearElastic(self.young, self.poisson, self.plane, self.density)  # its checks
        if not self.poisson >= 0:
            raise InvalidInput(f"poisson: expected between 0 and 0.5, got {self.poisson!r}")

    def respond(self, C: Array) -> Response:
        """Energy, stress and moduli, see `PointLaw`."""
        eye, lame, shear = np.eye(3), self.lame_lambda(), self.shear
        E = (C - eye) / 2
        trace = np.trace(E, axis1=1, axis2=2)
        S = lame * trace[:, None, None] * eye + 2 * shear * E
        W = lame / 2 * trace**2 + shear * (E * E).sum(axis=(1, 2))
        D = lame * np.einsum("ij,kl->ijkl", eye, eye)
        D += shear * np.einsum("ik,jl->ijkl", eye, eye)
        D += shear * np.einsum("il,jk->ijkl", eye, eye)
        return W, S, np.tile(D, (len(C), 1, 1, 1, 1))


def _empty(n: int) -> Response:
    return np.empty(n), np.empty((n, 3, 3)), np.empty((n, 3, 3, 3, 3))
