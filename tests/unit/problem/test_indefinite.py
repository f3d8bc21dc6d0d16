"""An indefinite W or M is named with its direction, and never where rounding made it."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.problem.friction import FrictionProblem
from amontons.problem.indefinite import negative_direction
from amontons.problem.solution import Outcome
from amontons.solvers import GaussSeidel
from amontons.solvers.driver import drive

PRESSED = [-1.0, 0.1, 0.2]


def pressed(W, contacts=4):
    return FrictionProblem.from_delassus(W, np.tile(PRESSED, (contacts, 1)), [0.3] * contacts)


def value_of(problem, found):
    """The number evaluated again, for a direction at one contact."""
    d = np.zeros((problem.contacts, problem.dimension))
    d[found.places[0]] = found.entries
    W = problem.W.toarray() if sparse.issparse(problem.W) else problem.W
    return d.ravel() @ W @ d.ravel()


@pytest.mark.parametrize("matrix", [np.array, sparse.csr_array])
@pytest.mark.parametrize("contacts", [4, 60])
def test_minus_identity_is_named_at_once(matrix, contacts):
    problem = pressed(matrix(-np.eye(3 * contacts)), contacts)
    solution = drive(problem)
    record = solution.convergence
    assert record.outcome is Outcome.BREAKDOWN
    assert record.iterations < 10_000
    assert "W is indefinite: d' W d = -1" in record.detail
    assert "contact 0, along (1, 0, 0)" in record.detail
    assert "signs" in record.advice
    assert all("Newton" not in step.stage for step in record.history)  # nothing dearer


def test_one_bad_contact_among_good_ones():
    W = np.eye(12)
    W[3:6, 3:6] = [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    problem = pressed(W)
    found = negative_direction(problem)
    assert found.places == (1,)
    assert found.value == pytest.approx(-1.0)
    assert value_of(problem, found) == pytest.approx(found.value)
    assert drive(problem, GaussSeidel()).converged  # and a solution there may be


def test_contacts_that_are_bad_together():
    W = np.eye(12)
    W[0, 6] = W[6, 0] = 1.5  # normal directions of contacts 0 and 2
    found = negative_direction(pressed(W))
    assert sorted(found.places) == [0, 2]
    assert found.value == pytest.approx(-0.5)
    assert found.entries is None


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_a_regular_problem_is_not_accused(scale):
    random = np.random.default_rng(3)
    A = random.standard_normal((60, 20))
    skew = np.triu(np.ones((60, 60)), 1)
    for W in (np.eye(60), A @ A.T, A @ A.T + skew - skew.T, np.zeros((60, 60))):
        assert negative_direction(pressed(scale * W, 20)) is None


def test_a_solution_is_found_where_there_is_one():
    """The diverging contact stays open."""
    W = np.diag([1.0, 1.0, 1.0, -1.0, 1.0, 1.0])
    problem = FrictionProblem.from_delassus(W, [PRESSED, [1.0, 0.0, 0.0]], [0.3, 0.3])
    assert am.solve(problem).converged


def test_global_form():
    M = np.diag([1.0, 1.0, 1.0, -2.0, 1.0, 1.0])
    problem = FrictionProblem.from_global(
        M, np.eye(6), [*PRESSED, 1.0, 0.1, 0.2], np.zeros((2, 3)), [0.3, 0.3]
    )
    solution = drive(problem)
    assert "W is indefinite: d' W d = -0.5" in solution.convergence.detail
    free = FrictionProblem.from_global(
        M, np.eye(6)[:, :3], np.tile(PRESSED, 2), np.zeros((1, 3)), [0.3]
    )
    found = negative_direction(free)  # no contact feels it
    assert (found.matrix, found.places, found.value) == ("M", (3,), -2.0)


def test_a_contact_that_can_not_react_is_named():
    W = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    problem = FrictionProblem.from_delassus(W, [PRESSED, PRESSED], [0.3, 0.3])
    record = drive(problem, max_iterations=100).convergence
    assert "contact 1 can not react" in record.detail
    assert "rows" in record.advice


def test_info_tells(tmp_path):
    from amontons.app.cli.info import describe

    assert "d' W d = -1" in describe(pressed(-np.eye(12)))["sign"]
    assert "sign" not in describe(pressed(np.eye(12)))
