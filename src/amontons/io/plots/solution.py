"""The state of the contacts of one solution, on their surface where there is one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...problem.solution import ContactStatus, FrictionSolution
from .contact_pairs import contact_pairs
from .reactions import cone_plane, ranked_reactions
from .style import COLOURS, INK, stamp, status_marks
from .surface_curves import draw_curves
from .surface_maps import draw_maps

if TYPE_CHECKING:
    from ...mechanics.model import ContactFields, Model

MAX_MAPS = 4  # pairs in 3D: each has a row of its own


def status_figure(
    solution: FrictionSolution,
    fields: ContactFields | None = None,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """Status and pressure on the contact surface; without geometry, reactions in the cone."""
    pairs = [] if fields is None or model is None else contact_pairs(solution, fields, model)
    maps = solution.problem.dimension == 3 and 0 < len(pairs) <= MAX_MAPS
    rows = len(pairs) if maps else 1
    figure = Figure(figsize=(9.6, 0.4 + 4.2 * rows), dpi=150, layout="constrained")
    panels = figure.subplots(rows, 2, squeeze=False)
    if maps and model is not None:
        for (left, right), pair in zip(panels, pairs, strict=True):
            draw_maps(figure, left, right, pair, model, named=rows > 1)
    elif pairs and solution.problem.dimension == 2:
        draw_curves(*panels[0], pairs)
    else:
        cone_plane(panels[0, 0], solution)
        ranked_reactions(panels[0, 1], solution)
    figure.suptitle(title or solution.problem.name or "contact status", color=INK)
    _legend(figure, solution, markers=not maps)
    for axes in panels.flat:
        axes.spines[["top", "right"]].set_visible(False)
    stamp(figure, solution.convergence.stamp)
    return figure


def _legend(figure: Figure, solution: FrictionSolution, markers: bool) -> None:
    """One legend below both panels, with the number of contacts in every state."""
    labels = {
        status: f"{status.name.lower()}: {solution.counts[status.name.lower()]}"
        for status in ContactStatus
    }
    handles = status_marks(labels) if markers else [
        Patch(facecolor=COLOURS[status], edgecolor=INK, label=label)
        for status, label in labels.items()
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
