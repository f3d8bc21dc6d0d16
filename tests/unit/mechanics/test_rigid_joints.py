"""Joints of rigid bodies: what they take, contacts that hang on them, guides without play."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

import amontons as am
from amontons.mechanics.multibody import GROUND, Joint, RigidBodies, RigidBody, cuboid
from amontons.mechanics.multibody.guides import Guides
from amontons.mechanics.multibody.joints import Joints
from amontons.mechanics.multibody.moving import at_start
from amontons.mechanics.multibody.rows import Rows

FLOOR = am.Plane((0, 0, 1))
G = 9.81


def run(system, step, until, **options):
    """All steps."""
    return list(am.evolve_rigid(system, step=step, until=until, **options))


def energy(steps):
    """Kinetic and potential, with that before the first step, (n + 1,)."""
    after = np.array([s.energies.kinetic + s.energies.potential for s in steps])
    return np.concatenate([[after[0] - steps[0].energies.gain], after])


@pytest.mark.parametrize("beside", [0.0, 1e-3, 0.1])
def test_a_block_turns_about_a_corner_that_stands_on_the_floor(beside):
    """As an inverted pendulum, the hinge at the corner or a little beside it.

    A contact that the joint contradicted ended in NotConverged; one near it threw the block.
    """
    hinge, at, spin = np.array([-beside, 0, 0]), np.array([0.5, 0, 0.5]), np.array([0, -2.0, 0])
    block = RigidBody(cuboid((1, 0.4, 1)), position=at, spin=spin,
                      velocity=np.cross(spin, at - hinge))  # fmt: skip
    joints = [Joint(0, GROUND, hinge + [0, y, 0]) for y in (-0.2, 0.2)]
    steps = run(RigidBodies([block], [FLOOR], joints=joints), 2e-3, 0.2)
    arm = at - hinge
    about = block.inertia[1, 1] + block.mass * (arm @ arm)
    begin, length = np.arctan2(arm[2], arm[0]), np.hypot(*arm[[0, 2]])

    def fall(_, y):
        return [y[1], -block.mass * G * length * np.cos(y[0]) / about]

    swung = integrate.solve_ivp(fall, (0, 0.2), [begin, 2.0], rtol=1e-10, atol=1e-10)
    end = steps[-1].position[0] - hinge
    assert np.arctan2(end[2], end[0]) == pytest.approx(swung.y[0, -1], abs=1e-5)
    assert np.ptp(energy(steps)) < 1e-8 * block.mass * G


def test_a_block_falls_back_onto_the_edge_beyond_its_hinge():
    """What the joint does not decide still stands on the floor."""
    block = RigidBody(cuboid((1, 0.4, 1)), position=(0.5, 0, 0.5), spin=(0, -1.0, 0),
                      velocity=np.cross((0, -1.0, 0), (0.5, 0, 0.5)))  # fmt: skip
    joints = [Joint(0, GROUND, (0, y, 0)) for y in (-0.2, 0.2)]
    end = run(RigidBodies([block], [FLOOR], joints=joints), 2e-3, 0.4)[-1]
    np.testing.assert_allclose(end.position[0], (0.5, 0, 0.5), atol=2e-5)
    assert np.abs(end.state.motion.spin).max() < 1e-6
    carried = end.r[:, 0].sum() + end.joints[:, 2].sum()
    assert carried == pytest.approx(block.mass * G * 2e-3, rel=1e-5)


def bar(a, b, turning, velocities):
    """Between two points of the plane y = 0, turning about y, with the speeds of its ends."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    d = b - a
    half = -0.5 * np.arctan2(d[2], d[0])
    length = np.linalg.norm(d)
    return RigidBody(
        cuboid((length, 0.02, 0.02)), 2000, 0.5 * (a + b),
        (np.cos(half), 0, np.sin(half), 0), np.mean(velocities, axis=0), (0, turning, 0),
    )  # fmt: skip


