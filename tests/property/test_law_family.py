"""Caps, cohesion and several laws in one problem: single contacts, all solvers, the limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import amontons as am
from amontons.core.errors import UnsupportedLaw
from amontons.linear.blocks import spatial
from amontons.mechanics.ready import gallery
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.judge import measures
from amontons.problem.law import Kind, joined
from amontons.problem.law.single import solve_one
from amontons.problem.law.states import OPEN, SLIP, STICK
from amontons.problem.settling import settle
from amontons.solvers import METHODS
from amontons.solvers.driver import drive

entry = st.floats(-3, 3).map(lambda x: round(x, 9))  # squares must not underflow
matrix = arrays(float, (3, 3), elements=entry)
vector = arrays(float, 3, elements=entry)
number = st.floats(0, 2).map(lambda x: round(x, 9))
kinds = st.sampled_from(["coulomb", "tresca", "capped"])


def made(kind, mu, tau, tension=0.0):
    law = {"coulomb": lambda: am.Coulomb([mu]), "tresca": lambda: am.Tresca([tau]),
           "capped": lambda: am.CappedCoulomb([mu], [tau])}[kind]()  # fmt: skip
    return am.Cohesive(law, [tension]) if tension else law


def bound_of(kind, mu, tau, pressure):
    """The friction bound as the law says it, with no code of the package."""
    return {"coulomb": mu * pressure, "tresca": tau, "capped": min(mu * pressure, tau)}[kind]


def violation(kind, mu, tau, tension, r, u, force, length):
    """The law of one contact, said disjunctively, relative to a force and a length."""
    pressure, slip = r[0] + tension, np.linalg.norm(u[1:])
    bound = bound_of(kind, mu, tau, max(pressure, 0.0))
    pull = np.linalg.norm(r[1:])
    opposed = np.abs(slip * r[1:] + bound * u[1:]).max() / force / length
    return max(
        -pressure / force, -u[0] / length, min(pressure / force, u[0] / length),
        (pull - bound) / force, opposed,
    )  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(matrix, vector, kinds, number, number, number)
def test_a_contact_solved_exactly_obeys_its_law(root, b, kind, mu, tau, tension):
    A = root @ root.T + 0.1 * np.eye(3)
    r, u, state = solve_one(A, b, made(kind, mu, tau, tension))
    stiff = np.linalg.norm(A, 2)
    length = np.linalg.norm(b) + stiff * (np.linalg.norm(r) + tension) + 1e-300
    assert violation(kind, mu, tau, tension, r, u, length / stiff, length) <= 1e-8
    assert state in (OPEN, SLIP, STICK)
    if state == OPEN:
        assert r[0] == -tension


def every_state(A, b, kind, mu, tau):
    """All solutions in 2D, by trying every status: open, stick, two slips, two bounds."""
    found = []
    rows = [np.zeros(2)] if kind != "tresca" else []
    for sign in (1.0, -1.0):
        if kind != "tresca" and A[0, 0] + mu * sign * A[0, 1] != 0:
            n = -b[0] / (A[0, 0] + mu * sign * A[0, 1])
            rows.append(np.array([n, sign * mu * n]))
        if kind != "coulomb":
            push = -(b[0] + sign * tau * A[0, 1]) / A[0, 0]
            rows += [np.array([push, sign * tau]), np.array([0.0, sign * tau])]
    rows += [-np.linalg.solve(A, b), np.array([0.0, -b[1] / A[1, 1]])]
    for r in rows:
        u = A @ r + b
        size = np.linalg.norm(b) + np.linalg.norm(A, 2) * np.linalg.norm(r) + 1e-300
        if violation(kind, mu, tau, 0.0, r, u, size / np.linalg.norm(A, 2), size) <= 1e-9:
            found.append(r)
    return found


@settings(max_examples=300, deadline=None)
@given(arrays(float, (2, 2), elements=entry), arrays(float, 2, elements=entry), kinds,
       number, number)  # fmt: skip
def test_the_solution_is_one_of_all_statuses(root, b, kind, mu, tau):
    A = np.eye(3)
    A[:2, :2] = root @ root.T + 0.1 * np.eye(2)
    all_of_them = every_state(A[:2, :2], b, kind, mu, tau)
    r, _, _ = solve_one(A, [*b, 0.0], made(kind, mu, tau))
    assert all_of_them
    size = np.abs(all_of_them).max() + np.abs(b).max() + 1e-300
    assert min(np.abs(r[:2] - other).max() for other in all_of_them) <= 1e-6 * size


# the law at a state: both sides of every inequality
STATES = [
    # kind, r, u, does it obey?
    ("capped", [1, -0.5], [0, 2], True),  # slips at mu r_N = 0.5
    ("capped", [1, -0.4], [0, 2], False),  # slips below its bound
    ("capped", [1, -0.4], [0, 0], True),
    ("capped", [4, -1], [0, 2], True),  # slips at the cap
    ("capped", [4, -2], [0, 2], False),  # at Coulomb's bound, above the cap
    ("capped", [4, 1], [0, 2], False),  # pushes along
    ("capped", [4, -0.9], [0, 2], False),
    ("capped", [4, 1.1], [0, 0], False),
    ("capped", [2, -1], [0, 2], True),  # where both bounds meet
    ("capped", [0, 0], [1, 2], True),
    ("capped", [0, 0.5], [1, 0], False),  # open contacts have no friction
    ("capped", [4, 0], [1, 0], False),
    ("capped", [-0.1, 0], [0, 0], False),
    ("capped", [0, 0], [-0.1, 0], False),
    ("tresca", [0, -1], [1, 2], True),
    ("coulomb", [4, -2], [0, 2], True),
]


@pytest.mark.parametrize(("kind", "r", "u", "obeys"), STATES)
@pytest.mark.parametrize("tension", [0.0, 0.7])
@pytest.mark.parametrize("rho", [0.1, 1.0, 10.0])
def test_the_judge_knows_both_sides_of_every_inequality(kind, r, u, obeys, tension, rho):
    law = made(kind, 0.5, 1.0, tension)
    r, u, rho = np.array([r], dtype=float), np.array([u], dtype=float), np.array([rho])
    assert (violation(kind, 0.5, 1.0, 0.0, r[0], u[0], 1.0, 1.0) <= 1e-12) == obeys
    r[:, 0] -= tension
    assert (measures.scaled_residual(r, u, law, rho) <= 1e-12) == obeys
    x = r - rho[:, None] * u
    assert np.allclose(law.augmented_reaction(x), r, atol=1e-12) == obeys


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2, 3]))
def test_kernels_are_their_numpy_twins(seed, d):
    rng, nc = np.random.default_rng(seed), 12
    law = some_law(rng, nc)
    r, u = rng.standard_normal((2, nc, d))
    rho = rng.uniform(0.1, 2, nc)
    W = np.diag(np.repeat(1 / rho, d))
    problem = FrictionProblem.from_delassus(W, u - r / rho[:, None], law)
    np.testing.assert_allclose(problem.rho, rho)
    indptr, indices, data, q, kind, parameters, _ = problem.kernel_data
    found = measures.natural_error(indptr, indices, data, q, kind, parameters, rho, spatial(r))
    assert found == pytest.approx(measures.scaled_residual(r, u, law, rho), rel=1e-9)
    closed, sliding = law.regions(r, u, rho)
    told = settle(law, rho, r, u)
    np.testing.assert_array_equal(told.sliding, sliding)
    np.testing.assert_array_equal(told.status == OPEN, ~(closed & (r[:, 0] > 0)))


@pytest.mark.parametrize("d", [2, 3])
def test_the_derivative_of_the_augmented_reaction(d):
    rng = np.random.default_rng(d)
    law = am.Cohesive(some_law(rng, 200), np.full(200, 0.3))
    x, step = rng.standard_normal((200, d)), 1e-7
    J = law.augmented_reaction_jacobian(x)
    for k in range(d):
        e = np.zeros(d)
        e[k] = step
        slope = (law.augmented_reaction(x + e) - law.augmented_reaction(x - e)) / (2 * step)
        np.testing.assert_allclose(J[:, :, k], slope, atol=1e-6)


def some_law(rng, nc):
    """A law of all kinds in any order."""
    parts = [am.Coulomb(rng.uniform(0, 1, nc)), am.Tresca(rng.uniform(0, 1, nc)),
             am.CappedCoulomb(rng.uniform(0, 1, nc), rng.uniform(0, 1, nc))]  # fmt: skip
    return joined(parts).at(rng.permutation(3 * nc)[:nc])


def law_violation(problem, r):
    """The laws of all contacts, relative to the sizes of u and r."""
    law = problem.law
    W = problem.W if isinstance(problem.W, np.ndarray) else problem.W.toarray()
    u = (W @ r.ravel()).reshape(r.shape) + problem.q
    length, force = np.linalg.norm(problem.q), max(np.linalg.norm(r), 1e-300)
    return max(
        violation(Kind(kind).name.lower(), mu, tau, c, own, slip, force, length)
        for kind, (mu, tau), c, own, slip in zip(
            law.kind, law.parameters, law.cohesion, r, u, strict=True
        )
    )


def random_problem(seed, d, law_of):
    problem = gallery.random_delassus(seed, 8, d, mu=0.3)
    size = np.abs(am.solve(problem).r).max()
    return FrictionProblem.from_delassus(problem.W, problem.q, law_of(size))


LAWS = {
    "capped": lambda size: am.CappedCoulomb([0.4] * 8, 0.1 * size),
    "cohesive": lambda size: am.Cohesive(am.Coulomb([0.3] * 8), 0.2 * size),
    "mixed": lambda size: am.Cohesive(
        some_law(np.random.default_rng(1), 8).scaled(0.1 * size), [0, 0.1 * size] * 4
    ),
}


def as_global(problem):
    values, vectors = np.linalg.eigh(problem.W)
    H = (vectors * np.sqrt(np.maximum(values, 0))).T
    return FrictionProblem.from_global(
        np.eye(len(H)), H, np.zeros(len(H)), problem.q, problem.law
    )


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", [2, 3])
def test_all_solvers(name, method, d):
    problem, kind = random_problem(d, d, LAWS[name]), METHODS[method]
    asked = as_global(problem) if kind.form is Form.GLOBAL else problem
    if getattr(kind, "needs_cone", False) and name != "cohesive":
        with pytest.raises(UnsupportedLaw, match="needs Coulomb's cone"):
            drive(asked, kind())
        return
    found = drive(asked, kind(), time_limit=20, max_iterations=20_000)
    if found.converged:
        assert problem.error(found.r) <= 1e-8
        assert law_violation(problem, found.r) < 1e-6
        np.testing.assert_array_equal(
            found.r[found.status == OPEN, 0], -problem.law.cohesion[found.status == OPEN]
        )
    if method in ("auto", "gauss-seidel", "semismooth-newton"):
        assert found.converged, str(found)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", LAWS)
def test_auto_solves_all_laws(name, seed):
    problem = random_problem(seed, 2 + seed % 2, LAWS[name])
    assert law_violation(problem, am.solve(problem).r) < 1e-6


@pytest.mark.parametrize("d", [2, 3])
def test_limits(d):
    plain = gallery.random_delassus(d, 8, d, mu=0.3)
    W, q, n = plain.W, plain.q, plain.contacts
    r = am.solve(plain, am.GaussSeidel(), tolerance=1e-12).r

    def solved(law):
        problem = FrictionProblem.from_delassus(W, q, law)
        return am.solve(problem, am.GaussSeidel(), tolerance=1e-12)

    np.testing.assert_allclose(solved(am.CappedCoulomb([0.3] * n, 1e9)).r, r, atol=1e-11)
    np.testing.assert_allclose(solved(am.Cohesive(am.Coulomb([0.3] * n), 0.0)).r, r, atol=1e-11)
    pressed = np.array(q)
    pressed[:, 0] = -5 - np.abs(q[:, 0])  # all closed
    W, q = np.eye(len(W)) + 0.02 * W / np.abs(W).max(), pressed
    bound = [0.01] * n
    given_bound, capped = solved(am.Tresca(bound)), solved(am.CappedCoulomb([1e6], bound))
    assert (given_bound.status != OPEN).all()
    np.testing.assert_allclose(capped.r, given_bound.r, atol=1e-9)


def test_contacts_that_do_not_feel_each_other_obey_their_own_laws():
    laws = [am.Coulomb([0.5]), am.Tresca([0.7]), am.CappedCoulomb([0.5], [0.3]),
            am.Cohesive(am.CappedCoulomb([0.5], [0.3]), [0.2])]  # fmt: skip
    q = np.array([[-1.0, 2.0, 0.5]] * 4)
    whole = am.solve(FrictionProblem.from_delassus(np.eye(12), q, joined(laws))).r
    for law, row, own in zip(laws, q, whole, strict=True):
        alone = am.solve(FrictionProblem.from_delassus(np.eye(3), row[None], law)).r
        np.testing.assert_allclose(own, alone[0], atol=1e-9)


@pytest.mark.parametrize(
    ("pull", "r_N", "status"), [(0.5, -0.5, STICK), (2.0, -1.0, OPEN), (-1.0, 1.0, STICK)]
)
def test_cohesion_bears_tension_up_to_its_value(pull, r_N, status):
    law = am.Cohesive(am.Coulomb([0.5]), [1.0])
    problem = FrictionProblem.from_delassus(np.eye(3), [[pull, 0.0, 0.0]], law)
    found = am.solve(problem)
    np.testing.assert_allclose(found.r, [[r_N, 0, 0]], atol=1e-12)
    assert found.status == [status]
    assert problem.error(found.r) <= 1e-12
    assert found.max_cone_violation == pytest.approx(0.0, abs=1e-12)
    assert problem.error(found.r - [[0.1, 0, 0]]) > 0.01
    again = am.drive(problem, start=found)
    assert again.convergence.iterations == 0


def test_iterates_and_starts_of_a_cohesive_problem_are_its_own():
    law = am.Cohesive(am.Coulomb([0.5]), [1.0])
    problem = FrictionProblem.from_delassus(np.eye(3), [[2.0, 0.0, 0.0]], law)
    seen = []
    am.drive(problem, am.GaussSeidel(), callback=lambda _, it: seen.append(it.r.copy()))
    assert all(r[0, 0] == -1.0 for r in seen)


@pytest.mark.parametrize("law", [am.CappedCoulomb([0.4] * 6, 0.1),
                                 am.Cohesive(am.Coulomb([0.4] * 6), 0.1)])  # fmt: skip
def test_questions_refuse_laws_that_they_do_not_know(law):
    plain = gallery.random_delassus(1, 6, 2, mu=0.3)
    problem = FrictionProblem.from_delassus(plain.W, plain.q, law)
    for ask in (am.all_solutions, am.multistart, am.critical_friction,
                am.p_matrix_friction, am.full_contact_friction):  # fmt: skip
        with pytest.raises(UnsupportedLaw, match=r"friction"):
            ask(problem)
    with pytest.raises(UnsupportedLaw):
        am.follow(problem)
    for verdict in (am.uniqueness(problem), am.existence(problem)):
        assert verdict.verdict.name == "UNDECIDED"
        assert law.name in verdict.reason


@pytest.mark.parametrize("make", [
    lambda: am.CappedCoulomb([0.3], [-1.0]), lambda: am.CappedCoulomb([0.3, 0.2], [1, 2, 3]),
    lambda: am.Cohesive(am.Coulomb([0.3]), [-1.0]), lambda: am.Cohesive(0.3, [1.0]),
    lambda: am.Cohesive(am.Cohesive(am.Coulomb([0.3]), 1.0), 1.0), lambda: joined([0.3]),
])  # fmt: skip
def test_bad_laws_are_refused(make):
    with pytest.raises(am.InvalidInput):
        make()
