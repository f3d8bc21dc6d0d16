"""The verb `solve`: models and problems, failures with their record, forwarding."""

import subprocess
import sys

import numpy as np
import pytest

import amontons as am
from amontons.app.api import solve_any_form
from amontons.mechanics.ready.gallery import box_tower, one_contact_2d, random_delassus


@pytest.fixture(scope="module")
def model():
    block = am.Body(am.box((1, 1), cells=4), am.LinearElastic(200, 0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", (0.02, -0.02))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.4)],
        name="block",
    )


def test_problem_gives_a_friction_solution():
    solution = am.solve(random_delassus(0, 6))
    assert isinstance(solution, am.FrictionSolution)
    assert solution.converged


def test_model_gives_a_model_solution(model):
    solution = am.solve(model)
    assert isinstance(solution, am.ModelSolution)
    assert solution.converged
    assert solution.problem is model.assemble()
    assert solution.displacement[0].shape == (25, 2)
    assert solution.pressure.min() >= 0
    force = (solution.pressure * solution.weights).sum()
    assert solution.resultant[1] == pytest.approx(force)
    assert len(solution.pattern) == solution.r.shape[0] == 5
    assert {"r", "pressure", "write"} <= set(dir(solution))
    with pytest.raises(AttributeError, match="colour"):
        _ = solution.colour


def test_summary_reads_well(model):
    text = str(am.solve(model))
    assert "block: 5 contacts in 2D" in text
    assert "converged with Auto" in text
    assert "resultant on the slave: x " in text


def test_failure_raises_with_the_record():
    with pytest.raises(am.NotConverged, match="Allow more iterations") as caught:
        am.solve(random_delassus(1, 8), am.GaussSeidel(), tolerance=1e-12, max_iterations=1)
    assert caught.value.solution.convergence.outcome is am.Outcome.MAX_ITERATIONS
    assert np.isfinite(caught.value.solution.r).all()


def test_failure_of_a_model_carries_its_fields(model):
    with pytest.raises(am.NotConverged) as caught:
        am.solve(model, am.GaussSeidel(), tolerance=1e-12, max_iterations=1)
    assert isinstance(caught.value.solution, am.ModelSolution)


def test_check_false_returns_the_best():
    solution = am.solve(
        random_delassus(1, 8), am.GaussSeidel(), tolerance=1e-12, max_iterations=1, check=False
    )
    assert not solution.converged


def test_interrupt_keeps_the_best_iterate():
    def interrupt(step, iterate):
        raise KeyboardInterrupt

    problem = random_delassus(2, 8)
    with pytest.raises(am.Interrupted) as caught:
        am.solve(problem, am.GaussSeidel(), tolerance=1e-13, callback=interrupt)
    assert caught.value.solution.convergence.outcome is am.Outcome.STOPPED
    assert caught.value.solution.r.any()


def test_callback_stops():
    with pytest.raises(am.NotConverged, match="by the callback"):
        am.solve(
            random_delassus(2, 8), am.GaussSeidel(), tolerance=1e-13, callback=lambda s, i: True
        )


def test_start_from_a_solution(model):
    first = am.solve(model)
    again = am.solve(model, start=first)
    assert again.convergence.iterations == 0
    problem = random_delassus(0, 6)
    assert am.solve(problem, start=am.solve(problem)).convergence.iterations == 0


def test_a_model_is_condensed_for_gauss_seidel(model):
    swept = am.solve(model, am.GaussSeidel(), tolerance=1e-10)
    reference = am.solve(model, tolerance=1e-10)
    assert swept.pattern == reference.pattern
    np.testing.assert_allclose(swept.displacement[0], reference.displacement[0], atol=1e-9)


def test_a_problem_keeps_its_form():
    with pytest.raises(am.UnsupportedForm, match="condensed"):
        am.solve(box_tower(2), am.GaussSeidel())
    solution = solve_any_form(box_tower(2), am.GaussSeidel())
    assert solution.converged
    assert solution.v.shape == (12,)
    assert solution.problem.form is am.Form.GLOBAL


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0}, "tolerance"),
        ({"tolerance": np.nan}, "tolerance"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"time_limit": -1}, "time_limit"),
    ],
)
def test_options_refused(options, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.solve(one_contact_2d(), **options)


@pytest.mark.parametrize("thing", [None, 3, "case.toml", np.eye(3)])
def test_neither_model_nor_problem(thing):
    with pytest.raises(am.InvalidInput, match="expected a Model or a FrictionProblem"):
        am.solve(thing)


def test_the_verb_survives_the_import_of_its_module():
    code = (
        "import amontons as am, amontons.solvers.driver\n"
        "from amontons.solvers.driver import drive\n"
        "assert callable(am.solve) and am.solve.__module__ == 'amontons.app.api'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_fclib_work_loads_no_mesh_library():
    code = (
        "import sys, amontons as am\nfrom amontons.mechanics.ready.gallery import box_tower\n"
        "am.solve(box_tower(1))\nfrom amontons.app import cli\n"
        "assert 'ngsolve' not in sys.modules and 'meshio' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
