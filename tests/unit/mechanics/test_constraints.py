"""Equations, couplings, pretension, turned axes, springs: held against mechanics."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am

SOFT = am.LinearElastic(1000.0, 0.0)
STEEL = am.LinearElastic(1000.0, 0.3)
AWAY = am.Contact("left", am.Plane((1, 0, 0), (-5, 0, 0)), mu=0.2)  # touches nothing
AWAY_2D = am.Contact("left", am.Plane((1, 0), (-5, 0)), mu=0.2)


def bar(cells=(2, 2, 4), size=(2.0, 2.0, 4.0), material=STEEL, order=1):
    return am.Body(am.box(size, cells), material, order=order)


def balance(solution):
    """Sum of all forces and moments that act on the bodies from outside, over their size."""
    wrenches = [each.wrench for each in solution.supports.values()]
    total = solution.load
    for wrench in wrenches:
        total = total + wrench
    for name, pair in solution.pairs.items():
        contact = solution.model.contacts[solution.model.pair_names.index(name)]
        total = total + pair.wrench if contact.master is None else total
    size = max(np.abs([*w.force, *w.moment]).max() for w in (*wrenches, solution.load))
    return np.concatenate([total.force, total.moment]) / size


# ------------------------------------------------------------------------------- equations
def block(nodes=None):
    mesh = am.box((2.0, 1.0), (4, 2))
    top = np.flatnonzero(mesh.points[:, 1] == 1.0)
    sets = {"corner": [0], "first": top[:1], "rest": top[1:], "third": top[2:3]}
    return am.Body(am.Mesh(mesh.points, mesh.cells, mesh.surfaces, node_sets=sets), SOFT)


def flat(constraints, loads=(), supports=(), **more):
    held = [am.Fix("bottom", (None, 0)), am.Fix("corner", (0, None)), *supports]
    return am.Model([block()], held, [AWAY_2D], loads, constraints=constraints, **more)


def test_nodes_that_move_together_share_a_force():
    """A force on one node of a top that stays flat: u = F L / (E A), as if all were pressed."""
    equal = am.Equation([("rest", 1, 1.0), ("first", 1, -1.0)])
    found = am.solve(flat([equal], [am.NodalForce("third", (0, -20.0))]))
    top = found.model.bodies[0].mesh.surface_nodes("top")
    np.testing.assert_allclose(found.displacement[0][top, 1], -20.0 / (1000 * 2), rtol=1e-9)
    np.testing.assert_allclose(balance(found)[:2], 0, atol=1e-12)
    assert found.supports["bottom"].force[1] == pytest.approx(20.0)


def test_a_chain_of_equations_is_the_same_as_its_ends():
    a, b, c = (int(k) for k in block().mesh.surface_nodes("top")[:3])
    force = [am.NodalForce("third", (0, -20.0))]
    chain = [am.Equation([(a, 1, 2.0), (b, 1, -1.0)]), am.Equation([(b, 1, 1.0), (c, 1, -3.0)])]
    ends = [am.Equation([(a, 1, 1.0), (c, 1, -1.5)]), am.Equation([(b, 1, 1.0), (c, 1, -3.0)])]
    first, second = (am.solve(flat(list(each), force)) for each in (chain, ends))
    np.testing.assert_allclose(first.displacement[0], second.displacement[0], atol=1e-14)
    u = first.displacement[0][:, 1]
    assert (u[a], u[b]) == (pytest.approx(1.5 * u[c]), pytest.approx(3 * u[c]))
    again = am.solve(flat(chain[::-1], force))
    np.testing.assert_allclose(first.displacement[0], again.displacement[0], atol=1e-14)


def test_a_right_side_is_a_reference_that_is_prescribed():
    """u(rest) - u(first) = g: a step of known height, found again at the nodes."""
    jump = am.Reference("g", (0.0, 2.0))
    step = am.Equation([("rest", 1, 1.0), ("first", 1, -1.0), ("g", 1, -1.0)])
    held = am.Fix("g", (None, 0.01))
    found = am.solve(flat([step], supports=[held], references=[jump]))
    nodes = found.model.bodies[0].mesh.node_sets
    u = found.displacement[0][:, 1]
    np.testing.assert_allclose(u[nodes["rest"]] - u[nodes["first"]], 0.01, rtol=1e-12)
    # what it takes to hold g is the force that the equation carries: energy by displacement
    other = am.solve(flat([step], supports=[am.Fix("g", (None, 0.02))], references=[jump]))
    assert found.references["g"].force[1] > 0
    assert other.references["g"].force[1] == pytest.approx(2 * found.references["g"].force[1])


def test_a_contact_node_may_be_dependent():
    """Two nodes of a slave tied to others: the floor carries the load, nothing enters it."""
    mesh = am.box((2.0, 1.0), (4, 2))
    bottom = np.flatnonzero(mesh.points[:, 1] == 0.0)
    a, b, c = (int(k) for k in bottom[:3])
    body = am.Body(mesh, am.LinearElastic(1000.0, 0.3))
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    equal = [am.Equation([(a, 0, 1.0), (b, 0, -1.0)]), am.Equation([(a, 1, 1.0), (c, 1, -1.0)])]
    model = am.Model([body], [], [floor], [am.Traction("top", (0.5, -10.0))], constraints=equal)
    found = am.solve(model)
    assert found.converged
    np.testing.assert_allclose(found.resultant, (-1.0, 20.0), rtol=1e-7)
    u = found.displacement[0]
    assert u[a, 0] == pytest.approx(u[b, 0], abs=1e-12)
    assert u[a, 1] == pytest.approx(u[c, 1], abs=1e-12)
    assert found.gap.min() > -1e-10


@pytest.mark.parametrize(("constraints", "supports", "words"), [
    ([am.Equation([(12, 1, 1.0), (13, 1, -1.0)]), am.Equation([(12, 1, 1), (14, 1, 2.0)])], (),
     r"equation 1: component 1 of node 12 .*is eliminated by equation 0 already"),
    ([am.Equation([(12, 1, 1.0), (13, 1, -1.0)])], [am.Fix("top", (None, 0.1))],
     r"equation 0: component 1 of node 12 .*a support prescribes it too"),
    ([am.Equation([(12, 1, 1.0), (13, 1, -1.0)]), am.Equation([(13, 1, 1), (12, 1, 2.0)])], (),
     r"depends on itself"),
    ([am.Equation([(12, 1, 1.0), (12, 1, -1.0), (13, 1, 1)])], (), "add up to 0"),
    ([am.Equation([("nowhere", 1, 1.0)])], (), "nowhere"),
    ([am.Equation([(99, 1, 1.0)])], (), "node 99: expected a number from 0 to 14"),
    ([am.Equation([(1, 2, 1.0)])], (), "component: expected one below 2"),
    ([am.Equation([("rest", 1, 1.0), ("bottom", 1, 1.0)])], (), "expected 1 node or 5"),
    ([am.Coupling("top", "R")], (), "reference 'R'"),
])  # fmt: skip
def test_wrong_constraints_are_told(constraints, supports, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.solve(flat(constraints, supports=supports))


@pytest.mark.parametrize("make", [
    lambda: am.Equation([]), lambda: am.Equation([("a", 1, 0.0)]),
    lambda: am.Equation([("a", 3, 1.0)]), lambda: am.Spring([("a", 1, 1.0)], -1.0),
    lambda: am.Coupling("a", "R", kind="soft"), lambda: am.Coupling("a", "R", components=[7]),
    lambda: am.Coupling("a", "R", kind="distributing", components=[0]),
    lambda: am.Pretension("p", "one"), lambda: am.Reference("R.rotation", (0, 0)),
    lambda: am.Axes("a", "b", [[1, 1], [0, 1]]),
])  # fmt: skip
def test_wrong_parts_are_refused(make):
    with pytest.raises(am.InvalidInput):
        make()


# ------------------------------------------------------------------------------- couplings
def led_bar(kind, loads=(), supports=(), order=2, material=SOFT):
    """A bar held at its bottom whose top follows, or is followed by, a reference above it."""
    body = bar((1, 2, 4), (1.0, 2.0, 8.0), material, order)
    lead = am.Reference("R", (0.5, 1.0, 8.0))
    return am.Model([body], [am.Fix("bottom", 0), *supports],
                    [am.Contact("left", am.Plane((1, 0, 0), (-5, 0, 0)), mu=0.2)], loads,
                    references=[lead], constraints=[am.Coupling("top", "R", kind)])  # fmt: skip


@pytest.mark.parametrize("kind", ["kinematic", "distributing"])
def test_a_moment_bends_a_bar(kind):
    """Pure bending without Poisson's effect: phi = M L / (E I), exact in second order."""
    found = am.solve(led_bar(kind, [am.NodalForce("R.rotation", (3.0, 0, 0))]))
    turned = found.references["R"]
    inertia = 1.0 * 2.0**3 / 12
    assert turned.rotation[0] == pytest.approx(3.0 * 8.0 / (1000 * inertia), rel=1e-6)
    assert turned.displacement[1] == pytest.approx(-turned.rotation[0] * 8.0 / 2, rel=1e-6)
    np.testing.assert_allclose(balance(found), 0, atol=1e-9)
    np.testing.assert_allclose(found.supports["bottom"].moment, (-3.0, 0, 0), atol=1e-9)


