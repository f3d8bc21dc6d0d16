"""The problems as sketches, with supports and sizes: left of figures 4.1, 6.1 and 7.1."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from . import figures
from . import ring as ring_sizes
from .shapes import ANGLE, HIGH, INNER, LOW, OUTER, RADIUS, RIM, TOP

BODY, OTHER, HELD, MOVED = "#cfd8e3", "#e8dcc8", "#c0392b", "#1b5e20"


def _save(figure: plt.Figure, path: Path) -> None:
    figure.savefig(path, dpi=figures.DPI, bbox_inches="tight")
    plt.close(figure)


def _measure(axes, start, end, text: str, shift=(0.0, 0.0)) -> None:
    """A length between two points with its name."""
    axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "lw": 0.9})
    middle = (np.array(start) + np.array(end)) / 2 + shift
    axes.text(*middle, text, ha="center", va="center", bbox={"fc": "white", "ec": "none",
              "pad": 1})  # fmt: skip


def cube(path: Path) -> None:
    """The cube over the plane, and where its upper face is moved to."""
    figure = plt.figure(figsize=(6, 5))
    axes = figure.add_subplot(projection="3d")
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    for a in range(8):
        for b in range(a):
            if np.abs(corners[a] - corners[b]).sum() == 1:
                axes.plot(*corners[[a, b]].T, color="0.4", lw=1)
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    x, y = ring.T
    axes.plot(x, y + 0.2, 1.06 - 0.15 * x, color=MOVED, lw=2, label="prescribed upper face")
    side = np.linspace(0.1, 0.9, 3)
    for p in side:
        for q in side:
            axes.quiver(p, q, 1, 0, 0.2, 0.06 - 0.15 * p, color=MOVED, lw=0.9)
    plane = np.array([[-0.2, 1.2], [-0.2, 1.2]])
    axes.plot_surface(plane, plane.T, np.zeros((2, 2)), color=OTHER, alpha=0.5)
    axes.text2D(0.02, 0.9, "below: rigid plane, contact with friction",
                transform=axes.transAxes)  # fmt: skip
    axes.text2D(0.02, 0.96, "E = 200, nu = 0.3; above: u = (0, 0.2, 0.06 - 0.15 x)",
                transform=axes.transAxes)  # fmt: skip
    axes.set(xlabel="x", ylabel="y", zlabel="z", xlim=(-0.2, 1.2), ylim=(-0.2, 1.4),
             zlim=(0, 1.2))  # fmt: skip
    axes.set_box_aspect((1.4, 1.6, 1.2))
    axes.view_init(20, -55)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_ticks([0, 1])
    axes.legend(loc="upper left", bbox_to_anchor=(0, 0.9), frameon=False)
    _save(figure, path)


def shell(path: Path) -> None:
    """Half a spherical shell and the body that is pressed into it, sections y = 0."""
    figure, axes = plt.subplots(figsize=(7.4, 4.8))
    angle = np.linspace(-np.pi / 2, np.pi / 2, 200)
    arc = np.array([np.sin(angle), -np.cos(angle)])
    axes.fill(*np.concatenate([OUTER * arc.T, INNER * arc.T[::-1]]).T, fc=OTHER, ec="k")
    axes.plot(*(OUTER * arc), color=HELD, lw=3, label="fixed")
    part = np.linspace(-ANGLE, ANGLE, 100)
    cap = np.column_stack([RADIUS * np.sin(part), RADIUS - INNER - RADIUS * np.cos(part)])
    outline = np.concatenate([cap, [[TOP, HIGH], [-TOP, HIGH]]])
    axes.fill(*outline.T, fc=BODY, ec="k")
    axes.plot([-TOP, TOP], [HIGH, HIGH], color=MOVED, lw=3, label="moved by (0, 0, -0.2)")
    for x in np.linspace(-TOP, TOP, 5):
        axes.annotate("", (x, HIGH - 0.02), (x, HIGH + 0.13),
                      arrowprops={"arrowstyle": "->", "color": MOVED})  # fmt: skip
    for angle_of, size, name in ((-1.25, INNER, "$r_i$ = 0.7"), (1.3, OUTER, "$r_a$ = 1")):
        end = size * np.array([np.sin(angle_of), -np.cos(angle_of)])
        axes.annotate("", end, (0, 0), arrowprops={"arrowstyle": "->", "lw": 0.8})
        axes.text(*(0.75 * end + [0, 0.04]), name, ha="center")
    centre = np.array([0, RADIUS - INNER])
    end = centre + RADIUS * np.array([np.sin(0.75), -np.cos(0.75)])
    axes.annotate("", end, centre, arrowprops={"arrowstyle": "->", "lw": 0.8})
    axes.text(0.12, -0.43, "r = 0.6", ha="center")
    _measure(axes, (0, HIGH - 0.06), (TOP, HIGH - 0.06), "d = 0.3", (-0.04, -0.06))
    _measure(axes, (-0.12, -INNER), (-0.12, HIGH), "h = 0.5")
    axes.plot([RIM, -RIM], [LOW, LOW], "k.", ms=4)
    axes.text(0, -0.86, "$\\Omega^m$: E = 400", ha="center")
    axes.text(0.1, -0.6, "$\\Omega^s$: E = 300", ha="center", va="center")
    axes.set(aspect="equal", xlabel="x", ylabel="z", ylim=(-1.05, 0.1))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncol=2, frameon=False)
    _save(figure, path)


def ring(path: Path) -> None:
    """The ring over the tool, which it penetrates, sections y = 0."""
    figure, axes = plt.subplots(figsize=(7.4, 4.4))
    sizes, tool = ring_sizes.RING, ring_sizes.TOOL
    low, high = tool["low"], tool["high"]
    for sign in (1, -1):
        x = sign * np.array([tool["inner"], ring_sizes.WIDE, ring_sizes.NARROW, tool["inner"]])
        axes.fill(x, [low, low, high, high], fc=OTHER, ec="k")
        axes.plot(x[:2], [low, low], color=HELD, lw=3, label="fixed" if sign == 1 else None)
        inner, outer = sign * sizes["inner"], sign * sizes["outer"]
        axes.fill([inner, outer, outer, inner],
                  [sizes["low"], sizes["low"], sizes["high"], sizes["high"]], fc=BODY, ec="k",
                  alpha=0.7)  # fmt: skip
        rim = sizes["high"] - (sizes["high"] - sizes["low"]) / ring_sizes.FINE[0][1]
        axes.plot([outer, outer], [rim, sizes["high"]], color=HELD, lw=4)
        axes.text(sign * 1.15, 0.25, "$\\Omega^s$", ha="center", va="center")
        axes.text(sign * 0.82, 0.25, "$\\Omega^m$", ha="center", va="center")
    axes.text(0, 0.25, "ring $\\Omega^s$: E = 9e7\ntool $\\Omega^m$: E = 8.13e8\nF = 0.7",
              ha="center", va="center")  # fmt: skip
    axes.annotate("they penetrate", (1.01, 0.03), (0.35, -0.12),
                  arrowprops={"arrowstyle": "->", "lw": 0.8})  # fmt: skip
    axes.set(aspect="equal", xlabel="x", ylabel="z")
    axes.legend(loc="upper center", frameon=False)
    _save(figure, path)
