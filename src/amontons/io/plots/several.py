"""Several solutions of one problem side by side: deformed bodies, statuses, reactions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ...problem.solution import ContactStatus, FrictionSolution
from .bodies import draw_bodies
from .layout import Sheet
from .scene import Frame, Scene, magnification
from .style import COLOURS, INK, MARKERS, stamp_panel, status_marks

if TYPE_CHECKING:
    from ...analysis.solutions.enumerate import PieceSolution, Solutions
    from ...mechanics.model import ContactFields, Model

Array = NDArray[np.float64]
SHOWN = 6  # solutions that get a panel
COLUMNS = 3
ARROW = 0.12  # longest arrow, relative to the bodies
PANEL = 3.4  # width in inches
HEAD = 0.55  # height of the title of a panel
LETTERS = {"f": ContactStatus.OPEN, "s": ContactStatus.STICK}  # of patterns; others slip


@dataclass(frozen=True, eq=False)
class Panel:
    """What a panel shows: reactions (nc, d), statuses (nc,), and a line above it."""

    r: Array
    status: NDArray[np.int8]
    name: str = ""
    stamp: str = ""

    @property
    def counts(self) -> str:
        """How many contacts there are in every state, in words."""
        counts = ((s.name.lower(), int((self.status == s).sum())) for s in ContactStatus)
        return ", ".join(f"{n} {name}" for name, n in counts if n)

    @classmethod
    def of_piece(cls, found: PieceSolution, number: int) -> Panel:
        """One of `all_solutions`."""
        status = [LETTERS.get(letter, ContactStatus.SLIP) for letter in found.pattern]
        name = f"{number}: orientation {found.orientation:+d}"
        if found.freedom:
            name += f", a set of dimension {found.freedom}"
        return cls(found.r, np.array(status, dtype=np.int8), name)


def solutions_figure(
    solutions: Sequence[FrictionSolution],
    names: Sequence[str] = (),
    *,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """One panel per solution, up to six: of a model the deformed bodies, else the reactions.

    names: a line above each panel, by default the counts of the statuses.
    """
    panels = [
        Panel(s.r, s.status, names[k] if k < len(names) else "", s.convergence.stamp)
        for k, s in enumerate(solutions)
    ]
    fields = None if model is None else [model.recover(s) for s in solutions[:SHOWN]]
    return _figure(panels, title, model, fields)


def all_solutions_figure(
    found: Solutions, *, title: str = "", model: Model | None = None
) -> Figure:
    """What `all_solutions` found; of a model, if given, the deformed bodies.

    The title says whether the list is complete.
    """
    count = f"{len(found)} solution" + ("s" if len(found) != 1 else "")
    told = f"{count}, {'complete' if found.complete else 'there may be others'}"
    panels = [Panel.of_piece(piece, k) for k, piece in enumerate(found.solutions, start=1)]
    fields = None
    if model is not None:
        from ...solvers import Iterate
        from ...solvers.driver import drive

        problem = model.assemble()
        states = [drive(problem, start=Iterate(np.array(p.r))) for p in panels[:SHOWN]]
        fields = [model.recover(state) for state in states]
    return _figure(panels, f"{title}: {told}" if title else told, model, fields)


def _figure(
    every: Sequence[Panel], title: str, model: Model | None,
    fields: Sequence[ContactFields] | None,
) -> Figure:  # fmt: skip
    """The panels; fields: of the first ones, with their model."""
    shown = list(every)[:SHOWN]
    columns = max(1, min(COLUMNS, len(shown)))
    rows = max(1, math.ceil(len(shown) / columns))
    height = HEAD + PANEL * (0.72 if model is None else _height(model))
    scene = None if model is None else Scene.of(model)
    factor = 1.0
    if scene is not None and fields:
        frames = [Frame(0.0, f.displacement, p.status)
                  for f, p in zip(fields, shown, strict=True)]  # fmt: skip
        factor = magnification(scene, frames)
        title += f", displacements × {factor:g}"
    if len(every) > SHOWN:
        title += f"; {len(every) - SHOWN} more not shown"
    left = 0.75 if model is None else 0.1
    sheet = Sheet(left + PANEL * columns, height * rows, title=title, rows=1)
    if not shown:
        axes = sheet.panel(left, 0.1, PANEL - 0.2, height - 0.2)
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no solution was found", ha="center", va="center")
    low = 0.5 if model is None else 0.05
    drawn = []
    for k, panel in enumerate(shown):
        bottom = height * (rows - 1 - k // columns) + low
        axes = sheet.panel(left + PANEL * (k % columns), bottom, PANEL - (0.7 if model is None
                           else 0.15), height - HEAD - low)  # fmt: skip
        axes.set_title(f"{panel.name}\n{panel.counts}" if panel.name else panel.counts)
        stamp_panel(axes, panel.stamp)
        drawn.append(axes)
    if scene is not None and fields:
        _bodies(drawn, shown, scene, fields, factor)
    elif shown:
        _reactions(drawn, shown)
    sheet.legend(status_marks({status: status.name.lower() for status in ContactStatus}), 3)
    return sheet.done()


# ------------------------------------------------------------------------- deformed bodies
def _height(model: Model) -> float:
    """Height of a panel, relative to its width."""
    if model.dimension == 3:
        return 0.85
    points = np.concatenate([body.mesh.points for body in model.bodies])
    width, height = np.ptp(points, axis=0)
    return float(np.clip(1.3 * height / width, 0.4, 1.2))


def _bodies(
    drawn: Sequence[Axes], panels: Sequence[Panel], scene: Scene,
    fields: Sequence[ContactFields], factor: float,
) -> None:  # fmt: skip
    """Bodies deformed, in 2D with their shape at rest (thin lines) and forces on the slaves."""
    force = max((float(np.linalg.norm(f.force, axis=1).max(initial=0.0)) for f in fields),
                default=0.0)  # fmt: skip
    length = ARROW * scene.size / force if force > 0 else 0.0
    flat = scene.camera.toward is None
    for axes, field, panel in zip(drawn, fields, panels, strict=True):
        draw_bodies(axes, scene, scene.moved(field.displacement, factor), panel.status)
        if flat:
            rest: Any = scene.points
            for nodes in scene.sides:
                axes.add_collection(
                    PolyCollection(rest[nodes], facecolors="none", alpha=0.25, edgecolors=INK,
                                   linewidths=0.3, zorder=0.5), autolim=False
                )  # fmt: skip
            _contacts(axes, field, panel, factor, length)
            axes.set(aspect="equal", xticks=[], yticks=[])
            axes.spines[["left", "bottom"]].set_visible(False)
    if flat:
        _same_limits(drawn)


def _same_limits(panels: Sequence[Axes]) -> None:
    """Panels of the same size and place can be compared."""
    (left, right), (low, high) = (
        np.array([getattr(axes, f"get_{side}lim")() for axes in panels]).T for side in "xy"
    )
    for axes in panels:
        axes.set(xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))


def _contacts(
    axes: Axes, field: ContactFields, panel: Panel, factor: float, length: float
) -> None:
    """Marks at the contacts, arrows for the forces on the slave."""
    at = field.points.copy()
    for body in np.unique(field.body):
        mine = field.body == body
        at[mine] += factor * field.displacement[body][field.node[mine]]
    tails = at - length * field.force
    moved = (tails != at).any(axis=1)
    if moved.any():
        axes.quiver(*tails[moved].T, *(at - tails)[moved].T, color="#D55E00", angles="xy",
                    scale_units="xy", scale=1.0, width=0.006, headwidth=5, headlength=6,
                    headaxislength=5, zorder=5)  # fmt: skip
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        space = 0.04 * (right - left)
        (x, y), (a, b) = tails.min(axis=0) - space, tails.max(axis=0) + space
        axes.set(xlim=(min(left, x), max(right, a)), ylim=(min(low, y), max(high, b)))
    for status in ContactStatus:
        chosen = panel.status == status
        axes.scatter(*at[chosen].T, s=22, marker=MARKERS[status], color=COLOURS[status],
                     edgecolors=INK, linewidths=0.4, zorder=4)  # fmt: skip


# ------------------------------------------------------------------------- without geometry
def _reactions(drawn: Sequence[Axes], panels: Sequence[Panel]) -> None:
    """Normal reactions as bars in the colour of the status, tangential ones as ticks."""
    largest = max((float(np.abs(p.r).max(initial=0.0)) for p in panels), default=0.0)
    is_planar = all(p.r.shape[1] == 2 for p in panels)
    low = min(float(p.r[:, 1].min(initial=0.0)) for p in panels) if is_planar else 0.0
    for axes, panel in zip(drawn, panels, strict=False):
        r = panel.r
        number = np.arange(1, len(r) + 1)
        colours = [COLOURS[ContactStatus(status)] for status in panel.status]
        axes.bar(number, r[:, 0], color=colours, edgecolor=INK, linewidth=0.3)
        shear = r[:, 1] if r.shape[1] == 2 else np.linalg.norm(r[:, 1:], axis=1)
        axes.plot(number, shear, linestyle="", marker="_", color="#D55E00", markersize=6)
        axes.axhline(0, color=INK, linewidth=0.6)
        for status in ContactStatus:  # bars of zero height have no colour to see
            chosen = panel.status == status
            axes.scatter(number[chosen], np.zeros(chosen.sum()), s=12, zorder=3, linewidths=0.3,
                         marker=MARKERS[status], color=COLOURS[status],
                         edgecolors=INK)  # fmt: skip
        axes.set(
            xlabel="contact",
            xlim=(0, len(r) + 1),
            ylim=(1.1 * low - 0.05 * largest, 1.1 * largest + 1e-300),
        )
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    tangential = "r_T" if is_planar else "|r_T|"
    drawn[0].set_ylabel(f"r_N (bars), {tangential} (ticks)")
