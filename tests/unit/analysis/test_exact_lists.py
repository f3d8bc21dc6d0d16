"""Lists and verdicts on hard problems, against exact arithmetic and by hand."""

import contextlib
import importlib
import json
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.analysis.certificates.uniqueness import Verdict
from amontons.analysis.scaled import Scaled
from amontons.analysis.solutions.existence import different, exist
from amontons.analysis.solutions.multistart import Finder
from amontons.app.cli import main
from amontons.core.errors import AmontonsError
from amontons.mechanics.ready.gallery import one_contact_2d
from amontons.mechanics.ready.hild import hild_triangle

BENCHMARKS = Path(__file__).resolve().parents[3] / "benchmarks"
UNIQUE = (Verdict.UNIQUE_EVERY_LOAD, Verdict.UNIQUE_THIS_LOAD)


@pytest.fixture(scope="module")
def benchmark():
    """The module of the benchmark, which finds its neighbours in its own folder."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        yield importlib.import_module("exact_lists")
    finally:
        sys.path.remove(str(BENCHMARKS))


def pressed_pad(small, d=2):
    """A contact that sticks, and one with three solutions that is loaded `small` times less.

    The load of the second is the small rest of q_2 + W_21 r_1.
    """
    coupling = np.array([[0.5, 0.25], [0.25, 0.5]])
    own = np.array([[1.0, 0.8], [0.8, 1.0]]) + coupling @ coupling.T
    W = np.block([[np.eye(2), coupling.T], [coupling, own]])
    r = np.array([1.0, 0.1])
    q = np.vstack([-r, -coupling @ r + small * np.array([0.44619781, 0.89493436])])
    if d == 3:
        W, q = np.insert(W, [2, 4], 0.0, axis=0), np.hstack([q, np.zeros((2, 1))])
        W = np.insert(W, [2, 4], 0.0, axis=1)
        W[2, 2] = W[5, 5] = 1.0
    return am.FrictionProblem.from_delassus(W, q, [0.5, 2.0])


@pytest.mark.parametrize("small", [1e-5, 5e-7, 1e-8, 1e-9, 1e-10, 1e-12, 1e-14])
def test_a_load_that_cancels_hides_no_solution(small):
    problem = pressed_pad(small)
    found = am.all_solutions(problem)
    listed = {w for s in found.solutions for w in (s.pattern, *s.touching)}
    assert listed >= {"sf", "ss", "s-"}
    assert found.complete == (small > 1e-6)
    if len(found) == 3:
        assert sum(s.orientation for s in found.solutions) == 1
        assert all(s.sole for s in found.solutions)
    verdict = am.uniqueness(problem, time_limit=5)
    assert verdict.verdict is Verdict.NOT_UNIQUE
    assert "the motion is the same" not in verdict.reason


@pytest.mark.parametrize("small", [1e-5, 1e-7, 1e-8])
def test_a_load_that_cancels_in_3d(small):
    problem = pressed_pad(small, 3)
    found = am.all_solutions(problem, time_limit=3)
    assert len(found) == 3 or not found.complete
    assert am.uniqueness(problem, time_limit=3).verdict not in UNIQUE
    many = am.multistart(problem, starts=200)
    assert len(many) == 3 or "one is missing" in many.reason or small < 1e-6


def test_the_load_of_a_contact_is_what_is_left_of_its_terms():
    problem = pressed_pad(1e-8)
    r = am.all_solutions(problem).solutions[0].r
    share, terms = load_shares(problem, r)
    assert share[1] == pytest.approx(1e-8 * np.hypot(0.446, 0.895) / 1.26, rel=0.5)
    assert terms[1] > 0.1
    assert not resolves(problem, r)
    assert resolves(pressed_pad(1e-3), r)
    lone = am.FrictionProblem.from_delassus(np.eye(4), [[-1.0, 0.0], [0.0, 0.0]], [0.5, 0.5])
    assert load_shares(lone, np.array([[1.0, 0.0], [0.0, 0.0]]))[0][1] == np.inf


def load_shares(problem, r):
    scaled = Scaled.of(problem)
    return scaled.load_shares(r / scaled.to_r)


def resolves(problem, r):
    scaled = Scaled.of(problem)
    return scaled.resolves(r / scaled.to_r)


def test_a_border_that_hides_no_other_solution_is_one():
    # r_T = mu r_N and u_T = 0 up to rounding: stick and slip, both with positive determinants
    W = np.array([[2.0, 0.3], [0.3, 1.0]])
    q = -W @ np.array([1.0, 0.3])
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, [q], [0.3]))
    assert found.one
    (solution,) = found.solutions
    assert {solution.pattern, *solution.touching} == {"s", "+"}
    assert solution.orientation == 1
    assert 0 < found.resolution < 1e-11


def test_a_fold_is_not_called_one_solution():
    # on the border of stick and slip with determinants of both signs: two solutions, or none
    found = am.all_solutions(hild_triangle(3, mu=3.0))
    stick = next(s for s in found.solutions if s.pattern == "sss")
    assert stick.orientation == 0
    assert not stick.sole
    assert found.complete  # degrees 1 and 0 add up to 1
    assert not found.one


def test_orientations_that_do_not_add_up_are_told(monkeypatch):
    monkeypatch.setattr(Finder, "_connected", lambda *_: False)
    finder = Finder(Scaled.of(one_contact_2d(2.0)), np.random.default_rng(0), 1e-8)
    for solution in am.all_solutions(one_contact_2d(2.0)).solutions[:2]:
        finder.add(solution.r / finder.scaled.to_r)
    assert finder.lacks_one
    assert "one is missing" in finder.reason(2)


def two_soft_directions(seed):
    """W with two tiny eigenvalues, whose inverse is not definite in floating point."""
    random = np.random.default_rng(seed)
    Q = np.linalg.qr(random.standard_normal((6, 6)))[0]
    W = Q @ np.diag([1e-9, 1e-9, 0.05, 0.5, 1.0, 2.6]) @ Q.T
    load = random.standard_normal((3, 2))
    return am.FrictionProblem.from_delassus((W + W.T) / 2, load, [0.5] * 3)


@pytest.mark.parametrize("seed", [0, 2, 3, 4])
def test_two_soft_directions(seed, benchmark):
    problem = two_soft_directions(seed)
    found = am.all_solutions(problem, time_limit=10)
    truth = benchmark.exact_oracle.all_exact(problem.W, problem.q, problem.mu)
    assert found.complete
    assert {s.pattern for s in found.solutions} == {x.pattern for x in truth.solutions}
    assert am.uniqueness(problem, time_limit=10).verdict is Verdict.UNIQUE_THIS_LOAD


def test_a_friction_that_is_proved_is_reported():
    """At the friction asked for the bound is proved to hold, not only below it."""
    problem = hild_triangle(10, mu=0.45).assemble().condensed()
    found = am.uniqueness(problem, time_limit=30)
    assert found.verdict is Verdict.UNIQUE_EVERY_LOAD
    assert found.lower > found.friction
    assert found.resolution == 0.0


@pytest.mark.parametrize("d", [2, 3])
def test_two_reactions_near_one_solution_are_no_two_solutions(d):
    """However near; a contact with little force may seem to be open in one of them."""
    W = np.eye(2 * d) + 0.1
    r = np.zeros((2, d))
    r[:, 0] = 1.0, 1e-9
    problem = am.FrictionProblem.from_delassus(W, -(W @ r.ravel()).reshape(2, d), [2.0, 2.0])
    for other in (r * [[1.0], [0.0]], r * (1 + 1e-10), r + 1e-10):
        assert problem.error(other) < 1e-8
        assert not exist(problem, [r, other])
        assert different(problem, [r, other, r]) == [True, False, False]


def test_solutions_are_known_no_better_than_rounding_leaves_them(benchmark):
    """Of a nearly singular W: the exact solution is within the distance that is told."""
    name, (W, q, mu) = benchmark.draw(1403, 2, 3)
    assert name == "nearly singular"
    (exact,) = benchmark.exact_oracle_discs.all_exact(W, q, mu).solutions
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, q, mu))
    (one,) = found.solutions
    off = np.abs(one.r.ravel() - exact.r).max() / np.abs(exact.r).max()
    assert found.complete and off <= found.resolution < 1e-10


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("gap", [1e-3, -1e-10])
def test_a_second_solution_has_to_exist(d, gap):
    # at gap = 0 stick and slip meet in r = (1, -2); with gap < 0 there is none, however near
    W = np.eye(d)
    W[0, 1] = W[1, 0] = 0.8
    q = np.zeros((1, d))
    q[0, :2] = 0.6, 1.2 + gap
    r = np.zeros((1, d))
    r[0, :2] = np.linalg.solve(W[:2, :2], -q[0, :2])
    problem = am.FrictionProblem.from_delassus(W, q, [2.0])
    assert problem.error(r) < 1e-9
    assert exist(problem, [0 * r, r]) == (gap > 0)
    expected = (Verdict.NOT_UNIQUE,) if gap > 0 else (*UNIQUE, Verdict.UNDECIDED)
    assert am.uniqueness(problem, time_limit=5).verdict in expected


def test_contacts_given_twice_move_alike():
    W = np.tile(np.eye(2), (2, 2))
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.1]] * 2, [0.5, 0.5])
    found = am.uniqueness(problem, time_limit=5)
    assert found.verdict is Verdict.NOT_UNIQUE
    assert "the motion is the same" in found.reason


# ------------------------------------------------------------------- in files and text
def test_lists_and_verdicts_state_their_resolution():
    result = CliRunner().invoke(main, ["enumerate", "example:hild", "--json", "-"])
    data = json.loads(result.stdout)
    assert 0 < data["resolution"] < 1e-8
    assert all(s["sole"] and s["distance"] <= data["resolution"] for s in data["solutions"])
    text = CliRunner().invoke(main, ["enumerate", "example:hild"]).stdout
    assert "any other differs by less than" in text.replace("\n", " ")
    for mu, resolution in ((1.0, 0.0), (2.0, 0.0)):
        answer = ["uniqueness", "example:hild", "--mu", str(mu), "--json", "-"]
        data = json.loads(CliRunner().invoke(main, answer).stdout)
        assert data["resolution"] == resolution
    several = am.uniqueness(one_contact_2d(2.0))
    assert 0 < several.resolution < 1e-10
    assert "known to" in several.reason


def test_a_diagram_says_what_is_proved():
    """A closed loop between the chosen values is missed, and the reason does not hide it."""
    random = np.random.default_rng(1153)
    A = random.standard_normal((4, 4))
    q0, q1 = random.standard_normal((2, 2, 2))
    W = A @ A.T / 4 + 0.05 * np.eye(4)
    base, target = (am.FrictionProblem.from_delassus(W, q, [3.0] * 2) for q in (q0, q1))
    few = am.diagram(target, "load", (0, 1), base=base, at=(0.0, 0.5, 1.0))
    assert few.complete
    assert few.whole is None
    assert "nothing is proved between these values" in few.reason
    assert few.reason in str(few)
    assert few.record()["at"] == [0.0, 0.5, 1.0]
    many = am.diagram(target, "load", (0, 1), base=base, at=np.linspace(0, 1, 21))
    assert [branch.closed for branch in many] == [False, True]


# ------------------------------------------------------------------- many problems
def test_random_problems_in_the_plane(benchmark):
    tallies = benchmark.run(28, 5, 2, benchmark.Kept(5))
    assert [text for t in tallies.values() for text in t.faults] == []
    assert sum(t.complete for t in tallies.values()) > 19


def test_random_problems_in_space(benchmark, monkeypatch):
    monkeypatch.setattr(benchmark, "LIMIT", 1.0)
    tallies = benchmark.run(7, 5, 3, benchmark.Kept(5))
    assert [text for t in tallies.values() for text in t.faults] == []
    assert sum(t.complete for t in tallies.values()) > 2


def test_the_comparison_sees_what_is_wrong(benchmark):
    """A list that lacks a solution, and a verdict that is false."""
    problem = one_contact_2d(2.0)
    case = np.asarray(problem.W), problem.q, problem.mu
    truth = benchmark.exact_oracle.all_exact(*case)
    assert {x.pattern for x in truth.solutions} == {"f", "s", "-"}
    found, verdict = am.all_solutions(problem), am.uniqueness(problem)
    assert benchmark.faults(case, truth, found, verdict) == []
    short = am.Solutions(found.solutions[:2], True, "", 0, 0.0, None, 1e-12)
    assert benchmark.faults(case, truth, short, verdict) == ["missed -"]
    unique = am.uniqueness(one_contact_2d(1.3))
    assert any("false" in x for x in benchmark.faults(case, truth, found, unique))


def hostile(random, nc, d):
    """Matrices that nobody should ask about."""
    m = nc * d
    A = random.standard_normal((m, m))
    S, Q = A @ A.T / m, np.linalg.qr(A)[0]
    soft = random.uniform(0.1, 2, m)
    soft[:2] = 10.0 ** random.uniform(-17, -6, 2)
    far = np.repeat(10.0 ** random.uniform(-45, 45, nc), d)
    blind = S.copy()
    blind[:d, :d] = 0
    return [Q @ np.diag(soft) @ Q.T, np.outer(A[0], A[0]), np.zeros((m, m)), S - np.eye(m) / 2,
            -S, A, A - A.T, S * far * far[:, None], 1e99 * S, 1e-99 * S, np.ones((m, m)),
            blind]  # fmt: skip


QUESTIONS = [
    lambda p: am.all_solutions(p, time_limit=0.2), lambda p: am.uniqueness(p, time_limit=0.2),
    lambda p: am.critical_friction(p, time_limit=0.2),
    lambda p: am.multistart(p, starts=20, time_limit=0.2),
    lambda p: am.diagram(p, "load", (0, 1), time_limit=0.2),
]  # fmt: skip


@pytest.mark.parametrize("d", [2, 3])
def test_hostile_matrices_are_answered_in_words(d):
    random = np.random.default_rng(d)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for W in hostile(random, 2, d):
            q = random.standard_normal((2, d)) * 10.0 ** random.choice([0, 60, -60])
            mu = random.choice([0.0, 0.3, 5.0, 1e12, 1e-12], 2)
            for ask in QUESTIONS:
                with contextlib.suppress(AmontonsError):
                    ask(am.FrictionProblem.from_delassus(W, q, mu))
