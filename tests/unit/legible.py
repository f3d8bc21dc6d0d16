"""What can not be read in a figure: texts that are cut off, and texts across each other."""

from __future__ import annotations

import itertools

from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

SLACK = 1.5  # pixels


def faults(figure: Figure) -> list[str]:
    """A line for each text that leaves the figure, and for each two that meet."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    shown = [(text.get_text(), text.get_window_extent(renderer)) for text in _texts(figure)]
    width, height = figure.bbox.width, figure.bbox.height
    cut = [
        f"cut off: {words!r}" for words, box in shown
        if box.x0 < -SLACK or box.y0 < -SLACK or box.x1 > width + SLACK
        or box.y1 > height + SLACK
    ]  # fmt: skip
    met = [
        f"{a!r} across {b!r}"
        for (a, one), (b, other) in itertools.combinations(shown, 2) if _meet(one, other)
    ]  # fmt: skip
    return cut + met


def _meet(a: Bbox, b: Bbox) -> bool:
    """True for boxes that share more than a rim."""
    width = min(a.x1, b.x1) - max(a.x0, b.x0)
    height = min(a.y1, b.y1) - max(a.y0, b.y0)
    return width > SLACK and height > SLACK


def _texts(figure: Figure) -> list[Text]:
    """Texts that are drawn, without those written across a whole figure on purpose."""
    hidden = {id(text) for axis in figure.findobj(Axis) for text in _ticks_out_of_view(axis)}
    for axes in figure.findobj(lambda artist: hasattr(artist, "axison")):
        if not axes.axison:
            hidden |= {id(t) for axis in (axes.xaxis, axes.yaxis) for t in axis.findobj(Text)}
    return [
        text for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden
        and not text.get_rotation() == 20
    ]  # fmt: skip


def _ticks_out_of_view(axis: Axis) -> list[Text]:
    low, high = sorted(axis.get_view_interval())
    reach = 1e-9 * (high - low)
    return [
        label for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        for label in (tick.label1, tick.label2)
        if not low - reach <= tick.get_loc() <= high + reach or not tick.get_visible()
    ]  # fmt: skip
