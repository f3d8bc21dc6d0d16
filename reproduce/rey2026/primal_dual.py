"""The primal-dual accelerated gradient method: section 3.4, algorithm 2.

Nodal contact forces, metric 1, no restarts.  The algorithm is read with û in the place of u,
with r_c multiplied by beta_k, and with s_n from u_n: see `README.md`.  A run ends by the change
of u as in the paper, and not by the judge: r = 0 on the way is no solution while u moves.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import amontons as am
from amontons.solvers import Iterate, Target

from .triangle import Cell, Triangle, tally

CHANGE = 1e-8  # |u^{k+1} - u^k| of the end; the paper's 1e-10 takes five times the iterations
LIMIT = 200_000
NEAR = 0.01  # energy norm of the error that names a solution: it is some 1e4 changes there


def cells(table: Mapping) -> list[list[Cell]]:
    """A table over alpha_0 and u^0, with r^0 = 0, or r^0, with u^0 = 0."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = [_start(triangle, table["start"], column, k)
              for k, column in enumerate(table["columns"])]  # fmt: skip
    return [[run(triangle, alpha, start) for start in starts] for alpha in table["values"]]


def _start(triangle: Triangle, variable: str, column: list[float], k: int) -> Iterate:
    """u^0 = (u_x, u_y), or r^0 = (r_T, r_N); the exact stick and slip state where named."""
    exact = triangle.exact
    if variable == "u":
        v = exact["slip"] if k == 8 and "slip" in exact else np.array(column, dtype=float)
        return Iterate(np.zeros((1, 2)), v)
    name = {6: "stick", 7: "slip"}.get(k, "")
    r = triangle.forces(exact[name]) if name in exact else np.array([column[::-1]])
    return Iterate(r, np.zeros(2))


def run(
    triangle: Triangle, alpha: float, start: Iterate, *, batch: int = 1,
    change: float = CHANGE, near: float = NEAR,
) -> Cell:  # fmt: skip
    """The algorithm from r and v of `start`."""
    method = am.AcceleratedGradient(
        alpha=alpha, metric=am.Metric.IDENTITY, restart=am.Restart.NEVER, batch=batch
    )
    count = 0
    for iterate in method.iterates(triangle.problem, start, Target(change)):
        count += batch
        if iterate.change <= change or count >= LIMIT:
            break
    done = iterate.change <= change
    return triangle.cell(iterate.v, converged=done, within=near, iterations=count)


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over alpha_0: how many random starts led to what.

    r^0 and the u^0 of AB are uniform in [-0.5, 0.5], u^0 elsewhere is zero (not in the paper).
    Free and stick are 2.9 apart in the energy norm, and a run is decided long before its end.
    """
    triangle = Triangle(table["n_c"], table["mu"])
    random = np.random.default_rng(seed)
    starts = []
    for _ in range(draws):
        r, u = random.uniform(-0.5, 0.5, (2, table["n_c"], 2))
        starts.append(Iterate(r, triangle.problem.H @ u.ravel()))
    return tally(
        [run(triangle, alpha, start, batch=500, change=1e-5, near=0.1) for start in starts]
        for alpha in table["values"]
    )
