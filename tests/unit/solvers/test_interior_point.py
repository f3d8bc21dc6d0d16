"""The interior point: cone complementarity with frozen sliding, piles at rest."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import UnsupportedForm
from amontons.linear.blocks import spatial
from amontons.mechanics.ready.gallery import random_delassus
from amontons.mechanics.ready.packings import SpherePacking
from amontons.solvers.contract import Iterate, Target
from amontons.solvers.newton.smoothing import Workspace


def solve(problem, **options):
    return am.solve(problem, am.InteriorPoint(**options), tolerance=1e-9, check=False)


@pytest.mark.parametrize("slip", [0.0, 0.3])
def test_relaxation_is_a_cone_complementarity_problem(slip):
    """x in K, y = S u + s e_N in K, x . y = 0, with the s given and not |u_T|."""
    problem = random_delassus(3, 12).condensed()
    r = am.InteriorPoint().relax(Workspace.of(problem), np.full(12, slip), 0.0)[1]
    u, mu = problem.velocity(r)[0], problem.mu
    x = np.column_stack([mu * r[:, 0], r[:, 1:]])
    y = np.column_stack([u[:, 0] / mu + slip, u[:, 1:]])
    for cone in (x, y):
        assert (cone[:, 0] - np.linalg.norm(cone[:, 1:], axis=1)).min() > -1e-6
    assert np.abs(np.einsum("ia,ia->i", x, y)).max() < 1e-6 * np.abs(r).max()
    if slip:  # and it is another problem than that of the law
        assert problem.error(r) > 1e-3


def test_pile_at_rest_in_few_steps():
    """Every sphere rests: more reactions than balances, weight carried by the floor."""
    packing = SpherePacking(100, seed=1)
    problem = packing.problem()
    assert 3 * problem.contacts > problem.unknowns
    solution = solve(problem.condensed())
    assert solution.converged
    found = next(
        am.InteriorPoint(sweeps=0).iterates(
            problem.condensed(), Iterate(np.zeros((problem.contacts, 3))), Target(1e-6)
        )
    )
    assert found.iterations < 60
    assert problem.error(found.r) < 0.05


def test_without_friction_it_is_the_whole_solution():
    """mu = 0: the relaxation is the problem, whatever the frozen s."""
    problem = random_delassus(5, 10).with_mu(0.0)
    solution = solve(problem, sweeps=0)
    assert solution.converged
    assert np.abs(solution.r[:, 1:]).max() == 0
    assert solution.r[:, 0].min() >= 0


def test_contacts_that_can_not_react_stay_open():
    """A zero block moves as q says; its reaction is zero and the others are not disturbed."""
    alone = random_delassus(6, 5)
    W = np.zeros((18, 18))
    W[:15, :15] = alone.W.toarray() if hasattr(alone.W, "toarray") else alone.W
    q = np.vstack([alone.q, [0.5, 0.1, 0.0]])
    problem = am.FrictionProblem.from_delassus(W, q, np.append(alone.mu, 0.4))
    solution = solve(problem)
    assert solution.converged
    assert (solution.r[5] == 0).all()
    np.testing.assert_allclose(solution.r[:5], solve(alone).r, atol=1e-6)
    # nor are the steps themselves: no sweeps have to make up for them
    steps, r = am.InteriorPoint().relax(Workspace.of(problem), np.full(6, 0.1), 1e-9)
    own = Workspace.of(alone.condensed())
    expected = am.InteriorPoint().relax(own, np.full(5, 0.1), 1e-9)[1]
    assert steps > 3
    np.testing.assert_allclose(r[:5], expected, atol=1e-4)  # as far as steps go


def test_planar_problem():
    """In the plane the second tangent does not exist, and does not disturb."""
    W = np.array([[2.0, 0.3, 0.5, 0], [0.3, 1.5, 0, 0.2], [0.5, 0, 1.8, 0], [0, 0.2, 0, 1.2]])
    q = np.array([[-1.0, 0.2], [-0.5, -0.7]])
    problem = am.FrictionProblem.from_delassus(W, q, [0.3, 0.3])
    solution = solve(problem)
    assert solution.converged
    assert solution.r.shape == (2, 2)
    np.testing.assert_allclose(solution.r, am.solve(problem, tolerance=1e-11).r, atol=1e-6)
    assert spatial(solution.r).shape == (2, 3)


def test_tresca_is_refused():
    problem = am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0, 0]], am.Tresca([0.5]))
    with pytest.raises(UnsupportedForm, match="Tresca"):
        am.solve(problem, am.InteriorPoint())


@pytest.mark.parametrize(
    "wrong", [{"steps": 0}, {"sweeps": -1}, {"shift": 0.0}, {"shift": -1.0}]
)
def test_options_are_checked(wrong):
    with pytest.raises(am.InvalidInput, match=next(iter(wrong))):
        am.InteriorPoint(**wrong)
