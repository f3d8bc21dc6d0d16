"""Other solutions from other starts: found where they are, and none where there is one."""

import numpy as np
import pytest

import amontons as am


def hild(mu):
    """The triangle that sticks, slips or lifts off at mu = 3.5: three solutions, enumerated."""
    model = am.read_case("example:hild").model.with_mu(mu)
    return model.discrete_problem().condensed()


def test_the_triangle_that_sticks_may_lift_off():
    problem = hild(3.5)
    W = problem.W if isinstance(problem.W, np.ndarray) else problem.W.toarray()
    stuck = np.linalg.solve(W, -problem.q.ravel()).reshape(-1, 2)  # u = 0
    held = am.drive(problem, start=am.Iterate(stuck))
    assert held.pattern == "ssssssss"
    (other,) = am.maybe_others(held, starts=1)
    assert other.solution.pattern == "ffffffff"
    assert other.solution.converged
    assert other.distance == pytest.approx(1.0)
    assert other.contacts == 8


def test_nothing_is_found_where_there_is_one():
    found = am.drive(hild(0.3))
    assert am.maybe_others(found, starts=4) == ()


def test_the_same_for_the_same_seed():
    found = am.drive(am.SpherePacking(12, seed=3).problem())
    one, two = (am.maybe_others(found, seed=5) for _ in range(2))
    assert [o.distance for o in one] == [o.distance for o in two]


def test_bad_input_is_named():
    problem = am.SpherePacking(12, seed=3).problem().condensed()
    failed = am.drive(problem, am.GaussSeidel(), max_iterations=1, tolerance=1e-15)
    assert not failed.converged
    with pytest.raises(am.InvalidInput, match="solution: expected a converged solution"):
        am.maybe_others(failed)
    with pytest.raises(am.InvalidInput, match="starts: expected a whole number"):
        am.maybe_others(am.drive(problem), starts=0)
    for wrong in (problem, None):
        with pytest.raises(am.InvalidInput, match="solution: expected a converged solution"):
            am.maybe_others(wrong)
    with pytest.raises(am.InvalidInput, match="seed: expected a whole number >= 0, got 'x'"):
        am.maybe_others(am.drive(problem), seed="x")
