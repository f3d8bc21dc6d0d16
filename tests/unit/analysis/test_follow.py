"""The verbs follow and diagram, and the command line."""

import json
from dataclasses import fields
from importlib import resources

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.analysis.solutions.enumerate import enumerate_solutions
from amontons.app.cli import main
from amontons.app.cli.sources import open_source
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.mechanics.ready.gallery import one_contact_2d
from amontons.mechanics.ready.hild import hild_triangle
from amontons.mechanics.ready.vee import vee

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


class Circle:
    """y^2 + p^2 = 1, with parts that can be replaced by broken ones."""

    def __init__(self, **broken):
        self.__dict__.update(broken)

    def residual(self, y, p):
        return y**2 + p**2 - 1

    def jacobian(self, y, p):
        return np.diag(2 * y), np.array([2 * p])

    def piece(self, y, p):
        return "circle"


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (
            {"residual": lambda y, p: np.zeros(2)},
            r"residual: .* shape \(1,\), got shape \(2,\)",
        ),
        ({"residual": lambda y, p: [0.0]}, "residual: .* got list"),
        ({"residual": lambda y, p: y * np.nan}, "residual: expected finite"),
        ({"jacobian": lambda y, p: np.eye(1)}, "jacobian: expected two"),
        ({"jacobian": lambda y, p: (np.eye(3), y)}, r"jacobian by y: .* got shape \(3, 3\)"),
        ({"jacobian": lambda y, p: (np.eye(1), 0.0)}, "jacobian by p: .* got float"),
        ({"piece": lambda y, p: [1]}, "piece: expected a name"),
        ({"weight": -1.0}, "weight: expected a number > 0, got -1"),
    ],
)
def test_own_problems_that_break_the_protocol_are_told_where(broken, message):
    with pytest.raises(InvalidInput, match=message):
        am.follow(Circle(**broken), interval=(-2, 2), start=[1.0], at=0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"interval": (0, 1, 2)}, "interval: expected two numbers"),
        ({"interval": None}, "interval: expected two numbers"),
        ({"interval": ("a", "b")}, "interval: expected two numbers"),
        ({"at": 5}, "at: expected a number in 0 … 1, got 5"),
        ({"at": "x"}, "at: expected a number"),
        ({"at": np.nan}, "at: expected a number"),
        ({"max_points": "x"}, "max_points: expected a number"),
        ({"max_points": np.nan}, "max_points: expected a number"),
        ({"time_limit": "x"}, "time_limit: expected seconds"),
        ({"callback": 3}, "callback: expected a function"),
        ({"options": {"step": 1}}, "options: expected a Continuation"),
        ({"base": "x"}, "base: expected a Model"),
        ({"steps": 3}, "steps: expected one of max_points"),
    ],
)
def test_bad_arguments_are_named(options, message):
    with pytest.raises(InvalidInput, match=message):
        am.follow(one_contact_2d(), **options)


@pytest.mark.parametrize("at", [[], 0.5, "x", [np.nan], [3.0]])
def test_values_of_a_diagram_are_checked(at):
    with pytest.raises(InvalidInput, match="at: expected"):
        am.diagram(one_contact_2d(), at=at)


def test_large_deformations_have_no_diagram_and_starts_of_their_size():
    body = am.Body(am.box((1, 1), 2), am.NeoHookean(1.0, 0.3))
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)
    model = am.Model([body], [am.Fix("top", (0, -0.1))], contacts=[contact])
    with pytest.raises(UnsupportedForm, match="diagram: .* use follow"):
        am.diagram(model)
    with pytest.raises(InvalidInput, match="start: .* 12 entries, got 3"):
        am.follow(model, start=np.zeros(3))


