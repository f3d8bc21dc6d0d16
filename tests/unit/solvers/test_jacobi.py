"""Jacobi with its safe stiffness, and without."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.driver import drive
from amontons.solvers.sweeps.jacobi import safe_stiffening


def block_roots(problem):
    W, d = problem.W, problem.dimension
    D = np.zeros_like(W)
    for k in range(0, len(W), d):
        D[k : k + d, k : k + d] = W[k : k + d, k : k + d]
    values, vectors = np.linalg.eigh(D)
    return (vectors / np.sqrt(values)) @ vectors.T


@pytest.mark.parametrize("d", [2, 3])
def test_stiffness_is_the_largest_eigenvalue(d):
    problem = random_delassus(5, 7, d)
    root = block_roots(problem)
    exact = np.linalg.eigvalsh(root @ problem.W @ root)[-1]
    assert 0.9 * exact <= safe_stiffening(problem) <= 1.001 * exact
    assert exact > 1.5  # not diagonally dominant


@pytest.mark.parametrize("seed", range(3))
def test_converges_where_plain_jacobi_does_not(seed):
    problem = random_delassus(seed, 8)
    found = am.solve(problem, am.Jacobi(batch=5), tolerance=1e-10)
    np.testing.assert_allclose(found.u, am.solve(problem, tolerance=1e-12).u, atol=1e-7)
    plain = drive(problem, am.Jacobi(stiffening=1.0, batch=10), tolerance=1e-10)
    assert not plain.converged
    assert plain.convergence.error > 1e-3


def test_energy_without_friction_never_grows():
    problem = random_delassus(1, 8).with_mu(0.0)
    q, W, seen = problem.q.ravel(), problem.W, []
    drive(problem, am.Jacobi(), max_iterations=50,
          callback=lambda step, iterate: seen.append(iterate.r.ravel()))  # fmt: skip
    energies = [0.5 * r @ W @ r + q @ r for r in seen]
    assert (np.diff(energies) <= 1e-12 * abs(energies[-1])).all()


def test_diagonal_problem_takes_one_iteration():
    problem = am.FrictionProblem.from_delassus(
        np.eye(6), np.tile([-1.0, 0.2, 0.0], (2, 1)), np.full(2, 0.5)
    )
    found = am.solve(problem, am.Jacobi())
    assert found.convergence.iterations == 1


def test_contact_without_compliance_keeps_zero():
    W = np.zeros((6, 6))
    W[:3, :3] = np.eye(3)
    q = np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    found = am.solve(am.FrictionProblem.from_delassus(W, q, np.full(2, 0.5)), am.Jacobi())
    np.testing.assert_allclose(found.r, [[1, 0, 0], [0, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("options", [{"batch": 0}, {"stiffening": 0.0}, {"stiffening": -1.0}])
def test_options_are_checked(options):
    with pytest.raises(am.InvalidInput, match=next(iter(options))):
        am.Jacobi(**options)
