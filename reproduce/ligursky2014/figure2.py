"""Figure 2: zeros of examples 1 and 2 around the origin, and the null directions there.

A direction in which no zeros lie, or along which more than one branch leaves, is what the
examples are about: the first-order system alone can not tell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from amontons.core.files import replacing

Array = np.ndarray
AHEAD = np.linspace(0, 1, 201)
TINY = 1e-6  # at which a directional derivative is read off
DPI = 150


def G(p: Array, x: Array) -> Array:
    """Example 1, the first function."""
    return np.abs(x) + np.where(p >= 0, p**2, p)


def H(p: Array, x: Array) -> Array:
    """Example 1, the second function."""
    return np.where(p < 0, p**2, 0.0) - np.abs(x)


def pitchfork(p: Array, x: Array) -> Array:
    """Example 2."""
    return x * (x**2 - p)


@dataclass(frozen=True, eq=False)
class Panel:
    """A function, the branches of its zeros as (p, x), and the null directions in the origin.

    directions: None for all of them.
    """

    title: str
    function: Callable[[Array, Array], Array]
    branches: Sequence[tuple[Array, Array]]
    directions: Sequence[tuple[float, float]] | None


PANELS = (
    Panel("(a) example 1, G", G, [(-AHEAD, AHEAD), (-AHEAD, -AHEAD)],
          [(1, 0), (-1, 1), (-1, -1)]),
    Panel("(b) example 1, H", H,
          [(AHEAD, 0 * AHEAD), (-AHEAD, AHEAD**2), (-AHEAD, -(AHEAD**2))], [(1, 0), (-1, 0)]),
    Panel("(c) example 2", pitchfork,
          [(AHEAD, 0 * AHEAD), (-AHEAD, 0 * AHEAD), (AHEAD**2, AHEAD), (AHEAD**2, -AHEAD)],
          None),
)  # fmt: skip


def run(levels: Sequence[int], out: Path) -> list[dict[str, Any]]:
    """Draws the figure; what is drawn, and that it is a zero, as numbers."""
    figure = Figure(figsize=(10.5, 3.6), dpi=DPI, layout="constrained")
    for axes, panel in zip(figure.subplots(1, 3), PANELS, strict=True):
        for p, x in panel.branches:
            axes.plot(p, x, color="tab:blue", lw=1.6)
        for direction in panel.directions or ():
            style = {"arrowstyle": "->", "color": "tab:red", "lw": 1.4}
            axes.annotate("", 0.5 * np.array(direction), (0, 0), arrowprops=style)
        if panel.directions is None:
            axes.add_patch(Circle((0, 0), 0.3, fill=False, color="tab:red", lw=1.4))
        axes.set(title=panel.title, xlabel=r"$\gamma$", ylabel="$x$", aspect="equal",
                 xlim=(-1.05, 1.05), ylim=(-1.05, 1.05))  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    with replacing(out / "figure2.png") as part:
        figure.savefig(part, dpi=DPI, format="png")
    return [row(panel) for panel in PANELS]


def row(panel: Panel) -> dict[str, Any]:
    """One panel in numbers."""
    angles = np.linspace(0, 2 * np.pi, 64)
    all_of_them = list(zip(np.cos(angles), np.sin(angles), strict=True))
    slopes = [
        abs(float(panel.function(np.array(TINY * p), np.array(TINY * x)))) / TINY
        for p, x in panel.directions or all_of_them
    ]
    return {
        "panel": panel.title, "one-sided branches": len(panel.branches),
        "null directions": "all" if panel.directions is None
        else ", ".join(f"({p:g}, {x:g})" for p, x in panel.directions),
        "largest value on the branches": max(
            float(np.abs(panel.function(p, x)).max()) for p, x in panel.branches),
        "largest slope along the directions": max(slopes),
    }  # fmt: skip
