"""Numbers of contact pairs and supports: balances, paths gone by hand, works, names."""

import json
from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve

SOFT = am.LinearElastic(200, 0.3)
METHODS = ["nodal", "mortar", "nitsche", am.Nitsche(theta=1.0), am.Nitsche(theta=-1.0)]


def two(dim, method, **contact):
    """A small block on a large one, pressed, dragged and heavy; meshes that match if nodal."""
    flat = (0,) * (dim - 2)
    low = am.Body(am.box((2,) + (1,) * (dim - 1), (4,) + (2,) * (dim - 1)), SOFT, name="low")
    cells = 2 if method == "nodal" else 3
    mesh = am.box((1,) * dim, cells, origin=(0.5, *flat, 1))
    up = am.Body(mesh, am.LinearElastic(100, 0.3), name="up")
    pair = am.Contact("up.bottom", master="low.top", mu=0.3, method=method, **contact)
    supports = [am.Fix("low.bottom", 0), am.Fix("up.top", (0.01, *flat, -0.02))]
    return am.Model([low, up], supports, [pair], [am.BodyForce((*flat, 0.1, -0.5))])


def total(found, what):
    return sum(getattr(held, what) for held in found.supports.values()) + getattr(
        found.load, what
    )


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_forces_and_moments_balance(dim, method):
    """Of the whole, where the pair is inner, and of the upper body, where it is not."""
    found = am.solve(two(dim, method, name="lug"), tolerance=1e-11)
    size = np.linalg.norm(found.load.force)
    np.testing.assert_allclose(total(found, "force"), 0, atol=1e-11 * size)
    np.testing.assert_allclose(total(found, "moment"), 0, atol=1e-11 * size)
    pair, top = found.pairs["lug"], found.supports["up.top"]
    weight = found.load.force / 3  # the upper body has a third of the volume
    np.testing.assert_allclose(pair.force + top.force + weight, 0, atol=1e-9 * size)
    centre = np.array([1.0, *(0.5,) * (dim - 2), 1.5])
    moments = pair.about(centre).moment + top.about(centre).moment  # its weight has none
    np.testing.assert_allclose(moments, 0, atol=1e-9 * size)


def test_several_pairs_and_supports_balance_on_obstacles():
    floor, wall = am.Plane((0, 0, 1)), am.Plane((1, 0, 0))
    body = am.Body(am.box((1, 1, 1), cells=3), SOFT)
    model = am.Model(
        [body], [am.Fix("top", (None, 0.005, -0.02)), am.Fix("right", (-0.01, 0.005, None))],
        [am.Contact("bottom", floor, mu=0.3), am.Contact("left", wall, mu=0.2)],
        [am.Pressure("front", 0.7), am.BodyForce((0, 0.2, -1))],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-11)
    assert list(found.pairs) == ["bottom", "left"]
    for what in ("force", "moment"):
        contact = sum(getattr(pair, what) for pair in found.pairs.values())
        np.testing.assert_allclose(total(found, what) + contact, 0, atol=1e-11)
    np.testing.assert_allclose(
        sum(pair.force for pair in found.pairs.values()), found.resultant, atol=1e-13
    )


