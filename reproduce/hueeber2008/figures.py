"""Figures 4.2, 4.3, 5.1 (right), 5.2 and 5.3 with our numbers."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

from . import cube
from .runs import Run

OPEN, SLIP, STICK = "#9aa5b1", "#d9480f", "#1c6dd0"
STYLES = ("-", "--", ":")


def tangents(level: int, rows: np.ndarray) -> np.ndarray:
    """Local vectors (nc, 3) in x and y, (nc, 2), for the plane z = 0."""
    frames = np.concatenate([p.rows.frames for p in cube.model(level).discretisation.placed])
    return np.einsum("kij,ki->kj", frames[:, 1:], rows[:, 1:])[:, :2]


def status(solution: am.FrictionSolution, points: np.ndarray, level: int, path: Path) -> None:
    """Nodes by status, slip as lines, traction as arrows: figures 4.2 and 5.2."""
    slip, pull = tangents(level, solution.u), -tangents(level, solution.r)
    pressure = np.maximum(solution.r[:, 0], 0)
    closed = solution.status != am.ContactStatus.OPEN
    size = 4 + 60 * pressure / max(pressure.max(), 1e-300)
    figure, both = plt.subplots(1, 2, figsize=(13, 6.4), width_ratios=(1.15, 1))
    for axes, cut in zip(both, (None, ((0.55, 1.02), (0.55, 1.02))), strict=True):
        big = 1.0 if cut is None else 4.0
        for name, mask, colour in (
            ("open, slides", ~closed & solution.sliding, "#c9b458"),
            ("open", ~closed & ~solution.sliding, OPEN),
            ("closed, slides", closed & solution.sliding, SLIP),
            ("closed, sticks", closed & ~solution.sliding, STICK),
        ):
            if mask.any():
                axes.scatter(*points[mask, :2].T, s=big * size[mask], color=colour,
                             label=f"{name} ({mask.sum()})", zorder=2)  # fmt: skip
        scale = 1.5 * 2.0**-level
        line = slip * scale / max(np.linalg.norm(slip, axis=1).max(), 1e-300)
        moved = solution.sliding & (closed | isinstance(solution.problem.law, am.Tresca))
        ends = np.stack([points[moved, :2], points[moved, :2] + line[moved]], axis=1)
        axes.add_collection(matplotlib.collections.LineCollection(ends, colors="0.15", lw=0.8))
        arrows = np.linalg.norm(pull, axis=1) > 1e-9 * max(np.abs(pull).max(), 1e-300)
        unit = pull * scale / max(np.linalg.norm(pull, axis=1).max(), 1e-300)
        axes.quiver(*points[arrows, :2].T, *unit[arrows].T, angles="xy", scale_units="xy",
                    scale=1, width=0.0022, color="#2b8a3e", zorder=3)  # fmt: skip
        axes.set(xlabel="x", aspect="equal", title="" if cut is None else "cut-out")
        if cut is not None:
            axes.set(xlim=cut[0], ylim=cut[1])
    both[0].set_ylabel("y")
    both[0].legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncol=4, frameon=False)
    both[0].set_title("size: normal force; line: slip; arrow: traction on the plane")
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def sets(runs: dict[str, Run], path: Path) -> None:
    """Numbers of active nodes over the steps, K_l dashed: figure 5.3."""
    figure, grid = plt.subplots(2, 3, figsize=(12, 6), sharex=True)
    for axes, (level, run) in zip(grid.flat, runs.items(), strict=False):
        k = np.arange(1, run.steps + 1)
        axes.plot(k, run.normal, "-o", ms=3, color=SLIP, label="$|A_n|$")
        axes.plot(k, run.tangential, "-s", ms=3, color=STICK, label="$|A_\\tau|$")
        axes.axvline(run.settled, ls="--", color="0.4", label=f"$K_l$ = {run.settled}")
        axes.set_title(f"level {level}")
        axes.legend(frameon=False)
    for axes in grid[-1]:
        axes.set_xlabel("step k")
    for axes in grid.flat[len(runs) :]:
        axes.set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def modifications(runs: dict[str, Run], level: int, path: Path) -> None:
    """Error of lambda, alpha and beta at one node: figure 4.3."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 3.8))
    node = int(np.argmin(np.linalg.norm(cube.contact_points(level) - cube.NODE, axis=1)))
    best = min(runs.values(), key=lambda run: run.changes[-1]).iterates[-1].r
    for (name, run), style in zip(runs.items(), STYLES, strict=True):
        error = [np.linalg.norm(it.r - best) for it in run.iterates]
        k = np.arange(1, run.steps + 1)
        shown = np.array(error) > 0
        left.semilogy(k[shown], np.array(error)[shown], "o" + style, ms=3, label=name)
        middle.plot(k, [it.alpha[node] for it in run.iterates], "o" + style, ms=3, label=name)
        right.plot(k, [it.beta[node] for it in run.iterates], "o" + style, ms=3, label=name)
    for axes, title in ((left, "$|\\lambda^k - \\lambda^*|$"), (middle, "$\\alpha$"),
                        (right, "$\\beta$")):  # fmt: skip
        axes.set(xlabel="step k", title=title)
        axes.legend(frameon=False, title="modification")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def bound(solution: am.FrictionSolution, points: np.ndarray, path: Path) -> None:
    """Friction bound and shear force at all nodes: figure 5.1, right."""
    figure = plt.figure(figsize=(7, 5.4))
    axes = figure.add_subplot(projection="3d")
    shear = np.linalg.norm(solution.r[:, 1:], axis=1)
    limit = solution.problem.law.bound(solution.r)
    n = int(np.sqrt(len(points)))
    order = np.lexsort((points[:, 0], points[:, 1]))
    x, y, z = (a[order].reshape(n, n) for a in (points[:, 0], points[:, 1], shear))
    axes.plot_surface(x, y, z, cmap="viridis", alpha=0.75, linewidth=0)
    axes.scatter(*points[:, :2].T, limit, s=4, color=SLIP, label="bound $F \\lambda_n$")
    axes.set(xlabel="x", ylabel="y", zlabel="force at a node")
    axes.set_title("surface: $|\\lambda_\\tau|$; dots: friction bound")
    axes.view_init(28, -125)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)
