"""Friction that follows pressure or slip speed: by hand, judged, no and many states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import amontons as am
from amontons.core.errors import UnsupportedForm, UnsupportedLaw
from amontons.mechanics.ready import gallery
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.law import joined
from amontons.solvers import METHODS
from amontons.solvers.driver import drive

FALLS = am.FrictionCurve([0.6, 0.2], speed=[0.0, 2.0])


def one(curve, q=(-1.0, 3.0), **more):
    law = am.VaryingFriction(curve, **more)
    return FrictionProblem.from_delassus(np.eye(len(q)), [q], law)


def mu_of(found):
    return -found.r[0, 1] / found.r[0, 0]


@pytest.mark.parametrize("area", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("pressed", [0.3, 1.0, 9.0])
def test_over_the_pressure(area, pressed):
    curve = am.FrictionCurve([0.1, 0.5, 0.2], pressure=[0.2, 1.0, 3.0])
    found = am.solve(one(curve, (-pressed, 30.0), area=area), tolerance=1e-11)
    expected = np.interp(pressed / area, [0.2, 1.0, 3.0], [0.1, 0.5, 0.2])
    assert mu_of(found) == pytest.approx(expected, rel=1e-9)
    assert found.problem.law.mu == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("duration", [1.0, 2.0])
def test_over_the_speed(duration):
    """u_T = 3 - mu and mu = 0.6 - 0.2 u_T / T: two lines meet."""
    found = am.solve(one(FALLS, duration=duration), tolerance=1e-11)
    mu = min(0.6, max(0.2, (0.6 - 0.6 / duration) / (1 - 0.2 / duration)))
    assert mu_of(found) == pytest.approx(mu, rel=1e-8)
    assert found.u[0, 1] == pytest.approx(3 - mu, rel=1e-8)


def test_over_both_is_bilinear():
    table = np.array([[0.5, 0.3], [0.4, 0.1]])
    curve = am.FrictionCurve(table, pressure=[1.0, 2.0], speed=[0.0, 4.0])
    p, s = np.array([1.0, 2.0, 1.5, 0.0, 9.0]), np.array([0.0, 4.0, 2.0, 4.0, 1.0])
    np.testing.assert_allclose(curve(p, s), [0.5, 0.1, 0.325, 0.3, 0.325])
    by_function = am.FrictionCurve(lambda p, s: curve(p, s))
    for each in (curve, by_function):
        found = am.solve(one(each, (-1.5, 2.0)), tolerance=1e-11)
        u = found.u[0, 1]
        assert mu_of(found) == pytest.approx(0.45 - 0.25 * u / 4, rel=1e-8)


def test_a_constant_curve_is_coulombs_law():
    plain = gallery.random_delassus(4, 8, 3, mu=0.3)
    law = am.VaryingFriction(am.FrictionCurve([0.3, 0.3], speed=[0.0, 1.0]), np.ones(8))
    found = am.solve(FrictionProblem.from_delassus(plain.W, plain.q, law), tolerance=1e-11)
    expected = am.solve(plain, tolerance=1e-11)
    np.testing.assert_allclose(found.r, expected.r, atol=1e-8)
    np.testing.assert_array_equal(found.status, expected.status)


def test_the_judge_takes_the_coefficient_of_the_state():
    problem = one(am.FrictionCurve([0.5, 0.1], pressure=[0.0, 2.0]))
    assert problem.error([[1.0, -0.3]] * np.ones((1, 1))) <= 1e-12
    for wrong in (0.5, 0.29, 0.31, 0.1):
        assert problem.error(np.array([[1.0, -wrong]])) > 1e-3
        assert problem.weakest(np.array([[1.0, -wrong]])).error > 1e-3


def some(seed, d, by):
    plain = gallery.random_delassus(seed, 8, d, mu=0.3)
    first = am.solve(plain)
    size = (np.abs(first.r) if by == "pressure" else np.abs(first.u)).max()
    curve = am.FrictionCurve([0.4, 0.25], **{by: [0.0, size]})
    law = am.VaryingFriction(curve, np.ones(8))
    return FrictionProblem.from_delassus(plain.W, plain.q, law)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2, 3]), st.sampled_from(["pressure", "speed"]))
def test_what_is_called_converged_solves_coulombs_problem_with_its_own_mu(seed, d, by):
    problem = some(seed, d, by)
    found = am.drive(problem, time_limit=20)
    assert found.converged, str(found)
    p, s = np.maximum(found.r[:, 0], 0), np.linalg.norm(found.u[:, 1:], axis=1)
    mu = problem.law.curve(p, s)
    again = FrictionProblem.from_delassus(problem.W, problem.q, mu)
    assert again.error(found.r) <= 2e-8
    assert am.drive(problem, start=found).convergence.iterations == 0


@pytest.mark.parametrize("method", METHODS)
def test_all_solvers(method):
    problem, kind = some(3, 3, "speed"), METHODS[method]
    expected = am.solve(problem, tolerance=1e-11).r
    if kind.form is Form.GLOBAL:
        values, vectors = np.linalg.eigh(problem.W)
        H = (vectors * np.sqrt(np.maximum(values, 0))).T
        problem = FrictionProblem.from_global(
            np.eye(24), H, np.zeros(24), problem.q, problem.law
        )
    found = drive(problem, kind(), time_limit=30, max_iterations=50_000)
    if method in ("auto", "gauss-seidel", "semismooth-newton", "smoothing-newton"):
        assert found.converged, str(found)
    if found.converged:
        np.testing.assert_allclose(found.r, expected, atol=1e-5 * np.abs(expected).max())


def test_no_state_is_called_one():
    """Slow slip has little friction and gets fast, fast slip has much and gets slow."""
    curve = am.FrictionCurve(lambda p, s: np.where(s < 0.5, 0.1, 0.9))
    found = am.drive(one(curve, (-1.0, 1.0)))
    assert found.convergence.outcome.name == "STAGNATED"
    assert "friction coefficients still change" in found.convergence.detail
    with pytest.raises(am.NotConverged, match="several states, or none"):
        am.solve(one(curve, (-1.0, 1.0)))


def test_of_several_states_the_start_tells_which():
    """mu falls with the speed from 0.9 to 0.2: slow at 0.1 and fast at 0.8 are both states."""
    curve = am.FrictionCurve([0.9, 0.2], speed=[0.3, 0.6])
    slow = am.solve(one(curve, (-1.0, 1.0)))
    assert slow.u[0, 1] == pytest.approx(0.1)
    fast = am.solve(one(curve, (-1.0, 1.0)), start=am.Iterate(np.array([[1.0, -0.2]])))
    assert fast.u[0, 1] == pytest.approx(0.8)


def test_beside_other_laws_and_within_them():
    """Each contact as alone: cohesion adds no pressure, compliance slips by u + C r."""
    capped = am.Cohesive(am.CappedCoulomb([0.0], [0.4]), [0.2])
    laws = [am.VaryingFriction(FALLS), am.Coulomb([0.3]), am.Tied(),
            am.VaryingFriction(FALLS, law=am.Compliant(am.Coulomb([0.0]), 0.5, 0.25)),
            am.VaryingFriction(am.FrictionCurve([0.5, 0.1], pressure=[0.0, 2.0]), law=capped),
            ]  # fmt: skip
    q = np.array([[-1.0, 2.0, 0.5]] * 5)
    whole = am.solve(FrictionProblem.from_delassus(np.eye(15), q, joined(laws)))
    for law, row, own in zip(laws, q, whole.r, strict=True):
        alone = am.solve(FrictionProblem.from_delassus(np.eye(3), row[None], law))
        np.testing.assert_allclose(own, alone.r[0], atol=1e-7)
    u, r = whole.u[3], whole.r[3]
    slip = np.linalg.norm(u[1:] + 0.25 * r[1:])
    assert np.linalg.norm(r[1:]) == pytest.approx((0.6 - 0.2 * slip) * r[0], rel=1e-6)


def test_limits_and_callbacks_hold_for_all_rounds_together():
    problem = some(3, 3, "speed")
    few = am.drive(problem, am.GaussSeidel(), max_iterations=3)
    assert few.convergence.iterations == 3
    assert few.convergence.outcome.name == "MAX_ITERATIONS"
    stopped = am.drive(problem, am.GaussSeidel(), callback=lambda step, iterate: True)
    assert stopped.convergence.outcome.name == "STOPPED"
    history = am.solve(problem).convergence.history
    assert (np.diff([step.iteration for step in history]) >= 0).all()


def test_questions_and_bad_curves_are_refused():
    problem = some(1, 2, "speed")
    for ask in (am.all_solutions, am.critical_friction, am.follow):
        with pytest.raises(UnsupportedLaw, match="follows pressure or slip speed"):
            ask(problem)
    assert "follows pressure" in am.uniqueness(problem).reason
    with pytest.raises((UnsupportedLaw, UnsupportedForm), match="published errors"):
        am.drive(problem, criterion=am.Criterion.NATURAL)
    curve = FALLS
    for make in (
        lambda: am.FrictionCurve([0.1, 0.2]), lambda: am.FrictionCurve([0.1], speed=[1.0, 2.0]),
        lambda: am.FrictionCurve([0.1, 0.2], speed=[2.0, 1.0]),
        lambda: am.FrictionCurve([0.1, -0.2], speed=[1.0, 2.0]),
        lambda: am.FrictionCurve([0.1, np.nan], pressure=[1.0, 2.0]),
        lambda: am.FrictionCurve(lambda p, s: p, speed=[1.0]), lambda: am.VaryingFriction(0.3),
        lambda: am.VaryingFriction(curve, 0.0),
        lambda: am.VaryingFriction(curve, law=am.Tied()),
        lambda: am.VaryingFriction(curve, law=am.Tresca([1.0])),
        lambda: am.Cohesive(am.VaryingFriction(curve), 1.0),
        lambda: am.Compliant(am.VaryingFriction(curve), 1.0),
        lambda: am.solve(one(am.FrictionCurve(lambda p, s: s - 9))),
        lambda: am.solve(one(am.FrictionCurve(lambda p, s: np.ones(7)))),
    ):  # fmt: skip
        with pytest.raises(am.InvalidInput):
            make()