def test_an_edge_of_two_supports_counts_once_for_the_first():
    body = am.Body(am.box((1, 1), cells=2), SOFT)
    supports = [am.Fix("top", (0, -0.01)), am.Fix("left", (0, None))]
    model = am.Model([body], supports, [am.Contact("bottom", am.Plane((0, 1)), mu=0.1)])
    found = am.solve(model, tolerance=1e-12)
    assert list(found.supports) == ["top", "left"]
    whole = sum(held.force for held in found.supports.values())
    np.testing.assert_allclose(whole, np.concatenate(found.reaction).sum(axis=0))
    corner = np.flatnonzero((body.mesh.points == (0, 1)).all(axis=1))
    swapped = am.solve(replace(model, supports=supports[::-1]), tolerance=1e-12)
    moved = found.supports["top"].force - swapped.supports["top"].force
    np.testing.assert_allclose(moved, [found.reaction[0][corner[0], 0], 0], atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rigid_body_balances(dim):
    """One that two surfaces hold, under an elastic one; and one that is driven down."""
    flat = (0,) * (dim - 2)
    lid = am.box((1,) * dim, cells=2, origin=(0, *flat, 1))
    base = am.box((1,) * dim, cells=2)
    bodies = [am.Body(lid, SOFT, "lid"), am.Body(base, am.Rigid(), "base")]
    pair = am.Contact("lid.bottom", master="base.top", mu=0.5)
    held = [am.Fix("lid.top", (0.001, *flat, -0.01)), am.Fix("base.bottom", 0),
            am.Fix("base.left", 0)]  # fmt: skip
    loads = [am.BodyForce((*flat, 0.3, -0.2))]
    found = am.solve(am.Model(bodies, held, [pair], loads), tolerance=1e-11)
    (pressed,) = found.pairs.values()
    below = [found.supports[name] for name in ("base.bottom", "base.left")]
    size = np.linalg.norm(pressed.force)
    for what in ("force", "moment"):
        np.testing.assert_allclose(total(found, what), 0, atol=1e-11 * size)
    own = sum(one.force for one in below) - pressed.force
    np.testing.assert_allclose(own + loads[0].value, 0, atol=1e-10 * size)


@pytest.mark.parametrize("law", [am.NeoHookean(200, 0.3), SOFT])
def test_finite_kinematics_balance(law):
    """Arms are those of the deformed body at finite strains, else the undeformed ones."""
    body = am.Body(am.box((2, 1), (6, 3)), law)
    contact = am.Contact("bottom", am.Sphere((1, -4.05), 4), mu=0.4, kinematics="finite")
    model = am.Model([body], [am.Fix("top", (0.1, -0.15))], [contact], [am.Pressure("left", 5)])
    found = am.solve(model, tolerance=1e-11)
    (pair,) = found.pairs.values()
    size = np.linalg.norm(pair.force)
    np.testing.assert_allclose(total(found, "force") + pair.force, 0, atol=1e-9 * size)
    if law is not SOFT:  # a pressure that follows is no load of the undeformed body
        np.testing.assert_allclose(total(found, "moment") + pair.moment, 0, atol=1e-9 * size)
    assert pair.obstacle == "sphere"


def test_dynamics_change_the_momentum():
    body = am.Body(am.box((1, 1), cells=2, origin=(0, 0.01)), replace(SOFT, density=2.0))
    pair = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    model = am.Model([body], [am.Fix("left", (0, None))], [pair], [am.BodyForce((0, -3.0))])
    method, last = MoreauJean(1e-2), at_rest(model)
    for step in evolve(model, method, until=0.5, tolerance=1e-12, start=last):
        held, load = step.supports["left"], step.fields.load
        given = step.pairs["bottom"].force + held.force + load.force
        mean = step.state.velocity.reshape(-1, 2) - last.velocity.reshape(-1, 2)
        weights = np.array([1, 2, 1, 2, 4, 2, 1, 2, 1]) / 16
        order = np.lexsort((body.mesh.points[:, 0], body.mesh.points[:, 1]))
        momentum = 2.0 * weights @ mean[order]
        np.testing.assert_allclose(given * 1e-2, momentum, atol=1e-10)
        last = step.state


# ------------------------------------------------------------------ area, pressure
@pytest.mark.parametrize("method", ["nodal", "mortar"])
def test_a_uniform_pressure(method):
    body = am.Body(am.box((2, 1, 1), (4, 2, 2)), am.LinearElastic(200, 0.0))
    model = am.Model(
        [body], [am.Fix("top", (0, 0, -0.01))],
        [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3, method=method)],
    )  # fmt: skip
    pair = am.solve(model, tolerance=1e-11).pairs["bottom"]
    assert pair.area == pytest.approx(2, rel=1e-12)
    assert pair.largest_pressure == pytest.approx(2, rel=1e-9)
    assert pair.share_sticking == 1
    assert pair.force == pytest.approx([0, 0, 4], abs=1e-9)
    assert pair.moment == pytest.approx([2, -4, 0], abs=1e-8)  # at (1, 1/2, 0)
    assert pair.about((1, 0.5, 7)).moment == pytest.approx([0, 0, 0], abs=1e-8)
    assert pair.about((0, 0, 0)).moment == pytest.approx(pair.moment)


