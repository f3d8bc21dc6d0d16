"""Exact solution curves: by hand, against enumeration, through corners, at limits."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.diagram import bifurcation_diagram
from amontons.analysis.paths.event_tracking import leaving, track
from amontons.analysis.paths.first_order import orientation
from amontons.analysis.paths.following import Limits, continue_both, track_both
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.path import EventKind, Stop
from amontons.analysis.paths.starting import exact_state, polished
from amontons.analysis.solutions.enumerate import enumerate_solutions
from amontons.core.errors import InvalidInput, UnsupportedForm

ONE = [[1.0, 0.8], [0.8, 1.0]]


def one_contact(mu=2.0):
    """q_N from 0.8 to 0.2; the fold from stick is at q_N = 0.5, that from open at 0."""
    ends = [am.FrictionProblem.from_delassus(ONE, [[x, 1.0]], [mu]) for x in (0.8, 0.2)]
    return FrictionPath(*ends)


def random_path(seed, contacts=None, mu=3.0):
    rng = np.random.default_rng(seed)
    nc = contacts or int(rng.integers(1, 6))
    A = rng.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / (2 * nc) + 0.05 * np.eye(2 * nc)
    friction = rng.uniform(0, mu, nc) * (rng.random(nc) > 0.1)
    ends = [
        am.FrictionProblem.from_delassus(W, rng.standard_normal((nc, 2)), friction)
        for _ in range(2)
    ]
    return FrictionPath(*ends)


def test_one_contact_by_hand():
    path = one_contact()
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 3.0)))
    assert [event.kind for event in branch.folds] == [EventKind.FOLD] * 2
    np.testing.assert_allclose([e.parameter for e in branch.folds], [4 / 3, 1 / 2], rtol=1e-14)
    assert [(e.before, e.after) for e in branch.folds] == [("f", "-"), ("-", "s")]
    r = [path.solution(y, 1.0).r[0] for y in branch.at(1.0)]
    np.testing.assert_allclose(r, [[0, 0], [1 / 3, -2 / 3], [5 / 3, -7 / 3]], atol=1e-14)
    assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)
    assert [row["pattern"] for row in branch.table()][0] == "f"


def test_little_friction_has_no_fold():
    path = one_contact(mu=1.0)
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 2.5)))
    assert not branch.folds
    assert branch.points[-1].parameter == 2.5


def corner(gap):
    """(q_N, q_T) on a line past 0 at a distance: there free, slip, stick and slip meet."""
    ends = [am.FrictionProblem.from_delassus(ONE, [[0.3 * p + gap, p]], [2.0]) for p in (-1, 1)]
    return FrictionPath(*ends)


@pytest.mark.parametrize(("follow", "near", "far"), [
    (track_both, 3e-11, 1e-9), (continue_both, 3e-10, 1e-8),
])  # fmt: skip
def test_curves_that_pass_by_each_other_are_no_branch_point_or_called_unresolved(
    follow, near, far
):
    for gap in (0.0, near, -near, far, -far):
        path = corner(gap)
        branch = follow(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))
        told = [e.detail for e in branch.events if e.kind is EventKind.BRANCH]
        assert len(told) == (abs(gap) <= near)
        assert all(("unresolved" in detail) == (gap != 0) for detail in told)


def test_starting_in_the_middle_gives_the_same_curve():
    path = one_contact()
    slip = path.state([[1 / 3, -2 / 3]])
    branch = track_both(path, slip, 1.0, Limits((0.0, 3.0)))
    assert sorted(e.parameter for e in branch.folds) == pytest.approx([1 / 2, 4 / 3], rel=1e-13)
    assert len(branch.at(1.0)) == 3
    assert np.all(np.diff(branch.arclength) >= 0)


@pytest.mark.parametrize("seed", range(30))
def test_all_solutions_lie_on_the_branches_and_no_others(seed):
    """Against the exhaustive search with proof, which shares no code with the tracking."""
    path = random_path(seed)
    diagram = bifurcation_diagram(path, Limits((0.0, 1.0)), [0.0, 0.37, 1.0])
    assert diagram.complete, diagram.reason
    for p in (0.0, 0.37, 1.0):
        found = enumerate_solutions(path.at(p))
        ours = diagram.solutions(p)
        assert len(found) == len(ours)
        for y in ours:
            assert path.solution(y, p).convergence.error < 1e-12


@pytest.mark.parametrize("seed", range(10))
def test_every_line_belongs_to_one_branch_once(seed):
    path = random_path(seed + 50, contacts=4)
    diagram = bifurcation_diagram(path, Limits((0.0, 1.0)), [0.0, 0.5, 1.0])
    lines = [
        {(str(e.before), str(e.after)) for e in branch.events if e.after is not None}
        for branch in diagram
    ]
    for k, one in enumerate(lines):
        for other in lines[k + 1 :]:
            assert not one & other


@pytest.mark.parametrize("seed", range(8))
def test_orientation_is_kept_along_a_branch(seed):
    path = random_path(seed + 100, contacts=4)
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))
    signs = set()
    for a, b in zip(branch.points, branch.points[1:], strict=False):
        middle, p = (a.state + b.state) / 2, (a.parameter + b.parameter) / 2
        signs.add(orientation(path, middle, p, b.parameter - a.parameter))
    assert len(signs) == 1


@pytest.mark.parametrize("seed", range(10))
def test_rounding_does_not_grow_along_many_events(seed):
    path = random_path(seed, contacts=15, mu=1.0)
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))
    for point in branch.points:
        assert path.solution(point.state, point.parameter).convergence.error < 1e-11


def symmetric():
    """Two mirrored contacts, which close at once, and one on the axis, which never slips."""
    W = np.array([
        [2.0, 0.5, 0.3, 0.0, 0.4, 0.1],
        [0.5, 2.0, 0.2, 0.0, 0.1, 0.2],
        [0.3, 0.2, 1.5, 0.0, 0.3, -0.2],
        [0.0, 0.0, 0.0, 1.5, 0.0, 0.0],
        [0.4, 0.1, 0.3, 0.0, 2.0, -0.5],
        [0.1, 0.2, -0.2, 0.0, -0.5, 2.0],
    ])  # fmt: skip
    W[1, 5] = W[5, 1] = -0.2
    W[1, 4] = W[4, 1] = -0.1
    W[0, 5] = W[5, 0] = 0.1
    start = [[1.0, 0.5], [1.5, 0.0], [1.0, -0.5]]
    end = [[-1.0, 0.5], [-2.0, 0.0], [-1.0, -0.5]]
    return FrictionPath(
        *(am.FrictionProblem.from_delassus(W, q, [0.7] * 3) for q in (start, end))
    )


def test_symmetric_contacts_close_together():
    path = symmetric()
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))
    assert branch.stops == (Stop.INTERVAL, Stop.INTERVAL)
    assert branch.points[-1].parameter == 1.0
    for event in branch.events:  # at the points between, letters depend on rounding
        for pattern in filter(None, (event.before, event.after)):
            assert pattern[0] == {"+": "-", "-": "+"}.get(pattern[2], pattern[2])
    found = enumerate_solutions(path.at(1.0))
    assert len(found) == 1
    np.testing.assert_allclose(
        branch.points[-1].state, path.state(found.solutions[0].r), atol=1e-12
    )


def test_all_contacts_grazing_at_the_start():
    W = np.diag([1.0, 2.0, 1.0, 2.0]) + 0.1
    ends = [am.FrictionProblem.from_delassus(W, q, [0.5] * 2)
            for q in (np.zeros((2, 2)), [[-1.0, 0.1], [-1.0, 3.0]])]  # fmt: skip
    path = FrictionPath(*ends)
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((-1.0, 1.0)))
    assert len(branch) == 3
    r = path.solution(branch.points[-1].state, 1.0)
    assert r.convergence.error < 1e-13
    assert r.pattern == "s-"
    assert branch.points[0].piece == "ff"


def test_slip_at_constant_load():
    """mu W_NT = W_NN: the piece of slip stands upright in the diagram."""
    W = np.array([[1.0, 0.5], [0.5, 1.0]])
    ends = [
        am.FrictionProblem.from_delassus(W, q, [2.0]) for q in ([[-1.0, 0.0]], [[1.0, 2.0]])
    ]
    path = FrictionPath(*ends)
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 2.0)))
    upright = [e for e in branch.events if e.kind is EventKind.STATUS]
    np.testing.assert_allclose([e.parameter for e in upright], [0.5, 0.5], atol=1e-14)
    assert not branch.folds


def test_ends_are_named():
    path = one_contact()
    start = exact_state(path, 0.0)
    few = track_both(path, start, 0.0, Limits((0.0, 3.0), max_points=2))
    assert few.stops[1] is Stop.MAX_POINTS
    asked = track_both(path, start, 0.0, Limits((0.0, 3.0), callback=lambda point, event: True))
    assert asked.stops == (Stop.STOPPED, Stop.STOPPED)
    late = track_both(path, start, 0.0, Limits((0.0, 3.0), time_limit=1e-9))
    assert late.stops[1] is Stop.TIME_LIMIT
    whole = track_both(path, start, 0.0, Limits((0.0, 3.0)))
    again = track_both(path, start, 0.0, Limits((0.0, 3.0)), known=[whole])
    assert again.stops[1] is Stop.JOINED


def test_going_on_from_the_last_point():
    path = random_path(3, contacts=8, mu=1.0)
    limits = Limits((0.0, 1.0))
    whole = track_both(path, exact_state(path, 0.0), 0.0, limits)
    middle = whole.points[len(whole) // 2]
    again = track_both(path, middle.state, middle.parameter, limits)
    np.testing.assert_allclose(again.points[-1].state, whole.points[-1].state, atol=1e-12)


def test_bad_input_is_refused():
    path = one_contact()
    with pytest.raises(InvalidInput, match="interval"):
        Limits((1.0, 0.0))
    tangent = leaving(path, np.zeros(2), 0.0).tangents[0]
    with pytest.raises(InvalidInput, match="parameter in 0 … 1"):
        next(track(path, np.zeros(2), 2.0, tangent, (0.0, 1.0)))
    with pytest.raises(InvalidInput, match="start: expected a solution"):
        polished(path, np.array([5.0, 0.0]), 0.5)
    with pytest.raises(UnsupportedForm, match="straight lines"):
        leaving(FrictionPath.friction(path.start), np.zeros(2), 0.5)
    other = am.FrictionProblem.from_delassus(np.eye(2), [[0.0, 0.0]], [2.0])
    with pytest.raises(InvalidInput, match="same matrices"):
        FrictionPath(path.start, other)


@pytest.mark.parametrize("follow", [track_both, continue_both])
def test_a_turn_at_a_branch_point_is_a_fold(follow):
    path = corner(0.0)
    rays = leaving(path, np.zeros(2), 0.5).tangents  # the parameter runs from 0 to 1
    assert len(rays) > 2
    turned = 0
    for ray in rays:
        p = 0.5 + 0.3 * ray.rate / abs(ray.rate)
        y = 0.3 * ray.direction / abs(ray.rate)
        branch = follow(path, polished(path, y, p), p, Limits((0.0, 1.0)))
        parameters = [point.parameter for point in branch.points]
        senses = np.sign(np.diff(parameters))
        turns = int((np.diff(senses[senses != 0]) != 0).sum())
        assert len(branch.folds) == turns
        turned += turns
    assert turned
