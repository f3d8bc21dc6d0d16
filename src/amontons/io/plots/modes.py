"""Modes side by side: bodies at the moment of their largest displacement."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...analysis.stability.modes import Modes
from ...core.errors import InvalidInput
from .bodies import draw_bodies
from .layout import Sheet
from .scene import SHOWN, Scene

MOST = 12  # modes in a picture
ACROSS = 4
WIDTH, HEIGHT, GAP = 2.8, 2.4, 0.15  # of a panel in inches


def modes_figure(result: Modes, *, title: str = "", most: int = MOST) -> Figure:
    """The first modes of a model; raises InvalidInput for a discrete problem."""
    if result.model is None:
        raise InvalidInput("plot: modes of a discrete problem have no bodies to show")
    count = min(len(result.s), most)
    across = min(ACROSS, max(count, 1))
    down = -(-max(count, 1) // across)
    sheet = Sheet(WIDTH * across, HEIGHT * down, title=title)
    scene = Scene.of(result.model)
    for k in range(count):
        row, column = divmod(k, across)
        low = HEIGHT * (down - 1 - row)
        axes = sheet.panel(WIDTH * column, low, WIDTH - GAP, HEIGHT - 2 * GAP)
        shape = result.displacement(k)
        whole = np.concatenate(list(shape)).ravel()
        largest = whole[np.abs(whole).argmax()]
        turn = np.abs(largest) / largest  # the moment at which that one is real
        factor = SHOWN * scene.size / float(np.abs(largest))
        draw_bodies(axes, scene, scene.moved([(turn * u).real for u in shape], factor))
        axes.set_title(_caption(result, k))
        axes.set_axis_off()
    return sheet.done()


def _caption(result: Modes, k: int) -> str:
    text = f"{k}: {result.frequency[k]:.5g}"
    return f"{text}, grows ({result.damping[k]:.1e})" if k in result.growing else text
