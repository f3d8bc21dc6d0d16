"""The contactwise error: no contact is lost beside another, in any unit of its own."""

import decimal
import json
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

import amontons as am
from amontons.io import results as output
from amontons.problem.judge import measures as judge
from amontons.problem.judge.measures import Measure
from amontons.problem.judge.sharp import sharp_error
from amontons.problem.solution import Outcome
from amontons.solvers.contract import Breakdown, Iterate
from amontons.solvers.driver import drive


def random_problem(seed, nc=4, d=3):
    random = np.random.default_rng(seed)
    A = random.standard_normal((nc * d, nc * d + 2))
    W, q = A @ A.T / (nc * d), random.standard_normal((nc, d))
    return am.FrictionProblem.from_delassus(W, q, random.uniform(0, 1.5, nc))


def rescaled(problem, sizes):
    """The same problem with the velocities of contact i in units 1 / sizes[i]."""
    S = np.repeat(sizes, problem.dimension)
    return am.FrictionProblem.from_delassus(
        S[:, None] * problem.W * S, S.reshape(problem.q.shape) * problem.q, problem.law
    )


def oracle(problem, r):
    """The contactwise error, contact by contact."""
    nc, d = r.shape
    worst = []
    for i in range(nc):
        rows = problem.W.reshape(nc, d, nc, d)[i]
        parts = [rows[:, j] @ r[j] for j in range(nc)]
        u = problem.q[i] + sum(parts)
        rho = 1 / np.linalg.norm(rows[:, i], 2)
        z = problem.law.at([i]).natural_map(r[i : i + 1], u[None], np.array([rho])) / rho
        scale = np.linalg.norm(problem.q[i]) + sum(map(np.linalg.norm, parts))
        worst.append(max(np.linalg.norm(z), -0.5 * u[0]) / scale)
    return max(worst), int(np.argmax(worst))


@given(st.integers(0, 10**6), st.sampled_from([2, 3]))
def test_measure(seed, d):
    problem = random_problem(seed, d=d)
    r = np.random.default_rng(seed + 1).standard_normal((4, d))
    found = problem.weakest(r)
    error, contact = oracle(problem, r)
    assert found.error == pytest.approx(error, rel=1e-12)
    assert found.contact == contact
    u = problem.velocity(r)[0]
    scale = judge.residual_sizes(r, u, problem.law, problem.rho)
    assert judge.weakest_of(r, u, problem.law, problem.rho, scale).error == pytest.approx(1)


@given(st.integers(0, 10**6))
def test_units_of_a_contact_do_not_matter(seed):
    problem = random_problem(seed)
    random = np.random.default_rng(seed + 1)
    r, sizes = random.standard_normal((4, 3)), 10.0 ** random.uniform(-9, 9, 4)
    a = problem.weakest(r)
    b = rescaled(problem, sizes).weakest(r / sizes[:, None])
    assert b.error == pytest.approx(a.error, rel=1e-9)
    assert b.contact == a.contact


@pytest.mark.parametrize("large", [1e8, 1e9, 1e15])
def test_small_load_beside_a_large_one(large):
    problem = am.FrictionProblem.from_delassus(np.eye(4), [[-1, 0.5], [large, 0]], [0.3, 0.3])
    found = am.solve(problem)
    np.testing.assert_allclose(found.r, [[1, -0.3], [0, 0]], rtol=1e-4, atol=0)
    assert found.convergence.contact_error <= 1e-4
    sum_only = am.solve(problem, contact_tolerance=np.inf)
    assert not sum_only.r.any()
    assert sum_only.convergence.contact_error > 0.1
    assert sum_only.convergence.weakest == 0


@given(st.integers(0, 10**6))
def test_every_contact_is_solved_in_units_of_its_own(seed):
    problem = random_problem(seed)
    sizes = 10.0 ** np.random.default_rng(seed + 1).uniform(-9, 9, 4)
    found = drive(rescaled(problem, sizes), time_limit=5)
    if found.converged:
        assert oracle(problem, found.r * sizes[:, None])[0] <= 1.01e-4


class Loose:
    """Yields one reaction again and again."""

    form = am.Form.ANY

    def __init__(self, r, v=None, last=None):
        self.iterate, self.last = Iterate(np.array(r), v), last

    def iterates(self, problem, start, target):
        yield self.iterate
        if self.last is not None:
            raise self.last


