"""Rigid bodies: exact motion, supports on them, statics, mixtures with deformable bodies."""

import numpy as np
import pytest

import amontons as am

STONE = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
HEAVY = am.Rigid(density=1000)
GRAVITY = 9.81


def block(dim, material=HEAVY, cells=1):
    return am.Body(am.box((2.0, 1.0, 1.0)[:dim], cells), material)


def on_floor(dim, mu, **options):
    up = (0.0,) * (dim - 1) + (1.0,)
    weight = am.BodyForce((0.0,) * (dim - 1) + (-1000 * GRAVITY,))
    loads = [weight, *options.pop("loads", ())]
    floor = am.Contact("bottom", am.Plane(up), mu=mu)
    return am.Model([block(dim, **options)], [], [floor], loads)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("cells", [1, 2])
def test_a_sliding_block_is_slowed_by_friction_as_galileo_says(dim, cells):
    model = on_floor(dim, 0.3, cells=cells)
    start = am.at_rest(model, velocity=(1.0,) + (0.0,) * (dim - 1))
    method = am.MoreauJean(step=1e-3, theta=1)
    last = list(am.evolve(model, method, until=0.1, start=start, tolerance=1e-10))[-1]
    assert last.problem.unknowns == (3 if dim == 2 else 6)
    np.testing.assert_allclose(last.v[0][:, 0], 1 - 0.3 * GRAVITY * 0.1, rtol=1e-9)
    assert last.resultant()[-1] == pytest.approx(1000 * GRAVITY * 2)


def test_a_rigid_block_flies_and_turns():
    """Free fall: the centre on a parabola, the spin constant, the block its own shape."""
    floor = am.Contact("bottom", am.Plane((0, 0, 1), point=(0, 0, -50)), mu=0)
    model = am.Model([block(3)], [], [floor], [am.BodyForce((0, 0, -1000 * GRAVITY))])
    centre = np.array([1, 0.5, 0.5])
    start = am.at_rest(model, velocity=lambda x: np.cross((0, 0, 1e-3), x - centre))
    steps = list(am.evolve(model, am.MoreauJean(step=0.01, theta=0.5), until=0.2, start=start))
    u = steps[-1].displacement[0]
    assert u[:, 2] == pytest.approx(-0.5 * GRAVITY * 0.2**2)
    x = model.bodies[0].mesh.points - centre
    np.testing.assert_allclose(u[:, :2], 0.2 * np.cross((0, 0, 1e-3), x)[:, :2], atol=1e-15)
    assert steps[-1].energies.defect == pytest.approx(0, abs=1e-9)


def test_a_tall_block_topples_where_statics_say_so():
    """Pushed at its top: it stays below weight * half width / height, and tips above."""
    for push, stays in ((0.49, True), (0.51, False)):
        body = am.Body(am.box((1.0, 1.0), 1), HEAVY)
        force = am.Traction("top", (push * 1000 * GRAVITY, -1e-9))
        model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=2.0)],
                         [am.BodyForce((0, -1000 * GRAVITY)), force])  # fmt: skip
        last = list(am.evolve(model, am.MoreauJean(step=0.01, theta=1), until=0.1))[-1]
        assert (np.abs(last.displacement[0]).max() < 1e-9) == stays


def test_supports_move_a_rigid_body_and_keep_its_unknowns():
    lid, stone = block(2), am.Body(am.box((2.0, 1.0), (4, 2), origin=(0, -1)), STONE)
    contact = am.Contact("body 1.bottom", master="body 2.top", mu=0.5, method="nodal")
    model = am.Model(
        [lid, stone],
        [am.Fix("body 2.bottom", 0), am.Fix("body 1.top", lambda x, t: (1e-4 * t, None))],
        [contact], [am.Traction("body 1.top", (0, -1e5))],
    )  # fmt: skip
    steps = list(am.evolve(model, am.MoreauJean(step=0.02, theta=1), until=0.2))
    assert steps[-1].problem.unknowns == 3 + 2 * 15 - 2 * 5
    np.testing.assert_allclose(steps[-1].displacement[0][2:, 0], 2e-5)
    assert abs(steps[-1].energies.defect) < 1e-9 * steps[-1].energies.turnover
    assert steps[-1].energies.supports > 0


