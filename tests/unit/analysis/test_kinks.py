"""Kinks where the first order does not decide, and problems that only name the active piece."""

import doctest

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths import path as path_module

QUADRANTS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]  # signs of p and x


class Quadrants:
    """A scalar function with one selection function per quadrant, as in [LR] example 1."""

    def __init__(self, *functions):
        self.functions = dict(zip(QUADRANTS, functions, strict=True))

    def piece(self, y, p):
        return (1 if p >= 0 else -1, 1 if y[0] >= 0 else -1)

    def pieces(self, y, p, tolerance):
        return [
            q for q in QUADRANTS if q[0] * p >= -tolerance and q[1] * y[0] >= -tolerance
        ]  # fmt: skip

    def residual_of(self, q, y, p):
        return np.array([self.functions[q](y[0], p)[0]])

    def jacobian_of(self, q, y, p):
        _, by_y, by_p = self.functions[q](y[0], p)
        return np.array([[by_y]]), np.array([by_p])

    def margins(self, q, y, p):
        return np.array([q[0] * p, q[1] * y[0]])

    def residual(self, y, p):
        return self.residual_of(self.piece(y, p), y, p)

    def jacobian(self, y, p):
        return self.jacobian_of(self.piece(y, p), y, p)


class Bare:
    """The same problem with no more than what is required."""

    def __init__(self, problem):
        self.residual, self.jacobian = problem.residual, problem.jacobian
        self.piece = problem.piece


def example_G(bend=1.0):
    """Zeros only to the left of p = 0, where both first-order systems see (1, 0), too."""
    return Quadrants(
        lambda x, p: (-x + p, -1.0, 1.0), lambda x, p: (-x + bend * p**2, -1.0, 2 * bend * p),
        lambda x, p: (x + bend * p**2, 1.0, 2 * bend * p), lambda x, p: (x + p, 1.0, 1.0),
    )  # fmt: skip


def example_H(power=2):
    """One curve to the right, two that touch to the left."""
    def of(sign, slope):
        return lambda x, p: (
            slope * x + sign * abs(p) ** power, slope,
            sign * power * abs(p) ** (power - 1) * np.sign(p),
        )  # fmt: skip

    return Quadrants(of(1, 1.0), of(0, 1.0), of(0, -1.0), of(1, -1.0))


@pytest.mark.parametrize("wrap", [lambda problem: problem, Bare])
@pytest.mark.parametrize("bend", [1.0, 30.0, 0.3])
def test_no_curve_leaves_where_only_the_first_order_says_so(wrap, bend):
    branch = am.follow(wrap(example_G(bend)), start=[-1.0], at=-1, interval=(-1, 1))
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    (fold,) = branch.folds
    assert not fold.smooth
    assert fold.parameter == pytest.approx(0, abs=1e-12)
    assert branch[-1].state[0] == pytest.approx(1.0)
    np.testing.assert_allclose(np.abs(branch.states[:, 0]), -branch.parameter, atol=1e-11)


@pytest.mark.parametrize("wrap", [lambda problem: problem, Bare])
@pytest.mark.parametrize(("power", "near"), [(2, 1e-7), (3, 1e-5)])
@pytest.mark.parametrize("start", [-1.0, 1.0])
def test_three_branches_that_touch_are_a_branch_point(wrap, power, near, start):
    problem = wrap(example_H(power))
    branch = am.follow(problem, start=[start], at=-1, interval=(-1, 1))
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    kinds = [event.kind for event in branch.events]
    assert kinds == [am.EventKind.END, am.EventKind.BRANCH, am.EventKind.END]
    event = branch.events[1]
    assert event.parameter == pytest.approx(0, abs=near)
    assert sorted(round(rate) for rate in event.directions[:, -1]) == [-1, -1, 1]
    assert branch[-1].parameter == 1


def test_from_the_right_one_of_two_branches_is_taken():
    branch = am.follow(example_H(), start=[0.0], at=1, interval=(-1, 1))
    (event,) = [e for e in branch.events if e.kind is am.EventKind.BRANCH]
    assert len(event.directions) == 3
    assert abs(branch.at(-1.0)[0][0]) == pytest.approx(1)


def test_the_example_of_the_documentation_runs():
    assert doctest.testmod(path_module).failed == 0
    assert "follow" in path_module.PathProblem.__doc__


