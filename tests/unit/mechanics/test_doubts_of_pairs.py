"""What results say of pairs that can not be trusted: meshes that do not match, long slips."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from two_meshes import joined, write_gmsh

import amontons as am
from amontons.app.cli import main
from amontons.mechanics.contact.mismatch import mismatch
from amontons.mechanics.ready.walls import Wall
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve

SOFT = am.LinearElastic(young=100, poisson=0.3)
STEEL = am.LinearElastic(young=210e3, poisson=0.3)
METHODS = ["nodal", "mortar", "nitsche"]


OURS = {"nodal-on-non-matching-meshes", "sliding-beyond-pairs", "sliding-beyond-curvature"}


def doubts(result):
    """What the result says of its pairs; some of these models turn or have no load besides."""
    return [warning for warning in result.warnings if warning.name in OURS]


def names(result):
    return [warning.name for warning in doubts(result)]


def stack(d, lower, upper, kinds=(None, None), *, method=None, drop=-0.01, along=0.0):
    """A block on a block of the same footprint, pressed and pushed from its top."""
    up = (0.0,) * (d - 1)
    low = am.box((1.0,) * d, lower, kinds[0], origin=(*up, -1.0))
    high = am.box((1.0,) * d, upper, kinds[1])
    push = (along, *up[1:], drop)
    return am.Model(
        [am.Body(low, SOFT, "low"), am.Body(high, SOFT, "high")],
        [am.Fix("low.bottom", (0.0,) * d), am.Fix("high.top", push)],
        [am.Contact("high.bottom", master="low.top", mu=0.1, method=method)],
    )


def ring(inner, outer, cells, length=30.0):
    """A quarter of a ring around z, with its surfaces named."""
    grid = am.box((1, 1, 1), cells)
    radius = inner + (outer - inner) * grid.points[:, 0]
    angle = np.pi / 2 * grid.points[:, 1]
    x = np.c_[radius * np.cos(angle), radius * np.sin(angle), length * grid.points[:, 2]]
    names = {"left": "inner", "right": "outer", "front": "y0", "back": "x0", "bottom": "z0"}
    return am.Mesh(x, grid.cells, {new: grid.surfaces[old] for old, new in names.items()})


def press_fit(shaft, hub, method, overlap=0.02):
    """Lamé: 63.0 between shaft and hub of 10, 20, 40 and an overlap of 0.02."""
    bodies = [am.Body(ring(10, 20 + overlap, shaft), STEEL, "a"),
              am.Body(ring(20, 40, hub), STEEL, "b")]  # fmt: skip
    held = [am.Fix(f"{q}.{side}", value) for q in "ab" for side, value in (
        ("y0", (None, 0, None)), ("x0", (0, None, None)), ("z0", (None, None, 0)))]  # fmt: skip
    pair = am.Contact("a.outer", master="b.inner", mu=0, method=method)
    return am.Model(bodies, held, [pair])


# ------------------------------------------------------------------ which method by default
def test_bodies_meet_by_mortar_and_obstacles_by_nodes():
    assert am.Contact("a", master="b", mu=0).method == "mortar"
    assert am.Contact("a", am.Plane((0, 1)), mu=0).method == "nodal"
    assert am.Contact("a", master="b", mu=0, method="nodal").method == "nodal"
    wall = Wall(rows=2, blocks=2, size=(2, 1), cells=(2, 1), material=SOFT)
    assert {contact.method for contact in wall.contacts} == {"nodal"}


@pytest.mark.parametrize("d", [2, 3])
def test_a_uniform_pressure_passes_by_default(d):
    low, high = ((3, 2), (7, 1)) if d == 2 else ((4, 5, 1), (3, 3, 1))
    free = am.LinearElastic(100, 0.0)
    model = stack(d, low, high)
    bodies = [am.Body(body.mesh, free, body.name) for body in model.bodies]
    solution = am.solve(am.Model(bodies, model.supports, model.contacts), tolerance=1e-12)
    assert solution.pressure == pytest.approx(np.full(len(solution.pressure), 0.5), rel=1e-9)
    assert not doubts(solution)


CASE = """
[mesh]
file = "two.msh"
[material.default]
young = 100.0
poisson = 0.3
[[fix]]
on = "floor"
value = [0.0, 0.0]
[[fix]]
on = "roof"
value = [{along}, -0.01]
[[contact]]
slave = "high"
master = "low"
friction = {{ coulomb = 0.1 }}
{method}
"""


def run_case(folder, monkeypatch, method="", along=0.0):
    """The record of a case of two blocks in one mesh, and what is said."""
    monkeypatch.chdir(folder)
    low, high = am.box((1, 1), (3, 2), origin=(0, -1)), am.box((1, 1), (4, 2))
    write_gmsh(folder / "two.msh", joined(low, high))
    (folder / "case.toml").write_text(CASE.format(method=method, along=along))
    done = CliRunner().invoke(main, ["solve", "case.toml"])
    assert done.exit_code == 0, done.output
    record = (folder / "case-results" / "solution.json").read_text()
    return json.loads(record), done.output


def test_case_files_have_the_same_default_and_warnings(tmp_path, monkeypatch):
    plain, told = run_case(tmp_path, monkeypatch)
    nodal, nodal_told = run_case(tmp_path, monkeypatch, 'method = "nodal"')
    assert am.read_case("case.toml").model.contacts[0].method == "nodal"
    assert plain["warnings"] == []
    assert "warning" not in told
    (warning,) = nodal["warnings"]
    assert warning["name"] == "nodal-on-non-matching-meshes"
    assert warning["contacts"]
    assert "'mortar'" in warning["message"]
    assert "[nodal-on-non-matching-meshes]" in nodal_told
    far, far_told = run_case(tmp_path, monkeypatch, along=0.5)
    assert am.read_case("case.toml").model.contacts[0].method == "mortar"
    assert [w["name"] for w in far["warnings"]] == ["sliding-beyond-pairs"]
    assert "[sliding-beyond-pairs]" in far_told


# ----------------------------------------------------------------------- meshes that match
MATCHING = [
    (2, (4, 1), (4, 3), (None, None)), (2, (4, 2), (4, 1), ("tri", "quad")),
    (3, (3, 2, 1), (3, 2, 2), (None, None)), (3, (2, 2, 1), (2, 2, 1), ("tet", "tet")),
    (2, (3, 1), (6, 1), (None, None)),  # nested in a coarser master: also exact
]  # fmt: skip


@pytest.mark.parametrize(("d", "low", "high", "kinds"), MATCHING)
def test_matching_meshes_are_silent(d, low, high, kinds):
    assert not names(am.solve(stack(d, low, high, kinds, method="nodal")))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("method", METHODS)
def test_meshes_that_do_not_match_are_told_of_with_nodes_only(d, method):
    low, high = ((3, 2), (4, 1)) if d == 2 else ((4, 5, 1), (3, 3, 1))
    solution = am.solve(stack(d, low, high, method=method))
    wanted = ["nodal-on-non-matching-meshes"] if method == "nodal" else []
    assert names(solution) == wanted
    for warning in doubts(solution):
        assert set(warning.contacts) <= set(np.flatnonzero(solution.pressure > 0))
        assert "%" in warning.message


def test_mismatch_is_how_unevenly_a_uniform_pressure_arrives():
    """Three facets on two, by hand: 1/9 and 1/9 + 2/9 arrive where 1/4 and 1/2 are due."""
    low, high = am.box((1, 1), (2, 1), origin=(0, -1)), am.box((1, 1), (3, 1))
    found = mismatch(high, "bottom", low, "top").force
    end = abs(1 / 6 + 1 / 3 * 1 / 3 - 1 / 4) / (1 / 4)
    middle = abs(2 * 1 / 3 * 2 / 3 - 1 / 2) / (1 / 2)
    assert found == pytest.approx([max(end, middle)] * 4)


@pytest.mark.parametrize(("shaft", "hub"), [((2, 13, 3), (3, 9, 2)), ((2, 12, 2), (3, 12, 2))])
def test_facets_behind_a_curved_surface_are_told_of(shaft, hub):
    """275 for 63 in a press fit: the chords of the hub stand out by four times the overlap."""
    exact, nodal = (am.solve(press_fit(shaft, hub, m)) for m in ("mortar", "nodal"))
    mean, wrong = ((s.pressure * s.weights).sum() / s.weights.sum() for s in (exact, nodal))
    assert mean == pytest.approx(63.0, rel=0.05)
    assert not names(exact)
    if shaft[1] == hub[1]:
        assert wrong == pytest.approx(63.0, rel=0.05)
        assert not names(nodal)
        return
    assert wrong > 3 * 63
    (warning,) = doubts(nodal)
    assert "behind its curved surface" in warning.message
    share = float(warning.message.split("surface, ")[1].split("%")[0]) / 100
    assert wrong / mean - 1 == pytest.approx(share, rel=0.25)  # as much as is said


def test_flat_facets_lie_behind_nothing():
    """Their slopes are rounding: the blocks of the wall's example were told of 7.7e-34."""
    low = am.box((0.4, 0.2, 0.2), (4, 2, 2), origin=(0.1, 0, 0.4))
    high = am.box((0.4, 0.2, 0.2), (4, 2, 2), origin=(0.3, 0, 0.6))
    for angle in (0.0, 0.2, 0.5):  # off the axes
        cos, sin = np.cos(angle), np.sin(angle)
        turn = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
        one, two = (am.Mesh(m.points @ turn, m.cells, m.surfaces) for m in (high, low))
        assert not mismatch(one, "bottom", two, "top").behind.any()


