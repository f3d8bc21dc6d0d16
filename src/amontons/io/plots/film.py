"""Films of steps in time: deformed bodies coloured by what they carry, joints by status.

All pictures of a film have one frame, one magnification and one scale of colours.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.animation import FFMpegWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...core.errors import InvalidInput, MissingDependency, NotWritten, shown
from ...core.files import replacing, write_bytes
from ...mechanics.elements import von_mises
from ...mechanics.multibody import RigidStep
from ...mechanics.steps import TimeStep
from ...problem.solution import ContactStatus
from ..vtk import stresses
from .bodies import JOINTS, draw_bodies
from .layout import Sheet
from .rigid_film import rigid_figures
from .saving import spent_picture
from .scene import Frame, Scene, magnification, room_needed
from .steps import SECONDS, few_colours, film_of, joint_legend, moment
from .style import UNKNOWN, Units, with_unit

Array = NDArray[np.float64]
SUFFIXES = (".gif", ".mp4")
MAP = colormaps["viridis"]
PALE = 0.75  # of the colours, the rest is white: joints stay visible on them


class FilmColour(Enum):
    """What colours the bodies of a film."""

    BODY = "body"
    DISPLACEMENT = "displacement"  # its length
    STRESS = "stress"  # that of von Mises, at nodes the mean of the cells around


@dataclass(frozen=True, eq=False)
class _Shot:
    """A frame and what colours its nodes, (nodes,), or None."""

    frame: Frame
    values: Array | None


def film(
    steps: Iterable[TimeStep] | Iterable[RigidStep], path: str | os.PathLike[str], *,
    colour: FilmColour | str = FilmColour.DISPLACEMENT, magnify: float | None = None,
    seconds: float = SECONDS, units: Units = UNKNOWN,
) -> Path:  # fmt: skip
    """Write a film of steps of one model, a .gif, or an .mp4 where ffmpeg is installed.

    Steps of rigid bodies show these as they are: no colour and magnify.
    magnify: factor on displacements, by default 1 at large deformations and else a round one;
    seconds: of one picture.  Raises InvalidInput for no steps, other suffixes and bad options,
    MissingDependency without ffmpeg, NotWritten.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InvalidInput(f"path: expected a name in .gif or .mp4, got {str(path)!r}")
    for name, value in (("seconds", seconds), ("magnify", 1.0 if magnify is None else magnify)):
        if not (isinstance(value, int | float) and 0 < value < np.inf):
            raise InvalidInput(f"{name}: expected a number > 0, got {shown(value)}")
    try:
        colour = FilmColour(colour)
    except ValueError as reason:
        names = ", ".join(one.value for one in FilmColour)
        raise InvalidInput(f"colour: expected one of {names}, got {shown(colour)}") from reason
    if path.suffix.lower() == ".mp4" and not FFMpegWriter.isAvailable():
        raise MissingDependency(f"{path.name}: an .mp4 needs ffmpeg, which was not found; a "
                                "name that ends in .gif needs nothing")  # fmt: skip
    given: list[Any] = list(steps)
    if given and all(isinstance(step, RigidStep) for step in given):
        figures = rigid_figures(given, units)
    elif given and all(isinstance(step, TimeStep) for step in given):
        figures = _figures(given, colour, magnify, units)
    else:
        raise InvalidInput(f"steps: expected steps in time, one at least, got {shown(given)}")
    pictures = [spent_picture(figure) for figure in figures]
    if path.suffix.lower() == ".gif":
        write_bytes(path, film_of([few_colours(drawn, 256) for drawn in pictures], seconds))
    else:
        _write_mp4(path, pictures, seconds)
    return path


def _figures(
    steps: Sequence[TimeStep], colour: FilmColour, magnify: float | None, units: Units
) -> Iterable[Figure]:
    scene = Scene.of(steps[0].model)
    shots = [_Shot(Frame.of(step), _values(step, colour)) for step in steps]
    frames = [shot.frame for shot in shots]
    if magnify is None:
        large = steps[0].frames is not None
        magnify = 1.0 if large else magnification(scene, frames)
    room = magnify * room_needed(scene, frames)
    values = [shot.values for shot in shots if shot.values is not None]
    most = max((float(v.max(initial=0.0)) for v in values), default=0.0) or 1.0
    for shot in shots:
        yield _figure(scene, shot, most, colour, magnify, room, units)


def _values(step: TimeStep, colour: FilmColour) -> Array | None:
    """What colours the nodes of all bodies, (nodes,)."""
    if colour is FilmColour.BODY:
        return None
    if colour is FilmColour.DISPLACEMENT:
        return np.linalg.norm(np.concatenate(list(step.displacement)), axis=1)
    parts = stresses(step.model, step.fields, step.time)
    return von_mises(np.concatenate([nodes for _, nodes in parts]))


def _figure(
    scene: Scene, shot: _Shot, most: float, colour: FilmColour, magnify: float, room: float,
    units: Units,
) -> Figure:  # fmt: skip
    frame, flat = shot.frame, scene.model.dimension == 2
    title = f"{moment(frame, units)}, displacements × {magnify:g}"
    sheet = Sheet(8.4, 5.6, title=title, note=frame.stamp, rows=1)
    axes = sheet.panel(*((0.85, 0.6, 6.3, 4.9) if flat else (0.1, 0.05, 7.2, 5.5)))
    tints = None
    if shot.values is not None:
        tints = np.asarray(MAP(shot.values / most))[:, :3] * PALE + (1 - PALE)
    draw_bodies(axes, scene, scene.moved(frame.displacement, magnify), frame.status, room=room,
                joints=JOINTS, length=units.length, tints=tints)  # fmt: skip
    if flat:
        axes.set(xlabel=with_unit("x", units.length), ylabel=with_unit("y", units.length))
    if tints is not None:
        _scale(sheet.panel(7.45, 1.0, 0.18, 3.8), most, colour, units)
    counts = {s: f"{s.name.lower()}: {int((frame.status == s).sum())}" for s in ContactStatus}
    joint_legend(sheet, counts)
    return sheet.done()


def _scale(axes: Axes, most: float, colour: FilmColour, units: Units) -> None:
    """Colours from 0 to the largest value of the film."""
    pale = np.asarray(MAP(np.linspace(0, 1, 128)))[:, None, :3] * PALE + (1 - PALE)
    axes.imshow(pale, origin="lower", aspect="auto", extent=(0.0, 1.0, 0.0, most))
    unit = units.length if colour is FilmColour.DISPLACEMENT else ""
    name = "displacement" if colour is FilmColour.DISPLACEMENT else "von Mises stress"
    axes.set(xticks=[], ylabel=with_unit(name, unit))
    axes.yaxis.set(ticks_position="right", label_position="right")
    axes.tick_params(labelsize=8)


def _write_mp4(path: Path, pictures: Sequence[bytes], seconds: float) -> None:
    """By ffmpeg, which gets the pictures one after another."""
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2"  # sides that its usual format asks for
    with replacing(path) as temporary:
        words = [FFMpegWriter.bin_path(), "-y", "-loglevel", "error", "-f", "image2pipe",
                 "-framerate", f"{1 / seconds:.6g}", "-c:v", "png", "-i", "-", "-vf", even,
                 "-pix_fmt", "yuv420p", str(temporary)]  # fmt: skip
        done = subprocess.run(words, input=b"".join(pictures), capture_output=True, check=False)
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip()
            raise NotWritten(f"{path}: ffmpeg failed: {said}")