@pytest.mark.parametrize("kind", ["kinematic", "distributing"])
def test_what_a_reference_is_given_it_takes(kind):
    """A force and a moment move it; prescribing that motion gives them back as reactions."""
    force, moment = (1.0, 2.0, -3.0), (0.5, -1.0, 2.0)
    loads = [am.NodalForce("R", force), am.NodalForce("R.rotation", moment)]
    pushed = am.solve(led_bar(kind, loads, order=1))
    moved = pushed.references["R"]
    held = [am.Fix("R", moved.displacement), am.Fix("R.rotation", moved.rotation)]
    back = am.solve(led_bar(kind, supports=held, order=1))
    np.testing.assert_allclose(back.displacement[0], pushed.displacement[0], atol=1e-12)
    np.testing.assert_allclose(back.supports["R"].force, force, atol=1e-9)
    np.testing.assert_allclose(back.supports["R.rotation"].moment, moment, atol=1e-9)
    np.testing.assert_allclose(pushed.load.force, force)
    arm = np.cross((0.5, 1.0, 8.0), force)
    np.testing.assert_allclose(pushed.load.moment, arm + moment)
    for each in (pushed, back):
        np.testing.assert_allclose(balance(each), 0, atol=1e-9)


def test_a_distributing_coupling_moves_with_the_mean_and_leaves_nodes_free():
    loads = [am.NodalForce("R", (0, 0, -4.0))]
    model = led_bar("distributing", loads, material=STEEL, order=1)
    found = am.solve(model)
    free = am.solve(am.Model(model.bodies, model.supports, model.contacts,
                             [am.Traction("top", (0, 0, -4.0 / 2))]))  # fmt: skip
    np.testing.assert_allclose(found.displacement[0], free.displacement[0], atol=1e-13)
    top = found.model.bodies[0].mesh.surface_nodes("top")
    assert np.ptp(found.displacement[0][top, 0]) > 1e-4
    held = am.solve(led_bar("kinematic", loads, material=STEEL, order=1))
    assert np.ptp(held.displacement[0][top, 0]) < 1e-14


