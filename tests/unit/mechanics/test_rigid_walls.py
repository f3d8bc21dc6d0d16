"""Walls of rigid bricks: levers, and interior points on the bodies."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.multibody import solving, sweeping
from amontons.mechanics.multibody.quick import Found
from amontons.mechanics.multibody.sweeping import Search


def wall(courses=4, across=3):
    """Bricks on bricks, pushed by a ball."""
    blocks = [am.RigidBody(am.cuboid((0.2, 0.1, 0.1)), 2000,
                           (0.2 * k + 0.1 * (row % 2), 0, 0.05 + 0.1 * row))
              for row in range(courses) for k in range(across)]  # fmt: skip
    ball = am.RigidBody(am.Ball(0.1), 8000, (0.2, -0.151, 0.2), velocity=(0, 2, 0))
    return am.RigidBodies([*blocks, ball], [am.Plane((0, 0, 1))], mu=0.6)


def shaken(part):
    """Bricks on bricks, not side by side, pushed across by a part of what friction holds."""
    blocks = [am.RigidBody(am.cuboid((0.2, 0.1, 0.1)), 2000,
                           (0.23 * k + 0.07 * (row % 2), 0.01 * (row % 3), 0.05 + 0.1 * row))
              for row in range(4) for k in range(3)]  # fmt: skip
    push = part * 0.6 * 9.81 * np.array([0.6, 0.8])
    return am.RigidBodies(blocks, [am.Plane((0, 0, 1))], mu=0.6,
                          gravity=lambda t: (*(push * min(t / 5e-3, 1)), -9.81))  # fmt: skip


@pytest.fixture
def searches(monkeypatch):
    """The searches of the steps of a wall, as they begin."""
    made = []

    class Kept(Search):
        def __post_init__(self):
            super().__post_init__()
            made.append(self)

    monkeypatch.setattr(solving, "Search", Kept)
    monkeypatch.setattr(sweeping, "WORK", 0)
    return made


def test_levers_give_what_contacts_do_to_each_other(searches):
    """W = G G^T, with the signs of slave and master and arms in global axes."""
    _ = list(am.evolve_rigid(wall(), step=1e-3, until=2e-3, tolerance=1e-3))
    for search in searches:
        n, bodies = len(search.posed.q), len(search.mobility[0])
        G = np.zeros((n, 3, bodies, 6))
        for side in range(2):
            for i in range(n):
                if search.sides[i, side] >= 0:
                    G[i, :, search.sides[i, side]] += search.levers[i, side]
        G = G.reshape(3 * n, 6 * bodies)
        posed, W = search.posed, np.zeros((n, 3, n, 3))
        for i in range(n):
            for k in range(posed.indptr[i], posed.indptr[i + 1]):
                W[i, :, posed.indices[k]] = posed.data[k]
        W = W.reshape(3 * n, 3 * n)
        np.testing.assert_allclose(G @ G.T, W, atol=1e-12 * abs(W).max())


def test_an_interior_point_solves_the_law_from_nothing(searches):
    """In some ten steps, sliding included, whichever reactions bricks choose from."""
    made = []
    for part in (0.5, 1.2):
        _ = list(am.evolve_rigid(shaken(part), step=1e-3, until=8e-3, tolerance=1e-5))
        made += searches
        searches.clear()
    ended = []
    for search in made:
        search.latest, search.relaxing = np.zeros_like(search.r), 0
        r = search.relax(sweeping.FOLLOWED)
        ended.append((search.relaxing, search.problem.error(r) / search.tolerance))
    steps, errors = np.transpose(ended)
    assert np.median(steps) <= 15
    assert np.mean(errors <= 1) >= 0.8


def test_relaxations_take_joints_and_bricks(searches, monkeypatch):
    """They are made to solve each step, with sweeps; with the sliding found they do alone."""
    monkeypatch.setattr(Search, "swept_while_promising", lambda self, start: None)
    beam = [am.RigidBody(am.cuboid((0.5, 0.05, 0.05)), 1000, (0.25 + 0.5 * k, 0, 0.025))
            for k in range(3)]  # fmt: skip
    joints = [am.Joint(k, k + 1, (0.5 * (k + 1), y, 0.025)) for k in range(2)
              for y in (-0.02, 0.02)]  # fmt: skip
    chain = am.RigidBodies(beam, [am.Plane((0, 0, 1))], mu=0.4, joints=joints,
                           apart=[(0, 1), (1, 2)])  # fmt: skip
    for system in (wall(), chain):
        searches.clear()
        steps = am.evolve_rigid(system, step=1e-3, until=4e-3, tolerance=1e-5)
        solved = [s for s in steps if isinstance(s._solved, Found)]
        assert len(solved) > 2
        relaxed = [s for s in searches if s.mu > 0 and s.relaxing > 0]
        missed = []
        for search in relaxed:
            found, r = sweeping.found_quickly(search)
            assert found is not None
            search.latest = r
            missed.append(search.offer(search.relax()) / search.goal)
        # of sliding that is known to the tolerance; each is from .2 to 12 by rounding alone
        assert np.median(missed) <= 5
        assert max(missed) <= 30
        assert all(s.solution.problem.error(s.solution.r) <= 1e-5 for s in solved)


@pytest.mark.parametrize(("part", "tolerance"), [(0.5, 1e-4), (0.5, 1e-5), (0.9, 1e-4)])
def test_corners_of_a_wall_do_not_drop_out(part, tolerance):
    """Errors of solves opened 1e-10: 27 to 72 contacts in turn, ten times the work."""
    steps = list(am.evolve_rigid(shaken(part), step=1e-3, until=0.06, tolerance=tolerance))
    assert min(len(step.r) for step in steps) >= 64  # of 72, as it tips
    assert all(isinstance(step._solved, Found) for step in steps)
    assert sum(step._solved.sweeps for step in steps) < 2500
    if part == 0.5:
        assert abs(steps[-1].position - steps[0].position).max() == pytest.approx(
            5.168e-4, rel=2e-3
        )
