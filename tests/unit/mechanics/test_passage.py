"""Steps in time that follow the path of solutions: where bodies jump, and where not."""

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.sources import open_source
from amontons.solvers.contract import Breakdown

W = np.array([[1.0, -1.0], [-1.0, 2.0]])


def one_contact(u_n, u_t, mu=2.0, side=1):
    """One contact that at mu = 2 jams on lifting: W_NN + mu W_NT = -1 < 0."""
    mirror = np.diag([1.0, side])
    return am.FrictionProblem.from_delassus(mirror @ W @ mirror, [[u_n, side * u_t]], [mu])


@pytest.mark.parametrize("side", [1, -1])
def test_one_contact_jumps_where_the_hand_calculation_says(side):
    """Stick r = -W^-1 q meets the cone at q_N = 1/3; slip leads back to q_N = 0, then open."""
    before, step = (one_contact(q, -1.0, side=side) for q in (0.2, 0.4))
    r = -np.linalg.solve(before.W, np.ravel(before.q)).reshape(1, 2)
    found = am.PathCrossing().between(before, step, r)
    assert np.abs(found.r).max() < 1e-14
    assert found.folds == pytest.approx([2 / 3, -1.0], abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_one_contact_with_little_friction_slips_without_a_jump(side):
    """At mu = 0.8 the cone is met at q_N = -1/3, and W_NN + mu W_NT > 0: slip goes on."""
    before, step = (one_contact(q, -1.0, 0.8, side) for q in (-0.9, -0.2))
    r = -np.linalg.solve(before.W, np.ravel(before.q)).reshape(1, 2)
    found = am.PathCrossing().between(before, step, r)
    assert found.folds == ()
    assert found.r[0] == pytest.approx([1.0, side * 0.8], abs=1e-12)  # r_N = 0.2 / (1 - mu)


def test_what_does_not_begin_a_path_is_said():
    before, step = one_contact(0.2, -1.0), one_contact(0.4, -1.0)
    with pytest.raises(Breakdown, match="the last state does not begin a path"):
        am.PathCrossing().between(before, step, np.array([[5.0, 0.0]]))
    r = -np.linalg.solve(W, [0.2, -1.0]).reshape(1, 2)
    with pytest.raises(Breakdown, match="followed to"):
        am.PathCrossing(max_points=2).between(before, step, r)
    with pytest.raises(Breakdown, match="ends at -0.5 of it"):
        am.PathCrossing(back=0.5).between(before, step, r)


def arm():
    """A brake arm that is dragged until it jams, then lifted."""
    return open_source("example:release").model


def test_the_jump_does_not_depend_on_the_steps():
    times, before = [], []
    for h in (0.05, 0.02):
        steps = list(am.evolve(arm(), am.QuasiStatic(h, crossing=am.PathCrossing()), until=2.0))
        jumps = [step for step in steps if step.passage.jumped]
        assert len(jumps) == 1
        assert jumps[0].time - h < jumps[0].passage.folds[0] <= jumps[0].time
        assert all(step.passage.arrived for step in steps[1:])
        assert all(step.solution.converged for step in steps)
        times.append(jumps[0].passage.folds[0])
        before.append(steps[round(1.6 / h) - 1].resultant())
        assert jumps[0].solution.pattern == "fffff"
    assert times[0] == pytest.approx(times[1], abs=2e-3)  # the foot rolls off node by node
    assert before[0] == pytest.approx(before[1], rel=2e-2)


def test_without_a_path_the_arm_lets_go_before_it_must():
    *_, step = am.evolve(arm(), am.QuasiStatic(0.05), until=1.5)
    assert step.solution.pattern == "fffff"
    *_, step = am.evolve(arm(), am.QuasiStatic(0.05, crossing=am.PathCrossing()), until=1.5)
    assert step.solution.pattern.count("s") == 3
    assert step.passage is not None
    assert "without a fold" in step.solution.convergence.detail


def strut(law, scale, angle=0.5):
    """A leaning strut on a plane: pressed and dragged for t < 1, then lifted."""

    def top(x, t):
        drag, lift = min(t, 1.0), max(0.0, t - 1.0)
        return scale * 0.01 * drag, scale * (-0.01 * drag + 0.02 * lift)

    mesh = am.box((0.1, 1.0), cells=(1, 8))
    points = mesh.points @ np.array(
        [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    )
    points[:, 1] -= points[:, 1].min()
    body = am.Body(am.Mesh(points, mesh.cells, mesh.surfaces), law)
    return am.Model(
        [body], [am.Fix("top", top)], [am.Contact("bottom", am.Plane((0, 1)), mu=1.0)]
    )


def test_large_deformations_jump_as_small_ones_do_where_they_are_small():
    method = am.QuasiStatic(0.125, crossing=am.PathCrossing())
    times = []
    for law, scale in ((am.LinearElastic(1.0, 0.3), 1.0), (am.NeoHookean(1.0, 0.3), 0.1)):
        steps = list(am.evolve(strut(law, scale), method, until=2.0))
        (jump,) = [step for step in steps if step.passage.jumped]
        assert all(step.passage.arrived for step in steps)
        assert jump.gap.min() > 0
        times.append(jump.passage.folds)
    assert times[0] == pytest.approx(times[1], rel=1e-3)
    assert times[0][1] == pytest.approx(1.5, abs=1e-9)  # the height at which it first touched


def test_three_dimensions_go_step_by_step():
    """A punch is pressed and slid: the path goes on in every step, no jump."""

    def top(x, t):
        return 0.05 * max(0.0, t - 1), 0.0, -0.1 * min(t, 1.0)

    model = am.Model(
        [am.Body(am.box((1, 1, 1), cells=1), am.LinearElastic(1.0, 0.3))],
        [am.Fix("top", top)],
        [am.Contact("bottom", am.Plane((0.1, 0.05, 1), (0.5, 0.5, -0.1)), mu=0.3)],
    )  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(0.5, crossing=am.PathCrossing()), until=2.0))
    plain = list(am.evolve(model, am.QuasiStatic(0.5), until=2.0, tolerance=1e-11))
    assert not any(step.passage.jumped for step in steps)
    assert any(step.passage.arrived for step in steps)
    for ours, other in zip(steps, plain, strict=True):
        assert ours.resultant() == pytest.approx(other.resultant(), abs=1e-7)