@pytest.mark.parametrize("last", [None, FloatingPointError("overflow"), Breakdown("stuck")])
def test_named_outcome(last):
    problem = am.FrictionProblem.from_delassus(np.eye(4), [[-1, 0], [1e9, 0]], [0.3, 0.3])
    found = drive(problem, Loose(np.zeros((2, 2)), last=last))
    assert found.convergence.outcome is Outcome.WEAK_CONTACTS
    assert "contact 0" in found.convergence.detail
    assert found.convergence.error <= 1e-8
    assert ", contact 0 " in str(found.convergence)
    data = output.summary(output.Output(found))
    assert data["outcome"] == "weak_contacts"
    assert data["contact_error"] == pytest.approx(1 / (1 + 0.3**2) ** 0.5, rel=0.1)
    assert data["weakest"] == 0
    json.dumps(data, allow_nan=False)


class Steady:
    """Sweeps that go on to the goal that they are told."""

    form = am.Form.DELASSUS

    def __init__(self, goes_on):
        self.goes_on, self.starts, self.goals = goes_on, 0, []

    def iterates(self, problem, start, target):
        self.starts += 1
        for iterate in am.GaussSeidel(batch=1).iterates(problem, start, target):
            judged = yield replace(iterate, goes_on=self.goes_on)
            self.goals.append(judged.goal)


def test_a_method_that_goes_on_is_not_started_again():
    sizes = np.array([1.0, 1e-2, 1e-3, 1.0])  # loads: a weak contact lags behind
    problem = random_problem(3)
    problem = am.FrictionProblem.from_delassus(
        problem.W, problem.q * sizes[:, None], problem.law
    )
    again, on = Steady(False), Steady(True)
    for solver in (again, on):
        found = drive(problem, solver, tolerance=1e-2, contact_tolerance=1e-6)
        assert found.converged
        assert found.convergence.contact_error <= 1e-6
    assert on.starts == 1 < again.starts
    assert on.goals[-1] < on.goals[0] == 1e-2


def test_rounding_of_a_load_that_cancels_is_no_error():
    """Two loads that hold each other but for rounding leave a q of rounding alone."""
    M = sparse.diags_array([1.0, 1e6])
    H = sparse.csc_array(np.array([[1.0, 0, 0, 0], [0, 0, 1, 0]]))
    w = np.array([[-1.0 / 3, 0], [-1e-6, 0]])
    problem = am.FrictionProblem.from_global(M, H, [1.0 / 3, 1.0], w, [0.0, 0.0])
    r = np.array([[1e-17, 0], [0.0, 0]])
    local = problem.condensed()
    assert local.weakest(r).error < 1e-2
    bare = am.FrictionProblem.from_delassus(local.W, local.q, [0, 0])
    assert bare.weakest(np.array([[1e-17, 0], [0.0, 0]])).error == pytest.approx(1)


def exact_error(problem, r):
    """The error of r in 100 digits."""
    with decimal.localcontext(prec=100):
        return _exact_error(problem, r)


def _exact_error(problem, r):
    nc, d = r.shape
    R = [Decimal(float(x)) for x in r.ravel()]
    q = [Decimal(float(x)) for x in problem.q.ravel()]
    rows = [[Decimal(float(x)) for x in row] for row in problem.W]
    u = [sum((a * x for a, x in zip(row, R, strict=True)), b)
         for row, b in zip(rows, q, strict=True)]  # fmt: skip
    total = Decimal(0)
    for i in range(nc):
        own = slice(d * i, d * i + d)
        rho, mu = 1 / Decimal(float(np.linalg.norm(problem.W[own, own], 2))), problem.mu[i]
        mu = Decimal(float(mu))
        slip = sum(x * x for x in u[own][1:]).sqrt()
        hat = [u[own][0] + mu * slip, *u[own][1:]]
        x = [a - rho * b for a, b in zip(R[own], hat, strict=True)]
        t = sum(y * y for y in x[1:]).sqrt()
        if t <= mu * x[0]:
            p = x
        elif mu * t <= -x[0]:
            p = [Decimal(0)] * d
        else:
            along = (x[0] + mu * t) / (1 + mu * mu)
            p = [along, *(mu * along * y / t for y in x[1:])]
        size = sum(((a - b) / rho) ** 2 for a, b in zip(R[own], p, strict=True))
        total += max(size, (min(u[own][0], Decimal(0)) / 2) ** 2)
    return float(total.sqrt() / sum(x * x for x in q).sqrt())


