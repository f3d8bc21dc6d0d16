"""FrictionSolution: pattern, counts, reported errors, and what it prints."""

import numpy as np
import pytest

from amontons.problem.friction import FrictionProblem
from amontons.problem.solution import ContactStatus
from amontons.solvers import GaussSeidel
from amontons.solvers.driver import drive


def solution_2d():
    q = [[1.0, 0], [-4, 0.4], [-4, 8], [-4, -8]]
    problem = FrictionProblem.from_delassus(4 * np.eye(8), q, [0.5] * 4, name="four")
    return drive(problem, GaussSeidel(), tolerance=1e-12)


def test_pattern_and_counts():
    solution = solution_2d()
    assert solution.pattern == "fs-+"
    assert solution.counts == {"open": 1, "slip": 2, "stick": 1}
    assert solution.status.tolist() == [0, 2, 1, 1]
    assert ContactStatus(solution.status[1]) is ContactStatus.STICK


def test_pattern_in_space():
    problem = FrictionProblem.from_delassus(np.eye(3), [[-1, 5, 0]], [0.5])
    assert drive(problem, GaussSeidel()).pattern == "l"


def test_text_tells_the_essentials():
    text = str(solution_2d())
    assert "four: 4 contacts in 2D: 1 open, 2 slip, 1 stick" in text
    assert "converged with GaussSeidel: error" in text
    assert "<= 1e-12" in text


def test_reported_errors():
    solution = solution_2d()
    assert solution.fclib_error < 1e-12
    assert solution.max_penetration < 1e-12
    assert solution.max_cone_violation < 1e-12


def test_fclib_error_of_the_global_form_is_that_of_the_condensed_one():
    rng = np.random.default_rng(0)
    M, H = np.diag(rng.random(9) + 1), rng.standard_normal((9, 6))
    problem = FrictionProblem.from_global(
        M, H, rng.standard_normal(9), rng.standard_normal((2, 3)) - [2, 0, 0], [0.3, 0.3]
    )
    local = drive(problem.condensed(), GaussSeidel(), max_iterations=2)
    whole = drive(problem, start=local, tolerance=0.9999)
    assert whole.v is not None
    assert whole.fclib_error == pytest.approx(local.fclib_error, rel=1e-9)


def test_solutions_are_frozen():
    with pytest.raises(AttributeError):
        solution_2d().r = None
