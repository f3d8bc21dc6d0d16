"""All pieces of a load interval: beside brute force, closed branches, ends without load."""

from itertools import product

import numpy as np
import pytest

import amontons as am
from amontons.analysis.solutions.interval_search import pieces_between
from amontons.analysis.solutions.load_interval import START
from amontons.core.clock import Deadline
from amontons.mechanics.ready.hild import hild_triangle


def problem(W, q, mu):
    q = np.asarray(q, dtype=float)
    return am.FrictionProblem.from_delassus(np.asarray(W, dtype=float), q, mu)


def pieces(start, end):
    return pieces_between(start, end, Deadline.counted(60))


def solutions_at(W, q, mu):
    """Patterns that have a solution: each solved on its own, with no code of the package."""
    found = []
    for pattern in product("fs+-", repeat=len(mu)):
        columns, rows = [], []
        for i, letter in enumerate(pattern):
            n, t = 2 * i, 2 * i + 1
            unit = np.eye(len(q))
            if letter == "s":
                columns += [unit[n], unit[t]]
                rows += [n, t]
            elif letter != "f":
                columns.append(unit[n] + {"+": 1, "-": -1}[letter] * mu[i] * unit[t])
                rows.append(n)
        R = np.array(columns).reshape(-1, len(q)).T
        r = R @ np.linalg.solve((W @ R)[rows], -q[rows]) if rows else np.zeros(len(q))
        u = W @ r + q
        if all(
            {"f": u[2 * i] >= 0, "s": mu[i] * r[2 * i] >= abs(r[2 * i + 1]),
             "+": r[2 * i] >= 0 >= u[2 * i + 1], "-": min(r[2 * i], u[2 * i + 1]) >= 0}[letter]
            for i, letter in enumerate(pattern)
        ):  # fmt: skip
            found.append("".join(pattern))
    return found


@pytest.mark.parametrize("varies", ["load", "friction", "both"])
@pytest.mark.parametrize("seed", range(25))
def test_every_solution_is_on_a_piece(seed, varies):
    rng = np.random.default_rng(seed)
    nc = int(rng.integers(1, 4))
    X = rng.normal(size=(2 * nc, 2 * nc))
    W, mus = X @ X.T / (2 * nc) + 0.1 * np.eye(2 * nc), rng.uniform(0.2, 4, (2, nc))
    loads = rng.normal(size=(2, nc, 2))
    if varies == "load":
        mus[1] = mus[0]
    if varies == "friction":
        loads[1] = loads[0]
    mus[0] *= rng.integers(2)  # also from none on
    found = pieces(*(problem(W, q, mu) for q, mu in zip(loads, mus, strict=True)))
    assert found.doubt == ""

    def at(t):
        return ((1 - t) * x[0] + t * x[1] for x in (loads, mus))

    for t in rng.uniform(size=20):
        q, mu = at(t)
        here = [piece.pattern for piece in found.pieces if piece.low <= t <= piece.high]
        there = solutions_at(W, q.ravel(), mu)
        assert sorted(here) == sorted(there) or not mu.any()
    for piece in found.pieces:
        q, mu = at(piece.middle)
        assert problem(W, q, mu).error(piece.r) < 1e-12


def test_the_critical_friction_of_a_load_is_proved():
    """[Hild]: one solution up to 3, three beyond; found between the values as well."""
    diagram = am.diagram(hild_triangle(8), "friction", (0.5, 4.0))
    assert diagram.whole == (0.5, 4.0)
    assert diagram.critical == pytest.approx(3.0, abs=1e-8)
    assert [len(diagram.solutions(p)) for p in (2.99, 3.01, 3.2, 3.9)] == [1, 3, 3, 3]


# two contacts whose curves have a loop near the middle of the interval, not at it
W_LOOP = [
    [1.44, 0.29, 0.25, -0.33],
    [0.29, 1.40, -0.93, -0.21],
    [0.25, -0.93, 0.96, 0.18],
    [-0.33, -0.21, 0.18, 0.83],
]
LOOPED = [
    problem(W_LOOP, q, [0.78, 2.18])
    for q in ([[-0.86, -0.65], [-0.46, 1.2]], [[0.62, 0.74], [0.29, 1.21]])
]


