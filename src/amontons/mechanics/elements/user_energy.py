"""An energy of the user's own, checked against differences when it is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, InvertedCells, shown
from .energies import PointLaw, Response, check_density
from .plane_stress import check_even, check_plane

Array = NDArray[np.float64]
SAMPLES = 12  # deformations at which what is given is compared with differences
STEP = 1e-3  # of the differences, which are of fourth order
AGREE = 1e-6  # relative to the largest component
AT_REST = 1e-8  # stress of the undeformed body, relative to the moduli


@dataclass(frozen=True, eq=False)
class UserEnergy(PointLaw):
    """W(C) + U(J) per volume of the reference configuration, C = F^T F, J = det F.

    energy, stress, moduli: functions of many C at once, (n, 3, 3), that return W (n,),
    S = 2 dW/dC (n, 3, 3) and D = 2 dS/dC = 4 d2W/dC2 (n, 3, 3, 3, 3), in units of stress; S
    symmetric, D with D_ijkl = D_jikl = D_ijlk = D_klij.  Compiled functions (numba, JAX, C) as
    well as NumPy's; plain functions of a module, if models are to be sent to other processes.
    volume: of J (n,), returns U, dU/dJ and d2U/dJ2, each (n,); cells are then hybrid where the
    law is nearly incompressible at rest.  A C is never turned, so no energy can depend on the
    frame; it need not be isotropic.  density: mass per volume, read by dynamics only; plane:
    "strain" or "stress", read in 2D only (`plane_stress`).

    Raises InvalidInput where shapes, symmetries or derivatives are wrong, which is tried at
    some deformations with stretches of 0.7 to 1.4, or where the body is stressed at rest.  What
    is not a number at a deformation counts as cells that can not be there: steps are cut, and
    the last good state is kept.
    """

    energy: Callable[[Array], Any]
    stress_of: Callable[[Array], Any]
    moduli_of: Callable[[Array], Any]
    volume_of: Callable[[Array], Any] | None = None
    name: str = "user's energy"
    density: float | None = None
    plane: str = "strain"

    def __post_init__(self) -> None:
        for field in ("energy", "stress_of", "moduli_of", "volume_of"):
            given = getattr(self, field)
            if not (callable(given) or field == "volume_of" and given is None):
                raise InvalidInput(f"{field}: expected a function, got {shown(given)}")
        if self.volume_of is None:
            object.__setattr__(self, "volume", None)
        check_density(self.density)
        check_plane(self.plane)
        self._check()
        D = self.whole(np.eye(3)[None], np.ones(1))[2][0]
        bulk = float(np.einsum("iijj->", D)) / 9
        shear = (float(np.einsum("ijij->", D)) - 3 * bulk) / 10
        self._put(bulk, shear)
        if self.plane == "stress":
            check_even(self, _samples())

    def _put(self, bulk: float, shear: float) -> None:
        """Constants at rest, the mean over all directions; InvalidInput where not positive."""
        for what, value in (("bulk modulus", bulk), ("shear modulus", shear)):
            if not value > 0:
                raise InvalidInput(
                    f"{self.name}: moduli: the {what} at rest is {value:g}, expected one > 0"
                )
        object.__setattr__(self, "young", 9 * bulk * shear / (3 * bulk + shear))
        object.__setattr__(self, "poisson", (3 * bulk - 2 * shear) / (6 * bulk + 2 * shear))

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U, U' and U'' of J > 0 of any shape."""
        assert self.volume_of is not None
        flat = np.ascontiguousarray(J, dtype=float).ravel()
        with np.errstate(all="ignore"):
            found = tuple(self.volume_of(flat.copy()))  # may write into what it gets
        if len(found) != 3:
            raise InvalidInput(f"{self.name}: volume: expected U, U' and U'', got {len(found)}")
        U, slope, bend = (
            self._shaped("volume", value, flat.shape, flat) for value in found
        )
        return U.reshape(J.shape), slope.reshape(J.shape), bend.reshape(J.shape)

    def respond(self, C: Array) -> Response:
        """Energy, stress and moduli; raises InvertedCells where one is not a number."""
        C = np.ascontiguousarray(C, dtype=float)
        n = len(C)
        with np.errstate(all="ignore"):
            asked = self.energy, self.stress_of, self.moduli_of
            found = tuple(each(C.copy()) for each in asked)  # may write into what it gets
        shapes = (n,), (n, 3, 3), (n, 3, 3, 3, 3)
        names = "energy", "stress", "moduli"
        W, S, D = (
            self._shaped(name, value, shape, C)
            for name, value, shape in zip(names, found, shapes, strict=True)
        )
        return W, S, D

    def _shaped(self, what: str, value: Any, shape: tuple[int, ...], at: Array) -> Array:
        """A copy of what a function returned, of this shape and finite."""
        try:
            out = np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise InvalidInput(
                f"{self.name}: {what}: expected an array of shape {shape}, got {shown(value)}"
            ) from None
        if out.shape != shape:
            raise InvalidInput(
                f"{self.name}: {what}: expected shape {shape}, got {out.shape}"
            )
        wrong = ~np.isfinite(out.reshape(len(out), -1)).all(axis=1)
        if wrong.any():
            where = np.array2string(at[int(np.argmax(wrong))], precision=4).replace("\n", "")
            letter = "C" if at.ndim == 3 else "J"
            raise InvertedCells(
                f"{self.name}: {what} is not a finite number at {letter} = {where}"
            )
        return out

    # ---------------------------------------------------------------- checks
    def _check(self) -> None:
        C = _samples()
        try:
            W, S, D = self.respond(C)
        except InvertedCells as reason:
            raise InvalidInput(str(reason)) from None
        self._symmetric("stress", S, "ij -> ji", S.swapaxes(1, 2))
        for way, other in (("ijkl -> jikl", (0, 2, 1, 3, 4)), ("ijkl -> ijlk", (0, 1, 2, 4, 3)),
                           ("ijkl -> klij", (0, 3, 4, 1, 2))):  # fmt: skip
            self._symmetric("moduli", D, way, D.transpose(other))
        for i in range(3):
            for j in range(i, 3):
                way = np.zeros((3, 3))
                way[i, j] += 0.5
                way[j, i] += 0.5

                def along(s: float, at: int, way: Array = way) -> Array:
                    return self.respond(C + s * way)[at]

                self._agree("stress", S[:, i, j], 2 * _slope(lambda s: along(s, 0)),
                            f"2 d(energy)/dC at ({i}, {j})", abs(S).max())  # fmt: skip
                self._agree("moduli", D[:, :, :, i, j], 2 * _slope(lambda s: along(s, 1)),
                            f"2 d(stress)/dC at (:, :, {i}, {j})", abs(D).max())  # fmt: skip
        if self.volume_of is not None:
            self._check_volume()
        rest = self.whole(np.eye(3)[None], np.ones(1))
        size = float(abs(rest[2]).max())
        if not abs(rest[1]).max() <= AT_REST * size:
            raise InvalidInput(
                f"{self.name}: stress: the undeformed body has a stress of "
                f"{abs(rest[1]).max():.3g}, expected none"
            )

    def _check_volume(self) -> None:
        J = np.linspace(0.7, 1.4, SAMPLES)
        try:
            _, slope, bend = self.volume(J)
            first, second = (_slope(lambda s, k=k: self.volume(J + s)[k]) for k in (0, 1))
        except InvertedCells as reason:
            raise InvalidInput(str(reason)) from None
        self._agree("volume", slope, first, "the derivative of U", abs(slope).max())
        self._agree("volume", bend, second, "the derivative of U'", abs(bend).max())

    def _symmetric(self, what: str, value: Array, words: str, other: Array) -> None:
        if not abs(value - other).max() <= AGREE * abs(value).max():
            raise InvalidInput(f"{self.name}: {what}: expected them symmetric ({words})")

    def _agree(self, what: str, value: Array, other: Array, words: str, size: float) -> None:
        apart = abs(value - other).reshape(len(value), -1).max(axis=1)
        worst = int(apart.argmax())
        if not apart[worst] <= AGREE * max(size, np.finfo(float).tiny):
            raise InvalidInput(
                f"{self.name}: {what}: differs from {words} by {apart[worst]:.3g} where the "
                f"largest is {size:.3g} (sample {worst} of {len(value)})"
            )


def _samples() -> Array:
    """Some C (n, 3, 3), the first with three equal stretches and the next with two."""
    rng = np.random.default_rng(7)
    stretches = rng.uniform(0.7, 1.4, (SAMPLES, 3))
    stretches[0] = 1.1
    stretches[1, 1] = stretches[1, 0]
    axes = np.linalg.qr(rng.normal(size=(SAMPLES, 3, 3)))[0]
    return np.einsum("nij,nj,nkj->nik", axes, stretches**2, axes)


def _slope(function: Callable[[float], Array]) -> Array:
    """Derivative at 0, by differences of fourth order."""
    first, second = (function(h) - function(-h) for h in (STEP, 2 * STEP))
    return (8 * first - second) / (12 * STEP)