def test_statics_of_a_rigid_block_on_an_elastic_one_is_that_of_a_very_stiff_one():
    stiff = am.LinearElastic(young=2.2e13, poisson=0.0)
    found = []
    for material in (am.Rigid(), stiff):
        lid = am.Body(am.box((2.0, 1.0), (2, 1)), material)
        stone = am.Body(am.box((2.0, 1.0), (4, 2), origin=(0, -1)), STONE)
        contact = am.Contact("body 2.top", master="body 1.bottom", mu=0.5, method="nodal")
        model = am.Model([lid, stone], [am.Fix("body 2.bottom", 0)], [contact],
                         [am.Traction("body 1.top", (1e3, -1e5))])  # fmt: skip
        solution = am.solve(model, tolerance=1e-10)
        found.append(solution.displacement[1])
        assert solution.resultant[1] == pytest.approx(-2e5)
    np.testing.assert_allclose(found[0], found[1], atol=2e-3 * np.abs(found[1]).max())


@pytest.mark.parametrize(("length", "force"), [(1.0, 1.0), (1e-6, 1e9), (1e3, 1e-6)])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_rigid_block_that_rests_on_a_plane_is_in_balance_in_any_units(dim, length, force):
    body = am.Body(am.box([2 * length] + [length] * (dim - 1), 2), am.Rigid())
    up = np.eye(dim)[-1]
    contact = am.Contact("bottom", am.Plane(up), mu=0.5)
    load = force * (0.2 * np.eye(dim)[0] - up)
    model = am.Model([body], [], [contact], [am.Traction("top", load)])
    solution = am.solve(model)
    area = 2 * length ** (dim - 1)
    np.testing.assert_allclose(solution.resultant, -area * load, atol=1e-6 * force * area)
    assert np.abs(solution.displacement[0]).max() < 1e-6 * length


def test_a_rigid_block_that_friction_can_not_hold_has_no_solution():
    body = am.Body(am.box((2.0, 1.0), 2), am.Rigid())
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.5)
    model = am.Model([body], [], [contact], [am.Traction("top", (0.6, -1.0))])
    with pytest.raises(am.NotConverged, match="no solution.*no contact forces balance"):
        am.solve(model)


def stack(count, push):
    """Rigid blocks 2 wide and 1 high, one on the other, the last one pushed."""
    bodies = [
        am.Body(am.box((2.0, 1.0), (2, 1), origin=(0, k)), am.Rigid(), f"b{k}")
        for k in range(count)
    ]
    contacts = [am.Contact("b0.bottom", am.Plane((0, 1)), mu=0.5)]
    contacts += [
        am.Contact(f"b{k}.bottom", master=f"b{k - 1}.top", mu=0.5, method="nodal")
        for k in range(1, count)
    ]
    return am.Model(bodies, [], contacts, [am.Traction(f"b{count - 1}.top", (push, -1.0))])


def test_a_stack_of_rigid_blocks_stands_until_its_weight_leaves_the_edge():
    # about the edge below: push * 2 * height against 2 * half the width
    solution = am.solve(stack(6, 0.99 / 6))
    for k in range(6):
        np.testing.assert_allclose(
            solution.pairs[f"b{k}.bottom"].force, (-0.33, 2.0), rtol=1e-5
        )
    with pytest.raises(am.NotConverged, match="no solution"):
        am.solve(stack(6, 1.01 / 6))


@pytest.mark.parametrize("across", [0.0, 1e-3, 0.5])
def test_an_elastic_lid_presses_a_rigid_block_onto_a_plane(across):
    found = []
    for material in (am.Rigid(), am.LinearElastic(young=1e8, poisson=0.3)):
        lid = am.Body(am.box((2.0, 1.0), (4, 2), origin=(0, 1)),
                      am.LinearElastic(young=100, poisson=0.3), "lid")  # fmt: skip
        base = am.Body(am.box((2.0, 1.0), (4, 2)), material, "base")
        contacts = [
            am.Contact("lid.bottom", master="base.top", mu=0.3, method="nodal"),
            am.Contact("base.bottom", am.Plane((0, 1)), mu=0.5),
        ]
        found.append(
            am.solve(am.Model([lid, base], [am.Fix("lid.top", (across, -0.02))], contacts))
        )
    for name in ("lid.bottom", "base.bottom"):
        rigid, stiff = (s.pairs[name].force for s in found)
        np.testing.assert_allclose(rigid, stiff, atol=2e-5 * 5)


