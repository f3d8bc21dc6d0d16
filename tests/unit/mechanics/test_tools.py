"""Rigid tools: obstacles that move with a body, profiles, and what acts on them."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes import second_order

SOFT = am.LinearElastic(1000.0, 0.3)


def tool(dim, name="punch", at=None, size=1.0):
    """A rigid body: its mesh says nothing about the obstacle that moves with it."""
    mesh = am.box((size,) * dim, 1)
    shift = np.full(dim, 5.0) if at is None else np.array(at)
    return am.Body(replace(mesh, points=mesh.points + shift), am.Rigid(), name)


def pressed(dim, value, *, by_force, method="nodal", order=1, mu=0.3, side=None):
    """A block under a ball (a disc in 2D) that goes down by a value, or is pressed by one."""
    n = 8 if dim == 2 else 4
    block = am.Body(am.box((2,) * dim, n), SOFT, "block", order=order)
    center = np.full(dim, 1.0)
    center[-1] = 2 + 3.0
    up = dim - 1
    held = [None if k == up and by_force else 0.0 for k in range(dim)]
    if not by_force:
        held[up] = -value
    if side is not None:
        held[0] = side
    turns = [0.0] * (1 if dim == 2 else 3)
    force = np.zeros(dim)
    force[up] = -value if by_force else 0.0
    contact = am.Contact("top", am.Sphere(center, 3.0), mu=mu, method=method, follows="punch")
    return am.Model(
        [block, tool(dim)],
        [am.Fix("block.bottom", 0), am.Fix("R", held), am.Fix("R.rotation", turns)],
        [replace(contact, slave="block.top")], [am.NodalForce("R", force)],
        references=[am.Reference("R", center)], constraints=[am.Coupling("punch", "R")],
    )  # fmt: skip


@pytest.mark.parametrize(("dim", "method", "order"), [
    (2, "nodal", 1), (2, "mortar", 1), (2, "mortar", 2), (3, "nodal", 1), (3, "mortar", 1),
])  # fmt: skip
def test_by_a_force_and_by_a_displacement(dim, method, order):
    """The reaction of the reference presses as far as it was moved; and the still obstacle."""
    moved = am.solve(pressed(dim, 0.05, by_force=False, method=method, order=order),
                     tolerance=1e-12)  # fmt: skip
    up = dim - 1
    reaction = -moved.references["R"].force[up]
    assert reaction == pytest.approx(moved.resultant[up] * -1, rel=1e-9)
    assert reaction > 0
    loaded = am.solve(pressed(dim, reaction, by_force=True, method=method, order=order),
                      tolerance=1e-12)  # fmt: skip
    assert loaded.references["R"].displacement[up] == pytest.approx(-0.05, rel=1e-8)
    assert np.allclose(loaded.displacement[0], moved.displacement[0], atol=1e-9)
    # a ball that stands there from the beginning, in the same normals: contact's gap is less
    still = am.Contact("block.top", lowered(moved.model.contacts[0].obstacle, 0.05, dim),
                       mu=0.3, method=method)  # fmt: skip
    block = moved.model.bodies[0]
    there = am.solve(am.Model([block], [am.Fix("block.bottom", 0)], [still]), tolerance=1e-12)
    assert there.resultant[up] == pytest.approx(-reaction, rel=0.05)  # normals turn by 1/60


def lowered(ball, by, dim):
    center = np.array(ball.center)
    center[dim - 1] -= by
    return am.Sphere(center, ball.radius)


def test_a_flat_tool_is_exactly_the_plane_that_was_moved():
    """Normals do not change: the gap is less by the motion, whatever the way aside."""
    for dim in (2, 3):
        block = am.Body(am.box((1,) * dim, 3), SOFT, "block")
        normal = -np.eye(dim)[-1]
        start, end = (np.eye(dim)[-1] * h for h in (1.1, 0.98))
        supports = [am.Fix("block.bottom", 0), am.Fix("punch.top", 1.2 * 0.1 * normal)]
        contact = am.Contact("block.top", am.Plane(normal, start), mu=0.2, follows="punch")
        moved = am.solve(am.Model([block, tool(dim)], supports, [contact]), tolerance=1e-12)
        still = am.Contact("block.top", am.Plane(normal, end), mu=0.2)
        there = am.solve(am.Model([block], supports[:1], [still]), tolerance=1e-12)
        assert np.allclose(moved.displacement[0], there.displacement[0], atol=1e-11)
        assert moved.supports["punch.top"].force == pytest.approx(
            there.resultant, rel=1e-8, abs=1e-9
        )


def test_a_tool_that_turns_and_drags():
    """A plane turned by a small angle about R; dragged aside it pulls with mu N."""
    mesh = am.box((1, 1), 4)
    block = am.Body(mesh, SOFT, "block")
    supports = [am.Fix("block.bottom", 0), am.Fix("R", (0, -0.02)),
                am.Fix("R.rotation", [1e-3])]  # fmt: skip
    plane = am.Contact("block.top", am.Plane((0, -1), (0, 1)), mu=0.0, follows="punch")
    model = am.Model([block, tool(2)], supports, [plane],
                     references=[am.Reference("R", (0.5, 2))],
                     constraints=[am.Coupling("punch", "R")])  # fmt: skip
    u = am.solve(model, tolerance=1e-12).displacement[0]
    top = mesh.surface_nodes("top")
    x = mesh.points[top, 0]
    assert np.allclose(u[top, 1], -0.02 + 1e-3 * (x - 0.5), atol=1e-12)
    drag = replace(model, supports=[supports[0], am.Fix("R", (0.05, -0.02)),
                                    am.Fix("R.rotation", [0.0])],
                   contacts=[replace(plane, mu=0.1)])  # fmt: skip
    found = am.solve(drag, tolerance=1e-12)
    assert found.counts["slip"] == 5
    force = found.references["R"].force
    assert force[0] == pytest.approx(-0.1 * force[1], rel=1e-9)
    assert force[0] > 0
    balance = found.supports["block.bottom"].force + force
    assert np.allclose(balance, 0, atol=1e-9)


def test_a_tool_that_nothing_holds_is_refused_and_one_that_contact_holds_is_not():
    model = pressed(2, 3.0, by_force=True, mu=0.3)
    assert am.solve(model, tolerance=1e-10).converged
    free = replace(model, supports=model.supports[:1], contacts=[
        replace(model.contacts[0], mu=0.0)])  # fmt: skip
    with pytest.raises(am.SingularOperator, match="body 'punch' is free to move"):
        am.solve(free)


def test_hertz_against_an_analytic_roller():
    """A half plane's worth of block under a rigid disc: half width and peak pressure."""
    R, F, E, nu = 10.0, 20.0, 1000.0, 0.3
    star = E / (1 - nu**2)
    a = np.sqrt(4 * F * R / (np.pi * star))
    peak = 2 * F / (np.pi * a)
    mesh = am.box((1, 1), (64, 32))
    scale = lambda s, power: np.sign(s) * np.abs(s) ** power  # noqa: E731
    x = 12 * scale(2 * mesh.points[:, 0] - 1, 2.0)
    y = -12 * scale(1 - mesh.points[:, 1], 2.0)
    block = am.Body(replace(mesh, points=np.stack([x, y], axis=1)), SOFT, "block")
    disc = am.Sphere((0, R), R)
    model = am.Model(
        [block, tool(2)],
        [am.Fix("block.bottom", 0), am.Fix("R", (0, None)), am.Fix("R.rotation", [0])],
        [am.Contact("block.top", disc, mu=0.0, follows="punch", method="mortar")],
        [am.NodalForce("R", (0, -F))], references=[am.Reference("R", (0, R))],
        constraints=[am.Coupling("punch", "R")],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-11)
    assert found.resultant[1] == pytest.approx(-F, rel=1e-9)
    assert found.fields.pressure.max() == pytest.approx(peak, rel=0.03)
    away, touches = np.abs(found.fields.points[:, 0]), found.fields.pressure > 0
    assert away[touches].max() < a < away[~touches].min()


