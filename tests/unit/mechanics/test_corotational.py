"""Linear elasticity in frames that turn with the bodies: any rotation, small strains."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.io.vtk import body_stress
from amontons.mechanics.elements.corotational import CorotationalBody
from amontons.mechanics.elements.linear_body import LinearBody
from amontons.mechanics.elements.mass import mass

G = 9.81
LAW = am.LinearElastic(100.0, 0.3, density=1.0)


def turn(dim, angle):
    """A rotation matrix."""
    axis = np.array([0.0, 0.0, 1.0]) if dim == 2 else np.array([0.3, 0.5, 0.8124])
    return Rotation.from_rotvec(angle * axis).as_matrix()[:dim, :dim]


@pytest.mark.parametrize(("kind", "order"), [("quad", 1), ("tri", 2), ("hex", 1), ("tet", 1)])
def test_forces_are_the_slope_of_an_energy_that_rotations_leave_as_it_is(kind, order):
    dim = 2 if kind in ("quad", "tri") else 3
    mesh = am.Body(am.box((1.0, 0.7, 0.4)[:dim], 2, kind), LAW, order=order).mesh
    X, rng = mesh.points, np.random.default_rng(1)
    body, R = CorotationalBody(mesh, LAW), turn(dim, 2.5)
    u, way = 0.05 * rng.standard_normal((2, *X.shape))
    moved = (X + u) @ R.T - X + 1.3
    assert body.energy(moved) == pytest.approx(body.energy(u), rel=1e-12)
    np.testing.assert_allclose(body.forces(moved), body.forces(u) @ R.T, atol=1e-12)
    assert np.abs(body.forces(X @ R.T - X)).max() < 1e-12
    slope = (body.energy(moved + 1e-5 * way) - body.energy(moved - 1e-5 * way)) / 2e-5
    assert (body.forces(moved) * way).sum() == pytest.approx(slope, rel=1e-7, abs=1e-9)
    small = 1e-5 * u
    assert body.energy(small) == pytest.approx(LinearBody(mesh, LAW).energy(small), rel=1e-4)
    whole, blocks = body.tangent(1e-9 * u)
    np.testing.assert_allclose(blocks, LinearBody(mesh, LAW).tangent(u)[1], atol=1e-6)
    np.testing.assert_allclose(whole, body.forces(1e-9 * u), atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("viscous", [0.0, 0.4])
def test_forces_between_states_keep_energy_and_momenta(dim, viscous):
    mesh = am.box((1.0, 0.7, 0.4)[:dim], 2)
    X, rng, body = mesh.points, np.random.default_rng(2), CorotationalBody(mesh, LAW)
    before, more = 0.05 * rng.standard_normal((2, *X.shape))
    after = (X + before + more) @ turn(dim, 0.7).T - X
    force = body.between(before, after, viscous)
    gain = body.energy(after) - body.energy(before) + body.lost(before, after, viscous)
    assert (force * (after - before)).sum() == pytest.approx(gain, rel=1e-12)
    assert (body.lost(before, after, viscous) > 0) == (viscous > 0)
    moment = np.einsum("ai,aj->ij", X + (before + after) / 2, force)
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    assert np.abs(moment - moment.T).max() < 1e-12
    np.testing.assert_allclose(body.between(before, before), body.forces(before), atol=1e-13)


def test_pieces_of_a_mesh_have_frames_of_their_own():
    """Two blocks in one body, each turned about itself, store nothing."""
    one = am.box((1.0, 0.5), 2)
    n = len(one.points)
    cells = one.cells[0]
    both = am.Mesh(
        np.concatenate([one.points, one.points + [3.0, 0.0]]),
        (replace(cells, nodes=np.concatenate([cells.nodes, cells.nodes + n])),), {},
    )  # fmt: skip
    body, X = CorotationalBody(both, LAW), both.points
    turned = np.concatenate([one.points @ turn(2, 0.9).T, X[n:] @ turn(2, -0.4).T])
    assert body.energy(turned - X) < 1e-25
    assert LinearBody(both, LAW).energy(turned - X) > 1.0
    u = 0.02 * np.random.default_rng(0).standard_normal(X.shape)
    alone = CorotationalBody(one, LAW)
    np.testing.assert_allclose(body.forces(u)[:n], alone.forces(u[:n]), atol=1e-12)


def test_stresses_turn_with_the_body():
    """A bar that is stretched by 1e-6 and turned by 50 degrees."""
    body = am.Body(am.box((1.0, 0.2), (4, 1)), replace(LAW, plane="stress"), corotational=True)
    X, R = body.mesh.points, turn(2, np.radians(50))
    strained = X * [1 + 1e-6, 1 - 0.3e-6]
    for stress in body_stress(body, strained @ R.T - X):
        expected = np.outer(R[:, 0], R[:, 0]) * 1e-4
        np.testing.assert_allclose(
            stress[:, :2, :2], np.broadcast_to(expected, (len(stress), 2, 2)), atol=1e-11
        )


def momenta(body, state):
    X = body.mesh.points
    x = X + state.displacement.reshape(X.shape)
    p = (mass(body.mesh, body.material) @ state.velocity).reshape(X.shape)
    moment = np.einsum("ai,aj->ij", x, p)
    return np.concatenate([p.sum(axis=0), (moment - moment.T).ravel()])


def test_a_block_that_spins_is_where_a_hyperelastic_law_puts_it():
    """A fourth of a turn in space; energy and momenta to rounding."""
    box, ends = am.box((1.0, 0.6, 0.3), 2), []
    for law in (am.LinearElastic(1e4, 0.3, density=1.0),
                am.SaintVenantKirchhoff(1e4, 0.3, density=1.0)):  # fmt: skip
        body = am.Body(box, law, corotational=isinstance(law, am.LinearElastic))
        model = am.Model([body], [], [])
        spin = np.array([0.4, -0.5, 3.0])
        start = am.at_rest(model, velocity=lambda x: tuple(np.cross(spin, x)))  # noqa: B023
        wanted, energy = momenta(body, start), None
        for step in am.evolve(model, am.MoreauJean(0.02), until=0.5, start=start):
            energy = step.energies.total if energy is None else energy
            assert step.energies.total == pytest.approx(energy, rel=1e-11)
            np.testing.assert_allclose(momenta(body, step.state), wanted, atol=1e-11)
        ends.append(step.state.displacement)
        assert step.energies.elastic > 1e-6 * energy
    np.testing.assert_allclose(*ends, atol=3e-6)


def block(young, tilt, cells=(2, 2), damping=1e-3):
    """A block 0.2 x 1 that stands tilted on its right corner, and its two ends."""
    mesh = am.box((0.2, 1.0), cells)
    X = (mesh.points - [0.2, 0.0]) @ turn(2, -tilt).T
    ends = [int(np.argmin(mesh.points @ w)) for w in ([1, 9], [1, -9])]
    law = am.LinearElastic(young, 0.2, plane="stress", density=2500.0)
    body = am.Body(replace(mesh, points=X), law, corotational=True)
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), 2.0)],
                     [am.BodyForce((0, -2500 * G))])  # fmt: skip
    return model, X, ends


def tilts(model, X, ends, step, until):
    """Angles of the left edge and how it stretches, in all steps."""
    out = []
    for s in am.evolve(model, am.MoreauJean(step, stiffness_damping=1e-3), until=until):
        low, high = (X + s.state.displacement.reshape(X.shape))[ends]
        edge = high - low
        out.append((np.arctan2(edge[0], edge[1]), np.linalg.norm(edge) - 1.0))
        assert abs(s.energies.defect) < 1e-7
    return np.array(out)


def test_a_block_that_topples_turns_as_a_rigid_one_and_keeps_its_edges():
    """The inverted pendulum, 4/3 R theta'' = g sin(theta - alpha); no contact's change."""
    found = tilts(*block(5e10, 0.25), 4e-3, 0.6)
    alpha, R = np.arctan2(0.1, 0.5), np.hypot(0.1, 0.5)
    exact = integrate.solve_ivp(
        lambda t, y: [y[1], 0.75 * G / R * np.sin(y[0] - alpha)], (0, 0.6), [0.25, 0.0],
        rtol=1e-10, atol=1e-12,
    ).y[0, -1]  # fmt: skip
    assert exact > 0.4
    assert found[-1, 0] == pytest.approx(exact, rel=1e-3)
    assert np.abs(found[:, 1]).max() < 1e-6


