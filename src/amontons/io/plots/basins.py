"""Which solution each method found: a map of all runs, or the shares of many."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .style import INK, stamp

if TYPE_CHECKING:
    from ...analysis.basins.study import Basins

SPARE = ("#009E73", "#CC79A7", "#56B4E9", "#F0E442", "#7B3294", "#00441B")  # of other names
KNOWN = {"stick": "#0072B2", "slip": "#E69F00", "free": "#C9D1D9", "other": "#8B5A2B",
         "failed": "#B00020"}  # fmt: skip
MAP = 24  # starts up to which each run has a cell
ROW = 0.32  # inches
LETTERS = 44  # of a label


def basins_figure(basins: Basins, *, title: str = "") -> Figure:
    """One row per method: a cell for each start, or of many the share of each solution."""
    few = len(basins.starts) <= MAP
    rows = len(basins.methods)
    width = 4.0 + (0.34 * len(basins.starts) if few else 4.5)
    height = 1.9 + ROW * rows + (0.9 if few else 0.0)
    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    axes = figure.subplots()
    colours = _colours(basins.names)
    (_cells if few else _bars)(axes, basins, colours)
    axes.set_yticks(range(rows), [_short(method.label) for method in basins.methods])
    axes.set_ylim(rows - 0.5, -0.5)
    axes.spines[["top", "right", "left", "bottom"]].set_visible(False)
    axes.tick_params(length=0)
    counts = basins.count()
    marks = [Patch(facecolor=colours[name], edgecolor=INK, linewidth=0.4,
                   label=f"{name} ({counts[name]})") for name in basins.names]  # fmt: skip
    if marks:
        figure.legend(handles=marks, loc="outside lower center", ncols=min(len(marks), 5),
                      frameon=False)  # fmt: skip
    figure.suptitle(title or basins.name, color=INK, fontsize=11)
    stamp(figure, f"NOT FINISHED ({basins.missing} runs missing)" if basins.missing else "")
    return figure


def _colours(names: tuple[str, ...]) -> dict[str, str]:
    """A colour for each solution; the usual names keep theirs."""
    others = itertools.cycle(SPARE)
    return {name: KNOWN[name] if name in KNOWN else next(others) for name in names}


def _cells(axes: Axes, basins: Basins, colours: dict[str, str]) -> None:
    """One cell per run; a run that is missing is white."""
    found = {(run.method, run.start): run.found for run in basins.runs}
    for (row, column), name in found.items():
        axes.add_patch(_box(column - 0.5, row - 0.5, 1.0, colours[name]))
    axes.set_xlim(-0.5, len(basins.starts) - 0.5)
    labels = [_short(start.label) for start in basins.starts]
    axes.set_xticks(range(len(labels)), labels, rotation=60, ha="right", rotation_mode="anchor")


def _box(x: float, y: float, width: float, colour: str) -> Patch:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, 1.0, facecolor=colour, edgecolor="white", linewidth=1.2)


def _bars(axes: Axes, basins: Basins, colours: dict[str, str]) -> None:
    """The share of each solution among the runs of a method."""
    for row in range(len(basins.methods)):
        counts = basins.count(row)
        total, left = sum(counts.values()), 0.0
        for name in (name for name in counts if counts[name]):
            share = counts[name] / total
            axes.add_patch(_box(left, row - 0.5, share, colours[name]))
            if share > 0.06:
                axes.text(left + share / 2, row, str(counts[name]), ha="center", va="center",
                          fontsize=8, color=_ink_on(colours[name]))  # fmt: skip
            left += share
    axes.set_xlim(0, 1)
    axes.set_xlabel("share of the runs")
    axes.set_xticks(np.linspace(0, 1, 6))


def _ink_on(colour: str) -> str:
    """Dark letters on light boxes, white ones on dark."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return INK if 0.3 * red + 0.59 * green + 0.11 * blue > 140 else "white"


def _short(label: str) -> str:
    return label if len(label) <= LETTERS else f"{label[: LETTERS - 1]}…"