def test_components_of_a_kinematic_coupling():
    """Only along z: the top stays flat and free to slide sideways; what moves nothing is 0."""
    body = bar()
    lead = am.Reference("R", (1.0, 1.0, 4.0))
    model = am.Model([body], [am.Fix("bottom", (None, None, 0)),
                              am.Fix("left", (0, None, None)),
                              am.Fix("front", (None, 0, None))], [AWAY],
                     [am.NodalForce("R", (0, 0, -40.0))], references=[lead],
                     constraints=[am.Coupling("top", "R", components=[2])])  # fmt: skip
    with pytest.raises(am.InvalidInput, match="no contact is left"):
        am.solve(model)  # its slave, "left", is held
    away = am.Contact("right", am.Plane((-1, 0, 0), (5, 0, 0)), mu=0.2)
    found = am.solve(am.Model(model.bodies, model.supports, [away], model.loads,
                              references=[lead], constraints=model.constraints))  # fmt: skip
    strain = -40.0 / (4 * 1000)
    x = body.mesh.points
    np.testing.assert_allclose(found.displacement[0], x * strain * (-0.3, -0.3, 1), atol=1e-12)
    np.testing.assert_allclose(
        found.references["R"].displacement, (0, 0, 4 * strain), atol=1e-12
    )
    pushed = am.Model(model.bodies, model.supports, [away], [am.NodalForce("R", (1.0, 0, 0))],
                      references=[lead], constraints=model.constraints)  # fmt: skip
    with pytest.raises(am.SingularOperator, match="component 0 of reference 'R'"):
        am.solve(pushed)


