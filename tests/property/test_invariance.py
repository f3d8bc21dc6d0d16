"""The solution does not depend on units, on the order of contacts, or on tangent axes."""

import numpy as np
import pytest

from amontons.problem.friction import Form, FrictionProblem
from amontons.solvers import METHODS
from amontons.solvers.driver import drive

SOLVERS = [
    pytest.param(solver, id=name)
    for name, solver in METHODS.items()
    if solver.form is not Form.GLOBAL
]
NC = 5


def unique_problem(seed=0):
    """Well conditioned, small friction: one solution."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3 * NC, 3 * NC)) / np.sqrt(3 * NC)
    W = 0.3 * root @ root.T + np.eye(3 * NC)
    return FrictionProblem.from_delassus(W, rng.standard_normal((NC, 3)), np.full(NC, 0.2))


def reactions(solver, problem):
    solution = drive(problem, solver(), tolerance=1e-9, max_iterations=20_000, time_limit=20)
    assert solution.converged, str(solution)
    return solution.r


@pytest.mark.parametrize("force", [1e-6, 1e6])
@pytest.mark.parametrize("length", [1e-6, 1e6])
@pytest.mark.parametrize("solver", SOLVERS)
def test_units(solver, force, length):
    problem = unique_problem()
    r = reactions(solver, problem)
    other = FrictionProblem.from_delassus(
        problem.W * (length / force), length * problem.q, problem.mu
    )
    solution = drive(other, solver(), tolerance=1e-9, max_iterations=20_000)
    assert solution.converged, str(solution)
    np.testing.assert_allclose(solution.r / force, r, atol=1e-7)


@pytest.mark.parametrize("solver", SOLVERS)
def test_order_of_contacts(solver):
    problem = unique_problem()
    order = np.random.default_rng(1).permutation(NC)
    index = (3 * order[:, None] + np.arange(3)).ravel()
    other = FrictionProblem.from_delassus(
        problem.W[np.ix_(index, index)], problem.q[order], problem.mu[order]
    )
    np.testing.assert_allclose(
        reactions(solver, other), reactions(solver, problem)[order], atol=1e-7
    )


@pytest.mark.parametrize("solver", SOLVERS)
def test_tangent_axes(solver):
    problem = unique_problem()
    turn = np.zeros((3 * NC, 3 * NC))
    for i, t in enumerate(np.random.default_rng(2).uniform(0, 6, NC)):
        c, s = np.cos(t), np.sin(t)
        turn[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    other = FrictionProblem.from_delassus(
        turn @ problem.W @ turn.T, turn @ problem.q.ravel(), problem.mu
    )
    expected = (turn @ reactions(solver, problem).ravel()).reshape(NC, 3)
    np.testing.assert_allclose(reactions(solver, other), expected, atol=1e-7)
