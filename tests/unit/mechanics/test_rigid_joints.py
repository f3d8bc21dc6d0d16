"""Joints of rigid bodies: what they take, contacts that hang on them, guides without play."""

import numpy as np
import pytest
from scipy import integrate

import amontons as am
from amontons.mechanics.multibody import GROUND, Joint, RigidBodies, RigidBody, cuboid

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
    steps = run(RigidBodies([block], [FLOOR], joints=joints), 1e-3, 0.3)
    arm = at - hinge
    about = block.inertia[1, 1] + block.mass * (arm @ arm)
    begin, length = np.arctan2(arm[2], arm[0]), np.hypot(*arm[[0, 2]])

    def fall(_, y):
        return [y[1], -block.mass * G * length * np.cos(y[0]) / about]

    swung = integrate.solve_ivp(fall, (0, 0.3), [begin, 2.0], rtol=1e-10, atol=1e-10)
    end = steps[-1].position[0] - hinge
    assert np.arctan2(end[2], end[0]) == pytest.approx(swung.y[0, -1], abs=2e-6)
    assert np.ptp(energy(steps)) < 1e-8 * block.mass * G


def test_a_block_falls_back_onto_the_edge_beyond_its_hinge():
    """What the joint does not decide still stands on the floor."""
    block = RigidBody(cuboid((1, 0.4, 1)), position=(0.5, 0, 0.5), spin=(0, -1.0, 0),
                      velocity=np.cross((0, -1.0, 0), (0.5, 0, 0.5)))  # fmt: skip
    joints = [Joint(0, GROUND, (0, y, 0)) for y in (-0.2, 0.2)]
    end = run(RigidBodies([block], [FLOOR], joints=joints), 1e-3, 0.4)[-1]
    np.testing.assert_allclose(end.position[0], (0.5, 0, 0.5), atol=2e-5)
    assert np.abs(end.state.motion.spin).max() < 1e-6
    carried = end.r[:, 0].sum() + end.joints[:, 2].sum()
    assert carried == pytest.approx(block.mass * G * 1e-3, rel=1e-5)


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
    """Energy is kept in truth; over the dead centre the crank turns by 0.1 rad in a step."""
    lost = []
    for step in (1e-3, 5e-4, 2.5e-4):
        steps = run(light_crank(), step, 0.05, tolerance=1e-9)
        E = energy(steps)
        lost.append(1 - E[-1] / E[0])
        works = sum(s.energies.joints + s.energies.contact for s in steps)
        assert works == pytest.approx(E[-1] - E[0], rel=1e-9)
        assert max(abs(s.energies.defect) for s in steps) < 1e-12 * E[0]
        names = [w.name for s in steps for w in s.warnings]
        assert names == (["joints-lose-energy"] if step == 1e-3 else [])
    assert lost[0] > 0.01
    assert lost[0] > 5 * lost[1] > 20 * lost[2]  # contacts of the guide are of first order


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_a_guide_without_play_does_not_squeeze(step):
    """Deceleration mu g: more would be an answer too, with any squeeze between both planes."""
    planes = [am.Plane((0, 0, 1), (0, 0, -0.15)), am.Plane((0, 0, -1), (0, 0, 0.15))]
    block = RigidBody(cuboid((0.3, 0.3, 0.3)), 300, (0, 0, 0), velocity=(2, 0, 0))
    steps = run(RigidBodies([block], planes, mu=0.3), step, 0.1, tolerance=1e-9)
    speeds = [s.state.motion.velocity[0, 0] for s in steps]
    np.testing.assert_allclose(
        speeds, [2 - 0.3 * G * s.time for s in steps], atol=1e-3 * 0.3 * G * 0.1
    )


def test_a_chain_falls_as_lagrange_says():
    """Six links let go level, in m and kg or in mm and t; angles from an ODE."""
    n, length, step, until = 6, 0.1, 2e-3, 0.2
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
