"""Projections, Jacobians and natural maps of both friction laws, by hand and by differences."""

import numpy as np
import pytest

from amontons.core.errors import InvalidInput
from amontons.problem.law import Coulomb, Tresca
from amontons.problem.law.cones import (
    natural_map,
    project_cone,
    project_cone_jacobian,
    project_disk,
    project_disk_jacobian,
    with_de_saxce,
)

RNG_SEED = 20


@pytest.mark.parametrize(
    ("x", "mu", "expected"),
    [
        ((2.0, 0.5, 0.0), 0.5, (2.0, 0.5, 0.0)),  # inside
        ((-1.0, 0.3, 0.4), 0.5, (0.0, 0.0, 0.0)),  # polar
        ((0.0, 3.0, 4.0), 1.0, (2.5, 1.5, 2.0)),  # between: onto the side
        ((1.0, 3.0, 4.0), 0.0, (1.0, 0.0, 0.0)),  # no friction: a ray
        ((-1.0, 3.0, 4.0), 0.0, (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), 0.7, (0.0, 0.0, 0.0)),  # apex
        ((2.0, 0.0, 1.0), 0.5, (2.0, 0.0, 1.0)),  # on the side
    ],
)
def test_projection_by_hand(x, mu, expected):
    np.testing.assert_allclose(project_cone(np.array([x]), np.array([mu]))[0], expected)


def test_disk_by_hand():
    t = np.array([[3.0, 4.0], [0.3, 0.4], [0.0, 0.0], [3.0, 4.0]])
    radius = np.array([1.0, 1.0, 0.0, 0.0])
    np.testing.assert_allclose(
        project_disk(t, radius), [[0.6, 0.8], [0.3, 0.4], [0, 0], [0, 0]]
    )


def differences(function, x, step=1e-7):
    """Central differences of a map of rows, (nc, out, d)."""
    columns = []
    for k in range(x.shape[1]):
        e = np.zeros_like(x)
        e[:, k] = step
        columns.append((function(x + e) - function(x - e)) / (2 * step))
    return np.stack(columns, axis=2)


@pytest.mark.parametrize("d", [2, 3])
def test_cone_jacobian_is_the_derivative(d):
    rng = np.random.default_rng(RNG_SEED)
    x, mu = rng.standard_normal((400, d)), 2 * rng.random(400)
    mu[:20] = 0
    t = np.linalg.norm(x[:, 1:], axis=1)
    kink = np.minimum(np.abs(t - mu * x[:, 0]), np.abs(mu * t + x[:, 0]))
    clear = kink > 1e-4
    jacobian = project_cone_jacobian(x, mu)
    numeric = differences(lambda y: project_cone(y, mu), x)
    np.testing.assert_allclose(jacobian[clear], numeric[clear], atol=1e-6)
    eigenvalues = np.linalg.eigvalsh(jacobian)
    assert eigenvalues.min() > -1e-14
    assert eigenvalues.max() < 1 + 1e-14
    assert clear.sum() > 350


@pytest.mark.parametrize("d", [2, 3])
def test_disk_jacobians_are_the_derivatives(d):
    rng = np.random.default_rng(RNG_SEED)
    t, radius = rng.standard_normal((300, d - 1)), 2 * rng.random(300)
    clear = np.abs(np.linalg.norm(t, axis=1) - radius) > 1e-4
    in_t, in_radius = project_disk_jacobian(t, radius)
    numeric = differences(lambda y: project_disk(y, radius), t)
    np.testing.assert_allclose(in_t[clear], numeric[clear], atol=1e-6)
    h = 1e-7
    numeric = (project_disk(t, radius + h) - project_disk(t, radius - h)) / (2 * h)
    np.testing.assert_allclose(in_radius[clear], numeric[clear], atol=1e-6)


def test_jacobians_on_kinks():
    side = project_cone_jacobian(np.array([[2.0, 1.0, 0.0]]), np.array([0.5]))
    np.testing.assert_array_equal(side[0], np.eye(3))
    apex = project_cone_jacobian(np.zeros((1, 3)), np.array([0.5]))
    assert not apex.any()
    in_t, in_radius = project_disk_jacobian(np.array([[0.6, 0.8]]), np.array([1.0]))
    np.testing.assert_array_equal(in_t[0], np.eye(2))
    assert not in_radius.any()


def test_de_saxce_leaves_its_argument_alone():
    u = np.array([[1.0, 3.0, 4.0]])
    np.testing.assert_array_equal(with_de_saxce(u, np.array([0.5])), [[3.5, 3.0, 4.0]])
    assert u[0, 0] == 1


