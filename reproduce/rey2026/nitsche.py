"""Nitsche's unsymmetric method with generalised Newton: section 3.2.

Eight Gauss points on every edge of AB, kappa as printed, full Newton steps from u^0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

import amontons as am

from .triangle import Cell, Triangle, tally, triangle_of

Array = NDArray[np.float64]
POINTS = 8  # on an edge: from six on the tables are those of exact integration
TOLERANCE = 1e-10  # of the judge
LIMIT = 100  # Newton steps: one element takes ten; from random starts some never end
NEAR_SLIP = 0.5  # kappa times the distance to the exact slip is 0.6


class Unknown(Enum):
    """What is random of u^0, and how: readings of the paper's sentence."""

    BODY = "all nodes"
    CONTACTS = "contact nodes, others at rest"
    BALANCE = "contact nodes, others in balance"
    TWO_POINTS = "contact nodes, others in balance, two Gauss points"


def by_nitsche(
    triangle: Triangle, kappa: float, points: int = POINTS, theta: float = 0.0
) -> am.Model:
    """The model with the contact of this page."""
    method = am.Nitsche(kappa=kappa, points=points, theta=theta)
    contacts = [replace(contact, method=method) for contact in triangle.model.contacts]
    return replace(triangle.model, contacts=contacts)


def method(triangle: Triangle, model: am.Model, kappa: float) -> am.BasinMethod:
    """Newton's method for one kappa."""
    solver = am.SemismoothNewton(line_search=am.FullStep())
    return am.BasinMethod(
        solver, "nitsche", {"kappa": kappa}, problem=model.discrete_problem(),
        within=NEAR_SLIP / triangle.size,
    )  # fmt: skip


def cells(
    table: Mapping, points: int = POINTS, theta: float = 0.0, tolerance: float = TOLERANCE
) -> list[list[Cell]]:
    """A table over kappa and u^0 = (u_x, u_y); the last start is the exact slip, if any."""
    triangle = triangle_of(table["n_c"], table["mu"])
    starts = [np.array(column, dtype=float) for column in table["columns"]]
    starts[-1] = triangle.exact.get("slip", starts[-1])
    models = {kappa: by_nitsche(triangle, kappa, points, theta) for kappa in table["values"]}
    return _study(triangle, models, starts, tolerance)


def run(triangle: Triangle, model: am.Model, start: Array) -> Cell:
    """Newton's method from displacements (n,)."""
    return _study(triangle, {1.0: model}, [start], TOLERANCE)[0][0]


def _study(
    triangle: Triangle, models: Mapping[float, am.Model], starts: Sequence[Array],
    tolerance: float,
) -> list[list[Cell]]:  # fmt: skip
    methods = [method(triangle, model, kappa) for kappa, model in models.items()]
    rest = np.zeros((triangle.n_c, 2))
    return triangle.study(
        methods, [am.Iterate(rest, start) for start in starts], tolerance=tolerance,
        max_iterations=LIMIT,
    )  # fmt: skip


def counts(
    table: Mapping, draws: int, seed: int, unknown: Unknown = Unknown.BODY
) -> dict[str, list[int]]:
    """A table over kappa: how many random u^0, uniform in [-0.5, 0.5], led to what."""
    triangle = triangle_of(table["n_c"], table["mu"])
    random = np.random.default_rng(seed)
    starts = [_random(triangle, random, unknown) for _ in range(draws)]
    points = 2 if unknown is Unknown.TWO_POINTS else POINTS
    models = {kappa: by_nitsche(triangle, kappa, points) for kappa in table["values"]}
    return tally(_study(triangle, models, starts, TOLERANCE))


def _random(triangle: Triangle, random: np.random.Generator, unknown: Unknown) -> Array:
    """A random u^0, (n,)."""
    problem = triangle.problem
    if unknown is Unknown.BODY:
        return random.uniform(-0.5, 0.5, problem.unknowns)
    moved = random.uniform(-0.5, 0.5, (triangle.n_c, 2))
    if unknown is Unknown.CONTACTS:
        return problem.H @ moved.ravel()
    local = triangle.local
    r = np.linalg.solve(local.W, (moved - local.q).ravel()).reshape(moved.shape)
    return problem.velocity(r)[1]  # the contacts where they are, the body in balance
