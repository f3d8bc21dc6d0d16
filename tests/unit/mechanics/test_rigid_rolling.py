"""Balls whose contacts resist rolling and spinning, against closed forms."""

import numpy as np
import pytest

import amontons as am

G, R, MASS = 9.81, 0.1, 1000 * 4 / 3 * np.pi * 0.1**3


def on_floor(until, *, velocity=0.0, spin=(0, 0, 0), slope=0.0, mu=0.5, **lengths):
    """Steps of a ball on a plane that falls along x by tan = slope."""
    angle = np.arctan(slope)
    ball = am.RigidBody(am.Ball(R), 1000, (0, 0, R), velocity=(velocity, 0, 0), spin=spin)
    system = am.RigidBodies(
        [ball], [am.Plane((0, 0, 1))], mu=mu,
        gravity=(G * np.sin(angle), 0, -G * np.cos(angle)), **lengths,
    )  # fmt: skip
    return list(am.evolve_rigid(system, step=2e-3, until=until, tolerance=1e-12))


@pytest.mark.parametrize("way", [1, -1])
def test_a_ball_rolls_to_rest(way):
    """v' = -5/7 rolling g / R: after 7 v R / (5 rolling g) and 7 v^2 R / (10 rolling g)."""
    v, rolling = 0.3 * way, 0.005
    steps = on_floor(1.0, velocity=v, spin=(0, v / R, 0), rolling=rolling)
    assert abs(steps[-1].state.motion.velocity).max() < 1e-12
    way_to_rest = 0.7 * v * abs(v) * R / (rolling * G)
    assert steps[-1].position[0, 0] == pytest.approx(way_to_rest, rel=1e-5)
    moving = [s for s in steps if abs(s.state.motion.velocity[0, 0]) > 1e-9]
    assert moving[-1].time == pytest.approx(1.4 * abs(v) * R / (rolling * G), abs=2e-3)
    assert steps[9].regimes.rolls.all() and not steps[9].regimes.slips.any()
    assert not steps[-1].regimes.rolls.any() and steps[-1].status[0] == am.ContactStatus.STICK
    moment = MASS * G * rolling * 2e-3
    assert np.linalg.norm(steps[9].moments) == pytest.approx(moment, rel=1e-9)
    assert max(abs(s.energies.defect) for s in steps) < 1e-14 * MASS


@pytest.mark.parametrize("spin", [5.0, -5.0])
def test_a_ball_stops_spinning(spin):
    """2/5 R^2 |spin| / (torsion g), and does not go anywhere."""
    steps = on_floor(1.1, spin=(0, 0, spin), torsion=0.002)
    turning = [s for s in steps if abs(s.state.motion.spin[0, 2]) > 1e-9]
    assert turning[-1].time == pytest.approx(0.4 * R**2 * 5 / (0.002 * G), abs=2e-3)
    assert turning[5].regimes.spins.all() and not steps[-1].regimes.spins.any()
    np.testing.assert_allclose(steps[-1].position, [[0, 0, R]], atol=1e-12)


def test_a_ball_rests_on_a_slope_up_to_rolling_over_radius():
    """And beyond it rolls with 5/7 (g sin - rolling / R g cos)."""
    rest = on_floor(0.4, slope=0.0499, rolling=0.005)
    assert abs(rest[-1].position[0, 0]) < 1e-12
    roll = on_floor(0.4, slope=0.06, rolling=0.005)
    a = 5 / 7 * G * (np.sin(np.arctan(0.06)) - 0.05 * np.cos(np.arctan(0.06)))
    assert roll[-1].position[0, 0] == pytest.approx(0.5 * a * 0.4**2, rel=1e-9)
    slides = on_floor(0.4, slope=0.2, mu=0.1, rolling=0.05)  # rolling / R > tan > mu
    a = G * (np.sin(np.arctan(0.2)) - 0.1 * np.cos(np.arctan(0.2)))
    assert slides[-1].position[0, 0] == pytest.approx(0.5 * a * 0.4**2, rel=1e-9)
    assert slides[-1].regimes.slips.all() and abs(slides[-1].state.motion.spin).max() < 1e-12


def test_two_balls_that_meet_keep_both_momenta():
    """Moments act on both bodies: what one is given the other loses."""
    first = am.RigidBody(am.Ball(0.1), 1000, (0, 0, 0), velocity=(1, 0.2, 0), spin=(5, 3, -9))
    second = am.RigidBody(am.Ball(0.2), 500, (0.305, 0.02, 0.03), spin=(-2, 1, 4))
    system = am.RigidBodies(
        [first, second], mu=0.3, gravity=(0, 0, 0), rolling=0.01, torsion=0.02
    )
    # what mends overlaps displaces bodies, which changes x x v
    steps = list(am.evolve_rigid(system, step=1e-3, until=0.05, tolerance=1e-12, overlap=0.5))
    masses = np.array([first.mass, second.mass])
    inertia = np.array([first.inertia[0, 0], second.inertia[0, 0]])

    def momenta(step):
        v, x = step.state.motion.velocity, step.position
        own = np.einsum("bij,bj->bi", step.rotation, step.state.motion.spin)
        turning = (inertia[:, None] * own + masses[:, None] * np.cross(x, v)).sum(axis=0)
        return np.concatenate([masses @ v, turning])

    assert any(len(s.r) and s.r[0, 0] > 0 and abs(s.moments).min() > 0 for s in steps)
    # axes turn within the step of the impact: what is kept is so to the square of the step
    np.testing.assert_allclose(momenta(steps[-1]), momenta(steps[0]), atol=5e-6)
    assert steps[-1].energies.kinetic < steps[0].energies.kinetic


def test_steps_go_on_from_a_state_with_the_same_numbers():
    steps = on_floor(0.1, velocity=0.3, rolling=0.005, torsion=0.001)
    half = steps[24].state
    again = list(am.evolve_rigid(steps[0].system, step=2e-3, until=0.1, start=half,
                                 tolerance=1e-12))  # fmt: skip
    np.testing.assert_array_equal(again[-1].position, steps[-1].position)
    np.testing.assert_array_equal(again[-1].moments, steps[-1].moments)


@pytest.mark.parametrize(("lengths", "words"), [
    ({"rolling": -0.1}, "rolling"), ({"torsion": np.nan}, "torsion"),
    ({"rolling": 0.1, "joints": [am.Joint(0, -1, (0, 0, 0))]}, "joints"),
])  # fmt: skip
def test_what_does_not_fit_is_refused_in_words(lengths, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.RigidBodies([am.RigidBody(am.Ball(0.1))], **lengths)
