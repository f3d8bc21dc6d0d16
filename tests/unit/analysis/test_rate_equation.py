"""Evolutions of a user's own, and the continuation problem between two of their steps."""

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import brentq

import amontons as am

FOLD = (2 / np.sqrt(27) - 0.3) / 0.2  # of x^3 - x = 0.3 + 0.2 gamma, at x = -1 / sqrt 3


def snap(t):
    return np.array([brentq(lambda x: x**3 - x - t, -1, -0.6)])


def snap_through(**given):
    return am.RateEquation(lambda x, rate: x**3 - x, lambda t, x: np.array([t]), **given)


GIVEN = {
    "G_slopes": lambda x, rate: (np.diag(3 * x**2 - 1), np.zeros((1, 1))),
    "F_slope": lambda t, x: np.zeros((1, 1)),
}


@pytest.mark.parametrize("given", [{}, GIVEN], ids=["differences", "slopes"])
def test_snap_through_has_its_folds_and_all_next_states(given):
    path = am.StepPath(snap_through(**given), (snap(0.1), snap(0.3)), (0.1, 0.3, 0.5))
    branch = path.branch()
    upper, lower = (event.parameter for event in branch.folds)
    assert upper == pytest.approx(0.4245008973, abs=1e-9)
    assert upper == pytest.approx(FOLD, abs=1e-12)
    assert lower == pytest.approx(-3.4245008973, abs=1e-9)
    (after,) = branch.at(1.0)
    assert after**3 - after == pytest.approx(0.5, abs=1e-12)
    assert len(branch.at(0.0)) == 3
    known = am.follow(path, interval=(-5, 1))  # the path knows where it starts
    assert [e.parameter for e in known.folds] == pytest.approx([upper, lower], abs=1e-10)


def test_all_next_states_that_a_path_reaches():
    """t = .3 + .05 gamma: three at gamma = 1, before, between and behind the folds."""
    path = am.StepPath(snap_through(**GIVEN), (snap(0.25), snap(0.3)), (0.25, 0.3, 0.35))
    found = sorted(float(x[0]) for x in path.branch(back=20).at(1.0))
    np.testing.assert_allclose(found, sorted(np.roots([1, 0, -1, -0.35]).real), atol=1e-11)
    assert len(path.branch(back=20, ahead=0).at(1.0)) == 1  # the first arrival only


SCHEMES = {"euler": am.ThetaMethod(), "theta": am.ThetaMethod(0.7),
           "trapezoidal": am.ThetaMethod(0.5), "midpoint": am.MidpointRule()}  # fmt: skip


def linear_step(scheme, A, load, x, t, h):
    """One step of x' + A x = load(t), by hand."""
    theta, eye = scheme.theta, np.eye(len(x))
    if isinstance(scheme, am.MidpointRule):
        forces = load(t + h / 2)
    else:
        forces = theta * load(t + h) + (1 - theta) * load(t)
    return np.linalg.solve(eye / h + theta * A, (eye / h - (1 - theta) * A) @ x + forces)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
