"""The driver: every outcome, from solvers made to end in it."""

import pickle
import time
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.solution import Outcome
from amontons.solvers import GaussSeidel, Hybrid
from amontons.solvers.contract import Breakdown, Iterate
from amontons.solvers.driver import PATIENCE, drive

PROBLEM = FrictionProblem.from_delassus(2 * np.eye(3), [[-2.0, 0, 0]], [0.5])
SOLUTION = np.array([[1.0, 0, 0]])


@dataclass(frozen=True)
class Scripted:
    """Yields r_N = 1 + offset for every offset, then raises or ends."""

    form: ClassVar[Form] = Form.DELASSUS
    offsets: list = field(default_factory=list)
    ending: BaseException | None = None
    pause: float = 0.0

    def iterates(self, problem, start, target):
        for offset in self.offsets:
            time.sleep(self.pause)
            yield Iterate(SOLUTION + [[offset, 0, 0]], linear_iterations=2)
        if self.ending is not None:
            raise self.ending


def falling(n):
    return [2.0**-k for k in range(n)]


ENDINGS = [
    (Scripted([0.5, 0.1, 0.0]), {}, Outcome.CONVERGED, 3),
    (Scripted(falling(20)), {"max_iterations": 5}, Outcome.MAX_ITERATIONS, 5),
    (Scripted(falling(20), pause=0.02), {"time_limit": 0.03}, Outcome.TIME_LIMIT, 2),
    (Scripted([0.5] * (PATIENCE + 9)), {}, Outcome.STAGNATED, PATIENCE + 2),
    (Scripted([0.5]), {}, Outcome.STAGNATED, 1),
    (Scripted([0.5, 0.3, 0.5, 0.3]), {}, Outcome.CYCLED, 3),
    (Scripted([0.5, np.nan, 0.0]), {}, Outcome.NON_FINITE, 2),
    (Scripted([0.5, 1e-9]), {"contact_tolerance": 1e-12}, Outcome.WEAK_CONTACTS, 4),
    (Scripted([0.5], Breakdown("no direction")), {}, Outcome.BREAKDOWN, 1),
    (Scripted([0.5], KeyboardInterrupt()), {}, Outcome.STOPPED, 1),
    (
        Scripted([0.5, 0.0]),
        {"callback": lambda step, _: step.iteration == 1},
        Outcome.STOPPED,
        1,
    ),
]


@pytest.mark.parametrize(("solver", "options", "outcome", "iterations"), ENDINGS)
def test_every_outcome(solver, options, outcome, iterations):
    record = drive(PROBLEM, solver, **options).convergence
    assert record.outcome is outcome
    assert record.iterations <= iterations
    if outcome is not Outcome.STAGNATED and outcome is not Outcome.TIME_LIMIT:
        assert record.iterations == iterations
    assert outcome.advice.endswith(".")


def test_all_outcomes_are_covered():
    assert {ending[2] for ending in ENDINGS} == set(Outcome)


def test_reason_is_kept():
    record = drive(PROBLEM, Scripted([0.5], Breakdown("no direction"))).convergence
    assert record.detail == "no direction"
    assert "no direction" in str(record)


def test_best_iterate_is_returned():
    solution = drive(PROBLEM, Scripted([0.5, 0.001, 0.3], Breakdown("end")))
    np.testing.assert_allclose(solution.r, [[1.001, 0, 0]])
    np.testing.assert_allclose(solution.u, [[0.002, 0, 0]])
    assert solution.convergence.error == pytest.approx(PROBLEM.error(solution.r))
    assert solution.convergence.error == min(s.error for s in solution.convergence.history)


def test_best_iterate_survives_interrupt_and_overflow():
    for solver in (Scripted([0.1], KeyboardInterrupt()), Scripted([0.1, np.inf])):
        np.testing.assert_allclose(drive(PROBLEM, solver).r, [[1.1, 0, 0]])


def test_history_is_consistent():
    record = drive(PROBLEM, Scripted([0.5, 0.2, 0.1, 0.0])).convergence
    assert [s.iteration for s in record.history] == [0, 1, 2, 3, 4]
    assert [s.linear_iterations for s in record.history] == [0, 2, 4, 6, 8]
    assert record.linear_iterations == 8
    seconds = [s.seconds for s in record.history]
    assert seconds == sorted(seconds)
    assert seconds[-1] <= record.seconds
    assert record.history[-1].error == record.error == 0


def test_convergence_is_the_judges_word_only():
    """A solver that claims the end with a wrong reaction is stagnated, not converged."""
    solution = drive(PROBLEM, Scripted([1e-6]), tolerance=1e-8)
    assert not solution.converged
    assert solution.convergence.error > 1e-8
    assert drive(PROBLEM, Scripted([1e-9]), tolerance=1e-8).converged