def test_nitsche_sees_curved_surfaces_too():
    solution = am.solve(press_fit((2, 13, 3), (3, 9, 2), "nitsche"))
    mean = (solution.pressure * solution.weights).sum() / solution.weights.sum()
    assert mean == pytest.approx(63.0, rel=0.05)


# ------------------------------------------------------------------------------ long slips
def slider(d, along, method=None, *, lower=12, length=4.0):
    """A block of four cells on a longer one, whose facets are a third of its length."""
    low = am.box((length, *(1.0,) * (d - 1)), (lower,) + (2,) * (d - 1),
                 origin=(-1, *(0,) * (d - 2), -1))  # fmt: skip
    high = am.box((1.0,) * d, (4,) + (2,) * (d - 1))
    push = (along, *(0.0,) * (d - 2), -0.01)
    return am.Model(
        [am.Body(low, SOFT, "low"), am.Body(high, SOFT, "high")],
        [am.Fix("low.bottom", (0.0,) * d), am.Fix("high.top", push)],
        [am.Contact("high.bottom", master="low.top", mu=0.1, method=method)],
    )


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("method", ["mortar", "nitsche"])
@pytest.mark.parametrize(
    ("along", "told"),
    [(0.01, ""), (0.25, ""), (0.4, "1.2 times"), (-0.4, "1.2 times"), (2.4, "7.2 times")],
)
def test_slip_over_a_facet_is_told_of(d, method, along, told):
    solution = am.solve(slider(d, along, method))
    if not told:
        assert not doubts(solution)
        return
    (warning,) = doubts(solution)
    assert warning.name == "sliding-beyond-pairs"
    assert told in warning.message
    assert ("off its edge" in warning.message) == (along == 2.4)
    assert "'high.bottom' with 'low.top'" in warning.message
    assert len(warning.contacts) == (solution.pressure > 0).sum()