def tool(loads=(), supports=()):
    """A rigid block that its reference presses on an elastic one."""
    low = am.Body(am.box((4.0, 4.0, 2.0), (4, 4, 2)), STEEL, "low")
    mesh = am.box((2.0, 2.0, 1.0), (2, 2, 1))
    high = am.Body(am.Mesh(mesh.points + (1, 1, 2.0), mesh.cells, mesh.surfaces),
                   am.Rigid(density=1.0), "high")  # fmt: skip
    contact = am.Contact("high.bottom", master="low.top", mu=0.4)
    return am.Model([low, high], [am.Fix("low.bottom", 0), *supports], [contact], loads,
                    references=[am.Reference("R", (2.0, 2.0, 5.0))],
                    constraints=[am.Coupling("high", "R")])  # fmt: skip


def test_a_rigid_tool_presses_by_force_or_by_way():
    upright = am.Fix("R.rotation", (0, 0, 0))
    sideways = am.Fix("R", (0, 0, None))
    force = am.solve(tool([am.NodalForce("R", (0, 0, -30.0))], [upright, sideways]))
    np.testing.assert_allclose(force.resultant, (0, 0, 30.0), atol=1e-6)
    way = force.references["R"].displacement
    assert way[2] < 0
    driven = am.solve(tool(supports=[upright, am.Fix("R", way)]))
    np.testing.assert_allclose(driven.supports["R"].force, (0, 0, -30.0), atol=1e-5)
    assert balance(driven)[:3] == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(driven.displacement[1], np.tile(way, (18, 1)), atol=1e-12)


def test_a_rigid_tool_that_nothing_guides_stands_on_friction_alone():
    """Pressed above its centre it stands still, pushed sideways by more than mu N it slides."""
    found = am.solve(tool([am.NodalForce("R", (3.0, 0, -30.0))]))
    assert found.converged
    np.testing.assert_allclose(found.resultant, (-3.0, 0, 30.0), atol=1e-5)
    with pytest.raises(am.AmontonsError, match="no contact forces balance"):
        am.solve(tool([am.NodalForce("R", (15.0, 0, -30.0))]))


def test_a_rigid_node_set_of_an_elastic_body_with_a_node_held():
    """A support on one of its nodes holds the set at that node; it may still turn about it."""
    body = bar((2, 2, 4))
    nodes = body.mesh.surface_nodes("top")
    sets = {"pin": nodes[:1]}
    mesh = am.Mesh(body.mesh.points, body.mesh.cells, body.mesh.surfaces, node_sets=sets)
    model = am.Model([am.Body(mesh, STEEL)], [am.Fix("bottom", 0), am.Fix("pin", (0, 0, 0.01))],
                     [AWAY], references=[am.Reference("R", (1.0, 1.0, 4.0))],
                     constraints=[am.Coupling("top", "R")])  # fmt: skip
    found = am.solve(model)
    u, lead = found.displacement[0][nodes], found.references["R"]
    arms = mesh.points[nodes] - (1.0, 1.0, 4.0)
    np.testing.assert_allclose(u, lead.displacement + np.cross(lead.rotation, arms), atol=1e-13)
    np.testing.assert_allclose(u[0], (0, 0, 0.01), atol=1e-13)
    assert np.abs(lead.rotation[:2]).min() > 1e-4
    np.testing.assert_allclose(balance(found), 0, atol=1e-9)
    np.testing.assert_allclose(lead.force, 0, atol=1e-9)


def test_supports_that_no_rigid_motion_allows_are_told():
    body = bar((2, 2, 4))
    bent = am.Fix("top", lambda x: (0, 0, 0.1 * x[0] ** 2))
    model = am.Model([body], [am.Fix("bottom", 0), bent], [AWAY],
                     references=[am.Reference("R", (1.0, 1.0, 4.0))],
                     constraints=[am.Coupling("top", "R")])  # fmt: skip
    with pytest.raises(am.InvalidInput, match="contradicts the constraints"):
        am.solve(model)


def test_a_reference_that_turns_without_its_nodes_is_told():
    """Two nodes on a line leave the rotation about it open."""
    mesh = am.box((2.0, 2.0, 4.0), (2, 2, 4))
    ends = np.flatnonzero((mesh.points[:, 2] == 4) & (np.ptp(mesh.points[:, :2], axis=1) == 0))
    sets = {"line": ends[[0, -1]]}
    body = am.Body(am.Mesh(mesh.points, mesh.cells, mesh.surfaces, node_sets=sets), STEEL)
    model = am.Model([body], [am.Fix("bottom", 0)], [AWAY],
                     references=[am.Reference("R", (1.0, 1.0, 4.0))],
                     constraints=[am.Coupling("line", "R")])  # fmt: skip
    with pytest.raises(am.SingularOperator, match="reference 'R' can move without any node"):
        am.solve(model)


