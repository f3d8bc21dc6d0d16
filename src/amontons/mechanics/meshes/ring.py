"""Structured rings: hexahedra in polar coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import real
from ...core.errors import InvalidInput
from ...core.words import helpful
from .box import box
from .facets import Cells, Facets
from .mesh import Mesh

Array = NDArray[np.float64]
AROUND = 2 * np.pi
NAMES = {"left": "inner", "right": "outer", "front": "start", "back": "end",
         "bottom": "bottom", "top": "top"}  # fmt: skip


@helpful
def ring(radii: Sequence[float], angles: Sequence[float], heights: Sequence[float]) -> Mesh:
    """A disc, a tube, or a sector of one, around the z axis, of hexahedra.

    radii > 0, angles (radians, from x towards y), heights (z): where nodes are, growing.
    Angles that go once around close the ring: its two ends are then one.  Surfaces inner,
    outer, bottom, top, of a sector start and end (the first and last angle).  Region
    "default".  Sides are straight from node to node.

    >>> ring([1, 2], [0, 2, 4, 6.283185307179586], [0, 1]).points.shape
    (12, 3)
    """
    r, turns, z = (
        _growing(name, values)
        for name, values in (("radii", radii), ("angles", angles), ("heights", heights))
    )
    if r[0] <= 0:
        raise InvalidInput(f"radii: expected lengths > 0, got {r[0]:g}; a ring has a hole")
    whole = turns[-1] - turns[0]
    closed = bool(np.isclose(whole, AROUND, rtol=1e-12, atol=0.0))
    if whole > AROUND and not closed:
        raise InvalidInput(f"angles: expected at most 2 pi from first to last, got {whole:g}")
    if np.diff(turns).max() >= np.pi:
        raise InvalidInput("angles: expected steps below pi, of radians; take more cells")
    grid = box((1, 1, 1), (len(r) - 1, len(turns) - 1, len(z) - 1))
    number = np.arange(len(grid.points)).reshape(len(z), len(turns), len(r))  # r runs fastest
    if closed:  # the last angle is the first one
        number = np.arange(number[:, 1:].size).reshape(len(z), -1, len(r))
        number = np.concatenate([number, number[:, :1]], axis=1)
        turns = turns[:-1]
    number = number.ravel()
    height, angle, radius = (a.ravel() for a in np.meshgrid(z, turns, r, indexing="ij"))
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    surfaces = {
        NAMES[name]: tuple(Facets(f.kind, number[f.nodes]) for f in facets)
        for name, facets in grid.surfaces.items()
        if not closed or NAMES[name] not in ("start", "end")
    }
    cells = tuple(Cells(c.kind, number[c.nodes]) for c in grid.cells)
    return Mesh(points, cells, surfaces)


def _growing(name: str, values: Sequence[float]) -> Array:
    out = real(name, values)
    if out.ndim != 1 or len(out) < 2 or not np.isfinite(out).all() or (np.diff(out) <= 0).any():
        raise InvalidInput(f"{name}: expected at least two growing numbers, got {values!r}")
    return out