def test_slip_off_the_edge_is_told_of_however_short():
    """Half a facet over the end of the master; the same slip with room before the end."""
    off = am.solve(stack(2, (2, 1), (2, 1), drop=-0.03, along=0.25))
    (warning,) = doubts(off)
    assert "1 of them off its edge by up to 0.2" in warning.message
    assert len(warning.contacts) == 1
    assert not names(am.solve(slider(2, 0.25, lower=8)))
    assert not names(am.solve(stack(2, (2, 1), (2, 1), drop=-0.03, along=0.03)))


def test_a_master_of_one_cell_knows_no_more_than_the_length_of_its_slave():
    assert not names(am.solve(slider(2, 0.4, lower=1)))
    assert names(am.solve(slider(2, 1.3, lower=1))) == ["sliding-beyond-pairs"]


def test_pairs_of_a_sticking_or_open_contact_are_not_doubted():
    sticking = slider(2, 0.4)
    contact = am.Contact("high.bottom", master="low.top", mu=1e3)
    assert not names(am.solve(am.Model(sticking.bodies, sticking.supports, [contact])))
    away = [am.Fix("low.bottom", (0.0, 0.0)), am.Fix("high.top", (2.0, 0.1))]
    assert not names(am.solve(am.Model(sticking.bodies, away, sticking.contacts)))


