"""The primal-dual accelerated gradient method: section 3.4, algorithm 2.

Nodal contact forces, metric 1, no restarts.  The algorithm is read with û in the place of u,
with r_c multiplied by beta_k, and with s_n from u_n: see `README.md`.  A run ends when the
judge takes r and u: r = 0 on the way is no solution while u is out of balance with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

import amontons as am

from .triangle import Cell, Triangle, tally, triangle_of

TOLERANCE = 1e-6  # of the judge, on one element: the paper's change of 1e-10 makes it 1e-6
LOOSE = 1e-3  # the same from random starts: the ends are 2.9 apart, and long decided
LIMIT = 200_000
NEAR, FAR = 0.01, 0.1  # energy norm of the error that names a solution
BATCH, MANY = 20, 500  # iterations between two judgements


def method(alpha: float, batch: int) -> am.BasinMethod:
    """Algorithm 2 for one alpha_0."""
    solver = am.AcceleratedGradient(
        alpha=alpha, metric=am.Metric.IDENTITY, restart=am.Restart.NEVER, batch=batch
    )
    return am.BasinMethod(solver, "primal-dual", {"alpha_0": alpha})


def cells(
    table: Mapping, tolerance: float = TOLERANCE, near: float = NEAR
) -> list[list[Cell]]:
    """A table over alpha_0 and u^0, with r^0 = 0, or r^0, with u^0 = 0."""
    triangle = triangle_of(table["n_c"], table["mu"])
    starts = [_start(triangle, table["start"], column, k)
              for k, column in enumerate(table["columns"])]  # fmt: skip
    methods = [method(alpha, BATCH) for alpha in table["values"]]
    return triangle.study(
        methods, starts, within=near, tolerance=tolerance, max_iterations=LIMIT
    )


def _start(triangle: Triangle, variable: str, column: list[float], k: int) -> am.Iterate:
    """u^0 = (u_x, u_y), or r^0 = (r_T, r_N); the exact stick and slip state where named."""
    exact = triangle.exact
    if variable == "u":
        v = exact["slip"] if k == 8 and "slip" in exact else np.array(column, dtype=float)
        return am.Iterate(np.zeros((1, 2)), v)
    name = {6: "stick", 7: "slip"}.get(k, "")
    r = triangle.forces(exact[name]) if name in exact else np.array([column[::-1]])
    return am.Iterate(r, np.zeros(2))


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over alpha_0: how many random starts led to what.

    r^0 and the u^0 of AB are uniform in [-0.5, 0.5], u^0 elsewhere is zero (not in the paper).
    """
    triangle = triangle_of(table["n_c"], table["mu"])
    return tally(from_random(triangle, table["values"], draws, seed))


def from_random(
    triangle: Triangle, values: Sequence[float], draws: int, seed: int
) -> list[list[Cell]]:
    """What became of random starts, a row per alpha_0."""
    random = np.random.default_rng(seed)
    starts = []
    for _ in range(draws):
        r, u = random.uniform(-0.5, 0.5, (2, triangle.n_c, 2))
        starts.append(am.Iterate(r, triangle.problem.H @ u.ravel()))
    return triangle.study(
        [method(alpha, MANY) for alpha in values], starts, within=FAR, tolerance=LOOSE,
        max_iterations=LIMIT,
    )  # fmt: skip
