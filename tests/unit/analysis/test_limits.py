"""Jamming and collapse against formulas: wedges, columns, hinges of arches."""

from dataclasses import replace

import numpy as np
import pytest
from block_assemblies import arch, column, four_hinges, groove, running_bond, sideways
from motion_patterns import least_load

import amontons as am
from amontons.app.cli.sources import open_source
from amontons.core.clock import Deadline
from amontons.mechanics.ready.gallery import GALLERY


def wedge(degrees, material):
    """A wedge between two planes: rigid or not, it jams at the tangent of its half angle."""
    mesh = am.box((2, 10), cells=(2, 3), origin=(-1, 0))
    x, y = mesh.points.T
    angle = np.radians(degrees)
    points = np.column_stack([x * (4 + y * np.tan(angle)), y])
    c, s = np.cos(angle), np.sin(angle)
    mesh = replace(mesh, points=points, grid=None, levels=())
    return am.Model(
        [am.Body(mesh, material)],
        contacts=[am.Contact("right", am.Plane((-c, s), (4.0, 0)), mu=0.3),
                  am.Contact("left", am.Plane((c, s), (-4.0, 0)), mu=0.3)],
        loads=[am.BodyForce((0, -1.0))],
    )  # fmt: skip


MODEL = wedge(20, am.Rigid(1.0))
MATERIALS = {"rigid": am.Rigid(1.0), "elastic": am.LinearElastic(100, 0.3)}


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
@pytest.mark.parametrize("degrees", [5, 20, 40])
def test_a_wedge_jams_at_the_tangent_of_its_half_angle(degrees, material):
    found = am.jamming_friction(wedge(degrees, material))
    wanted = np.tan(np.radians(degrees))
    assert found.lower <= wanted * (1 + 1e-9) and found.upper >= wanted * (1 - 1e-9)
    assert found.upper - found.lower <= 3e-6 * wanted and found.every


def test_the_brake_arm():
    model = open_source("example:brake").model
    found = am.jamming_friction(model)
    assert found.lower < found.upper == pytest.approx(0.38638, abs=1e-5)
    W = model.assemble().condensed().W
    r = found.r.ravel()
    assert np.abs((W @ r)[::2]).max() <= 1e-12 * np.abs(W @ np.abs(r)).max()  # u_N = 0
    assert (np.abs(found.r[:, 1]) <= found.upper * found.r[:, 0] * (1 + 1e-12)).all()
    v = found.v  # strictly inside of the dual cone
    assert (v[:, 0] > found.lower * (1 - 1e-5) * np.abs(v[:, 1])).all()


def test_discs_in_space_are_cut_as_far_as_needed():
    """A cone in a conical hole, rigid: the tangent again, and not that of a polygon."""
    angle = np.radians(20)
    turn = 2 * np.pi * np.arange(7) / 7
    normal = np.column_stack([-np.cos(angle) * np.cos(turn), -np.cos(angle) * np.sin(turn),
                              np.full(7, np.sin(angle))])  # fmt: skip
    place = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(7)])
    around = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(7)])
    along = np.cross(normal, around)
    H = np.zeros((6, 21))
    for i in range(7):
        for k, axis in enumerate((normal[i], around[i], along[i])):
            H[:, 3 * i + k] = [*axis, *np.cross(place[i], axis)]
    problem = am.FrictionProblem.from_global(
        np.zeros((6, 6)), H, np.zeros(6), np.zeros((7, 3)), np.full(7, 0.1)
    )
    found = am.jamming_friction(problem, time_limit=5)
    assert found.lower <= np.tan(angle) * (1 + 1e-9) <= found.upper * (1 + 2e-6)
    assert found.upper == pytest.approx(np.tan(angle), rel=1e-4)


def test_a_wedge_of_an_unsymmetric_matrix_jams_by_its_rows():
    """W = F^T H: reactions hold each other where H r = 0, at tan 0.4, whatever F is."""

    def wedge(a):
        c, s = np.cos(a), np.sin(a)
        return np.array([[c, -s, -c, s], [s, c, s, c]])

    W = wedge(0.8).T @ wedge(0.4)
    problem = am.FrictionProblem.from_delassus(W, np.zeros((2, 2)), [0.3] * 2)
    found = am.jamming_friction(problem)
    assert found.lower <= np.tan(0.4) * (1 + 1e-9) <= found.upper * (1 + 2e-6)
    assert found.upper == pytest.approx(np.tan(0.4), rel=1e-4)


