"""Every solver on every small problem: what is called converged obeys the law."""

import numpy as np
import pytest

from amontons.core.errors import UnsupportedForm
from amontons.mechanics.ready import gallery
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.law import Tresca
from amontons.problem.solution import Outcome
from amontons.solvers import METHODS, GaussSeidel
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive

SOLVERS = [pytest.param(solver, id=name) for name, solver in METHODS.items()]
TOLERANCE = 1e-8


def with_load(problem, normal):
    """The problem with every q_N replaced: positive opens contacts, negative closes them."""
    q = np.array(problem.q)
    q[:, 0], q[:, 1:] = normal, 0.01 * q[:, 1:]
    return problem.with_load(q)


def diagonal(d, normal, tangential, mu):
    return FrictionProblem.from_delassus(
        2 * np.eye(3 * d), np.tile([normal, tangential, 0][:d], (3, 1)), np.full(3, mu)
    )


PROBLEMS = {
    "planar": gallery.random_delassus(1, 6, 2, mu=0.3),
    "spatial": gallery.random_delassus(2, 6, 3, mu=0.3),
    "rank-deficient": gallery.random_delassus(3, 6, 3, rank=9, mu=0.3),
    "frictionless": gallery.random_delassus(4, 6, 3, mu=0.3).with_mu(0.0),
    "open": with_load(gallery.random_delassus(5, 6, 3, mu=0.3), 1.0),
    "stuck": diagonal(3, -1.0, 0.1, 0.5),
    "sliding": diagonal(3, -1.0, 5.0, 0.5),
    "sliding-planar": diagonal(2, -1.0, -5.0, 0.5),
    "one": diagonal(3, -1.0, 5.0, 0.5).condensed(),
}


def law_violation(problem, r):
    """The disjunctive Coulomb law, relative to the sizes of u and r."""
    W = problem.W if isinstance(problem.W, np.ndarray) else problem.W.toarray()
    u = (W @ r.ravel()).reshape(r.shape) + problem.q
    length, force = np.linalg.norm(problem.q), max(np.linalg.norm(r), 1e-300)
    normal, slip = r[:, 0] / force, u[:, 1:] / length
    pull = np.linalg.norm(r[:, 1:], axis=1) / force
    opposed = (
        np.linalg.norm(slip, axis=1)[:, None] * r[:, 1:] / force
        + (problem.mu * normal)[:, None] * slip
    )
    return max(
        -normal.min(),
        -u[:, 0].min() / length,
        np.abs(np.minimum(normal, u[:, 0] / length)).max(),
        (pull - problem.mu * normal).max(),
        np.abs(opposed).max(),
    )


def as_global(problem):
    """The same problem with M = 1 and W = H^T H, for solvers of the global form."""
    values, vectors = np.linalg.eigh(problem.W)
    H = (vectors * np.sqrt(np.maximum(values, 0))).T
    return FrictionProblem.from_global(
        np.eye(len(H)), H, np.zeros(len(H)), problem.q, problem.law
    )


def ask(solver, problem, **options):
    """Solve in the form that the solver takes."""
    given = as_global(problem) if solver.form is Form.GLOBAL else problem
    return drive(
        given, solver(), **{"tolerance": TOLERANCE, "max_iterations": 20_000} | options
    )


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_converged_means_the_law_holds(solver, name):
    problem = PROBLEMS[name]
    solution = ask(solver, problem, time_limit=20)
    if solution.converged:
        assert problem.error(solution.r) <= TOLERANCE
        assert law_violation(problem, solution.r) < 100 * TOLERANCE
    else:
        assert solution.convergence.error > TOLERANCE
    if solver in (METHODS.get("auto"), GaussSeidel):
        assert solution.converged, str(solution)


@pytest.mark.parametrize("solver", SOLVERS)
def test_tresca_friction(solver):
    problem = PROBLEMS["spatial"]
    given = FrictionProblem.from_delassus(problem.W, problem.q, Tresca(np.full(6, 0.2)))
    try:
        solution = ask(solver, given, time_limit=20)
    except UnsupportedForm:  # some methods are made for Coulomb's cone and say so
        return
    if solution.converged:
        assert given.error(solution.r) <= TOLERANCE
        assert (np.linalg.norm(solution.r[:, 1:], axis=1) <= 0.2 + 1e-6).all()


@pytest.mark.parametrize("mu", [0.5, 1.0, 1.2, 2.0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_one_contact_with_one_or_three_solutions(solver, mu):
    """At mu = 2: open, stick (5/3, -7/3) and slip (1/3, -2/3); below, only open."""
    solutions = [(0, 0)] + [(5 / 3, -7 / 3), (1 / 3, -2 / 3)] * (mu == 2.0)
    problem = gallery.one_contact_2d(mu)
    for r in solutions:
        assert problem.error(np.array([r])) < 1e-14
    for start in ((0, 0), (3, -4), (0.3, -0.6), (1, 1)):
        solution = ask(solver, problem, start=Iterate(np.array([start], dtype=float)))
        if solution.convergence.outcome is Outcome.CONVERGED:
            assert min(np.abs(solution.r - r).max() for r in solutions) < 1e-6
