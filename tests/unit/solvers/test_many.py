"""Many small problems in one call: the answers of `drive`, bit by bit, whatever the threads."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.first_stage import solve_range


@pytest.fixture(scope="module")
def problems():
    """Easy and hard ones, 3D and 2D, all laws, one without load, one without contacts."""
    made = [random_delassus(seed, 4 + seed % 9, rank=30) for seed in range(30)]
    bounds = made[3].W, made[3].q, am.Tresca(np.full(made[3].contacts, 0.4))
    flat = np.eye(6) + 0.1
    made += [
        am.FrictionProblem.from_delassus(*bounds),
        am.FrictionProblem.from_delassus(flat, [[-1, 0.2], [-2, 0.1], [1, 0]], [0.3, 0.5, 0]),
        am.FrictionProblem.from_delassus(np.eye(3), np.zeros((1, 3)), [0.3]),
        am.FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, 3)), []),
        am.FrictionProblem.from_delassus(
            np.eye(3), [[-1, 0, 0]], am.Cohesive(am.Coulomb([0.3]), [0.5])
        ),
    ]
    return made


@pytest.mark.parametrize("threads", [1, 3, None])
def test_answers_are_those_of_drive(problems, threads):
    found = am.solve_many(problems, tolerance=1e-9, threads=threads)
    assert len(found) == len(problems)
    for solution, problem in zip(found, problems, strict=True):
        alone = am.drive(problem, tolerance=1e-9)
        assert solution.problem is problem
        assert np.array_equal(solution.r, alone.r)
        assert np.array_equal(solution.u, alone.u)
        assert np.array_equal(solution.status, alone.status)
        assert solution.convergence.outcome is alone.convergence.outcome
        assert solution.convergence.error == alone.convergence.error
        assert solution.convergence.iterations == alone.convergence.iterations


def test_problems_in_global_form_get_their_motion():
    made = am.SpherePacking(12, seed=3).problem()
    (found,) = am.solve_many([made])
    assert found.converged
    assert found.problem is made
    assert made.error(found.r, found.v) <= 1e-8
    assert np.allclose(made.M @ found.v, made.H @ found.r.ravel() + made.f, atol=1e-10)


def test_warm_starts(problems):
    cold = am.solve_many(problems[:5])
    warm = am.solve_many(problems[:5], starts=[cold[0], None, *cold[2:]])
    assert [s.convergence.iterations == 0 for s in warm] == [True, False, True, True, True]


def test_no_time(problems):
    hard = am.SpherePacking(60, mu=0.3, seed=1).problem().condensed()
    found = am.solve_many([hard, problems[0]], time_limit=1e-9)
    assert found[0].convergence.outcome is am.Outcome.TIME_LIMIT
    assert np.isfinite(found[0].r).all()


def test_an_unsolvable_problem_does_not_stop_the_others():
    wall = am.FrictionProblem.from_delassus(np.zeros((3, 3)), [[-1.0, 0, 0]], [0.3])
    free = am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0, 0]], [0.3])
    found = am.solve_many([free, wall, free])
    assert [s.converged for s in found] == [True, False, True]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"problems": [None]}, r"problems\[0\]: expected a FrictionProblem, got None"),
        ({"starts": [None, 3]}, r"starts\[1\]: expected a solution or an Iterate, got int"),
        ({"starts": [None]}, "starts: expected one start for each of 2 problems, got 1"),
        ({"threads": 0}, "threads: expected a whole number >= 1, or None, got 0"),
        ({"tolerance": -1}, "tolerance"),
    ],
)
def test_errors_are_named(problems, arguments, text):
    with pytest.raises(am.InvalidInput, match=text):
        am.solve_many(**{"problems": problems[:2], **arguments})


def test_one_problem_and_many_take_the_same_compiled_function(problems):
    """Another signature is another compilation, which may round differently."""
    am.solve_many(problems[:1], tolerance=1e-9)
    known = set(solve_range.signatures)
    am.solve_many(problems[:5], tolerance=1e-9)
    assert set(solve_range.signatures) == known


def test_one_problem_alone_is_refused():
    problem = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0]], [0.5])
    with pytest.raises(am.InvalidInput, match=r"problems: .*write \[it\]"):
        am.solve_many(problem)
