"""Why a list of 3D solutions is complete: regions, each closed by quadratic forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scaled import Scaled
from .multipliers import BoxProof

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DiscBox:
    """A region in which there is no solution but r, (nc, 3), or none at all where r is None.

    r may also be a point where the equations of a pattern hold but a sign of the law does not.

    letters: what every contact may do, . anything, c closed, f free, s stick, l slip with
    u_T / |u_T| at an angle within arcs[:, 1] of arcs[:, 0], rad.  V (nc, 6, 6), in the units of
    the problem: with d = (r', u') - (r, u) of any solution r' in the region d V d <= 0 for
    every contact, and the sum is positive for all d_u = W d_r; without r it is (nc, 7, 7), and
    d = (r', u', 1).
    """

    letters: str
    arcs: Array
    r: Array | None
    V: Array


@dataclass(frozen=True, eq=False)
class DiscProof:
    """Regions that together are everything; anyone can check it with W, q and mu.

    linear: patterns of free and sticking contacts, each a linear system of its own.
    """

    boxes: tuple[DiscBox, ...]
    linear: tuple[str, ...]


def box_of(scaled: Scaled, proof: BoxProof) -> DiscBox:
    """What closed a region, in the units of the problem."""
    nc = len(proof.regions)
    unit = np.repeat(np.hstack([scaled.to_r, scaled.to_u]), scaled.dimension, axis=1)
    if proof.r is None:
        unit = np.hstack([unit, np.ones((nc, 1))])
    V = proof.V / unit[:, :, None] / unit[:, None, :]
    arcs = np.array([(region.middle, region.half) for region in proof.regions])
    letters = "".join(region.letter for region in proof.regions)
    return DiscBox(letters, arcs, None if proof.r is None else proof.r * scaled.to_r, V)