def test_a_callback_can_not_hide_convergence():
    assert drive(PROBLEM, Scripted([0.0]), callback=lambda *_: True).converged


def test_a_repeated_iterate_is_no_cycle():
    solution = drive(PROBLEM, Scripted([0.5, 0.5, 0.5, 0.2, 0.0]))
    assert solution.converged


def test_start_from_the_solution_needs_no_iteration():
    first = drive(PROBLEM, GaussSeidel())
    again = drive(PROBLEM, GaussSeidel(), start=first)
    assert again.converged
    assert again.convergence.iterations == 0
    np.testing.assert_array_equal(again.r, first.r)


def test_without_load_no_start_is_in_the_way():
    """Its error is infinite, whatever it is, from where Newton's method had overflowed."""
    problem = FrictionProblem.from_delassus(2 * np.eye(3), np.zeros((1, 3)), [0.5])
    solution = drive(problem, am.SemismoothNewton(), start=Iterate(np.array([[1e-13, 0, 0]])))
    assert solution.converged and not solution.r.any()


def test_start_is_not_modified():
    start = Iterate(np.array([[0.3, 0.0, 0.0]]))
    assert drive(PROBLEM, GaussSeidel(), start=start).converged
    np.testing.assert_array_equal(start.r, [[0.3, 0, 0]])


@pytest.mark.parametrize("d", [2, 3])
def test_nothing_to_do(d):
    quiet = FrictionProblem.from_delassus(np.eye(d), np.zeros((1, d)), [0.5])
    empty = FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, d)), [])
    for problem in (quiet, empty):
        solution = drive(problem, GaussSeidel())
        assert solution.converged
        assert solution.convergence.iterations == 0
        assert not solution.r.any()
        assert solution.pattern == "f" * problem.contacts


def test_a_floating_body_is_a_breakdown_and_no_crash():
    stiffness = sparse.diags_array(
        [-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(60, 60)
    ).tolil()
    stiffness[0, 0] = stiffness[59, 59] = 1
    problem = FrictionProblem.from_global(
        stiffness, np.eye(60)[:, :3], np.ones(60), np.zeros((1, 3)), [0.5]
    )

    @dataclass(frozen=True)
    class Condensing(Scripted):
        form: ClassVar[Form] = Form.GLOBAL

        def iterates(self, problem, start, target):
            yield Iterate(problem.condensed().q)

    solution = drive(problem, Condensing())
    assert solution.convergence.outcome is Outcome.BREAKDOWN
    assert np.isfinite(solution.u).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": 0.0}, "tolerance: .*0.0"),
        ({"tolerance": np.nan}, "tolerance: .*nan"),
        ({"max_iterations": 0}, "max_iterations: .*0"),
        ({"time_limit": 0.0}, "time_limit: .*0.0"),
        ({"start": Iterate(np.zeros((2, 3)))}, r"start: .*\(1, 3\).*\(2, 3\)"),
        ({"start": Iterate(np.full((1, 3), np.nan))}, "start: .*finite"),
    ],
)
def test_rejects(options, message):
    with pytest.raises(InvalidInput, match=message):
        drive(PROBLEM, GaussSeidel(), **options)


def test_the_wrong_form_names_what_fits():
    problem = FrictionProblem.from_global(
        np.eye(3), np.eye(3), np.ones(3), np.zeros((1, 3)), [0.5]
    )
    with pytest.raises(
        UnsupportedForm, match=r"GaussSeidel needs the local form.*condensed\(\)"
    ):
        drive(problem, GaussSeidel())
    with pytest.raises(InvalidInput, match="start: expected v of 3 entries, got 4"):
        drive(problem, start=Iterate(np.zeros((1, 3)), np.zeros(4)))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"solver": "gauss-seidel"}, "solver"),
        ({"solver": am.GaussSeidel}, "solver"),
        ({"tolerance": "a"}, "tolerance"),
        ({"max_iterations": "a"}, "max_iterations"),
        ({"time_limit": "a"}, "time_limit"),
        ({"callback": 3}, "callback"),
        ({"start": np.zeros((1, 3))}, "start"),
    ],
)
def test_wrong_types_are_named(options, text):
    with pytest.raises(am.InvalidInput, match=text):
        drive(PROBLEM, **options)


def test_returned_arrays_are_read_only():
    solution = drive(PROBLEM)
    with pytest.raises(ValueError, match="read-only"):
        solution.r[0, 0] = 1.0


def test_not_converged_survives_pickling():
    error = am.NotConverged("no", None)
    assert str(pickle.loads(pickle.dumps(error))) == "no"