def test_bodies_joined_by_constraints_are_held_together():
    """A body whose only hold is an equation to another is not loose; cut, it is named."""
    low = am.Body(am.box((1.0, 1.0), 2), SOFT, "low")
    mesh = am.box((1.0, 1.0), 2)
    high = am.Body(am.Mesh(mesh.points + (0, 1), mesh.cells, mesh.surfaces), SOFT, "high")
    ties = [am.Equation([("high.bottom", c, 1.0), ("low.top", c, -1.0)]) for c in (0, 1)]
    away = am.Contact("high.left", am.Plane((1, 0), (-5, 0)), mu=0)
    loads = [am.Traction("high.top", (0.0, -10.0))]
    model = am.Model([low, high], [am.Fix("low.bottom", 0)], [away], loads, constraints=ties)
    found = am.solve(model)
    assert not model.held_by_contact
    whole = am.Body(am.box((1.0, 2.0), (2, 4)), SOFT)
    one = am.solve(am.Model([whole], [am.Fix("bottom", 0)],
                            [am.Contact("left", am.Plane((1, 0), (-5, 0)), mu=0.2)],
                            [am.Traction("top", (0.0, -10.0))]))  # fmt: skip
    top = found.displacement[1][mesh.surface_nodes("top"), 1]
    np.testing.assert_allclose(
        top, one.displacement[0][whole.mesh.surface_nodes("top"), 1], rtol=1e-9
    )
    floating = am.Model([low, high], [], [away], loads, constraints=ties)
    with pytest.raises(am.SingularOperator, match="low \\+ high.*free to move: .*along y"):
        am.solve(floating)
    guided = am.Contact("high.bottom", am.Plane((0, 1), (0, -5)), mu=0)
    hinged = am.Model([low, high], [am.Fix("low.bottom", 0)], [guided], loads,
                      constraints=ties[1:])  # fmt: skip
    with pytest.raises(am.SingularOperator, match="along x"):
        hinged.assemble()


# -------------------------------------------------------------------------------- pretension
def bolt(order=1, **more):
    mesh = am.opened(am.box((2.0, 2.0, 4.0), (2, 2, 4)), "cut", (0, 0, 2), (0, 0, 1))
    held = [am.Fix("bottom", 0), am.Fix("top", (0, None, 0)), *more.pop("supports", ())]
    return am.Model([am.Body(mesh, STEEL, order=order)], held, [AWAY], more.pop("loads", ()),
                    constraints=[am.Pretension("P", ("cut-below", "cut-above"))])  # fmt: skip


def test_pretension_gives_the_numbers_of_calculix():
    """ccx 2.20, *PRE-TENSION SECTION on 16 C3D8: 10 N shorten by 9.616650E-03, and back."""
    pulled = am.solve(bolt(loads=[am.NodalForce("P", [10.0])]))
    assert pulled.references["P"].displacement == pytest.approx(9.616650e-3, rel=1e-6)
    assert pulled.references["P"].force == pytest.approx(10.0)
    np.testing.assert_allclose(
        pulled.supports["bottom"].force, (0, 0, -10), atol=1e-9
    )  # tension
    np.testing.assert_allclose(balance(pulled), 0, atol=1e-9)
    drawn = am.solve(bolt(supports=[am.Fix("P", [0.01])]))
    assert drawn.references["P"].force == pytest.approx(10.39863, rel=1e-6)
    np.testing.assert_allclose(drawn.supports["bottom"].force, (0, 0, -10.39863), atol=1e-5)
    pushed = am.solve(bolt(loads=[am.NodalForce("P", [-10.0])]))
    np.testing.assert_allclose(pushed.displacement[0], -pulled.displacement[0], atol=1e-14)


