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
from amontons.core.files import replacing

from . import convergence
from .curves import chord_error, sampled, thinned
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
PAPER = {  # section 3.2.2
    "step": 5e-4, "min_step": 5e-7, "max_step": 0.5, "grow": 1.3, "shrink": 0.35,
    "residual": 5e-10, "change": 5e-10, "min_cosine": 0.99999, "corrections": 5, "quick": 4,
}  # fmt: skip
THEIRS = "algorithms 1 and 2, their settings"
WORDS = {"f": "separated", "-": "slip to the right", "+": "slip to the left", "s": "stick"}
CHECKS = ("residual", "error", "penetration", "tension", "r_n gap", "beyond the cone",
          "friction with the slip")  # fmt: skip
AMPLIFIED = 10  # displacements in figure 13
DPI = 150


def block(cells: int, mu: float = 1.8) -> am.Model:
    """The block, its top turned by 0.023 and pressed down by t (mm, N)."""
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
    return am.Model(
        [am.Body(am.box((40, 80), cells=(cells, 2 * cells)),
                 am.CiarletGeymonat.from_lame(4000.0, 120.0, 30.0),
                 integration="full")],
        supports=[am.Fix("top", lambda x, t: (x[0] * c, x[0] * s - t))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=mu)],
        name=f"block {cells}x{2 * cells}",
    )  # fmt: skip


def rotated(x: np.ndarray) -> tuple[float, float]:
    """U_0: the displacement of a rigid rotation by 0.023 about (0, 80)."""
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
    return x[0] * c - (x[1] - 80) * s, x[0] * s + (x[1] - 80) * c


def start(model: am.Model) -> np.ndarray:
    """The unknowns of the rotated body, which has no contact."""
    return am.at_rest(model, displacement=rotated).displacement[model.discretisation.free]


def follow(cells: int, options: am.Continuation, mu: float = 1.8) -> am.Branch:
    """The whole curve, gamma from 0 to 1."""
    model = block(cells, mu)
    return am.follow(model, "load", (0.0, 1.0), start=start(model), options=options)


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


def curve(branch: am.Branch) -> dict[str, Any]:
    """The monitored node along the branch, as it is drawn, and how far its chords are off."""
    dense = sampled(branch, lambda y, p: node_at(branch, y, p))
    drawn = thinned(dense)
    return {**drawn, "chords": chord_error(drawn, dense)}


def timed(cells: int, options: am.Continuation, mu: float = 1.8) -> tuple[am.Branch, float]:
    """The whole curve, and CPU seconds."""
    began = time.process_time()
    branch = follow(cells, options, mu)
    return branch, time.process_time() - began


def chosen(levels: Sequence[int]) -> list[int]:
    """The levels that the block has."""
    return [level for level in levels if level in LEVELS]


def run(levels: Sequence[int], out: Path) -> Iterator[dict[str, Any]]:
    """The block on each level by two step settings; draws figure 13 on the coarsest one."""
    for level in chosen(levels):
        cells = LEVELS[level]
        runs: dict[str, Any] = {}
        for name, options in SETTINGS.items():
            branch, cpu = timed(cells, options)
            runs[name] = record(branch, cpu)
            if len(runs) == 1:
                values = curve(branch)
                if level == min(LEVELS):
                    draw_shapes(branch, out / "figure13.png")
        yield {str(2 * cells**2): {"runs": runs, "curve": values}}


def run_theirs(levels: Sequence[int], out: Path) -> Iterator[dict[str, Any]]:
    """The block on each level by the algorithms and settings of the paper."""
    options = am.Continuation(**PAPER, switch=am.Switch.TANGENT)
    for level in chosen(levels):
        branch, cpu = timed(LEVELS[level], options)
        yield {str(2 * LEVELS[level] ** 2): record(branch, cpu) | {"curve": curve(branch)}}


def run_friction(levels: Sequence[int], out: Path) -> Iterator[dict[str, Any]]:
    """Figure 14: T_nu at the monitored node for several coefficients, on the first two levels.

    The finest would take an hour.
    """
    for level in chosen(levels)[:2]:
        rows = {}
        for mu in FRICTION:
            branch, _ = timed(LEVELS[level], am.Continuation(), mu)
            values = curve(branch)
            shown = {key: values[key] for key in ("gamma", "T_nu", "chords")}
            rows[str(mu)] = {"folds": [event.parameter for event in branch.folds], **shown}
        yield {str(2 * LEVELS[level] ** 2): rows}


