"""Figures of the steps of an evolution: deformed bodies with their joints, and a film of them.

Displacements are magnified, the same in all pictures of a film.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from PIL import Image  # comes with matplotlib

from ...core.errors import InvalidInput
from ...core.files import made, write_bytes
from ...mechanics.model import Model
from ...problem.solution import ContactStatus
from .saving import save_figure
from .scene import Frame, Scene, magnification, room_needed
from .style import UNKNOWN, Units, stamp, stamp_panel

Array = NDArray[np.float64]
STONE, EDGE = "#F1EDE6", "#B9B2A6"
JOINTS = {ContactStatus.OPEN: "#CC79A7", ContactStatus.SLIP: "#E69F00",
          ContactStatus.STICK: "#0072B2"}  # fmt: skip
WIDTHS = {ContactStatus.OPEN: 3.6, ContactStatus.SLIP: 2.6,
          ContactStatus.STICK: 1.3}  # fmt: skip  # points: told apart without colour too
SECONDS = 0.25  # of one picture of a film
LAST = 2.0  # seconds for which a film rests on its last picture


def step_figure(
    model: Model | Scene, frame: Frame, *, magnify: float = 1.0, room: float = 0.0,
    units: Units = UNKNOWN,
) -> Figure:  # fmt: skip
    """The deformed bodies, their joints coloured by status.

    magnify: factor on displacements; room: magnified displacement that must fit in, unit of
    length, so that all pictures of a film have one frame.
    """
    scene = model if isinstance(model, Scene) else Scene(model)
    figure = Figure(figsize=(7.6, 6.4), dpi=110, layout="constrained")
    axes = figure.subplots()
    _draw_step(axes, scene, frame, magnify, room, units)
    axes.set_title(f"{_moment(frame, units)}, displacements × {magnify:g}")
    labels = {s: f"{s.name.lower()}: {int((frame.status == s).sum())}" for s in ContactStatus}
    _joint_legend(figure, labels)
    stamp(figure, frame.stamp)
    return figure


def series_figure(
    model: Model | Scene, frames: Sequence[Frame], *, units: Units = UNKNOWN
) -> Figure:
    """Some steps side by side, magnified alike; raises InvalidInput when there is none."""
    if not frames:
        raise InvalidInput("frames: expected at least one, got none")
    scene = model if isinstance(model, Scene) else Scene(model)
    factor, room = magnification(scene, frames), room_needed(scene, frames)
    figure = Figure(figsize=(3.4 * len(frames) + 0.5, 5.1), dpi=120, layout="constrained")
    panels = figure.subplots(1, len(frames), sharey=True, squeeze=False)[0]
    for axes, frame in zip(panels, frames, strict=True):
        _draw_step(axes, scene, frame, factor, factor * room, units)
        shares = [int((frame.status == s).sum()) for s in ContactStatus]
        counted = ", ".join(
            f"{n} {s.name.lower()}" for n, s in zip(shares, ContactStatus, strict=True)
        )
        axes.set_title(f"{_moment(frame, units)}\n{counted}", fontsize=10)
        axes.label_outer()
        stamp_panel(axes, frame.stamp)
    _joint_legend(figure, {s: s.name.lower() for s in ContactStatus})
    figure.suptitle(f"Joints by status of their contacts, displacements × {factor:g}\n")
    return figure


def _moment(frame: Frame, units: Units) -> str:
    return f"t = {frame.time:.4g} {units.time}".rstrip()


def _draw_step(
    axes: Axes, scene: Scene, frame: Frame, magnify: float, room: float, units: Units
) -> None:
    """Deformed sides and joints in one frame for all steps."""
    moved = [
        (body.mesh.points + magnify * u)[:, list(scene.axes)]
        for body, u in zip(scene.model.bodies, frame.displacement, strict=True)
    ]
    for body, nodes in scene.sides:
        axes.add_collection(
            PolyCollection(
                list(moved[body][nodes]), facecolors=STONE, edgecolors=EDGE, linewidths=0.4
            )
        )
    _draw_joints(axes, scene, frame, moved)
    start = np.concatenate([b.mesh.points[:, list(scene.axes)] for b in scene.model.bodies])
    margin = room + 0.02 * scene.size
    low, high = start.min(axis=0) - margin, start.max(axis=0) + margin
    x, y = ("xyz"[k] for k in scene.axes)
    length = units.length or "unit of length"
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]),
             xlabel=f"${x}$ in {length}", ylabel=f"${y}$ in {length}")  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)


def _joint_legend(figure: Figure, labels: dict[ContactStatus, str]) -> None:
    handles = [
        Line2D([], [], color=JOINTS[s], linewidth=1.5 * WIDTHS[s], label=text)
        for s, text in labels.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)


def _draw_joints(axes: Axes, scene: Scene, frame: Frame, moved: list[Array]) -> None:
    """Half an edge for each of its two contacts; open ones last, so that cracks show."""
    halves: dict[int, list[Array]] = {int(s): [] for s in ContactStatus}
    for body, edges, contacts in scene.joints:
        ends = moved[body][edges]
        middle = ends.mean(axis=1)
        for side in (0, 1):
            status = frame.status[contacts[:, side]]
            half = np.stack([ends[:, side], middle], axis=1)
            for s in ContactStatus:
                halves[int(s)].extend(half[status == s])
    for s in (ContactStatus.STICK, ContactStatus.SLIP, ContactStatus.OPEN):
        axes.add_collection(
            LineCollection(
                halves[int(s)], colors=JOINTS[s], linewidths=WIDTHS[s], capstyle="round"
            )
        )


def draw_film(
    model: Model, frames: Sequence[Frame], folder: str | os.PathLike[str], name: str = "step",
    *, units: Units = UNKNOWN,
) -> list[Path]:  # fmt: skip
    """One PNG for each frame, FOLDER/NAME-00001.png and so on, and FOLDER/film.gif of them all.

    Returns the paths, the film last.
    """
    folder = Path(folder)
    scene = Scene(model)
    factor = magnification(scene, frames)
    room = factor * room_needed(scene, frames)
    paths, images = [], []
    with made(folder):
        for k, frame in enumerate(frames, start=1):
            figure = step_figure(scene, frame, magnify=factor, room=room, units=units)
            paths.append(folder / f"{name}-{k:05d}.png")
            save_figure(figure, paths[-1])
            images.append(_image(figure))
        if images:
            paths.append(folder / "film.gif")
            write_bytes(paths[-1], _film(images))
    return paths


def _film(images: list[Image.Image]) -> bytes:
    """The bytes of a GIF of them all."""
    film = BytesIO()
    durations = [int(1e3 * SECONDS)] * (len(images) - 1) + [int(1e3 * LAST)]
    images[0].save(film, format="gif", save_all=True, append_images=images[1:],
                   duration=durations, loop=0, optimize=True)  # fmt: skip
    return film.getvalue()


def _image(figure: Figure) -> Image.Image:
    """A figure with few colours, as a GIF wants it."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    return image.quantize(colors=64, dither=Image.Dither.NONE)