@pytest.mark.parametrize(("change", "words"), [
    ({"follows": "punh"}, "body 'punh': not found, .*; did you mean 'punch'"),
    ({"follows": "block"}, "expected a body that does not deform, 'block' does"),
    ({"follows": 3}, "follows: expected a body's name, got 3"),
    ({"method": "nitsche"}, "goes with method 'nodal' or 'mortar'"),
    ({"kinematics": "finite"}, "goes with kinematics='small'"),
    ({"obstacle": None, "master": "block.top"}, "goes with an obstacle"),
])  # fmt: skip
def test_what_can_not_follow(change, words):
    model = pressed(2, 0.05, by_force=False)
    with pytest.raises(am.InvalidInput, match=words):
        replace(model, contacts=[replace(model.contacts[0], **change)])


# ------------------------------------------------------------------------------- profiles
def test_a_profile_of_lines_and_arcs_is_where_it_should_be():
    """A bar with round end, material to the right of the way: down, round, up."""
    bar = am.Profile((1, 3), [(1, 0), ((0, -1), (0, 0)), ((-1, 0), (0, 0)), (-1, 3)])
    x = np.array([[2, 1], [0, -3], [0.5, 2], [-1.5, 1], [3, -4], [0.0, -0.5], [2, 7]])
    gap = [1, 2, -0.5, 0.5, 4, -0.5, np.hypot(1, 4)]
    assert np.allclose(bar.gap(x), gap, atol=1e-12)
    normals = [(1, 0), (0, -1), (1, 0), (-1, 0), (0.6, -0.8), (0, -1),
               np.array([1, 4]) / np.hypot(1, 4)]  # fmt: skip
    assert np.allclose(bar.normals(x), normals, atol=1e-12)
    assert np.allclose(bar.turned.gap(x[:-1]), -np.array(gap[:-1]), atol=1e-12)


