"""Pictures of rigid bodies that move far: shaded surfaces, the planes that they stand on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...mechanics.multibody import RigidStep
from ...mechanics.multibody.rows import frames_of
from ...problem.solution import ContactStatus
from ..rigid_bodies import surface_of
from .bodies import MARGIN, STONE
from .camera import Camera
from .layout import Sheet
from .render import Window, render
from .style import Units, status_marks

Array = NDArray[np.float64]
Index = NDArray[np.int64]
GROUND = "#F7F6F3"
SIZE = 7.6, 5.0  # of the picture, inches
PIXELS = 100  # per inch
BEYOND = 0.15  # of the size of all, that planes reach beyond the bodies


def rigid_figures(steps: Sequence[RigidStep], units: Units) -> Iterator[Figure]:
    """One figure per step, all in one view that shows every body in every step."""
    bodies = steps[0].system.bodies
    surfaces = [surface_of(body.shape) for body in bodies]
    first = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    triangles = np.concatenate([f + n for (_, f), n in zip(surfaces, first, strict=False)])
    rest = np.concatenate([points for points, _ in surfaces])
    of = np.repeat(np.arange(len(bodies)), np.diff(first))
    places = [step.position[of] + np.einsum("aij,aj->ai", step.rotation[of], rest)
              for step in steps]  # fmt: skip
    seen = np.concatenate(places)
    ground = _planes(steps[0], seen)
    whole = np.concatenate([seen, *ground])
    camera = Camera.of(whole)
    flat = camera.project(whole)
    low, high = flat.min(axis=0), flat.max(axis=0)
    margin = MARGIN * float(np.linalg.norm(high - low))
    shape = int(SIZE[1] * PIXELS), int(SIZE[0] * PIXELS)
    window = Window.around(low - margin, high + margin, shape)
    quads = len(rest) + np.arange(4 * len(ground)).reshape(-1, 4)
    colour = np.array([to_rgb(STONE[k % len(STONE)]) for k in of])
    colour = 255 * np.concatenate([colour, np.tile(to_rgb(GROUND), (4 * len(ground), 1))])
    for step, points in zip(steps, places, strict=True):
        image = render(camera, np.concatenate([points, *ground]), [triangles, quads], colour,
                       None, window)  # fmt: skip
        met = window.pixels(camera.project(step.meetings.points))
        yield _figure(step, image.colours, met, units)


def _figure(step: RigidStep, pixels: NDArray[np.uint8], met: Array, units: Units) -> Figure:
    """The bodies, and their contacts (nc, 2) in pixels, those behind bodies too."""
    record = step.solution
    stamp = "" if record is None else record.convergence.stamp
    title = f"t = {step.time:.4g} {units.time}".rstrip()
    sheet = Sheet(8.4, 5.6, title=title, note=stamp, rows=1)
    axes = sheet.panel(0.4, 0.05, *SIZE)
    axes.imshow(pixels, origin="lower", interpolation="none")
    axes.autoscale(False)
    axes.set_axis_off()
    labels = {s: f"{s.name.lower()}: {int((step.status == s).sum())}" for s in ContactStatus}
    marks = status_marks(labels)
    for mark, status in zip(marks, ContactStatus, strict=True):
        axes.plot(*(met[step.status == status] - 0.5).T, linestyle="", marker=mark.get_marker(),
                  color=mark.get_color(), markeredgecolor=mark.get_markeredgecolor(),
                  markersize=4, clip_on=False)  # fmt: skip
    sheet.legend(marks, len(marks))
    return sheet.done()


def _planes(step: RigidStep, points: Array) -> list[Array]:
    """Corners (4, 3) of a part of each plane, below all points (n, 3)."""
    out = []
    size = BEYOND * float(np.linalg.norm(np.ptp(points, axis=0)))
    for plane in step.system.planes:
        normal = np.asarray(plane.normal, dtype=float)
        axes = frames_of(normal[None])[0]
        level = np.dot(normal, np.asarray(plane.point, dtype=float))
        flat = points @ axes[1:].T
        (a, b), (c, d) = flat.min(axis=0) - size, flat.max(axis=0) + size
        corners = np.array([(a, b), (c, b), (c, d), (a, d)]) @ axes[1:]
        out.append(corners + level * normal)
    return out