def test_pretension_in_second_order():
    """Free to contract: F = E A s / L, exactly."""
    mesh = am.opened(am.box((2.0, 2.0, 4.0), (2, 2, 4)), "cut", (0, 0, 2), (0, 0, 1))
    held = [am.Fix("bottom", (None, None, 0)), am.Fix("top", (None, None, 0)),
            am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None)),
            am.Fix("P", [0.02])]  # fmt: skip
    away = am.Contact("right", am.Plane((-1, 0, 0), (5, 0, 0)), mu=0.2)
    section = am.Pretension("P", ("cut-below", "cut-above"))
    found = am.solve(am.Model([am.Body(mesh, STEEL, order=2)], held, [away],
                              constraints=[section]))  # fmt: skip
    assert found.references["P"].force == pytest.approx(1000 * 4 * 0.02 / 4, rel=1e-9)


def test_opened_doubles_the_nodes_of_a_plane_alone():
    whole = am.box((2.0, 2.0, 4.0), (2, 2, 4))
    mesh = am.opened(whole, "cut", (0, 0, 2), (0, 0, 1))
    assert len(mesh.points) == len(whole.points) + 9
    below, above = (mesh.surface_nodes(f"cut-{side}") for side in ("below", "above"))
    assert not set(below) & set(above)
    np.testing.assert_allclose(mesh.points[below], mesh.points[above])
    for name in ("left", "top"):
        assert len(mesh.surface(name)[0].nodes) == len(whole.surface(name)[0].nodes)
    for point in ((0, 0, 2.3), (0, 0, 9)):
        with pytest.raises(am.InvalidInput, match="opened 'cut'"):
            am.opened(whole, "cut", point, (0, 0, 1))


# ---------------------------------------------------------------------------- axes, springs
def test_axes_turn_supports_and_forces():
    """A block turned by half a radian, held and pushed along its own axes: the same block."""
    axes = np.array([[np.cos(0.5), np.sin(0.5)], [-np.sin(0.5), np.cos(0.5)]])
    mesh = am.box((2.0, 1.0), (4, 2))
    x, y = mesh.points.T
    sets = {"low": (y == 0) & (x > 0), "side": (x == 0) & (y > 0),
            "corner": (x == 0) & (y == 0), "high": (y == 1) & (x > 0)}  # fmt: skip
    sets = {name: np.flatnonzero(chosen) for name, chosen in sets.items()}
    held = {"low": (None, 0.01), "side": (0, None), "corner": (0, 0.01)}

    def model(turn, constraints, prefix):
        points = mesh.points @ turn
        body = am.Body(am.Mesh(points, mesh.cells, mesh.surfaces, node_sets=sets), STEEL)
        obstacle = am.Plane(turn.T @ (-1, 0), turn.T @ (9, 0))
        fixes = [am.Fix(prefix + name, value) for name, value in held.items()]
        return am.Model([body], fixes, [am.Contact("right", obstacle, mu=0.2)],
                        [am.NodalForce(prefix + "high", (0.5, -3.0))],
                        constraints=constraints)  # fmt: skip

    plain = am.solve(model(np.eye(2), (), ""))
    own = [am.Axes("own " + name, name, axes) for name in sets]
    turned = am.solve(model(axes, own, "own "))
    np.testing.assert_allclose(
        turned.displacement[0] @ axes.T, plain.displacement[0], atol=1e-13
    )
    np.testing.assert_allclose(balance(turned), 0, atol=1e-9)
    np.testing.assert_allclose(turned.load.force, axes.T @ (2.0, -12.0), atol=1e-12)
    for name in held:
        np.testing.assert_allclose(axes @ turned.supports["own " + name].force,
                                   plain.supports[name].force, atol=1e-9)  # fmt: skip


def test_a_rigid_block_on_springs():
    """Its reference sinks by F / k, and a spring of three springs' directions pulls aslant."""
    mesh = am.box((1.0, 1.0, 1.0), 1)
    body = am.Body(mesh, am.Rigid())
    lead = am.Reference("R", (0.5, 0.5, 0.5))
    springs = [
        am.Spring([("R", 2, 1.0)], 50.0),
        am.Spring([("R", 0, 0.6), ("R", 1, 0.8)], 20.0),
    ]
    held = [am.Fix("R.rotation", 0)]
    far = am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, -9)), mu=0.2)
    force = (6.0, 8.0, -5.0)
    guide = am.Equation([("R", 0, 0.8), ("R", 1, -0.6)])
    model = am.Model([body], held, [far], [am.NodalForce("R", force)], references=[lead],
                     constraints=[am.Coupling("body", "R"), guide],
                     springs=springs)  # fmt: skip
    found = am.solve(model)
    np.testing.assert_allclose(found.references["R"].displacement, (0.3, 0.4, -0.1), atol=1e-9)