def test_corners_of_a_profile():
    """A square, closed: outside of a corner the distance to it; inside the nearer side."""
    square = am.Profile((0, 0), [(0, 1), (1, 1), (1, 0), (0, 0)])
    x = np.array([[2, 2], [-1, -1], [0.5, 0.4], [0.9, 0.5], [1, 1], [0, 0], [0.2, -1]])
    assert np.allclose(square.gap(x), [2**0.5, 2**0.5, -0.4, -0.1, 0, 0, 1], atol=1e-12)
    n = square.normals(x)
    assert np.allclose(n[:2], [[0.5**0.5] * 2, [-(0.5**0.5)] * 2])
    assert np.allclose(n[4:6], [[0.5**0.5] * 2, [-(0.5**0.5)] * 2])
    wedge = am.Profile((-1, 1), [(0, 0), (1, 1)])  # a valley with material below
    assert np.allclose(wedge.gap(np.array([[0, 1.0], [0, -1.0]])), [0.5**0.5, -1], atol=1e-12)


def random_points(count, dim, seed=1):
    return np.random.default_rng(seed).uniform(-2, 2, (count, dim))


def test_profiles_in_space_agree_with_spheres_and_cylinders():
    x = random_points(200, 3)
    half = am.Profile((0, 1), [((1, 0), (0, 0)), ((0, -1), (0, 0))])
    axis = np.array([1.0, 2.0, -0.5])
    ball = am.Revolution(half, (0.1, 0.2, 0.3), axis)
    same = am.Sphere((0.1, 0.2, 0.3), 1.0)
    assert np.allclose(ball.gap(x), same.gap(x), atol=1e-12)
    assert np.allclose(ball.normals(x), same.normals(x), atol=1e-12)
    ring = am.Profile((1, 0), [((0, -1), (0, 0)), ((-1, 0), (0, 0)), ((0, 1), (0, 0)),
                               ((1, 0), (0, 0))])  # fmt: skip
    other = np.cross(axis, (0, 0, 1.0))
    bar = am.Extrusion(ring, (0.1, 0.2, 0.3), other, np.cross(axis, other))
    rod = am.Cylinder((0.1, 0.2, 0.3), axis, 1.0)
    for one in (bar, bar.turned):
        sign = -1 if one is bar.turned or one.profile is not ring else 1
        assert np.allclose(one.gap(x), sign * rod.gap(x), atol=1e-12)
        assert np.allclose(one.normals(x), sign * rod.normals(x), atol=1e-12)
    hollow = am.Cylinder((0.1, 0.2, 0.3), axis, 1.0, hollow=True)
    assert np.allclose(hollow.gap(x), -rod.gap(x))