class Staircase:
    """x' jumps at every hundredth of p: kinks closer than a step."""

    def __init__(self):
        self.calls = 0

    def residual(self, y, p):
        steps = np.arange(100) / 100
        return y - (p + np.maximum(p - steps, 0).sum() / 3)

    def jacobian(self, y, p):
        self.calls += 1
        return np.eye(1), -np.array([1 + (p > np.arange(100) / 100).sum() / 3])

    def piece(self, y, p):
        return int((p > np.arange(100) / 100).sum())


def test_kinks_are_located_in_a_few_corrections():
    problem = Staircase()
    branch = am.follow(problem, start=[0.0], at=-0.001, interval=(-0.5, 1.0))
    changes = [e.parameter for e in branch.events if e.kind is am.EventKind.STATUS]
    np.testing.assert_allclose(changes, np.arange(100) / 100, atol=1e-12)
    assert problem.calls < 40 * 100


class Bends:
    """y = f(p), or |y - f(p)| = slope |p|, with f straight but for its kinks."""

    def __init__(self, kinks, changes, slope=0.0):
        self.kinks, self.changes, self.slope = np.array(kinks), np.array(changes), slope

    def _curve(self, p):
        beyond = np.maximum(p - self.kinks, 0)
        return 0.5 * p + self.changes @ beyond, 0.5 + self.changes @ (p > self.kinks)

    def residual(self, y, p):
        off = y - self._curve(p)[0]
        return off if not self.slope else np.abs(off) - self.slope * np.abs(p)

    def jacobian(self, y, p):
        value, rate = self._curve(p)
        side = np.sign(y[0] - value) if self.slope else 1.0
        return side * np.eye(1), -np.array([side * rate + self.slope * np.sign(p)])

    def piece(self, y, p):
        value = self._curve(p)[0]
        sides = (p > 0, y[0] > value) if self.slope else ()
        return (int((p > self.kinks).sum()), *map(bool, sides))


def graded(seed):
    """Kinks at 1e-6 to 1e-4 from one another."""
    rng = np.random.default_rng(seed)
    gaps = 10 ** rng.uniform(-6, -4, 20)
    return np.append(0.0, np.cumsum(gaps)), rng.uniform(-0.2, 0.2, 21)


@pytest.mark.parametrize("kinks_and_changes", [
    ([0.0, 7.143e-6, 8.2343e-5], [0.1, 0.1, 0.1]),
    ([0.0, 7.143e-6, 8.2343e-5], [0.1, 0.1, -0.1]),
    *(graded(seed) for seed in range(3)),
])  # fmt: skip
def test_a_graph_whose_kinks_follow_closely_has_no_branch_point(kinks_and_changes):
    """What a solution along a later piece's line tells from the curve is the kinks between."""
    problem = Bends(*kinks_and_changes)
    branch = am.follow(problem, start=[-0.0005], at=-0.001, interval=(-0.002, 0.004))
    inner = [event for event in branch.events if event.kind is not am.EventKind.END]
    assert {event.kind for event in inner} == {am.EventKind.STATUS}
    np.testing.assert_allclose([e.parameter for e in inner], problem.kinks, atol=1e-12)


@pytest.mark.parametrize("apart", [5e-8, 3e-7])
def test_two_kinks_close_by_do_not_close_a_curve(apart):
    problem = Bends([0.0, apart], [0.1, 0.1])
    branch = am.follow(problem, start=[-0.0005], at=-0.001, interval=(-0.002, 0.002))
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    changes = [e.parameter for e in branch.events if e.kind is am.EventKind.STATUS]
    np.testing.assert_allclose(changes, [0, apart], atol=1e-12)


@pytest.mark.parametrize("slope", [0.1, 0.05, 0.002])
def test_a_branch_point_with_kinks_close_behind_it_is_told(slope):
    problem = Bends([0.0, 7.143e-6, 8.2343e-5], [0.1, 0.1, 0.1], slope)
    start = [-0.0005 + slope * 0.001]
    branch = am.follow(problem, start=start, at=-0.001, interval=(-0.002, 0.002))
    (event,) = [e for e in branch.events if e.kind is am.EventKind.BRANCH]
    assert event.parameter == pytest.approx(0, abs=1e-9)
    slopes = event.directions[:, 0] / event.directions[:, 1]
    wanted = [0.5 - slope, 0.5 + slope, 0.6 - slope, 0.6 + slope]
    np.testing.assert_allclose(np.sort(slopes), np.sort(wanted), atol=1e-6)
