"""Branches over what was asked for, with their orientation, in figures and as CSV."""

import csv

import numpy as np
import pytest
from legible import faults

import amontons as am
from amontons.io.plots import branch_figure
from amontons.mechanics.ready.vee import vee


@pytest.fixture(scope="module")
def model():
    return vee()


@pytest.fixture(scope="module")
def branch(model):
    return am.follow(model, "load", (0, 1))


class Parabola:
    """y^2 = p: two solutions for p > 0, a fold at 0."""

    def residual(self, y, p):
        return y**2 - p

    def jacobian(self, y, p):
        return np.array([[2 * y[0]]]), np.array([-1.0])

    def piece(self, y, p):
        return "one"


def test_orientation_changes_at_folds_only(branch):
    sign = branch.orientation
    assert len(sign) == len(branch) - 1
    assert set(sign.tolist()) == {-1, 1}
    turns = np.flatnonzero(np.diff(sign)) + 1
    folds = [event.parameter for event in branch.folds]
    assert branch.parameter[turns] == pytest.approx(folds)
    assert sign[0] == sign[-1] == 1


def test_orientation_is_that_of_all_solutions(model, branch):
    """Three at 0.38; those of the exact search have the same signs, one by one."""
    at = 0.38
    found = am.all_solutions(branch.problem.at(at))
    assert len(found) == 3
    p = branch.parameter
    low, high = np.minimum(p[:-1], p[1:]), np.maximum(p[:-1], p[1:])
    crossed = np.flatnonzero((low < at) & (at < high))
    told = {s.pattern: s.orientation for s in found.solutions}
    states = branch.at(at)
    assert len(states) == len(crossed) == 3
    for y, k in zip(states, crossed, strict=True):
        assert told[branch.problem.solution(y, at).pattern] == branch.orientation[k]


def test_orientation_of_a_problem_of_ones_own():
    curve = am.follow(Parabola(), start=[1.0], at=1.0, interval=(-1.0, 2.0))
    middle = (curve.states[:-1, 0] + curve.states[1:, 0]) / 2
    away = np.abs(middle) > 0.05
    assert (curve.orientation[away] == np.sign(middle[away])).all()
    assert curve.plot().axes[0].get_ylabel() == "size of the unknowns"
    assert curve.values("arclength") == pytest.approx(curve.arclength)
    with pytest.raises(am.InvalidInput, match="no contacts"):
        curve.values("r_N 0")


def test_values_by_name(model, branch):
    r = np.array([s.r for s in branch.solutions])
    u = np.array([s.u for s in branch.solutions])
    assert branch.values("load") == pytest.approx(branch.parameter)
    assert branch.values("parameter") == pytest.approx(branch.parameter)
    assert branch.values("r_N 3") == pytest.approx(r[:, 3, 0])
    assert branch.values("r_T 3") == pytest.approx(r[:, 3, 1])
    assert branch.values("u_T 0") == pytest.approx(u[:, 0, 1])
    assert branch.values("sum r_T") == pytest.approx(r[:, :, 1].sum(axis=1))
    assert branch.values("norm") == pytest.approx(np.linalg.norm(r, axis=(1, 2)))
    # on the plane y = 0, n is y
    force = branch.values("force y", model)
    assert force == pytest.approx(branch.values("sum r_N"), abs=1e-12)
    assert branch.values(lambda s: s.r[3, 0]) == pytest.approx(r[:, 3, 0])


def test_displacements_of_a_surface(model, branch):
    """Slip is displacement along the plane; clamped ends do not move."""
    slip = np.array([s.u[:, 1] for s in branch.solutions])
    mean = branch.values("displacement x contact", model)
    assert np.abs(mean) == pytest.approx(np.abs(slip.mean(axis=1)), rel=1e-9, abs=1e-12)
    assert branch.values("displacement y clamped", model) == pytest.approx(0.0)


