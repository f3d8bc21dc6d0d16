"""Status, sliding and margin of contacts at known solutions."""

import numpy as np
import pytest

from amontons.problem.friction import FrictionProblem
from amontons.problem.law import Tresca
from amontons.problem.status import ContactStatus, classify
from amontons.solvers import GaussSeidel
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive

UNIT = 0.25  # rho of the contacts below


def three_contacts(law):
    q = [[1.0, 0.0, 0.0], [-4.0, 0.4, 0.0], [-4.0, 8.0, 0.0]]
    return FrictionProblem.from_delassus(4 * np.eye(9), q, law)


def test_open_stick_slip():
    problem = three_contacts([0.5] * 3)
    r = np.array([[0, 0, 0], [1, -0.1, 0], [1, -0.5, 0]])
    u = problem.velocity(r)[0]
    assert problem.error(r) < 1e-15
    status, sliding, margin = classify(problem, r, u)
    assert status.tolist() == [ContactStatus.OPEN, ContactStatus.STICK, ContactStatus.SLIP]
    assert sliding.tolist() == [False, False, True]
    np.testing.assert_allclose(margin, [UNIT * 1, 0.4, 1.0])


def test_tresca_open_contacts_may_slide():
    problem = three_contacts(Tresca([0.3] * 3)).with_load([[1, 0, 0], [1, 2, 0], [-4, 8, 0]])
    r = np.array([[0, 0, 0], [0, -0.3, 0], [1, -0.3, 0]])
    assert problem.error(r) < 1e-15
    status, sliding, _ = classify(problem, r, problem.velocity(r)[0])
    assert status.tolist() == [0, 0, 1]
    assert sliding.tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("r", "letter"), [((0, 0), "f"), ((5 / 3, -7 / 3), "s"), ((1 / 3, -2 / 3), "-")]
)
def test_every_one_of_several_solutions_keeps_its_status(r, letter):
    problem = FrictionProblem.from_delassus([[1, 0.8], [0.8, 1]], [[0.2, 1.0]], [2.0])
    solution = drive(problem, GaussSeidel(), start=Iterate(np.array([r])))
    assert solution.convergence.iterations == 0
    assert solution.pattern == letter


def test_status_does_not_depend_on_the_form():
    rng = np.random.default_rng(1)
    M, H = np.diag(rng.random(12) + 1), rng.standard_normal((12, 12))
    problem = FrictionProblem.from_global(
        M, H, 3 * rng.standard_normal(12), np.zeros((4, 3)), [0.3] * 4
    )
    local = drive(problem.condensed(), GaussSeidel(), tolerance=1e-12, max_iterations=20000)
    assert local.converged
    status, _, _ = classify(problem, local.r, local.u)
    np.testing.assert_array_equal(status, local.status)
    assert (local.margin >= 0).all()


def test_frictionless_contacts_slip():
    problem = FrictionProblem.from_delassus(np.eye(2), [[-1, 0]], [0.0])
    assert drive(problem, GaussSeidel()).status.tolist() == [ContactStatus.SLIP]
