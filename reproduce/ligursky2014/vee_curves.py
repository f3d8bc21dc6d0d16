"""Figures 9 to 11 of the V-shaped body, and what its curves do from mesh to mesh.

The curves are piecewise straight, linear elasticity under a load that grows along a line, and
followed from event to event: their chords are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import amontons as am
from amontons.core.files import replacing
from amontons.mechanics.ready.vee import vee as vee_model

from . import vee
from .tables import table

AMPLIFIED = 10  # displacements in figure 10
NAMES = {"u_nu": r"$u_\nu$ (m)", "u_tau": r"$u_\tau$ (m)",
         "T_nu": r"$T_\nu$ (GN/m$^2$)", "T_tau": r"$T_\tau$ (GN/m$^2$)"}  # fmt: skip
WORDS = {"f": "separated", "+": "left slip", "s": "stick"}
GROUND = 0.0  # height of the obstacle
FREE = 0.2  # a load under which the corner is separated, whatever the mesh
DPI = 150


@cache
def model(level: int) -> am.Model:
    """The body on one mesh; friction is of no account for what is asked of it here."""
    return vee_model(vee.mesh(level))


def corner_rows(level: int, branch: am.Branch) -> tuple[int, float]:
    """The contact at the most left node, and the length of boundary that it stands for."""
    fields = model(level).recover(branch.problem.solution(branch[0].state, 0.0))
    left = int(np.argmin(fields.points[:, 0]))
    return left, float(fields.weights[left])


def at_corner(branch: am.Branch, y: np.ndarray, p: float, left: int, weight: float) -> Any:
    """Displacements and stresses of the corner, signs of the paper."""
    solution = branch.problem.solution(y, p)
    u, r = solution.u[left], solution.r[left] / weight
    return {"u_nu": -float(u[0]), "u_tau": float(u[1]), "T_nu": -float(r[0]),
            "T_tau": float(r[1])}  # fmt: skip


def run(levels: Sequence[int], out: Path) -> dict[str, Any]:
    """Curves of the corner on all levels; draws figures 9 and 10."""
    found, branches = {}, {}
    for level in levels:
        branch = branches[level] = vee.follow(level, None)
        left, weight = corner_rows(level, branch)
        rows = [
            {"gamma": p, "status": branch.problem.solution(y, p).pattern[left],
             **at_corner(branch, y, p, left, weight)}
            for p in (0.0, FREE, vee.GAMMA) for y in branch.at(p)
        ]  # fmt: skip
        points = [
            {"gamma": x.parameter, **at_corner(branch, x.state, x.parameter, left, weight)}
            for x in branch
        ]
        found[str(vee.LEVELS[level])] = {
            "rows": rows, "folds": [fold.parameter for fold in branch.folds],
            "curve": {key: [row[key] for row in points] for key in points[0]},
        }  # fmt: skip
    draw_curves(found, out / "figure9.png")
    level = vee.coarsest(levels)
    draw_bodies(level, branches[level], out / "figure10.png")
    return found


def run_friction(levels: Sequence[int], out: Path) -> dict[str, Any]:
    """The normal stress of the corner for several coefficients, on all levels of the paper."""
    found: dict[str, Any] = {}
    for level in [level for level in levels if level > 0] or levels:
        rows = found[str(vee.LEVELS[level])] = {}
        for mu in vee.FRICTION:
            branch = vee.follow(level, None, mu)
            left, weight = corner_rows(level, branch)
            forces = (branch.states * branch.problem.to_r).reshape(len(branch), -1, 2)
            stress = (-forces[:, left, 0] / weight).tolist()
            rows[f"{mu:g}"] = {"folds": [fold.parameter for fold in branch.folds],
                               "gamma": branch.parameter.tolist(), "T_nu": stress}  # fmt: skip
    draw_friction(found, out / "figure11.png")
    return found


# ------------------------------------------------------------------------------- figures
def draw_curves(found: dict[str, Any], path: Path) -> None:
    """Figure 9: displacements and contact stresses of the corner, one line per mesh."""
    figure = Figure(figsize=(9.0, 6.4), dpi=DPI, layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    for triangles, one in found.items():
        for axes, (key, name) in zip(panels, NAMES.items(), strict=True):
            axes.plot(one["curve"]["gamma"], one["curve"][key], linewidth=1.1,
                      label=f"{triangles} triangles")  # fmt: skip
            axes.set(xlabel=r"$\gamma$", ylabel=name)
    panels[0].legend(frameon=False)
    save(figure, path)


def draw_bodies(level: int, branch: am.Branch, path: Path) -> None:
    """Figure 10: the body at rest, and its three states, displacements ten times amplified."""
    body = model(level)
    mesh = body.bodies[0].mesh
    solutions = [branch.problem.solution(y, vee.GAMMA) for y in branch.at(vee.GAMMA)]
    left, _ = corner_rows(level, branch)
    shapes = [("reference configuration", np.zeros_like(mesh.points))]
    shapes += [
        (f"corner: {WORDS[s.pattern[left]]}", body.recover(s).displacement[0])
        for s in solutions
    ]
    figure = Figure(figsize=(9.0, 7.8), dpi=DPI, layout="constrained")
    for letter, axes, (title, moved) in zip(
        "abcd", figure.subplots(2, 2).ravel(), shapes, strict=True
    ):
        x = mesh.points + AMPLIFIED * moved
        axes.add_collection(PolyCollection(list(x[mesh.cells[0].nodes]), facecolors="none",
                                           edgecolors="tab:blue", linewidths=0.3))  # fmt: skip
        axes.axhline(GROUND, color="black")
        axes.set(xlim=(-0.25, 0.9), ylim=(GROUND - 0.08, 0.88), aspect="equal",
                 title=f"({letter}) {title}")  # fmt: skip
    save(figure, path)


def draw_friction(found: dict[str, Any], path: Path) -> None:
    """Figure 11: one panel per mesh, one line per coefficient."""
    figure = Figure(figsize=(4.2 * len(found), 4.2), dpi=DPI, layout="constrained")
    panels = figure.subplots(1, len(found), squeeze=False, sharey=True)[0]
    for axes, (triangles, rows) in zip(panels, found.items(), strict=True):
        for mu, row in rows.items():
            axes.plot(row["gamma"], row["T_nu"], linewidth=1.1, label=f"F = {mu}")
        axes.set(xlabel=r"$\gamma$", title=f"{triangles} triangles")
    panels[0].set_ylabel(NAMES["T_nu"])
    panels[0].legend(frameon=False)
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """As PNG, whole or not at all."""
    with replacing(path) as part:
        figure.savefig(part, dpi=DPI, format="png")


def page_friction(found: dict[str, Any]) -> list[str]:
    """Folds for several coefficients on all meshes."""
    rows = [{"triangles": triangles, "F": mu,
             "folds": ", ".join(f"{x:.6f}" for x in row["folds"]) or "none"}
            for triangles, of in found.items() for mu, row in of.items()]  # fmt: skip
    return ["## Friction and folds on all meshes (figure 11)", "", *table(rows)]
