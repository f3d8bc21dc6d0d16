"""A converged solution says one thing of a contact: status and reaction agree, exactly."""

import numpy as np
import pytest

import amontons as am
from amontons.app.api import solve_any_form
from amontons.core.errors import UnsupportedForm
from amontons.problem.friction import FrictionProblem
from amontons.problem.judge.measures import Measure
from amontons.problem.law import Tresca
from amontons.problem.settling import settle, settled
from amontons.problem.status import ContactStatus, classify
from amontons.solvers import METHODS

STEEL = am.LinearElastic(young=200.0, poisson=0.3)
SOLVERS = [pytest.param(solver, id=name) for name, solver in METHODS.items()]
EPSILON = np.finfo(float).eps


def on_a_ball(cells=6, **friction):
    """A cube pressed onto a ball: half of the contacts are open."""
    ball = am.Sphere(center=(0.5, 0.5, -4.0), radius=4.0)
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=cells), STEEL)],
        [am.Fix("top", (0.001, 0.0, -0.005))],
        [am.Contact("bottom", ball, **friction)],
    )


def pair(method):
    """Two cubes, one of them tilted, so that they touch along a part of their surfaces."""
    cubes = [
        am.Body(am.box((1, 1, 1), cells=4, origin=(0, 0, z)), STEEL, name=name)
        for name, z in (("upper", 0.0), ("lower", -1.0))
    ]
    tilt = (0.002, 0.0, lambda x: 0.01 - 0.02 * x[0])
    return am.Model(
        cubes,
        [am.Fix("upper.top", tilt), am.Fix("lower.bottom", 0.0)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.3, method=method)],
    )


MODELS = {
    "nodal": on_a_ball(mu=0.4),
    "tresca": on_a_ball(tresca=2.0),
    "pair": pair("nodal"),
    "mortar": pair("mortar"),
}


def check(solution):
    """Reactions keep to their statuses, and the judge has seen these reactions."""
    r, status, law = solution.r, solution.status, solution.problem.law
    is_open = status == ContactStatus.OPEN
    assert not r[is_open, 0].any()
    assert (r[~is_open, 0] > 0).all()
    shear = np.linalg.norm(r[:, 1:], axis=1)
    assert (shear <= law.bound(r) * (1 + 8 * EPSILON))[is_open].all()
    if not isinstance(law, Tresca):
        assert not r[is_open].any()
    v = solution.v
    assert solution.problem.error(r, v) <= solution.convergence.tolerance


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_reactions_keep_to_their_statuses(solver, name):
    try:
        solution = solve_any_form(MODELS[name], solver(), time_limit=3)
    except UnsupportedForm:  # some methods are made for Coulomb's cone and say so
        return
    if solution.converged:
        check(solution.solution)
        assert solution.counts["open"] > 4


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_area_under_pressure_is_that_of_the_closed_contacts(scale):
    """Contact multigrid judged by residuals, whose reactions are the forces left at nodes."""
    ball = am.Sphere(center=(0.5, 0.5, -4.0), radius=4.0)
    model = am.Model(
        [am.Body(am.box((1, 1, 1), cells=16), am.LinearElastic(200.0 * scale, 0.3))],
        [am.Fix("top", (0.0, 0.0, -0.005))],
        [am.Contact("bottom", ball, mu=0.4)],
    )
    solution = am.solve(model, am.ContactMultigrid())
    assert solution.convergence.measure is Measure.RESIDUAL
    check(solution.solution)
    assert (solution.pressure > 0).sum() == (solution.status != ContactStatus.OPEN).sum()


def test_a_method_for_the_other_form_tells_the_same_statuses():
    solution = am.solve(MODELS["nodal"], am.SmoothingNewton())
    check(solution.solution)


def test_large_deformations():
    model = am.Model(
        [am.Body(am.box((2, 1), cells=(12, 6)), am.NeoHookean(young=1.0, poisson=0.3))],
        [am.Fix("top", (0.1, -0.1))],
        [am.Contact("bottom", am.Sphere(center=(1, -2.0), radius=2.0), mu=0.3)],
    )
    solution = am.solve(model)
    r, is_open = solution.r, solution.status == ContactStatus.OPEN
    assert is_open.any()
    assert not is_open.all()
    assert not r[is_open].any()
    assert (r[~is_open, 0] > 0).all()


def test_points_of_a_followed_curve():
    model = on_a_ball(4, mu=0.4)
    branch = am.follow(model, interval=(0.5, 1.0), max_points=5)
    for solution in branch.solutions:
        assert solution.converged
        check(solution)


@pytest.mark.parametrize("law", [[0.4] * 40, Tresca([0.4] * 40), [0.0] * 40])
@pytest.mark.parametrize("d", [2, 3])
def test_the_statuses_are_those_of_classify(law, d):
    random = np.random.default_rng(1)
    W = np.diag(random.uniform(0.5, 2.0, 40 * d))
    problem = FrictionProblem.from_delassus(W, np.ones((40, d)), law)
    r, u = random.standard_normal((2, 40, d))
    found = settle(problem.law, problem.rho, r, u)
    status, sliding, _ = classify(problem, r, u)
    np.testing.assert_array_equal(found.status, status)
    np.testing.assert_array_equal(found.sliding, sliding)
    (u, _), found = settled(problem.law, problem.rho, r, problem.velocity)
    assert not settle(problem.law, problem.rho, found.r, u).changed
