"""What ends a solve: the criterion and the patience that are asked for."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.problem.judge.measures import Measure
from amontons.problem.solution import Outcome
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive


class Slow:
    """Iterates that make no progress, and then the solution."""

    form = am.Form.ANY

    def __init__(self, r, waits):
        self.r, self.waits = r, waits

    def iterates(self, problem, start, target):
        for k in range(self.waits):
            yield Iterate(np.full_like(self.r, 1.0 + 1e-3 * k))
        yield Iterate(self.r)


def test_patience_decides_when_a_solve_has_stagnated():
    problem = random_delassus(1, 4)
    r = am.solve(problem, tolerance=1e-12).r
    slow = Slow(r, 60)
    assert drive(problem, slow, patience=20).convergence.outcome is Outcome.STAGNATED
    assert drive(problem, slow, patience=20).convergence.iterations < 60
    assert drive(problem, slow, patience=None).converged
    assert drive(problem, slow).converged  # 500 by default
    assert not drive(problem, Slow(r, 600)).converged
    assert drive(problem, Slow(r, 600), patience=None).converged


@pytest.mark.parametrize("patience", [0, -1, 1.5, True, "10"])
def test_patience_is_checked(patience):
    with pytest.raises(am.InvalidInput, match="patience"):
        am.solve(random_delassus(1, 4), patience=patience)


@pytest.mark.parametrize("criterion", ["natural", None, 3])
def test_criterion_is_checked(criterion):
    with pytest.raises(am.InvalidInput, match=r"Criterion\.NATURAL"):
        am.solve(random_delassus(1, 4), criterion=criterion)


SOLVERS = [
    am.Auto(), am.GaussSeidel(batch=3), am.GaussSeidel(batch=am.Batch.ADAPTIVE),
    am.SemismoothNewton(), am.InteriorPoint(), am.Jacobi(),
]  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("unit", [1.0, 1e3, 1e-3])
def test_natural_criterion_stops_by_equation_13(solver, unit):
    """W in other units: the judge sees no difference, (13) does, and is met all the same."""
    problem = random_delassus(3, 6)
    scaled = am.FrictionProblem.from_delassus(unit * problem.W, problem.q, problem.law)
    tolerance = 1e-6
    found = drive(scaled, solver, tolerance=tolerance, criterion=am.Criterion.NATURAL)
    assert found.converged, str(found)
    assert found.natural_error <= tolerance
    assert found.convergence.error == pytest.approx(found.natural_error, rel=1e-6)
    assert found.convergence.measure is Measure.NATURAL
    errors = [step.error for step in found.convergence.history]
    assert min(errors[:-1], default=1) > tolerance


def test_natural_criterion_in_the_global_form():
    rng = np.random.default_rng(0)
    H = rng.standard_normal((9, 6))
    problem = am.FrictionProblem.from_global(
        2 * np.eye(9), H, np.zeros(9), np.tile([-1.0, 0.3, 0.0], (2, 1)), np.full(2, 0.4)
    )
    found = drive(problem, am.SemismoothNewton(), criterion=am.Criterion.NATURAL)
    assert found.natural_error <= 1e-8

