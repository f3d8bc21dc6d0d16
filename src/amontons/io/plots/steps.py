"""Figures of the steps of an evolution: deformed bodies with their joints, and a film of them.

Displacements are magnified, the same in all pictures of a film.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image  # comes with matplotlib

from ...core.errors import InvalidInput
from ...core.files import made, write_bytes
from ...mechanics.model import Model
from ...problem.solution import ContactStatus
from .bodies import JOINTS, WIDTHS, draw_bodies
from .layout import Sheet
from .saving import spent_picture
from .scene import Frame, Scene, magnification, room_needed
from .style import UNKNOWN, Units, stamp_panel, with_unit

SECONDS = 0.25  # of one picture of a film
LAST = 2.0  # seconds for which a film rests on its last picture


def step_figure(
    model: Model | Scene, frame: Frame, *, magnify: float = 1.0, room: float = 0.0,
    units: Units = UNKNOWN,
) -> Figure:  # fmt: skip
    """All bodies, deformed, their joints coloured by status.

    magnify: factor on displacements; room: magnified displacement that must fit in, unit of
    length, so that all pictures of a film have one frame.
    """
    scene = model if isinstance(model, Scene) else Scene.of(model)
    title = f"{moment(frame, units)}, displacements × {magnify:g}"
    sheet = Sheet(7.6, 5.6, title=title, note=frame.stamp, rows=1)
    if scene.model.dimension == 2:
        axes = sheet.panel(0.85, 0.6, 6.5, 4.9)
    else:
        axes = sheet.panel(0.1, 0.05, 7.4, 5.5)
    _draw_step(axes, scene, frame, magnify, room, units)
    labels = {s: f"{s.name.lower()}: {int((frame.status == s).sum())}" for s in ContactStatus}
    joint_legend(sheet, labels)
    return sheet.done()


def series_figure(
    model: Model | Scene, frames: Sequence[Frame], *, units: Units = UNKNOWN
) -> Figure:
    """Some steps side by side, magnified alike; raises InvalidInput when there is none."""
    if not frames:
        raise InvalidInput("frames: expected at least one, got none")
    scene = model if isinstance(model, Scene) else Scene.of(model)
    factor, room = magnification(scene, frames), room_needed(scene, frames)
    title = f"Joints by status of their contacts, displacements × {factor:g}"
    sheet = Sheet(3.4 * len(frames) + 0.8, 3.9, title=title, rows=1)
    for k, frame in enumerate(frames):
        axes = sheet.panel(0.75 + 3.4 * k, 0.55, 3.2, 2.85)
        _draw_step(axes, scene, frame, factor, factor * room, units)
        shares = [int((frame.status == s).sum()) for s in ContactStatus]
        counted = ", ".join(
            f"{n} {s.name.lower()}" for n, s in zip(shares, ContactStatus, strict=True)
        )
        axes.set_title(f"{moment(frame, units)}\n{counted}")
        if k:
            axes.set_ylabel("")
        stamp_panel(axes, frame.stamp)
    joint_legend(sheet, {s: s.name.lower() for s in ContactStatus})
    return sheet.done()


def moment(frame: Frame, units: Units) -> str:
    """The time of a frame, in words."""
    return f"t = {frame.time:.4g} {units.time}".rstrip()


def _draw_step(
    axes: Axes, scene: Scene, frame: Frame, magnify: float, room: float, units: Units
) -> None:
    """Deformed bodies and joints in one frame for all steps."""
    moved = scene.moved(frame.displacement, magnify)
    draw_bodies(axes, scene, moved, frame.status, room=room, joints=JOINTS, length=units.length)
    if scene.model.dimension == 2:
        axes.set(xlabel=with_unit("x", units.length), ylabel=with_unit("y", units.length))


def joint_legend(sheet: Sheet, labels: dict[ContactStatus, str]) -> None:
    """Joints as they are drawn, with their labels."""
    handles = [
        Line2D([], [], color=JOINTS[s], linewidth=1.5 * WIDTHS[s], label=text)
        for s, text in labels.items()
    ]
    sheet.legend(handles, len(handles))


def draw_film(
    model: Model, frames: Sequence[Frame], folder: str | os.PathLike[str], name: str = "step",
    *, units: Units = UNKNOWN,
) -> list[Path]:  # fmt: skip
    """One PNG for each frame, FOLDER/NAME-00001.png and so on, and FOLDER/film.gif of them all.

    Returns the paths, the film last.
    """
    folder = Path(folder)
    scene = Scene.of(model)
    factor = magnification(scene, frames)
    room = factor * room_needed(scene, frames)
    paths, images = [], []
    with made(folder):
        for k, frame in enumerate(frames, start=1):
            figure = step_figure(scene, frame, magnify=factor, room=room, units=units)
            paths.append(folder / f"{name}-{k:05d}.png")
            drawn = spent_picture(figure)
            write_bytes(paths[-1], drawn)
            images.append(few_colours(drawn))
        if images:
            paths.append(folder / "film.gif")
            write_bytes(paths[-1], film_of(images))
    return paths


def film_of(images: list[Image.Image], seconds: float = SECONDS) -> bytes:
    """The bytes of a GIF of them all; seconds: of one."""
    film = BytesIO()
    durations = [round(1e3 * seconds)] * (len(images) - 1) + [int(1e3 * LAST)]
    images[0].save(film, format="gif", save_all=True, append_images=images[1:],
                   duration=durations, loop=0, optimize=True)  # fmt: skip
    return film.getvalue()


def few_colours(drawn: bytes, colours: int = 64) -> Image.Image:
    """A picture as a GIF wants it."""
    image = Image.open(BytesIO(drawn)).convert("RGB")
    return image.quantize(colors=colours, dither=Image.Dither.NONE)