def light_crank(phi=-0.5, speed=20.0, r=0.1, rod=0.3):
    """A crank that a slider of fifty times its mass drives over its dead centre."""
    tip = r * np.array([np.cos(phi), 0, np.sin(phi)])
    down = np.arcsin(tip[2] / rod)
    end = np.array([tip[0] + rod * np.cos(down), 0, 0])
    swing = r * np.cos(phi) * speed / (rod * np.cos(down))
    v_tip = speed * r * np.array([-np.sin(phi), 0, np.cos(phi)])
    v_end = np.array([-tip[2] * speed - rod * np.sin(down) * swing, 0, 0])
    bodies = [
        bar((0, 0, 0), tip, -speed, [(0, 0, 0), v_tip]), bar(tip, end, swing, [v_tip, v_end]),
        RigidBody(cuboid((0.3, 0.3, 0.3)), 150, end, velocity=v_end),
    ]  # fmt: skip
    pins = ((0, GROUND, (0, 0, 0)), (1, 0, tip), (2, 1, end))
    joints = [Joint(i, j, p + np.array([0, y, 0])) for i, j, p in pins for y in (-0.03, 0.03)]
    planes = [am.Plane((0, 0, 1), (0, 0, -0.15)), am.Plane((0, 0, -1), (0, 0, 0.15))]
    return RigidBodies(bodies, planes, mu=0.0, joints=joints, apart=[(0, 1), (1, 2), (0, 2)],
                       gravity=(0, 0, 0))  # fmt: skip


def test_what_joints_lose_by_long_steps_is_of_third_order_and_told():
    """Energy is kept in truth; over the dead centre the crank turns by 0.2 rad in a step.

    Its slider hangs in a guide: joints that were not closed beside contacts lost 3 % at 1 ms.
    """
    lost = []
    for step in (2e-3, 1e-3, 5e-4):
        steps = run(light_crank(), step, 0.032, tolerance=1e-9)
        E = energy(steps)
        lost.append(1 - E[-1] / E[0])
        works = sum(s.energies.joints + s.energies.contact for s in steps)
        assert works == pytest.approx(E[-1] - E[0], rel=1e-9)
        assert max(abs(s.energies.defect) for s in steps) < 1e-12 * E[0]
        names = [w.name for s in steps for w in s.warnings]
        assert names == (["joints-lose-energy"] if step == 2e-3 else [])
    assert lost[0] > 0.01
    assert 0 < lost[1] < 0.008
    assert 0 < 6 * lost[2] < lost[1]


def crank_stopped_by_friction(system, mu, until, phi=-0.5, speed=20.0, r=0.1, rod=0.3):
    """Where the slider comes to rest by Newton's laws of three bodies in a plane."""
    crank, bar, slider = system.bodies
    g = -system.gravity[2]

    def rate(_, y):
        """Of angle and speed, from forces T of crank on rod and F of rod on slider."""
        c, s, w = np.cos(y[0]), np.sin(y[0]), y[1]
        psi = np.arcsin(r * s / rod)
        sine, cosine = r * s / rod, np.cos(psi)
        swing = r * c * w / (rod * cosine)  # psi'
        # psi'' = a w' + b; the rod is below the tip by its sine
        a, b = r * c / (rod * cosine), (-r * s * w**2 + rod * sine * swing**2) / (rod * cosine)
        tip = r * np.array([[-s, -c * w**2], [c, -s * w**2]])  # by w' and the rest
        d = rod * np.array([[-sine * a, -sine * b - cosine * swing**2],
                            [-cosine * a, -cosine * b + sine * swing**2]])  # fmt: skip
        end, mid = tip + d, tip + d / 2
        way = np.sign(-r * s * w - rod * sine * swing)
        M = np.zeros((5, 5))  # w', Tx, Tz, Fx, Fz
        f = np.zeros(5)
        M[0, :3] = crank.inertia[1, 1] + crank.mass * r**2 / 4, -r * s, r * c
        f[0] = -crank.mass * g * r / 2 * c
        M[1], f[1] = [bar.mass * mid[0, 0], -1, 0, 1, 0], -bar.mass * mid[0, 1]
        M[2], f[2] = [bar.mass * mid[1, 0], 0, -1, 0, 1], -bar.mass * (mid[1, 1] + g)
        M[3] = [bar.inertia[1, 1] * a, *(rod / 2 * np.array([-sine, -cosine, -sine, -cosine]))]
        f[3] = -bar.inertia[1, 1] * b
        M[4] = [slider.mass * end[0, 0], 0, 0, -1, -way * mu]
        f[4] = -slider.mass * (end[0, 1] + way * mu * g)
        return [w, np.linalg.solve(M, f)[0]]

    def stopped(_, y):
        return y[1] - 1e-6

    stopped.terminal = True
    y = integrate.solve_ivp(rate, (0, until), [phi, speed], events=stopped, rtol=1e-9,
                            atol=1e-11).y[0, -1]  # fmt: skip
    return r * np.cos(y) + np.sqrt(rod**2 - (r * np.sin(y)) ** 2)


