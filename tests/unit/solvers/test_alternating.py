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
    monkeypatch.setattr(Alternation, "_step", lambda self, r, shift: None)
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


def test_a_trap_is_left_along_the_step_with_the_least_shift_from_the_best_reaction():
    problem = am.SpherePacking(20, mu=0.3, seed=2).problem().condensed()
    way = swept(problem, 5)
    best = way.r.copy()
    step = way._step(best, alternating.LEAST_SHIFT)
    assert step is not None
    way.r = np.ones_like(best)  # elsewhere now
    for part in (*alternating.KICKS, alternating.KICKS[0]):  # to one side and the other
        moved = part * step * (np.linalg.norm(best) / np.linalg.norm(step))
        assert way._kicked() == pytest.approx(best + moved)


def test_sweeps_alone_and_kicks_leave_traps_in_turn():
    problem = am.SpherePacking(20, mu=0.3, seed=2).problem().condensed()
    way = swept(problem, 5)
    for traps, count in ((1, alternating.WANDERED), (2, alternating.KICKED)):
        way.failures = alternating.FAILURES
        assert way.advance(0.0) == count * alternating.SWEEPS
        assert way.traps == traps
        assert way.error == pytest.approx(problem.error(way.r) * problem.q_norm)
    assert way.least <= way.error
    assert way.least == pytest.approx(problem.error(way.best) * problem.q_norm)
