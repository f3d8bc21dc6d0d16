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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import amontons as am
from amontons.analysis import Ended, RunLimits

from .triangle import SAME, Cell, Triangle, tally, triangle_of

Array = NDArray[np.float64]
POINTS = 8  # on an edge, as in `nitsche`
LIMIT = 200  # Newton steps: it ends within ten or not at all
TOLERANCE = 1e-10  # of the judge, or of the last step at points; rounding leaves 1e-11
JUDGED = 1e-8  # residual at points, relative to the forces
LEAST = 1e-3  # size of forces and tractions that are next to none
NEAR_SLIP = 0.5  # energy norm in which slip at points is that of the nodes


def cells(
    table: Mapping, tolerance: float = TOLERANCE, near: float = SAME
) -> list[list[Cell]]:
    """A table over eta and lambda^0; the last two columns are the exact stick and slip."""
    triangle = triangle_of(table["n_c"], table["mu"])
    starts = [np.array([column[::-1]]) for column in table["columns"]]  # printed (T, N)
    starts[-2:] = [exact(triangle, "stick"), exact(triangle, "slip")]
    methods = [nodal(triangle, eta) for eta in table["values"]]
    return _study(triangle, methods, starts, tolerance=tolerance, within=near)


def _study(
    triangle: Triangle, methods: Sequence[Any], starts: Sequence[Array], **options: float
) -> list[list[Cell]]:
    """From lambda, rows (N, T), which are forces G lambda."""
    forces = [am.Iterate(triangle.mass @ start) for start in starts]
    return triangle.study(methods, forces, max_iterations=LIMIT, **options)


def exact(triangle: Triangle, name: str) -> Array:
    """lambda (n_c, 2), rows (N, T), of the solution of that name; at mu = 3 slip is stick."""
    v = triangle.exact[name if name in triangle.exact else "stick"]
    return np.linalg.solve(triangle.mass, triangle.forces(v))


def nodal(triangle: Triangle, eta: float) -> am.BasinMethod:
    """Newton's method with the law at the nodes, in tractions."""
    solver = am.SemismoothNewton(
        line_search=am.FullStep(), rho=eta, rho_strategy=am.RhoStrategy.CONSTANT
    )
    return am.BasinMethod(
        solver, "alart-curnier", {"eta": eta}, problem=triangle.integral,
        reactions=np.kron(triangle.mass, np.eye(2)),
    )  # fmt: skip


def run(triangle: Triangle, eta: float, start: Array) -> Cell:
    """Newton's method from lambda = start, rows (N, T)."""
    return _study(triangle, [nodal(triangle, eta)], [start], tolerance=TOLERANCE)[0][0]


def at_points(triangle: Triangle) -> tuple[Array, Array]:
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


@dataclass(frozen=True, eq=False)
class AtPoints:
    """Newton's method with the law at Gauss points, as `am.basins` takes it.

    within: relative, how near a solution is told by: slip there is not that of the nodes.
    """

    triangle: Triangle
    eta: float
    within: float | None = None
    method = "alart-curnier, integral"

    @property
    def parameters(self) -> dict[str, float]:
        """eta."""
        return {"eta": self.eta}

    @property
    def label(self) -> str:
        """For tables."""
        return f"{self.method} eta={self.eta:g}"

    def run(
        self, problem: am.FrictionProblem, start: am.Iterate, limits: RunLimits
    ) -> Ended:
        """Steps from lambda of the forces of a start until both step and residual are small."""
        G = np.kron(self.triangle.mass, np.eye(2))
        unknown, count, done = np.linalg.solve(G, start.r.ravel()), 0, False
        while True:
            residual, matrix = self._linearised(unknown)
            size = max(float(np.linalg.norm(G @ unknown)), LEAST)
            error = float(np.linalg.norm(residual)) / size
            if done or count >= LIMIT or limits.deadline.passed or not np.isfinite(error):
                break
            step = np.linalg.solve(matrix, -residual)
            unknown, count = unknown + step, count + 1
            done = np.linalg.norm(step) <= limits.tolerance * max(
                float(np.linalg.norm(unknown)), LEAST
            )
        converged = done and error <= JUDGED
        outcome = "converged" if converged else "max_iterations"
        if not converged and limits.deadline.passed:
            outcome = "time_limit"
        return Ended((G @ unknown).reshape(-1, 2), None, converged, error, count, outcome)

    def _linearised(self, unknown: Array) -> tuple[Array, Array]:
        """The equation at lambda, (2 n_c,), and one element of its generalised Jacobian."""
        spread, weighted, law = _points(self.triangle)
        compliance, q = self.triangle.integral.W, self.triangle.local.q.ravel()
        x = (spread @ (unknown - self.eta * (compliance @ unknown + q))).reshape(-1, 2)
        G = weighted @ spread
        inside = spread - self.eta * (spread @ compliance)  # dx / dlambda
        slope = np.einsum(
            "qij,qjk->qik", law.augmented_reaction_jacobian(x),
            inside.reshape(-1, 2, len(unknown)),
        )  # fmt: skip
        residual = G @ unknown - weighted @ law.augmented_reaction(x).ravel()
        return residual, G - weighted @ slope.reshape(spread.shape)


@lru_cache(maxsize=8)
def _points(triangle: Triangle) -> tuple[Array, Array, am.Coulomb]:
    """Values at the points from nodal ones, (2 q, 2 n_c); integrals of them; the law there."""
    shapes, weights = at_points(triangle)
    spread = np.kron(shapes, np.eye(2))
    law = am.Coulomb(np.full(len(weights), triangle.mu))
    return spread, spread.T * np.repeat(weights, 2), law


def run_at_points(triangle: Triangle, eta: float, start: Array) -> Cell:
    """Newton's method with the law at Gauss points, from lambda = start, rows (N, T)."""
    within = None if triangle.n_c == 1 else NEAR_SLIP / triangle.size
    method = AtPoints(triangle, eta, within)
    return _study(triangle, [method], [start], tolerance=TOLERANCE)[0][0]


def counts(table: Mapping, draws: int, seed: int) -> dict[str, list[int]]:
    """A table over eta: how many random lambda^0, uniform in [-0.5, 0.5], led to what."""
    triangle = triangle_of(table["n_c"], table["mu"])
    starts = np.random.default_rng(seed).uniform(-0.5, 0.5, (draws, table["n_c"], 2))
    within = NEAR_SLIP / triangle.size
    methods = [AtPoints(triangle, eta, within) for eta in table["values"]]
    return tally(_study(triangle, methods, list(starts), tolerance=TOLERANCE))
