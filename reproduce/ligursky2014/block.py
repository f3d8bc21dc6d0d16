"""Section 3.2.2: the block at large strains on 800, 3200, 12800 squares, figures 12 to 14.

Forces at nodes are ours: r_N > 0 in compression.  The paper's normal points into the obstacle:
u_nu = -u_y, T_nu = -r_N / h, T_tau = r_T / h with the tangent to the right, h being the
length of boundary of a node.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import amontons as am
from amontons.evolution.timed import steady
from amontons.files import replacing

from .tables import table

LEVELS = {1: 20, 2: 40, 3: 80}  # cells along the width
GAMMA = 0.495
TURN = 0.023
ALONG = (0.25, 0.45, 0.52, 0.75, 1.0)  # gamma where there is one solution
MONITORED = (10.0, 0.0)
NODE = ("u_nu", "u_tau", "T_nu", "T_tau")
FRICTION = (0.6, 1.0, 1.4, 1.8, 2.2)  # figure 14
SETTINGS = {  # of the steps; else the options of the library
    "steps up to 0.1": am.Continuation(),
    "steps up to 0.02": am.Continuation(max_step=0.02, step=2e-4),
}
WORDS = {"f": "separated", "-": "slip to the right", "+": "slip to the left", "s": "stick"}
CHECKS = ("residual", "error", "penetration", "tension", "r_n gap", "beyond the cone",
          "friction with the slip")  # fmt: skip
DPI = 150


def block(cells: int, mu: float = 1.8) -> am.Model:
    """The block, its top turned by 0.023 and pressed down by t (mm, N)."""
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
    return am.Model(
        [am.Body(am.box((40, 80), cells=(cells, 2 * cells)),
                 am.CiarletGeymonat.from_lame(4000.0, 120.0, 30.0))],
        supports=[am.Fix("top", lambda x, t: (x[0] * c, x[0] * s - t))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=mu)],
        name=f"block {cells}x{2 * cells}",
    )  # fmt: skip


def start(model: am.Model) -> np.ndarray:
    """The rigid rotation by 0.023 about (0, 80), without contact."""
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
    moved = (model.bodies[0].mesh.points - [0, 80]) @ np.array([[c, s], [-s, c]])
    return moved.ravel()[model.discretisation.free]


def follow(cells: int, options: am.Continuation, mu: float = 1.8) -> am.Branch:
    """The whole curve, gamma from 0 to 1."""
    model = block(cells, mu)
    return am.follow(model, "load", (0.0, 1.0), start=start(steady(model)), options=options)


def record(branch: am.Branch, cpu: float) -> dict[str, Any]:
    """Folds, the solutions at gamma = 0.495, and what it took."""
    return {
        "folds": [event.parameter for event in branch.folds],
        "points": len(branch), "cpu": cpu,
        "status changes": sum(e.kind is am.EventKind.STATUS for e in branch.events),
        "ends": [stop.name.lower() for stop in branch.stops],
        "at 0.495": [solution_row(branch, y) for y in branch.at(GAMMA)],
        "along": [{"gamma": p, **node_at(branch, y, p)} for p in ALONG for y in branch.at(p)],
    }  # fmt: skip


def solution_row(branch: am.Branch, y: np.ndarray) -> dict[str, Any]:
    """One solution at gamma = 0.495: what the judge says, and the monitored node."""
    path = branch.problem
    problem, solution = path.at(GAMMA), path.solution(y, GAMMA)
    r, u = problem.reactions(y), problem.local_velocity(y)
    slide = np.abs(r[:, 1]) - 1.8 * r[:, 0]
    return {
        "corner": solution.pattern[-1], "pattern": solution.pattern,
        "error": solution.convergence.error,
        "residual": float(np.abs(problem.residual(y)).max()),
        "penetration": float(-u[:, 0].min()), "tension": float(-r[:, 0].min()),
        "r_n gap": float(np.abs(r[:, 0] * u[:, 0]).max()),
        "beyond the cone": float(slide.max()),
        "friction with the slip": float((r[:, 1] * u[:, 1]).max()),
        **node_at(branch, y, GAMMA),
    }  # fmt: skip


def node_at(branch: am.Branch, y: np.ndarray, gamma: float) -> dict[str, float]:
    """Displacements (mm) and stresses (N/mm2) at the monitored node, signs of the paper."""
    problem = branch.problem.at(gamma)
    r, u = problem.reactions(y), problem.local_velocity(y)
    k = int(np.argmin(np.linalg.norm(problem.parts.points - MONITORED, axis=1)))
    h = float(np.diff(problem.parts.points[:2, 0])[0])
    return {"u_nu": -float(u[k, 0]), "u_tau": float(u[k, 1]),
            "T_nu": -float(r[k, 0]) / h, "T_tau": float(r[k, 1]) / h}  # fmt: skip


def curve(branch: am.Branch) -> dict[str, list[float]]:
    """The monitored node along the branch, as in figure 12."""
    rows = [
        {"gamma": point.parameter, **node_at(branch, point.state, point.parameter)}
        for point in branch
    ]
    return {key: [row[key] for row in rows] for key in rows[0]}


def run(levels: Sequence[int], out: Path) -> Iterator[dict[str, Any]]:
    """The block on each level by two step settings; draws figure 13 on the coarsest one."""
    for level in (level for level in levels if level in LEVELS):
        cells = LEVELS[level]
        runs: dict[str, Any] = {}
        for name, options in SETTINGS.items():
            began = time.process_time()
            branch = follow(cells, options)
            runs[name] = record(branch, time.process_time() - began)
            if len(runs) == 1:
                values = curve(branch)
                if level == min(LEVELS):
                    draw_shapes(branch, out / "figure13.png")
        yield {str(2 * cells**2): {"runs": runs, "curve": values}}


def run_friction(levels: Sequence[int], out: Path) -> dict[str, list[float]]:
    """Figure 14: T_nu at the monitored node for several coefficients, on the coarsest level."""
    figure = Figure(figsize=(6, 4.5), layout="constrained")
    axes = figure.add_subplot()
    folds, lowest = {}, 0.0
    cells = LEVELS[min((level for level in levels if level in LEVELS), default=1)]
    for mu in FRICTION:
        branch = follow(cells, am.Continuation(), mu)
        folds[str(mu)] = [event.parameter for event in branch.folds]
        values = curve(branch)
        axes.plot(values["gamma"], values["T_nu"], label=f"F = {mu}")
        inside = [T for p, T in zip(values["gamma"], values["T_nu"], strict=True) if p < 0.7]
        lowest = min(lowest, *inside)
    axes.set(xlabel=r"$\gamma$", ylabel=r"$T_\nu$ (N/mm$^2$) at (10, 0)", xlim=(0.3, 0.7),
             ylim=(1.1 * lowest, -0.05 * lowest))  # fmt: skip
    axes.legend()
    save(figure, out / "figure14.png")
    return folds


def draw_curves(found: dict[str, Any], path: Path) -> None:
    """Figure 12, of all levels that are stored."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    for axes, key in zip(
        figure.subplots(2, 2).ravel(), NODE, strict=True
    ):
        for squares in sorted(found, key=int):
            values = found[squares]["curve"]
            axes.plot(values["gamma"], values[key], lw=1, label=f"{squares} squares")
        symbol = rf"${key[0]}_\{key[2:]}$"
        unit = "mm" if key[0] == "u" else "N/mm$^2$"
        axes.set(xlabel=r"$\gamma$", ylabel=f"{symbol} ({unit})")
    axes.legend()
    save(figure, path)