def test_prescribed_displacements_grow_with_the_load():
    body = am.Body(am.box((2, 1), cells=(4, 2)), am.LinearElastic(100.0, 0.3))
    for push in ((0.02, -0.03), lambda x, t: (0.02 * t, -0.03 * t)):
        pressed = am.Model([body], [am.Fix("top", push)],
                           [am.Contact("bottom", am.Plane((0, 1)), mu=0.4)])  # fmt: skip
        curve = am.follow(pressed, "load", (0, 1))
        assert curve.values("displacement y top", pressed) == pytest.approx(
            -0.03 * curve.parameter
        )
        assert curve.values("displacement x top", pressed) == pytest.approx(
            0.02 * curve.parameter
        )


@pytest.mark.parametrize(
    ("name", "why"),
    [("wrong", "this branch has parameter"), ("r_N 99", "no contact 99"), ("r_N -1", "contact"),
     ("force x", "needs the model"), ("pattern", "no numbers"), ("", "this branch has"),
     (3, "a name or a function")],
)  # fmt: skip
def test_wrong_names_are_refused(branch, name, why):
    with pytest.raises(am.InvalidInput, match=why):
        branch.values(name)
    with pytest.raises(am.InvalidInput, match=why):
        branch.plot(y=name)


def test_wrong_axes_and_surfaces_are_refused(model, branch):
    with pytest.raises(am.InvalidInput, match="no axis 'z'"):
        branch.values("force z", model)
    with pytest.raises(am.InvalidInput, match="contact"):
        branch.values("displacement x bottom", model)


def test_dashes_between_the_folds(branch):
    figure = branch.plot(title="a")
    axes = figure.axes[0]
    lines = [line for line in axes.lines if line.get_marker() == "None"]
    assert [line.is_dashed() for line in lines] == [False, True, False]
    folds = sorted(event.parameter for event in branch.folds)
    dashed = lines[1].get_xdata()
    assert [dashed.min(), dashed.max()] == pytest.approx(folds)
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == ["fold", "orientation −1"]
    assert faults(figure) == []


def test_choice_of_axes(model, branch):
    figure = branch_figure(branch, y="displacement x contact", x="sum r_N", model=model)
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("sum r_N", "displacement x contact")
    points = np.concatenate([line.get_xydata() for line in axes.lines[:3]])
    assert points[0] == pytest.approx([0.0, branch.values("displacement x contact", model)[0]])
    assert faults(figure) == []


def test_branches_of_a_diagram_have_names(model):
    found = am.diagram(model, "load", (0.3, 0.5))
    figure = found.plot(title="all")
    assert faults(figure) == []
    named = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert (named[0] == "branch 0") is (len(found) > 1)


def test_csv_reads_back_as_it_was(model, branch, tmp_path):
    branch.to_csv(tmp_path / "b.csv", "sum r_N", "displacement x contact", model=model)
    with open(tmp_path / "b.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(branch)
    assert [float(row["load"]) for row in rows] == branch.parameter.tolist()
    assert [float(row["sum r_N"]) for row in rows] == branch.values("sum r_N").tolist()
    assert [int(row["orientation"]) for row in rows][:-1] == branch.orientation.tolist()
    assert sum(int(rows[5][name]) for name in ("open", "slip", "stick")) == 19
    assert rows[3]["pattern"] == branch.table()[3]["pattern"]


def test_csv_of_a_diagram_numbers_its_branches(tmp_path):
    problem = am.FrictionProblem.from_delassus([[2.0, 0.5], [0.5, 1.0]], [[-1.0, 0.3]], 0.4)
    found = am.diagram(problem, "load", (0.5, 1.0))
    found.to_csv(tmp_path / "d.csv")
    rows = (tmp_path / "d.csv").read_text().splitlines()
    assert len(rows) == 1 + sum(len(b) for b in found)
    assert rows[0].startswith("load," if len(found) == 1 else "branch,load,")
