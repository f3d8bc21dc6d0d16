"""Alart and Curnier's generalised Newton method, reduced to the multipliers: section 3.3.

lambda are tractions at the nodes of AB: the contact forces are G lambda with the mass matrix G
of the shape functions on AB ("integral approximation"), so u = W G lambda + q, and Newton with
full steps runs on that problem.  lambda at B, which is held, is zero.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import amontons as am
from amontons.solvers import Iterate

from .triangle import Cell, Triangle, tally

LIMIT = 200  # Newton steps: it ends within ten or not at all
TOLERANCE = 1e-10  # of the judge; rounding leaves 1e-11 at eta = 1e-7


def cells(table: Mapping) -> list[list[Cell]]:
    """A table over eta and lambda^0; the last two columns are the exact stick and slip."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = [np.array([column[::-1]]) for column in table["columns"]]  # printed (T, N)
    starts[-2:] = [exact(triangle, "stick"), exact(triangle, "slip")]
    return [[run(triangle, eta, start) for start in starts] for eta in table["values"]]


def exact(triangle: Triangle, name: str) -> np.ndarray:
    """lambda (n_c, 2), rows (N, T), of the solution of that name; at mu = 3 slip is stick."""
    v = triangle.exact[name if name in triangle.exact else "stick"]
    return np.linalg.solve(triangle.mass, triangle.forces(v))


def run(triangle: Triangle, eta: float, start: np.ndarray) -> Cell:
    """Newton's method from lambda = start, rows (N, T)."""
    method = am.SemismoothNewton(
        line_search=am.FullStep(), rho=eta, rho_strategy=am.RhoStrategy.CONSTANT
    )
    found = am.drive(
        triangle.integral, method, tolerance=TOLERANCE, max_iterations=LIMIT,
        start=Iterate(start),
    )  # fmt: skip
    v = triangle.problem.velocity(triangle.mass @ found.r)[1]
    return triangle.cell(v, converged=found.converged, iterations=found.convergence.iterations)


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over eta: how many random lambda^0, uniform in [-0.5, 0.5], led to what."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = np.random.default_rng(seed).uniform(-0.5, 0.5, (draws, table["n_c"], 2))
    return tally([run(triangle, eta, start) for start in starts] for eta in table["values"])
