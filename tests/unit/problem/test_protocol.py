"""A discrete problem and a solver of one's own, from outside the package."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import amontons as am
from amontons.problem.protocol import Problem
from amontons.solvers.contract import Iterate, taken_by


@dataclass(frozen=True, eq=False)
class HardSpring(Problem):
    """A point on a spring that hardens, k v + c v^3 = f + r, above a rigid floor at -gap."""

    law: am.Coulomb
    k: float
    c: float
    f: float
    gap: float
    dimension: ClassVar[int] = 2
    unknowns: ClassVar[int] = 1

    @property
    def rho(self):
        return np.array([self.k])

    def motion(self, r, v=None):
        v = np.zeros(1) if v is None else v
        return np.array([[v[0] + self.gap, 0.0]]), v

    def error(self, r, v=None):
        (u, v), (normal, shear) = self.motion(r, v), r[0]
        balance = self.k * v[0] + self.c * v[0] ** 3 - self.f - normal
        law = normal - max(normal - self.k * u[0, 0], 0.0)
        return float(np.hypot(np.hypot(balance, law), shear)) / abs(self.f)


@dataclass(frozen=True)
class ByNewton:
    """Newton's method for the spring, pressed onto the floor where it would go through."""

    solves: ClassVar[tuple[type, ...]] = (HardSpring,)

    def iterates(self, problem, start, target):
        v = 0.0 if start.v is None else start.v[0]
        told = None
        while told is None or told.error > 0:
            v -= (problem.k * v + problem.c * v**3 - problem.f) / (
                problem.k + 3 * problem.c * v**2
            )
            at = max(v, -problem.gap)
            force = problem.k * at + problem.c * at**3 - problem.f if at > v else 0.0
            told = yield Iterate(np.array([[force, 0.0]]), np.array([at]))


def spring(f):
    return HardSpring(am.Coulomb(np.array([0.3])), k=2.0, c=5.0, f=f, gap=0.5)


@pytest.mark.parametrize("solve", [am.drive, am.solve])
@pytest.mark.parametrize(("f", "pattern"), [(-9.0, "s"), (-1.0, "f"), (4.0, "f")])
def test_a_problem_and_a_solver_of_ones_own(solve, f, pattern):
    problem = spring(f)
    found = solve(problem, ByNewton(), tolerance=1e-12)
    assert found.converged
    assert found.problem is problem
    assert found.convergence.solver == "ByNewton"
    v, (normal, _) = found.v[0], found.r[0]
    assert 2 * v + 5 * v**3 == pytest.approx(f + normal)
    assert found.pattern == pattern
    assert normal * found.u[0, 0] == pytest.approx(0, abs=1e-12)
    assert found.fclib_error is None
    assert found.natural_error is None
    assert "1 contacts in 2D" in str(found)


def test_a_start_of_ones_own_problem():
    found = am.drive(spring(-9.0), ByNewton(), tolerance=1e-12)
    again = am.drive(spring(-9.0), ByNewton(), tolerance=1e-12, start=found)
    assert again.convergence.iterations == 0
    with pytest.raises(am.InvalidInput, match="expected v of 1 entries, got 2"):
        am.drive(spring(-9.0), ByNewton(), start=Iterate(found.r, np.zeros(2)))
    with pytest.raises(am.InvalidInput, match="expected r of shape"):
        am.drive(spring(-9.0), ByNewton(), start=Iterate(np.zeros((2, 2))))


def test_a_problem_that_fails_has_a_record():
    record = am.drive(spring(4.0), ByNewton(), max_iterations=2).convergence
    assert record.outcome is am.Outcome.MAX_ITERATIONS
    assert len(record.history) == 3


def test_solvers_refuse_what_they_do_not_solve():
    friction = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0.0]], [0.5])
    with pytest.raises(am.UnsupportedForm, match="ByNewton: "):
        am.drive(friction, ByNewton())
    for solver in (None, am.GaussSeidel(), am.SemismoothNewton()):
        with pytest.raises(am.UnsupportedForm, match="made for other problems"):
            am.drive(spring(1.0), solver)
    with pytest.raises(am.UnsupportedForm, match="natural"):
        am.drive(spring(1.0), ByNewton(), criterion=am.Criterion.NATURAL)


def test_what_a_solver_takes_by_default():
    class Old:
        form = am.Form.GLOBAL
        nitsche = True

    takes = taken_by(Old())
    assert [kind.__name__ for kind in takes.solves] == ["FrictionProblem", "NitscheProblem"]
    assert takes.form is am.Form.GLOBAL
    assert not takes.matrix_free and not takes.needs_cone and not takes.changes_method
    assert taken_by(object()).solves == (am.FrictionProblem,)