def test_hertz_between_a_cylinder_and_a_plane():
    """K. L. Johnson, Contact mechanics (1985), (4.43), (4.45): p0 and a of a line contact."""
    E, nu, R, push = 1000.0, 0.3, 10.0, 0.02
    n = 48
    body = am.Body(am.box((4, 4), (n, n), origin=(-2, 0)), am.LinearElastic(E, nu))
    roller = am.Sphere((0, -R), R)
    model = am.Model([body], [am.Fix("top", (0, -push))], [am.Contact("bottom", roller, mu=0)])
    pair = am.solve(model).pairs["bottom"]
    modulus = E / (1 - nu**2)
    force = pair.force[1]
    a = np.sqrt(4 * force * R / (np.pi * modulus))
    assert pair.area == pytest.approx(2 * a, abs=2 * 4 / n)  # to the nodes at both ends
    assert pair.largest_pressure == pytest.approx(2 * force / (np.pi * a), rel=0.05)


# ------------------------------------------------------------------ slip and its work
def dragged(ways, mu=0.1, **options):
    xs = np.array([0.0, *ways])
    top = am.Fix("top", (lambda x, t: np.interp(t, range(len(xs)), xs), -0.05))
    body = am.Body(am.box((2, 1), (4, 2)), am.LinearElastic(100, 0.2))
    return am.Model([body], [top], [am.Contact("bottom", am.Plane((0, 1)), mu=mu, name="shoe")],
                    **options)  # fmt: skip


def test_slip_there_and_back():
    """Far past the elastic way: net is where it is, accumulated all of it."""
    steps = list(evolve(dragged([0, 1, 0, 1]), QuasiStatic(0.125), until=4, tolerance=1e-11))
    slips = [step.pairs["shoe"].slip for step in steps]
    net = [step.fields.slid.mean() for step in steps]
    way = [step.fields.path.mean() for step in steps]
    there, back, again = 15, 23, 31
    elastic = 1 - net[there]  # of the way, as the block shears by mu p / G
    assert elastic == pytest.approx(0.1 * 0.05 * 100 / (100 / 2.4), rel=0.2)
    assert net[back] == pytest.approx(elastic, rel=0.02)
    assert net[again] == pytest.approx(net[there], abs=1e-6)
    assert way[back] - way[there] == pytest.approx(1 - 2 * elastic, abs=1e-3)
    assert way[again] - way[back] == pytest.approx(1 - 2 * elastic, abs=1e-3)
    assert slips[back].accumulated == steps[back].fields.path.max()
    assert all(slip.net <= slip.accumulated * (1 + 1e-12) for slip in slips)
    ways = [slip.accumulated for slip in slips]
    assert (np.diff(ways) >= 0).all()


@pytest.mark.parametrize("step", [0.5, 0.0625])
def test_friction_work_is_the_contact_part_of_the_balance(step):
    model = dragged([0, 0.5, 0.1, 0.3])
    steps = list(evolve(model, QuasiStatic(step), until=4, tolerance=1e-12))
    booked = -np.cumsum([s.energies.contact for s in steps])
    found = [s.pairs["shoe"].friction_work for s in steps]
    size = sum(s.energies.turnover for s in steps)
    np.testing.assert_allclose(found, booked, atol=1e-7 * size)
    assert (np.diff(found) >= 0).all()


def test_friction_work_of_steady_sliding_is_force_times_way():
    *_, before, after = evolve(dragged([0, 0.5, 1.0]), QuasiStatic(1.0), until=3)
    work = after.pairs["shoe"].friction_work - before.pairs["shoe"].friction_work
    assert work == pytest.approx(0.1 * after.pairs["shoe"].force[1] * 0.5, rel=1e-6)
    assert after.pairs["shoe"].force[0] == pytest.approx(-0.1 * after.pairs["shoe"].force[1])
    assert after.pairs["shoe"].share_sticking == 0


