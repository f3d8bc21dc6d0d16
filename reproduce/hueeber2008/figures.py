"""The figures of the paper with our numbers."""

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
DPI = 110
STYLES = ("-", "--", ":")


Cut = tuple[tuple[float, float], tuple[float, float]] | None


def in_plane(model: am.Model, rows: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Tangential local vectors (nc, 3) along two directions (nc, 2, 3): (nc, 2)."""
    frames = np.concatenate([p.rows.frames for p in model.discretisation.placed])
    vectors = np.einsum("kij,ki->kj", frames[:, 1:], rows[:, 1:])
    return np.einsum("kaj,kj->ka", np.broadcast_to(axes, (len(rows), 2, 3)), vectors)


def status(
    model: am.Model, solution: am.FrictionSolution, points: np.ndarray, axes: np.ndarray,
    scale: float, path: Path, cut: Cut, words: tuple[str, str] = ("x", "y"),
) -> None:  # fmt: skip
    """Nodes by status, slip as lines, traction as arrows: figures 4.2, 5.2, 6.2, 6.3, 7.2.

    points (nc, 2) and axes (nc, 2, 3) or (2, 3): where nodes are drawn and along what; scale:
    length of the longest line, and of the longest arrow.  A long belt of nodes gets lines and
    arrows in the cut-out only.
    """
    slip, pull = in_plane(model, solution.u, axes), -in_plane(model, solution.r, axes)
    pressure = np.maximum(solution.r[:, 0], 0)
    size = 4 + 60 * pressure / max(pressure.max(), 1e-300)
    closed = solution.status != am.ContactStatus.OPEN
    moved = solution.sliding & (closed | isinstance(solution.problem.law, am.Tresca))
    pulled = np.linalg.norm(pull, axis=1) > 1e-9 * max(np.abs(pull).max(), 1e-300)
    figure, both = plt.subplots(1, 2, figsize=(13, 6.4), width_ratios=(1.15, 1))
    wide, high = np.ptp(points, axis=0)
    belt = wide >= 3 * high
    for frame, shown in zip(both, (None, cut), strict=True):
        dot = size * (3 if shown else 0.4 if belt else 0.8)
        for name, mask, colour in _kinds(solution, closed):
            if mask.any():
                frame.scatter(*points[mask].T, s=dot[mask], color=colour, zorder=2,
                              label=f"{name} ({mask.sum()})")  # fmt: skip
        line = slip * scale / max(np.linalg.norm(slip[moved], axis=1).max(initial=0), 1e-300)
        ends = np.stack([points[moved], points[moved] + line[moved]], axis=1)
        # at sliding nodes both have one direction: a broad line under a thin arrow
        lines = matplotlib.collections.LineCollection(
            ends, colors="0.25", lw=2.6 if shown else 1.1, zorder=2.5, alpha=0.6
        )
        unit = pull * scale / max(np.linalg.norm(pull, axis=1).max(), 1e-300)
        if shown or not belt:
            frame.add_collection(lines)
            frame.quiver(*points[pulled].T, *unit[pulled].T, angles="xy", scale_units="xy",
                         scale=1, width=0.0026, color="#1b5e20", zorder=3)  # fmt: skip
        shape = "auto" if belt and not shown else "equal"
        frame.set(xlabel=words[0], aspect=shape, title="cut-out" if shown else "")
        if shown:
            frame.set(xlim=shown[0], ylim=shown[1])
    both[0].set_ylabel(words[1])
    both[0].legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncol=4, frameon=False)
    both[0].set_title(
        "size: normal force; grey line: slip; arrow: shear force on the other side"
    )
    figure.savefig(path, dpi=DPI, bbox_inches="tight")
    plt.close(figure)


def _kinds(solution: am.FrictionSolution, closed: np.ndarray) -> list:
    """(name, which, colour) of the kinds of nodes."""
    sliding = solution.sliding
    tresca = isinstance(solution.problem.law, am.Tresca)
    if not tresca:
        sliding = sliding & closed  # an open node has nothing to slide against
    return [
        ("open, slides", ~closed & sliding, "#c9b458"),
        ("open, sticks" if tresca else "open", ~closed & ~sliding, OPEN),
        ("closed, slides", closed & sliding, SLIP),
        ("closed, sticks", closed & ~sliding, STICK),
    ]  # fmt: skip


def radial(solutions: dict, radius: np.ndarray, path: Path) -> None:
    """Normal and tangential traction and the bound over the distance: figure 6.4.

    solutions: {mu: (solution, weights)}, radius (nc,).
    """
    figure, axes = plt.subplots(1, len(solutions), figsize=(4.4 * len(solutions), 3.8))
    for frame, (mu, (solution, weights)) in zip(
        np.atleast_1d(axes), solutions.items(), strict=True
    ):
        normal = solution.r[:, 0] / weights
        shear = np.linalg.norm(solution.r[:, 1:], axis=1) / weights
        frame.plot(radius, normal, ".", ms=4, color=STICK, label="$\\lambda_n$")
        frame.plot(radius, shear, ".", ms=4, color=SLIP, label="$|\\lambda_\\tau|$")
        frame.plot(radius, float(mu) * normal, ".", ms=2, color="0.6", label="$F \\lambda_n$")
        frame.set(xlabel="distance from the middle", title=f"F = {mu}")
        frame.legend(frameon=False)
    np.atleast_1d(axes)[0].set_ylabel("traction")
    figure.tight_layout()
    figure.savefig(path, dpi=DPI)
    plt.close(figure)


def newton(runs: dict[str, dict[str, Run]], path: Path) -> None:
    """Relative error of lambda, fixed point against full Newton: figures 7.2 and 7.3.

    runs: {title: {method: run}}.
    """
    figure, axes = plt.subplots(
        1, len(runs), figsize=(4.4 * len(runs), 3.8), squeeze=False, sharey=True
    )
    for frame, (title, methods) in zip(axes[0], runs.items(), strict=True):
        best = methods["newton"].iterates[-1].r
        for (name, run), style in zip(methods.items(), ("-o", "--s"), strict=True):
            error = np.array([np.linalg.norm(it.r - best) for it in run.iterates])
            error /= np.linalg.norm(best)
            shown = error > 0
            label = {"newton": "full Newton", "fixed-point": "fixed point"}[name]
            frame.semilogy(np.flatnonzero(shown) + 1, error[shown], style, ms=3, label=label)
        frame.set(xlabel="step k", title=title)
        frame.legend(frameon=False)
    axes[0, 0].set_ylabel("$|\\lambda^k - \\lambda^*| / |\\lambda^*|$")
    figure.tight_layout()
    figure.savefig(path, dpi=DPI)
    plt.close(figure)


def sets(runs: dict[str, Run], path: Path) -> None:
    """Numbers of active nodes over the steps, K_l dashed: figures 5.3 and 6.5."""
    columns = 2 if len(runs) == 4 else min(len(runs), 3)
    rows = -(-len(runs) // columns)
    figure, grid = plt.subplots(
        rows, columns, figsize=(4.2 * columns, 3.2 * rows), squeeze=False
    )
    last = max(run.steps for run in runs.values())
    for axes, (level, run) in zip(grid.flat, runs.items(), strict=False):
        k = np.arange(1, run.steps + 1)
        axes.plot(k, run.normal, "-o", ms=3, color=SLIP, label="$|A_n|$")
        axes.plot(k, run.tangential, "-s", ms=3, color=STICK, label="$|A_\\tau|$")
        axes.axvline(run.settled, ls="--", color="0.4", label=f"$K_l$ = {run.settled}")
        axes.set(title=f"level {level}", xlabel="step k", xlim=(0, last + 1))
        axes.legend(frameon=False)
    for axes in grid.flat[len(runs) :]:
        axes.set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=DPI)
    plt.close(figure)


def modifications(runs: dict[str, Run], level: int, path: Path) -> None:
    """Error of lambda, alpha and beta at one node: figure 4.3."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 3.8))
    node = cube.node(level)
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
    figure.savefig(path, dpi=DPI)
    plt.close(figure)


def bound(solution: am.FrictionSolution, points: np.ndarray, path: Path) -> None:
    """Friction bound and shear force at all nodes: figure 5.1, right."""
    figure = plt.figure(figsize=(7, 5.4))
    _over_plane(figure.add_subplot(projection="3d"), points, solution, np.ones(len(points)),
                "force at a node", bounded=True)  # fmt: skip
    figure.savefig(path, dpi=DPI, bbox_inches="tight")
    plt.close(figure)


def tractions(
    solution: am.FrictionSolution, points: np.ndarray, weights: np.ndarray, path: Path, *,
    normal: bool,
) -> None:  # fmt: skip
    """lambda_n, if asked for, and |lambda_tau| with the bound: figures 6.2 and 6.6, right.

    points (nc, 3), weights (nc,): D_p, by which a force becomes a traction.
    """
    figure = plt.figure(figsize=(13, 5.2) if normal else (7, 5.4))
    if normal:
        left = figure.add_subplot(1, 2, 1, projection="3d")
        _over_plane(left, points, solution, weights, "traction", bounded=False)
    axes = figure.add_subplot(1, 1 + normal, 1 + normal, projection="3d")
    _over_plane(axes, points, solution, weights, "traction", bounded=True)
    figure.savefig(path, dpi=DPI, bbox_inches="tight")
    plt.close(figure)


def _over_plane(
    axes, points: np.ndarray, solution: am.FrictionSolution, weights: np.ndarray, unit: str, *,
    bounded: bool,
) -> None:  # fmt: skip
    """lambda_n over (x, y), or with `bounded` |lambda_tau| with dots at the friction bound."""
    shear = np.linalg.norm(solution.r[:, 1:], axis=1) / weights
    value = shear if bounded else solution.r[:, 0] / weights
    x, y = points[:, 0], points[:, 1]
    axes.plot_trisurf(x, y, value, cmap="viridis", alpha=0.75, linewidth=0)
    title = "$\\lambda_n$"
    if bounded:
        limit = solution.problem.law.bound(solution.r) / weights
        size = 4 if len(x) < 1500 else 1
        axes.scatter(x, y, limit, s=size, color=SLIP, depthshade=False)
        title = "surface: $|\\lambda_\\tau|$; dots: friction bound $F \\lambda_n$"
    axes.set(xlabel="x", ylabel="y", zlabel=unit, title=title)
    axes.view_init(28, -125)
