"""Friction along axes, and springs along the surface, that bodies carry as they move far."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation
from tangent_checker import checked_tangents

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.mechanics.contact.surface_axes import SurfaceAxes, carried_frames
from amontons.mechanics.model.large_deformation import large_deformation, large_step

MU1, MU2 = 0.2, 0.5
ALONG = {"mu": MU1, "mu_across": MU2, "direction": (1, 0, 0)}
SOFT, STIFF = am.NeoHookean(10.0, 0.3), am.NeoHookean(200.0, 0.3)
PRESS = 0.01


def slider(top, law, *, obstacle=None, order=1, cells=2):
    """A stiff unit plate on a floor, or on a softer plate below it."""
    upper = am.Body(am.box((1, 1, 0.5), (cells, cells, 1)), STIFF, name="upper", order=order)
    if obstacle is not None:
        return am.Model([upper], [am.Fix("top", top)], [am.Contact("bottom", obstacle, **law)])
    lower = am.Body(am.box((2, 2, 0.5), 3, origin=(-0.5, -0.5, -0.5)), SOFT, name="lower",
                    order=order)  # fmt: skip
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)],
                    [am.Contact("upper.bottom", master="lower.top", **law)])  # fmt: skip


def turned_then_dragged(angle, far):
    """Press until 1, turn about the middle until 2, drag along x until 3."""

    def top(x, t):
        turned = angle * min(max(t - 1, 0), 1)
        arm = np.array(x) - [0.5, 0.5, 0]
        to = Rotation.from_rotvec([0, 0, turned]).apply(arm)
        return tuple(to - arm + [far * max(t - 2, 0), 0, -PRESS * min(t, 1.0)])

    return top


@pytest.mark.parametrize("floor", [True, False])
@pytest.mark.parametrize("angle", [0.0, 0.9])
def test_dragged_slip_is_normal_to_an_ellipse_that_turned_with_the_plate(floor, angle):
    obstacle = am.Plane((0, 0, 1)) if floor else None
    model = slider(turned_then_dragged(angle, 0.3), ALONG, obstacle=obstacle)
    *_, step = am.evolve(model, am.QuasiStatic(0.25), until=3.0)
    assert step.solution.converged
    slip = np.array([np.cos(angle), -np.sin(angle)])  # in axes of the plate
    squares = np.array([MU1, MU2]) ** 2
    tau = -squares * slip / np.sqrt(squares @ slip**2)
    turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()[:2, :2]
    force = step.resultant()
    # both sides deform and tilt: not all nodes slip quite alike
    np.testing.assert_allclose(force[:2] / force[2], turn @ tau, atol=4e-3)


@pytest.mark.parametrize("obstacle", [am.Plane((0, 0, 1)), None])
def test_equal_coefficients_are_coulombs_law(obstacle):
    """To what Newton leaves: sums are in another order."""
    top = turned_then_dragged(0.3, 0.1)
    equal = {"mu": 0.3, "mu_across": 0.3, "direction": (1, 2, 0)}
    both = [[step.state for step in am.evolve(slider(top, law, obstacle=obstacle),
                                              am.QuasiStatic(0.5), until=3.0)]
            for law in (equal, {"mu": 0.3})]  # fmt: skip
    for a, b in zip(*both, strict=True):
        np.testing.assert_allclose(a.displacement, b.displacement, rtol=0, atol=1e-11)


def test_nearly_equal_coefficients_are_nearly_coulombs_law():
    top = turned_then_dragged(0.3, 0.1)
    near = {"mu": 0.3, "mu_across": 0.3 * (1 + 1e-12), "direction": (1, 2, 0)}
    *_, a = am.evolve(slider(top, near), am.QuasiStatic(0.5), until=2.5, tolerance=1e-12)
    *_, b = am.evolve(slider(top, {"mu": 0.3}), am.QuasiStatic(0.5), until=2.5, tolerance=1e-12)
    np.testing.assert_allclose(a.state.displacement, b.state.displacement, atol=1e-11)


LAWS = [ALONG, {"mu": 0.3, "stick_stiffness": 2.0}, {"tresca": 0.02, "stick_stiffness": 5.0},
        {**ALONG, "stick_stiffness": 20.0, "stiffness": 3.0, "cohesion": 0.01}]  # fmt: skip


def checked(model, seed, draws=12, size=0.02):
    """Tangents of a step from a random state with drawn springs, at random states."""
    rng = np.random.default_rng(seed)
    parts = large_deformation(model).parts
    dofs, (nc, d) = parts.X.size, parts.at.shape
    before, drawn = 0.01 * rng.standard_normal(dofs), 0.02 * rng.standard_normal((nc, d - 1))
    nothing = np.zeros(dofs)
    sticks = model.contacts[0].stick_stiffness is not None
    problem = large_step(model, nothing, nothing, before, drawn=drawn if sticks else None)
    states = (
        rng.standard_normal((2, problem.unknowns)) * [[size], [1.0]] for _ in range(draws)
    )
    return checked_tangents(problem, states)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("obstacle", [am.Sphere((0.5, 0.5, -3), 3), None])
def test_tangents_are_exact(law, obstacle):
    assert checked(slider((0, 0, -0.02), law, obstacle=obstacle), 3) > 6


def test_tangents_are_exact_in_2d_and_second_order():
    law = {"mu": 0.3, "stick_stiffness": 2.0}
    lower = am.Body(am.box((2, 1), (5, 2), origin=(-0.5, -1)), SOFT, name="lower")
    upper = am.Body(am.box((1, 1), (3, 2)), STIFF, name="upper")
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, -0.02))]
    model = am.Model([lower, upper], supports,
                     [am.Contact("upper.bottom", master="lower.top", **law)])  # fmt: skip
    assert checked(model, 5) > 6
    disc = am.Model([upper], supports[1:],
                    [am.Contact("bottom", am.Sphere((0.5, -3), 3), **law)])  # fmt: skip
    assert checked(disc, 6) > 6
    curved = slider((0, 0, -0.02), {**ALONG, "stick_stiffness": 20.0}, order=2, cells=1)
    assert checked(curved, 7, draws=4, size=0.005) > 2


def with_held_side(law, obstacle=None):
    """The plates with slave nodes of one edge, and all of the side above, held along x."""
    model = slider((0, 0, -PRESS), law, obstacle=obstacle)
    return am.Model(model.bodies, [*model.supports, am.Fix("upper.left", (0, None, None))],
                    model.contacts)  # fmt: skip


@pytest.mark.parametrize("law", LAWS[1:3])
@pytest.mark.parametrize("obstacle", [am.Sphere((0.8, 0.5, -3), 3), None])
def test_tangents_are_exact_where_supports_hold_springs(law, obstacle):
    assert checked(with_held_side(law, obstacle), 3, draws=6) > 3


def test_supports_take_what_springs_are_drawn_in_their_direction():
    """The slave stands along x, its master gives way: springs are drawn by what it leaves."""
    far, k = 0.002, 2.0
    model = with_held_side({"mu": 0.3, "stick_stiffness": k, "stiffness": 50.0})
    parts = large_deformation(model).parts
    load, prescribed = np.zeros(parts.X.size), model.discretisation.prescribed
    drawn = np.full((len(parts.at), 2), far)
    problem = large_step(model, load, prescribed, drawn=drawn)
    solution = am.solve(problem, tolerance=1e-10)
    assert solution.converged
    axes = problem.contact_point(solution.v).meeting.frames
    slip, force = (np.einsum("pk,pkc->pc", of[:, 1:], axes[:, 1:])
                   for of in (solution.u, solution.r))  # fmt: skip
    held = ~parts.contact.free
    assert held.sum() == 3
    corners = np.abs(parts.X.reshape(-1, 3)[parts.at[:, 0] // 3][:, 1] - 0.5) > 0.4
    area = np.where(corners, 1 / 16, 1 / 8)  # of four facets, grown by less than 1e-3
    np.testing.assert_allclose(force[held], -k * (area * slip[:, 0])[held[:, 0]], rtol=1e-3)
    assert ((slip[held] > 0.8 * far) & (slip[held] < 0.9 * far)).all()
    bottom = np.unique(model.bodies[0].mesh.surface("bottom")[0].nodes)
    below = parts.forces(problem.displacement(solution.v)).reshape(-1, 3)[bottom].sum(axis=0)
    total = np.einsum("pk,pkc->c", solution.r, axes)
    np.testing.assert_allclose(below, total, atol=1e-8)


def rotated(model, turn):
    """The same model with everything turned."""
    bodies = [am.Body(am.Mesh(b.mesh.points @ turn.T, b.mesh.cells, b.mesh.surfaces),
                      b.material, name=b.name) for b in model.bodies]  # fmt: skip

    def of(value):
        if not callable(value):
            return tuple(turn @ np.broadcast_to(value, 3))
        return lambda x, t: tuple(turn @ value(tuple(turn.T @ np.array(x)), t))

    supports = [am.Fix(s.on, of(s.value)) for s in model.supports]
    contacts = [replace(c, direction=turn @ np.array(c.direction)) for c in model.contacts]
    return am.Model(bodies, supports, contacts)


def test_turning_everything_turns_all_forces():
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    law = {"mu": 0.2, "mu_across": 0.5, "direction": (1, 0.4, 0), "stick_stiffness": 30.0}
    model = slider(turned_then_dragged(0.4, 0.05), law)
    options = {"until": 2.5, "tolerance": 1e-12}
    for a, b in zip(am.evolve(model, am.QuasiStatic(0.5), **options),
                    am.evolve(rotated(model, turn), am.QuasiStatic(0.5), **options),
                    strict=True):  # fmt: skip
        np.testing.assert_allclose(b.fields.force, a.fields.force @ turn.T, atol=1e-11)


def together(angle):
    """Supports of both plates: press, drag within the bound of friction, then turn both."""

    def motion(lift, slide):
        def value(x, t):
            moved = np.array(x) + [slide * min(max(t - 1, 0), 1), 0, lift * min(t, 1.0)]
            turn = Rotation.from_rotvec([0, angle * max(t - 2, 0), 2 * angle * max(t - 2, 0)])
            return tuple(turn.apply(moved) - np.array(x))

        return value

    return motion


def test_a_drawn_spring_turns_with_the_bodies():
    """Elastic slip and force as before in their frames, turned in global axes."""
    law = {"mu": 0.9, "mu_across": 2.0, "direction": (1, 1, 0), "stick_stiffness": 40.0}
    model = slider(0, law)
    motion = together(0.4)
    supports = [am.Fix("lower.bottom", motion(0, 0)),
                am.Fix("upper.top", motion(-PRESS, 0.004))]  # fmt: skip
    model = am.Model(model.bodies, supports, model.contacts)
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=3.0, tolerance=1e-12))
    before, after = steps[3], steps[5]
    assert abs(before.state.force[:, 1:]).max() > 1e-3
    np.testing.assert_allclose(after.state.force, before.state.force, atol=1e-11)
    turn = Rotation.from_rotvec([0, 0.4, 0.8])
    np.testing.assert_allclose(after.fields.force, turn.apply(before.fields.force), atol=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_plate_on_springs_is_drawn_by_shear_over_stiffness_until_it_slips(dim):
    """Shear k s of a plate far stiffer than its springs, up to mu times the pressure.

    Drawn back to where it was it pushes by k times what it slipped.
    """
    k, mu, far = 1.0, 0.3, 0.4
    mesh = am.box((1,) * (dim - 1) + (0.05,), (2,) * (dim - 1) + (1,))
    plate = am.Body(mesh, am.NeoHookean(1e4, 0.0), name="plate")

    def top(x, t):
        slide = far * (min(max(t - 1, 0), 1) - max(t - 2, 0))
        return (slide, *(0,) * (dim - 2), -2e-6 * min(t, 1.0))

    normal = (0,) * (dim - 1) + (1,)
    contact = am.Contact("bottom", am.Plane(normal), mu=mu, stick_stiffness=k)
    model = am.Model([plate], [am.Fix("top", top)], [contact])
    steps = list(am.evolve(model, am.QuasiStatic(0.2), until=3.0))
    drawn = [0.0]
    for step in steps:
        force = step.resultant()
        way = 0.0 if len(drawn) < 6 else far / 5 * (1 if len(drawn) < 11 else -1)
        bound = mu * force[-1] / k
        drawn.append(float(np.clip(drawn[-1] + way, -bound, bound)))
        near = 2e-3 if abs(drawn[-1]) < 0.8 * bound else 2e-2  # its ends slip first
        assert force[0] == pytest.approx(-k * drawn[-1], abs=near * mu * force[-1])
        assert abs(step.energies.defect) < 1e-8
        assert step.energies.contact <= 1e-10
    assert max(drawn) < 0.9 * far  # it slipped
    assert steps[-1].state.friction_work.sum() > 0


def test_axes_are_the_given_tangents_where_nothing_is_deformed():
    """Whatever the surface: a ball of the mesh's facets, of first and of second order."""
    for order in (1, 2):
        body = am.Body(am.box((1, 1, 1), 2), SOFT, name="body", order=order)
        mesh = body.mesh
        points = mesh.points - 0.5
        round_ = points * (1 + 0.4 * (points**2).sum(axis=1))[:, None]
        bent = am.Mesh(round_, mesh.cells, mesh.surfaces)
        nodes = np.unique(np.concatenate([f.nodes.ravel() for f in bent.surface("top")]))
        axes = SurfaceAxes.of(bent, "top", nodes)
        found = carried_frames(axes.frames[:, 0], (axes.rows @ round_).reshape(-1, 2, 3))
        np.testing.assert_allclose(found, axes.frames, atol=1e-12)
        np.testing.assert_allclose(axes.rows.sum(axis=1), 0, atol=1e-12)


def test_axes_turn_by_the_rotation_of_the_polar_decomposition():
    """Of a block that is sheared in its plane, too."""
    mesh = am.box((1, 1, 1), 2)
    nodes = np.unique(mesh.surface("bottom")[0].nodes)
    axes = SurfaceAxes.of(mesh, "bottom", nodes)
    F = np.array([[1.2, 0.1, 0], [0.4, 0.9, 0], [0, 0, 1.1]])
    along = (axes.rows @ (mesh.points @ F.T)).reshape(-1, 2, 3)
    found = carried_frames(axes.frames[:, 0], along)
    turned = polar(F)[0] @ [1, 0, 0]
    np.testing.assert_allclose(found[:, 1], np.tile(turned, (9, 1)), atol=1e-12)


def test_a_direction_across_the_surface_is_refused_in_words():
    law = {**ALONG, "direction": (0, 0, 1)}
    with pytest.raises(InvalidInput, match="expected a direction along the surface"):
        am.solve(slider((0, 0, -0.01), law))