def test_a_crank_whose_slider_rubs_stops_as_newton_says():
    """To second order in the step, whose joints close beside the contacts of the slider."""
    system = replace(light_crank(), planes=[am.Plane((0, 0, 1), (0, 0, -0.15))], mu=0.3,
                     gravity=(0, 0, -20 * G))  # fmt: skip
    expected = crank_stopped_by_friction(system, 0.3, 0.032)
    missed = [abs(run(system, step, 0.032, tolerance=1e-8)[-1].position[2, 0] - expected)
              for step in (2e-3, 1e-3)]  # fmt: skip
    assert missed[1] < 1e-4
    assert missed[0] > 3 * missed[1]


def test_a_wedged_rod_stays():
    """A hinge and two planes hold it, which friction jams: no step ends in NotConverged."""
    planes = [FLOOR, am.Plane((-1, 0, 0), (1.001, 0, 0))]
    planes.append(am.Plane((-0.3, 0, -1), (1, 0, 0.101)))
    rod = RigidBody(cuboid((1, 0.1, 0.1)), 1000, (0.5, 0, 0.05), velocity=(0, 0, 1),
                    spin=(0, -2, 0))  # fmt: skip
    joints = [Joint(0, GROUND, (0, y, 0.05)) for y in (-0.05, 0.05)]
    steps = run(RigidBodies([rod], planes, mu=0.2, joints=joints), 1e-3, 0.05,
                tolerance=1e-10)  # the speeds of what keeps still are rounding of the solve
    E = energy(steps)
    assert np.diff(E).max() < 1e-6 * E[0]
    speeds = [np.abs(step.velocity).max() for step in steps[20:]]
    assert max(speeds) < 1e-5  # a step gives 1e-2
    np.testing.assert_allclose(steps[-1].position[0], (0.5, 0, 0.05), atol=2e-3)


@pytest.mark.parametrize(("turning", "told"), [(1000.0, True), (300.0, False)])
def test_spin_about_an_axis_of_symmetry_does_not_hide_what_joints_lose(turning, told):
    """A leaning gyroscope on a point: its nod is of far less energy than its spin."""
    R = np.array([[1, 0, 0], [0, np.cos(1.2), -np.sin(1.2)], [0, np.sin(1.2), np.cos(1.2)]])
    body = RigidBody(cuboid((0.4, 0.4, 0.02)), 1000, 0.3 * R[:, 2],
                     (np.cos(0.6), np.sin(0.6), 0, 0), spin=turning * R[:, 2])  # fmt: skip
    steps = run(RigidBodies([body], joints=[Joint(0, GROUND, (0, 0, 0))]), 1e-3, 0.1)
    assert any(s.warnings for s in steps) == told


def test_a_body_is_not_apart_from_itself():
    body = RigidBody(cuboid((1, 1, 1)))
    with pytest.raises(am.InvalidInput, match="apart"):
        RigidBodies([body, body], apart=[(0, 0)])


@pytest.mark.parametrize(
    ("step", "options", "ground"),
    [(1e-3, {}, {}), (2.5e-4, {}, {}), (2e-3, {"solver": am.Auto()}, {}),
     (2e-3, {}, {"torsion": 1e-6})],
)  # fmt: skip
def test_a_guide_without_play_does_not_squeeze(step, options, ground):
    """Deceleration mu g: more would be an answer too, with any squeeze between both planes."""
    planes = [am.Plane((0, 0, 1), (0, 0, -0.15)), am.Plane((0, 0, -1), (0, 0, 0.15))]
    block = RigidBody(cuboid((0.3, 0.3, 0.3)), 300, (0, 0, 0), velocity=(2, 0, 0))
    system = RigidBodies([block], planes, mu=0.3, **ground)
    steps = run(system, step, 0.025, tolerance=1e-9, **options)
    speeds = [s.state.motion.velocity[0, 0] for s in steps]
    np.testing.assert_allclose(
        speeds, [2 - 0.3 * G * s.time for s in steps], atol=1e-3 * 0.3 * G * 0.025
    )


