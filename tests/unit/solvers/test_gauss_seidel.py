"""Gauss-Seidel sweeps against a NumPy twin that solves contact after contact."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.mechanics.ready.gallery import random_delassus
from amontons.problem.friction import FrictionProblem
from amontons.problem.law import Coulomb, Tresca
from amontons.problem.law.single import solve_one
from amontons.solvers import GaussSeidel
from amontons.solvers.contract import Iterate, Target
from amontons.solvers.driver import drive
from amontons.solvers.sweeps.gauss_seidel import Batch
from amontons.solvers.sweeps.kernels import sweep_data, watch_for
from amontons.solvers.sweeps.momentum import Momentum


def random_problem(d=3, law=Coulomb, nc=5):
    rng = np.random.default_rng(d)
    root = rng.standard_normal((nc * d, nc * d))
    q = rng.standard_normal((nc, d)) - np.eye(1, d)
    return FrictionProblem.from_delassus(
        root @ root.T / nc + np.eye(nc * d), q, law(0.3 * np.ones(nc))
    )


def sweep(problem, r):
    """One sweep with dense matrices."""
    r, d = r.copy(), problem.dimension
    for i in range(problem.contacts):
        own = slice(d * i, d * i + d)
        A = np.eye(3)
        A[:d, :d] = problem.W[own, own]
        others = r.copy()
        others[i] = 0
        b = np.zeros(3)
        b[:d] = problem.W[own] @ others.ravel() + problem.q[i]
        r[i] = solve_one(A, b, problem.law.at(np.array([i])))[0][:d]
    return r


@pytest.mark.parametrize("law", [Coulomb, Tresca])
@pytest.mark.parametrize("d", [2, 3])
def test_sweeps_are_those_of_the_dense_twin(d, law):
    problem = random_problem(d, law)
    expected = np.zeros((5, d))
    iterates = GaussSeidel().iterates(problem, Iterate(expected), Target(1e-8))
    for _ in range(4):
        expected = sweep(problem, expected)
        np.testing.assert_allclose(next(iterates).r, expected, atol=1e-10)


@pytest.mark.parametrize("options", [{}, {"batch": 7}, {"anderson_depth": 5}])
@pytest.mark.parametrize("law", [Coulomb, Tresca])
def test_options_lead_to_the_same_solution(options, law):
    problem = random_problem(3, law)
    reference = drive(problem, GaussSeidel(), tolerance=1e-13, max_iterations=100_000)
    other = drive(problem, GaussSeidel(**options), tolerance=1e-12, max_iterations=100_000)
    assert other.converged
    np.testing.assert_allclose(other.r, reference.r, atol=1e-8)


def test_batches_count_their_sweeps():
    iterates = GaussSeidel(batch=3).iterates(
        random_problem(), Iterate(np.zeros((5, 3))), Target(1e-8)
    )
    assert next(iterates).iterations == 3


@pytest.mark.parametrize("options", [{"batch": 0}, {"anderson_depth": -1}])
def test_options_are_checked(options):
    with pytest.raises(InvalidInput, match=next(iter(options))):
        GaussSeidel(**options)


@pytest.mark.parametrize("local", [am.LocalSolver.NEWTON, am.LocalSolver.PROJECTION])
@pytest.mark.parametrize("mu", [0.0, 0.3, 1.0])
def test_local_solvers_of_the_literature_reach_the_exact_solution(local, mu):
    problem = random_delassus(3, 12, mu=mu)
    exact = drive(problem, am.GaussSeidel(), tolerance=1e-10)
    found = drive(problem, am.GaussSeidel(local=local), tolerance=1e-10)
    assert exact.converged
    assert found.converged
    np.testing.assert_allclose(found.u, exact.u, atol=1e-8)


def test_local_newton_needs_coulomb_friction():
    problem = random_delassus(3, 4)
    tresca = am.FrictionProblem.from_delassus(problem.W, problem.q, am.Tresca(np.ones(4)))
    with pytest.raises(am.UnsupportedForm, match="NEWTON"):
        drive(tresca, am.GaussSeidel(local=am.LocalSolver.NEWTON))


@pytest.mark.parametrize("local", [am.LocalSolver.NEWTON, am.LocalSolver.PROJECTION])
def test_few_local_steps_and_a_loose_tolerance_reach_the_same_solution(local):
    problem = random_delassus(3, 12)
    exact = drive(problem, am.GaussSeidel(), tolerance=1e-10)
    for options in ({"local_steps": 3}, {"local_tolerance": 1e-2}):
        found = drive(problem, am.GaussSeidel(local=local, **options), tolerance=1e-10)
        assert found.converged
        np.testing.assert_allclose(found.u, exact.u, atol=1e-8)


def test_loose_projections_cost_less():
    problem = random_delassus(3, 12)

    def flops(**options):
        solver = am.GaussSeidel(local=am.LocalSolver.PROJECTION, **options)
        return drive(problem, solver, tolerance=1e-8).convergence.flops

    assert flops(local_steps=3) < flops()
    assert flops(local_tolerance=1e-3) < flops()


@pytest.mark.parametrize(
    "options",
    [{"local_tolerance": 0.0}, {"local_tolerance": 1.5}, {"local_steps": 0}],
)
def test_local_options_are_checked(options):
    with pytest.raises(InvalidInput, match=next(iter(options))):
        GaussSeidel(local=am.LocalSolver.NEWTON, **options)
    with pytest.raises(InvalidInput, match="exact solution"):
        GaussSeidel(**{name: 3 if name == "local_steps" else 0.1 for name in options})


# ------------------------------------------------------------------ momentum
def test_momentum_goes_on_where_it_ended():
    problem = random_delassus(3, 12, rank=20)
    whole, parts = (Momentum(sweep_data(problem), np.zeros((12, 3))) for _ in range(2))
    whole.sweep(30, watch_for(0.0))
    for _ in range(3):
        assert parts.sweep(10, watch_for(0.0))[0] == 10
    np.testing.assert_allclose(parts.r, whole.r, atol=1e-13)


def test_momentum_solves_and_ends_when_the_judge_is_content():
    problem = random_delassus(3, 12, rank=40, mu=0.3)
    memory, watch = Momentum(sweep_data(problem), np.zeros((12, 3))), watch_for(
        1e-9 * problem.q_norm)  # fmt: skip
    done, flops = memory.sweep(5000, watch)
    assert done < 5000
    assert flops > 0
    assert problem.error(memory.r) <= 1e-9
    assert watch[2] == pytest.approx(problem.error(memory.r) * problem.q_norm, rel=1e-3)


def test_momentum_keeps_the_start_that_it_was_given():
    problem, start = random_delassus(3, 12), np.zeros((12, 3))
    Momentum(sweep_data(problem), start).sweep(3, watch_for(0.0))
    assert not start.any()


def test_momentum_as_an_option():
    problem = random_delassus(3, 12, rank=40, mu=0.3)
    found = drive(problem, GaussSeidel(momentum=True, batch=20))
    assert found.converged
    np.testing.assert_allclose(found.u, drive(problem).u, atol=1e-6 * abs(found.u).max())
    with pytest.raises(InvalidInput, match="anderson_depth already"):
        GaussSeidel(momentum=True, anderson_depth=5)
    with pytest.raises(InvalidInput, match="with momentum give a number"):
        GaussSeidel(momentum=True, batch=Batch.ADAPTIVE)