def test_a_contact_given_twice_is_no_error():
    """How the two share their forces is not determined, so the equations can be singular."""
    single = [[5, 4, 1, 3], [4, 22, 12, -4], [1, 12, 14, -3], [3, -4, -3, 16]]
    twice = [0, 1, 0, 1, 2, 3]
    W, mu = np.array(single, dtype=float)[np.ix_(twice, twice)], [1e6, 1e6, 2.0]
    loads = [[-2, -1], [-2, -1], [0, 2]], [[0, -1], [0, -1], [-1, -2]]
    base, end = (
        am.FrictionProblem.from_delassus(W, np.array(q, dtype=float), mu) for q in loads
    )
    diagram = am.diagram(end, "load", (-1, 2), base=base)
    assert not diagram.complete
    assert "sets of solutions are no curves" in diagram.reason
    assert all(isinstance(stop, am.Stop) for branch in diagram for stop in branch.stops)


def test_a_change_of_status_at_the_start_is_an_event():
    """One contact from open to closed at p = 1: also where the walk begins there."""
    W = [[1.0, 0.2], [0.2, 1.0]]
    open_, closed = (
        am.FrictionProblem.from_delassus(W, [[q, 0.0]], [0.5]) for q in (1.0, -1.0)
    )
    away = am.follow(closed, base=open_, interval=(0, 1))
    at = am.follow(closed, base=open_, interval=(0, 1), start=np.zeros((1, 2)), at=0.5)
    for branch in (away, at):
        (event,) = [e for e in branch.events if e.kind is am.EventKind.STATUS]
        assert event.parameter == pytest.approx(0.5, abs=1e-12)
        assert {event.before, event.after} == {"f", "s"}
    ends = am.follow(closed, base=open_, interval=(0.5, 1), start=np.zeros((1, 2)), at=0.5)
    assert not [e for e in ends.events if e.kind is am.EventKind.STATUS]


def test_parameters_of_the_algorithm_from_case_file_and_command_line(tmp_path):
    case, data = tmp_path / "vee.toml", resources.files("amontons") / "examples_data"
    text = (data / "vee.toml").read_text()
    (tmp_path / "vee.msh").write_bytes((data / "vee.msh").read_bytes())
    case.write_text(text + "\n[continuation]\nmax_step = 0.05\nswitch = \"tangent\"\n")
    counts = []
    for more in ([], ["--set", "continuation.max_step=0.02"]):
        done = CliRunner().invoke(main, [
            "follow", str(case), "--set", "mesh.refine=0", "--json", "-", "-o",
            str(tmp_path / "out"), *more,
        ])  # fmt: skip
        assert done.exit_code == 0, done.output
        found = json.loads(done.output)
        folds = [e["parameter"] for e in found["events"] if e["kind"] == "fold"]
        assert folds == pytest.approx([0.4356565442, 0.3207653196], abs=1e-9)
        steps = np.diff([point["arclength"] for point in found["points"]])
        counts.append(steps.max())
    assert counts[0] > 0.045
    assert counts[1] < 0.0201


@pytest.mark.parametrize("name", [f.name for f in fields(am.Continuation)])
def test_every_parameter_of_the_algorithm_has_a_key(name):
    value = {"switch": "tangent", "max_step": 0.2, "grow": 2, "shrink": 0.4, "quick": 3,
             "corrections": 6, "min_cosine": 0.99, "min_step": 1e-6}  # fmt: skip
    value = value.get(name, 1e-3)
    source = open_source("example:hild", [f"continuation.{name}={value}"])
    options = source.settings.continuation()
    assert getattr(options, name) == (am.Switch.TANGENT if name == "switch" else value)


@pytest.mark.parametrize(("override", "message"), [
    ("continuation.swich=tangent", "no such field; did you mean 'switch'"),
    ("continuation.switch=other", "expected first-order or tangent"),
    ("continuation.step=-1", "expected 0 < min_step"),
    ("continuation.ahead=0", "ahead: expected a number > 0"),
])  # fmt: skip
@pytest.mark.parametrize("source", ["example:vee", "example:hild"])
def test_wrong_parameters_of_the_algorithm_are_named(source, override, message):
    with pytest.raises(am.AmontonsError, match=message):
        open_source(source, [override])


