"""Bodies in 3D as an image: hidden surfaces right, shaded, with outlines and mesh lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .raster import Seen, seen

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FINER = 2  # pixels of the buffer per pixel of the picture, each way; `render` counts on two
DARK = 0.7  # shade of what looks away from the light; 1 towards it
CREASE = 0.8  # cosine between normals below which facets meet in an edge that is drawn
STEP = 0.02  # jump of depth, relative to the picture, that counts as an outline
ROOM = 9.0  # pixels of the buffer across a facet from which mesh lines are drawn
OUTLINE, MESH = 90, 220  # how dark lines are: the colour below, of 256 parts
WHITE = 255


@dataclass(frozen=True, eq=False)
class Window:
    """The part of the plane of the picture that an image shows, and its size in pixels."""

    left: float
    right: float
    low: float
    high: float
    shape: tuple[int, int]  # height, width

    @classmethod
    def around(cls, low: Array, high: Array, shape: tuple[int, int]) -> Window:
        """The smallest one of that shape around a box, everything to one scale."""
        height, width = shape
        middle, size = (low + high) / 2, np.maximum(high - low, 1e-300)
        unit = max(size[0] / width, size[1] / height)
        x, y = unit * width / 2, unit * height / 2
        return cls(middle[0] - x, middle[0] + x, middle[1] - y, middle[1] + y, shape)

    @property
    def pixel(self) -> float:
        """Unit of length per pixel."""
        return (self.right - self.left) / self.shape[1]

    def pixels(self, points: Array) -> Array:
        """Column and row of points (..., 2) in the plane."""
        return (points - np.array([self.left, self.low])) / self.pixel


@dataclass(frozen=True, eq=False)
class Image:
    """An RGB image, rows upwards, and what it shows at every pixel of its buffer."""

    colours: NDArray[np.uint8]
    fine: NDArray[np.uint8]  # as the buffer has it
    front: Seen
    window: Window  # of the buffer
    triangles: Index  # (k, 3) nodes

    def visible(self, points: Array, depth: Array) -> NDArray[np.bool_]:
        """Points (k, 2) of the plane that nothing hides, at given depths (k,)."""
        column, row = np.floor(self.window.pixels(points)).astype(np.int64).T
        height, width = self.window.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        front = self.front.depth[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        return inside & (depth >= front - 4 * self.window.pixel)


def render(
    camera: Camera, points: Array, sides: list[Index], colour: Array, painted: Array | None,
    window: Window,
) -> Image:  # fmt: skip
    """The surfaces of points (n, 3), given by tables of nodes outwards.

    colour (n, 3): of a body at its nodes, 0 to 255; painted (n, 3): instead of it where all
    corners of a facet have one, NaN elsewhere.
    """
    triangles = np.concatenate([_cut(table) for table in sides])
    fine = Window(window.left, window.right, window.low, window.high,
                  (FINER * window.shape[0], FINER * window.shape[1]))  # fmt: skip
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = camera.depth(normal) > 0
    triangles, corners, normal = triangles[front], corners[front], normal[front]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    flat = np.concatenate(
        [fine.pixels(camera.project(corners)), camera.depth(corners)[..., None]], axis=2
    )
    found = seen(flat, fine.shape)
    pixels = _coloured(camera, found, triangles, normal, colour, painted)
    _draw_lines(pixels, found, normal, flat, fine)
    wide = pixels.astype(np.uint16)
    rows = wide[::FINER] + wide[1::FINER]  # means of four pixels, that edges become smooth
    small = (rows[:, ::FINER] + rows[:, 1::FINER]) // FINER**2
    return Image(small.astype(np.uint8), pixels, found, fine, triangles)


def _cut(table: Index) -> Index:
    """Facets as triangles; of a quadrilateral two in a row."""
    if table.shape[1] == 3:
        return table
    return table[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def _coloured(
    camera: Camera, found: Seen, triangles: Index, normal: Array, colour: Array,
    painted: Array | None,
) -> NDArray[np.uint8]:  # fmt: skip
    """Shaded colours of all pixels, white where there is nothing."""
    assert camera.toward is not None
    light = 0.7 * camera.toward + 0.6 * camera.plane[1] - 0.35 * camera.plane[0]
    light /= np.linalg.norm(light)
    shade = DARK + (1 - DARK) * np.clip(normal @ light, 0, 1)
    tables = np.repeat(colour[triangles[:, 0]][:, None], 3, axis=1)  # (k, 3 corners, 3)
    if painted is not None:
        own = painted[triangles]
        told = np.isfinite(own).all(axis=(1, 2))
        tables[told] = own[told]
    tables = (tables * shade[:, None, None]).astype(np.uint8).reshape(-1, 3)
    tables = np.concatenate([tables, np.full((1, 3), WHITE, dtype=np.uint8)])  # the last: none
    entry = 3 * found.triangle + found.corner  # -3 where there is nothing
    entry[entry < 0] = len(tables) - 1
    return np.take(tables, entry, axis=0)


def _draw_lines(
    pixels: NDArray[np.uint8], found: Seen, normal: Array, flat: Array, window: Window
) -> None:
    """Darken the pixels at outlines and edges, and between the facets of coarse meshes."""
    owner = found.triangle
    if not (owner >= 0).any():
        return
    facing = normal.astype(np.float32)
    jump = STEP * max(window.right - window.left, window.high - window.low)
    coarse = float(np.sqrt(np.median(_areas(flat)))) > ROOM
    for axis in (0, 1):
        near, far = (slice(None, -1), slice(1, None))
        first = (near, slice(None)) if axis == 0 else (slice(None), near)
        second = (far, slice(None)) if axis == 0 else (slice(None), far)
        row, column = np.nonzero(owner[first] != owner[second])
        other = (row + 1, column) if axis == 0 else (row, column + 1)
        a, b = owner[row, column], owner[other]
        edge = (a < 0) | (b < 0)
        cosine = np.einsum("ij,ij->i", facing[np.maximum(a, 0)], facing[np.maximum(b, 0)])
        with np.errstate(invalid="ignore"):
            apart = np.abs(found.depth[row, column] - found.depth[other]) > jump
        edge |= (cosine < CREASE) | apart
        _darken(pixels, row[edge], column[edge], OUTLINE)
        if coarse:
            mesh = ~edge & (a // 2 != b // 2)
            _darken(pixels, row[mesh], column[mesh], MESH)


def _areas(flat: Array) -> Array:
    """Areas of triangles in pixels."""
    one, two = flat[:, 1, :2] - flat[:, 0, :2], flat[:, 2, :2] - flat[:, 0, :2]
    return np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def _darken(pixels: NDArray[np.uint8], row: Index, column: Index, parts: int) -> None:
    pixels[row, column] = pixels[row, column].astype(np.uint16) * parts // 256