def test_interrupt_in_the_first_factorisation_is_not_repeated(monkeypatch):
    block = am.Body(am.box((1, 1, 1), cells=3), am.LinearElastic(young=200, poisson=0.3))
    contact = am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.5)
    problem = am.Model([block], [am.Fix("top", (0, 0, -0.1))], [contact]).assemble()

    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(type(problem.matrices), "factor", interrupted)
    solution = drive(problem)
    assert solution.convergence.outcome is am.Outcome.STOPPED
    assert not solution.r.any()
    assert solution.counts["open"] == problem.contacts


def test_a_stale_v_of_the_start_is_not_returned():
    problem = FrictionProblem.from_global(
        np.eye(3), np.eye(3), [-1.0, 0.0, 0.0], [[0, 0, 0]], [0.5]
    )
    solved = drive(problem)
    again = drive(problem, start=Iterate(solved.r.copy(), np.full(3, 7.0)))
    assert again.convergence.iterations == 0
    np.testing.assert_allclose(again.v, solved.v, atol=1e-12)


@dataclass(frozen=True)
class Listening:
    """Yields r_N = 1 + offset for every offset and keeps what it is told of each."""

    form: ClassVar[Form] = Form.DELASSUS
    offsets: list = field(default_factory=list)
    told: list = field(default_factory=list)

    def iterates(self, problem, start, target):
        for offset in self.offsets:
            self.told.append((yield Iterate(SOLUTION + [[offset, 0, 0]])))


@dataclass(frozen=True)
class Plain:
    """The same as an iterator that can not be told, or as a list."""

    form: ClassVar[Form] = Form.DELASSUS
    kind: type = iter

    def iterates(self, problem, start, target):
        return self.kind(Iterate(SOLUTION + [[offset, 0, 0]]) for offset in (0.5, 0.1, 0.0))


def test_a_solver_is_told_of_every_iterate():
    solver = Listening([0.5, 0.1, 1e-9, 0.2, 0.0])
    found = drive(PROBLEM, solver, contact_tolerance=1e-12, time_limit=60)
    history = found.convergence.history
    assert [told.error for told in solver.told[:2]] == [step.error for step in history[1:3]]
    assert all(told.contact_error is None for told in solver.told[:2])
    assert all(0 < told.seconds_left <= 60 for told in solver.told)


def test_a_solver_is_told_of_its_weakest_contact():
    """A method with a rule of its own is asked on where the sum alone will do."""

    @dataclass(frozen=True)
    class Ruled(Listening):
        def iterates(self, problem, start, target):
            for offset in self.offsets:
                near = Iterate(SOLUTION + [[offset, 0, 0]], ends="")
                self.told.append((yield near))

    solver = Ruled([0.5, 1e-9, 0.0])
    drive(PROBLEM, solver, contact_tolerance=1e-12)
    assert solver.told[0].contact_error is None
    assert solver.told[1].error < 1e-8
    assert 1e-12 < solver.told[1].contact_error < 1e-8


@pytest.mark.parametrize("kind", [iter, list, tuple])
@pytest.mark.parametrize("wrap", [False, True])
def test_plain_iterators_work(kind, wrap):
    solver = Hybrid(first=Plain(kind), main=Plain(kind)) if wrap else Plain(kind)
    record = drive(PROBLEM, solver).convergence
    assert record.outcome is Outcome.CONVERGED
    assert record.iterations == (4 if wrap else 3)


def test_the_parts_of_a_hybrid_are_told():
    first, main = Listening([0.5, 0.4, 0.3]), Listening([0.2, 0.1, 0.0])
    solver = Hybrid(first=first, main=main, iterates_of_first=2)
    history = drive(PROBLEM, solver).convergence.history
    assert [step.error for step in history[1:]] == [
        PROBLEM.error(SOLUTION + [[offset, 0, 0]]) for offset in (0.5, 0.4, 0.2, 0.1, 0.0)
    ]
    assert [told.error for told in first.told] == [history[1].error]
    assert [told.error for told in main.told] == [history[3].error, history[4].error]


def test_the_main_part_of_a_hybrid_starts_where_the_first_ends():
    starts = []

    @dataclass(frozen=True)
    class Noting(Listening):
        def iterates(self, problem, start, target):
            starts.append(start.r[0, 0])
            yield from super().iterates(problem, start, target)

    drive(PROBLEM, Hybrid(first=Listening([0.5, 0.3]), main=Noting([0.0]), iterates_of_first=2))
    drive(PROBLEM, Hybrid(first=Listening([]), main=Noting([0.0])))
    np.testing.assert_allclose(starts, [1.3, 0.0])
