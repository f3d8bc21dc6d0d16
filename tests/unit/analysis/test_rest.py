"""Curves through points where contacts are at rest: loads that grow from zero, closed gaps."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.first_order import COMBINATIONS, _combinations, first_order
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.path import Stop


def block(dim, cells, **law):
    """A block at rest on a plane, its top pushed down and aside."""
    top = (0.1, -0.2) if dim == 2 else (0.1, 0.05, -0.2)
    body = am.Body(am.box((1,) * dim, cells), am.LinearElastic(young=1.0, poisson=0.3))
    ground = am.Plane(normal=np.eye(dim)[-1])
    contact = am.Contact("bottom", ground, **(law or {"mu": 0.5}))
    return am.Model([body], [am.Fix("top", top)], contacts=[contact])


def reactions(branch, p):
    (y,) = branch.at(p)
    return branch.problem.solution(y, p).r


CASES = {
    "2d": (2, 9, {}),
    "2d frictionless": (2, 20, {"mu": 0.0}),
    "2d tresca": (2, 15, {"tresca": 0.02}),
    "3d": (3, 2, {}),
    "3d many": (3, 3, {}),
    "3d tresca": (3, 3, {"tresca": 0.5}),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_a_load_grows_from_zero_on_closed_gaps(case):
    model = block(case[0], case[1], **case[2])
    branch = am.follow(model)
    assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)
    for p in (0.3, 1.0):
        solved = am.solve(model.with_load(p), tolerance=1e-12).r
        assert np.abs(reactions(branch, p) - solved).max() < 1e-8 * np.abs(solved).max()


def test_more_pieces_meet_there_than_can_be_looked_at():
    start = am.follow(block(2, 9))
    path = start.problem
    assert isinstance(path, FrictionPath)
    assert 4.0**path.start.contacts > COMBINATIONS
    system = first_order(path, start[0].state, 0.0)
    assert sorted(np.sign(t.rate) for t in system.tangents) == [-1, 1]
    assert system.complete, system.reason


@pytest.mark.parametrize("at", [-0.6, 0.7])
def test_a_curve_in_3d_goes_through_rest(at):
    model = block(3, 2)
    branch = am.follow(model, "load", (-1, 1), at=at)
    assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)
    (event,) = [e for e in branch.events if e.kind is am.EventKind.STATUS]
    assert abs(event.parameter) < 1e-12
    for p in (-0.5, 0.5):
        solved = am.solve(model.with_load(p), tolerance=1e-12).r
        assert np.abs(reactions(branch, p) - solved).max() < 1e-8


def test_slip_of_one_contact_from_rest():
    """W = 1: r = p (1, -mu t) for p > 0, t the direction of q_T; nothing for p < 0."""
    problem = am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0.3, -0.4]], [0.25])
    branch = am.follow(problem, "load", (-1, 1))
    np.testing.assert_allclose(reactions(branch, 1.0), [[1, -0.15, 0.2]], atol=1e-12)
    np.testing.assert_allclose(reactions(branch, 0.5), [[0.5, -0.075, 0.1]], atol=1e-12)
    np.testing.assert_allclose(reactions(branch, -0.5), [[0, 0, 0]], atol=1e-12)
    assert branch.status[0] == "f"
    assert branch.status[-1] == "l"


def test_the_end_of_the_interval_counts_where_the_last_event_is():
    """That event is at 1e-14 or so, and the end of the interval at 0."""
    branch = am.follow(block(2, 3), at=1.0)
    assert len(branch.at(0.0)) == 1
    assert np.abs(branch.at(0.0)[0]).max() < 1e-10
    assert len(branch.at(1.0)) == 1
    assert branch.at(-0.01) == []


def test_more_combinations_than_floats_can_count_are_infinitely_many():
    """NumPy would warn of an overflow, which must not reach who follows a load."""
    assert _combinations(["fs", "s"]) == 2
    assert _combinations(["fs+"] * 2000) == np.inf
