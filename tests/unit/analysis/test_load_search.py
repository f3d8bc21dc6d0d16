"""All curves of solutions of 3D problems over load and friction, beside what is known."""

import itertools

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import amontons as am
from amontons.analysis.solutions.discs.load_search import LARGEST, pieces_in_space
from amontons.core.clock import Deadline


def problem(W, q, mu):
    q = np.asarray(q, dtype=float)
    return am.FrictionProblem.from_delassus(np.asarray(W, dtype=float), q, mu)


def solutions_at(W, q, mu, count=24):
    """(pattern, r) of all solutions: every pattern by Newton's method from many directions."""
    found = []
    for pattern in itertools.product("fsl", repeat=len(mu)):
        slip = [i for i, letter in enumerate(pattern) if letter == "l"]
        grid = np.arange(count) * 2 * np.pi / count
        for start in itertools.product(grid, repeat=len(slip)):
            r = _newton(W, q, mu, pattern, slip, np.array(start))
            if r is not None and not any(np.abs(r - other).max() < 1e-6 for _, other in found):
                found.append(("".join(pattern), r))
    return found


def _newton(W, q, mu, pattern, slip, angle):
    for _ in range(12):
        values = [_across(W, q, mu, pattern, slip, angle)]
        steps = 1e-7 * np.eye(len(slip))
        values += [_across(W, q, mu, pattern, slip, angle + step) for step in steps]
        g = values[0][0]
        J = np.array([(v[0] - g) / 1e-7 for v in values[1:]]).T.reshape(len(slip), len(slip))
        if not len(slip) or abs(np.linalg.det(J)) < 1e-12:
            break
        angle = angle - np.clip(np.linalg.solve(J, g), -0.5, 0.5)
    g, r, u = _across(W, q, mu, pattern, slip, angle)
    fits = np.abs(g).max(initial=0.0) < 1e-9
    for i, letter in enumerate(pattern):
        n, T = 3 * i, slice(3 * i + 1, 3 * i + 3)
        if letter == "f":
            fits &= u[n] >= 0
        elif letter == "s":
            fits &= mu[i] * r[n] >= np.linalg.norm(r[T])
        else:
            a = angle[slip.index(i)]
            fits &= r[n] >= 0 and u[T] @ [np.cos(a), np.sin(a)] >= 0
    return r if fits else None


def _across(W, q, mu, pattern, slip, angle):
    """(u_T across the directions of slip, r, u) with the linear equations solved."""
    unit, columns, rows = np.eye(len(q)), [], []
    for i, letter in enumerate(pattern):
        if letter == "s":
            columns += list(unit[3 * i : 3 * i + 3])
            rows += range(3 * i, 3 * i + 3)
        elif letter == "l":
            a = angle[slip.index(i)]
            columns.append(unit[3 * i] - mu[i] * (np.cos(a) * unit[3 * i + 1]
                                                  + np.sin(a) * unit[3 * i + 2]))  # fmt: skip
            rows.append(3 * i)
    R = np.array(columns).reshape(-1, len(q)).T
    r = R @ np.linalg.solve((W @ R)[rows], -q[rows]) if rows else np.zeros(len(q))
    u = W @ r + q
    g = [np.cos(a) * u[3 * i + 2] - np.sin(a) * u[3 * i + 1]
         for i, a in zip(slip, angle, strict=True)]  # fmt: skip
    return np.array(g), r, u


@pytest.mark.parametrize(("seed", "contacts"), [(1, 1), (3, 1), (7, 2)])
def test_every_solution_is_on_a_branch(seed, contacts):
    """Also unsymmetric W, friction that changes, a contact without friction."""
    rng = np.random.default_rng(seed)
    m = 3 * contacts
    X, S = rng.normal(size=(2, m, m))
    W = X @ X.T / m + 0.1 * np.eye(m) + (0.2 * (S - S.T) if seed % 2 else 0)
    mus = rng.uniform(0.2, 4, contacts) * np.ones((2, 1))
    if seed == 3:
        mus[1] *= 1.7
    loads = rng.normal(size=(2, contacts, 3)) - [0.7, 0, 0]
    a, b = (problem(W, q, mu) for q, mu in zip(loads, mus, strict=True))
    diagram = am.diagram(b, base=a)
    assert diagram.whole == (0.0, 1.0)
    assert diagram.complete
    to_r = diagram.branches[0].problem.to_r
    for t in rng.uniform(size=3):
        q, mu = ((1 - t) * x[0] + t * x[1] for x in (loads, mus))
        known = [r for _, r in solutions_at(W, q.ravel(), mu, 12 if contacts == 1 else 6)]
        there = [y * to_r for y in diagram.solutions(t)]
        assert len(there) == len(known)
        assert all(min(np.abs(r - x).max() for x in there) < 1e-6 for r in known)


# one contact: W_NT = (0.8, 0), and q_T = (0.8, 0.2) at all loads
W_ONE = [[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 1.0]]
A, C, MU, Q1, Q2 = 1.0, 0.8, 2.0, 0.8, 0.2


def normal_load(r):
    """q_N of the solution that slips with normal reaction r: e along W_TN r + q_T, u_N = 0."""
    e = (C * r + Q1) / np.hypot(C * r + Q1, Q2)
    return r * (MU * C * e - A)


def slip_speed(r):
    """u_T along e of the same."""
    return np.hypot(C * r + Q1, Q2) - MU * r