def test_a_chain_falls_as_lagrange_says():
    """Four links let go level, in m and kg or in mm and t; angles from an ODE."""
    n, length, step, until = 4, 0.1, 2e-3, 0.15
    C = length * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))  # centres by angles

    def chain(unit, density):
        bars = [RigidBody(cuboid(np.array([length, 0.01, 0.01]) * unit), density,
                          ((k + 0.5) * length * unit, 0, 0)) for k in range(n)]  # fmt: skip
        joints = [Joint(k, k - 1, (k * length * unit, y * unit, 0))
                  for k in range(n) for y in (-0.02, 0.02)]  # fmt: skip
        apart = [(i, j) for i in range(n) for j in range(i)]
        return RigidBodies(bars, joints=joints, apart=apart, gravity=(0, 0, -G * unit))

    system = chain(1.0, 1000.0)
    mass, inertia = system.bodies[0].mass, system.bodies[0].inertia[1, 1]

    def fall(_, y):
        c, s, w = np.cos(y[:n]), np.sin(y[:n]), y[n:]
        Jx, Jz = -C * s, -C * c
        M = mass * (Jx.T @ Jx + Jz.T @ Jz) + inertia * np.eye(n)
        turned = Jx.T @ ((C * c) @ w**2) - Jz.T @ ((C * s) @ w**2) - G * Jz.sum(axis=0)
        return np.concatenate([w, np.linalg.solve(M, mass * turned)])

    swung = integrate.solve_ivp(fall, (0, until), np.zeros(2 * n), rtol=1e-9, atol=1e-11)
    expected = -C @ np.sin(swung.y[:n, -1])
    end = run(system, step, until, tolerance=1e-9)[-1]
    np.testing.assert_allclose(end.position[:, 2], expected, atol=2e-5 * length * n)
    other = run(chain(1e3, 1e-9), step, until, tolerance=1e-9)[-1]
    np.testing.assert_allclose(other.position / 1e3, end.position, atol=1e-10)


def hanging_chain():
    """Five links on the ground."""
    bars = [RigidBody(cuboid((0.01, 0.01, 0.1)), position=(0, 0, -(k + 0.5) * 0.1))
            for k in range(5)]  # fmt: skip
    joints = [Joint(k, k - 1, (0, y, -0.1 * k)) for k in range(5) for y in (-0.02, 0.02)]
    return RigidBodies(bars, joints=joints, apart=[(i, j) for i in range(5) for j in range(i)])


def portal():
    """A beam hinged to two posts."""
    bodies = [RigidBody(cuboid((0.1, 0.1, 1)), position=(x, 0, 0.5)) for x in (0, 2)]
    bodies.append(RigidBody(cuboid((2.1, 0.1, 0.1)), position=(1, 0, 1.05)))
    joints = [Joint(2, post, (2 * post, y, 1)) for post in (0, 1) for y in (-0.05, 0.05)]
    return RigidBodies(bodies, [FLOOR], joints=joints, apart=[(0, 2), (1, 2)])


def lying_chain(n):
    """Links on the floor."""
    bars = [RigidBody(cuboid((0.09, 0.03, 0.03)), position=((k + 0.5) * 0.1, 0, 0.015))
            for k in range(n)]  # fmt: skip
    joints = [Joint(k, k - 1, (0.1 * k, y, 0.015)) for k in range(1, n) for y in (-0.01, 0.01)]
    return RigidBodies(bars, [FLOOR], joints=joints, apart=[(k, k + 1) for k in range(n - 1)])


@pytest.mark.parametrize(
    ("system", "until"), [(hanging_chain(), 0.03), (portal(), 0.01), (lying_chain(30), 3e-3)]
)
def test_what_stands_still_loses_no_energy(system, until):
    """What is lost there is an error of solves; any part of nothing was much."""
    assert [w for s in run(system, 1e-3, until) for w in s.warnings] == []


def test_contacts_of_parts_that_move_whole_are_never_decided(monkeypatch):
    """Which is told of masses alone; joints that were asked say the same."""

    def decided():
        system = replace(portal(), joints=[*portal().joints, Joint(0, GROUND, (0, 0, 0))])
        steps = [run(each, 1e-3, 2e-3)[-1] for each in (portal(), lying_chain(4), system)]
        return [(len(step.r), len(step.warnings)) for step in steps]

    found = decided()
    monkeypatch.setattr(Joints, "_carried", lambda self, at, _: np.zeros(len(at.slave), bool))
    assert decided() == found
    assert found[0][0] == found[2][0] == 8


def test_a_motion_given_later_may_be_jolted():
    """A jolt is no error of the steps, in whichever of them; none of it divides by zero."""
    system = replace(hanging_chain(), gravity=(0, 0, 0))
    rest = run(system, 1e-3, 2e-3)[-1].state
    thrown = np.zeros((5, 3))
    thrown[:, 2] = 1.0  # all of which the joint on the ground takes
    given = replace(rest, motion=rest.motion._replace(velocity=thrown))
    steps = run(system, 1e-3, 5e-3, start=given)
    assert steps[0].energies.joints == pytest.approx(-0.5 * 5 * system.bodies[0].mass)
    assert [w for s in steps for w in s.warnings] == []
    again = run(system, 1e-3, 5e-3, start=steps[0].state)[-1].state
    assert again.lost == steps[-1].state.lost
    np.testing.assert_array_equal(again.motion.velocity, steps[-1].state.motion.velocity)


