"""The table of a branch, its JSON, and its values at a parameter."""

import json

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.path import (
    Branch,
    Event,
    EventKind,
    PathProblem,
    Point,
    Stop,
    corrected,
    joined,
    name_of,
    solve_linear,
)


class Parabola:
    """y^2 = p: two states for p > 0 and a smooth fold at 0."""

    def residual(self, y, p):
        return y**2 - p

    def jacobian(self, y, p):
        return np.diag(2 * y), np.array([-1.0])

    def piece(self, y, p):
        return np.zeros(1, dtype=np.int8)

    def describe(self, y, p):
        return {"norm": float(abs(y[0]))}


def point(s):
    y = np.array([s])
    return Point(s**2, y, np.array([1.0]), 2 * s, "smooth", arclength=s)


def branch():
    fold = Event(EventKind.FOLD, 0.0, np.zeros(1), smooth=True, before="low", after="high")
    back = (
        [point(0.5), point(0.25), point(0.0), point(-0.5), point(-1.0)],
        [fold],
        Stop.INTERVAL,
    )
    forth = ([point(0.5), point(1.5)], [], Stop.MAX_POINTS)
    return joined(Parabola(), back, forth)


def test_protocol():
    assert isinstance(Parabola(), PathProblem)
    assert not isinstance(object(), PathProblem)


def test_halves_are_joined_in_order():
    whole = branch()
    assert isinstance(whole, Branch)
    np.testing.assert_allclose(whole.states[:, 0], [-1, -0.5, 0, 0.25, 0.5, 1.5])
    assert whole.stops == (Stop.INTERVAL, Stop.MAX_POINTS)
    assert whole.folds[0].before == "high"  # travelled the other way


def test_values_at_a_parameter():
    found = branch().at(0.49)
    np.testing.assert_allclose(np.ravel(found), [-0.7, 0.7], rtol=1e-12)
    assert branch().at(-1.0) == []


def test_newton_at_fixed_parameter_says_when_there_is_no_solution():
    assert corrected(Parabola(), np.array([1.0]), -1.0) is None
    np.testing.assert_allclose(corrected(Parabola(), np.array([1.0]), 2.0), [np.sqrt(2)])


def test_table_and_json():
    record = json.loads(json.dumps(branch().record()))
    assert [row["norm"] for row in record["points"]] == [1, 0.5, 0, 0.25, 0.5, 1.5]
    assert record["events"][0]["kind"] == "fold"
    assert record["stops"] == ["interval", "max_points"]
    assert "folds: 0;" in str(branch())


def test_names_of_pieces():
    assert name_of(np.array([1, 2])) == name_of(np.array([1, 2])) != name_of(np.array([1, 3]))
    assert name_of("fs+") == "fs+"


def test_singular_systems_are_refused():
    from scipy import sparse

    for matrix in (np.zeros((2, 2)), sparse.csc_array((2, 2))):
        with pytest.raises(np.linalg.LinAlgError):
            solve_linear(matrix, np.ones(2))


def test_a_closed_branch_of_lines_ends_where_it_began():
    """Begun in the middle of a line: that line is there as a whole."""
    W = [[1.4, 0.1, -0.4, -0.6], [0.1, 1.1, -0.7, 0.5], [-0.4, -0.7, 0.7, -0.1],
         [-0.6, 0.5, -0.1, 1.7]]  # fmt: skip
    ends = [
        am.FrictionProblem.from_delassus(W, q, [3.2, 7.1])
        for q in ([[-2.1, 0.9], [1.4, -0.9]], [[0.0, -0.8], [0.2, -1.5]])
    ]
    diagram = am.diagram(ends[1], "load", (-1, 2), base=ends[0], at=[1.05])
    (isola,) = [branch for branch in diagram if branch.closed]
    assert 0.91 < isola[0].parameter < 1.16
    np.testing.assert_allclose(isola[-1].state, isola[0].state, atol=1e-12)
    assert isola[-1].parameter == isola[0].parameter
    assert (np.diff(isola.arclength) > 0).all()
    for p in (0.91, 0.95, 1.02, 1.1, 1.16):
        assert len(isola.at(p)) == 2
    assert len(isola.at(isola[0].parameter)) == 2  # the start counts once


def test_a_branch_of_one_point_can_be_shown():
    """Also where the user's interval has whole numbers."""
    branch = am.follow(Parabola(), interval=(1, 4), start=[1.0], callback=lambda *_: True)
    assert len(branch) == 1
    assert "1 … 1" in str(branch)
    assert branch.parameter.dtype == float