COULOMB_STATES = [
    ((0, 0, 0), (1, 2, -1), True),  # open
    ((2, 0.3, 0.4), (0, 0, 0), True),  # stick
    ((2, -0.6, -0.8), (0, 3, 4), True),  # slip, mu = 0.5
    ((2, 0.6, 0.8), (0, 3, 4), False),  # friction pushes
    ((2, -0.3, -0.4), (0, 3, 4), False),  # too weak while slipping
    ((2, 3, 0), (0, 0, 0), False),  # outside the cone
    ((0, 0, 0), (-1, 0, 0), False),  # penetration
    ((1, 0, 0), (1, 0, 0), False),  # pressed at a distance
    ((-1, 0, 0), (0, 0, 0), False),  # glued
]


@pytest.mark.parametrize(("r", "u", "solves"), COULOMB_STATES)
@pytest.mark.parametrize("rho", [1e-6, 1.0, 1e6])
def test_natural_map_of_coulomb_is_zero_exactly_at_solutions(r, u, solves, rho):
    r, u = np.array([r], dtype=float), np.array([u], dtype=float)
    residual = Coulomb([0.5]).natural_map(r, u, np.array([rho]))
    assert (np.abs(residual).max() < 1e-9 * max(1, rho)) == solves


@pytest.mark.parametrize(
    ("r", "u", "solves"),
    [
        ((0, -0.3, -0.4), (1, 3, 4), True),  # open and rubbing
        ((0, 0.1, 0.2), (1, 0, 0), True),  # open and stuck
        ((2, -0.3, -0.4), (0, 3, 4), True),
        ((2, 0.1, 0.2), (0, 0, 0), True),
        ((2, 0.3, 0.4), (0, 3, 4), False),
        ((2, 0, 0), (0, 3, 4), False),
        ((2, 1, 0), (0, 0, 0), False),
        ((0, 0, 0), (-1, 0, 0), False),
    ],
)
@pytest.mark.parametrize("rho", [1e-6, 1.0, 1e6])
def test_natural_map_of_tresca_is_zero_exactly_at_solutions(r, u, solves, rho):
    r, u = np.array([r], dtype=float), np.array([u], dtype=float)
    residual = Tresca([0.5]).natural_map(r, u, np.array([rho]))
    assert (np.abs(residual).max() < 1e-9 * max(1, rho)) == solves


def test_natural_map_scales_with_units():
    rng = np.random.default_rng(RNG_SEED)
    r, u = rng.standard_normal((2, 50, 3))
    mu, rho = rng.random((2, 50))
    newtons, metres = 1e9, 1e-3
    scaled = natural_map(newtons * r, metres * u, mu, rho * newtons / metres)
    np.testing.assert_allclose(scaled, newtons * natural_map(r, u, mu, rho), rtol=1e-9)


@pytest.mark.parametrize("law", [Coulomb, Tresca])
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_bad_coefficients_are_named(law, value):
    name = "mu" if law is Coulomb else "bound"
    with pytest.raises(InvalidInput, match=rf"{name}\[1\].*{value}"):
        law([0.2, value])


def test_coefficients_are_read_only_rows():
    with pytest.raises(InvalidInput, match=r"mu: expected shape \(nc,\), got \(1, 2\)"):
        Coulomb([[0.1, 0.2]])
    mu = Coulomb([0.1, 0.2]).mu
    with pytest.raises(ValueError, match="read-only"):
        mu[0] = 1


def test_selection_and_bounds():
    r = np.array([[2.0, 0, 0], [-1.0, 0, 0]])
    np.testing.assert_array_equal(Coulomb([0.5, 0.5]).bound(r), [1.0, 0.0])
    np.testing.assert_array_equal(Tresca([0.5, 0.7]).bound(r), [0.5, 0.7])
    assert Coulomb([0.1, 0.2]).at(np.array([1])).mu == [0.2]
    assert Tresca([0.1, 0.2]).at(np.array([1])).limit == [0.2]


def test_regions_of_both_laws():
    r = np.array([[0, 0, 0], [2, 0.3, 0], [2, -1, 0]], dtype=float)
    u = np.array([[1, 0, 0], [0, 0, 0], [0, 1, 0]], dtype=float)
    closed, sliding = Coulomb([0.5] * 3).regions(r, u, np.ones(3))
    assert closed.tolist() == [False, True, True]
    assert sliding.tolist() == [False, False, True]
    closed, sliding = Tresca([1.0] * 3).regions(
        r, u + [[0, 2, 0], [0, 0, 0], [0, 0, 0]], np.ones(3)
    )
    assert closed.tolist() == [False, True, True]
    assert sliding.tolist() == [True, False, True]