@pytest.mark.parametrize(("make", "words"), [
    (lambda: am.Profile((0, 0), []), "steps: expected at least one end"),
    (lambda: am.Profile((0, 0), [(0, 0)]), r"steps\[0\]: expected a line or an arc"),
    (lambda: am.Profile((1, 0), [((-1, 0), (0, 0))]), "arc of less than 180 degrees"),
    (lambda: am.Profile((1, 0), [((0, 2), (0, 0))]), "its ends are 1 and 2 from its center"),
    (lambda: am.Profile((1, 0), [(1, 2, 3)]), r"expected 2 numbers, got \(1, 2, 3\)"),
    (lambda: am.Cylinder((0, 0, 0), (0, 0, 0), 1), "axis: expected a vector that is not zero"),
    (lambda: am.Cylinder((0, 0, 0), (0, 0, 1), -1), "radius: expected a length > 0"),
    (lambda: am.Cylinder((0, 0), (0, 0, 1), 1), "point: expected 3 numbers"),
])  # fmt: skip
def test_what_is_no_obstacle(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make()


def test_an_obstacle_in_space_needs_a_mesh_in_space():
    body = am.Body(second_order(am.box((1, 1), 2)), SOFT)
    contact = am.Contact("top", am.Cylinder((0, 0, 2), (1, 0, 0), 1), mu=0.1)
    model = am.Model([body], [am.Fix("bottom", 0)], [contact])
    with pytest.raises(am.InvalidInput, match="cylinder: is in 3D, the mesh in 2D"):
        model.assemble()


def test_hertz_of_a_ball_around_its_axis():
    """Largest pressure 3 F / (2 pi a^2), approach a^2 / R on a large body."""
    R, F, E, nu = 10.0, 5.0, 1000.0, 0.3
    star = E / (1 - nu**2)
    a = (3 * F * R / (4 * star)) ** (1 / 3)
    mesh = am.box((1, 1), (48, 48))
    x = np.stack([8 * mesh.points[:, 0] ** 2, -8 * (1 - mesh.points[:, 1]) ** 2], axis=1)
    block = am.Body(replace(mesh, points=x), SOFT, "block", axisymmetric=True)
    ball = replace(tool(2), axisymmetric=True)
    model = am.Model(
        [block, ball], [am.Fix("block.bottom", 0)],
        [am.Contact("block.top", am.Sphere((0, R), R), mu=0.0, follows="punch",
                    method="mortar")],
        [am.NodalForce("R", (0, -F))], references=[am.Reference("R", (0, R))],
        constraints=[am.Coupling("punch", "R")],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-11)
    assert found.resultant[1] == pytest.approx(-F, rel=1e-9)
    assert found.fields.pressure.max() == pytest.approx(1.5 * F / (np.pi * a**2), rel=0.03)
    sunk = -found.references["R"].displacement
    assert sunk[0] == 0
    assert sunk[1] == pytest.approx(a**2 / R, rel=0.12)  # the block is 26 a deep
    with pytest.raises(am.InvalidInput, match="around an axis follows a reference"):
        replace(model, constraints=[], loads=[]).assemble()
