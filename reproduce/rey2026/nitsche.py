"""Nitsche's unsymmetric method with generalised Newton: section 3.2.

Eight Gauss points on every edge of AB, kappa as printed, full Newton steps from u^0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import amontons as am
from amontons.solvers import Iterate

from .triangle import Cell, Triangle, tally

POINTS = 8  # on an edge: from six on the tables are those of exact integration
TOLERANCE = 1e-10  # of the judge
LIMIT = 100  # Newton steps: one element takes ten; from random starts some never end
NEAR_SLIP = 0.5  # kappa times the distance to the exact slip is 0.6


def by_nitsche(triangle: Triangle, kappa: float, points: int = POINTS) -> am.Model:
    """The model with the contact of this page."""
    method = am.Nitsche(kappa=kappa, points=points)
    contacts = [replace(contact, method=method) for contact in triangle.model.contacts]
    return replace(triangle.model, contacts=contacts)


def cells(table: Mapping, points: int = POINTS) -> list[list[Cell]]:
    """A table over kappa and u^0 = (u_x, u_y); the last start is the exact slip, if any."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = [np.array(column, dtype=float) for column in table["columns"]]
    starts[-1] = triangle.exact.get("slip", starts[-1])
    return [[run(triangle, by_nitsche(triangle, kappa, points), start) for start in starts]
            for kappa in table["values"]]  # fmt: skip


def run(triangle: Triangle, model: am.Model, start: NDArray[np.float64]) -> Cell:
    """Newton's method from displacements (n,)."""
    found = am.solve(
        model, am.SemismoothNewton(line_search=am.FullStep()), tolerance=TOLERANCE,
        max_iterations=LIMIT, start=Iterate(np.zeros((0, 2)), start), check=False,
    )  # fmt: skip
    steps = found.convergence.iterations
    cell = triangle.cell(found.v, converged=found.converged, iterations=steps)
    if cell.kind == "other" and "slip" in triangle.exact:
        error = triangle.energy(found.v - triangle.exact["slip"])
        if error <= NEAR_SLIP and set(found.pattern) & {"+", "-"}:
            return Cell("slip", error, steps)  # the one of this kappa
    return cell


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over kappa: how many random u^0, uniform in [-0.5, 0.5], led to what."""
    triangle = Triangle(table["n_c"], table["mu"])
    random = np.random.default_rng(seed)
    starts = random.uniform(-0.5, 0.5, (draws, triangle.problem.unknowns))
    models = [by_nitsche(triangle, kappa) for kappa in table["values"]]
    return tally([run(triangle, model, start) for start in starts] for model in models)
