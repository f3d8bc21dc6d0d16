"""The judge: its NumPy twin, its independence of units and frames, and its special cases."""

import numpy as np
import pytest
from scipy import sparse

from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.problem.friction import FrictionProblem
from amontons.problem.judge import measures as judge
from amontons.problem.judge.measures import Measure, scaled_residual
from amontons.problem.law import Coulomb, Tresca
from amontons.solvers import GaussSeidel, Iterate
from amontons.solvers.driver import drive, drive_from


def random_local(seed=0, nc=6, d=3, law=Coulomb):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((nc * d, nc * d))
    W = root @ root.T / (nc * d) + np.eye(nc * d)
    problem = FrictionProblem.from_delassus(
        W, rng.standard_normal((nc, d)), law(0.8 * rng.random(nc))
    )
    return problem, rng.standard_normal((nc, d))


def twin(problem, r):
    """The exact measure written with dense NumPy."""
    nc, d = r.shape
    u = (problem.W @ r.ravel()).reshape(r.shape) + problem.q
    own = problem.W.reshape(nc, d, nc, d)[np.arange(nc), :, np.arange(nc), :]
    rho = 1 / np.linalg.norm(own, 2, axis=(1, 2))
    residual = problem.law.natural_map(r, u, rho) / rho[:, None]
    return np.linalg.norm(residual) / np.linalg.norm(problem.q)


@pytest.mark.parametrize("law", [Coulomb, Tresca])
@pytest.mark.parametrize("d", [2, 3])
def test_compiled_and_numpy_agree(d, law):
    for seed in range(50):
        problem, r = random_local(seed, d=d, law=law)
        assert problem.error(r) == pytest.approx(twin(problem, r), rel=1e-12)
        u = problem.velocity(r)[0]
        size = judge.scaled_residual(r, u, problem.law, problem.rho)
        assert problem.error(r) == pytest.approx(size / problem.q_norm, rel=1e-12)


@pytest.mark.parametrize("law", [Coulomb, Tresca])
@pytest.mark.parametrize("force", [1e-9, 1e9])
@pytest.mark.parametrize("length", [1e-9, 1e9])
def test_units_do_not_matter(force, length, law):
    problem, r = random_local(1, law=law)
    number = problem.law.coefficient * (force if law is Tresca else 1)
    other = FrictionProblem.from_delassus(
        problem.W * (length / force), problem.q * length, law(number)
    )
    assert other.error(force * r) == pytest.approx(problem.error(r), rel=1e-10)


def test_order_and_tangent_axes_do_not_matter():
    problem, r = random_local(2)
    rng = np.random.default_rng(3)
    order = rng.permutation(6)
    index = (3 * order[:, None] + np.arange(3)).ravel()
    shuffled = FrictionProblem.from_delassus(
        problem.W[np.ix_(index, index)], problem.q[order], problem.mu[order]
    )
    assert shuffled.error(r[order]) == pytest.approx(problem.error(r), rel=1e-12)
    turn = np.zeros((18, 18))
    for i, t in enumerate(rng.uniform(0, 6, 6)):
        c, s = np.cos(t), np.sin(t)
        turn[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    turned = FrictionProblem.from_delassus(
        turn @ problem.W @ turn.T, turn @ problem.q.ravel(), problem.mu
    )
    assert turned.error((turn @ r.ravel()).reshape(6, 3)) == pytest.approx(problem.error(r))


def test_planar_is_embedded_in_space():
    problem, r = random_local(4, d=2)
    W = np.zeros((6, 3, 6, 3))
    W[:, :2, :, :2] = problem.W.reshape(6, 2, 6, 2)
    W[np.arange(6), 2, np.arange(6), 2] = W[np.arange(6), 1, np.arange(6), 1]
    flat = np.column_stack([problem.q, np.zeros(6)])
    solid = FrictionProblem.from_delassus(W.reshape(18, 18), flat, problem.mu)
    assert solid.error(np.column_stack([r, np.zeros(6)])) == pytest.approx(problem.error(r))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite_is_infinitely_wrong(bad):
    problem, r = random_local(5)
    for k in range(3):
        wrong = r.copy()
        wrong[2, k] = bad
        assert problem.error(wrong) == np.inf


def test_a_contact_that_can_not_react():
    W = np.zeros((6, 6))
    W[3:, 3:] = np.eye(3)
    problem = FrictionProblem.from_delassus(W, [[1, 0, 0], [-1, 0, 0]], [0.5, 0.5])
    assert problem.error(np.array([[0, 0, 0], [1.0, 0, 0]])) == 0
    assert problem.error(np.array([[1e-9, 0, 0], [1.0, 0, 0]])) == np.inf
    closed = problem.with_load([[-1, 0, 0], [-1, 0, 0]])
    assert closed.error(np.array([[0, 0, 0], [1.0, 0, 0]])) == pytest.approx(1 / np.sqrt(2))


def test_without_load_only_zero_is_right():
    problem = FrictionProblem.from_delassus(np.eye(3), [[0, 0, 0]], [0.5])
    assert problem.error(np.zeros((1, 3))) == 0
    assert problem.error(np.full((1, 3), 1e-30)) == np.inf


def residual_pair():
    """A global problem judged by its residual, and the same one judged exactly."""
    rng = np.random.default_rng(6)
    M = sparse.diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(60, 60))
    H = sparse.random_array((60, 15), density=0.1, rng=rng)
    w = rng.standard_normal((5, 3)) - [1, 0, 0]
    problem = FrictionProblem.from_global(M, H, rng.standard_normal(60), w, [0.3] * 5)
    large = FrictionProblem.from_global(M, H, problem.f, w, [0.3] * 5)
    large.__dict__["measure"] = Measure.RESIDUAL
    return problem, large


