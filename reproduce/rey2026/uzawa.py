"""The augmented Lagrangian solved with Uzawa: section 3.1, algorithm 1.

NODAL: forces at the nodes of AB, springs eta times the length that belongs to a node.
INTEGRAL: the terms on AB at Gauss points, as the paper writes them; multipliers there, those of
a start being interpolated, springs eta times the weight of a point.

lambda^0 are, in the nodal reading, forces and, as the formulas of the paper have it, the
tangential ones act on the obstacle: the opposite of r_T.  Newton's method starts from u^0 for
every lambda.  -sigma_T in s and in the update is left out: lambda_T is all of the tangential
force, as in the paper's reference.  On a kink the derivative is that inside of the cone.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import lru_cache

import numpy as np

import amontons as am

from .alart_curnier import at_points
from .triangle import TOLERANCE, Cell, Triangle, tally, triangle_of

NEWTON = 1e-10  # residual of the forces, not relative to the load
STEPS = 20  # of Newton's method for one lambda
FEW, ITERATIONS = 400, 20_000  # of Newton's method in all, with one element and more
NEAR = 1e-4  # energy norm of the error that names a solution: 1 / eta is an error, too
NEAR_SLIP = 0.5  # of the integral reading, whose slip solution is not that of the nodes
AGAINST = np.array([1.0, -1.0])  # lambda_T of the paper acts on the obstacle


class Terms(Enum):
    """How the terms on AB are formed."""

    NODAL = "nodal"
    INTEGRAL = "integral"


def method(triangle: Triangle, eta: float, terms: Terms = Terms.NODAL) -> am.BasinMethod:
    """Algorithm 1 for one eta."""
    solver = am.Uzawa(
        rho=eta * (triangle.lengths.mean() if terms is Terms.NODAL else 1.0),
        rho_strategy=am.RhoStrategy.CONSTANT, growth=1,
        newton_tolerance=NEWTON / float(np.linalg.norm(triangle.problem.f)),
        newton_steps=STEPS, inner_start=am.InnerStart.FIRST, line_search=am.FullStep(),
    )  # fmt: skip
    if terms is Terms.NODAL:
        return am.BasinMethod(solver, "uzawa", {"eta": eta})
    problem, spread = of_points(triangle)
    return am.BasinMethod(
        solver, "uzawa, integral", {"eta": eta}, problem=problem, reactions=spread.T,
        within=None if triangle.n_c == 1 else NEAR_SLIP / triangle.size,
    )  # fmt: skip


@lru_cache(maxsize=8)
def of_points(triangle: Triangle) -> tuple[am.FrictionProblem, np.ndarray]:
    """The law at Gauss points of AB, and their reactions as functions of nodal lambda."""
    shapes, weights = at_points(triangle)
    spread = np.kron(np.sqrt(weights)[:, None] * shapes, np.eye(2))
    nodal = triangle.problem
    problem = am.FrictionProblem.from_global(
        nodal.M, nodal.H @ spread.T, nodal.f, (spread @ nodal.w.ravel()).reshape(-1, 2),
        np.full(len(weights), triangle.mu),
    )  # fmt: skip
    return problem, spread


def cells(table: Mapping, terms: Terms = Terms.NODAL, tolerance: float = TOLERANCE,
          near: float = NEAR) -> list[list[Cell]]:  # fmt: skip
    """A table over eta and u^0, with lambda^0 = 0, or lambda^0, with u^0 = 0."""
    triangle = triangle_of(table["n_c"], table["mu"])
    starts = [_start(triangle, table["start"], column, k, terms)
              for k, column in enumerate(table["columns"])]  # fmt: skip
    methods = [method(triangle, eta, terms) for eta in table["values"]]
    return triangle.study(
        methods, starts, within=near, tolerance=tolerance, max_iterations=FEW
    )


def _start(
    triangle: Triangle, variable: str, column: list[float], k: int, terms: Terms
) -> am.Iterate:
    """u^0 = (u_x, u_y), or lambda^0 = (N, T); the exact stick and slip state where named."""
    exact = triangle.exact
    if variable == "u":
        return am.Iterate(np.zeros((1, 2)), np.array(column, dtype=float))
    name = {6: "stick", 7: "slip" if "slip" in exact else "stick"}.get(k, "")
    if name:
        r = triangle.forces(exact[name])
    else:
        r = np.array([column]) if terms is Terms.NODAL else triangle.mass @ np.array([column])
    return am.Iterate(AGAINST * r, np.zeros(2))


def counts(
    table: Mapping, draws: int, seed: int, terms: Terms = Terms.NODAL
) -> dict[str, list[int]]:
    """A table over eta: how many random starts led to what.

    lambda_N^0 is uniform in [0, 0.5], lambda_T^0 and u^0 of all nodes in [-0.5, 0.5]; nodal
    forces, or of the integral terms nodal tractions.
    """
    triangle = triangle_of(table["n_c"], table["mu"])
    random = np.random.default_rng(seed)
    starts = []
    for _ in range(draws):
        r = random.uniform([0, -0.5], 0.5, (triangle.n_c, 2))
        v = random.uniform(-0.5, 0.5, triangle.problem.unknowns)
        starts.append(am.Iterate(r if terms is Terms.NODAL else triangle.mass @ r, v))
    methods = [method(triangle, eta, terms) for eta in table["values"]]
    return tally(triangle.study(methods, starts, within=NEAR, max_iterations=ITERATIONS))