# --------------------------------------------------------------------------------- in time
def test_a_bolt_keeps_its_length_when_it_is_locked():
    """Pulled by 10 N up to t = 1, then its top rises: the force grows as that of one piece."""
    base = bolt()
    sections = [am.Pretension("P", ("cut-below", "cut-above"), locked=1.0)]
    lift = am.Fix("top", (0, None, lambda x, t: 0.01 * max(0.0, t - 1.0)))
    pull = am.NodalForce("P", [lambda x, t: 10.0 * min(t, 1.0)])
    model = am.Model(base.bodies, [base.supports[0], lift], [AWAY], [pull],
                     constraints=sections)  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(step=0.5), until=2.0))
    lengths = [float(step.references["P"].displacement[0]) for step in steps]
    forces = [float(step.references["P"].force[0]) for step in steps]
    assert lengths == [pytest.approx(k * 9.616650e-3, rel=1e-6) for k in (0.5, 1, 1, 1)]
    # lifted by 0.01 or shortened by 0.01: the same elongation of the bolt, 10.39863 N
    assert forces == [pytest.approx(f, rel=1e-6) for f in (5, 10, 10 + 5.199316, 20.39863)]
    assert steps[-1].supports["bottom"].force[2] == pytest.approx(-20.39863, rel=1e-6)
    free = am.evolve(am.Model(base.bodies, [base.supports[0], lift], [AWAY], [pull],
                              constraints=[am.Pretension("P", ("cut-below", "cut-above"))]),
                     am.QuasiStatic(step=0.5), until=2.0)  # fmt: skip
    assert list(free)[-1].references["P"].force == pytest.approx(10.0)
    again = list(am.evolve(model, am.QuasiStatic(step=0.5), until=2.0, start=steps[2].state))
    np.testing.assert_allclose(again[-1].state.displacement, steps[-1].state.displacement,
                               atol=1e-15)  # fmt: skip
    with pytest.raises(am.InvalidInput, match="locked at 1, inside of the step from 0.8"):
        list(am.evolve(model, am.QuasiStatic(step=0.8), until=2.0))
    with pytest.raises(am.UnsupportedForm, match="quasi-static steps only"):
        next(am.evolve(model, am.MoreauJean(step=0.1), until=0.2))


def test_a_locked_bolt_where_loads_grow_with_the_load_factor():
    base = bolt()
    section = am.Pretension("P", ("cut-below", "cut-above"), locked=1.0)
    model = am.Model(base.bodies, base.supports, [AWAY], [am.NodalForce("P", [10.0])],
                     constraints=[section])  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(step=1.0), until=3.0))
    forces = [float(step.references["P"].force[0]) for step in steps]
    assert forces == [pytest.approx(10.0)] * 3


def test_steps_take_constraints_and_balance_energy():
    """Quasi-static and dynamic: nothing is created, and what is tied stays tied."""
    equal = am.Equation([("rest", 1, 1.0), ("first", 1, -1.0)])
    body = am.Body(block().mesh, am.LinearElastic(1000.0, 0.3, density=1.0))
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    loads = [am.NodalForce("third", (1.0, -20.0))]
    model = am.Model([body], [], [floor], loads, constraints=[equal])
    slow = list(am.evolve(model, am.QuasiStatic(step=0.5), until=1.0))
    static = am.solve(model)
    np.testing.assert_allclose(slow[-1].resultant(), (-1.0, 20.0), rtol=1e-6)
    np.testing.assert_allclose(slow[-1].gap, static.gap, atol=1e-9)
    top = body.mesh.surface_nodes("top")
    fast = list(am.evolve(model, am.MoreauJean(step=1e-3, theta=0.5), until=0.05))
    for step in (*slow, *fast):
        assert np.ptp(step.displacement[0][top, 1]) < 1e-14
        scale = abs(step.energies.loads) + step.energies.total
        assert abs(step.energies.defect) < 1e-7 * max(scale, 1e-12)


