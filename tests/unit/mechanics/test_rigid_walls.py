"""Walls of rigid bricks: relaxations on the bodies find what those by W find."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.multibody import moving, sweeping
from amontons.mechanics.multibody.quick import Found
from amontons.mechanics.multibody.sweeping import Search
from amontons.solvers.newton.interior_point import InteriorPoint
from amontons.solvers.newton.smoothing import Workspace


def wall(courses=4, across=3):
    """Bricks on bricks, pushed by a ball."""
    blocks = [am.RigidBody(am.cuboid((0.2, 0.1, 0.1)), 2000,
                           (0.2 * k + 0.1 * (row % 2), 0, 0.05 + 0.1 * row))
              for row in range(courses) for k in range(across)]  # fmt: skip
    ball = am.RigidBody(am.Ball(0.1), 8000, (0.2, -0.151, 0.2), velocity=(0, 2, 0))
    return am.RigidBodies([*blocks, ball], [am.Plane((0, 0, 1))], mu=0.6)


@pytest.fixture
def searches(monkeypatch):
    """The searches of the steps of a wall, as they begin."""
    made = []

    class Kept(Search):
        def __post_init__(self):
            super().__post_init__()
            made.append(self)

    monkeypatch.setattr(moving, "Search", Kept)
    monkeypatch.setattr(sweeping, "WORK", 0)
    return made


def test_the_relaxation_on_the_bodies_is_that_of_the_contacts(searches):
    """Levers give W, and the motion of the relaxation, which is unique, is the same."""
    steps = list(am.evolve_rigid(wall(), step=1e-3, until=5e-3, tolerance=1e-9))
    assert all(s.solution.converged for s in steps)
    for search in [s for s in searches if s.mu > 0][:3]:
        found = am.drive(search.posed.problem(am.Coulomb(np.full(search.contacts, 0.6))),
                         tolerance=1e-10)  # fmt: skip
        slip = np.hypot(*found.u[:, 1:].T)  # with it the relaxation has the solution
        problem = am.FrictionProblem.from_delassus(
            search.posed.problem(am.Coulomb(np.full(search.contacts, 0.6))).W,
            search.posed.q, 0.6,
        )  # fmt: skip
        n, bodies = len(search.posed.q), len(search.bodies[0])
        G = np.zeros((n, 3, bodies, 6))
        for side in range(2):
            for i in range(n):
                if search.sides[i, side] >= 0:
                    G[i, :, search.sides[i, side]] += search.levers[i, side]
        G = G.reshape(3 * n, 6 * bodies)
        W = problem.W.toarray()
        np.testing.assert_allclose(G @ G.T, W, atol=1e-12 * abs(W).max())
        goal = 1e-8 * problem.q_norm
        theirs = InteriorPoint().relax(Workspace.of(problem), slip, goal)[1]
        p = search.posed
        ours, _ = sweeping.relaxed(
            search.levers, search.sides, search.matrix, (p.indptr, p.indices, p.data), p.q,
            search.law[:2], search.law[2], slip, goal, 60,
        )  # fmt: skip
        moved = (problem.velocity(r)[0] for r in (theirs, ours))
        size = np.abs(problem.q).max()
        theirs, ours = moved
        np.testing.assert_allclose(ours, theirs, atol=1e-5 * size)
        np.testing.assert_allclose(ours, found.u, atol=1e-5 * size)


def test_relaxations_with_joints_and_walls_keep_the_tolerance(searches, monkeypatch):
    """Each chunk of sweeps too short to do it alone, so that relaxations have to."""
    monkeypatch.setattr(sweeping, "CHUNK", 20)
    beam = [am.RigidBody(am.cuboid((0.5, 0.05, 0.05)), 1000, (0.25 + 0.5 * k, 0, 0.026))
            for k in range(3)]  # fmt: skip
    joints = [am.Joint(k, k + 1, (0.5 * (k + 1), y, 0.026)) for k in range(2)
              for y in (-0.02, 0.02)]  # fmt: skip
    chain = am.RigidBodies(beam, [am.Plane((0, 0, 1))], mu=0.4, joints=joints,
                           apart=[(0, 1), (1, 2)])  # fmt: skip
    for system in (wall(), chain):
        searches.clear()
        steps = list(am.evolve_rigid(system, step=1e-3, until=0.01, tolerance=1e-6))
        found = [s for s in steps if isinstance(s._solved, Found)]
        assert len(found) > 5
        for step in found:
            problem = step.solution.problem
            assert problem.error(step.solution.r) <= 1e-6
        if system is not chain:
            assert any(search.relaxing for search in searches)
