"""Work and figures of sections 6 and 7: shell, ring and tool."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import amontons as am

from . import figures, ring, shell, sketches
from .deformed import deformed
from .runs import INEXACT, Run, fixed_point, run

FINEST = 3  # level of the shell in the paper


def records(runs: dict[str, Run]) -> dict:
    """The numbers of several runs."""
    return {level: found.record() | {"counts": found.solution.counts}
            for level, found in runs.items()}  # fmt: skip


def table61(levels: list[int], out: Path) -> dict:
    """Table 6.1, with figures 6.3 and 6.4 on the finest level."""
    chosen = [k for k in levels if k <= FINEST]
    runs = shell.table61(chosen)
    last = chosen[-1]
    found = {mu: by_level[str(last)].solution for mu, by_level in runs["zero"].items()}
    for mu, solution in found.items():
        _contacts(last, float(mu), solution, out / f"figure6.3-{mu}.png")
    (placed,) = shell.model(last, 0.2).discretisation.placed
    radius = np.linalg.norm(placed.rows.points[:, :2], axis=1)
    weighted = {mu: (solution, placed.rows.weights) for mu, solution in found.items()}
    figures.radial(weighted, radius, out / "figure6.4.png")
    sketches.shell(out / "figure6.1a.png")
    return {
        name: {mu: records(by_level) for mu, by_level in group.items()}
        for name, group in runs.items()
    } | {"nodes": {str(k): shell.nodes(k) for k in chosen}}


def section6(levels: list[int], out: Path) -> dict:
    """F = 0.5 pressed and F = 0.7 pulled sideways: figures 6.1, 6.2, 6.5 and 6.6."""
    chosen = [k for k in levels if k <= FINEST]
    last = chosen[-1]
    pressed = {
        str(k): run(shell.model(k, 0.5).assemble(), fixed_point(**INEXACT), 1e-9,
                    start=shell.first_guess(shell.model(k, 0.5)))
        for k in chosen
    }  # fmt: skip
    solution, model = pressed[str(last)].solution, shell.model(last, 0.5)
    figures.sets({k: pressed[k] for k in pressed if k != "0"} or pressed, out / "figure6.5.png")
    deformed(model, solution, out / "figure6.1.png", cut=True)
    _contacts(last, 0.5, solution, out / "figure6.2.png")
    (rows,) = (placed.rows for placed in model.discretisation.placed)
    figures.tractions(solution, rows.points, rows.weights, out / "figure6.2b.png", normal=True)
    pulled_model = shell.model(last, 0.7, traction=True)
    pulled = run(pulled_model.assemble(), fixed_point(**INEXACT), 1e-9,
                 start=shell.first_guess(pulled_model))  # fmt: skip
    deformed(pulled_model, pulled.solution, out / "figure6.6a.png", cut=True)
    _contacts(last, 0.7, pulled.solution, out / "figure6.6b.png", traction=True)
    figures.tractions(
        pulled.solution, rows.points, rows.weights, out / "figure6.6c.png", normal=False
    )
    return {"pressed": records(pressed), "pulled": records({str(last): pulled})}


def ring_and_tool(levels: list[int], out: Path) -> dict:
    """Section 7: full Newton against the fixed point, figures 7.1 and 7.2; coarse up to 2."""
    fine = max(levels) > 2
    found = ring.newton(fine)
    model, solution = ring.model(fine), found["newton"].solution
    figures.newton({"ring and tool, F = 0.7": found}, out / "figure7.2b.png")
    deformed(model, solution, out / "figure7.1.png", view=(18, -70), cut=True)
    sketches.ring(out / "figure7.1a.png")
    _unrolled(model, solution, out / "figure7.2a.png")
    return records(found)


def figure73(levels: list[int], out: Path) -> Iterator[dict]:
    """Section 7 on the shell, levels 2 and 3, pair by pair; figure 7.3 on the finest."""
    chosen = [k for k in levels if 2 <= k <= FINEST] or [min(max(levels), FINEST)]
    compared: dict[str, dict[str, Run]] = {}
    for level in chosen:
        compared = {}
        for mu in (0.2, 0.4, 0.6):
            found = compared[f"shell, F = {mu}"] = shell.newton(level, mu)
            yield {f"shell, level {level}, F = {mu}": records(found)}
    figures.newton(compared, out / "figure7.3.png")


def _contacts(
    level: int, mu: float, solution: am.FrictionSolution, path: Path, *, traction: bool = False
) -> None:
    """Nodes of the cap seen from above."""
    model = shell.model(level, mu, traction)
    (placed,) = model.discretisation.placed
    figures.status(
        model, solution, placed.rows.points[:, :2], np.eye(3)[:2], 0.5 * 2.0**-level, path,
        ((0.12, 0.54), (0, 0.42)),
    )  # fmt: skip


def _unrolled(model: am.Model, solution: am.FrictionSolution, path: Path) -> None:
    """Nodes of the ring over angle and height."""
    (placed,) = model.discretisation.placed
    points = placed.rows.points
    angle = np.arctan2(points[:, 1], points[:, 0])
    around = np.column_stack([-np.sin(angle), np.cos(angle), np.zeros(len(angle))])
    axes = np.stack([around, np.broadcast_to([0.0, 0.0, 1.0], around.shape)], axis=1)
    figures.status(
        model, solution, np.column_stack([angle, points[:, 2]]), axes, 0.05, path,
        ((-0.3, 0.3), (-0.06, 0.52)), ("angle", "z"),
    )  # fmt: skip
