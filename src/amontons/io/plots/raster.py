"""Hidden surfaces: which facet is seen at every pixel, by a depth buffer in numpy.

All pixels in the box around a triangle are tried at once, for all triangles of about one size
together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Covered = tuple[Any, ...]  # arrays: pixels, triangles, nearest corners, depths
AT_ONCE = 1 << 19  # pixels tried together
SIZES = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768])
LEVELS = 65535  # steps of depth that are told apart: 16 bits sort fast


@dataclass(frozen=True, eq=False)
class Seen:
    """What is in front at every pixel: rows upwards, columns to the right, -1 where nothing is.

    triangle, corner (height, width): the triangle, and which of its corners is nearest;
    depth (height, width): growing towards the viewer, -inf where nothing is.
    """

    triangle: NDArray[np.int32]
    corner: NDArray[np.int8]
    depth: NDArray[np.float32]


def seen(triangles: Array, shape: tuple[int, int]) -> Seen:
    """The front triangles of (k, 3, 3): column and row in pixels, depth towards the viewer.

    shape: height and width in pixels; what lies outside is cut off.
    """
    height, width = shape
    parts = [part for part in _tried(triangles.astype(np.float32), shape) if len(part[0])]
    owner = np.full(height * width, -1, dtype=np.int32)
    corner = np.zeros(height * width, dtype=np.int8)
    front = np.full(height * width, -np.inf, dtype=np.float32)
    if parts:
        pixel, triangle, nearest, depth = map(np.concatenate, zip(*parts, strict=True))
        low, high = float(depth.min()), float(depth.max())
        steps = (depth - low) * (LEVELS / max(high - low, 1e-30))
        order = np.argsort(steps.astype(np.uint16), kind="stable")
        place = pixel[order]  # where one occurs again the last one, in front, stays
        owner[place], corner[place] = triangle[order], nearest[order]
        front[place] = depth[order]
    return Seen(owner.reshape(shape), corner.reshape(shape), front.reshape(shape))


def _tried(triangles: NDArray[np.float32], shape: tuple[int, int]) -> Iterator[Covered]:
    """Pixels, triangles, nearest corners and depths of what covers a pixel, in chunks."""
    low = np.floor(triangles[:, :, :2].min(axis=1)).astype(np.int32)
    size = np.ceil(triangles[:, :, :2].max(axis=1)).astype(np.int32) - low
    step = np.searchsorted(SIZES, np.clip(size, 1, SIZES[-1]))
    for wide, tall in np.unique(step, axis=0):
        group = np.flatnonzero((step == (wide, tall)).all(axis=1))
        across, up = int(SIZES[wide]), int(SIZES[tall])
        if max(wide, tall) == len(SIZES) - 1:  # as large as they are
            across, up = (int(x) for x in size[group].max(axis=0))
        many = max(1, AT_ONCE // (across * up))
        for first in range(0, len(group), many):
            yield _covered(triangles, group[first : first + many], low, (across, up), shape)


def _covered(
    triangles: NDArray[np.float32], group: Index, low: NDArray[np.int32], box: tuple[int, int],
    shape: tuple[int, int],
) -> Covered:  # fmt: skip
    """What a few triangles of about one size cover, see `_tried`."""
    across, up = box
    a, b, c = (triangles[group, k] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0)
    x = np.arange(across, dtype=np.float32) + 0.5
    y = np.arange(up, dtype=np.float32) + 0.5
    dx, dy = (low[group, k] - a[:, k] for k in (0, 1))

    def share(ex: NDArray[Any], ey: NDArray[Any]) -> NDArray[Any]:
        """One barycentric coordinate at all pixels of the boxes, (k, up, across)."""
        along = (dx[:, None] + x) * (ey * inverse)[:, None]
        across_ = (dy[:, None] + y) * (ex * inverse)[:, None]
        return along[:, None, :] - across_[:, :, None]

    second = share(c[:, 0] - a[:, 0], c[:, 1] - a[:, 1])
    third = -share(b[:, 0] - a[:, 0], b[:, 1] - a[:, 1])
    inside = (second >= 0) & (third >= 0) & (second + third <= 1)
    inside &= (area != 0)[:, None, None]
    k, row, column = np.nonzero(inside)
    two, three = second[inside], third[inside]
    column = column + low[group[k], 0]
    row = row + low[group[k], 1]
    kept = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    if not kept.all():
        k, row, column, two, three = (v[kept] for v in (k, row, column, two, three))
    one = 1 - two - three
    nearest = np.where(one >= np.maximum(two, three), 0, np.where(two >= three, 1, 2))
    depth = a[k, 2] * one + b[k, 2] * two + c[k, 2] * three
    return row * shape[1] + column, group[k].astype(np.int32), nearest.astype(np.int8), depth
