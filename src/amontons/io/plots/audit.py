"""Where an answer is wrong: the bodies, and what each contact does against the law."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...analysis.audit import Audit, PairAudit
from ...analysis.audit.verdict import RIGHT
from ...problem.law.states import ContactStatus
from .bodies import draw_bodies
from .layout import Sheet
from .scene import Frame, Scene, magnification
from .style import ALARM, INK

ROW, BODIES, PANEL = 3.9, 3.9, 4.2  # height of a row, widths of the panels, inches
NEAR = 1e-3  # of the largest extent: points that lie on each other
MOST = 4  # pairs that are drawn, each a row


def audit_figure(found: Audit, title: str = "") -> Figure:
    """The deformed bodies, and pressure at the contacts with those that can not be ringed."""
    pairs = found.pairs[:MOST]
    rows = len(pairs)
    sheet = Sheet(BODIES + PANEL + 1.4, ROW * rows, title=f"{title or found.title}: "
                  f"{found.verdict}", note="", rows=1)  # fmt: skip
    scene = Scene.of(found.model)
    status = np.concatenate([statuses(pair) for pair in found.pairs])
    frame = Frame(0.0, found.displacement, status)
    factor = magnification(scene, [frame])
    axes = sheet.panel(0.5, 0.6, BODIES - 0.6, ROW - 0.95)
    draw_bodies(axes, scene, scene.moved(found.displacement, factor), status)
    axes.set_title(f"Bodies, displacements × {factor:g}")
    for k, pair in enumerate(pairs):
        low = ROW * (rows - 1 - k) + 0.65
        _draw(sheet.panel(BODIES + 0.7, low, PANEL - 0.6, ROW - 1.1), pair)
    return sheet.done()


def statuses(pair: PairAudit) -> np.ndarray:
    """ContactStatus (nc,) of a pair as its slave sees it."""
    one = pair.seen[0]
    closed = np.where(one.slides, ContactStatus.SLIP, ContactStatus.STICK)
    return np.where(one.pressed, closed, ContactStatus.OPEN).astype(np.int8)


def _draw(axes: Axes, pair: PairAudit) -> None:
    """Contacts of one pair seen along an axis, coloured by traction."""
    one = max(pair.seen, key=lambda s: int(s.impossible.sum()))
    side = one.side
    traction = side.r[:, 0] / side.weight
    if side.points.shape[1] == 2:
        axis = int(np.ptp(side.points, axis=0).argmax())
        where = side.points[:, axis], traction
        names = "xy"[axis], "pressure"
        axes.plot(*where, "o", color=INK, markersize=4)
    else:
        first, second = _plane(side.points)
        where = side.points[:, first], side.points[:, second]
        names = "xyz"[first], "xyz"[second]
        drawn = axes.scatter(*where, c=traction, s=24, cmap="viridis")
        assert axes.figure is not None
        axes.figure.colorbar(drawn, ax=axes, label="pressure")
    bad = one.impossible
    axes.plot(where[0][bad], where[1][bad], "o", markersize=11, fillstyle="none", color=ALARM)
    axes.set(xlabel=names[0], ylabel=names[1])
    wrong = [name for name, one in pair.findings.items() if one.verdict is not RIGHT]
    fails = f"{', '.join(wrong)} not right, " if wrong else ""
    axes.set_title(f"{pair.name}: {fails}{int(bad.sum())} contacts can not be so")


def _plane(points: np.ndarray) -> tuple[int, int]:
    """The two axes along which most points (n, 3) lie apart, and furthest."""
    span = np.ptp(points, axis=0)
    places = np.round(points / (NEAR * (float(span.max()) or 1.0)))

    def apart(axes: tuple[int, int]) -> tuple[int, float]:
        return len(np.unique(places[:, list(axes)], axis=0)), float(span[list(axes)].sum())

    return max(((0, 1), (0, 2), (1, 2)), key=apart)
