"""Two deforming bodies where they are now: slopes, patch test, rotations, momentum, words."""

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.contact.current_mortar import MortarPair
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.meshes import Facets
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO, SOFT = am.NeoHookean(1.0, 0.3), am.LinearElastic(1.0, 0.3)
STEP = 1e-6


def lines(slaves=6, masters=8, apart=0.02):
    """A wavy line over another, which it overhangs at one end: (pair, positions)."""
    upper = np.stack([np.linspace(0.1, 1.3, slaves), np.full(slaves, apart)], axis=1)
    lower = np.stack([np.linspace(0, 1, masters), np.zeros(masters)], axis=1)
    over = np.stack([np.arange(slaves - 1), np.arange(1, slaves)], axis=1)
    under = slaves + np.stack([np.arange(1, masters), np.arange(masters - 1)], axis=1)
    skins = [Skin.of((Facets("line", nodes),), 0) for nodes in (over, under)]
    nodes = np.arange(slaves)
    free = np.ones((slaves, 2), dtype=bool)
    free[0, 0] = False
    return MortarPair(nodes, *skins, free), np.concatenate([upper, lower])


def moments(arms, forces):
    """Sum of the moments of forces (k, 2)."""
    return (arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()


def without(pair, node):
    """The pair without a row for a slave node: its neighbours take its share."""
    kept = pair.slaves != node
    return MortarPair(pair.slaves[kept], pair.slave, pair.master, pair.free[kept])


def told(meeting, earlier, force):
    """What has derivatives."""
    return [meeting.normals, meeting.distances * meeting.met[:, None],
            meeting.gap * meeting.met, meeting.averages.T @ force,
            meeting.couples.matrix @ force.ravel(), meeting.motion(earlier)]  # fmt: skip


def aside(pair, rest, far):
    """The meeting with the slave moved along by -far, where some of its nodes face nobody."""
    x = rest.copy()
    x[pair.slave.all, 0] -= far
    return pair.at(x)


@pytest.mark.parametrize(("left_out", "far"), [(None, 0.0), (2, 0.0), (None, 0.6)])
def test_slopes_are_exact_at_random_states(left_out, far):
    pair, rest = lines()
    pair = pair if left_out is None else without(pair, left_out)
    earlier, rng = aside(pair, rest, far), np.random.default_rng(0)
    checked = 0
    for _ in range(60):
        x, way = rest + 0.03 * rng.standard_normal(rest.shape), rng.standard_normal(rest.shape)
        here, behind, ahead = (pair.at(x + k * STEP * way) for k in (0, -1, 1))
        if not ((behind.met == ahead.met).all() and (here.met == ahead.met).all()):
            continue
        force = rng.standard_normal((len(here.met), 2)) * here.met[:, None]
        assert (here.met & ~earlier.met).any() == bool(far)
        assert (here.passed > 1.1).any() == (left_out is not None)
        slopes = here.slopes
        found = [one @ way.ravel() for one in (
            slopes.normals, slopes.distances, slopes.gap, slopes.spread(force),
            here.couples.slopes(force), slopes.motion(earlier),
        )]  # fmt: skip
        differences = (told(side, earlier, force) for side in (ahead, behind))
        for mine, after, before in zip(found, *differences, strict=True):
            difference = (after - before).ravel() / (2 * STEP)
            assert np.abs(mine - difference).max() < 1e-7 * np.abs(difference).max()
        checked += 1
    assert checked > 54


def test_forces_balance_and_rotations_are_no_slip():
    pair, rest = lines()
    rng = np.random.default_rng(1)
    x = rest + 0.02 * rng.standard_normal(rest.shape)
    here = pair.at(x)
    assert 4 <= here.met.sum() < len(here.met)
    force = rng.standard_normal((len(here.met), 2)) * here.met[:, None]
    spread = here.averages.T @ force
    assert np.abs(spread.sum(axis=0)).max() < 1e-14
    moment = moments(x, spread) - moments(here.distances, here.passed[:, None] * force)
    assert abs(moment) < 1e-14
    couples = (here.couples.matrix @ force.ravel()).reshape(x.shape)
    assert np.abs(couples.sum(axis=0)).max() < 1e-14
    assert abs(moments(x, spread + couples)) < 1e-14 < 1e-4 < abs(moments(x, spread))
    for angle in (0.3, 1.7, 3.0, -2.2):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        free = MortarPair(pair.slaves, pair.slave, pair.master, np.ones_like(pair.free))
        before, after = free.at(x), free.at(x @ turn.T + [3.0, -1.0])
        both = before.met
        assert (after.met == both).all()
        np.testing.assert_allclose(after.averages.toarray(), before.averages.toarray(),
                                   atol=1e-12)  # fmt: skip
        np.testing.assert_allclose(after.motion(before)[both], 0, atol=1e-13)
        np.testing.assert_allclose(after.gap[both], before.gap[both], atol=1e-13)


def test_motion_of_nodes_that_meet_anew_turns_with_the_master():
    pair, rest = lines()
    free = MortarPair(pair.slaves, pair.slave, pair.master, np.ones_like(pair.free))
    before, rng = aside(free, rest, 0.6), np.random.default_rng(4)
    x = rest + 0.02 * rng.standard_normal(rest.shape)
    here = free.at(x)
    new = here.met & ~before.met
    assert new.sum() >= 2
    own = here.motion(before)[new]
    assert np.linalg.norm(own, axis=1) == pytest.approx(0.6, rel=0.3)
    for angles in rng.uniform(-3, 3, (5, 2)):
        now, then = (np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
                     for a in angles)  # fmt: skip
        moved = free.at(x @ now.T + 1.0).motion(free.at(before.x @ then.T - 2.0))[new]
        np.testing.assert_allclose(moved, own @ now.T, atol=1e-13)
    # who goes with a stretch of the master does not move against it
    stretch = np.array([[1.2, 0.0], [0.1, 1.0]])
    far = before.x @ stretch.T
    far[pair.slave.all] += stretch @ (0.6, 0.0)
    met = free.at(far)
    at = met.motion(before)[met.met & ~before.met]
    np.testing.assert_allclose(at, np.tile(stretch @ (0.6, 0.0), (len(at), 1)), rtol=0.02)


def wheel(turned, *, swap, step=0.01):
    """A wheel of radius 1 that has rolled by an angle over a floor: (pair, positions).

    Its node at the angle a from the lowest point meets the floor's at a, turned by a.
    """
    at = np.arange(-30, 31) * step
    low, n = np.stack([at, 0 * at], axis=1), len(at)
    ring = np.stack([turned + np.sin(at - turned), 1 - np.cos(at - turned)], axis=1)
    facets = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    over = Skin.of((Facets("line", facets),), 0)
    under = Skin.of((Facets("line", facets[:, ::-1]),), n)
    sides = (under, over) if swap else (over, under)
    slaves = np.arange(n) + n * swap
    return MortarPair(slaves, *sides, np.ones((n, 2), dtype=bool)), np.concatenate([ring, low])


def test_a_wheel_that_rolls_has_no_slip_where_it_comes_down():
    way, place = 0.1, 40  # the node at that angle
    slips = []
    for swap in (False, True):
        pair, before = wheel(0.0, swap=swap)
        _, after = wheel(way, swap=swap)
        here, earlier = pair.at(after), pair.at(before)
        assert earlier.gap[place] > 0.9 * way**2 / 2
        slips.append(here.motion(earlier)[place, 0])
    # against one normal alone way^3 / 3 as the slave, and way^3 / 6 the other way as the floor
    assert np.abs(slips).max() < 1.3 * way**3 / 12


def two_blocks(top, *, mu, law=NEO, cells=(3, 5), swap=False, **options):
    """A block on a wider one, whose bottom is held."""
    n, m = cells
    lower = am.Body(am.box((2, 1), (m, 3), origin=(-0.5, -1)), law, name="lower")
    upper = am.Body(am.box((1, 1), n), law, name="upper")
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    pair = am.Contact(sides[0], master=sides[1], mu=mu, kinematics="finite", **options)
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)],
                    [pair])  # fmt: skip


