"""Figures of an evolution: deformed bodies with their joints, a film of them, the energies.

Bodies in 3D are seen from the front along the thinnest direction of the whole; joints are the
slave edges on that side.  Displacements are magnified, the same in all pictures of a film.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from PIL import Image  # comes with matplotlib

from ..errors import InvalidInput
from ..evolution import Energies, TimeStep
from ..files import replacing
from ..model import Model
from ..solution import ContactStatus
from .solution import INK

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STONE, EDGE = "#F1EDE6", "#B9B2A6"
JOINTS = {ContactStatus.OPEN: "#CC79A7", ContactStatus.SLIP: "#E69F00",
          ContactStatus.STICK: "#0072B2"}  # fmt: skip
WIDTHS = {ContactStatus.OPEN: 3.6, ContactStatus.SLIP: 2.6,
          ContactStatus.STICK: 1.3}  # fmt: skip  # points: told apart without colour too
SHOWN = 0.12  # size that the largest displacement gets, relative to the whole
FRONT = 1e-6  # part of the depth within which nodes lie on the side that is seen
SECONDS = 0.25  # of one picture of a film
LAST = 2.0  # seconds for which a film rests on its last picture


@dataclass(frozen=True)
class Units:
    """What the axes say; empty where only the reader knows."""

    length: str = ""
    time: str = ""
    energy: str = ""


UNKNOWN, SI = Units(), Units("m", "s", "J")


def _with(name: str, unit: str) -> str:
    """The label of an axis."""
    return f"{name} in {unit}" if unit else name


@dataclass(frozen=True, eq=False)
class Frame:
    """What a picture of a step needs: time, displacement per body, status of all contacts."""

    time: float
    displacement: tuple[Array, ...]
    status: NDArray[np.int8]

    @classmethod
    def of(cls, step: TimeStep) -> Frame:
        """The frame of a step."""
        return cls(step.time, step.displacement, step.status)


@dataclass(frozen=True, eq=False)
class Scene:
    """The visible sides and joints of a model, found once for all pictures."""

    model: Model
    axes: tuple[int, int] = field(init=False)
    sides: list[tuple[int, Index]] = field(init=False)  # body, nodes of its visible facets
    joints: list[tuple[int, Index, Index]] = field(init=False)  # body, edges, contacts at ends

    def __post_init__(self) -> None:
        points = np.concatenate([body.mesh.points for body in self.model.bodies])
        spread = np.ptp(points, axis=0)
        depth = int(np.argmin(spread)) if self.model.dimension == 3 else None
        kept = [k for k in range(self.model.dimension) if k != depth]
        near = None if depth is None else points[:, depth].min() + FRONT * spread[depth]
        object.__setattr__(self, "axes", (kept[0], kept[1]))
        object.__setattr__(self, "sides", self._sides(depth, near))
        object.__setattr__(self, "joints", self._joints(depth, near))

    def _seen(self, body: int, depth: int | None, near: float | None) -> NDArray[np.bool_]:
        """Nodes of a body that lie on the visible side; all of them in 2D."""
        points = self.model.bodies[body].mesh.points
        if depth is None or near is None:
            return np.ones(len(points), dtype=bool)
        return points[:, depth] <= near

    def _sides(self, depth: int | None, near: float | None) -> list[tuple[int, Index]]:
        found = []
        for k, body in enumerate(self.model.bodies):
            seen = self._seen(k, depth, near)
            blocks = body.mesh.cells if depth is None else body.mesh.boundary
            for block in blocks:
                nodes = block.nodes[:, : _corners(block.kind)]
                found.append((k, nodes[seen[nodes].all(axis=1)]))
        return found

    def _joints(self, depth: int | None, near: float | None) -> list[tuple[int, Index, Index]]:
        """Visible edges of the slave surfaces, both ends of which have a contact."""
        bodies = self.model.bodies
        at = [np.full(len(body.mesh.points), -1) for body in bodies]
        surfaces: dict[tuple[int, str], None] = {}
        first = 0
        for contact, placed in zip(
            self.model.contacts, self.model.discretisation.placed, strict=True
        ):
            at[placed.body][placed.rows.nodes] = first + np.arange(len(placed.rows.nodes))
            first += len(placed.rows.nodes)
            surfaces[placed.body, contact.slave.rpartition(".")[2]] = None
        found = []
        for k, name in surfaces:
            seen = self._seen(k, depth, near) & (at[k] >= 0)
            for facets in bodies[k].mesh.surface(name):
                edges = _edges(facets.nodes[:, : _corners(facets.kind)])
                edges = edges[seen[edges].all(axis=1)]
                found.append((k, edges, at[k][edges]))
        return found

    @property
    def size(self) -> float:
        """Length of the diagonal of the picture."""
        points = np.concatenate([body.mesh.points for body in self.model.bodies])
        return float(np.linalg.norm(np.ptp(points[:, list(self.axes)], axis=0)))


def _corners(kind: str) -> int:
    """Corner nodes of a cell or facet."""
    return {"line": 2, "tri": 3, "quad": 4}[kind.rstrip("0123456789")]


def _edges(nodes: Index) -> Index:
    """Sides of facets as pairs of nodes, each once."""
    if nodes.shape[1] == 2:
        return nodes
    pairs = np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def magnification(scene: Scene, frames: Sequence[Frame]) -> float:
    """A round factor that makes the largest displacement a visible part of the picture."""
    largest = _room(scene, frames)
    if largest == 0:
        return 1.0
    factor = SHOWN * scene.size / largest
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(k for k in (1, 2, 5) if k * power <= factor) * power)


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
    return figure


def series_figure(
    model: Model | Scene, frames: Sequence[Frame], *, units: Units = UNKNOWN
) -> Figure:
    """Some steps side by side, magnified alike; raises InvalidInput when there is none."""
    if not frames:
        raise InvalidInput("frames: expected at least one, got none")
    scene = model if isinstance(model, Scene) else Scene(model)
    factor, room = magnification(scene, frames), _room(scene, frames)
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
    _joint_legend(figure, {s: s.name.lower() for s in ContactStatus})
    figure.suptitle(f"Joints by status of their contacts, displacements × {factor:g}\n")
    return figure


def _moment(frame: Frame, units: Units) -> str:
    return f"t = {frame.time:.4g} {units.time}".rstrip()


def _room(scene: Scene, frames: Sequence[Frame]) -> float:
    """The largest displacement in the plane of the picture, unit of length."""
    return max(
        (float(np.abs(u[:, list(scene.axes)]).max()) for f in frames for u in f.displacement),
        default=0.0,
    )


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
                moved[body][nodes], facecolors=STONE, edgecolors=EDGE, linewidths=0.4
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
    folder.mkdir(parents=True, exist_ok=True)
    scene = Scene(model)
    factor = magnification(scene, frames)
    room = factor * _room(scene, frames)
    paths, images = [], []
    for k, frame in enumerate(frames, start=1):
        figure = step_figure(scene, frame, magnify=factor, room=room, units=units)
        path = folder / f"{name}-{k:05d}.png"
        with replacing(path) as temporary:
            figure.savefig(temporary, format="png")
        paths.append(path)
        images.append(_image(figure))
    if images:
        paths.append(folder / "film.gif")
        durations = [int(1e3 * SECONDS)] * (len(images) - 1) + [int(1e3 * LAST)]
        with replacing(paths[-1]) as temporary:
            images[0].save(temporary, format="gif", save_all=True, append_images=images[1:],
                           duration=durations, loop=0, optimize=True)  # fmt: skip
    return paths


def _image(figure: Figure) -> Image.Image:
    """A figure with few colours, as a GIF wants it."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    return image.quantize(colors=64, dither=Image.Dither.NONE)