def test_residual_and_exact_measures_agree_on_right_and_wrong():
    exact, residual = residual_pair()
    assert exact.measure is Measure.EXACT
    r = drive(exact.condensed(), GaussSeidel(), tolerance=1e-13, max_iterations=5000).r
    v = exact.velocity(r)[1]
    assert exact.error(r) < 1e-12
    assert residual.error(r, v) < 1e-11
    assert residual.error(r) < 1e-11  # it finds v by itself
    wrong = 1.1 * r
    assert exact.error(wrong) > 1e-3
    assert residual.error(wrong) > 1e-3
    assert residual.error(r, 1.1 * v) > 1e-3  # out of balance
    assert residual.error(r, np.full(60, np.nan)) == np.inf


def test_each_measure_tests_the_balance_of_the_motion_that_it_is_given():
    """A v that reactions and loads do not hold is no solution, though r alone would be one."""
    for problem in residual_pair():
        r = drive(problem.condensed(), GaussSeidel(), tolerance=1e-13, max_iterations=5000).r
        v = problem.velocity(r)[1]
        assert problem.error(r, v) < 1e-11
        assert problem.certain_error(r, v) < 1e-11
        for wrong in (0 * v, 1.1 * v, v + 1e-3 * np.eye(60)[7]):
            off = np.linalg.norm(problem.M @ (wrong - v)) / np.linalg.norm(problem.f)
            assert problem.error(r, wrong) >= 0.99 * off
            assert problem.certain_error(r, wrong) >= 0.99 * off
        assert problem.error(r, np.full(60, np.nan)) == np.inf
        assert problem.error(r, 1e200 * v) > 1e100
        with pytest.raises(InvalidInput, match=r"v: expected shape \(60,\), got \(59,\)"):
            problem.error(r, v[:59])


def test_no_contact_force_is_no_solution_while_the_body_is_out_of_balance():
    """The bodies move away: r = 0 solves, but not with a motion that is another one's."""
    M, H = sparse.csc_array(np.eye(4)), sparse.csc_array(np.eye(4)[:, :2])
    problem = FrictionProblem.from_global(M, H, [1.0, 0, 0, 1], [[0.0, 0]], [0.5])
    assert problem.measure is Measure.EXACT
    rest = np.zeros((1, 2))
    assert problem.error(rest) == problem.error(rest, np.array([1.0, 0, 0, 1])) == 0
    assert problem.error(rest, np.array([1.0, 0, 0, 0])) == pytest.approx(2**-0.5)
    still = Iterate(rest, np.zeros(4))
    for run in (drive(problem, start=still), drive_from(still, problem)):
        assert run.converged
        assert run.v == pytest.approx([1, 0, 0, 1])
    errors = [step.error for step in run.convergence.history]
    assert errors[0] == pytest.approx(1)  # judged with the v of the start
    assert errors[-1] == 0


