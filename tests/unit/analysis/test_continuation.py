"""Continuation of known curves: smooth and not, folds, branch points, loops, corners."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

import amontons as am
from amontons.analysis.paths.continuation import Continuation, Switch, resumed
from amontons.analysis.paths.corrector import Curve
from amontons.analysis.paths.diagram import bifurcation_diagram
from amontons.analysis.paths.first_order import first_order
from amontons.analysis.paths.following import (
    Limits,
    Method,
    continue_both,
    follow_path,
    track_both,
)
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.path import EventKind, Stop, corrected
from amontons.analysis.paths.starting import exact_state
from amontons.analysis.solutions.enumerate import enumerate_solutions
from amontons.core.errors import InvalidInput, SingularOperator

ONE = [[1.0, 0.8], [0.8, 1.0]]


class Smooth:
    """A smooth problem given by H and its derivatives; one piece."""

    def __init__(self, H, J, Jp, sparse_matrix=False):
        self.H, self.J, self.Jp, self.sparse = H, J, Jp, sparse_matrix

    def residual(self, y, p):
        return np.atleast_1d(self.H(y, p))

    def jacobian(self, y, p):
        J = np.atleast_2d(self.J(y, p))
        return (sparse.csc_array(J) if self.sparse else J), np.atleast_1d(self.Jp(y, p))

    def piece(self, y, p):
        return "all"


class Black:
    """Another problem of which only the protocol is known: no margins, no neighbours."""

    def __init__(self, problem):
        self.residual, self.jacobian, self.piece = (
            problem.residual,
            problem.jacobian,
            problem.piece,
        )


@pytest.mark.parametrize("as_sparse", [False, True])
def test_a_circle_closes_and_has_two_smooth_folds(as_sparse):
    circle = Smooth(lambda y, p: y @ y + p**2 - 1, lambda y, p: 2 * y[None],
                    lambda y, p: 2 * p, as_sparse)  # fmt: skip
    options = Continuation(min_cosine=0.999)
    branch = continue_both(circle, np.array([1.0]), 0.0, Limits((-2.0, 2.0)), options)
    assert branch.closed
    assert branch.stops == (Stop.CLOSED, Stop.CLOSED)
    assert sorted(e.parameter for e in branch.folds) == pytest.approx([-1.0, 1.0], abs=1e-12)
    assert all(e.smooth for e in branch.folds)
    assert len(branch.at(0.6)) == 2
    length = branch.points[-1].arclength
    assert 2 * np.pi < length < 2 * np.pi + 0.2


class BentPitchfork:
    """z = sin p and x (z - c - x^2) = 0: branches at (0, c) of the bent trunk x = 0."""

    def __init__(self, c, matrix):
        self.c, self.matrix = c, matrix

    def residual(self, y, p):
        x, z = y
        return np.array([z - np.sin(p), x * (z - self.c - x**2)])

    def jacobian(self, y, p):
        x, z = y
        J = self.matrix(np.array([[0.0, 1.0], [z - self.c - 3 * x**2, x]]))
        return J, np.array([-np.cos(p), 0.0])

    def piece(self, y, p):
        return 0


@pytest.mark.parametrize("matrix", [np.array, sparse.csc_array])
@pytest.mark.parametrize("c", [0.1, 0.5, 0.77])
def test_a_branch_point_of_a_bent_curve_is_located_to_rounding(c, matrix):
    branch = continue_both(
        BentPitchfork(c, matrix), np.zeros(2), 0.0, Limits((-0.5, 1.4)), Continuation()
    )
    (event,) = [e for e in branch.events if e.kind is EventKind.BRANCH]
    assert event.parameter == pytest.approx(np.arcsin(c), abs=1e-10)
    assert event.state == pytest.approx([0.0, c], abs=1e-10)
    assert len(event.directions) == 4
    across = np.abs(event.directions @ [1.0, 0.0, 0.0]) > 0.5
    assert across.sum() == 2  # the other line leaves along x
    before = branch.parameter[:-1] < event.parameter - 1e-9
    np.testing.assert_array_equal(branch.orientation, np.where(before, 1, -1))  # of c - sin p


def test_a_branch_point_of_a_bent_curve_is_located_to_rounding_on_the_fork_too():
    """From the fork x^2 = sin p - c: p turns there, and the trunk crosses."""
    problem = BentPitchfork(0.5, np.array)
    p = 1.0
    y = np.array([np.sqrt(np.sin(p) - 0.5), np.sin(p)])
    branch = continue_both(problem, y, p, Limits((0.2, 1.2)), Continuation())
    (event,) = [e for e in branch.events if e.kind is EventKind.BRANCH]
    assert event.parameter == pytest.approx(np.pi / 6, abs=1e-8)
    assert np.abs(event.state - [0.0, 0.5]).max() < 1e-5  # x is the root of what p misses


def test_a_branch_point_is_found_with_its_other_line():
    """Example 2 of [LR]: x (x^2 - p)."""
    pitchfork = Smooth(lambda y, p: y * (y**2 - p), lambda y, p: np.diag(3 * y**2 - p),
                       lambda y, p: -y)  # fmt: skip
    branch = continue_both(pitchfork, np.zeros(1), -0.5, Limits((-1.0, 1.0)))
    (event,) = [e for e in branch.events if e.kind is EventKind.BRANCH]
    assert event.parameter == pytest.approx(0.0, abs=1e-8)
    assert len(event.directions) == 4
    np.testing.assert_allclose(abs(event.directions[2]), [1, 0], atol=1e-5)
    assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)


def hyperbola(gap):
    """x^2 - p^2 = gap^2: two curves that pass by each other at a distance of 2 gap."""
    return Smooth(lambda y, p: y**2 - p**2 - gap**2, lambda y, p: np.diag(2 * y),
                  lambda y, p: np.array([-2 * p]))  # fmt: skip


def unfolded(height):
    """x (x^2 - p) = height: the curve from the left goes up, or down, and does not branch."""
    return Smooth(lambda y, p: y * (y**2 - p) - height, lambda y, p: np.diag(3 * y**2 - p),
                  lambda y, p: -y)  # fmt: skip


@pytest.mark.parametrize("max_step", [0.1, 0.4])
@pytest.mark.parametrize(("problem", "start", "end"), [
    (hyperbola(1e-2), 1.0, 1.0), (hyperbola(1e-3), 1.0, 1.0),
    (unfolded(1e-6), 0.0, 1.0), (unfolded(-1e-8), 0.0, -1.0),
])  # fmt: skip
def test_curves_that_pass_by_each_other_have_no_branch_point(problem, start, end, max_step):
    """The steps shrink where one would lead from one to the other."""
    start = corrected(problem, np.array([start]), -1.0)
    options = Continuation(max_step=max_step)
    branch = continue_both(problem, start, -1.0, Limits((-1.0, 1.0)), options)
    assert {e.kind for e in branch.events} == {EventKind.END}
    assert branch.points[-1].parameter == 1
    assert branch.points[-1].state[0] == pytest.approx(end, abs=1e-3)


def test_a_gap_too_narrow_for_the_steps_ends_the_walk_without_a_branch_point():
    start = corrected(hyperbola(1e-5), np.ones(1), -1.0)
    branch = continue_both(hyperbola(1e-5), start, -1.0, Limits((-1.0, 1.0)))
    assert {e.kind for e in branch.events} == {EventKind.END}
    assert branch.stops[1] in (Stop.STEP_TOO_SMALL, Stop.SINGULAR)
    assert abs(branch.points[-1].parameter) < 1e-3


@pytest.mark.parametrize("slope", [2.0, -0.5, 30.0])
def test_both_lines_of_a_branch_point_are_told(slope):
    """x (x - slope p), whose lines are not orthogonal."""
    crossing = Smooth(lambda y, p: y * (y - slope * p), lambda y, p: np.diag(2 * y - slope * p),
                      lambda y, p: -slope * y)  # fmt: skip
    branch = continue_both(crossing, np.zeros(1), -0.5, Limits((-1.0, 1.0)))
    (event,) = [e for e in branch.events if e.kind is EventKind.BRANCH]
    assert event.parameter == pytest.approx(0.0, abs=1e-12)
    slopes = event.directions[:, 0] / event.directions[:, 1]
    np.testing.assert_allclose(slopes, [0, 0, slope, slope], atol=1e-6)


def test_end_of_interval_is_met_exactly_and_the_walk_goes_on_from_any_point():
    cubic = Smooth(lambda y, p: y**3 - y - p, lambda y, p: np.diag(3 * y**2 - 1),
                   lambda y, p: -np.ones(1))  # fmt: skip
    options = Continuation()
    whole = continue_both(cubic, np.array([-1.5]), -1.875, Limits((-1.875, 1.875)), options)
    folds = [e.parameter for e in whole.folds]
    np.testing.assert_allclose(folds, [2 / 27**0.5, -2 / 27**0.5], atol=1e-12)
    assert whole.points[-1].parameter == 1.875
    np.testing.assert_allclose(whole.points[-1].state, [1.5], atol=1e-11)
    middle = whole.points[len(whole) // 2]
    steps = options.walk(cubic, middle.state, middle.parameter, resumed(middle),
                         (-1.875, 1.875), step=middle.step)  # fmt: skip
    *_, (last, event) = steps
    assert event.stop is Stop.INTERVAL
    np.testing.assert_allclose(last.state, [1.5], atol=1e-11)


def one_contact(mu=2.0):
    ends = [am.FrictionProblem.from_delassus(ONE, [[x, 1.0]], [mu]) for x in (0.8, 0.2)]
    return FrictionPath(*ends)


@pytest.mark.parametrize("switch", list(Switch))
def test_non_smooth_folds(switch):
    path = one_contact()
    limits = Limits((0.0, 3.0))
    branch = continue_both(path, np.zeros(2), 0.0, limits, Continuation(switch=switch))
    np.testing.assert_allclose([e.parameter for e in branch.folds], [4 / 3, 1 / 2], atol=1e-11)
    assert [(e.before, e.after) for e in branch.folds] == [("f", "-"), ("-", "s")]
    assert not any(e.smooth for e in branch.folds)
    r = [path.solution(y, 1.0).r[0] for y in branch.at(1.0)]
    np.testing.assert_allclose(r, [[0, 0], [1 / 3, -2 / 3], [5 / 3, -7 / 3]], atol=1e-10)


def test_a_problem_that_tells_nothing_but_the_protocol():
    branch = continue_both(Black(one_contact()), np.zeros(2), 0.0, Limits((0.0, 3.0)))
    np.testing.assert_allclose([e.parameter for e in branch.folds], [4 / 3, 1 / 2], atol=1e-11)


def random_path(seed, nc):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / (2 * nc) + 0.05 * np.eye(2 * nc)
    mu = rng.uniform(0, 3, nc) * (rng.random(nc) > 0.1)
    return FrictionPath(*(
        am.FrictionProblem.from_delassus(W, rng.standard_normal((nc, 2)), mu) for _ in range(2)
    ))  # fmt: skip


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_both_methods_walk_the_same_curve(seed, nc):
    path = random_path(seed, nc)
    y, limits = exact_state(path, 0.0), Limits((0.0, 1.0))
    exact, general = track_both(path, y, 0.0, limits), continue_both(path, y, 0.0, limits)
    assert general.stops == exact.stops
    assert [(e.kind, e.after) for e in general.events] == [
        (e.kind, e.after) for e in exact.events
    ]
    np.testing.assert_allclose([e.parameter for e in general.events],
                               [e.parameter for e in exact.events], atol=1e-9)  # fmt: skip


@settings(max_examples=12, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.integers(1, 3))
def test_friction_as_the_parameter_finds_all_solutions(seed, nc):
    """Pieces are curved here; every solution of the exhaustive search lies on a branch."""
    path = FrictionPath.friction(random_path(seed, nc).at(0.4))
    at = [0.05, 1.0, 2.0]
    diagram = bifurcation_diagram(path, Limits((0.01, 2.0)), at)
    assert diagram.complete, diagram.reason
    for p in at:
        assert len(diagram.solutions(p)) == len(enumerate_solutions(path.at(p)))


def test_critical_friction_of_a_load():
    """One contact under q = (0.2, 1): two more solutions from mu = 1.25 - 0.2 … on, by hand.

    Stick needs |r_T| <= mu r_N at r = -W^-1 q = (5/3, -7/3): mu >= 7/5, where the slipping
    solution r_N = -0.2 / (1 - 0.8 mu) leaves it.
    """
    path = FrictionPath.friction(am.FrictionProblem.from_delassus(ONE, [[0.2, 1.0]], [1.0]))
    stick = path.state([[5 / 3, -7 / 3]])
    branch = follow_path(path, stick, 3.0, Limits((0.5, 4.0)))
    assert [e.parameter for e in branch.folds] == pytest.approx([1.4], abs=1e-11)
    assert len(branch.at(3.0)) == 2
    diagram = bifurcation_diagram(path, Limits((0.5, 4.0)), [3.0])
    assert diagram.critical == pytest.approx(1.4, abs=1e-11)
    assert len(diagram) == 2  # the open solution is a branch of its own


def test_tresca_and_three_dimensions_go_through_the_general_algorithm():
    rng = np.random.default_rng(1)
    A = rng.standard_normal((6, 6))
    W = A @ A.T + np.eye(6)
    for law in (am.Coulomb([0.3, 0.3]), am.Tresca([0.2, 0.2])):
        ends = [am.FrictionProblem.from_delassus(W, q, law)
                for q in (rng.uniform(0.1, 1, (2, 3)), rng.uniform(-1, 0, (2, 3)))]  # fmt: skip
        path = FrictionPath(*ends)
        start = path.state(am.solve(path.at(0.0), tolerance=1e-11).r)
        branch = follow_path(path, start, 0.0, Limits((0.0, 1.0)))
        assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)
        for point in branch.points:
            solution = path.solution(point.state, point.parameter)
            assert solution.convergence.error < 1e-9
        solved = am.solve(path.at(1.0), tolerance=1e-11)
        np.testing.assert_allclose(path.solution(branch.points[-1].state, 1.0).r, solved.r,
                                   atol=1e-7)  # fmt: skip


class Hat:
    """Example 1 of [LR]: H is known on four quadrants, two of them meeting along a solution."""

    def quadrant(self, y, p):
        return int(y[0] >= 0) + 2 * int(p >= 0)

    piece = quadrant

    def pieces(self, y, p, tolerance):
        return [q for q in range(4) if (y[0] >= -tolerance if q % 2 else y[0] <= tolerance)
                and (p >= -tolerance if q >= 2 else p <= tolerance)]  # fmt: skip

    def residual_of(self, q, y, p):
        return {0: y + p**2, 1: -y + p**2, 2: y, 3: -y}[q]

    def jacobian_of(self, q, y, p):
        return (np.eye(1) * (-1 if q % 2 else 1), np.array([2 * p if q < 2 else 0.0]))

    def margins(self, q, y, p):
        return np.array([y[0] if q % 2 else -y[0], p if q >= 2 else -p])

    def residual(self, y, p):
        return self.residual_of(self.quadrant(y, p), y, p)

    def jacobian(self, y, p):
        return self.jacobian_of(self.quadrant(y, p), y, p)


def test_curves_that_touch_are_told_by_their_pieces():
    """Two curves leave (0, 0) along (0, -1), which first order alone can not tell."""
    system = first_order(Hat(), np.zeros(1), 0.0)
    assert sorted(round(t.rate) for t in system.tangents) == [-1, -1, 1]
    back = [t for t in system.tangents if t.rate < 0]
    assert not any(t.strict for t in back)
    assert len({t.piece for t in back}) == 2


def test_options_are_checked():
    with pytest.raises(InvalidInput, match="step: expected 0 < min_step"):
        Continuation(step=1.0, max_step=0.1)
    with pytest.raises(InvalidInput, match="shrink"):
        Continuation(shrink=2.0)
    with pytest.raises(InvalidInput, match="switch"):
        continue_both(Black(one_contact()), np.zeros(2), 0.0, Limits((0.0, 1.0)),
                      Continuation(switch=Switch.FIRST_ORDER))  # fmt: skip
    with pytest.raises(InvalidInput, match="method"):
        follow_path(Black(one_contact()), np.zeros(2), 0.0, Limits((0.0, 1.0)),
                    method=Method.EVENTS)  # fmt: skip


@pytest.mark.parametrize("name", ["step", "grow", "residual", "corrections", "quick", "border"])
@pytest.mark.parametrize("value", ["a", None, np.nan, -1.0])
def test_options_are_numbers(name, value):
    with pytest.raises(InvalidInput, match=f"{name}: expected"):
        Continuation(**{name: value})


def ellipse(width, height=1.0):
    return Smooth(lambda y, p: (y / height) ** 2 + (p / width) ** 2 - 1,
                  lambda y, p: np.diag(2 * y / height**2),
                  lambda y, p: np.atleast_1d(2 * p / width**2))  # fmt: skip


def test_a_sharp_turn_of_a_smooth_curve_is_no_kink():
    """Folds with a radius of 1e-6: passed only with steps smaller than the default allows."""
    start, limits = np.array([1e-3]), Limits((-2.0, 2.0))
    branch = continue_both(ellipse(1.0, 1e-3), start, 0.0, limits)
    assert branch.stops == (Stop.STEP_TOO_SMALL, Stop.STEP_TOO_SMALL)
    assert not [e for e in branch.events if e.kind is EventKind.STATUS]
    assert 0.999 < branch.parameter.max() < 1.0
    finer = Continuation(min_step=1e-10, min_cosine=0.9, grow=3.0)
    branch = continue_both(ellipse(1.0, 1e-3), start, 0.0, limits, finer)
    assert branch.closed
    np.testing.assert_allclose([e.parameter for e in branch.folds], [1, -1], atol=1e-9)


def test_a_large_curve_is_followed_to_rounding():
    """Residuals of 1e6 can not be reduced to 5e-12."""
    large = Smooth(lambda y, p: y @ y + p**2 - 1e6, lambda y, p: 2 * y[None],
                   lambda y, p: 2 * p)  # fmt: skip
    options = Continuation(max_step=100.0, min_cosine=0.99)
    branch = continue_both(large, np.array([1e3]), 0.0, Limits((-2e3, 2e3)), options)
    assert branch.closed
    np.testing.assert_allclose([e.parameter for e in branch.folds], [1e3, -1e3], rtol=1e-12)


def test_a_start_where_smooth_curves_cross_is_refused():
    cross = Smooth(lambda y, p: y * (y - p), lambda y, p: np.diag(2 * y - p), lambda y, p: -y)
    with pytest.raises(SingularOperator, match="start: the tangent is not unique at 0"):
        continue_both(cross, np.zeros(1), 0.0, Limits((-1.0, 1.0)))


def test_a_corrector_that_fails_says_so():
    broken = Smooth(lambda y, p: np.full(1, np.nan) if p > 0.5 else y, lambda y, p: np.eye(1),
                    lambda y, p: np.zeros(1))  # fmt: skip
    branch = continue_both(broken, np.zeros(1), 0.0, Limits((0.0, 1.0)))
    assert branch.stops[1] is Stop.LOST
    assert branch.points[-1].parameter == pytest.approx(0.5, abs=1e-5)


class Bars:
    """Bars in series of stresses k l (1 - l^2) / 2 = p, with nothing left at l = 0."""

    def __init__(self, *stiffness):
        self.stiffness = np.array(stiffness)

    def residual(self, y, p):
        if y.min() <= 0:
            return np.full(y.shape, np.inf)
        return self.stiffness * y * (1 - y**2) / 2 - p

    def jacobian(self, y, p):
        if y.min() <= 0:
            raise np.linalg.LinAlgError("pressed flat")
        return np.diag(self.stiffness * (1 - 3 * y**2) / 2), -np.ones(y.shape)

    def piece(self, y, p):
        return "all"


@pytest.mark.parametrize("stiffness", [(1.0,), (1.0, 1.6), (1.0, 1.0), (1.6, 1.0, 1.0)])
@pytest.mark.parametrize("step", [0.02, 0.3])
def test_a_fold_is_told_where_bars_alike_give_way_together(stiffness, step):
    """At 1 / sqrt 3 of their length, where tangents are several; the path ends at nothing."""
    options = am.Continuation(step=step, max_step=step)
    branch = am.follow(Bars(*stiffness), start=np.ones(len(stiffness)), at=0.0,
                       interval=(-0.1, 0.5), options=options)  # fmt: skip
    (fold,) = branch.folds
    assert fold.parameter == pytest.approx(1 / (3 * np.sqrt(3)), rel=1e-6)
    assert branch[-1].parameter == pytest.approx(0.0, abs=1e-6)


def test_newton_steps_that_end_where_there_is_no_derivative_find_nothing():
    bar, tolerances = Bars(1.0), am.Continuation().tolerances
    curve = Curve(bar, 1)
    for far in (1e-13, 1e-3):
        assert curve.correct(np.array([far]), -far, np.zeros(1), 1.0, tolerances) is None
    assert corrected(bar, np.array([far]), -far) is None