def test_a_closed_branch_between_the_values_is_seen():
    diagram = am.diagram(LOOPED[1], base=LOOPED[0])
    assert diagram.complete
    assert diagram.whole == (0.0, 1.0)
    assert [branch.stops[0] for branch in diagram] == [am.Stop.INTERVAL, am.Stop.CLOSED]
    low, high = diagram.folds
    assert 0.5 < low < high < 0.6
    for p, count in ((low - 1e-6, 1), (low + 1e-6, 3), (high - 1e-6, 3), (high + 1e-6, 1)):
        exact = [(1 - p) * np.array(a.q) + p * np.array(b.q) for a, b in [LOOPED]][0]
        assert len(solutions_at(np.array(W_LOOP), exact.ravel(), [0.78, 2.18])) == count
        assert len(diagram.solutions(p)) == count


def test_values_alone_do_not_see_it_and_say_so():
    diagram = am.diagram(LOOPED[1], base=LOOPED[0], at=(0, 0.5, 1))
    assert diagram.complete
    assert diagram.whole is None
    assert len(diagram) == 1
    assert "nothing is proved between" in diagram.reason


def test_an_end_without_load_is_left_out():
    rest = LOOPED[0].with_load(np.zeros((2, 2)))
    diagram = am.diagram(LOOPED[0], base=rest)
    assert diagram.whole == pytest.approx((START, 1.0))
    backwards = pieces(LOOPED[0], rest)
    assert backwards.doubt == ""
    assert backwards.interval == (0.0, 1.0 - START)


def test_a_load_that_passes_through_zero():
    """All patterns touch there; the curve goes on."""
    loads = np.array([[-1.0, 0.2], [-0.5, -0.1]])
    found = pieces(*(problem(W_LOOP, c * loads, [0.3, 0.4]) for c in (1, -1)))
    assert found.doubt == ""
    assert [(p.pattern, p.low, p.high) for p in found.pieces][-1][0] == "ff"
    assert any(abs(p.high - 0.5) < 1e-9 for p in found.pieces)


def test_along_the_border_of_the_cone_nothing_is_claimed():
    """r_T = mu r_N with u_T = 0 all the way: stick and slip can not be told apart."""
    W = [[2.0, 0.5], [0.5, 1.0]]
    loads = [-2.25, -1.0], [-4.5, -2.0]  # r = (1, 0.5) and twice that
    found = pieces(*(problem(W, [q], [0.5]) for q in loads))
    assert "too near to a solution" in found.doubt
    diagram = am.diagram(problem(W, [loads[1]], [0.5]), base=problem(W, [loads[0]], [0.5]))
    assert diagram.whole is None


def test_a_contact_given_twice_leaves_a_doubt():
    W = np.array(W_LOOP)[np.ix_([0, 1, 0, 1], [0, 1, 0, 1])]
    loads = np.array([[-1.0, 0.3], [-1.0, 0.3]])
    found = pieces(problem(W, loads, [0.5, 0.5]), problem(W, 2 * loads, [0.5, 0.5]))
    assert "too near to a solution" in found.doubt


def test_without_any_load_nothing_is_searched():
    rest = LOOPED[0].with_load(np.zeros((2, 2)))
    assert pieces(rest, rest).doubt == "there is no load at either end"


def test_without_contacts_there_is_one_piece():
    none = problem(np.zeros((0, 0)), np.zeros((0, 2)), [])
    found = pieces(none, none)
    assert [(p.pattern, p.low, p.high) for p in found.pieces] == [("", 0.0, 1.0)]


def test_a_search_that_is_too_long_says_so():
    diagram = am.diagram(hild_triangle(25, mu=4.0), time_limit=0.05)
    assert diagram.whole is None
    assert "stopped after" in diagram.reason