def test_what_never_jams_and_what_is_refused():
    free = am.FrictionProblem.from_delassus(np.eye(2), [[0.0, 0.0]], [0.5])
    found = am.jamming_friction(free)
    assert found.r is None and found.lower > 100 and found.every
    tresca = am.FrictionProblem.from_delassus(np.eye(2), [[0.0, 0.0]], am.Tresca([1.0]))
    with pytest.raises(am.UnsupportedLaw, match="expected Coulomb"):
        am.jamming_friction(tresca)
    apart = am.Model(
        [am.Body(am.box((1, 1), 1, origin=(0, 0.1)), am.LinearElastic(1, 0.3))],
        [am.Fix("top", 0)], [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
    )  # fmt: skip
    assert "No contact touches" in str(am.jamming_friction(apart))


def test_the_search_for_patterns_that_jam_counts_its_programs():
    """Without a limit of the clock it has an end too: here before all patterns were seen."""
    random = np.random.default_rng(5)
    A = random.standard_normal((20, 21))
    problem = am.FrictionProblem.from_delassus(
        A @ A.T, np.zeros((10, 2)), random.uniform(0.5, 1, 10)
    )
    deadline = Deadline.counted(0.1)
    found = am.jamming_friction(problem, time_limit=deadline)
    assert deadline.passed and not found.every and found.examined < 100


# ------------------------------------------------------------------ collapse
def on_one(block, point):
    """A weight that grows on one voussoir."""

    def live(k, centre, area):
        return ((0.0, -1.0), np.array(point)) if k == block else ((0.0, 0.0), centre)

    return live


ARCHES = {  # radius, thickness, angle, voussoirs, live load
    "Oppenheim 1992": (10, 1.5, np.radians(157.5), 7, sideways),
    "semicircle": (10, 2.0, np.pi, 9, sideways),
    "weight beside the crown": (10, 2.0, np.radians(120), 12, on_one(8, (-3.0, 9.0))),
}


@pytest.mark.parametrize("name", ARCHES)
def test_arches_collapse_by_four_hinges(name):
    *shape, live = ARCHES[name]
    problem, grows = arch(*shape, 0.7, live)
    found = am.collapse_load(problem, grows)
    wanted = four_hinges(*shape, live)
    assert found.upper == pytest.approx(wanted, rel=1e-7)
    assert found.lower < wanted and found.width < 0.01
    if name.startswith("Opp"):
        assert wanted == pytest.approx(0.37, abs=0.005)  # of g, as published


@pytest.mark.parametrize(("count", "width", "height", "mu"),
                         [(1, 1, 2, 0.7), (1, 2, 1, 0.4), (5, 1, 0.5, 0.7), (4, 3, 0.5, 0.3)])
def test_columns_overturn_or_slide(count, width, height, mu):
    problem, grows = column(count, width, height, mu)
    found = am.collapse_load(problem, grows)
    wanted = min(width / (count * height), mu)
    assert found.upper == pytest.approx(wanted, rel=1e-7)
    assert found.lower < wanted and found.width < 0.01


def test_a_body_that_supports_hold_does_not_collapse():
    """Its stiffness balances all: without this its nodes were taken for blocks of their own."""
    held = am.Model(
        [am.Body(am.box((1, 0.5), (2, 1)), am.LinearElastic(100, 0.3))],
        [am.Fix("top", 0)], [am.Contact("bottom", am.Plane((0, 1)), mu=0.4)],
        [am.BodyForce((0, -1))],
    )  # fmt: skip
    with pytest.raises(am.InvalidInput, match="supports hold every body"):
        am.collapse_load(held, [am.BodyForce((1, 0))])


@pytest.mark.parametrize("weight", [1e-12, 1e9])
def test_units_of_the_live_load_change_nothing(weight):
    """A live load of one beside a dead load of a billion is less than programs keep to."""
    problem, grows = column(1, 1, 2, 0.7)
    heavy = replace(problem, f=problem.f * weight)
    found = am.collapse_load(heavy, grows)
    assert found.upper == pytest.approx(0.5 * weight, rel=1e-7)
    assert found.width < 0.01
    assert found.begins.upper == pytest.approx(0.5 * weight, rel=1e-6)
    assert grows @ found.begins.w == pytest.approx(1.0)
    balance = heavy.H @ found.begins.r.ravel() + heavy.f + found.begins.upper * grows
    assert np.abs(balance).max() < 1e-9 * np.abs(found.begins.r).max()


@pytest.mark.parametrize("seed", [6, 19, 31])
def test_a_motion_begins_where_all_patterns_say(seed):
    """Grooves, in two of which slip that does not dilate gives way before limit analysis."""
    problem, grows = groove(seed)
    wanted = least_load(problem.H.toarray(), problem.f, grows, problem.mu)
    found = am.collapse_load(problem, grows)
    first = found.begins
    assert first.lower <= wanted and first.upper == pytest.approx(wanted, rel=1e-6)
    assert first.width < 3e-3 and first.violation < 1e-9 and first.residual < 1e-9
    if seed != 6:
        assert wanted < 0.96 * found.upper
        assert first.width < 1e-5
    assert grows @ first.w == pytest.approx(1.0)
    balance = problem.H @ first.r.ravel() + problem.f + first.upper * grows
    assert np.abs(balance).max() < 1e-9 * np.abs(first.r).max()


@pytest.mark.parametrize(("rows", "blocks", "mu"), [(3, 2, 0.65), (5, 1, 0.65)])
def test_walls_with_head_joints_are_bounded_closely(rows, blocks, mu):
    """A low wall slides at mu, as a whole; a slender one gives way before limit analysis."""
    problem, grows = running_bond(rows, blocks, 0.4, 0.175, mu)
    found = am.collapse_load(problem, grows, gap=0.5)
    assert found.begins.width < 1e-5
    if rows == 3:
        assert found.begins.upper == pytest.approx(mu, rel=1e-6)
    else:
        assert found.begins.upper < 0.95 * found.upper
    assert "A motion that the live load drives can begin at" in str(found)


@pytest.mark.parametrize(("rows", "blocks", "load"), [(4, 1, 0.479262), (2, 2, 40 / 49)])
def test_rough_walls_give_way_where_contacts_decided_one_by_one_say(rows, blocks, load):
    """At friction 2 sequences of programs miss the least load, and one relaxation the proof.

    The loads are those of the best states that the mixed-integer program of HiGHS finds, which
    proves nothing of them in minutes.
    """
    problem, grows = running_bond(rows, blocks, 0.4, 0.175, 2.0)
    found = am.collapse_load(problem, grows)
    first = found.begins
    assert first.width < 2e-3 and first.upper < 0.9 * found.upper
    assert first.violation < 1e-9 and first.residual < 1e-9
    assert first.upper == pytest.approx(load, rel=1e-5)


def test_what_can_not_be_relaxed_in_time_still_has_a_witness():
    """Ferris and Tin-Loi's first wall: .64286 by limit analysis; real slip gives way before."""
    problem, grows = running_bond(6, 5, 0.4, 0.175, 0.65)
    found = am.collapse_load(problem, grows, time_limit=Deadline.counted(2.0))
    assert found.upper == pytest.approx(0.64286, abs=5e-6)
    assert found.begins.upper < 0.641 and found.begins.lower == found.lower
    assert found.begins.violation < 1e-6


def test_a_wall_of_blocks_is_bounded_on_both_sides():
    """Where both differ nothing is claimed in between; the frictionless wall can not stand."""
    wall = am.Wall(2, 2, (2.0, 1.0), (2, 1), am.LinearElastic(1, 0.3, density=1.0),
                   bond=am.Bond.STACK, rigid=True)  # fmt: skip
    model = wall.model(loads=[am.BodyForce((0, -1.0))])
    found = am.collapse_load(model, [am.BodyForce((1.0, 0.0))], gap=0.05)
    assert 0 < found.lower <= found.upper < 1
    pushed = am.collapse_load(model, [am.BodyForce((0.0, -1.0))])
    assert pushed.upper == np.inf and "Any live load" in str(pushed)
    lifted = replace(model, loads=[am.BodyForce((0, 1.0))])
    assert not am.collapse_load(lifted, [am.BodyForce((1.0, 0.0))]).balanced


def test_wrong_live_loads_are_refused():
    problem, _ = column(1, 1, 2, 0.7)
    with pytest.raises(am.InvalidInput, match=r"live: expected shape \(3,\)"):
        am.collapse_load(problem, np.zeros(2))
    with pytest.raises(am.InvalidInput, match=r"live.*: expected a finite number"):
        am.collapse_load(problem, [np.nan, 0, 0])
    with pytest.raises(am.InvalidInput, match="live: expected numbers"):
        am.collapse_load(problem, "sideways")
    with pytest.raises(am.InvalidInput, match="gap: expected a number"):
        am.collapse_load(problem, np.ones(3), gap="narrow")
    for loads in ([1, 0], am.BodyForce((1.0, 0.0)), None):
        with pytest.raises(am.InvalidInput, match="live: expected loads of the model"):
            am.collapse_load(MODEL, loads)
    with pytest.raises(am.InvalidInput, match="global form"):
        am.collapse_load(GALLERY["one-contact"](), np.zeros(2))