def test_events_and_points_tell_their_index_sets(tmp_path):
    branch = am.follow(vee(0))
    for event in branch.events[1:-1]:
        assert len(event.sets.undecided) == 1  # one contact changes its status at a time
        (contact,) = event.sets.undecided
        assert event.before[contact] != event.after[contact]
    record = branch.record()["events"][1]
    assert set(record["sets"]) == {f.name for f in fields(am.IndexSets)}
    middle = branch[len(branch) // 2]
    sizes = [len(getattr(middle.sets, name)) for name in ("free", "closed", "grazing")]
    assert sum(sizes) == branch.problem.start.contacts
    assert "slip" in str(middle.sets)


def test_tangents_are_public_and_can_be_followed():
    a, b = 2.0, 1.0
    M, H = np.array([[a, -b], [-b, a]]), np.diag([-1.0, 1.0])
    ends = [am.FrictionProblem.from_global(M, H, load, [[0.0, 0.0]], [a / b])
            for load in ((1.0, 0.0), (1.0, -1.0))]  # fmt: skip
    given = {"base": ends[0], "start": [[1.0, 2.0]], "at": 2.0, "interval": (0, 4)}
    system = am.first_order(ends[1], **given)
    assert {t.piece for t in system.tangents} == {"s", "+"}
    for tangent in system.tangents:
        branch = am.follow(ends[1], **given, along=tangent)
        assert branch.stops[0] is am.Stop.NOT_STARTED
        assert branch[0].piece == tangent.piece
    with pytest.raises(InvalidInput, match="along"):
        am.follow(ends[1], **given, along=system)
    with pytest.raises(InvalidInput, match="tolerance"):
        am.first_order(ends[1], **given, tolerance=0)


def test_tangents_of_problems_that_only_name_the_active_piece():
    class Kink:
        def residual(self, y, p):
            return y - 2 * np.maximum(p, 0) + np.minimum(p, 0)

        def jacobian(self, y, p):
            return np.eye(1), np.array([-2.0 if p > 0 else 1.0])

        def piece(self, y, p):
            return p > 0

    system = am.first_order(Kink(), start=[0.0], at=0.0, interval=(-1, 1))
    slopes = sorted((np.sign(t.rate), float(t.direction[0] / t.rate)) for t in system.tangents)
    np.testing.assert_allclose(slopes, [(-1, -1), (1, 2)], atol=1e-9)
    assert not system.complete
    inside = am.first_order(Kink(), start=[1.0], at=0.5, interval=(-1, 1))
    assert len(inside.tangents) == 2


def test_a_curve_goes_on_from_its_points_and_events():
    branch = am.follow(vee(0))
    fold = branch.folds[0]
    for problem in (vee(0), branch.problem):
        system = am.first_order(problem, start=fold)
        assert {t.piece for t in system.tangents} == {fold.before, fold.after}
        ends = [am.follow(problem, start=fold, along=t)[-1].parameter for t in system.tangents]
        assert sorted(ends) == [0, 1]
    point = branch[5]
    system = am.first_order(branch.problem, start=point.state, at=point.parameter)
    assert point.piece in {t.piece for t in system.tangents}
    assert am.follow(branch.problem, interval=(0.0, 0.2))[-1].parameter == 0.2
    with pytest.raises(InvalidInput, match="start: expected 20 unknowns, got 19"):
        am.follow(branch.problem, start=point.state[:-1], at=point.parameter)


def test_sets_of_solutions_are_told_by_the_event():
    M, H = np.array([[2.0, -1], [-1, 2]]), np.diag([-1.0, 1.0])
    ends = [am.FrictionProblem.from_global(M, H, load, [[0.0, 0.0]], [2.0])
            for load in ((0.0, 0.0), (1.0, -2.0))]  # fmt: skip
    branch = am.follow(ends[1], base=ends[0], start=[[0.0, 0.0]], at=0.0)
    (event,) = [e for e in branch.events if e.kind is am.EventKind.BRANCH]
    assert "a set of them on +" in event.detail
    (cone,) = am.first_order(ends[1], base=ends[0], start=event).cones
    assert len(cone.edges) == 2
