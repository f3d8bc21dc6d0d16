"""Unkind problems: a short run of benchmarks/abuse.py, and what longer runs have found."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.problem.friction import FrictionProblem

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
PROBLEMS, SEED = 100, 20
MISSED = 3  # solvable problems that Auto may leave, of those that are solvable
HOURS = 3600.0  # no time limit: iterations end what does not converge


@pytest.fixture(scope="module")
def abuse():
    """The benchmark's module, which finds its neighbour in its own folder."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        yield importlib.import_module("abuse")
    finally:
        sys.path.remove(str(BENCHMARKS))


def test_unkind_problems(abuse):
    runs = abuse.abuse_all(
        PROBLEMS, SEED, limit=HOURS, iterations=3000, iterations_of_others=100
    )
    wrong = [f"{run.number} {run.family} {run.solver}: {text}" for run in runs
             for text in run.findings if not text.startswith("not solved")]  # fmt: skip
    assert wrong == []
    auto = [run for run in runs if run.solver == "auto"]
    assert {run.family for run in auto} == set(abuse.FAMILIES)
    missed = [run for run in auto if run.solvable and run.outcome != "converged"]
    assert len(missed) <= MISSED, missed


def test_contacts_in_units_of_their_own(abuse):
    runs = abuse.abuse_rescaled(len(abuse.RESCALED), SEED, limit=HOURS, iterations=2000)
    assert [text for run in runs for text in run.findings] == []


def test_the_check_sees_a_wrong_answer(abuse):
    """The same checks on an answer that is none."""
    case = abuse.FAMILIES["regular"](np.random.default_rng(1))
    found = am.solve(case.problem)
    assert abuse.faults(case, found) == []
    r = np.array(found.r)
    r[:, 1:] *= -1.01
    wrong = am.FrictionSolution(
        case.problem, r, case.problem.velocity(r)[0], None, found.convergence
    )
    assert any("reported" in text for text in abuse.faults(case, wrong))
    assert any("called converged at" in text for text in abuse.faults(case, wrong))
    weak = FrictionProblem.from_delassus(np.eye(4), [[-1, 0], [1e9, 0]], [0.3, 0.3])
    found = am.solve(weak, contact_tolerance=np.inf)
    texts = abuse.faults(abuse.Case(weak, None, True), found)
    assert [text for text in texts if "of its own scale" in text]


def closing_walls(d):
    """A body between two walls that close: reactions push each other up for ever."""
    H = np.hstack([np.eye(d), np.diag([-1.0] + [1.0] * (d - 1))])
    q = np.zeros((2, d))
    q[:, 0] = -0.7
    return FrictionProblem.from_delassus(H.T @ H, q, np.full(2, 0.5))


@pytest.mark.parametrize("d", [2, 3])
def test_reactions_that_swallow_q_are_no_solution(d):
    """Of u = W r + q all is rounded away, and the law seems to hold, or half of it."""
    problem = closing_walls(d)
    r = np.zeros((2, d))
    r[:, 0] = 1e17
    assert problem.error(r) <= 0.5  # 0 where q is added before the products have cancelled
    assert problem.rounding(r) > 1
    start = am.solvers.Iterate(r)
    found = am.solve(problem, am.GaussSeidel(), start=start, max_iterations=3, check=False)
    assert not found.converged
    assert found.convergence.error >= 1  # the exact error of these reactions


def test_rounding_is_small_for_honest_reactions():
    problem = FrictionProblem.from_delassus(2 * np.eye(3), [[-1.0, 0, 0]], [0.5])
    r = np.array([[0.5, 0.0, 0.0]])
    assert problem.rounding(r) == pytest.approx(np.finfo(float).eps)
    whole = FrictionProblem.from_global(
        np.eye(3), np.sqrt(2) * np.eye(3), np.zeros(3), [[-1.0, 0, 0]], [0.5]
    )
    assert whole.rounding(r) == pytest.approx(np.finfo(float).eps)


def test_a_planar_contact_that_can_not_react(abuse):
    """W_ii = 0 in 2D: r must be zero, as in 3D, and a penetration stays one."""
    for d in (2, 3):
        q = np.zeros((1, d))
        q[0, 0] = 1.0
        problem = FrictionProblem.from_delassus(np.zeros((d, d)), q, [0.5])
        assert problem.error(np.zeros((1, d))) == 0
        assert problem.error(np.eye(1, d)) == np.inf
        q[0, 0] = -1.0
        assert problem.with_load(q).error(np.zeros((1, d))) == 1


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_the_error_of_a_planar_contact_with_a_held_tangent_has_no_unit(unit):
    W, r = np.diag([1.0, 0.0]), np.array([[0.9, 0.0]])
    problem = FrictionProblem.from_delassus(unit * W, [[-1.0, 0.0]], [0.5])
    assert problem.error(r / unit) == pytest.approx(0.1)


@pytest.mark.parametrize("size", [1e-200, 1e-101, 1e101, 1e200])
def test_numbers_that_can_not_be_squared_are_refused(size):
    """|q| would be zero or infinite, and with it every error."""
    q, W = np.array([[-size, 0.0, 0.0]]), np.eye(3)
    with pytest.raises(InvalidInput, match=r"^q: its largest entry .* use units"):
        FrictionProblem.from_delassus(W, q, [0.5])
    with pytest.raises(InvalidInput, match=r"^W: its largest entry"):
        FrictionProblem.from_delassus(size * W, [[-1.0, 0, 0]], [0.5])
    with pytest.raises(InvalidInput, match=r"^M: its largest entry"):
        FrictionProblem.from_global(size * W, W, np.zeros(3), [[-1.0, 0, 0]], [0.5])
