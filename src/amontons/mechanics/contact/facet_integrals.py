"""Integrals over what two facets share where they are now, with exact derivatives.

The master facet is projected along the normal of the slave facet onto it ([PL]); with phi, N
the shape functions of both and the integrals over the part they share, on the slave facet,

    mass_rt = int phi_r phi_t,    cross_rb = int phi_r N_b.                                (1)

They depend on the nodes of the two facets alone.  Derivatives are those of a complex step:
the real parts decide where parts end, imaginary ones of 1e-100 carry the derivative through,
exact to rounding as nothing is subtracted.

[PL] M. Puso, T. Laursen, "A mortar segment-to-segment contact method for large deformation
solid mechanics", Comput. Methods Appl. Mech. Engrg. 193 (2004) 601-629.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .plane_integrals import plane_integrals, rule

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Values = NDArray[Any]  # real, or complex in the search for derivatives
STEP = 1e-100
BESIDE = 0.5 / np.sqrt(3.0)
GAUSS = ((0.5 - BESIDE, 0.5), (0.5 + BESIDE, 0.5))  # exact, as (1) is quadratic


def line_integrals(slave: Values, master: Values) -> tuple[Values, Values]:
    """(1) of lines with ends (..., 2, 2): mass and cross, each (..., 2, 2)."""
    edge = slave[..., 1, :] - slave[..., 0, :]
    square = (edge * edge).sum(axis=-1)
    from_start = master - slave[..., :1, :]
    ends = (from_start * edge[..., None, :]).sum(axis=-1) / square[..., None]
    first, second = ends[..., 0], ends[..., 1]
    swapped = first.real > second.real
    low, high = np.where(swapped, second, first), np.where(swapped, first, second)
    low = np.where(low.real > 0, np.where(low.real < 1, low, 1), 0)
    high = np.where(high.real < 1, np.where(high.real > 0, high, 0), 1)
    across = np.where(first.real == second.real, 1, second - first)
    length = np.sqrt(square) * (high - low)
    mass = np.zeros(slave.shape, dtype=slave.dtype)
    cross = np.zeros(slave.shape, dtype=slave.dtype)
    for place, weight in GAUSS:
        at = low + place * (high - low)
        opposite = (at - first) / across
        phi = np.stack([1 - at, at], axis=-1)
        shape = np.stack([1 - opposite, opposite], axis=-1)
        area = (weight * length)[..., None, None]
        mass += area * phi[..., :, None] * phi[..., None, :]
        cross += area * phi[..., :, None] * shape[..., None, :]
    return mass, cross


@dataclass(frozen=True, eq=False)
class FacetPairs:
    """k pairs of facets: nodes at slave (k, a, d), master (k, b, d), padded by the last.

    corners, facing (k,): how many of them are real.
    """

    slave: Array
    corners: Index
    master: Array
    facing: Index

    def integrals(self) -> tuple[Array, Array]:
        """mass (k, a, a) and cross (k, a, b)."""
        if self.slave.shape[2] == 2:
            return line_integrals(self.slave, self.master)
        mass, cross = self._in_space(1, 0.0)
        return mass[:, 0], cross[:, 0]

    def slopes(self) -> tuple[Array, Array]:
        """Their derivatives by all nodes, (k, a, a, (a + b) d) and (k, a, b, (a + b) d)."""
        (k, a, d), b = self.slave.shape, self.master.shape[1]
        ways = (a + b) * d
        if d == 3:
            mass, cross = self._in_space(ways, STEP)
            return np.moveaxis(mass, 1, -1), np.moveaxis(cross, 1, -1)
        both = np.concatenate([self.slave, self.master], axis=1).reshape(k, ways)
        moved = both[:, None, :] + 1j * STEP * np.eye(ways)
        moved = moved.reshape(k, ways, a + b, d)
        found = line_integrals(moved[:, :, :a], moved[:, :, a:])
        mass, cross = (np.moveaxis(part.imag, 1, -1) / STEP for part in found)
        return mass, cross

    def _in_space(self, ways: int, step: float) -> tuple[Array, Array]:
        (k, a, _), b = self.slave.shape, self.master.shape[1]
        mass, cross = np.zeros((k, ways, a, a)), np.zeros((k, ways, a, b))
        plane_integrals(self.slave, self.corners, self.master, self.facing, rule(), step,
                        mass, cross)  # fmt: skip
        return mass, cross
