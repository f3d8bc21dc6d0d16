"""Several solutions of one problem side by side: deformed bodies, statuses, reactions."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ...problem.solution import ContactStatus, FrictionSolution
from .scene import Frame, Scene, magnification
from .style import COLOURS, INK, MARKERS, stamp_panel, status_marks

if TYPE_CHECKING:
    from ...mechanics.model import ContactFields, Model

Array = NDArray[np.float64]
SHOWN = 6  # solutions that get a panel
COLUMNS = 3
ARROW = 0.12  # longest arrow, relative to the bodies
PANEL = 3.4  # width in inches
LETTERS = 11  # of the title, per inch


def solutions_figure(
    solutions: Sequence[FrictionSolution],
    names: Sequence[str] = (),
    *,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """One panel per solution, up to six: of a 2D model the deformed bodies, else the reactions.

    names: a line above each panel, by default the counts of the statuses.
    """
    shown = list(solutions)[:SHOWN]
    columns = max(1, min(COLUMNS, len(shown)))
    rows = max(1, math.ceil(len(shown) / columns))
    drawn = model if model is not None and model.dimension == 2 else None
    height = PANEL * rows * (0.75 if drawn is None else _height(drawn))
    figure = Figure(figsize=(PANEL * columns, 1.4 + height), dpi=150, layout="constrained")
    panels = list(figure.subplots(rows, columns, squeeze=False).ravel())
    note = ""
    if drawn is not None and shown:
        note = _bodies(panels, shown, drawn)
    elif shown:
        _reactions(panels, shown)
    for k, (axes, solution) in enumerate(zip(panels, shown, strict=False)):
        counts = ", ".join(f"{n} {name}" for name, n in solution.counts.items() if n)
        name = names[k] if k < len(names) else ""
        axes.set_title(f"{name}\n{counts}" if name else counts, fontsize=10)
        stamp_panel(axes, solution.convergence.stamp)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    left = f"; {len(solutions) - SHOWN} more not shown" if len(solutions) > SHOWN else ""
    if not shown:
        axes = figure.add_subplot()
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no solution was found", ha="center", va="center")
    text = textwrap.fill(f"{title}{note}{left}", int(LETTERS * PANEL * columns))
    figure.suptitle(text, color=INK, fontsize=11)
    marks = status_marks({status: status.name.lower() for status in ContactStatus})
    figure.legend(handles=marks, loc="outside lower center", ncols=3, frameon=False)
    return figure


# ------------------------------------------------------------------------- deformed bodies
def _height(model: Model) -> float:
    """Height of a panel, relative to its width."""
    points = np.concatenate([body.mesh.points for body in model.bodies])
    width, height = np.ptp(points, axis=0)
    return float(np.clip(1.3 * height / width, 0.4, 1.2))


def _bodies(panels: Sequence[Axes], solutions: list[FrictionSolution], model: Model) -> str:
    """Bodies at rest (thin lines) and deformed, forces on the slaves; what the scale is."""
    scene, fields = Scene(model), [model.recover(s) for s in solutions]
    factor = magnification(
        scene,
        [Frame(0.0, f.displacement, s.status) for f, s in zip(fields, solutions, strict=True)],
    )
    force = max((float(np.linalg.norm(f.force, axis=1).max(initial=0.0)) for f in fields),
                default=0.0)  # fmt: skip
    for axes, field, solution in zip(panels, fields, solutions, strict=False):
        for body, nodes in scene.sides:
            points = model.bodies[body].mesh.points
            moved = points + factor * field.displacement[body]
            before = PolyCollection(list(points[nodes]), facecolors="none", alpha=0.25,
                                    edgecolors=INK, linewidths=0.3)  # fmt: skip
            after = PolyCollection(list(moved[nodes]), facecolors="#EAF1F6", edgecolors=INK,
                                   linewidths=0.4)  # fmt: skip
            axes.add_collection(before)
            axes.add_collection(after)
        length = ARROW * scene.size / force if force > 0 else 0.0
        _contacts(axes, field, solution, factor, length)
        axes.set(aspect="equal", xticks=[], yticks=[])
        axes.spines[["left", "bottom"]].set_visible(False)
        axes.margins(0.05)
        axes.autoscale_view()
    _same_limits(panels[: len(fields)])
    return f", displacements × {factor:g}"


def _same_limits(panels: Sequence[Axes]) -> None:
    """Panels of the same size and place can be compared."""
    if len(panels):
        (left, right), (low, high) = (
            np.array([getattr(axes, f"get_{side}lim")() for axes in panels]).T for side in "xy"
        )
        for axes in panels:
            axes.set(xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))


def _contacts(
    axes: Axes, field: ContactFields, solution: FrictionSolution, factor: float, length: float
) -> None:
    """Marks at the contacts, arrows for the forces on the slave."""
    at = field.points.copy()
    for body in np.unique(field.body):
        mine = field.body == body
        at[mine] += factor * field.displacement[body][field.node[mine]]
    tails = at - length * field.force
    for (x, y), (a, b) in zip(tails, at, strict=True):
        if x != a or y != b:
            axes.annotate("", (a, b), (x, y), arrowprops={
                "arrowstyle": "-|>", "color": "#D55E00", "linewidth": 0.9, "shrinkA": 0,
                "shrinkB": 2, "mutation_scale": 7,
            })  # fmt: skip
    axes.update_datalim(tails)
    for status in ContactStatus:
        chosen = solution.status == status
        axes.scatter(*at[chosen].T, s=22, marker=MARKERS[status], color=COLOURS[status],
                     edgecolors=INK, linewidths=0.4, zorder=3)  # fmt: skip


# ------------------------------------------------------------------------- without geometry
def _reactions(panels: Sequence[Axes], solutions: list[FrictionSolution]) -> None:
    """Normal reactions as bars in the colour of the status, tangential ones as ticks."""
    largest = max((float(np.abs(s.r).max(initial=0.0)) for s in solutions), default=0.0)
    is_planar = all(s.r.shape[1] == 2 for s in solutions)
    for axes, solution in zip(panels, solutions, strict=False):
        r = solution.r
        number = np.arange(1, len(r) + 1)
        colours = [COLOURS[ContactStatus(status)] for status in solution.status]
        axes.bar(number, r[:, 0], color=colours, edgecolor=INK, linewidth=0.3)
        shear = r[:, 1] if r.shape[1] == 2 else np.linalg.norm(r[:, 1:], axis=1)
        axes.plot(number, shear, linestyle="", marker="_", color="#D55E00", markersize=6)
        axes.axhline(0, color=INK, linewidth=0.6)
        for status in ContactStatus:  # bars of zero height have no colour to see
            chosen = solution.status == status
            axes.scatter(number[chosen], np.zeros(chosen.sum()), s=12, zorder=3, linewidths=0.3,
                         marker=MARKERS[status], color=COLOURS[status],
                         edgecolors=INK)  # fmt: skip
        low = min(float(s.r[:, 1].min(initial=0.0)) for s in solutions) if is_planar else 0.0
        axes.set(
            xlabel="contact",
            xlim=(0, len(r) + 1),
            ylim=(1.1 * low - 0.05 * largest, 1.1 * largest + 1e-300),
        )
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    tangential = "$r_T$" if is_planar else "$|r_T|$"
    panels[0].set_ylabel(f"$r_N$ (bars), {tangential} (ticks)")