def test_a_block_rocks_as_housner_says():
    """Upright the first time after a quarter of a period, however soft the stone is."""
    step = 2e-3
    angle = tilts(*block(1e9, 0.1), step, 0.38)[:, 0]
    at = int(np.flatnonzero(angle < 0)[0])
    time = (at + angle[at - 1] / (angle[at - 1] - angle[at])) * step
    assert time == pytest.approx(0.35112, rel=1e-3)  # verify/rigid.py


def test_a_block_is_pushed_over_in_quasi_static_steps():
    """The force at the top is W R sin(alpha - theta) over its height, whatever the angle."""
    mesh = am.box((0.2, 1.0), (2, 2))
    top = np.flatnonzero(np.abs(mesh.points - [0.0, 1.0]).max(axis=1) < 1e-9)
    mesh = replace(mesh, node_sets={"apex": top})
    law = am.LinearElastic(1e9, 0.2, plane="stress", density=2500.0)
    push = am.Fix("apex", lambda x, t: (0.12 * t, None))
    model = am.Model([am.Body(mesh, law, corotational=True)], [push],
                     [am.Contact("bottom", am.Plane((0, 1)), 2.0)],
                     [am.BodyForce((0, -2500 * G))])  # fmt: skip
    X, alpha, R = mesh.points, np.arctan2(0.1, 0.5), np.hypot(0.1, 0.5)
    for step in am.evolve(model, am.QuasiStatic(0.25), until=1.0):
        x = X + step.state.displacement.reshape(X.shape)
        edge = x[np.argmax(X @ [1, 9])] - x[np.argmin(X @ [-1, 9])]
        theta = np.arctan2(edge[0], edge[1])
        weight = 2500 * G * 0.2
        force = step.reaction.reshape(X.shape)[top[0], 0]
        expected = weight * R * np.sin(alpha - theta) / x[top[0], 1]
        assert force == pytest.approx(expected, rel=1e-3)
    assert theta > 0.11


