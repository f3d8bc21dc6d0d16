"""Bodies that do not deform."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.arrays import number
from ...core.errors import InvalidInput


@dataclass(frozen=True)
class Rigid:
    """A body that moves as a whole: 6 unknowns in 3D, 3 in 2D, small rotations.

    density: mass per volume (per area in 2D), read by dynamics only.
    """

    density: float | None = None

    def __post_init__(self) -> None:
        if self.density is not None and not number("density", self.density) > 0:
            raise InvalidInput(f"density: expected a finite number > 0, got {self.density!r}")
