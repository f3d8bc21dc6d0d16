"""Newton's steps and sweeps in turn."""

import numpy as np
import pytest

import amontons as am
from amontons.solvers.newton import alternating
from amontons.solvers.newton.alternating import Alternation
from amontons.solvers.sweeps.kernels import sweep_data, sweeps_inplace, watch_for

TOLERANCE = 1e-10


def swept(problem, count=300):
    """Some sweeps from no reaction, and where they have come to."""
    r = np.zeros((problem.contacts, 3))
    sweeps_inplace(sweep_data(problem), r, count, watch_for(0.0))
    return Alternation(problem, r, problem.error(r[:, : problem.dimension]) * problem.q_norm)


def test_steps_from_swept_reactions_of_a_packing_end_at_rounding():
    problem = am.SpherePacking(60, mu=0.3, seed=2).problem().condensed()
    way, goal = swept(problem), TOLERANCE * problem.q_norm
    assert way.error > 100 * goal
    for _ in range(20):
        if way.error <= goal:
            break
        way.advance(goal)
    assert problem.error(way.r) <= TOLERANCE


def test_a_plane_problem_is_solved_in_its_two_directions():
    W = np.diag([1.0, 2.0, 1.5, 1.0]) + 0.3
    q = np.array([[-1.0, 0.4], [-0.5, -2.0]])
    problem = am.FrictionProblem.from_delassus(W, q, [0.4, 0.4])
    way = swept(problem, 1)
    for _ in range(10):
        way.advance(TOLERANCE * problem.q_norm)
    assert way.error <= TOLERANCE * problem.q_norm
    assert not way.r[:, 2].any()


def test_sweeps_go_on_alone_where_steps_lead_nowhere(monkeypatch):
    problem = am.SpherePacking(20, mu=0.3, seed=2).problem().condensed()
    way = swept(problem, 5)
    monkeypatch.setattr(Alternation, "_step", lambda self: None)
    before = way.error
    for _ in range(alternating.FAILURES):
        assert way.advance(0.0) == 0
    assert way.stalled
    assert way.shift > alternating.FIRST_SHIFT
    assert way.advance(0.0) == alternating.WANDERED * alternating.SWEEPS
    assert way.steps == 0
    assert not way.stalled
    assert way.shift == alternating.FIRST_SHIFT
    assert way.error == pytest.approx(problem.error(way.r) * problem.q_norm)
    assert way.error < before