def test_quasi_static_steps_move_rigid_bodies_too():
    lid = am.Body(am.box((2.0, 1.0), (2, 1)), am.Rigid())
    stone = am.Body(am.box((2.0, 1.0), (4, 2), origin=(0, -1)), STONE)
    contact = am.Contact("body 2.top", master="body 1.bottom", mu=0.5, method="nodal")
    model = am.Model(
        [lid, stone],
        [am.Fix("body 2.bottom", 0), am.Fix("body 1.top", lambda x, t: (1e-5 * t, -1e-5 * t))],
        [contact],
    )  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(step=0.5), until=1.0))
    np.testing.assert_allclose(steps[-1].displacement[0], [[1e-5, -1e-5]] * 6)
    for step in steps:
        assert abs(step.energies.defect) < 1e-8 * step.energies.turnover


def test_what_rigid_bodies_can_not_do_is_said():
    with pytest.raises(am.InvalidInput, match="density"):
        am.Rigid(density=-1.0)
    with pytest.raises(am.InvalidInput, match="region 'default'.*got Rigid"):
        am.Body(am.box((1.0, 1.0), 1), {"default": am.Rigid()})
    bent = am.Fix("top", lambda x: (None, 0.01 * x[0] ** 2))
    body = am.Body(am.box((2.0, 1.0), 2), am.Rigid())
    contact = am.Contact("bottom", am.Plane((0, 1), point=(0, -1)), mu=0.3)
    with pytest.raises(am.InvalidInput, match="'body' is rigid.*no small rigid motion"):
        am.Model([body], [bent], [contact]).assemble()
    with pytest.raises(am.InvalidInput, match="nothing left to solve"):
        am.Model([body], [am.Fix("top", 0)], [contact]).assemble()
    soft = am.Body(am.box((1.0, 1.0), 1, origin=(0, 5)), am.NeoHookean(1.0, 0.3), name="soft")
    contact = am.Contact("body 1.bottom", am.Plane((0, 1), point=(0, -1)), mu=0.3)
    with pytest.raises(am.UnsupportedForm, match="rigid"):
        am.solve(am.Model([body, soft], [am.Fix("soft.top", 0)], [contact]))


def test_nitsche_and_current_contact_refuse_rigid_bodies():
    lid = am.Body(am.box((2.0, 1.0), (2, 1)), am.Rigid())
    stone = am.Body(am.box((2.0, 1.0), (4, 2), origin=(0, -1)), STONE)
    fix = am.Fix("body 2.bottom", 0)
    for slave, master in (("body 2.top", "body 1.bottom"), ("body 1.bottom", "body 2.top")):
        contact = am.Contact(slave, master=master, mu=0.5, method="nitsche")
        with pytest.raises(am.UnsupportedForm, match=r"Nitsche.*nodal"):
            am.Model([lid, stone], [fix], [contact]).discrete_problem()
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.5, configuration="current")
    with pytest.raises(am.UnsupportedForm, match="'body' is rigid"):
        am.solve(am.Model([block(2)], [], [floor], [am.Traction("top", (0, -1.0))]))


def test_a_rigid_body_that_nothing_holds_is_named():
    body = am.Body(am.box((2.0, 1.0), 2), am.Rigid())
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.0)
    model = am.Model([body], [], [contact], [am.Traction("top", (0, -1.0))])
    with pytest.raises(am.SingularOperator, match="translation along x"):
        am.solve(model)


def test_joints_within_reach_do_not_go_through():
    """A block above the floor falls by more than its gap in a step: it lands on the floor."""
    floor = am.Contact("bottom", am.Plane((0, 1), point=(0, -1e-4)), mu=0.5)
    model = am.Model([block(2)], [], [floor], [am.BodyForce((0, -1000 * GRAVITY))])
    lowest = {}
    for reach in (0.0, 1e-3):
        method = am.MoreauJean(step=0.02, theta=1, reach=reach)
        steps = list(am.evolve(model, method, until=0.1))
        lowest[reach] = min(step.gap.min() for step in steps)
        assert all(s.energies.contact < 1e-9 for s in steps)
    assert lowest[0.0] < -1e-3
    assert lowest[1e-3] > -1e-12
    with pytest.raises(am.InvalidInput, match="reach: expected 0 with restitution"):
        am.MoreauJean(step=0.1, reach=1.0, restitution=0.5)
