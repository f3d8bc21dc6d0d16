"""Orthotropic friction: the law said disjunctively, closed forms, frames, all solvers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import sparse

import amontons as am
from amontons.core.errors import UnsupportedLaw
from amontons.mechanics.ready import gallery
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.judge import measures
from amontons.problem.law import joined
from amontons.problem.law.single import solve_one
from amontons.problem.law.states import OPEN, SLIP, STICK
from amontons.solvers import METHODS
from amontons.solvers.driver import drive

entry = st.floats(-3, 3).map(lambda x: round(x, 9))
coefficient = st.floats(0.05, 1.5)
MU1, MU2, ANGLE = 0.2, 0.6, 0.4


def turned(angle):
    """Rotation of tangents by an angle, (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def violation(mu1, mu2, angle, r, u, force, length, tension=0.0):
    """The law of one contact as its inequalities say it, with no code of the package."""
    axes = turned(angle)
    p, slip, pressure = axes.T @ r[1:], axes.T @ u[1:], r[0] + tension
    inside = np.hypot(p[0] / mu1, p[1] / mu2)
    # largest dissipation: -r_T.u_T is the support function of the ellipse
    support = max(pressure, 0.0) * np.hypot(mu1 * slip[0], mu2 * slip[1])
    return max(
        -pressure / force, -u[0] / length, min(pressure / force, u[0] / length),
        (inside - pressure) * min(mu1, mu2) / force, (support + p @ slip) / force / length,
    )  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(arrays(float, (3, 3), elements=entry), arrays(float, 3, elements=entry),
       coefficient, coefficient, st.floats(-4, 4), st.sampled_from([0.0, 0.7]))  # fmt: skip
def test_a_contact_solved_exactly_obeys_the_law(root, b, mu1, mu2, angle, tension):
    A = root @ root.T + 0.1 * np.eye(3)
    law = am.Orthotropic(mu1, mu2, angle)
    r, u, state = solve_one(A, b, am.Cohesive(law, tension) if tension else law)
    stiff = np.linalg.norm(A, 2)
    length = np.linalg.norm(b) + stiff * (np.linalg.norm(r) + tension) + 1e-300
    assert violation(mu1, mu2, angle, r, u, length / stiff, length, tension) <= 1e-7
    np.testing.assert_allclose(u, A @ r + b, atol=1e-8 * length)
    assert state in (OPEN, SLIP, STICK)


# r, u along the principal directions or with their normals: both sides of every inequality
SLOPE = np.hypot(1 / MU1, 1 / MU2)
DIAGONAL = np.array([1, 1]) / SLOPE  # on the ellipse at r_N = 1
STATES = [
    ([1, -MU1, 0], [0, 2, 0], True),
    ([1, 0, -MU2], [0, 0, 2], True),
    ([1, -MU1, 0], [0, 2, 0.1], False),  # not normal to the ellipse
    ([1, -MU1 * 0.99, 0], [0, 2, 0], False),  # slips inside of it
    ([1, MU1, 0], [0, 2, 0], False),  # pushes along
    ([1, -MU2, 0], [0, 2, 0], False),  # outside
    ([1, -MU1 * 1.01, 0], [0, 0, 0], False),
    ([1, 0, 0.99 * MU2], [0, 0, 0], True),
    ([1, *-DIAGONAL], [0, MU1**-2, MU2**-2], True),  # the gradient of the ellipse
    ([1, *-DIAGONAL], [0, 1, 1], False),  # opposite to r_T: another sliding rule
    ([1, *-DIAGONAL], [0, 0, 0], True),
    ([0, 0, 0], [1, 2, 3], True),
    ([0, 0.1, 0], [1, 0, 0], False),
    ([1, 0, 0], [0.1, 0, 0], False),
    ([-0.1, 0, 0], [0, 0, 0], False),
    ([0, 0, 0], [-0.1, 0, 0], False),
]


@pytest.mark.parametrize(("r", "u", "obeys"), STATES)
@pytest.mark.parametrize("angle", [0.0, ANGLE, 3.0])
@pytest.mark.parametrize("rho", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("tension", [0.0, 0.7])
def test_the_judge_knows_both_sides_of_every_inequality(r, u, obeys, angle, rho, tension):
    law = am.Orthotropic(MU1, MU2, angle)
    law = am.Cohesive(law, tension) if tension else law
    r, u = (np.array([[x[0], *(turned(angle) @ x[1:])]]) for x in (r, u))
    r[:, 0] -= tension
    assert (violation(MU1, MU2, angle, r[0], u[0], 1.0, 1.0, tension) <= 1e-12) == obeys
    assert (measures.scaled_residual(r, u, law, np.array([rho])) <= 1e-12) == obeys
    W, q = np.eye(3) / rho, u - r / rho
    problem = FrictionProblem.from_delassus(W, q, law)
    assert (problem.error(r) <= 1e-12) == obeys
    inside = violation(MU1, MU2, angle, r[0], 0 * u[0], 1.0, 1.0, tension) <= 1e-12
    assert (measures.max_cone_violation(r, law) <= 1e-12) == inside
    bound = np.linalg.norm(r[:, 1:]) <= law.bound(r)[0] + 1e-12
    assert (bound and r[0, 0] >= -tension) == inside


def problem_with(law, seed=3, contacts=8):
    plain = gallery.random_delassus(seed, contacts, 3, mu=0.3)
    return FrictionProblem.from_delassus(plain.W, plain.q, law)


@pytest.mark.parametrize("angle", [0.0, 1.1])
def test_equal_coefficients_are_coulombs(angle):
    mu = np.linspace(0, 0.9, 8)
    found = am.solve(problem_with(am.Orthotropic(mu, mu, angle)))
    expected = am.solve(problem_with(am.Coulomb(mu)))
    np.testing.assert_array_equal(found.r, expected.r)
    np.testing.assert_array_equal(found.u, expected.u)
    # nearly equal ones go the whole way
    near = am.Orthotropic(mu, mu * (1 + 1e-12), angle)
    assert near.stretch is not None
    close = am.solve(problem_with(near), tolerance=1e-12)
    exact = am.solve(problem_with(am.Coulomb(mu)), tolerance=1e-12)
    np.testing.assert_allclose(close.r, exact.r, atol=1e-9 * np.abs(exact.r).max())


def test_a_contact_pulled_at_an_angle():
    """W = 1, pulled far at a given direction: slip is normal to the ellipse, in closed form."""
    for pull in np.linspace(0, 2 * np.pi, 13):
        q = np.array([[-1.0, 1e6 * np.cos(pull), 1e6 * np.sin(pull)]])
        found = am.solve(FrictionProblem.from_delassus(np.eye(3), q, am.Orthotropic(MU1, MU2)))
        slip = np.array([np.cos(pull), np.sin(pull)])  # the reaction hardly turns it
        size = np.hypot(MU1 * slip[0], MU2 * slip[1])
        expected = -np.array([MU1**2 * slip[0], MU2**2 * slip[1]]) / size
        np.testing.assert_allclose(found.r[0, 1:], expected, atol=1e-5)
        assert found.status == [SLIP]


def test_the_force_that_makes_a_contact_slip():
    """It sticks exactly up to the ellipse, whatever the direction of the pull."""
    for pull in np.linspace(0, np.pi, 7):
        e = np.array([np.cos(pull), np.sin(pull)])
        limit = 1 / np.hypot(e[0] / MU1, e[1] / MU2)
        for share, status in ((0.999, STICK), (1.001, SLIP)):
            q = np.array([[-1.0, *(turned(ANGLE) @ e * limit * share)]])
            law = am.Orthotropic(MU1, MU2, ANGLE)
            found = am.solve(FrictionProblem.from_delassus(np.eye(3), q, law))
            assert found.status == [status]


@pytest.mark.parametrize("turn", [0.3, -2.0, np.pi / 2])
def test_frames_may_be_turned(turn):
    """Tangents turned by -a and angles by a are the same contacts; so are mu1, mu2 swapped."""
    rng = np.random.default_rng(1)
    mu1, mu2, angle = rng.uniform(0.1, 0.9, (3, 8))
    problem = problem_with(am.Orthotropic(mu1, mu2, angle))
    r = am.solve(problem, tolerance=1e-12).r
    Q = np.eye(3)
    Q[1:, 1:] = turned(-turn)
    whole = np.kron(np.eye(8), Q)
    law = am.Orthotropic(mu1, mu2, angle - turn)
    other = FrictionProblem.from_delassus(whole @ problem.W @ whole.T, problem.q @ Q.T, law)
    size = np.abs(r).max()
    np.testing.assert_allclose(am.solve(other, tolerance=1e-12).r, r @ Q.T, atol=1e-8 * size)
    assert other.error(r @ Q.T) < 1e-10
    swapped = replace(problem, law=am.Orthotropic(mu2, mu1, angle + np.pi / 2))
    assert swapped.error(r) < 1e-10


def as_global(problem):
    values, vectors = np.linalg.eigh(problem.W)
    H = (vectors * np.sqrt(np.maximum(values, 0))).T
    return FrictionProblem.from_global(
        np.eye(len(H)), H, np.zeros(len(H)), problem.q, problem.law
    )


def law_violation(problem, r, u):
    law = problem.law.law if isinstance(problem.law, am.Cohesive) else problem.law
    length, force = np.linalg.norm(problem.q), max(np.linalg.norm(r), 1e-300)
    return max(
        violation(*numbers, own, slip, force, length, c)
        for *numbers, own, slip, c in zip(
            law.mu1, law.mu2, law.angle, r, u, problem.law.cohesion, strict=True
        )
    )


def orthotropic(seed, tension=0.0):
    rng = np.random.default_rng(seed)
    law = am.Orthotropic(*rng.uniform(0.1, 0.6, (2, 8)), rng.uniform(0, 3, 8))
    return am.Cohesive(law, tension) if tension else law


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("tension", [0.0, 0.3])
def test_all_solvers(method, tension):
    problem, kind = problem_with(orthotropic(2, tension)), METHODS[method]
    coulomb = problem_with(am.Coulomb(np.full(8, 0.3)))
    asked, easier = problem, coulomb
    if kind.form is Form.GLOBAL:
        asked, easier = as_global(problem), as_global(coulomb)
    found = drive(asked, kind(), time_limit=20, max_iterations=20_000)
    if drive(easier, kind(), time_limit=20, max_iterations=20_000).converged:
        assert found.converged, str(found)
    if found.converged:
        np.testing.assert_allclose(
            found.u, (problem.W @ found.r.ravel()).reshape(-1, 3) + problem.q, atol=1e-7
        )
        assert law_violation(problem, found.r, found.u) < 1e-6
        slides = found.status == SLIP
        power = (found.r[:, 1:] * found.u[:, 1:]).sum(axis=1)
        assert (power[slides] <= 1e-12).all()
        assert problem.error(found.r) <= 1e-8


@pytest.mark.parametrize("seed", range(10))
def test_auto_obeys_the_law(seed):
    problem = problem_with(orthotropic(seed), seed)
    found = am.solve(problem)
    assert law_violation(problem, found.r, found.u) < 1e-6
    again = am.drive(problem, start=found)
    assert again.convergence.iterations == 0


def test_contacts_of_several_laws():
    laws = [am.Orthotropic([MU1], [MU2], [ANGLE]), am.Tresca([0.7]), am.Coulomb([0.5]),
            am.Cohesive(am.Orthotropic([MU1], [MU2]), [0.2])]  # fmt: skip
    q = np.array([[-1.0, 2.0, 0.5]] * 4)
    whole = am.solve(FrictionProblem.from_delassus(np.eye(12), q, joined(laws))).r
    for law, row, own in zip(laws, q, whole, strict=True):
        alone = am.solve(FrictionProblem.from_delassus(np.eye(3), row[None], law)).r
        np.testing.assert_allclose(own, alone[0], atol=1e-9)
    part = joined(laws).at(np.array([3, 0]))
    np.testing.assert_allclose(part.pressed(whole[[3, 0]]), joined(laws).pressed(whole)[[3, 0]])


def test_facts_are_both_coefficients():
    facts = am.Orthotropic([MU1], [MU2], [ANGLE]).facts
    np.testing.assert_allclose(facts["friction coefficient"], [MU1, MU2])


def test_questions_refuse_it():
    problem = problem_with(orthotropic(1))
    for ask in (am.all_solutions, am.multistart, am.p_matrix_friction, am.full_contact_friction,
                am.follow):  # fmt: skip
        with pytest.raises(UnsupportedLaw, match="friction"):
            ask(problem)
    for verdict in (am.uniqueness(problem), am.existence(problem)):
        assert verdict.verdict.name == "UNDECIDED"
        assert "orthotropic friction" in verdict.reason
    with pytest.raises(UnsupportedLaw, match="needs reactions"):
        problem.law.augmented_reaction(problem.q)


@pytest.mark.parametrize(("make", "says"), [
    (lambda: am.Orthotropic([0.1, 0.2], [0.1, 0.2, 0.3]), "one number or 3"),
    (lambda: am.Orthotropic(-0.1, 0.1), "mu1"),
    (lambda: am.Orthotropic(0.1, 0.1, np.nan), "angle"),
    (lambda: am.Orthotropic(0.0, 0.1), "both positive"),
    (lambda: am.Orthotropic(1e-9, 0.1), "both positive"),
    (lambda: FrictionProblem.from_delassus(np.eye(2), [[0, 1]], am.Orthotropic(0.1, 0.2)),
     "in 2D there is one direction"),
])  # fmt: skip
def test_bad_numbers_are_refused(make, says):
    with pytest.raises(am.InvalidInput, match=says):
        make()


def test_all_forms_have_the_same_plain_problem():
    """Dense, sparse, global and condensed, with cohesion, and W that is not symmetric."""
    rng = np.random.default_rng(5)
    problem = problem_with(orthotropic(4, 0.3))
    r, law = rng.standard_normal((8, 3)), problem.law
    skew = problem.W + 0.1 * rng.standard_normal(problem.W.shape)
    spread = as_global(problem)
    for form in (
        problem, FrictionProblem.from_delassus(sparse.csr_array(problem.W), problem.q, law),
        FrictionProblem.from_delassus(skew, problem.q, law), spread, spread.condensed(),
    ):  # fmt: skip
        plain = form.plain
        assert plain.plain is plain
        u, expected = plain.velocity(law.pressed(r))[0], form.velocity(r)[0]
        np.testing.assert_allclose(law.unstretched(u, r), expected, atol=1e-10)
        np.testing.assert_allclose(law.released(law.pressed(r)), r, atol=1e-13)
        power = (r * expected).sum(axis=1) + law.cohesion * expected[:, 0]
        np.testing.assert_allclose((law.pressed(r) * u).sum(axis=1), power, atol=1e-10)
    part = problem.restricted(np.array([1, 4]))
    np.testing.assert_allclose(
        part.plain.W.toarray(), problem.plain.W.reshape(8, 3, 8, 3)[[1, 4]][:, :, [1, 4]]
        .reshape(6, 6), atol=1e-13,
    )  # fmt: skip
    again = problem.with_load(2 * problem.q)
    assert again.plain.W is problem.plain.W  # made once


def test_callbacks_and_starts_are_told_in_r():
    problem, seen = problem_with(orthotropic(6)), []
    found = am.drive(problem, am.GaussSeidel(), callback=lambda _, it: seen.append(it.r.copy()))
    assert found.converged
    np.testing.assert_allclose(seen[-1], found.r, atol=1e-6 * np.abs(found.r).max())
    assert am.drive(problem, am.GaussSeidel(), start=am.Iterate(seen[-1])).converged
