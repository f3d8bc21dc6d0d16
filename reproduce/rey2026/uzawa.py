"""The augmented Lagrangian solved with Uzawa: section 3.1, algorithm 1.

Forces at the nodes of AB, springs eta times the length that belongs to a node.  lambda^0 are
forces and, as the formulas of the paper have it, the tangential ones act on the obstacle: the
opposite of r_T.  Newton's method starts from u^0 for every lambda.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import amontons as am
from amontons.solvers import Iterate, Target

from .triangle import Cell, Triangle, tally

NEWTON = 1e-10  # residual of the forces, not relative to the load
RHO = 1e-10  # rho_1 and rho_2: penetration, and slip of sticking nodes, at the end
JUDGED = 1e-8
UPDATES, STEPS = 20, 20  # for one element: with eta from 1e4 on three and six do, or none
NEAR = 1e-4  # energy norm of the error that names a solution: 1 / eta is an error, too
AGAINST = np.array([1.0, -1.0])  # lambda_T of the paper acts on the obstacle


def cells(table: Mapping) -> list[list[Cell]]:
    """A table over eta and u^0, with lambda^0 = 0, or lambda^0, with u^0 = 0."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = [_start(triangle, table["start"], column, k)
              for k, column in enumerate(table["columns"])]  # fmt: skip
    return [[run(triangle, eta, start) for start in starts] for eta in table["values"]]


def _start(triangle: Triangle, variable: str, column: list[float], k: int) -> Iterate:
    """u^0 = (u_x, u_y), or lambda^0 = (N, T); the exact stick and slip state where named."""
    exact = triangle.exact
    if variable == "u":
        return Iterate(np.zeros((1, 2)), np.array(column, dtype=float))
    name = {6: "stick", 7: "slip" if "slip" in exact else "stick"}.get(k, "")
    r = triangle.forces(exact[name]) if name else np.array([column])
    return Iterate(AGAINST * r, np.zeros(2))


def run(triangle: Triangle, eta: float, start: Iterate, updates: int = UPDATES) -> Cell:
    """The algorithm from r = lambda^0 and v = u^0 of `start`."""
    method = am.Uzawa(
        rho=eta * triangle.lengths.mean(), rho_strategy=am.RhoStrategy.CONSTANT,
        growth=1, newton_tolerance=NEWTON / float(np.linalg.norm(triangle.problem.f)),
        newton_steps=STEPS, inner_start=am.InnerStart.FIRST, line_search=am.FullStep(),
    )  # fmt: skip
    count, done = 0, False
    iterates = method.iterates(triangle.problem, start, Target(RHO))
    for _, iterate in zip(range(updates), iterates, strict=False):
        count += iterate.iterations
        done = _converged(triangle, iterate)
        if done:
            break
    return triangle.cell(iterate.v, converged=done, within=NEAR, iterations=count)


def _converged(triangle: Triangle, iterate: Iterate) -> bool:
    """The test of algorithm 1: no penetration, and no slip of nodes inside the cone.

    Open nodes with a force meet it as well, so the judge has to agree.
    """
    u, r = triangle.problem.local_velocity(iterate.v), iterate.r
    sticks = np.abs(r[:, 1]) < triangle.mu * r[:, 0]
    still = (u[:, 0] >= -RHO).all() and (np.abs(u[sticks, 1]) <= RHO).all()
    return bool(still) and triangle.problem.error(r, iterate.v) <= JUDGED


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over eta: how many random starts led to what.

    lambda_N^0 is uniform in [0, 0.5], lambda_T^0 and u^0 of all nodes in [-0.5, 0.5].
    """
    triangle = Triangle(table["n_c"], table["mu"])
    random = np.random.default_rng(seed)
    starts = []
    for _ in range(draws):
        r = random.uniform([0, -0.5], 0.5, (triangle.n_c, 2))
        starts.append(Iterate(r, random.uniform(-0.5, 0.5, triangle.problem.unknowns)))
    return tally(
        [run(triangle, eta, start, 1000) for start in starts] for eta in table["values"]
    )
