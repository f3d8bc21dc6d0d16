"""Sphere packings: geometry, action and reaction, statics, seeds, refusals."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.packings import FLOOR, SpherePacking


@pytest.fixture(scope="module")
def packing():
    return SpherePacking(60, spread=0.2, mu=(0.3, 0.9), mu_wall=0.4, seed=2)


@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_spheres_touch_and_do_not_overlap(spread):
    made = SpherePacking(60, spread=spread, seed=5)
    c, r = made.centres, made.radii
    distance = np.linalg.norm(c[:, None] - c, axis=2) - r[:, None] - r
    distance[np.diag_indices(len(c))] = np.inf
    assert distance.min() > -1e-9 * made.radius
    assert (c > r[:, None] * (1 - 1e-9)).all()
    assert (c[:, :2] < made.edge - r[:, None] * (1 - 1e-9)).all()
    slave, master = made.pairs.T
    free = master >= 0
    np.testing.assert_allclose(distance[slave[free], master[free]], 0, atol=1e-9 * made.radius)
    low = slave[master == FLOOR]
    np.testing.assert_allclose(c[low, 2], r[low], rtol=1e-8)
    assert len(np.unique(np.sort(made.pairs, axis=1), axis=0)) == len(made.pairs)
    assert 2.3 < len(made.pairs) / made.count < 3.5
    assert len(set(r)) == (3 if spread else 1)


def test_every_sphere_above_the_floor_has_three_supports(packing):
    c, r = packing.centres, packing.radii
    touches = np.bincount(packing.pairs[packing.pairs >= 0].ravel(), minlength=packing.count)
    assert (touches[c[:, 2] > 1.001 * r] >= 3).all()


def test_frames_are_orthonormal_and_right_handed(packing):
    frames = packing.frames
    unit = np.broadcast_to(np.eye(3), frames.shape)
    np.testing.assert_allclose(frames @ frames.swapaxes(1, 2), unit, atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-14)
    slave, master = packing.pairs.T
    free = master >= 0
    along = packing.centres[slave[free]] - packing.centres[master[free]]
    assert ((along * frames[free, 0]).sum(axis=1) > 0).all()
    np.testing.assert_allclose(
        frames[master == FLOOR, 0], [[0, 0, 1]] * (master == FLOOR).sum()
    )


def test_reactions_between_spheres_change_no_momentum(packing):
    """Columns of H between two spheres balance in force and in moment about any point."""
    free = np.flatnonzero(packing.pairs[:, 1] >= 0)
    columns = (3 * free[:, None] + np.arange(3)).ravel()
    H = packing.H.toarray()[:, columns].reshape(packing.count, 6, -1)
    np.testing.assert_allclose(H[:, :3].sum(axis=0), 0, atol=1e-14)
    moment = np.cross(packing.centres[:, None], H[:, :3].swapaxes(1, 2)).swapaxes(1, 2)
    np.testing.assert_allclose((moment + H[:, 3:]).sum(axis=0), 0, atol=1e-14)


def test_rigid_motion_of_all_spheres_does_not_move_contacts_between_them(packing):
    free = packing.pairs[:, 1] >= 0
    spin, shift = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, 3.0])
    v = np.column_stack([shift + np.cross(spin, packing.centres), np.tile(spin, (60, 1))])
    u = (packing.H.T @ v.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(u[free], 0, atol=1e-14)
    floor = packing.pairs[:, 1] == FLOOR
    slave = packing.pairs[floor, 0]
    foot = packing.centres[slave] - [0, 0, 1] * packing.radii[slave, None]
    np.testing.assert_allclose(u[floor, 0], (shift + np.cross(spin, foot))[:, 2], atol=1e-14)


def test_impulses_of_floor_and_walls_carry_the_weight_of_what_rests(packing):
    """Momentum of the whole packing: weight times step, less what is still moving."""
    step = 1e-3
    problem = packing.problem(step)
    solution = am.solve(problem, tolerance=1e-8)
    held = packing.pairs[:, 1] < 0
    force = np.einsum("ik,ikc->c", solution.r[held], packing.frames[held])
    moved = packing.masses @ solution.v.reshape(-1, 6)[:, :3]
    weight = packing.masses.sum() * packing.gravity * step
    np.testing.assert_allclose(force + [0, 0, -weight], moved, atol=1e-6 * weight)
    assert force[2] > 0.95 * weight


def test_a_pyramid_at_rest_stays_at_rest():
    """With friction high enough the floor carries all of the weight."""
    packing = SpherePacking(12, width=0.2, mu=2.0, seed=1)
    solution = am.solve(packing.problem(), tolerance=1e-9)
    floor = packing.pairs[:, 1] == FLOOR
    weight = packing.masses.sum() * packing.gravity * 1e-3
    assert solution.r[floor, 0].sum() == pytest.approx(weight, rel=1e-6)


def test_seeds(packing):
    again = SpherePacking(60, spread=0.2, mu=(0.3, 0.9), mu_wall=0.4, seed=2)
    np.testing.assert_array_equal(packing.centres, again.centres)
    np.testing.assert_array_equal(packing.problem().mu, again.problem().mu)
    other = SpherePacking(60, spread=0.2, seed=3)
    assert abs(packing.centres - other.centres).max() > packing.radius
    mu, wall = packing.problem().mu, packing.pairs[:, 1] < FLOOR
    assert wall.any()
    assert (mu[wall] == 0.4).all()
    assert 0.3 <= mu[~wall].min() < mu[~wall].max() <= 0.9


def test_shaken_packings_move(packing):
    quiet, shaken = packing.problem(), packing.problem(shake=0.1)
    mass = quiet.M.diagonal()
    assert np.std(((shaken.f - quiet.f) / mass).reshape(-1, 6)[:, :3]) == pytest.approx(
        0.1, rel=0.3
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"count": 0}, "count: expected a whole number >= 1"),
        ({"count": 2.5}, "count: expected a whole number"),
        ({"radius": 0}, "radius: expected a number > 0"),
        ({"spread": 0.5}, "spread: expected a number from 0"),
        ({"mu": -1.0}, "mu: expected a number >= 0"),
        ({"mu": (0.5, 0.3)}, "mu: expected a number >= 0, or bounds"),
        ({"mu_wall": float("nan")}, "mu_wall: expected"),
        ({"width": 0.01}, "width: expected a number >= 0.04, two spheres"),
    ],
)
def test_bad_packings_are_named(changes, words):
    with pytest.raises(am.InvalidInput, match=words):
        SpherePacking(**({"count": 5} | changes))


def test_bad_steps_are_named():
    with pytest.raises(am.InvalidInput, match="step: expected a number > 0"):
        SpherePacking(3).problem(step=0)
    with pytest.raises(am.InvalidInput, match="shake: expected"):
        SpherePacking(3).problem(shake=-1)