def test_the_folds_of_one_contact_are_those_of_the_closed_form():
    """Stick turns into slip at the edge of the cone, slip into an open contact at q_N = 0."""
    a, b = (problem(W_ONE, [[q, Q1, Q2]], [MU]) for q in (-0.5, 0.5))
    diagram = am.diagram(b, base=a)
    assert diagram.whole == (0.0, 1.0)
    edge = minimize_scalar(lambda r: slip_speed(r) ** 2, (0.1, 1.0, 2.0), tol=1e-14).x
    low, high = diagram.folds
    assert low == pytest.approx(0.5, abs=1e-9)
    assert high == pytest.approx(0.5 + normal_load(edge), abs=1e-6)
    to_r = diagram.branches[0].problem.to_r
    r = 0.5 * edge
    states = diagram.solutions(0.5 + normal_load(r))
    assert len(states) == 3
    assert min(abs((y * to_r)[0] - r) for y in states) < 1e-9


def test_branches_that_end_early_are_not_the_whole():
    """All pieces are proved, but the branch through the middle of one stops within it."""
    a, b = (problem(W_ONE, [[q, Q1, Q2]], [MU]) for q in (-0.5, 0.6))
    diagram = am.diagram(b, base=a, max_points=2)
    assert diagram.whole is None
    assert not diagram.undecided
    assert "max points" in diagram.reason


# two contacts in a plane whose curves have a loop near the middle of the interval, not at it
PLANE = [0, 1, 3, 4]
W_LOOP = np.eye(6)
W_LOOP[np.ix_(PLANE, PLANE)] = [
    [1.44, 0.29, 0.25, -0.33],
    [0.29, 1.40, -0.93, -0.21],
    [0.25, -0.93, 0.96, 0.18],
    [-0.33, -0.21, 0.18, 0.83],
]
LOADS = np.zeros((2, 2, 3))
LOADS[:, :, :2] = [[-0.86, -0.65], [-0.46, 1.2]], [[0.62, 0.74], [0.29, 1.21]]
LOOP_MU = [0.78, 2.18]


def looped(aside=0.0):
    return [problem(W_LOOP, q + [0, 0, aside], LOOP_MU) for q in LOADS]


def test_a_plane_problem_in_space_has_the_diagram_of_the_plane():
    start, end = looped()
    diagram = am.diagram(end, base=start)
    plane = [problem(W_LOOP[np.ix_(PLANE, PLANE)], q[:, :2], LOOP_MU) for q in LOADS]
    known = am.diagram(plane[1], base=plane[0])
    assert diagram.whole == known.whole == (0.0, 1.0)
    assert [branch.closed for branch in diagram] == [branch.closed for branch in known]
    assert diagram.folds == pytest.approx(known.folds, abs=1e-8)


def test_a_closed_branch_off_the_plane_is_seen(tmp_path):
    start, end = looped(0.01)
    diagram = am.diagram(end, base=start)
    assert am.write_certificate(start, diagram, tmp_path / "c.h5", end=end) == "all branches"
    proved = am.check_certificate(tmp_path / "c.h5")
    assert "of 2 curves" in proved
    assert proved.endswith("1 with neither end.")
    assert diagram.whole == (0.0, 1.0)
    assert [branch.closed for branch in diagram] == [False, True]
    low, high = diagram.folds
    p = (low + high) / 2
    q = (1 - p) * LOADS[0] + p * LOADS[1] + [0, 0, 0.01]
    known = [r for _, r in solutions_at(W_LOOP, q.ravel(), LOOP_MU, 6)]
    assert len(known) == len(diagram.solutions(p)) == 3
    for outside in (low - 1e-5, high + 1e-5):
        assert len(diagram.solutions(outside)) == 1


def test_a_load_that_grows_from_zero():
    _, end = looped(0.1)
    diagram = am.diagram(end, base=end.with_load(np.zeros((2, 3))))
    assert diagram.whole == pytest.approx((1e-6, 1.0))


def test_what_is_undecided_is_named():
    """r_T = mu r_N with u_T = 0 all the way: stick and slip can not be told apart."""
    W, r = np.array(W_ONE), np.array([1.0, 0.3, 0.4])
    rest, a, b = (problem(W, [-c * (W @ r)], [0.5]) for c in (0, 1, 2))
    found = pieces_in_space(rest, b, Deadline.counted(0.2))
    assert found.doubt
    assert found.undecided[0][0] == 0.0  # the end that is left out is not proved either
    diagram = am.diagram(b, base=a, time_limit=Deadline.counted(2.0))
    assert diagram.whole is None
    assert diagram.undecided


def test_a_singular_W_proves_nothing():
    W = np.zeros((6, 6))
    W[:3, :3] = W[3:, 3:] = W[:3, 3:] = W[3:, :3] = np.eye(3)
    a, b = (problem(W, np.tile(q, (2, 1)), [0.3, 0.3]) for q in ([-1, 0.1, 0], [-1, 1, 0]))
    found = pieces_in_space(a, b, Deadline.counted(1))
    assert "not definite" in found.doubt
    assert found.undecided == ((0.0, 1.0),)


def test_more_contacts_than_an_interval_takes_are_told():
    """Nothing is proved between loads, and the reason says so."""
    nc = LARGEST + 1
    W = np.eye(3 * nc)
    a, b = (problem(W, np.tile(q, (nc, 1)), [0.3] * nc) for q in ([-1, 0.1, 0], [-1, 0.2, 0]))
    diagram = am.diagram(b, base=a, time_limit=Deadline.counted(20.0))
    assert diagram.whole is None
    assert f"{nc} contacts: the search of an interval takes up to {LARGEST}" in diagram.reason
