"""Figures whose panels have places in inches: no layout is searched for, which takes a second.

A sheet has a title above its panels, above that the stamp of a result that is none, and a row
or two of a legend below.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from .style import BAND, INK, stamp

DPI = 110
LINE = 0.24  # height of a line of the title, or of a row of a legend
LETTERS = 11  # of the title, per inch
SMALL = 9  # size of labels and titles of panels in points
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_DECADES = 7  # labels of a logarithmic axis


class Sheet:
    """A figure of given width, and height of its panels, in inches; its origin is below left.

    note: as `Convergence.stamp`; rows: of the legend.
    """

    def __init__(
        self, width: float, height: float, *, title: str = "", note: str = "", rows: int = 0
    ) -> None:
        text = textwrap.fill(title, max(20, int(LETTERS * width)))
        head = LINE * (text.count("\n") + 1) + 0.1 if text else 0.05
        band = BAND if note else 0.0
        self.width, self.foot = width, LINE * rows + (0.1 if rows else 0.0)
        self.height = self.foot + height + head + band
        self.panels: list[Axes] = []
        self.figure = Figure(figsize=(width, self.height), dpi=DPI)
        if text:
            top = 1 - (band + 0.1) / self.height
            self.figure.suptitle(text, color=INK, fontsize=11, y=top, va="top")
        stamp(self.figure, note)

    def panel(self, left: float, bottom: float, width: float, height: float) -> Axes:
        """Axes at a place in inches, plain ones: two spines, small letters."""
        place = (left / self.width, (self.foot + bottom) / self.height, width / self.width,
                 height / self.height)  # fmt: skip
        axes = self.figure.add_axes(place)
        axes.tick_params(labelsize=SMALL)
        for label in (axes.xaxis.label, axes.yaxis.label):
            label.set_fontsize(SMALL)
        axes.spines[["top", "right"]].set_visible(False)
        self.panels.append(axes)
        return axes

    def done(self) -> Figure:
        """The figure; titles of panels are made small."""
        for axes in self.panels:
            axes.title.set_fontsize(SMALL + 1)
        return self.figure

    def legend(self, handles: Sequence[Any], columns: int) -> None:
        """Marks below all panels."""
        if handles:
            self.figure.legend(handles=handles, loc="lower center", ncols=columns,
                               fontsize=SMALL, frameon=False, bbox_to_anchor=(0.5, 0.0),
                               borderpad=0.2, borderaxespad=0.2)  # fmt: skip


def decades(axis: Axis, low: float, high: float) -> None:
    """Powers of ten as the only ticks of a logarithmic axis, written without formulas."""
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    step = max(1, -(-(last - first + 1) // MOST_DECADES))
    axis.set_major_locator(FixedLocator([10.0**k for k in range(first, last + 1, step)]))
    axis.set_major_formatter(FuncFormatter(lambda x, _: power_of_ten(x)))
    axis.set_minor_locator(NullLocator())


def power_of_ten(x: float) -> str:
    """10⁻³, or the plain number from a tenth to a hundred."""
    exponent = round(math.log10(x))
    return f"{x:g}" if -1 <= exponent <= 2 else f"10{str(exponent).translate(RAISED)}"
