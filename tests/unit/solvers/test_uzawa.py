"""The augmented Lagrangian: its law and derivative, update, both forms and stiff springs."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.mechanics.ready import gallery
from amontons.solvers import Iterate, Target
from amontons.solvers.gradient.uzawa import _Springs


def one_by_one(iterates, count):
    return [next(iterates) for _ in range(count)]


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("tresca", [False, True])
def test_derivative_of_the_springs(d, tresca):
    rng = np.random.default_rng(d)
    nc, bound = 60, rng.uniform(0.1, 1, 60)
    law = am.Tresca(bound) if tresca else bound
    problem = am.FrictionProblem.from_delassus(np.eye(nc * d), np.zeros((nc, d)), law)
    springs = _Springs.of(problem, 1.7, am.RhoStrategy.CONSTANT)
    multiplier, u, du = rng.standard_normal((3, nc, d))
    p, B = springs.reaction(multiplier, u)
    closed, slides = (
        p[:, 0] > 0,
        np.linalg.norm(p[:, 1:], axis=1) > 0.999 * problem.law.bound(p),
    )
    assert closed.any() and (~closed).any() and slides.any() and (~slides).any()
    h = 1e-7
    slope = (springs.reaction(multiplier, u + h * du)[0] - p) / h
    assert slope == pytest.approx(-np.einsum("ijk,ik->ij", B, du), abs=1e-5)


def test_kinks_take_the_published_side():
    """x_N = 0 is open, the rim of the disk sticks, also where the disk is a point."""
    problem = am.FrictionProblem.from_delassus(np.eye(6), np.zeros((3, 2)), np.full(3, 0.5))
    springs = _Springs.of(problem, 2.0, am.RhoStrategy.CONSTANT)
    multiplier = np.array([[0.0, 0.0], [1.0, 0.5], [0.0, 0.1]])
    B = springs.reaction(multiplier, np.zeros((3, 2)))[1]
    assert B.tolist() == [[[0, 0], [0, 2]], [[2, 0], [0, 2]], [[0, 0], [0, 0]]]


def test_an_update_leaves_the_part_that_the_springs_give_way():
    """One closed contact without friction: lambda - r falls by 1 / (1 + rho W) each time."""
    W, rho = 3.0, 4.0
    problem = am.FrictionProblem.from_delassus(W * np.eye(2), [[-6.0, 0.0]], [0.0])
    method = am.Uzawa(rho=rho, growth=1, rho_strategy=am.RhoStrategy.CONSTANT)
    found = one_by_one(
        method.iterates(problem, Iterate(np.array([[0.5, 0.0]])), Target(1e-8)), 4
    )
    errors = [0.5 - 2.0] + [iterate.r[0, 0] - 2.0 for iterate in found]
    assert np.divide(errors[1:], errors[:-1]) == pytest.approx(np.full(4, 1 / 13))


@pytest.mark.parametrize("mu", [0.3, 1.0])
@pytest.mark.parametrize("d", [2, 3])
def test_same_solution_as_gauss_seidel_and_quick(d, mu):
    for seed in range(5):
        problem = gallery.random_delassus(seed, 6, d, mu=mu)
        expected = am.solve(problem, am.GaussSeidel(anderson_depth=8), tolerance=1e-10).r
        found = am.solve(problem, am.Uzawa(), tolerance=1e-9)
        assert found.r == pytest.approx(expected, abs=1e-5)
        assert found.convergence.iterations <= 40


def test_both_forms_do_the_same():
    rng = np.random.default_rng(3)
    root = rng.standard_normal((12, 12)) / np.sqrt(12)
    problem = am.FrictionProblem.from_global(
        root @ root.T + np.eye(12), np.eye(12)[:, :9], rng.standard_normal(12),
        np.array([[-1, 0.1, 0], [-0.5, 0.6, 0.2], [0.5, 0, 1]]), np.full(3, 0.4),
    )  # fmt: skip
    start = Iterate(np.zeros((3, 3)))
    method = am.Uzawa(rho_strategy=am.RhoStrategy.CONSTANT, newton_tolerance=1e-12)
    runs = [one_by_one(method.iterates(p, start, Target(1e-8)), 3)
            for p in (problem, problem.condensed())]  # fmt: skip
    assert any(np.abs(iterate.r).max() > 0.1 for iterate in runs[0])
    for one, two in zip(*runs, strict=True):
        assert one.r == pytest.approx(two.r, abs=1e-10)
        assert problem.M @ one.v == pytest.approx(
            problem.H @ one.r.ravel() + problem.f, abs=1e-10
        )


def test_a_body_that_contact_alone_holds():
    """Two masses joined by a spring, pushed onto an obstacle."""
    M = sparse.csc_array([[1.0, 0, -1, 0], [0, 1, 0, -1], [-1, 0, 1, 0], [0, -1, 0, 1]])
    problem = am.FrictionProblem.from_global(
        M, np.eye(4)[:, :2], [0, 0, -1.0, 0.2], np.zeros((1, 2)), [0.5], u_scale=1.0
    )
    start = Iterate(np.array([[1.0, 0.0]]), np.zeros(4))
    found = am.solve(problem, am.Uzawa(), start=start)
    assert found.r == pytest.approx(np.array([[1.0, -0.2]]), abs=1e-6)
    assert found.v == pytest.approx(np.array([0, 0, -1.0, 0.2]), abs=1e-6)


def test_springs_that_are_too_stiff_soften():
    problem = gallery.random_delassus(0, 6, 2, mu=1.0)
    stiff = am.drive(problem, am.Uzawa(rho=1e6, growth=1), max_iterations=900)
    assert not stiff.converged
    assert am.drive(problem, am.Uzawa(rho=1e6), max_iterations=900).converged


@pytest.mark.parametrize(
    "option", [{"rho": 0.0}, {"growth": 0.9}, {"newton_tolerance": -1.0}, {"newton_steps": 0}]
)
def test_bad_options_are_refused(option):
    with pytest.raises(InvalidInput, match=next(iter(option))):
        am.Uzawa(**option)