@pytest.mark.parametrize("mu", [1e3, 1e7, 1e8, 1e9, 1e12, 1e14, 1e20])
def test_huge_friction_hides_no_error(mu):
    """The rounding of the slip of a contact that sticks counts mu times."""
    random = np.random.default_rng(3)
    for d in (2, 3, 3, 2, 2, 3):
        A = random.standard_normal((2 * d, 2 * d + 2))
        q = random.standard_normal((2, d))
        problem = am.FrictionProblem.from_delassus(A @ A.T, q, [mu, mu])
        found = drive(problem, time_limit=1)
        error = exact_error(problem, found.r)
        # 3e-13: what rounding leaves of a sum of such numbers, far too small to matter
        assert found.convergence.error >= error * (1 - 1e-6) - 3e-13
        assert error <= 1e-8 or not found.converged
        if not found.converged:
            assert "rounding" in found.convergence.detail


@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.3, 2.0, 1e9]))
def test_sharp_error(seed, mu):
    problem = random_problem(seed, nc=3).with_mu(mu)
    r = np.random.default_rng(seed + 1).standard_normal((3, 3))
    sharp, hidden = sharp_error(*problem.kernel_data, r)
    assert sharp / problem.q_norm == pytest.approx(exact_error(problem, r), rel=1e-12)
    assert hidden <= 1e-14 * sharp + 1e-14


def loose_block(push, cells=2):
    body = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(200, 0.3))
    return am.Model(
        [body], [am.Fix("bottom", (None, push, None))],
        [am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.2)],
        [am.Traction("top", (0, 0, -100.0))],
    )  # fmt: skip


def test_no_body_is_out_of_balance():
    """Forces of a prescribed motion are no excuse for leaving a load without reaction."""
    problem = loose_block(1.0).assemble()
    assert problem.loose_modes.shape[1] > 0
    rest = np.zeros((problem.contacts, 3))
    assert problem.unbalanced(rest) == pytest.approx(1)
    assert problem.error(rest, problem.guess) == pytest.approx(1)
    r = rest.copy()
    r[:, 0] = 100 / len(r)
    assert problem.measure is Measure.RESIDUAL
    assert problem.unbalanced(r) < 1


@pytest.mark.parametrize("load", [am.Pressure("top", 1.0), am.Traction("top", (0, -1.0))],
                         ids=["follows", "dead"])  # fmt: skip
def test_stresses_and_loads_that_follow_are_no_loss_of_balance(load):
    """Tangents of a pressed block: turning it takes no energy, but moves what presses on it."""
    block = am.Body(am.box((1, 1), 2), am.SaintVenantKirchhoff(100.0, 0.3))
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.5)
    found = am.solve(am.Model([block], [], [floor], [load])).solution
    assert found.problem.loose_modes.shape[1] > 0
    assert found.problem.error(found.r, found.v) < 1e-10


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8])
@pytest.mark.parametrize("push", [1.0, 1e-2, 1e-4])
def test_pushed_block_that_contact_alone_holds(push, tolerance):
    found = am.solve(loose_block(push), tolerance=tolerance, time_limit=20)
    _, side, normal = found.resultant
    assert normal == pytest.approx(100, rel=tolerance)  # what contact alone can carry
    assert -20 * (1 + tolerance) <= side < -1
    assert np.hypot(*found.r[:, 1:].T).sum() == pytest.approx(20, rel=3 * tolerance**0.5)


@pytest.mark.parametrize("solver", [am.SemismoothNewton(), am.ContactMultigrid(),
                                    am.ActiveSet(), am.GaussSeidel(), am.Uzawa(), None],
                         ids=lambda s: type(s).__name__)  # fmt: skip
@pytest.mark.parametrize("push", [1e-2, 1e-4])
def test_pushed_contact_nodes_of_a_held_block(solver, push):
    body = am.Body(am.box((1, 1, 1), cells=2), am.LinearElastic(200, 0.3))
    model = am.Model(
        [body], [am.Fix("top", (0, 0, -0.01)), am.Fix("bottom", (None, push, None))],
        [am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.2)],
    )  # fmt: skip
    found = am.solve(model, solver, time_limit=20)
    bound, speed = 0.2 * found.r[:, 0], np.hypot(*found.u[:, 1:].T)
    assert found.r[:, 0].min() > 0
    np.testing.assert_allclose(found.u[:, 2], push, rtol=1e-12)
    against = -bound[:, None] * found.u[:, 1:] / speed[:, None]
    np.testing.assert_allclose(found.r[:, 1:], against, atol=1e-6 * bound.max())