def test_friction_work_of_a_sliding_block_is_its_kinetic_energy():
    """Thrown along the floor, it stops after v^2 / (2 mu g), and all has become heat."""
    stone = am.LinearElastic(1e9, 0.2, density=1.0)
    body = am.Body(am.box((1, 0.1), (2, 1)), stone)
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0.5)],
                     [am.BodyForce((0, -10.0))])  # fmt: skip
    start = at_rest(model, velocity=(2.0, 0.0))
    method = MoreauJean(1e-2, theta=1.0)
    last = list(evolve(model, method, until=0.6, start=start, tolerance=1e-10))[-1]
    pair = last.pairs["bottom"]
    assert pair.friction_work == pytest.approx(0.5 * 0.1 * 4, rel=0.02)
    assert pair.slip.accumulated == pytest.approx(4 / (2 * 0.5 * 10), rel=0.05)


def test_one_static_step_is_the_first_of_a_run():
    model = two(2, "mortar")
    static = am.solve(model, tolerance=1e-11).pairs["up.bottom"]
    step = next(iter(evolve(model, QuasiStatic(1.0), until=1, tolerance=1e-11)))
    first = step.pairs["up.bottom"]
    assert first.force == pytest.approx(static.force, abs=1e-8)
    assert first.slip.net == pytest.approx(static.slip.net, abs=1e-9)
    assert first.friction_work == pytest.approx(static.friction_work, rel=1e-6)


def test_an_open_pair_has_nothing():
    body = am.Body(am.box((1, 1), cells=2, origin=(0, 1)), SOFT)
    model = am.Model([body], [am.Fix("top", (0.1, 0))], [am.Contact("bottom", am.Plane((0, 1)),
                     mu=0.3)])  # fmt: skip
    pair = am.solve(model).pairs["bottom"]
    numbers = (pair.area, pair.largest_pressure, pair.slip.net, pair.slip.accumulated,
               pair.friction_work, pair.share_sticking)  # fmt: skip
    assert numbers == (0,) * 6
    assert not pair.force.any()


# ------------------------------------------------------------------ names
def test_names_are_those_given_or_of_the_slaves():
    floor, wall = am.Plane((0, 1)), am.Plane((0, 1), (0, -1))
    body = am.Body(am.box((1, 1), cells=2), SOFT)

    def names(*contacts):
        return am.Model([body], [am.Fix("top", (0, -0.01))], contacts).pair_names

    def contact(name="", obstacle=floor):
        return am.Contact("bottom", obstacle, mu=0.1, name=name)

    assert names(contact()) == ("bottom",)
    assert names(contact(), contact("", wall)) == ("bottom 1", "bottom 2")
    assert names(contact("lug"), contact("", wall)) == ("lug", "bottom")
    assert names(contact("bottom"), contact("", wall)) == ("bottom", "bottom 1")
    assert names(contact("bottom 1"), contact(), contact("", wall)) == (
        "bottom 1", "bottom 2", "bottom 3",
    )  # fmt: skip
    with pytest.raises(am.InvalidInput, match="differ, got 'lug' as for contact 0") as reason:
        names(contact("lug"), contact("lug", wall))
    assert reason.value.at == ("contacts", 1, "name")
    with pytest.raises(am.InvalidInput, match="name: expected a text on one line"):
        contact("two\nlines")
    with pytest.raises(am.InvalidInput, match="name: expected a text"):
        contact(3)


def test_a_point_of_another_dimension_is_refused():
    pair = am.solve(two(2, "nodal")).pairs["up.bottom"]
    with pytest.raises(am.InvalidInput, match="point: expected 2 coordinates, got 3"):
        pair.about((0, 0, 0))


def test_records_are_plain_data():
    found = am.solve(two(3, "mortar", name="lug"))
    record = found.pairs["lug"].record
    assert json.loads(json.dumps(record)) == record
    assert record.keys() == {
        "name", "slave", "master", "obstacle", "force", "moment", "point", "area",
        "largest_pressure", "slip", "friction_work", "share_sticking",
    }  # fmt: skip
    names = [record[key] for key in ("name", "slave", "master")]
    assert names == ["lug", "up.bottom", "low.top"]
    assert record["slip"].keys() == {"net", "accumulated"}