def test_a_reference_swings_on_a_spring():
    """A rigid block on a spring: cos(omega t) with omega^2 = k / m."""
    body = am.Body(am.box((1.0, 1.0), 1), am.Rigid(density=2.0))
    far = am.Contact("bottom", am.Plane((0, 1), (0, -9)), mu=0.2)
    model = am.Model([body], [am.Fix("R", (0, None)), am.Fix("R.rotation", [0])], [far],
                     references=[am.Reference("R", (3.0, 4.0))],
                     constraints=[am.Coupling("body", "R")],
                     springs=[am.Spring([("R", 1, 1.0)], 8.0)])  # fmt: skip
    start = am.at_rest(model, velocity=(0.0, 0.1))
    steps = list(am.evolve(model, am.MoreauJean(step=1e-3, theta=0.5), until=0.5, start=start))
    for step in steps[::100]:
        wanted = 0.05 * np.sin(2 * step.time)
        assert step.references["R"].displacement[1] == pytest.approx(wanted, abs=1e-7)


def test_finite_deformations_refuse_constraints():
    base = bolt()
    soft = am.Body(base.bodies[0].mesh, am.NeoHookean(1000.0, 0.3))
    with pytest.raises(am.UnsupportedForm, match="small strains alone have constraints"):
        am.Model([soft], base.supports, base.contacts, constraints=base.constraints)


# ------------------------------------------------------------------ held by springs alone
def on_springs(*springs, supports=(), contacts=()):
    """A stiff block 2 x 1, pressed down by 6 at its top."""
    body = am.Body(am.box((2, 1), (2, 1)), am.LinearElastic(1e6, 0.0))
    return am.Model([body], supports, contacts, [am.Traction("top", (0, -3.0))],
                    springs=springs)  # fmt: skip


DOWN = am.Spring([("bottom", 1, 1.0)], 10.0)  # one at each of 3 nodes
ASIDE = am.Spring([("left", 0, 1.0)], 10.0)


def test_springs_hold_a_body():
    u = am.solve(on_springs(DOWN, ASIDE)).displacement[0]
    np.testing.assert_allclose(u[:, 1], -6 / 30, rtol=1e-4)


def test_springs_that_leave_a_motion():
    with pytest.raises(am.SingularOperator, match="free to move: translation along x;"):
        am.solve(on_springs(DOWN))
    with pytest.raises(am.SingularOperator, match="free to move: translation along y"):
        am.solve(on_springs(replace(DOWN, stiffness=0.0), ASIDE))


def test_springs_and_contact_share_a_load():
    floor = am.Contact("bottom", am.Plane((0, 1), (0, -0.1)), mu=0.3)
    model = on_springs(DOWN, ASIDE, contacts=[floor])
    assert not model.rests_on_contact
    assert am.solve(model).resultant[1] == pytest.approx(6 - 30 * 0.1, rel=1e-4)


def test_a_spring_between_bodies_joins_them():
    """Two blocks, the upper one hangs at the lower one by springs: it sinks by both."""
    lower = am.Body(am.box((2, 1), (2, 1)), am.LinearElastic(1e6, 0.0), "lower")
    upper = am.Body(am.box((2, 1), (2, 1), origin=(0, 2)), am.LinearElastic(1e6, 0.0), "upper")
    between = [
        am.Spring([(("upper", k), c, 1.0), (("lower", k), c, -1.0)], 10.0)
        for k in range(3) for c in (0, 1)
    ]  # fmt: skip
    model = am.Model([lower, upper], [], loads=[am.Traction("upper.top", (0, -3.0))],
                     springs=[*between, am.Spring([("lower.bottom", 1, 1.0)], 10.0),
                              am.Spring([("lower.left", 0, 1.0)], 10.0)])  # fmt: skip
    u = am.solve(model).displacement
    np.testing.assert_allclose(u[0][:, 1], -0.2, rtol=1e-4)
    np.testing.assert_allclose(u[1][:, 1], -0.4, rtol=1e-4)
    with pytest.raises(am.SingularOperator, match="free to move"):
        am.solve(replace(model, springs=model.springs[:-1]))


def test_a_reference_that_a_spring_alone_holds_aside():
    body = am.Body(am.box((2, 1), (2, 1)), am.LinearElastic(100.0, 0.3))
    model = am.Model([body], [am.Fix("R.rotation", 0), am.Fix("left", (0, None))],
                     loads=[am.NodalForce("R", (2.0, -1.0))],
                     references=[am.Reference("R", (1.0, 1.0))],
                     constraints=[am.Coupling("top", "R", components=(1,))],
                     springs=[am.Spring([("R", 1, 1.0)], 10.0),
                              am.Spring([("R", 0, 1.0)], 10.0)])  # fmt: skip
    moved = am.solve(model).references["R"].displacement
    np.testing.assert_allclose(moved, [0.2, -0.1], rtol=1e-9)