def draw_shapes(branch: am.Branch, path: Path) -> None:
    """Figure 13: near the contact zone at gamma = 0.495, displacements ten times amplified."""
    states, problem = branch.at(GAMMA), branch.problem.at(GAMMA)
    figure = Figure(figsize=(4 * len(states), 2.6), layout="constrained")
    X, cells = problem.parts.X, problem.parts.bodies[0].blocks[0].nodes
    for axes, y in zip(figure.subplots(1, len(states), squeeze=False)[0], states, strict=True):
        x = X + 10 * problem.displacement(y)  # a contact at height 0 stays there
        axes.add_collection(PolyCollection(list(x[cells]), facecolors="none",
                                           edgecolors="tab:blue", linewidths=0.5))  # fmt: skip
        axes.axhline(0.0, color="black")
        low, high = x[X[:, 1] == 0, 0].min(), x[X[:, 1] == 0, 0].max()
        corner = WORDS[branch.problem.solution(y, GAMMA).pattern[-1]]
        axes.set(xlim=(low - 2, high + 6), ylim=(-1, 14), aspect="equal",
                 title=f"right corner: {corner}")  # fmt: skip
    save(figure, path)


def page(found: dict[str, Any]) -> list[str]:
    """The tables of the block."""
    folds, checks, nodes, along = [], [], [], []
    for squares in sorted(found, key=int):
        runs = found[squares]["runs"]
        for name, run_ in runs.items():
            row = {"squares": squares, "steps": name}
            row |= {f"fold {k + 1}": f"{fold:.10f}" for k, fold in enumerate(run_["folds"])}
            folds.append(row | {"points": run_["points"], "ends": ", ".join(run_["ends"]),
                                "CPU s": f"{run_['cpu']:.1f}"})  # fmt: skip
        for one in next(iter(runs.values()))["at 0.495"]:
            head = {"squares": squares, "right corner": WORDS[one["corner"]]}
            checks.append(head | {key: one[key] for key in CHECKS})
            nodes.append(head | {key: f"{round(one[key], 10) + 0.0:.10f}" for key in NODE})
        for one in next(iter(runs.values()))["along"]:
            row = {"squares": squares, "gamma": one["gamma"]}
            along.append(row | {key: f"{round(one[key], 10) + 0.0:.10f}" for key in NODE})
    return [
        "## Rectangular block (section 3.2.2)", "", *table(folds),
        "The solutions at gamma = 0.495; residual in N, lengths in mm, products in N mm:", "",
        *table(checks), "The node at (10, 0) there (mm, N/mm2), signs of the paper:", "",
        *table(nodes), "and where the load has one solution:", "", *table(along),
    ]  # fmt: skip


def page_friction(found: dict[str, list[float]]) -> list[str]:
    """Folds for several coefficients."""
    rows = [{"F": mu, "folds": ", ".join(f"{x:.6f}" for x in folds) or "none"}
            for mu, folds in found.items()]  # fmt: skip
    return ["## Block: friction and folds (figure 14)", "", *table(rows)]


def save(figure: Figure, path: Path) -> None:
    """As PNG, whole or not at all."""
    with replacing(path) as part:
        figure.savefig(part, dpi=DPI, format="png")