@pytest.mark.parametrize("sparsely", [False, True])
def test_schemes_make_the_steps_that_they_should(scheme, sparsely):
    A = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])

    def load(t):
        return np.array([np.sin(t), 0.2, t])

    wrap = sparse.csc_array if sparsely else np.asarray
    equation = am.RateEquation(
        lambda x, rate: rate, lambda t, x: load(t) - A @ x,
        lambda x, rate: (wrap(np.zeros((3, 3))), wrap(np.eye(3))), lambda t, x: wrap(-A),
    )  # fmt: skip
    times = (0.0, 0.1, 0.3, 0.4)
    states = [np.array([1.0, 0, -1])]
    for t, later in zip(times, times[1:], strict=False):
        states.append(linear_step(scheme, A, load, states[-1], t, later - t))
    path = am.StepPath(equation, (states[0], states[1]), times[:3], scheme)
    assert np.abs(path.residual(path.start, 0.0)).max() < 1e-14
    (found,) = path.branch().at(1.0)
    np.testing.assert_allclose(found, states[2], atol=1e-12)
    (last,) = path.next(found, 0.4).branch(back=0, ahead=0).at(1.0)
    np.testing.assert_allclose(last, states[3], atol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_derivatives_of_the_path(scheme):
    rng = np.random.default_rng(1)
    equation = am.RateEquation(
        lambda x, rate: np.array([rate[0] + x[0] * x[1], np.tanh(rate[1]) + x[1] ** 2]),
        lambda t, x: np.array([np.cos(t) * x[1], t**2 + x[0] ** 3]),
    )
    states = rng.normal(size=2), rng.normal(size=2)
    path = am.StepPath(equation, states, (0, 0.2, 0.5), scheme)
    y, p, h = rng.normal(size=2), 0.37, 1e-6
    J, Jp = path.jacobian(y, p)
    for k, step in enumerate(h * np.eye(2)):
        slope = (path.residual(y + step, p) - path.residual(y - step, p)) / (2 * h)
        np.testing.assert_allclose(J[:, k], slope, atol=1e-7)
    slope = (path.residual(y, p + h) - path.residual(y, p - h)) / (2 * h)
    np.testing.assert_allclose(Jp, slope, atol=1e-7)


def test_a_slider_of_ones_own_sticks_and_slips():
    """x' of a spring-pulled slider with friction, as G with two pieces: a kink at 1 / 2."""
    def excess(rate):
        return np.maximum(rate - 1.0, 0.0)

    equation = am.RateEquation(
        lambda x, rate: x + excess(rate), lambda t, x: np.array([t]),
        lambda x, rate: (np.eye(1), np.diag((rate > 1.0) * 1.0)),
        lambda t, x: np.zeros((1, 1)),
        G_piece=lambda x, rate: bool(rate[0] > 1.0),
    )
    path = am.StepPath(equation, (np.array([0.0]), np.array([0.5])), (0.0, 1.0, 2.0))
    with pytest.raises(am.InvalidInput, match="expected a solution at 0"):
        path.branch()
    path = am.StepPath(equation, (np.array([0.0]), np.array([1.0])), (0.0, 1.0, 3.0))
    branch = path.branch(back=0.5)
    kinks = [e for e in branch.events if e.kind is am.EventKind.STATUS]
    assert all(e.before != e.after for e in kinks)
    for y, p in zip(branch.states, branch.parameter, strict=True):
        assert np.abs(path.residual(y, p)).max() < 1e-11


@pytest.mark.parametrize(("change", "message"), [
    ({"times": (0.1, 0.1, 0.5)}, "times: expected t_k-1 < t_k < t_k"),
    ({"times": (0.1, 0.5)}, "times: expected"),
    ({"states": (np.zeros(1), np.zeros(2))}, "states: expected two vectors"),
    ({"states": np.zeros(1)}, "states: expected the last two"),
    ({"scheme": "midpoint"}, "scheme: expected a ThetaMethod"),
    ({"equation": None}, "equation: expected a RateEquation"),
])  # fmt: skip
def test_bad_steps_are_named(change, message):
    good = {"equation": snap_through(), "states": (snap(0.1), snap(0.3)),
            "times": (0.1, 0.3, 0.5)}  # fmt: skip
    with pytest.raises(am.InvalidInput, match=message):
        am.StepPath(**{**good, **change})


def test_bad_options_are_named():
    path = am.StepPath(snap_through(), (snap(0.1), snap(0.3)), (0.1, 0.3, 0.5))
    for options in ({"back": -1}, {"ahead": np.inf}, {"options": 3}, {"steps": 3}):
        with pytest.raises(am.InvalidInput, match=next(iter(options))):
            path.branch(**options)
    with pytest.raises(am.InvalidInput, match="theta"):
        am.ThetaMethod(0.0)
    with pytest.raises(am.InvalidInput, match="G: expected a function"):
        am.RateEquation(None, lambda t, x: x)
    wrong = am.RateEquation(lambda x, rate: np.zeros(2), lambda t, x: np.zeros(1))
    with pytest.raises(am.InvalidInput, match="residual"):
        am.StepPath(wrong, (snap(0.1), snap(0.3)), (0.1, 0.3, 0.5)).branch()