# ------------------------------------------------------------------------------- figures
def draw_friction(found: dict[str, Any], path: Path) -> None:
    """Figure 14, one panel per mesh."""
    figure = Figure(figsize=(5 * len(found), 4.2), layout="constrained")
    panels = figure.subplots(1, len(found), squeeze=False, sharey=True)[0]
    lowest = 0.0
    for axes, squares in zip(panels, sorted(found, key=int), strict=True):
        for mu, row in found[squares].items():
            axes.plot(row["gamma"], row["T_nu"], lw=1.1, label=f"F = {mu}")
            pairs = zip(row["gamma"], row["T_nu"], strict=True)
            lowest = min([lowest, *(T for p, T in pairs if p < 0.7)])
        axes.set(xlabel=r"$\gamma$", xlim=(0.3, 0.7), title=f"{squares} squares")
    panels[0].set(ylabel=r"$T_\nu$ (N/mm$^2$) at (10, 0)", ylim=(1.1 * lowest, -0.05 * lowest))
    panels[0].legend()
    save(figure, path)


def draw_curves(found: dict[str, Any], path: Path) -> None:
    """Figure 12, of all levels that are stored."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    for axes, key in zip(figure.subplots(2, 2).ravel(), NODE, strict=True):
        for squares in sorted(found, key=int):
            values = found[squares]["curve"]
            axes.plot(values["gamma"], values[key], lw=1, label=f"{squares} squares")
        symbol = rf"${key[0]}_\{key[2:]}$"
        unit = "mm" if key[0] == "u" else "N/mm$^2$"
        axes.set(xlabel=r"$\gamma$", ylabel=f"{symbol} ({unit})")
    axes.legend()
    save(figure, path)


def draw_shapes(branch: am.Branch, path: Path) -> None:
    """Figure 13: the body at rest, and near the contact at 0.495, displacements amplified."""
    states, problem = branch.at(GAMMA), branch.problem.at(GAMMA)
    figure = Figure(figsize=(2.2 + 3.4 * len(states), 3.6), layout="constrained")
    panels = figure.subplots(
        1, len(states) + 1, width_ratios=[1.6, *[3.4] * len(states)]
    )  # fmt: skip
    X = problem.parts.X
    cells = branch_cells(branch)
    _outline(panels[0], X[cells])
    panels[0].set(xlim=(-6, 46), ylim=(-6, 86), aspect="equal", title="(a) at rest")
    for letter, axes, y in zip("bcd", panels[1:], states, strict=True):
        x = X + AMPLIFIED * problem.displacement(y)  # a contact at height 0 stays there
        _outline(axes, x[cells])
        low, high = x[X[:, 1] == 0, 0].min(), x[X[:, 1] == 0, 0].max()
        corner = WORDS[branch.problem.solution(y, GAMMA).pattern[-1]]
        axes.set(xlim=(low - 2, high + 6), ylim=(-1, 14), aspect="equal",
                 title=f"({letter}) corner: {corner}")  # fmt: skip
    save(figure, path)


def branch_cells(branch: am.Branch) -> np.ndarray:
    """The squares (k, 4) of the mesh on which a branch was computed."""
    nodes = len(branch.problem.step.parts.X)
    width = next(c for c in LEVELS.values() if (c + 1) * (2 * c + 1) == nodes)
    return block(width).bodies[0].mesh.cells[0].nodes


def _outline(axes: Any, corners: np.ndarray) -> None:
    """Cells, and the foundation."""
    axes.add_collection(PolyCollection(list(corners), facecolors="none",
                                       edgecolors="tab:blue", linewidths=0.5))  # fmt: skip
    axes.axhline(0.0, color="black")


# --------------------------------------------------------------------------------- page
def folds_table(found: dict[str, Any], known: dict[str, Any]) -> list[str]:
    """Folds by every method, beside the reference."""
    rows = []
    for squares in sorted(found, key=int):
        for name, one in found[squares]["runs"].items():
            row = {"squares": squares, "method": name}
            row |= {f"fold {k + 1}": f"{fold:.10f}" for k, fold in enumerate(one["folds"])}
            if squares in known:
                if "folds" in known[squares]:
                    row["folds off"] = fold_error(one, known[squares])
                row["solutions off"] = solution_error(one, known[squares])
            rows.append(row | {"points": one["points"], "ends": ", ".join(one["ends"]),
                               "CPU s": f"{one['cpu']:.1f}"})  # fmt: skip
    return table(rows)


def fold_error(run_: dict[str, Any], known: dict[str, Any]) -> float:
    """Largest difference of a fold from the reference; infinite for another number of them."""
    if len(run_["folds"]) != len(known["folds"]):
        return float("inf")
    return max(abs(a - b) for a, b in zip(run_["folds"], known["folds"], strict=True))


def solution_error(run_: dict[str, Any], known: dict[str, Any]) -> float:
    """Largest difference at the monitored node (mm, N/mm2) in all solutions that are stored.

    Infinite where the statuses of the contacts differ.
    """
    ours = sorted(run_["at 0.495"], key=lambda row: row["pattern"])
    theirs = sorted(known["at 0.495"], key=lambda row: row["pattern"])
    if [row["pattern"] for row in ours] != [row["pattern"] for row in theirs]:
        return float("inf")
    pairs = [*zip(ours, theirs, strict=True),
             *zip(run_["along"] if "along" in known else (), known.get("along", ()),
                  strict=True)]  # fmt: skip
    return max(abs(a[key] - b[key]) for a, b in pairs for key in NODE)


def page(found: dict[str, Any], known: dict[str, Any]) -> list[str]:
    """The tables of the block; known: reference values by squares."""
    checks, nodes, along = [], [], []
    for squares in sorted(found, key=int):
        first = next(iter(found[squares]["runs"].values()))
        for one in first["at 0.495"]:
            head = {"squares": squares, "right corner": WORDS[one["corner"]]}
            checks.append(head | {key: one[key] for key in CHECKS})
            nodes.append(head | {key: f"{round(one[key], 10) + 0.0:.10f}" for key in NODE})
        for one in first["along"]:
            row = {"squares": squares, "gamma": one["gamma"]}
            along.append(row | {key: f"{round(one[key], 10) + 0.0:.10f}" for key in NODE})
    chords = ", ".join(
        f"{found[s]['curve']['chords']:.1e}" for s in sorted(found, key=int)
        if "chords" in found[s]["curve"]
    )  # fmt: skip
    without = [squares for squares in found if THEIRS not in found[squares]["runs"]]
    left = [f"Not run by {THEIRS}: {', '.join(without)} squares (part `block-paper`).", ""]
    return [
        "## Rectangular block (section 3.2.2)", "", *folds_table(found, known),
        *(left if without else []),
        "The reference is GetFEM's element on the same squares with statuses solved for "
        "directly (`reference.json`); solutions off: largest difference at the node (10, 0), "
        "mm and N/mm2, in the three solutions at 0.495, whose statuses are the same at every "
        "contact, and on 800 squares at five other loads.", "",
        "The solutions at gamma = 0.495; residual in N, lengths in mm, products in N mm:", "",
        *table(checks), "The node at (10, 0) there (mm, N/mm2), signs of the paper:", "",
        *table(nodes), "and where the load has one solution:", "", *table(along),
        *convergence.page("figure 12", convergence.block_rows(found),
                          convergence.block_claims(found)),
        f"Chords of figure 12 are off the curves by {chords} of the ranges, mesh after mesh; "
        "where that is not said they join the points of the first method.", "",
    ]  # fmt: skip


def page_friction(found: dict[str, Any]) -> list[str]:
    """Folds for several coefficients."""
    rows = [
        {"squares": squares, "F": mu,
         "folds": ", ".join(f"{x:.6f}" for x in row["folds"]) or "none",
         "chords off": row["chords"]}
        for squares in sorted(found, key=int) for mu, row in found[squares].items()
    ]  # fmt: skip
    return ["## Block: friction and folds (figure 14)", "", *table(rows)]


def save(figure: Figure, path: Path) -> None:
    """As PNG, whole or not at all."""
    with replacing(path) as part:
        figure.savefig(part, dpi=DPI, format="png")