# ----------------------------------------------------------------------------- energies
def energy_figure(
    times: Sequence[float], energies: Sequence[Energies], *, units: Units = UNKNOWN
) -> Figure:
    """Where the work went: sums since the start (left), work of contact per step (right).

    One entry for each step; raises InvalidInput when there is none.
    """
    if not len(times) or len(times) != len(energies):
        raise InvalidInput(
            f"energies: expected one for each of {len(times)} > 0 times, got {len(energies)}"
        )
    t = np.asarray(times, dtype=float)

    def total(name: str) -> Array:
        return np.cumsum([getattr(e, name) for e in energies])

    put_in = total("loads") + total("supports")
    stored = np.array([e.total for e in energies])
    stored += total("gain")[0] - stored[0]  # relative to the start
    dissipated = -total("contact")
    lost = total("damping") + total("numerical")
    figure = Figure(figsize=(10.8, 4.4), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.stackplot(t, stored, lost, dissipated, colors=("#56B4E9", "#BBBBBB", "#E69F00"),
                   labels=("stored (kinetic + elastic)", "lost in time scheme and damping",
                           "dissipated by contact and friction"))  # fmt: skip
    left.plot(t, put_in, color=INK, linewidth=1.6, linestyle="--",
              label="work of loads and supports")  # fmt: skip
    left.set(xlabel=_with("time", units.time), ylabel=_with("energy, work", units.energy),
             title="Energy balance since the start",
             xlim=(min(t.min(), 0.0), t.max()))  # fmt: skip
    work = np.array([e.contact for e in energies])
    defect = np.abs([e.defect for e in energies])
    right.plot(t, np.maximum(-work, 0), color="#E69F00", label="dissipated by contact")
    gained = work > 0
    if gained.any():
        right.plot(t[gained], work[gained], "x", color="#D55E00", label="gained from contact")
    right.plot(t, defect, color=INK, linewidth=0.8, label="|defect of the balance|")
    created = "creates" if gained.any() else "never creates"
    largest = f"{work.max():.1e} {units.energy}".rstrip()
    right.set(xlabel=_with("time", units.time), yscale="log",
              ylabel=_with("work in a step", units.energy),
              title=f"Contact {created} energy: largest work {largest}",
              xlim=left.get_xlim())  # fmt: skip
    for axes in (left, right):
        handles = axes.get_legend_handles_labels()
        axes.legend(*handles, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2,
                    frameon=False, fontsize=9)  # fmt: skip
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    return figure