def test_what_a_frame_can_not_do_is_said():
    box = am.box((1, 1), 1)
    for law in (am.NeoHookean(1.0, 0.3), am.ElastoPlastic(1.0, 0.3, yield_stress=1.0)):
        with pytest.raises(am.InvalidInput, match="corotational"):
            am.Body(box, law, corotational=True)
    with pytest.raises(am.InvalidInput, match="axisymmetric"):
        am.Body(box, LAW, axisymmetric=True, corotational=True)
    with pytest.raises(am.InvalidInput, match="True or False"):
        am.Body(box, LAW, corotational=1)  # type: ignore[arg-type]
    model, *_ = block(1e9, 0.1)
    with pytest.raises(am.UnsupportedForm, match="no path"):
        am.follow(model)
    with pytest.raises(am.UnsupportedForm, match="theta"):
        next(am.evolve(model, am.MoreauJean(1e-3, theta=1.0), until=1.0))
    other = am.Body(am.box((1, 1), 1, origin=(0, 2)), LAW, name="plain")
    floor = am.Contact("body.bottom", am.Plane((0, 1)), 0.3)
    mixed = am.Model([model.bodies[0], other], [], [floor])
    with pytest.raises(am.UnsupportedForm, match="corotational=True"):
        next(am.evolve(mixed, am.MoreauJean(1e-3), until=1.0))
