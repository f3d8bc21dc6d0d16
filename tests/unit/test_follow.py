"""The verbs follow and diagram, and the command line."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.analysis.solutions.enumerate import enumerate_solutions
from amontons.cli import main
from amontons.errors import InvalidInput
from amontons.gallery import one_contact_2d
from amontons.hild import hild_triangle
from amontons.vee import vee

SQUARE = am.box((1, 1), 3)


def pressed(value=(0.1, -0.2), mu=0.5):
    return am.Model(
        [am.Body(SQUARE, am.LinearElastic(young=1.0, poisson=0.3))],
        supports=[am.Fix("top", value)],
        contacts=[am.Contact("bottom", am.Plane(point=(0, -0.05), normal=(0, 1)), mu=mu)],
    )


def end_of(branch):
    return branch.problem.solution(branch.points[-1].state, branch.points[-1].parameter)


def test_load_factor_of_a_model_keeps_the_gaps():
    branch = am.follow(pressed())
    first = next(e for e in branch.events if e.kind is am.EventKind.STATUS)
    assert 0.2 < first.parameter < 0.3  # the gap closes at a quarter of the way
    solved = am.solve(pressed(), tolerance=1e-12)
    np.testing.assert_allclose(end_of(branch).r, solved.r, atol=1e-11)


def test_loads_in_time_are_followed_in_time():
    moving = pressed(lambda x, t: (0.1 * t, -0.2 + 0.1 * t))
    branch = am.follow(moving, "load", (0.5, 1.5))
    solved = am.solve(pressed((0.15, -0.05)), tolerance=1e-12)
    np.testing.assert_allclose(end_of(branch).r, solved.r, atol=1e-10)
    with pytest.raises(InvalidInput, match="no straight line in time"):
        am.follow(pressed(lambda x, t: (0.1 * t**2, -0.2)), "load", (0.0, 1.0))


def test_from_one_load_to_another():
    a, b = pressed((0.0, -0.2)), pressed((0.3, -0.2))
    branch = am.follow(b, base=a)
    np.testing.assert_allclose(end_of(branch).r, am.solve(b, tolerance=1e-12).r, atol=1e-10)
    start = branch.problem.solution(branch.points[0].state, 0.0)
    np.testing.assert_allclose(start.r, am.solve(a, tolerance=1e-12).r, atol=1e-10)


def test_a_start_can_be_given_and_events_and_steps_agree():
    solution = am.solve(pressed().with_load(0.7), tolerance=1e-12)
    exact = am.follow(pressed(), start=solution, at=0.7)
    steps = am.follow(pressed(), start=solution, at=0.7, options=am.Continuation())
    np.testing.assert_allclose([e.parameter for e in exact.events],
                               [e.parameter for e in steps.events], atol=1e-9)  # fmt: skip
    assert len(steps) > len(exact)


def test_hild_folds_at_friction_three():
    """[Hild]: up to 3 the open solution only; at 3 all contacts stick at their bound."""
    diagram = am.diagram(hild_triangle(3), "friction", (0.5, 4.0), at=[0.5, 4.0])
    assert diagram.complete
    assert diagram.critical == pytest.approx(3.0, abs=1e-9)
    assert len(diagram.solutions(3.5)) == len(am.all_solutions(hild_triangle(3, mu=3.5))) == 3


def test_diagram_of_the_vee_has_one_branch():
    diagram = am.diagram(vee(0))
    assert diagram.complete
    assert len(diagram) == 1
    assert len(diagram.solutions(0.38)) == 3
    path = diagram.branches[0].problem
    assert len(enumerate_solutions(path.at(0.38).condensed())) == 3


def test_own_path_problems():
    class Line:
        def residual(self, y, p):
            return y - p

        def jacobian(self, y, p):
            return np.eye(1), -np.ones(1)

        def piece(self, y, p):
            return 0

    branch = am.follow(Line(), interval=(0, 2), start=np.zeros(1))
    assert branch.points[-1].state == pytest.approx([2.0])
    with pytest.raises(InvalidInput, match="needs the unknowns"):
        am.follow(Line())


def test_bad_input_is_refused():
    with pytest.raises(InvalidInput, match="parameter: expected one of load, friction"):
        am.follow(pressed(), "mu")
    with pytest.raises(InvalidInput, match="friction >= 0"):
        am.follow(pressed(), "friction", (-1, 1))
    with pytest.raises(InvalidInput, match="start: expected reactions of shape"):
        am.follow(pressed(), start=np.zeros(3))
    with pytest.raises(InvalidInput, match="problem: expected a Model"):
        am.follow("vee")
    with pytest.raises(InvalidInput, match="base"):
        am.follow(pressed(), "friction", base=pressed())


def test_command_line(tmp_path):
    runner = CliRunner()
    place = tmp_path / "out"
    done = runner.invoke(
        main, ["follow", "example:vee", "--set", "mesh.refine=0", "-o", str(place)]
    )
    assert done.exit_code == 0, done.output
    assert "fold" in done.output
    found = json.loads((place / "follow.json").read_text())
    assert [e["kind"] for e in found["events"]].count("fold") == 2
    point = found["points"][5]
    assert {"parameter", "arclength", "contacts", "norm"} <= set(point)
    assert set(point["contacts"]) == {"open", "slip", "stick"}
    assert (place / "follow.png").stat().st_size > 5000


def test_command_line_with_all_branches(tmp_path):
    place = str(tmp_path / "out")
    done = CliRunner().invoke(main, ["follow", "example:one-contact", "--parameter", "friction",
                                     "--from", "0.5", "--to", "3", "--all", "-o", place,
                                     "--json", "-"])  # fmt: skip
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert found["complete"] is True
    assert len(found["branches"]) == 2
    (fold,) = [e["parameter"] for e in found["events"] if e["kind"] == "fold"]
    assert fold == pytest.approx(1.4, abs=1e-10)  # |r_T| / r_N of the sticking solution
    assert len(am.all_solutions(one_contact_2d(1.39))) == 1
    assert len(am.all_solutions(one_contact_2d(1.41))) == 3
    bad = CliRunner().invoke(main, ["follow", "example:vee", "--from", "1", "--to", "0"])
    assert bad.exit_code == 2
