"""The state of the contacts of one solution: all bodies, their contact zones beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...problem.solution import ContactStatus, FrictionSolution
from .bodies import draw_bodies
from .contact_pairs import ContactPair, contact_pairs
from .layout import Sheet
from .reactions import cone_plane, ranked_reactions
from .scene import Frame, Scene, magnification
from .style import COLOURS, INK, status_marks
from .surface_curves import draw_curves
from .surface_maps import draw_maps

if TYPE_CHECKING:
    from ...mechanics.model import ContactFields, Model

MAX_MAPS = 4  # pairs in 3D: each has a row of its own
ROW, BODIES, PANEL = 3.9, 3.9, 3.0  # height of a row, widths of the panels, inches


def status_figure(
    solution: FrictionSolution,
    fields: ContactFields | None = None,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """The deformed bodies, and status and pressure on the contact surfaces beside them.

    Without geometry, the reactions in the friction cone, and ranked; without contacts, the
    bodies alone.
    """
    name = title or solution.problem.name or "contact status"
    note = solution.convergence.stamp
    if fields is None or model is None:
        sheet = Sheet(9.6, ROW, title=name, note=note, rows=1)
        left, right = (sheet.panel(x, 0.6, 3.7, 2.95) for x in (0.85, 5.7))
        _reactions(left, right, solution)
        _legend(sheet, solution, patches=False)
        return sheet.done()
    if not solution.problem.contacts:
        sheet = Sheet(BODIES + 0.6, ROW, title=name, note=note, rows=1)
        _bodies(sheet.panel(*_place(model, 1)), solution, fields, model)
        return sheet.done()
    pairs = contact_pairs(solution, fields, model)
    maps = solution.problem.dimension == 3 and 0 < len(pairs) <= MAX_MAPS
    rows = len(pairs) if maps else 1
    sheet = Sheet(BODIES + 9.1, ROW * rows, title=name, note=note, rows=1)
    _bodies(sheet.panel(*_place(model, rows)), solution, fields, model)
    if maps:
        for k, pair in enumerate(pairs):
            low = ROW * (rows - 1 - k) + 0.65
            left, right = _beside(sheet, low, apart=0.75)
            draw_maps(left, right, pair, model, named=rows > 1)
    else:
        _without_maps(sheet, solution, pairs)
    _legend(sheet, solution, patches=maps)
    return sheet.done()


def _place(model: Model, rows: int) -> tuple[float, float, float, float]:
    """Where the bodies are drawn: left, bottom, width, height in inches."""
    if model.dimension == 2:
        return 0.6, 0.6, BODIES - 0.6, ROW - 0.95
    height = min(ROW * rows - 0.4, 1.6 * BODIES)
    return 0.1, (ROW * rows - height) / 2 - 0.05, BODIES, height


def _beside(sheet: Sheet, low: float, apart: float) -> tuple[Axes, Axes]:
    """The two panels of a row beside the bodies."""
    left, high = BODIES + 0.95, ROW - 1.0
    return (sheet.panel(left, low, PANEL, high),
            sheet.panel(left + PANEL + apart, low, PANEL, high))  # fmt: skip


def _bodies(
    axes: Axes, solution: FrictionSolution, fields: ContactFields, model: Model
) -> None:
    """All bodies, deformed."""
    scene = Scene.of(model)
    frame = Frame(0.0, fields.displacement, solution.status)
    factor = magnification(scene, [frame])
    if model.dimension == 2:
        axes.set(xlabel="x", ylabel="y")
    draw_bodies(axes, scene, scene.moved(fields.displacement, factor), solution.status)
    axes.set_title(f"Bodies, displacements × {factor:g}")


def _without_maps(
    sheet: Sheet, solution: FrictionSolution, pairs: list[ContactPair]
) -> None:
    """Curves along the surfaces in 2D, the reactions where there are too many in 3D."""
    left, right = _beside(sheet, 0.6, apart=0.95)
    if pairs and solution.problem.dimension == 2:
        draw_curves(left, right, pairs)
    else:
        _reactions(left, right, solution)


def _reactions(left: Axes, right: Axes, solution: FrictionSolution) -> None:
    cone_plane(left, solution)
    ranked_reactions(right, solution)


def _legend(sheet: Sheet, solution: FrictionSolution, *, patches: bool) -> None:
    """One legend below all panels, with the number of contacts in every state."""
    labels = {
        status: f"{status.name.lower()}: {solution.counts[status.name.lower()]}"
        for status in ContactStatus
    }
    handles = status_marks(labels) if not patches else [
        Patch(facecolor=COLOURS[status], edgecolor=INK, label=label)
        for status, label in labels.items()
    ]  # fmt: skip
    sheet.legend(handles, len(handles))
