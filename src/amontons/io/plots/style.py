"""What the figures share: colours and marks of the statuses, units on axes, round numbers.

Colours are those of Okabe and Ito, which colour-blind readers can tell apart.  Figures are made
without pyplot: no global state, no display needed.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...problem.solution import ContactStatus

COLOURS = {
    ContactStatus.OPEN: "#C9D1D9",
    ContactStatus.SLIP: "#E69F00",
    ContactStatus.STICK: "#0072B2",
}
MARKERS = {ContactStatus.OPEN: "o", ContactStatus.SLIP: "^", ContactStatus.STICK: "s"}
INK = "#333333"
ALARM = "#B00020"
LETTERS = 30  # of a line on a panel
BAND = 0.3  # height of the line of a stamp in inches


@dataclass(frozen=True)
class Units:
    """What the axes say; empty where only the reader knows."""

    length: str = ""
    time: str = ""
    energy: str = ""


UNKNOWN, SI = Units(), Units("m", "s", "J")


def with_unit(name: str, unit: str) -> str:
    """The label of an axis."""
    return f"{name} in {unit}" if unit else name


def status_marks(labels: Mapping[ContactStatus, str]) -> list[Line2D]:
    """The marks of the statuses, for a legend."""
    return [
        Line2D([], [], linestyle="", marker=MARKERS[status], label=label,
               color=COLOURS[status], markeredgecolor=INK)
        for status, label in labels.items()
    ]  # fmt: skip


def marker_size(count: int) -> float:
    """The area of one of so many marks, in square points."""
    return float(np.clip(4000 / max(count, 1), 8, 60))


def round_below(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a value > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-12))) * power


def stamp(figure: Figure, text: str) -> None:
    """Write over a figure that its result is none: a line on top, its first words across.

    text: as `Convergence.stamp`, "" leaves the figure as it is.  A figure without a layout
    engine has room for the line.
    """
    if not text:
        return
    width, height = figure.get_size_inches()
    title, layout = figure.get_suptitle(), figure.get_layout_engine()
    if layout is None:
        pass
    elif title:  # stays at the top whatever the layout: room above it
        figure.suptitle(f"\n\n{title}", color=INK)
    else:
        layout.set(rect=(0.0, 0.0, 1.0, 1.0 - BAND / height))
    figure.text(0.5, 1.0 - 0.5 * BAND / height, text, ha="center", va="center", color="white",
                weight="bold", fontsize=_fitting(text, width),
                bbox={"facecolor": ALARM, "edgecolor": "none", "pad": 3})  # fmt: skip
    words = text.partition(" (")[0]
    figure.text(0.5, 0.5, words, ha="center", va="center", rotation=20, color=ALARM, alpha=0.3,
                weight="bold", fontsize=60 * width / len(words), zorder=100)  # fmt: skip


def stamp_panel(axes: Axes, text: str) -> None:
    """The same on one panel of several."""
    if text:
        words, _, reason = text.partition(" (")
        lines = textwrap.fill(reason.rstrip(")"), LETTERS)
        axes.text(0.5, 0.5, f"{words}\n{lines}", transform=axes.transAxes, ha="center",
                  va="center", color=ALARM, weight="bold", fontsize=8, zorder=100,
                  in_layout=False, clip_on=False,
                  bbox={"facecolor": "white", "edgecolor": ALARM, "alpha": 0.75})  # fmt: skip


def _fitting(text: str, width: float) -> float:
    """Size in points at which a line of text fits into so many inches; at most 10."""
    return min(10.0, 105 * width / max(len(text), 1))
