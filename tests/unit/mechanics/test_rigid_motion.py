"""Rigid bodies that move: a top, a cradle, and what is said of bodies that overlap."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

import amontons as am
from amontons.core.clock import Deadline
from amontons.mechanics.multibody import (
    GROUND,
    Ball,
    Joint,
    RigidBodies,
    RigidBody,
    cuboid,
    evolve_rigid,
    solving,
)
from amontons.solvers.driver import drive_as_asked

FLOOR = am.Plane((0, 0, 1))
G = 9.81


def last(system, step, until, **options):
    """The last step, and all of them."""
    steps = list(evolve_rigid(system, step=step, until=until, **options))
    return steps[-1], steps


def test_a_top_nods_and_turns_as_lagrange_says():
    """Its moment is about another axis than its spin: errors of second order in the step."""
    tilt, spin, arm, until = 0.4, 60.0, 0.15, 0.5
    axis = np.array([np.sin(tilt), 0, np.cos(tilt)])
    top = RigidBody(cuboid((0.2, 0.2, 0.05)), position=arm * axis, spin=spin * axis,
                    orientation=(np.cos(tilt / 2), 0, np.sin(tilt / 2), 0))  # fmt: skip
    weight, across = top.mass * G * arm, top.inertia[0, 0] + top.mass * arm**2
    along = top.inertia[2, 2] * spin  # moment of momentum about its axis, kept as that about z

    def lagrange(t, y):
        turning = along * (np.cos(tilt) - np.cos(y[0])) / (across * np.sin(y[0]) ** 2)
        moment = (across * turning * np.cos(y[0]) - along) * turning + weight
        return y[1], moment * np.sin(y[0]) / across, turning

    found = integrate.solve_ivp(lagrange, (0, until), (tilt, 0, 0), rtol=1e-10, atol=1e-11)
    nod, _, turn = found.y[:, -1]
    expected = np.sin(nod) * np.cos(turn), np.sin(nod) * np.sin(turn), np.cos(nod)
    system = RigidBodies([top], joints=[Joint(0, GROUND, (0, 0, 0))])
    missed, gained = [], []
    for step in (2e-3, 1e-3):
        end, steps = last(system, step, until, tolerance=1e-10)
        missed.append(np.linalg.norm(end.rotation[0][:, 2] - expected))
        gained.append(abs(sum(s.energies.gain for s in steps)) / weight)
    assert missed[0] < 1e-3  # 0.009 where joints are not closed, 0.019 with a whole free step
    assert gained[0] < 1e-3  # 0.011 with that
    assert missed[1] < 0.35 * missed[0]
    assert gained[1] < 0.4 * gained[0]


def test_bodies_that_overlap_as_given_are_named():
    """Depth, place and both bodies; nothing where they only touch, or of later steps."""
    balls = [
        RigidBody(Ball(0.1), position=(x, 0, z), name=name)
        for x, z, name in ((0, 0.1, "left"), (0.17, 0.1, ""), (1, 0.1, ""), (2, 0.08, ""))
    ]
    _, steps = last(RigidBodies(balls, [FLOOR]), 1e-3, 3e-3)
    (said,) = steps[0].warnings
    assert said.name == "overlap-at-start"
    words = "body 1 and body 0 'left' overlap at the start by 0.03 at (0.085, 0, 0.1), 2 pairs"
    assert words in said.message
    assert not steps[1].warnings
    assert not last(RigidBodies(balls[2:3], [FLOOR]), 1e-3, 1e-3)[0].warnings


@pytest.mark.parametrize(("gap", "speeds"), [(0, (-0.5, 0.5, 0.5, 0.5)), (1e-3, (0, 0, 0, 1))])
def test_a_cradle_passes_on_what_newtons_restitution_says(gap, speeds):
    """u1 = -u0 at the contact that is hit, 0 at those that rest: momentum and energy stay."""
    row = [RigidBody(Ball(0.1), position=((0.2 + gap) * k, 0, 0)) for k in range(3)]
    first = RigidBody(Ball(0.1), position=(-0.205, 0, 0), velocity=(1, 0, 0))
    system = RigidBodies([first, *row], mu=0.0, restitution=1.0, gravity=(0, 0, 0))
    end, _ = last(system, 1e-3, 0.03, tolerance=1e-9)
    np.testing.assert_allclose(end.state.motion.velocity[:, 0], speeds, atol=1e-6)


def test_overlaps_with_several_planes_are_counted_from_below():
    """A body in two planes is one pair of bodies: `at least`."""
    balls = [RigidBody(Ball(0.1), position=(x, 0.08, 0.08)) for x in (0, 1)]
    _, (first, *_) = last(RigidBodies(balls, [FLOOR, am.Plane((0, 1, 0))]), 1e-3, 1e-3)
    assert ", at least 2 pairs in all:" in first.warnings[0].message


def test_the_mending_of_overlaps_is_limited_in_time_and_judged(monkeypatch):
    """Where it is not done it ends the step, with a word of what was to be mended."""
    seen, deadline = [], Deadline.after(600.0)

    def stopped(problem, asked, *rest):
        seen.append(asked.deadline)
        return drive_as_asked(problem, replace(asked, max_iterations=1), *rest)

    monkeypatch.setattr(solving, "drive_as_asked", stopped)
    balls = [RigidBody(Ball(0.1), position=(0.17 * k, 0, 0.1)) for k in range(3)]
    system, asked = RigidBodies(balls, [FLOOR]), {"step": 1e-3, "until": 1e-3}
    asked |= {"solver": am.GaussSeidel(), "deadline": deadline}
    with pytest.raises(am.NotConverged, match="step 1, overlaps to be mended"):
        next(evolve_rigid(system, **asked))
    assert seen == [deadline]
    next(evolve_rigid(system, **asked, check=False))
    assert seen == [deadline] * 3


def test_a_wheel_without_rim_rolls_down_as_mcgeer_says():
    """T. McGeer, Passive dynamic walking, IJRR 9 (1990): a corner's impact keeps eta of w."""
    count, radius, slope, step = 8, 0.5, 0.12, 2e-3
    half = np.pi / count
    around = 2 * half * (np.arange(count) + 0.5)
    corners = radius * np.column_stack([np.cos(around), np.sin(around)])
    sides = [np.column_stack([corners, np.full(count, z)]) for z in (-0.2, 0.2)]
    shape = am.Polyhedron(np.vstack(sides))
    still = RigidBody(shape, 1000)
    own, arm = still.inertia[2, 2], still.mass * radius**2
    eta = (own + arm * np.cos(2 * half)) / (own + arm)
    gained = 2 * arm / radius * G / (own + arm) * 2 * np.sin(slope) * np.sin(half)
    after = eta * np.sqrt(gained / (1 - eta**2))  # angular velocity of the cycle
    height = radius * np.cos(half)
    begins = after * np.array([height, 0, radius * np.sin(half)])
    wheel = RigidBody(shape, 1000, (0, 0, height), (1, 1, 0, 0), begins, (0, after, 0))
    pull = G * np.array([np.sin(slope), 0, -np.cos(slope)])
    system = RigidBodies([wheel], [FLOOR], mu=1.5, gravity=pull)
    end, steps = last(system, step, 8 * 0.38814)  # once round, by the pendulum's equation
    speeds = np.array([s.state.motion.spin[0, 2] for s in steps])
    assert end.position[0, 0] == pytest.approx(16 * radius * np.sin(half), rel=0.01)
    assert np.abs(speeds).max() == pytest.approx(after / eta, rel=0.01)
    assert max(abs(s.energies.defect) for s in steps) < 1e-11


def test_more_balls_of_a_cradle_keep_momentum_and_energy():
    """u1 = -u0 at the contact that is hit, 0 at those at rest: two balls hit three."""
    start = (0, 0.1, 0.21, 0.31, 0.41)
    speeds = [float(x < 0.2) for x in start]
    balls = [
        RigidBody(Ball(0.05), 1000, (x, 0, 0), velocity=(speed, 0, 0))
        for x, speed in zip(start, speeds, strict=True)
    ]
    end, _ = last(RigidBodies(balls, mu=0, restitution=1, gravity=(0, 0, 0)), 1e-3, 0.03)
    speeds = end.state.motion.velocity[:, 0]
    assert speeds == pytest.approx([-0.2, -0.2, 0.8, 0.8, 0.8], abs=1e-5)
