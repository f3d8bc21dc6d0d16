"""The interior point without friction, alone and as what `Auto` runs."""

import numpy as np
import pytest

import amontons as am
from amontons.problem import matrices

STONE = am.LinearElastic(10.0, 0.3, density=1.0)


def wall(mu, aside=0.0):
    """Three blocks, two of which contact alone holds."""
    made = am.Wall(2, 1, size=(2.0, 1.0), cells=(4, 2), material=STONE)
    return made.model([], [am.BodyForce((aside, -1.0))]).assemble().with_mu(mu)


def test_auto_takes_it_where_nothing_holds_bodies():
    """Weight of all blocks on the floor, the lower ones and the pressures of the law."""
    problem = wall(0.0)
    solution = am.solve(problem, tolerance=1e-9)
    assert solution.convergence.detail == "interior point without friction"
    assert solution.converged
    assert not solution.r[:, 1].any()
    alone = am.solve(problem, am.FrictionlessInteriorPoint(), tolerance=1e-9)
    np.testing.assert_allclose(alone.r, solution.r, atol=1e-7)
    weight = -problem.f[1::2].sum()
    pressed = (problem.H @ solution.r.ravel())[1::2].sum()
    assert pressed == pytest.approx(weight, rel=1e-8)


def test_a_load_that_no_pressure_balances_ends_with_a_reason():
    """Pushed aside on a floor without friction: no rest, whatever method."""
    solution = am.solve(
        wall(0.0, 0.5), am.FrictionlessInteriorPoint(), check=False, time_limit=20
    )
    assert not solution.converged
    assert np.isfinite(solution.r).all()


def test_bodies_that_have_mass_are_not_searched_for_loose_ones(monkeypatch):
    """That took 300 times as long as the solution of 5000 of them."""

    def never(*_):
        raise AssertionError("searched")

    monkeypatch.setattr(matrices, "loose_modes", never)
    H = np.kron(np.eye(3) - np.eye(3, k=1), np.eye(2))  # a column
    problem = am.FrictionProblem.from_global(
        np.eye(6), H, np.tile([0.0, -1.0], 3)[::-1], np.zeros((3, 2)), np.zeros(3)
    )
    np.testing.assert_allclose(am.solve(problem).r[:, 0], [3, 2, 1], rtol=1e-6)


def test_friction_is_refused():
    solution = am.solve(wall(0.3), am.FrictionlessInteriorPoint(), check=False)
    assert not solution.converged
    assert "friction" in solution.convergence.detail


def test_no_matrix_to_scale_steps_with_is_refused():
    problem = am.FrictionProblem.from_global(
        np.zeros((2, 2)), np.eye(2), [0.0, -1.0][::-1], np.zeros((1, 2)), [0.0]
    )
    solution = am.solve(problem, am.FrictionlessInteriorPoint(), check=False)
    assert not solution.converged
    assert "diagonal" in solution.convergence.detail
