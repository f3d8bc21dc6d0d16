"""The primal-dual accelerated gradient method: its projection, metrics, restarts and forms."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.mechanics.ready import gallery
from amontons.problem.law import Coulomb, Tresca
from amontons.problem.law.cones import project_cone, project_disk
from amontons.solvers import Iterate, Target
from amontons.solvers.gradient.accelerated import projected_step
from amontons.solvers.gradient.motion import _Identity, _Modes


def global_problem(seed=0, nc=4, d=3, mu=0.4):
    """A random problem whose M is no unit matrix and has more unknowns than contacts."""
    rng = np.random.default_rng(seed)
    n = nc * d + 5
    root = rng.standard_normal((n, n)) / np.sqrt(n)
    H = np.eye(n)[:, : nc * d] + 0.1 * rng.standard_normal((n, nc * d))
    f = rng.standard_normal(n)
    return am.FrictionProblem.from_global(
        root @ root.T + 0.5 * np.eye(n), H, f, 0.1 * rng.standard_normal((nc, d)),
        np.full(nc, mu),
    )  # fmt: skip


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("tresca", [False, True])
def test_projected_step_is_the_projection_of_cones(d, tresca):
    rng = np.random.default_rng(d)
    r, ahead, u = rng.standard_normal((3, 400, d))
    alpha, bound = rng.uniform(0.1, 2, 400), rng.uniform(0, 2, 400)
    bound[:20] = 0
    x = r - alpha[:, None] * ahead
    if tresca:
        expected = np.column_stack([np.maximum(x[:, 0], 0), project_disk(x[:, 1:], bound)])
    else:
        x[:, 0] -= alpha * bound * np.linalg.norm(u[:, 1:], axis=1)
        expected = project_cone(x, bound)
    law = (Tresca if tresca else Coulomb)(bound)
    found = projected_step(r, alpha, ahead, u, law.kind, law.parameters)
    assert found == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("metric", list(am.Metric))
@pytest.mark.parametrize("restart", list(am.Restart))
def test_every_variant_finds_the_solution_of_gauss_seidel(metric, restart):
    problem = global_problem()
    expected = am.solve(problem.condensed(), am.GaussSeidel(), tolerance=1e-10).r
    assert np.abs(expected).max() > 0.1
    method = am.AcceleratedGradient(metric=metric, restart=restart)
    found = am.solve(problem, method, tolerance=1e-5, max_iterations=20_000)
    assert found.r == pytest.approx(expected, abs=1e-3)
    balance = problem.M @ found.v - problem.H @ found.r.ravel() - problem.f
    assert np.abs(balance).max() < 1e-9


def test_restarts_save_most_iterations():
    problem = gallery.random_delassus(0, 6, 3, mu=0.3)
    count = {
        restart: am.solve(problem, am.AcceleratedGradient(restart=restart)).convergence
        for restart in am.Restart
    }
    assert 2 * count[am.Restart.ADAPTIVE].iterations < count[am.Restart.NEVER].iterations


def test_both_forms_take_the_same_steps():
    problem = global_problem()
    start = Iterate(np.zeros((4, 3)))
    kinds = [am.AcceleratedGradient().iterates(p, start, Target(1e-8))
             for p in (problem, problem.condensed())]  # fmt: skip
    rho = problem.rho / problem.condensed().rho
    assert np.abs(rho - 1).max() > 0.01  # another weight of contacts: not the same path, but
    last = [[next(kind) for _ in range(300)][-1] for kind in kinds]
    assert last[0].r == pytest.approx(last[1].r, abs=1e-6)


def test_modes_step_like_a_factor_in_every_iteration():
    problem, r = global_problem(), np.ones((4, 3))
    one, two = _Identity(problem), _Modes(problem)
    v = np.linspace(-1, 1, problem.unknowns)
    x, y = one.start(r, v), two.start(r, v)
    for beta in (3.0, 0.2):
        x, y = one.step(x, one.load(r), beta), two.step(y, two.load(r), beta)
    dense = problem.M.toarray()
    assert two.v(y) == pytest.approx(x)
    assert two.u(y) == pytest.approx(one.u(x))
    assert two.response(two.load(r)) == pytest.approx(problem.velocity(r)[0])
    assert one.omega == pytest.approx(np.linalg.eigvalsh(dense)[0], rel=1e-2)
    assert two.omega == pytest.approx(np.linalg.eigvalsh(dense)[0])
    assert one.gamma_squared == pytest.approx(np.linalg.norm(problem.H.toarray(), 2) ** 2)


def test_a_loose_body_needs_the_published_metric():
    """Two masses joined by a spring, pushed onto an obstacle that alone holds them."""
    M = sparse.csc_array([[1.0, 0, -1, 0], [0, 1, 0, -1], [-1, 0, 1, 0], [0, -1, 0, 1]])
    H = np.eye(4)[:, :2]
    problem = am.FrictionProblem.from_global(
        M, H, [0, 0, -1.0, 0.2], np.zeros((1, 2)), [0.5], u_scale=1.0
    )
    method = am.AcceleratedGradient(metric=am.Metric.IDENTITY, restart=am.Restart.NEVER)
    found = am.drive(problem, method, tolerance=1e-6, max_iterations=50_000)
    assert found.converged
    assert found.r == pytest.approx(np.array([[1.0, -0.2]]), abs=1e-5)
    assert am.drive(problem, am.AcceleratedGradient()).convergence.outcome.name == "BREAKDOWN"


def test_bad_options_are_refused():
    with pytest.raises(InvalidInput, match="alpha"):
        am.AcceleratedGradient(alpha=0.0)
    with pytest.raises(InvalidInput, match="batch"):
        am.AcceleratedGradient(batch=0)
    with pytest.raises(UnsupportedForm, match="IDENTITY"):
        am.drive(
            gallery.one_contact_2d(1.0).with_load([[-0.2, 1.0]]),
            am.AcceleratedGradient(metric=am.Metric.IDENTITY),
        )