def test_only_the_contact_that_slides_is_named():
    """Two blocks side by side on one master; contacts are numbered through the result."""
    model = slider(2, 0.01, length=5.0)
    other = am.Body(am.box((1, 1), (4, 2), origin=(2, 0)), SOFT, "other")
    far = am.Model(
        [*model.bodies, other], [*model.supports, am.Fix("other.top", (0.5, -0.01))],
        [*model.contacts, am.Contact("other.bottom", master="low.top", mu=0.1)],
    )  # fmt: skip
    solution = am.solve(far)
    (warning,) = doubts(solution)
    assert "'other.bottom'" in warning.message
    assert set(warning.contacts) == {5, 6, 7, 8, 9}


def test_steps_in_time_add_their_slip_up():
    model = slider(2, 0.0)
    push = am.Fix("high.top", (lambda x, t: 0.15 * t, -0.01))
    moving = am.Model(model.bodies, [model.supports[0], push], model.contacts)
    steps = list(evolve(moving, QuasiStatic(1.0), until=4))
    assert [names(step) for step in steps] == [[], [], ["sliding-beyond-pairs"]] + [
        ["sliding-beyond-pairs"]]  # fmt: skip
    assert "sliding-beyond-pairs" in str(steps[-1])
    assert "sliding" not in str(steps[0])


def test_dynamics_too_and_not_along_planes():
    heavy = am.LinearElastic(young=100, poisson=0.3, density=1.0)
    low = am.Body(am.box((4, 1), (12, 2), origin=(-1, -1)), heavy, "low")
    high = am.Body(am.box((1, 1), (4, 2)), heavy, "high")
    load = [am.BodyForce((0, -1.0))]
    pair = am.Model([low, high], [am.Fix("low.bottom", 0)],
                    [am.Contact("high.bottom", master="low.top", mu=0)], load)  # fmt: skip
    plane = am.Model([high], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0)], load)
    method = MoreauJean(step=0.02, theta=1)
    found = []
    for model, speed in ((pair, [(0, 0), (1.0, 0)]), (plane, (1.0, 0))):
        start = at_rest(model, velocity=speed)
        found.append([names(s) for s in evolve(model, method, until=0.6, start=start)])
    assert found[0][0] == []
    assert found[0][-1] == ["sliding-beyond-pairs"]
    assert not any(found[1])


# -------------------------------------------------------------------------- curved obstacles
def on_a_ball(radius, along, *, kind="sphere", method="nodal", load=-0.02):
    block = am.Body(am.box((10, 2), (40, 8), origin=(-5, 0)), SOFT)
    level = am.LevelSet(lambda x: np.hypot(x[:, 0], x[:, 1] + radius) - radius)
    flat = am.LevelSet(lambda x: 2 * x[:, 1])
    under = {"sphere": am.Sphere((0, -radius), radius), "level": level, "flat": flat,
             "plane": am.Plane((0, 1))}[kind]  # fmt: skip
    return am.Model([block], [am.Fix("top", (along, load))],
                    [am.Contact("bottom", under, mu=0.1, method=method)])  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["sphere", "level"])
