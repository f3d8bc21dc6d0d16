"""Bilateral rows: u = 0 with free reactions, alone and beside contacts of other laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import amontons as am
from amontons.core.errors import UnsupportedLaw
from amontons.linear.blocks import spatial
from amontons.mechanics.ready import gallery
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.judge import measures
from amontons.problem.judge.sharp import sharp_error
from amontons.problem.law import joined
from amontons.problem.law.single import solve_one
from amontons.problem.law.states import OPEN, SLIP, STICK
from amontons.problem.settling import settle
from amontons.solvers import METHODS
from amontons.solvers.driver import drive

entry = st.floats(-3, 3).map(lambda x: round(x, 9))
FEW = np.array([1, 4, 6])  # contacts that are tied, of 8


@settings(max_examples=200, deadline=None)
@given(arrays(float, (3, 3), elements=entry), arrays(float, 3, elements=entry))
def test_a_tie_solved_exactly_does_not_move(root, b):
    A = root @ root.T + 0.1 * np.eye(3)
    r, u, state = solve_one(A, b, am.Tied())
    np.testing.assert_allclose(r, -np.linalg.solve(A, b), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(u, 0, atol=1e-9 * (1 + np.linalg.norm(b)))
    assert state == STICK
    r, u, _ = solve_one(A, b, am.Compliant(am.Tied(), 0.5, 0.25))
    np.testing.assert_allclose(u, -np.array([0.5, 0.25, 0.25]) * r, atol=1e-8)


def test_directions_that_do_not_react_are_left_alone():
    r, _, _ = solve_one(np.diag([2.0, 0.0, 1.0]), [1.0, 0.0, -3.0], am.Tied())
    np.testing.assert_array_equal(r, [-0.5, 0.0, 3.0])


STATES = [
    ([1, 0], [0, 0], True), ([-1, 5], [0, 0], True), ([0, 0], [0, 0], True),
    ([1, 0], [0.1, 0], False), ([1, 0], [-0.1, 0], False), ([0, 0], [0.1, 0], False),
    ([-5, 1], [0, 0.1], False), ([0, 0], [0, -0.1], False),
]  # fmt: skip


@pytest.mark.parametrize(("r", "u", "obeys"), STATES)
@pytest.mark.parametrize("rho", [0.1, 1.0, 10.0])
def test_the_judge_knows_both_sides_of_every_equation(r, u, obeys, rho):
    """Also beside a contact that obeys its own law, and where it can not react."""
    law, rho = joined([am.Tied(), am.Coulomb([0.5])]), np.array([rho, rho])
    r, u = np.array([r, [1.0, -0.5]]), np.array([u, [0.0, 2.0]])
    assert (measures.scaled_residual(r, u, law, rho) <= 1e-12) == obeys
    x = r - rho[:, None] * u
    assert np.allclose(law.augmented_reaction(x), r, atol=1e-12) == obeys
    problem = FrictionProblem.from_delassus(
        np.diag(np.repeat(1 / rho, 2)), u - r / rho[:, None], law
    )
    assert (problem.error(r) <= 1e-12) == obeys
    assert (problem.weakest(r).error <= 1e-12) == obeys
    assert (sharp_error(*problem.kernel_data, spatial(r))[0] <= 1e-12) == obeys
    told = settle(law, rho, r, u)
    assert told.status[0] == STICK and not told.sliding[0] and not told.changed
    held = FrictionProblem.from_delassus(np.diag([0.0, 0, 1, 1]), u - [[0, 0], [1, -0.5]], law)
    rest = np.where([[False], [True]], r, 0.0)
    assert (held.error(rest) <= 1e-12) == (not u[0].any())


def laws(size, d):
    others = am.CappedCoulomb([0.4] * 5, 0.5 * size)
    whole = joined([am.Tied(3), others])
    order = np.argsort(np.concatenate([FEW, np.setdiff1d(np.arange(8), FEW)]))
    return whole.at(order)


def some(d, seed=3):
    plain = gallery.random_delassus(seed, 8, d, mu=0.3)
    size = np.abs(am.solve(plain).r).max()
    return FrictionProblem.from_delassus(plain.W, plain.q, laws(size, d))


def as_global(problem):
    values, vectors = np.linalg.eigh(problem.W)
    H = (vectors * np.sqrt(np.maximum(values, 0))).T
    return FrictionProblem.from_global(
        np.eye(len(H)), H, np.zeros(len(H)), problem.q, problem.law
    )


@pytest.mark.parametrize("d", [2, 3])
def test_it_is_the_problem_without_tied_rows(d):
    """Eliminated by hand, W_cc - W_ct W_tt^-1 W_tc, the other contacts have the same r."""
    problem = some(d)
    rows = np.arange(8 * d).reshape(8, d)
    t, c = rows[FEW].ravel(), np.delete(rows, FEW, axis=0).ravel()
    W, q = problem.W, problem.q.ravel()
    back = np.linalg.solve(W[np.ix_(t, t)], np.column_stack([W[np.ix_(t, c)], q[t]]))
    law = problem.law.at(np.setdiff1d(np.arange(8), FEW))
    less = FrictionProblem.from_delassus(
        W[np.ix_(c, c)] - W[np.ix_(c, t)] @ back[:, :-1],
        (q[c] - W[np.ix_(c, t)] @ back[:, -1]).reshape(-1, d), law,
    )  # fmt: skip
    expected = am.solve(less, tolerance=1e-12).r
    found = am.solve(problem, tolerance=1e-12)
    size = np.abs(found.r).max()
    np.testing.assert_allclose(np.delete(found.r, FEW, axis=0), expected, atol=1e-8 * size)
    tied = -(back[:, :-1] @ expected.ravel() + back[:, -1]).reshape(-1, d)
    np.testing.assert_allclose(found.r[FEW], tied, atol=1e-8 * size)
    assert (found.r[FEW, 0] < 0).any()  # some are pulled
    assert (found.status[FEW] == STICK).all() and not found.sliding[FEW].any()
    assert np.isinf(found.margin[FEW]).all()
    assert found.max_cone_violation <= 1e-9 * size


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", [2, 3])
def test_all_solvers(method, d):
    problem, kind = some(d), METHODS[method]
    asked = as_global(problem) if kind.form is Form.GLOBAL else problem
    if getattr(kind, "needs_cone", False):
        with pytest.raises(UnsupportedLaw, match="needs Coulomb's cone"):
            drive(asked, kind())
        return
    found = drive(asked, kind(), time_limit=20, max_iterations=20_000)
    if found.converged:
        assert problem.error(found.r) <= 1e-8
        np.testing.assert_allclose(found.u[FEW], 0, atol=1e-7 * np.linalg.norm(problem.q))
    if method in ("auto", "gauss-seidel", "semismooth-newton", "uzawa"):
        assert found.converged, str(found)


@pytest.mark.parametrize("seed", range(8))
def test_auto_solves_ties_beside_other_contacts(seed):
    found = am.solve(some(2 + seed % 2, seed))
    assert {int(s) for s in found.status} <= {OPEN, SLIP, STICK}
    np.testing.assert_allclose(found.u[FEW], 0, atol=1e-7)


def test_rows_that_say_the_same_twice_have_one_motion():
    """A singular W: u is unique, and the reactions share what they are to balance."""
    W = np.kron(np.ones((2, 2)), np.eye(3))
    found = am.solve(FrictionProblem.from_delassus(W, [[1.0, 2, 3]] * 2, am.Tied(2)))
    np.testing.assert_allclose(found.r.sum(axis=0), [-1, -2, -3], atol=1e-8)
    wrong = FrictionProblem.from_delassus(W, [[1.0, 2, 3], [1.5, 2, 3]], am.Tied(2))
    assert not am.drive(wrong, time_limit=5).converged  # they contradict each other


def test_questions_and_bad_values_are_refused():
    problem = some(2)
    for ask in (am.all_solutions, am.critical_friction, am.follow):
        with pytest.raises(UnsupportedLaw, match="friction of several laws"):
            ask(problem)
    ties = FrictionProblem.from_delassus(np.eye(4), np.ones((2, 2)), am.Tied(2))
    with pytest.raises(UnsupportedLaw, match="bilateral contact"):
        am.follow(ties)
    for verdict in (am.uniqueness(ties), am.existence(ties)):
        assert verdict.verdict.name == "UNDECIDED"
        assert "bilateral contact" in verdict.reason
    for make in (lambda: am.Tied(-1), lambda: am.Tied(1.5), lambda: am.Tied([1, 2]),
                 lambda: am.Cohesive(am.Tied(2), 1.0)):  # fmt: skip
        with pytest.raises(am.InvalidInput):
            make()
