"""Resultants: a force, and its moment about a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite
from ...core.errors import InvalidInput

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Wrench:
    """force (d,) in global axes, and moment about point (d,): (3,), in 2D (1,) about z.

    In 2D all is per thickness.
    """

    force: Array
    moment: Array
    point: Array

    @classmethod
    def of(cls, arms: Array, forces: Array) -> Wrench:
        """Of forces (k, d) that act at arms (k, d), about the origin."""
        d = arms.shape[1]
        return cls(forces.sum(axis=0), cross(arms, forces).sum(axis=0), np.zeros(d))

    def __add__(self, other: Wrench) -> Wrench:
        same = other.about(self.point)
        return Wrench(self.force + same.force, self.moment + same.moment, self.point)

    def about(self, point: Sequence[float] | Array) -> Wrench:
        """The same forces, their moment about another point (d,); raises InvalidInput."""
        at = finite("point", point, 1)
        if at.shape != self.force.shape:
            raise InvalidInput(
                f"point: expected {len(self.force)} coordinates, got {len(at)}", ("point",)
            )
        arm = (self.point - at)[None]
        return Wrench(self.force, self.moment + cross(arm, self.force[None])[0], at)

    @property
    def record(self) -> dict[str, Any]:
        """Plain data: force, moment, point."""
        return {name: getattr(self, name).tolist() for name in ("force", "moment", "point")}


def cross(arms: Array, forces: Array) -> Array:
    """arms x forces, both (k, d): (k, 3), in 2D the component out of the plane, (k, 1)."""
    if arms.shape[1] == 3:
        return np.cross(arms, forces)
    return (arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0])[:, None]


class Acting:
    """What acts by a `wrench`: its force, and its moment about a point."""

    wrench: Wrench

    @property
    def force(self) -> Array:
        """(d,), global axes; in 2D per thickness."""
        return self.wrench.force

    @property
    def moment(self) -> Array:
        """About `point`, (3,), in 2D (1,) about z."""
        return self.wrench.moment

    @property
    def point(self) -> Array:
        """(d,), the origin unless `about` has moved it."""
        return self.wrench.point

    def about(self, point: Sequence[float]) -> Self:
        """The same with the moment about another point (d,)."""
        return replace(self, wrench=self.wrench.about(point))  # type: ignore[type-var]
