"""Compliant contact: the law said disjunctively, the problem with W + C, energy, limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import amontons as am
from amontons.core.errors import UnsupportedLaw
from amontons.mechanics.ready import gallery
from amontons.problem.friction import FrictionProblem
from amontons.problem.judge import measures
from amontons.problem.law import joined
from amontons.problem.law.single import solve_one
from amontons.problem.law.states import SLIP, STICK

entry = st.floats(-3, 3).map(lambda x: round(x, 9))
C, STICKY, MU = 0.5, 0.25, 0.4


def violation(r, u, c, stick, mu, force, length, tension=0.0):
    """The law of one contact, said without code of the package."""
    overlap, slip, pressure = u[0] + c * r[0], u[1:] + stick * r[1:], r[0] + tension
    opposed = np.abs(np.linalg.norm(slip) * r[1:] + mu * max(pressure, 0) * slip).max()
    return max(
        -pressure / force, -overlap / length, min(pressure / force, overlap / length),
        (np.linalg.norm(r[1:]) - mu * pressure) / force, opposed / force / length,
    )  # fmt: skip


@settings(max_examples=200, deadline=None)
@given(arrays(float, (3, 3), elements=entry), arrays(float, 3, elements=entry),
       st.sampled_from([0.0, 0.7]))  # fmt: skip
def test_a_contact_solved_exactly_obeys_the_law(root, b, tension):
    A = root @ root.T + 0.1 * np.eye(3)
    law = am.Cohesive(am.Coulomb([MU]), [tension]) if tension else am.Coulomb([MU])
    r, u, _ = solve_one(A, b, am.Compliant(law, C, STICKY))
    stiff = np.linalg.norm(A, 2)
    length = np.linalg.norm(b) + (stiff + C) * (np.linalg.norm(r) + tension) + 1e-300
    assert violation(r, u, C, STICKY, MU, length / stiff, length, tension) <= 1e-7
    np.testing.assert_allclose(u, A @ r + b, atol=1e-8 * length)


STATES = [
    ([1, -MU, 0], [-C, 2 + STICKY * MU, 0], True),  # slips, and overlaps by c r_N
    ([1, -MU, 0], [-C, STICKY * MU, 0], True),  # at the limit: all slip is elastic
    ([1, -MU, 0], [-C, STICKY * MU - 0.1, 0], False),
    ([1, -0.1, 0.2], [-C, STICKY * 0.1, -STICKY * 0.2], True),  # elastic stick
    ([1, -0.1, 0.2], [-C, 0, 0], False),
    ([1, 0, 0], [0, 0, 0], False),  # no force without overlap
    ([1, 0, 0], [-1.1 * C, 0, 0], False),
    ([0, 0, 0], [0.1, 3, 1], True),
    ([0, 0, 0], [-0.1, 0, 0], False),
    ([-0.1, 0, 0], [0.1 * C, 0, 0], False),
]


@pytest.mark.parametrize(("r", "u", "obeys"), STATES)
@pytest.mark.parametrize("rho", [0.1, 1.0, 10.0])
def test_the_judge_knows_both_sides_of_every_inequality(r, u, obeys, rho):
    law = am.Compliant(am.Coulomb([MU]), C, STICKY)
    assert (violation(np.array(r), np.array(u), C, STICKY, MU, 1.0, 1.0) <= 1e-12) == obeys
    r, u = np.array([r], dtype=float), np.array([u], dtype=float)
    assert (measures.scaled_residual(r, u, law, np.array([rho])) <= 1e-12) == obeys
    problem = FrictionProblem.from_delassus(np.eye(3) / rho, u - r / rho, law)
    assert (problem.error(r) <= 1e-12) == obeys


def some(d, law_of, seed=3):
    plain = gallery.random_delassus(seed, 8, d, mu=MU)
    return plain, FrictionProblem.from_delassus(plain.W, plain.q, law_of(plain.law))


def as_global(problem):
    values, vectors = np.linalg.eigh(problem.W)
    H = (vectors * np.sqrt(np.maximum(values, 0))).T
    return FrictionProblem.from_global(
        np.eye(len(H)), H, np.zeros(len(H)), problem.q, problem.law
    )


@pytest.mark.parametrize("d", [2, 3])
def test_it_is_the_problem_with_more_on_the_diagonal(d):
    c, stick = np.linspace(0, 1, 8), np.linspace(0.5, 0, 8)
    plain, problem = some(d, lambda law: am.Compliant(law, c, stick))
    more = np.column_stack([c, *[stick] * (d - 1)])
    softer = FrictionProblem.from_delassus(
        plain.W + np.diag(more.ravel()), plain.q, plain.law
    )
    expected = am.solve(softer, tolerance=1e-12)
    size = np.abs(expected.r).max()
    for asked in (problem, as_global(problem)):
        found = am.solve(asked, tolerance=1e-12)
        np.testing.assert_allclose(found.r, expected.r, atol=1e-8 * size)
        np.testing.assert_allclose(found.u, expected.u - more * expected.r, atol=1e-7 * size)
        np.testing.assert_array_equal(found.status, expected.status)
        closed = found.status != 0
        np.testing.assert_allclose(  # the gap as it is
            found.u[closed, 0], -c[closed] * found.r[closed, 0], atol=1e-7 * size
        )
        assert asked.error(found.r) < 1e-9
        assert am.drive(asked, start=found).convergence.iterations == 0


def test_energy_stored_in_contacts():
    """A mass of compliance 1 pressed by a unit: both share the work, c r_N^2 / 2 each."""
    law = am.Compliant(am.Coulomb([MU]), C, STICKY)
    found = am.solve(FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0.1, 0.0]], law))
    assert found.status == [STICK]
    expected = [1 / (1 + C), -0.1 / (1 + STICKY), 0.0]
    np.testing.assert_allclose(found.r, [expected], atol=1e-12)
    stored = 0.5 * (C * expected[0] ** 2 + STICKY * expected[1] ** 2)
    assert -0.5 * (found.r * found.u).sum() == pytest.approx(stored)
    far = am.solve(FrictionProblem.from_delassus(np.eye(3), [[-1.0, 5.0, 0.0]], law))
    assert far.status == [SLIP]
    assert far.max_penetration == pytest.approx(C * far.r[0, 0])


@pytest.mark.parametrize("d", [2, 3])
def test_no_compliance_is_the_law_itself(d):
    plain, problem = some(d, lambda law: am.Compliant(law, 0.0))
    np.testing.assert_array_equal(am.solve(problem).r, am.solve(plain).r)
    _, softer = some(d, lambda law: am.Compliant(law, 1e-9, 1e-9))
    exact, near = (am.solve(p, tolerance=1e-12).r for p in (plain, softer))
    np.testing.assert_allclose(near, exact, atol=1e-6 * np.abs(exact).max())


def test_contacts_of_several_laws():
    laws = [am.Compliant(am.Coulomb([MU]), C), am.Tresca([0.7]),
            am.Compliant(am.Cohesive(am.Orthotropic([0.2], [0.5], [0.3]), [0.2]), C, STICKY),
            am.Cohesive(am.Coulomb([MU]), [0.2])]  # fmt: skip
    q = np.array([[-1.0, 2.0, 0.5]] * 4)
    whole = am.solve(FrictionProblem.from_delassus(np.eye(12), q, joined(laws)))
    for law, row, own, u in zip(laws, q, whole.r, whole.u, strict=True):
        alone = am.solve(FrictionProblem.from_delassus(np.eye(3), row[None], law))
        np.testing.assert_allclose(own, alone.r[0], atol=1e-9)
        np.testing.assert_allclose(u, own + row, atol=1e-9)


def test_questions_and_bad_numbers_are_refused():
    _, problem = some(2, lambda law: am.Compliant(law, 0.1))
    for ask in (am.all_solutions, am.critical_friction, am.follow):
        with pytest.raises(UnsupportedLaw, match="compliance"):
            ask(problem)
    law = am.Compliant(am.Coulomb([MU]), 1.0)
    for make in (lambda: am.Compliant(law, 1.0), lambda: am.Compliant(am.Coulomb([MU]), -1.0),
                 lambda: am.Compliant(0.3, 1.0), lambda: am.Cohesive(law, 1.0)):  # fmt: skip
        with pytest.raises(am.InvalidInput):
            make()
