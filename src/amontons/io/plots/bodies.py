"""Deformed bodies on a panel: cells in 2D, shaded surfaces in 3D, joints by their status."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from ...problem.solution import ContactStatus
from .render import Image, Window, render
from .scene import Scene
from .style import COLOURS, INK, round_below

Array = NDArray[np.float64]
STONE, EDGE = ("#EFE8DC", "#D9E6EE", "#E6DCEC", "#DDEAD7", "#F3E1D0"), "#B9B2A6"
JOINTS = {ContactStatus.OPEN: "#CC79A7", ContactStatus.SLIP: COLOURS[ContactStatus.SLIP],
          ContactStatus.STICK: COLOURS[ContactStatus.STICK]}  # fmt: skip
WIDTHS = {ContactStatus.OPEN: 3.6, ContactStatus.SLIP: 2.6,
          ContactStatus.STICK: 1.3}  # fmt: skip  # points: told apart without colour too
MANY_CELLS = 1500  # in 2D, above which their sides are not drawn
MARGIN = 0.04  # around the bodies, relative to the picture
TRIAD = 0.07  # length of the axes in the corner, relative to the picture


class _Picture(AxesImage):
    """An image that vector formats get in the resolution of its buffer."""

    fine: NDArray[np.uint8]

    def draw(self, renderer: Any) -> None:
        """Draw it; pixels of the screen take the smoothed one as it is."""
        if not isinstance(renderer, RendererAgg):
            self.set_data(self.fine)
        super().draw(renderer)


def draw_bodies(
    axes: Axes, scene: Scene, moved: Array, status: NDArray[np.int8] | None = None,
    *, room: float = 0.0, joints: Mapping[ContactStatus, str] = COLOURS,
    length: str = "", tints: Array | None = None,
) -> Image | None:  # fmt: skip
    """The bodies with their nodes where they have moved to, (nodes, dim).

    status (nc,): of the contacts, which colours slave surfaces and joints, these by their own
    colours; room: for what other pictures of a series need around the bodies at rest; length:
    its unit; tints (nodes, 3): colours at the nodes, 0 to 1, instead of those of bodies and
    slave surfaces.  In 3D the panel has no axes but a triad and a scale; the image is returned.
    """
    image = None
    if scene.camera.toward is None:
        _draw_cells(axes, scene, moved, tints)
    else:
        painted = status if tints is None else None
        image = _draw_surfaces(axes, scene, moved, painted, room, tints)
        _draw_triad(axes, scene, image.window, length)
    if status is not None:
        _draw_joints(axes, scene, moved, status, joints, image)
    if image is None:
        low, high = _box(scene, moved, room)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return image


def _box(scene: Scene, moved: Array, room: float) -> tuple[Array, Array]:
    """Corners of what has to be seen: the bodies at rest with room, and where they moved to."""
    rest = scene.camera.project(scene.points)
    low, high = rest.min(axis=0) - room, rest.max(axis=0) + room
    if not room:
        now = scene.camera.project(moved)
        low, high = np.minimum(low, now.min(axis=0)), np.maximum(high, now.max(axis=0))
    margin = MARGIN * float(np.linalg.norm(high - low))
    return low - margin, high + margin


def _draw_cells(axes: Axes, scene: Scene, moved: Array, tints: Array | None) -> None:
    """Cells in the colour of their body, or in the mean one of their nodes."""
    many = sum(len(nodes) for nodes in scene.sides) > MANY_CELLS
    outline: Any = moved[scene.outline]
    for nodes in scene.sides:
        colour = STONE[int(scene.body_of[nodes[0, 0]]) % len(STONE)]
        faces: Any = colour if tints is None else tints[nodes].mean(axis=1)
        edges = {"edgecolors": faces if many else EDGE, "linewidths": 0.4}
        cells: Any = moved[nodes]
        axes.add_collection(PolyCollection(cells, facecolors=faces, **edges), autolim=False)
    axes.add_collection(LineCollection(outline, colors=INK, linewidths=0.7), autolim=False)


def _draw_surfaces(
    axes: Axes, scene: Scene, moved: Array, status: NDArray[np.int8] | None, room: float,
    tints: Array | None,
) -> Image:  # fmt: skip
    """The image of the surfaces, to one scale; it fills the panel."""
    place = axes.get_window_extent()
    shape = (max(int(round(place.height)), 2), max(int(round(place.width)), 2))
    low, high = _box(scene, moved, room)
    low[1] -= 1.5 * TRIAD * (high[1] - low[1])  # for the triad
    window = Window.around(low, high, shape)
    stones = np.array([to_rgb(colour) for colour in STONE])
    if tints is None:
        tints = stones[scene.body_of % len(STONE)]
    painted = None
    if status is not None:
        chosen = 255 * np.array([to_rgb(COLOURS[s]) for s in ContactStatus])
        painted = np.full((len(moved), 3), np.nan)
        has = scene.contact_of >= 0
        painted[has] = chosen[status[scene.contact_of[has]]]
    image = render(scene.camera, moved, scene.sides, 255 * tints, painted, window)
    limits = (window.left, window.right, window.low, window.high)
    shown = _Picture(axes, extent=limits, origin="lower", interpolation="none")
    shown.set_data(image.colours)
    shown.fine = image.fine
    axes.add_image(shown)
    axes.set(xlim=limits[:2], ylim=limits[2:])
    axes.set_axis_off()
    return image


def _draw_triad(axes: Axes, scene: Scene, window: Window, unit: str) -> None:
    """The global axes and a length, in the lower corners."""
    size = min(window.right - window.left, window.high - window.low)
    origin = np.array([window.left + 0.06 * size, window.low + 0.06 * size])
    tips = origin + TRIAD * size * scene.camera.plane.T
    axes.add_collection(
        LineCollection([np.stack([origin, tip]) for tip in tips], colors=INK, linewidths=1.0),
        autolim=False,
    )
    for name, tip in zip("xyz", origin + 1.5 * (tips - origin), strict=True):
        axes.text(*tip, name, ha="center", va="center", fontsize=8, color=INK)
    length = round_below(0.3 * (window.right - window.left))
    right, low = window.right - 0.04 * size, window.low + 0.06 * size
    axes.plot([right - length, right], [low, low], color=INK, linewidth=1.2)
    axes.text(right - length / 2, low + 0.015 * size, f"{length:g} {unit}".rstrip(),
              ha="center", va="bottom", fontsize=8, color=INK)  # fmt: skip


def _draw_joints(
    axes: Axes, scene: Scene, moved: Array, status: NDArray[np.int8],
    colours: Mapping[ContactStatus, str], image: Image | None,
) -> None:  # fmt: skip
    """Half an edge for each of its two contacts; open ones last, so that cracks show."""
    flat, depth = scene.camera.project(moved), scene.camera.depth(moved)
    halves: dict[int, list[Array]] = {int(s): [] for s in ContactStatus}
    for edges, contacts in scene.joints:
        ends, far = flat[edges], depth[edges]
        for side in (0, 1):
            half = np.stack([ends[:, side], ends.mean(axis=1)], axis=1)
            shown = np.ones(len(half), dtype=bool)
            if image is not None:
                deep = 0.75 * far[:, side] + 0.25 * far[:, 1 - side]
                shown = image.visible(half.mean(axis=1), deep)
            own = status[contacts[:, side]]
            for s in ContactStatus:
                halves[int(s)].extend(half[shown & (own == s)])
    for s in (ContactStatus.STICK, ContactStatus.SLIP, ContactStatus.OPEN):
        axes.add_collection(
            LineCollection(halves[int(s)], colors=colours[s], linewidths=WIDTHS[s],
                           capstyle="round"), autolim=False,
        )  # fmt: skip
