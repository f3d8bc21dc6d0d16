"""Alart and Curnier's generalised Newton method, reduced to the multipliers: section 3.3.

lambda are tractions at the nodes of AB: the contact forces are G lambda with the mass matrix G
of the shape functions on AB ("integral approximation"), so u = W G lambda + q.  lambda at B,
which is held, is zero.  The law holds in the integral, with Gauss points x on AB:

    integral of N (lambda - P(lambda - eta u)) = 0

On one element lambda and u are proportional to one shape function, all points of it have the
state of its node, and the equation is that of the node: `am.SemismoothNewton` on the problem
W G, q.  On more elements states change within an element, and the equation needs its own loop.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import amontons as am
from amontons.cones import Coulomb, augmented_reaction, augmented_reaction_jacobian
from amontons.solvers import Iterate

from .triangle import Cell, Triangle, tally

POINTS = 8  # on an edge, as in `nitsche`
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


def at_points(triangle: Triangle) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions of the contacts, (q, n_c), and weights (q,) at all Gauss points of AB."""
    s, weights = np.polynomial.legendre.leggauss(POINTS)
    s, weights = (s + 1) / 2, weights / 2
    order = np.argsort(triangle.places)
    ends = np.append(triangle.places[order], 1.0)
    shapes = np.zeros((triangle.n_c, POINTS, triangle.n_c))
    for k, node in enumerate(order):
        shapes[k, :, node] = 1 - s
        if k + 1 < triangle.n_c:
            shapes[k, :, order[k + 1]] = s
    return shapes.reshape(-1, triangle.n_c), np.outer(np.diff(ends), weights).ravel()


def run_at_points(triangle: Triangle, eta: float, start: np.ndarray) -> Cell:
    """Newton's method with the law at Gauss points, from lambda = start, rows (N, T)."""
    shapes, weights = at_points(triangle)
    law = Coulomb(np.full(len(weights), triangle.mu))
    N = np.kron(shapes, np.eye(2))
    weighted = N.T * np.repeat(weights, 2)
    G = weighted @ N
    compliance = triangle.local.W @ G
    inside = (N @ (np.eye(len(G)) - eta * compliance)).reshape(-1, 2, len(G))  # dx / dlambda
    unknown, count, done = start.ravel(), 0, False
    while count < LIMIT and not done:
        u = compliance @ unknown + triangle.local.q.ravel()
        x = (N @ (unknown - eta * u)).reshape(-1, 2)
        residual = G @ unknown - weighted @ augmented_reaction(x, law).ravel()
        slope = np.einsum("qij,qjk->qik", augmented_reaction_jacobian(x, law), inside)
        step = np.linalg.solve(G - weighted @ slope.reshape(N.shape), -residual)
        unknown, count = unknown + step, count + 1
        done = np.linalg.norm(step) <= TOLERANCE * max(np.linalg.norm(unknown), 1e-3)
    v = triangle.problem.velocity((G @ unknown).reshape(-1, 2))[1]
    return triangle.cell(v, converged=bool(done), iterations=count)


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over eta: how many random lambda^0, uniform in [-0.5, 0.5], led to what."""
    triangle = Triangle(table["n_c"], table["mu"])
    starts = np.random.default_rng(seed).uniform(-0.5, 0.5, (draws, table["n_c"], 2))
    return tally(
        [run_at_points(triangle, eta, start) for start in starts] for eta in table["values"]
    )
