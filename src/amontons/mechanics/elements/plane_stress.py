"""Plane stress at finite strains: the thickness that leaves no stress across the plane.

Of C = F^T F the block in the plane is given, C_13 = C_23 = 0, and c = C_33, the square of the
stretch of the thickness, follows at every point from

    S_33(C, c) = 0,    S = 2 dW/dC,                                                         (1)

by Newton's method in ln c, kept between the last c that were too small and too large.  With (1)
W(C) = min_c W(C, c) is an energy of the plane, S its stress, and by implicit differentiation

    D_abcd = D_abcd - D_ab33 D_33cd / D_3333,    D = 2 dS/dC,                               (2)

its moduli, for any law that says W, S and D of a C ([KG]).  The volume may change or hardly,
as the thickness gives way: no cell locks, and none has a pressure of its own.

[KG] S. Klinkel, S. Govindjee, "Using finite strain 3D-material models in beam and shell
elements", Engineering Computations 19 (2002).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, InvertedCells
from .point_loops import add_volume_inplace

Array = NDArray[np.float64]
Response = tuple[Array, Array, Array]
ITERATIONS = 60  # of Newton's method, or of halves between bounds
FARTHEST = 1.0  # change of ln c in a step
SAME = 1e-13  # change of ln c that is none
REACH = 40.0  # |ln c| beyond which there is no thickness
EVEN = 1e-9  # shear stress across the plane, relative to the moduli, that is none


def check_plane(plane: object) -> None:
    """Raise InvalidInput unless it is "strain" or "stress"."""
    if plane not in ("strain", "stress"):
        raise InvalidInput(f'plane: expected "strain" or "stress", got {plane!r}')


@dataclass(frozen=True, eq=False)
class Thin:
    """A law of finite strains in plane stress: that of C in the plane, C_33 is not read."""

    law: Any
    finite: ClassVar[bool] = True
    volume: ClassVar[None] = None
    plane: ClassVar[str] = "stress"

    @property
    def shear(self) -> float:
        """Shear modulus at F = I."""
        return self.law.shear

    def lame_lambda(self, dim: int = 3) -> float:
        """First Lamé constant at F = I, in 2D that of plane stress."""
        return self.law.lame_lambda(dim)

    def moduli(self, dim: int) -> Array:
        """Those of the law at F = I, in 2D of plane stress."""
        return self.law.moduli(dim)

    def respond(self, C: Array) -> Response:
        """W (n,), S (n, 3, 3) and D (n, 3, 3, 3, 3) in the plane, of C (n, 3, 3).

        Raises InvertedCells where no thickness is without stress.
        """
        _, W, S, D = with_thickness(self.law, C)
        across = D[:, :, :, 2, 2]
        share = across / D[:, 2, 2, 2, 2, None, None]
        return W, S, D - np.einsum("nij,nkl->nijkl", across, share)

    def whole(self, C: Array, J: Array, held: Array | None = None) -> Response:
        """The same: all of the law is in it."""
        return self.respond(C)


def with_thickness(law: Any, C: Array) -> tuple[Array, Array, Array, Array]:
    """(c, W, S, D) of (1) at C (n, 3, 3), of a law in all three dimensions."""
    C = np.array(C, dtype=float)
    C[:, :2, 2] = C[:, 2, :2] = 0.0
    plane = np.linalg.det(C[:, :2, :2])
    if not (plane > 0).all():  # flat but for rounding
        raise InvertedCells(f"cells are inverted: the least det C is {plane.min():.3g}")
    stiff, soft = law.lame_lambda() + 2 * law.shear, law.lame_lambda()
    x = -soft / stiff * np.log(plane)  # that of small logarithmic strains
    low, high = np.full(len(x), -REACH), np.full(len(x), REACH)
    x, moved = np.clip(x, -0.5 * REACH, 0.5 * REACH), np.full(len(x), np.inf)
    C[:, 2, 2] = c = np.exp(x)
    with np.errstate(over="ignore", invalid="ignore"):
        W, S, D = _whole(law, C)
        for _ in range(ITERATIONS):
            pull = S[:, 2, 2] * c
            slope = pull + 0.5 * D[:, 2, 2, 2, 2] * c**2
            low, high = np.where(pull < 0, x, low), np.where(pull > 0, x, high)
            rises = slope > 0
            step = -pull / np.where(rises, slope, 1.0)
            goal = x + np.clip(step, -FARTHEST, FARTHEST)
            inside = rises & (goal >= low) & (goal <= high)
            goal = np.where(inside, goal, (low + high) / 2)
            goal = np.where(moved > SAME, goal, x)  # those that are found stay
            moved, x = np.abs(goal - x), goal
            C[:, 2, 2] = c = np.exp(x)
            W, S, D = _whole(law, C)
            if (moved <= SAME).all():
                break
        lost = ~((moved <= SAME) & (D[:, 2, 2, 2, 2] > 0) & (np.abs(x) < 0.9 * REACH))
    if lost.any():
        worst = int(np.argmax(lost))
        raise InvertedCells(
            "plane stress: no thickness is without stress across the plane at C = "
            f"{np.array2string(C[worst, :2, :2], precision=4)}".replace("\n", "")
        )
    return C[:, 2, 2], W, S, D


def _whole(law: Any, C: Array) -> Response:
    """W, S and D with the volume term."""
    W, S, D = law.respond(C)
    if law.volume is None:
        return W, S, D
    J = np.sqrt(np.linalg.det(C))
    U, slope, bend = law.volume(J)
    add_volume_inplace(np.linalg.inv(C), J, slope, bend, S, D)
    return W + U, S, D


def is_thin_at(law: Any, gradient: Array) -> bool:
    """Whether a law is that of plane stress at gradients (k, dim, dim), not around an axis."""
    return gradient.shape[1] == 2 and law.plane == "stress"


def thin_stress(law: Any, gradient: Array) -> Array:
    """Cauchy stress F S F^T / J (k, 3, 3) of gradients (k, 2, 2), zero across the plane."""
    F = np.tile(np.eye(3), (len(gradient), 1, 1))
    F[:, :2, :2] += gradient
    least = float(np.linalg.det(F).min(initial=np.inf))
    if not least > 0:
        raise InvertedCells(f"cells are inverted: the least det F is {least:.3g}")
    c, _, S, _ = with_thickness(law, F.swapaxes(1, 2) @ F)
    F[:, 2, 2] = np.sqrt(c)
    out = F @ S @ F.swapaxes(1, 2) / np.linalg.det(F)[:, None, None]
    out[:, 2] = out[:, :, 2] = 0.0  # but for rounding
    return out


def check_even(law: Any, C: Array) -> None:
    """Raise InvalidInput where strains in the plane, those of C (n, 3, 3), shear across it."""
    C = np.array(C, dtype=float)
    C[:, :2, 2] = C[:, 2, :2] = 0.0
    _, S, D = _whole(law, C)
    if abs(S[:, :2, 2]).max() > EVEN * abs(D).max():
        raise InvalidInput(
            f"{law.name}: plane: strains in the plane x, y give shear stresses across it of "
            f"{abs(S[:, :2, 2]).max():.3g}; plane stress needs a law for which z is an axis"
        )
