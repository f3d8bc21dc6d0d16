"""Fischer and Burmeister's function: zero at solutions, its derivative, also at the kinks."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.newton.fischer_burmeister import jordan_fischer_burmeister

STEP = 1e-6


def points(d, count, seed=0):
    rng = np.random.default_rng(seed)
    mu = rng.uniform(0.1, 2, count)
    mu[: count // 5] = 0
    return (
        rng.standard_normal((count, d)),
        rng.standard_normal((count, d)),
        am.Coulomb(mu),
        rng.uniform(0.5, 2, count),
    )


def differences(function, r, u, law, rho):
    """(dF/dr, dF/du) by central differences."""
    found = []
    for moved in (0, 1):
        columns = []
        for k in range(r.shape[1]):
            h = np.zeros(r.shape[1])
            h[k] = STEP
            ends = [
                function.residual(*((r + s * h, u) if moved == 0 else (r, u + s * h)), law, rho)
                for s in (1, -1)
            ]
            columns.append((ends[0] - ends[1]) / (2 * STEP))
        found.append(np.stack(columns, axis=2))
    return found


@pytest.mark.parametrize("d", [2, 3])
def test_derivative_is_that_of_differences(d):
    r, u, law, rho = points(d, 100)
    function = am.FischerBurmeister()
    _, A, B = function.linearise(r, u, law, rho)
    by_r, by_u = differences(function, r, u, law, rho)
    np.testing.assert_allclose(A, by_r, atol=1e-7)
    np.testing.assert_allclose(B, by_u, atol=1e-7)


@pytest.mark.parametrize("d", [2, 3])
def test_zero_exactly_at_solutions(d):
    law, rho = am.Coulomb(np.full(3, 0.5)), np.array([1.0, 2.0, 0.3])
    r, u = np.zeros((3, d)), np.zeros((3, d))
    u[0, 0] = 1.0  # open
    r[1, :2] = 2.0, 0.3  # stick
    r[2, :2], u[2, :2] = (2.0, -1.0), (0.0, 3.0)  # slip against the reaction
    found = am.FischerBurmeister().residual(r, u, law, rho)
    np.testing.assert_allclose(found, 0, atol=1e-15)
    r[2, 1] = 1.0  # along it
    assert np.abs(am.FischerBurmeister().residual(r, u, law, rho)[2]).max() > 0.1


@pytest.mark.parametrize("d", [2, 3])
def test_derivative_at_kinks_is_a_limit_of_derivatives_beside_them(d):
    s = np.array([0.6, 0.8]) if d == 3 else np.array([-1.0])
    edge, axis = np.array([1.0, *s]), np.eye(d)[0]
    x = np.array([2 * edge, np.zeros(d), 3 * edge, np.zeros(d)])
    y = np.array([3 * edge, np.zeros(d), np.zeros(d), 2 * edge])
    _, dx, dy = jordan_fischer_burmeister(x, y)
    for t in (1e-4, 1e-6):
        _, near_x, near_y = jordan_fischer_burmeister(x + t * axis, y + t * axis)
        np.testing.assert_allclose(near_x, dx, atol=10 * t)
        np.testing.assert_allclose(near_y, dy, atol=10 * t)
    np.testing.assert_allclose(dx[1], (1 - 0.5**0.5) * np.eye(d))


def test_derivative_is_bounded_and_not_singular_together():
    """I - L_z^-1 L_x has its eigenvalues between 0 and 2, and the sum of both is regular."""
    rng = np.random.default_rng(3)
    for scale in (1e-12, 1.0, 1e12):
        _, dx, dy = jordan_fischer_burmeister(
            rng.standard_normal((200, 3)), scale * rng.standard_normal((200, 3))
        )
        assert np.isfinite(dx).all()
        assert np.abs(np.linalg.eigvals(dx)).max() < 2.5
        assert np.linalg.cond(dx + dy).max() < 1e3


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_newton_on_it_finds_the_solution(d, mu):
    problem = random_delassus(2, 6, d, mu=mu) if mu else random_delassus(2, 6, d).with_mu(0.0)
    found = am.solve(problem, am.SemismoothNewton(am.FischerBurmeister()), tolerance=1e-12)
    np.testing.assert_allclose(found.u, am.solve(problem, tolerance=1e-12).u, atol=1e-9)


def test_global_form_and_tresca_friction():
    problem = random_delassus(4, 5)
    given = am.FrictionProblem.from_delassus(problem.W, problem.q, am.Tresca(np.full(5, 0.2)))
    found = am.solve(given, am.SemismoothNewton(am.FischerBurmeister()), tolerance=1e-10)
    np.testing.assert_allclose(found.u, am.solve(given, tolerance=1e-10).u, atol=1e-7)


def test_one_rho_per_contact():
    split = am.RhoStrategy.SPLIT
    with pytest.raises(am.InvalidInput, match="fischer burmeister .* one rho"):
        am.SemismoothNewton(am.FischerBurmeister(), rho_strategy=split)
    r = np.ones((2, 3))
    with pytest.raises(am.InvalidInput, match="one per contact"):
        am.FischerBurmeister().residual(r, r, am.Coulomb(np.ones(2)), np.ones((2, 2)))