@pytest.mark.parametrize(
    ("radius", "along", "told"),
    [(50, 0.1, False), (50, 3.0, True), (500, 1.0, False), (5, 1.0, True)],
)
def test_long_slips_along_curved_obstacles_are_told_of(method, kind, radius, along, told):
    solution = am.solve(on_a_ball(radius, along, kind=kind, method=method))
    assert names(solution) == ["sliding-beyond-curvature"] * told
    for warning in doubts(solution):
        assert "degrees" in warning.message


@pytest.mark.parametrize("kind", ["plane", "flat"])
def test_no_slip_is_too_long_along_a_plane(kind):
    assert not names(am.solve(on_a_ball(1.0, 30.0, kind=kind)))


def test_an_obstacle_that_ends_before_the_slip_does():
    wide = am.LevelSet(lambda x: np.where(x[:, 0] > 7, np.nan, x[:, 1] + x[:, 0] ** 2 / 100))
    model = on_a_ball(50.0, 3.0, load=-0.5)
    model = am.Model(model.bodies, model.supports, [am.Contact("bottom", wide, mu=0.1)])
    (warning,) = doubts(am.solve(model))
    assert warning.name == "sliding-beyond-curvature"
    assert "ends before that" in warning.message


def test_contact_where_nodes_are_needs_no_warning():
    block = am.Body(am.box((1, 1), 2, origin=(-0.5, 0)), am.NeoHookean(young=100, poisson=0.3))
    ball = am.Contact("bottom", am.Sphere((0, -2), 2.0), mu=0.1)
    model = am.Model([block], [am.Fix("top", (0.5, -0.1))], [ball])
    assert not names(am.solve(model))


# ------------------------------------------------------------ into what nobody looked at
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("along", "height", "told"), [(2.0, 0.2, True), (0.4, 0.2, False),
                                                       (2.0, 0.05, False)])  # fmt: skip
def test_open_contacts_that_pass_into_a_bump_are_told_of(method, along, height, told):
    """A block hovers over a flat part of its master and is moved to where that is higher."""
    ground = am.box((4, 1), (16, 2), origin=(-1, -1))
    x, y = ground.points.T
    rise = np.clip((x - 1.5) / 0.5, 0, 1) * height * (y + 1)
    low = am.Mesh(ground.points + np.c_[0 * x, rise], ground.cells, ground.surfaces)
    high = am.box((1, 1), (5, 2), origin=(0, 0.1))
    model = am.Model(
        [am.Body(low, SOFT, "low"), am.Body(high, SOFT, "high")],
        [am.Fix("low.bottom", 0), am.Fix("high.top", (along, 0))],
        [am.Contact("high.bottom", master="low.top", mu=0.1, method=method)],
    )  # fmt: skip
    solution = am.solve(model, check=False)
    assert not (solution.pressure > 0).any()
    assert names(solution) == ["sliding-beyond-pairs"] * told
    for warning in doubts(solution):
        assert "passed into another part" in warning.message


@pytest.mark.parametrize(("along", "told"), [(2.5, True), (-2.5, True), (0.2, False)])
def test_open_contacts_that_pass_into_the_wall_of_a_bowl_are_told_of(along, told):
    """Over its bottom the tangent is level; along it the wall is never met."""
    block = am.Body(am.box((0.2, 1), (2, 4), origin=(-0.1, 0.2)), SOFT)
    bowl = am.LevelSet(lambda x: 5 - np.hypot(x[:, 0], x[:, 1] - 5))
    model = am.Model([block], [am.Fix("top", (along, 0))], [am.Contact("bottom", bowl, mu=0.1)])
    solution = am.solve(model, check=False)
    assert not (solution.pressure > 0).any()
    assert names(solution) == ["sliding-beyond-curvature"] * told
    for warning in doubts(solution):
        assert "have passed into it" in warning.message