def test_a_problem_without_v_takes_none():
    problem, r = random_local()
    with pytest.raises(UnsupportedForm, match="v: .* local form"):
        problem.error(r, np.zeros(18))


@pytest.mark.parametrize("stiff", [1.0, 1e6, 1e12])
def test_rounding_of_stiff_bodies_is_no_imbalance(stiff):
    """M v loses digits beside a small load; the motion that a factor gives is in balance."""
    rng = np.random.default_rng(3)
    M = sparse.block_diag([sparse.eye_array(4), stiff * np.array([[2.0, -1], [-1, 2]])])
    tie = rng.standard_normal((6, 6))
    turn = np.linalg.qr(tie)[0]
    M, H = turn @ M.toarray() @ turn.T, rng.standard_normal((6, 2))
    problem = FrictionProblem.from_global(
        sparse.csc_array((M + M.T) / 2), sparse.csc_array(H), turn[:, 0], [[-1.0, 0]], [0.5]
    )
    r = drive(problem.condensed(), GaussSeidel(), tolerance=1e-12).r
    assert problem.error(r, problem.velocity(r)[1]) < 1e-11
    assert problem.error(r, 1.1 * problem.velocity(r)[1]) > 0.05


def test_loads_by_gaps_alone_have_a_balance_too():
    M, H = sparse.csc_array(np.diag([2.0, 2, 1])), sparse.csc_array(np.eye(3)[:, :2])
    problem = FrictionProblem.from_global(M, H, np.zeros(3), [[-1.0, 0]], [0.5])
    r = np.array([[2.0, 0]])
    v = np.array([1.0, 0, 0])
    assert problem.error(r, v) < 1e-15
    assert problem.error(r, (1 + 1e-6) * v) == pytest.approx(1e-6, rel=1e-3)
    assert problem.error(r, v + [0, 0, 1e-6]) == pytest.approx(0.5e-6, rel=1e-3)


@pytest.mark.parametrize("force", [1e-9, 1e9])
def test_residual_measure_is_free_of_units(force):
    _, problem = residual_pair()
    r, v = np.random.default_rng(7).random((5, 3)), np.random.default_rng(8).random(60)
    other = FrictionProblem.from_global(
        force * problem.M, force * problem.H, force * problem.f, problem.w * force, [0.3] * 5
    )
    other.__dict__["measure"] = Measure.RESIDUAL
    # H^T maps v to u: H scaled by `force` makes u `force` times larger at equal r and v
    assert other.error(r, v) == pytest.approx(problem.error(r, v), rel=1e-9)


def test_reported_numbers():
    law = Coulomb([0.5])
    r, u = np.array([[2.0, 3.0, 4.0]]), np.array([[-0.5, 0.0, 0.0]])
    assert judge.max_penetration(u) == 0.5
    assert judge.max_penetration(-u) == 0
    assert judge.max_cone_violation(r, law) == 4
    assert judge.max_cone_violation(np.array([[-2.0, 0, 0]]), law) == 2
    assert judge.max_cone_violation(np.zeros((0, 3)), Coulomb([])) == 0
    assert (
        judge.published_fclib_error(np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3)), law)
        == 0
    )
    one = np.array([[1.0, 0, 0]])
    assert judge.published_fclib_error(one, one, 2 * one, law) == pytest.approx(0.5)


@pytest.mark.parametrize("mu", [1e3, 1e6, 1e9])
def test_penetration_is_never_forgiven_for_a_huge_mu(mu):
    problem = FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0.5]], [mu])
    assert problem.error(np.zeros((1, 2))) > 0.4
    law = Coulomb([mu])
    assert scaled_residual(np.zeros((1, 2)), np.array([[-1.0, 0.5]]), law, np.ones(1)) >= 0.5


def test_a_contact_without_normal_compliance_still_obeys_tresca():
    problem = FrictionProblem.from_delassus(np.diag([0.0, 1.0]), [[1.0, 1.0]], Tresca([0.5]))
    assert problem.error(np.zeros((1, 2))) > 0.1
    assert problem.error(np.array([[0.0, -0.5]])) < 1e-15