def test_bad_options_are_named():
    with pytest.raises(am.InvalidInput, match="crossing: expected PathCrossing"):
        am.QuasiStatic(0.1, crossing="path")
    with pytest.raises(am.InvalidInput, match="back: expected"):
        am.PathCrossing(back=-1)
    with pytest.raises(am.InvalidInput, match="max_points: expected"):
        am.PathCrossing(max_points=1)
    model = am.Model(
        [am.Body(am.box((1, 1), cells=2), am.LinearElastic(1.0, 0.3))],
        [am.Fix("top", (0.0, -0.1))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.3, method=am.Nitsche())],
    )
    with pytest.raises(am.UnsupportedForm, match="crossing: .*Nitsche"):
        list(am.evolve(model, am.QuasiStatic(0.1, crossing=am.PathCrossing()), until=0.1))


def test_run_tells_the_jump(tmp_path):
    done = CliRunner().invoke(
        main, ["run", "example:release", "--rates", "-o", str(tmp_path / "out")]
    )
    assert done.exit_code == 0, done.output
    assert "a jump is possible: in the steps to t = 1.7" in done.output
    assert "no jump: proved of 39 steps" in done.output
    assert "jumps at t = 1.68691" in done.output
    assert "jumped at t = 1.68691: the path has folds at t = 1.68691, 1.25" in done.output
    with (tmp_path / "out" / "steps.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["jump"]) for row in rows if row["jump"]] == [
        pytest.approx(1.68691, abs=1e-5)
    ]
    assert [row["index"] for row in rows if float(row["jump_possible"])] == ["34"]
    record = json.loads((tmp_path / "out" / "solution.json").read_text(encoding="utf-8"))
    assert record["rates"]["jump_possible"] is False
    plain = CliRunner().invoke(
        main, ["run", "example:release", "--set", "evolution.crossing=false", "--quiet",
               "-o", str(tmp_path / "plain")],
    )  # fmt: skip
    assert plain.exit_code == 0
    wrong = CliRunner().invoke(
        main,
        ["run", "example:release", "--set", "evolution.crossing=3", "-o", str(tmp_path / "x")],
    )
    assert wrong.exit_code == 2
    assert "evolution.crossing" in wrong.output and "true or false" in wrong.output


@pytest.mark.parametrize("side", [1, -1])
def test_all_solutions_of_a_step_that_its_path_reaches(side):
    """At q_N = 0.2 the contact of the first test sticks, slips and is open."""
    before, step = (one_contact(q, -1.0, side=side) for q in (0.1, 0.2))
    r = -np.linalg.solve(before.W, np.ravel(before.q)).reshape(1, 2)
    alone = am.PathCrossing().between(before, step, r)
    assert alone.branch is None
    found = am.PathCrossing(ahead=2).between(before, step, r)
    np.testing.assert_allclose(found.r, alone.r, atol=1e-14)
    assert found.folds == alone.folds == ()
    solutions = [found.branch.problem.solution(y, 1.0) for y in found.branch.at(1.0)]
    assert [s.pattern for s in solutions] == ["s", "+" if side == 1 else "-", "f"]
    assert len(am.all_solutions(step)) == 3
    with pytest.raises(am.InvalidInput, match="ahead"):
        am.PathCrossing(ahead=-1)


def test_the_passage_of_a_step_has_all_its_solutions():
    crossing = am.PathCrossing(ahead=5)
    for step in am.evolve(arm(), am.QuasiStatic(0.1, crossing=crossing), until=1.5):
        assert step.passage.branch is not None
    several = step.passage.branch.at(1.0)
    assert len(several) == len(am.all_solutions(step.solution.problem)) == 3
