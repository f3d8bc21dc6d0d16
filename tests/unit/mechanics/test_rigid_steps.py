"""Steps in time of rigid bodies: theory, balances, joints, restart, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, optimize

import amontons as am
from amontons.linear.blocks import BlockRows
from amontons.mechanics.multibody import (
    GROUND,
    Ball,
    Joint,
    Polyhedron,
    RigidBodies,
    RigidBody,
    at_start,
    cuboid,
    evolve_rigid,
)
from amontons.mechanics.multibody.meeting import meetings
from amontons.mechanics.multibody.rows import (
    Rows,
    delassus,
    frames_of,
    impulses,
    rotations,
    velocities,
)

FLOOR = am.Plane((0, 0, 1))
G = 9.81


def tilted(angle):
    """Gravity of a floor that is tilted about y, downhill along x."""
    return (G * np.sin(angle), 0, -G * np.cos(angle))


def last(system, step, until, **options):
    """The last step, and all of them."""
    steps = list(evolve_rigid(system, step=step, until=until, **options))
    return steps[-1], steps


def test_w_is_h_inverse_mass_h():
    """The compiled blocks against the dense product; impulses are adjoint to velocities."""
    rng = np.random.default_rng(1)
    bodies = [RigidBody(cuboid(rng.uniform(0.5, 1, 3)), position=rng.uniform(0, 1.2, 3),
                        orientation=rng.standard_normal(4)) for _ in range(6)]  # fmt: skip
    system = RigidBodies(bodies, [FLOOR])
    motion = at_start(system).motion
    R = rotations(motion.orientation)
    found = meetings(system.packed, motion.position, R, np.full(6, 0.05))
    rows = Rows(found.slave, found.master, frames_of(found.normals),
                found.points - motion.position[found.slave],
                found.points - motion.position[found.master])  # fmt: skip
    assert (found.master == GROUND).any() and (found.master >= 0).any()
    n = 3 * len(found.slave)
    unit = np.eye(36).reshape(36, 2, 6, 3)
    HT = np.column_stack([velocities(rows, e[0], e[1]).ravel() for e in unit])
    masses = np.array([b.mass for b in bodies])
    inverse = np.array(
        [r @ np.linalg.inv(b.inertia) @ r.T for r, b in zip(R, bodies, strict=True)]
    )
    M_inverse = np.zeros((36, 36))
    for b in range(6):
        M_inverse[3 * b : 3 * b + 3, 3 * b : 3 * b + 3] = np.eye(3) / masses[b]
        M_inverse[18 + 3 * b : 21 + 3 * b, 18 + 3 * b : 21 + 3 * b] = inverse[b]
    W = BlockRows(*delassus(rows, masses, inverse))
    dense = np.zeros((n, n))
    for i in range(n // 3):
        assert (np.diff(W.indices[W.indptr[i] : W.indptr[i + 1]]) > 0).all()
        assert W.indices[W.diagonal[i]] == i
        for k in range(W.indptr[i], W.indptr[i + 1]):
            j = W.indices[k]
            dense[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = W.data[k]
    expected = HT @ M_inverse @ HT.T
    np.testing.assert_allclose(dense, expected, atol=1e-12 * np.abs(expected).max())
    r = rng.standard_normal((n // 3, 3))
    push, turn = impulses(rows, r, 6)
    np.testing.assert_allclose(
        np.concatenate([push, turn]).ravel(), HT.T @ r.ravel(), atol=1e-12
    )


def test_a_free_body_keeps_its_energy_and_its_momentum():
    """About its middle axis, where it turns over: both to rounding."""
    body = RigidBody(cuboid((1, 2, 3)), spin=(0.01, 3, 0))
    drift = []
    for step in (2e-2, 1e-2):
        end, steps = last(RigidBodies([body], gravity=(0, 0, 0)), step, 6.0)
        energies = [s.energies.kinetic for s in steps]
        np.testing.assert_allclose(energies, energies[0], rtol=1e-12)
        J = body.inertia
        L = end.rotation[0] @ J @ end.state.motion.spin[0]
        before = J @ np.array([0.01, 3, 0])
        drift.append(np.linalg.norm(L - before) / np.linalg.norm(before))
        assert min(s.state.motion.spin[0, 1] for s in steps) < -2  # it has turned over
    assert max(drift) < 1e-12


@pytest.mark.parametrize(("mu", "slips"), [(0.4, False), (0.1, True)])
def test_a_ball_rolls_down_at_five_sevenths(mu, slips):
    """a = 5/7 g sin where it rolls; g (sin - mu cos) where it slips, tan > 7/2 mu."""
    angle = 0.6
    ball = RigidBody(Ball(0.1), position=(0, 0, 0.1))
    system = RigidBodies([ball], [FLOOR], mu=mu, gravity=tilted(angle))
    end, steps = last(system, 1e-3, 0.5)
    rolls = 5 / 7 * G * np.sin(angle)
    slides = G * (np.sin(angle) - mu * np.cos(angle))
    expected = slides if slips else rolls
    assert end.state.motion.velocity[0, 0] == pytest.approx(0.5 * expected, rel=1e-6)
    assert end.position[0, 0] == pytest.approx(0.125 * expected, rel=3e-3)
    turning = 0.1 * end.state.motion.spin[0, 1]
    assert (turning < 0.9 * end.state.motion.velocity[0, 0]) == slips
    status = {am.ContactStatus(s).name for step in steps[1:] for s in step.status}
    assert status == {"SLIP" if slips else "STICK"}


@pytest.mark.parametrize(("mu", "moves"), [(0.35, False), (0.25, True)])
def test_a_box_on_a_slope_stays_or_slides(mu, moves):
    angle = np.arctan(0.3)
    box = RigidBody(cuboid((0.4, 0.4, 0.2)), position=(0, 0, 0.1))
    end, _ = last(RigidBodies([box], [FLOOR], mu=mu, gravity=tilted(angle)), 1e-3, 0.3)
    expected = 0.3 * G * (np.sin(angle) - mu * np.cos(angle)) if moves else 0.0
    assert end.state.motion.velocity[0, 0] == pytest.approx(expected, abs=1e-4)
    assert abs(end.position[0, 2] - 0.1) < 1e-5


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_a_ball_bounces_with_its_restitution(restitution):
    """Heights after a fall from 1: e^2, e^4."""
    ball = RigidBody(Ball(0.1), position=(0, 0, 1.1))
    system = RigidBodies([ball], [FLOOR], restitution=restitution)
    fall = np.sqrt(2 / G)
    _, steps = last(system, 1e-4, fall * (1 + 1.9 * restitution))
    heights = np.array([s.position[0, 2] for s in steps]) - 0.1
    times = np.array([s.time for s in steps])
    after = heights[times > fall + 1e-3]
    assert after.max(initial=0.0) == pytest.approx(restitution**2, abs=2e-3)
    assert heights.min() > -1e-3


def housner(b, h, tilt, impacts):
    """Times at which a block 2b x 2h passes its upright position, energies by [H].

    [H] G. W. Housner, "The behavior of inverted pendulum structures during earthquakes", BSSA
    53 (1963): (omega after / omega before) = 1 - 3/2 sin^2(alpha).
    """
    alpha, R = np.arctan2(b, h), np.hypot(b, h)
    c = 2 * G * R / (4 / 3 * R * R)

    def quarter(top):
        def slowness(s):
            return 2 * s / np.sqrt(c * (np.cos(alpha - top) - np.cos(alpha - (top - s * s))))

        return integrate.quad(slowness, 0, np.sqrt(top), epsabs=1e-12)[0]

    def height(angle):
        return np.cos(alpha - angle) - np.cos(alpha)

    lost = (1 - 1.5 * np.sin(alpha) ** 2) ** 2
    times, energy = [quarter(tilt)], height(tilt)
    for k in range(impacts):
        left = energy * lost ** (k + 1)
        top = optimize.brentq(lambda x, left=left: height(x) - left, 0, alpha)
        times.append(times[-1] + 2 * quarter(top))
    return times


def test_a_block_rocks_as_housner_says():
    b, h, tilt = 0.1, 0.5, 0.1
    expected = housner(b, h, tilt, 1)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0],
                     [-np.sin(tilt), 0, np.cos(tilt)]])  # fmt: skip
    block = RigidBody(
        cuboid((2 * b, 0.2, 2 * h)), 2500, np.array([b, 0, 0]) - turn @ [b, 0, -h],
        (np.cos(tilt / 2), 0, np.sin(tilt / 2), 0),
    )  # fmt: skip
    step = 5e-4
    _, steps = last(RigidBodies([block], [FLOOR], mu=2.0), step, 1.05)
    angle = np.array([2 * np.arctan2(*s.state.motion.orientation[0, [2, 0]]) for s in steps])
    at = np.flatnonzero(angle[:-1] * angle[1:] < 0)
    times = (at + 1 + angle[at] / (angle[at] - angle[at + 1])) * step
    assert times == pytest.approx(expected, rel=3e-3)
    assert max(abs(s.energies.defect) for s in steps) < 1e-12 * steps[0].energies.potential


def test_the_energy_balance_holds_to_rounding_with_impacts_and_mending():
    rng = np.random.default_rng(2)
    bodies = [RigidBody(cuboid((0.3, 0.2, 0.25)), position=(0.1 * k % 0.3, 0, 0.3 + 0.35 * k),
                        orientation=rng.standard_normal(4)) for k in range(4)]  # fmt: skip
    bodies.append(RigidBody(Ball(0.12), position=(0.05, 0.02, 1.9)))
    _, steps = last(RigidBodies(bodies, [FLOOR], mu=0.4), 1e-3, 0.8, tolerance=1e-8)
    size = steps[0].energies.potential
    assert max(abs(s.energies.defect) for s in steps) < 1e-12 * size
    assert sum(s.energies.contact for s in steps) < -0.1 * size
    assert max(s.energies.contact for s in steps) < 1e-3 * size
    assert any(s.energies.mending for s in steps)
    # contacts that mending has turned open would fall and be lifted again, step by step
    assert sum(s.energies.mending for s in steps) < 1e-2 * size
    overlaps = [-s.meetings.gaps.min() for s in steps if len(s.meetings.gaps)]
    assert max(overlaps) < 1e-2 and overlaps[-1] < 1e-4  # h / 2 times the speed


def test_gravity_in_time_is_that_of_the_middle_of_a_step():
    """A ball that falls freely: v is the sum of h g, x the same of v."""
    ball = RigidBody(Ball(0.1))
    system = RigidBodies([ball], gravity=lambda t: (np.sin(3 * t), 0, -t))
    end, steps = last(system, 1e-2, 1.0)
    middle = 1e-2 * (np.arange(100) + 0.5)
    v = 1e-2 * np.array([np.sin(3 * middle).sum(), 0, -middle.sum()])
    np.testing.assert_allclose(end.state.motion.velocity[0], v, rtol=1e-12)
    assert end.position[0, 2] == pytest.approx(-1 / 6, rel=1e-3)
    assert max(abs(s.energies.defect) for s in steps) < 1e-14 * ball.mass
    with pytest.raises(am.InvalidInput, match="gravity"):
        RigidBodies([ball], gravity=lambda t: (0, t))
    bad = RigidBodies([ball], gravity=lambda t: (0, 0, np.nan if t > 0.1 else -1))
    with pytest.raises(am.InvalidInput, match="gravity"):
        last(bad, 1e-2, 1.0)
    bad = RigidBodies([ball], gravity=lambda t: (0, 0, -1 / (t < 0.1)))
    with pytest.raises(am.InvalidInput, match=r"gravity\(t\) failed at t = 0.1.*Zero"):
        last(bad, 1e-2, 1.0)


def test_a_pendulum_swings_about_its_joint():
    """A rod on a hinge of two ball joints: small swings with the period of the books."""
    length, tilt = 1.0, 0.05
    rod = RigidBody(
        cuboid((0.02, 0.02, length)), position=(0.5 * np.sin(tilt), 0, -0.5 * np.cos(tilt)),
        orientation=(np.cos(tilt / 2), 0, -np.sin(tilt / 2), 0),
    )  # fmt: skip
    hinge = [Joint(0, GROUND, (0, y, 0)) for y in (-0.2, 0.2)]
    end, steps = last(RigidBodies([rod], joints=hinge), 1e-3, 2.0, tolerance=1e-10)
    period = 2 * np.pi * np.sqrt(2 * length / (3 * G)) * (1 + tilt**2 / 16)
    x = np.array([s.position[0, 0] for s in steps])
    down = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    times = (down + 1 + x[down] / (x[down] - x[down + 1])) * 1e-3
    assert np.diff(times) == pytest.approx(period, rel=1e-4)
    top = end.position[0] - end.rotation[0] @ [0, 0, -0.5]
    assert np.linalg.norm(top) < 2e-5
    energy = [s.energies.kinetic + s.energies.potential for s in steps]
    assert np.ptp(energy) < 1e-2 * (energy[0] + 0.5 * G * rod.mass)


def test_joints_take_no_energy():
    """A rod let go level: they lose by the third power of the step, not the first (1.4 %)."""
    rod = RigidBody(cuboid((1.0, 0.05, 0.05)), position=(0.5, 0, 0))
    hinge = [Joint(0, GROUND, (0, y, 0)) for y in (-0.1, 0.1)]  # along it they say things twice
    system = RigidBodies([rod], joints=hinge)
    lost = []
    for step in (4e-3, 2e-3):
        end, steps = last(system, step, 1.2, tolerance=1e-10)
        size = 0.5 * G * rod.mass
        assert abs(end.energies.kinetic + end.energies.potential) < 5e-5 * size  # as mended
        lost.append(-sum(s.energies.joints for s in steps) / size)
    assert 0 < lost[1] < 0.2 * lost[0] < 0.2 * 5e-5


def test_a_jolt_at_a_joint_is_an_impact_without_rebound():
    """A rod that flies into its joint: moment of momentum about it stays, the rest is lost."""
    rod = RigidBody(cuboid((1.0, 0.05, 0.05)), position=(0.5, 0, 0), velocity=(0, 0, 1.0))
    system = RigidBodies([rod], gravity=(0, 0, 0), joints=[Joint(0, GROUND, (0, 0, 0))])
    end, _ = last(system, 1e-4, 1e-2)
    about = rod.inertia[1, 1] + 0.25 * rod.mass
    assert end.energies.kinetic == pytest.approx((0.5 * rod.mass) ** 2 / (2 * about), rel=1e-3)


def test_balls_that_have_hit_go_on_together():
    """A row that nothing loads any more: q is 0, and no start makes an error finite."""
    row = [RigidBody(Ball(0.1), position=(0.2 * k, 0, 0)) for k in range(3)]
    first = RigidBody(Ball(0.1), position=(-0.205, 0, 0), velocity=(1, 0, 0))
    system = RigidBodies([first, *row], (), mu=0.0, gravity=(0, 0, 0))
    *_, last = evolve_rigid(system, step=1e-3, until=0.03)
    np.testing.assert_allclose(last.state.motion.velocity[:, 0], 0.25, atol=1e-6)


def test_impacts_at_contacts_that_part_gain_no_energy():
    """The middle ball leaves the first when the third one hits it; nothing is lost either."""
    R, speeds = 0.1, (0.0, 1.0, -2.0)
    balls = [RigidBody(Ball(R), position=(k * (2 * R - 5e-7), 0, 0), velocity=(v, 0, 0))
             for k, v in enumerate(speeds)]  # fmt: skip
    system = RigidBodies(balls, mu=0.0, restitution=1.0, gravity=(0, 0, 0))
    end, _ = last(system, 1e-7, 1e-7, tolerance=1e-12)
    before = 0.5 * balls[0].mass * sum(v * v for v in speeds)
    assert end.energies.kinetic == pytest.approx(before, rel=1e-9)


def test_a_weld_carries_the_weight_of_what_it_holds():
    """Three joints that lie on no line: the second body hangs on, the joints carry m g h."""
    first = RigidBody(cuboid((1, 1, 1)), position=(0, 0, 0.5))
    second = RigidBody(cuboid((0.5, 0.5, 0.5)), position=(0.75, 0, 0.75))
    weld = [Joint(1, 0, (0.5, *at)) for at in ((0, 0.75), (0.1, 0.75), (0, 0.85))]
    system = RigidBodies([first, second], [FLOOR], joints=weld, apart=[(0, 1)])
    end, _ = last(system, 1e-3, 0.05, tolerance=1e-9)
    np.testing.assert_allclose(
        end.joints.sum(axis=0), [0, 0, second.mass * G * 1e-3], atol=1e-5
    )
    np.testing.assert_allclose(end.position, [first.position, second.position], atol=1e-7)


def test_a_run_goes_on_from_a_state_with_the_same_numbers():
    bodies = [RigidBody(cuboid((0.2, 0.2, 0.2)), position=(0.02 * k, 0, 0.1 + 0.201 * k))
              for k in range(3)]  # fmt: skip
    system = RigidBodies(bodies, [FLOOR])
    end, steps = last(system, 1e-3, 0.06)
    again, _ = last(system, 1e-3, 0.06, start=steps[29].state)
    np.testing.assert_array_equal(again.position, end.position)
    np.testing.assert_array_equal(again.r, end.r)
    assert again.state.index == end.state.index


def test_dominoes_fall_one_after_another():
    dominoes = [RigidBody(cuboid((0.02, 0.1, 0.2)), position=(0.1 * k, 0, 0.1))
                for k in range(4)]  # fmt: skip
    dominoes[0] = replace(dominoes[0], spin=(0, 3.0, 0))
    end, steps = last(RigidBodies(dominoes, [FLOOR], mu=0.4), 2e-3, 1.0, tolerance=1e-5)
    tilts = np.array([np.arccos(np.clip(s.rotation[:, 2, 2], -1, 1)) for s in steps])
    assert (tilts[-1] > 0.5).all()
    fell = [np.flatnonzero(tilts[:, k] > 0.3)[0] for k in range(4)]
    assert fell == sorted(fell) and len(set(fell)) == 4


def voussoirs(thickness, count=9):
    """Stones of a semicircular arch of mean radius 1."""
    angles, out = np.linspace(0, np.pi, count + 1), []
    for a, b in zip(angles, angles[1:], strict=False):
        ring = [(r * np.cos(t), r * np.sin(t)) for t in (a, b)
                for r in (1 - thickness / 2, 1 + thickness / 2)]  # fmt: skip
        points = [(x, y, z) for x, z in ring for y in (-0.2, 0.2)]
        out.append(RigidBody(Polyhedron(points), 2000))
    return out


@pytest.mark.parametrize(("thickness", "stands"), [(0.14, True), (0.08, False)])
def test_an_arch_stands_on_both_sides_of_its_least_thickness(thickness, stands):
    """A semicircle needs t / R = 0.1075 (Milankovitch 1907); thinner, it falls."""
    system = RigidBodies(voussoirs(thickness), [FLOOR], mu=1.0)
    end, _ = last(system, 2e-3, 0.2 if stands else 0.6, tolerance=1e-4, check=False)
    sunk = system.bodies[4].position[2] - end.position[4, 2]
    assert (sunk < 2e-3) if stands else (sunk > 0.02)


@pytest.mark.parametrize(
    ("change", "match"),
    [({"mu": -0.1}, "mu"), ({"restitution": 1.5}, "restitution"),
     ({"gravity": (0, 1)}, "gravity"), ({"joints": [Joint(0, 5, (0, 0, 0))]}, "joints"),
     ({"planes": [am.Plane((0, 1))]}, "planes"),
     ({"apart": [(0, 0.5)]}, "apart"), ({"bodies": []}, "bodies"), ({"bodies": [1]}, "bodies"),
     ({"bodies": RigidBody(Ball(1.0))}, "bodies: expected a list"), ({"apart": [3]}, "apart"),
     ({"planes": am.Plane((0, 0, 1))}, "planes: expected a list"), ({"joints": [3]}, "joints"),
     ({"joints": [Joint(0, -1, (0, np.nan, 0))]}, r"joints\[0\].point")],
)  # fmt: skip
def test_bad_systems_are_refused_by_name(change, match):
    given = {"bodies": [RigidBody(Ball(1.0))], **change}
    with pytest.raises(am.InvalidInput, match=match):
        RigidBodies(**given)


@pytest.mark.parametrize(
    ("options", "match"),
    [({"step": 0.0}, "step"), ({"until": -1.0}, "until"), ({"overlap": -1}, "overlap"),
     ({"step": float("nan")}, "step"), ({"until": "late"}, "until"), ({"start": 3}, "start"),
     ({"tolerance": -1.0}, "tolerance")],
)  # fmt: skip
def test_bad_steps_are_refused_by_name(options, match):
    system = RigidBodies([RigidBody(Ball(1.0))])
    with pytest.raises(am.InvalidInput, match=match):
        evolve_rigid(system, **({"step": 1e-3, "until": 1.0} | options))


@pytest.mark.parametrize(
    ("options", "match"),
    [({"density": 0}, "density"), ({"position": (0, 1)}, "position"),
     ({"orientation": (0, 0, 0, 0)}, "orientation"), ({"velocity": (0, 0, np.nan)}, "velocity"),
     ({"shape": "ball"}, "shape"), ({"shape": cuboid((1, 1e-9, 1e-9))}, "shape: .* thicker"),
     ({"density": 1e-320}, "moments"), ({"density": 1e300}, r"up to 1e\+100 in size")],
)  # fmt: skip
def test_bad_bodies_are_refused_by_name(options, match):
    with pytest.raises(am.InvalidInput, match=match):
        RigidBody(**({"shape": Ball(1.0)} | options))
