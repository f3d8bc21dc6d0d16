"""All solutions over mu, the slip solution and critical coefficients: sections 5.1 and 5.2."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.analysis.certificates.critical_friction import critical_friction
from amontons.mechanics.ready.hild import hild_triangle

from .triangle import Triangle, mesh

COEFFICIENTS = tuple(round(0.1 * k, 1) for k in range(51))
COLOURS = {"f": "#9aa5b1", "s": "#1c6dd0", "+": "#d9480f", "-": "#d9480f"}
WORDS = {"f": "free", "s": "stick", "+": "slip", "-": "slip"}
REFINED = (2, 4, 8, 12, 16, 20, 24)  # contact nodes
SCALE = 0.06  # of displacements in the figure
DPI = 110


def enumeration(sizes: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7)) -> dict:
    """Number of solutions of each mesh over mu = 0, 0.1, …, 5, and whether all is proved."""
    found: dict[str, dict] = {}
    for n_c in sizes:
        local = Triangle(n_c, 1.0).local
        lists = [am.all_solutions(local.with_mu(mu)) for mu in COEFFICIENTS]
        found[str(n_c)] = {
            "runs": _runs([len(one) for one in lists]),
            "complete": all(one.complete for one in lists),
            "slip at 3.5": [one.pattern for one in lists[35].solutions if "+" in one.pattern],
        }
    return found


def _runs(counts: list[int]) -> list[list[float]]:
    """[first mu, last mu, number] of stretches with the same number."""
    runs: list[list[float]] = []
    for mu, count in zip(COEFFICIENTS, counts, strict=True):
        if runs and runs[-1][2] == count:
            runs[-1][1] = mu
        else:
            runs.append([mu, mu, count])
    return runs


def critical(sizes: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7)) -> dict:
    """mu_P, mu_c of full contact, and bounds of the critical friction for every load."""
    found = {}
    for n_c in sizes:
        bounds = critical_friction(Triangle(n_c, 1.0).local)
        found[str(n_c)] = {"mu_P": bounds.p_matrix, "mu_c": bounds.full_contact,
                           "lower": bounds.lower, "upper": bounds.upper}  # fmt: skip
    return found


def slip_figure(path: Path, n_c: int = 25, mu: float = 3.5) -> dict:
    """Figure 1: the third solution on the deformed mesh, and the others beside it."""
    triangle = Triangle(n_c, mu)
    listed = am.all_solutions(triangle.local)
    solutions = sorted(listed.solutions, key=lambda one: (len(set(one.pattern)), one.energy))
    figure, frames = plt.subplots(len(solutions), 1, figsize=(8, 2.4 * len(solutions)))
    for frame, one in zip(np.atleast_1d(frames), solutions, strict=True):
        _draw(frame, triangle, one)
    figure.tight_layout()
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return {"solutions": [_counts(one) for one in solutions], "complete": listed.complete}


def _counts(one: am.PieceSolution) -> dict:
    words = [WORDS[letter] for letter in one.pattern]
    return {"counts": {word: words.count(word) for word in ("free", "stick", "slip")},
            "error": one.error, "energy": one.energy}  # fmt: skip


def _draw(frame: plt.Axes, triangle: Triangle, one: am.PieceSolution) -> None:
    """The mesh with displacements times SCALE, contact nodes in the colour of their status."""
    parts, points = triangle.model.discretisation, mesh(triangle.n_c).points
    values = np.array(parts.prescribed, dtype=float)
    values[parts.free] = triangle.problem.velocity(one.r)[1]
    moved = points + SCALE * values.reshape(-1, 2)
    cells = mesh(triangle.n_c).cells[0].nodes
    frame.triplot(*points.T, cells, color="#e3e6ea", linewidth=0.5)
    frame.triplot(*moved.T, cells, color="#5c6773", linewidth=0.5)
    places = np.column_stack([triangle.places, np.zeros(triangle.n_c)])
    here = places + SCALE * one.u[:, ::-1]
    for word in dict.fromkeys(WORDS.values()):
        chosen = [k for k, letter in enumerate(one.pattern) if WORDS[letter] == word]
        if chosen:
            colour = COLOURS[one.pattern[chosen[0]]]
            frame.plot(
                *here[chosen].T, "o", color=colour, ms=4, label=f"{word} ({len(chosen)})"
            )
    frame.axhline(0, color="black", linewidth=0.8)
    frame.set_aspect("equal")
    frame.set_axis_off()
    frame.legend(loc="upper left", frameon=False)
    frame.set_title(f"energy {one.energy:.4f}, displacements times {SCALE:g}", fontsize=9)


def refinement(mu: float = 3.5) -> dict:
    """Patterns and energies of the slip solutions on structured meshes, coarse to fine."""
    found = {}
    for n in REFINED:
        local = hild_triangle(n, mu=mu).assemble().condensed()
        listed = am.all_solutions(local)
        slips = [one for one in listed.solutions if set(one.pattern) & {"+", "-"}]
        found[str(n)] = {"slip": [[one.pattern, one.energy] for one in slips],
                         "complete": listed.complete}  # fmt: skip
    return found