def turntable(mu):
    """A disc on the floor with a hinge about the vertical."""
    disc = RigidBody(cuboid((1, 1, 0.1)), position=(0, 0, 0.05), spin=(0, 0, 5), name="table")
    joints = [Joint(0, GROUND, (0, 0, z)) for z in (0.05, 0.2)]
    return RigidBodies([disc], [FLOOR], mu=mu, joints=joints)


def test_friction_of_a_contact_whose_normal_joints_decide_is_not_lost():
    """Between no load of the floor and all of it; which of these the warning leaves open."""
    steps = run(turntable(0.5), 1e-3, 0.05)
    free = 5 - 0.05 * 0.5 * G * np.sqrt(0.5) / (
        1 / 6
    )  # torque mu m g a / sqrt 2 of four corners
    spin = steps[-1].state.motion.spin[0, 2]
    assert free - 1e-3 < spin < 4.9
    (said,) = [w for s in steps for w in s.warnings]
    assert said.name == "friction-undetermined"
    assert "body 0 'table' and a plane" in said.message
    (smooth,) = run(turntable(0.0), 1e-3, 1e-3)
    assert smooth.state.motion.spin[0, 2] == pytest.approx(5, abs=1e-9)
    assert smooth.warnings == ()


@pytest.mark.parametrize("side", [1e-2, 1e2])
def test_what_a_joint_decides_depends_on_its_own_bodies_alone(side):
    """A joint elsewhere, of a body that is far lighter or heavier, changes nothing."""

    def end(*others):
        spin = np.array([0, -2.0, 0])
        at = np.array([0.5, 0, 0.5])
        block = RigidBody(
            cuboid((1, 0.4, 1)), position=at, spin=spin, velocity=np.cross(spin, at)
        )
        joints = [Joint(0, GROUND, (0, y, 0)) for y in (-0.2, 0.2)]
        joints += [Joint(1, GROUND, (400 - side, y, 400)) for y in (0, side) if others]
        system = RigidBodies([block, *others], [FLOOR], joints=joints)
        return run(system, 2e-3, 0.02, tolerance=1e-10, overlap=1e-2)[-1]  # none to mend

    other = RigidBody(cuboid((side, side, side)), position=(400, 0, 400))
    np.testing.assert_allclose(end(other).position[0], end().position[0], atol=1e-8)


def test_perpendicular_walls_do_not_face_each_other():
    """Turned ones make a cosine of a rounding's size."""
    at = np.array([0, 0])
    turned = np.array([[np.cos(a), np.sin(a), 0] for a in (0.7, 0.7 + 0.5 * np.pi)])
    turned[1, 0] -= 1e-16

    def faces(normals):
        axes = np.stack([np.stack([n, n, n]) for n in normals])
        rows = Rows(at, at - 1, axes, np.zeros((2, 3)), np.zeros((2, 3)))
        guides = Guides.of(normals)
        return guides is not None and guides.hold(rows, 2, 1)

    assert not faces(turned)
    assert faces(np.array([turned[0], -turned[0]]))


@pytest.mark.parametrize("tilt", [1e-8, 1e-6])
def test_two_joints_on_a_line_do_not_weld_where_they_are_not_quite_on_it(tilt):
    """A wheel that turns on a stand moves as it does with joints in line to the last digit."""
    stand = RigidBody(cuboid((0.2, 0.2, 0.2)), 1000, (0, 0, 0.1))
    wheel = RigidBody(cuboid((0.1, 0.3, 0.1)), 1000, (0.3, 0, 0.1), spin=(30.0, 0, 0))
    pins = [Joint(1, 0, (x, 0, 0.1)) for x in (0.1, 0.3)]
    system = RigidBodies([stand, wheel], [FLOOR], mu=0.5, joints=pins)
    start = at_start(system)
    turned = start.motion.orientation.copy()
    turned[1] = 1, 0, 0.5 * tilt, 0
    begins = start, replace(start, motion=start.motion._replace(orientation=turned))
    straight, off = (
        run(system, 1e-3, 0.05, start=begin)[-1] for begin in begins
    )
    np.testing.assert_allclose(off.state.motion.spin, straight.state.motion.spin, atol=1e-5)
    np.testing.assert_allclose(off.joints, straight.joints, atol=1e-6)
