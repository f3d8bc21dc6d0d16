"""Floating point operations that solvers report, against operations counted one by one."""

import math

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.problem.equations import JUDGE_FLOPS
from amontons.solvers.contract import Iterate, Target
from amontons.solvers.sweeps import kernels as sweeps
from amontons.solvers.sweeps import local_contact


class Counted(float):
    """A number that counts what is done with it; comparisons and signs are free."""

    done = 0


def counting(name):
    plain = getattr(float, name)

    def operation(self, *others):
        value = plain(self, *others)
        if value is NotImplemented:
            return value
        Counted.done += 1
        return Counted(value)

    return operation


for name in ("add", "sub", "mul", "truediv"):
    setattr(Counted, f"__{name}__", counting(f"__{name}__"))
    setattr(Counted, f"__r{name}__", counting(f"__r{name}__"))
Counted.__pow__ = counting("__pow__")
Counted.__abs__ = lambda self: Counted(float.__abs__(self))
Counted.__neg__ = lambda self: Counted(float.__neg__(self))


class Roots:
    """`math` whose root is an operation."""

    inf = math.inf

    @staticmethod
    def sqrt(value):
        Counted.done += 1
        return Counted(math.sqrt(value))


class Arrays:
    """`numpy` whose new arrays hold counted numbers."""

    @staticmethod
    def empty(shape):
        return numbers(np.zeros(shape))


def numbers(values):
    out = np.empty(np.shape(values), dtype=object)
    for k in np.ndindex(out.shape):
        out[k] = Counted(values[k])
    return out


@pytest.fixture
def plain(monkeypatch):
    """The kernels as Python, on counted numbers."""
    for name in ("_newton_row", "_determinant", "_modified_velocity", "_projected",
                 "newton_contact", "projection_contact"):  # fmt: skip
        kernel = getattr(local_contact, name)
        monkeypatch.setattr(local_contact, name, getattr(kernel, "py_func", kernel))
    monkeypatch.setattr(local_contact, "math", Roots)
    monkeypatch.setattr(local_contact, "np", Arrays)
    return local_contact


def one_contact(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    b = rng.standard_normal(3)
    b[0] = -abs(b[0])
    return root @ root.T + np.eye(3), b, rng.standard_normal(3)


@pytest.mark.parametrize("kernel", ["newton_contact", "projection_contact"])
def test_steps_on_one_contact_cost_what_the_kernel_counts(plain, kernel):
    told = 0.0
    Counted.done = 0
    for seed in range(30):
        A, b, r = one_contact(seed)
        work = np.zeros(1)
        getattr(plain, kernel)(
            numbers(A), *numbers(b), Counted(0.4), *numbers(r), 1e-10, 40, work
        )
        told += work[0]
    assert told == pytest.approx(Counted.done, rel=0.03)


def test_sweeps_by_hand_on_three_contacts():
    """27 numbers of W off the diagonal make 6 blocks of 9 products and 9 sums."""
    problem = random_delassus(1, 3)
    done = next(
        am.GaussSeidel(batch=2).iterates(problem, Iterate(np.zeros((3, 3))), Target(1e-8))
    )
    by_hand = 2 * (6 * (9 + 9) + 3 * (sweeps.CONTACT_FLOPS + local_contact.EXACT_FLOPS))
    assert done.flops == by_hand


def test_local_steps_are_counted_as_they_are_made():
    problem = random_delassus(1, 3)
    flops = []
    for steps in (1, 5):
        solver = am.GaussSeidel(local=am.LocalSolver.PROJECTION, local_steps=steps)
        iterates = solver.iterates(problem, Iterate(np.ones((3, 3))), Target(1e-8))
        flops.append(next(iterates).flops)
    base = 6 * 18 + 3 * sweeps.CONTACT_FLOPS
    trial = local_contact.VELOCITY_FLOPS + local_contact.PROJECTION_FLOPS
    assert flops[0] - base >= 3 * trial
    assert (flops[0] - base - 3 * trial) % local_contact.PROJECTION_FLOPS == 0
    assert flops[1] > flops[0]


def test_record_adds_iterates_and_judgements():
    problem = random_delassus(1, 3)
    found = am.solve(problem, am.GaussSeidel(), tolerance=1e-6)
    n = found.convergence.iterations
    judged = (n + 1) * (9 * JUDGE_FLOPS[0] + 3 * JUDGE_FLOPS[1])
    each = 6 * 18 + 3 * (sweeps.CONTACT_FLOPS + local_contact.EXACT_FLOPS)
    assert found.convergence.flops == judged + n * each
    history = [step.flops for step in found.convergence.history]
    assert (np.diff(history) > 0).all()
    assert history[-1] == found.convergence.flops


@pytest.mark.parametrize("size", [1, 2, 5, 20])
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_portfolio_counts_its_sweeps(size, dimension):
    """At least the plain sweeps and judgements that its record shows."""
    problem = random_delassus(3, size, dimension)
    record = am.solve(problem).convergence
    assert {step.stage for step in record.history} <= {"", "Anderson Gauss-Seidel"}
    assert record.flops is not None
    own = sweeps.CONTACT_FLOPS + local_contact.EXACT_FLOPS
    each = 18 * size * (size - 1) + own * size
    told = record.iterations * each + len(record.history) * problem.judge_flops
    assert told <= record.flops <= 3 * told + 5000 * size
    assert (np.diff([step.flops for step in record.history]) > 0).all()


def test_the_portfolio_counts_like_the_sweeps_that_it_makes():
    """Anderson's sweeps by the portfolio, in another order, cost what they cost alone."""
    problem = random_delassus(3, 20)
    sweep = am.solve(problem, am.GaussSeidel(anderson_depth=10, batch=40)).convergence
    auto = am.solve(problem).convergence
    a, b = (found.flops / found.iterations for found in (sweep, auto))
    assert a == pytest.approx(b, rel=0.1)


def test_methods_that_do_not_count_say_so():
    found = am.solve(random_delassus(1, 3), am.SmoothingNewton())
    assert found.convergence.flops is None


def test_newton_costs_a_factor_of_each_step():
    problem = random_delassus(1, 30)
    found = am.solve(problem, am.SemismoothNewton(line_search=am.FullStep()), tolerance=1e-6)
    n, m = found.convergence.iterations, 90
    assert found.convergence.flops > n * 2 / 3 * (m / 3) ** 3
    assert found.convergence.flops < n * (2 / 3 * m**3 + 200 * m**2)