@pytest.mark.parametrize("law", [NEO, SOFT])
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_the_tangent_is_exact(mu, swap, law):
    model = two_blocks(0, mu=mu, swap=swap, law=law)
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    before = 0.02 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.03], [1.0]] for _ in range(20))
    assert checked_tangents(problem, draws) > 12


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_patch(swap, mu):
    """Two blocks of meshes that do not match, 30 % shorter: one stretch everywhere."""
    lower = am.Body(am.box((1, 1), (5, 3), origin=(0, -1)), NEO, name="lower")
    upper = am.Body(am.box((1, 1), (3, 4), kind="tri"), NEO, name="upper")
    supports = [am.Fix("lower.bottom", (None, 0)), am.Fix("upper.top", (None, -0.6)),
                am.Fix("lower.left", (0, None)), am.Fix("upper.left", (0, None))]  # fmt: skip
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    pair = am.Contact(sides[0], master=sides[1], mu=mu, kinematics="finite")
    model = am.Model([lower, upper], supports, [pair])
    solution = am.solve(model, tolerance=1e-12)
    stretches = []
    for body, moved in zip(model.bodies, solution.displacement, strict=True):
        basis = np.c_[body.mesh.points, np.ones(len(body.mesh.points))]
        fit = np.linalg.lstsq(basis, moved, rcond=None)[0]
        assert np.abs(basis @ fit - moved).max() < 1e-10
        stretches.append(fit[:2])
    assert np.abs(stretches[0] - stretches[1]).max() < 1e-10
    assert np.ptp(solution.pressure) < 1e-10
    assert solution.convergence.iterations <= 6


def test_what_two_bodies_do_not_have_is_said():
    with pytest.raises(am.UnsupportedForm, match="method='mortar'"):
        am.solve(two_blocks((0, -0.1), mu=0.1, method="nodal"))


def test_meetings_outlast_a_step():
    """Parts without a law of their own are one object, which keeps where pairs have met."""
    model = two_blocks((0.0, -0.05), mu=0.3)
    parts = large_deformation(model).parts
    u = np.zeros(parts.X.shape)
    assert large_deformation(model).parts.meet(u) is parts.meet(u)


def test_the_work_of_a_step_does_not_depend_on_the_one_before():
    """Forces kept from the last step are those that a restart from its state computes."""
    model = two_blocks(lambda x, t: (0.2 * max(t - 1, 0), -0.05 * min(t, 1)), mu=0.3)
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=2.0))
    again = next(iter(am.evolve(model, am.QuasiStatic(0.5), until=2.0, start=steps[2].state)))
    assert again.energies == steps[3].energies
    np.testing.assert_array_equal(again.state.displacement, steps[3].state.displacement)
