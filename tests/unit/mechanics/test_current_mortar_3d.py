"""Two surfaces in space where they are now: slopes, also beside edges, rotations, momentum."""

import numpy as np
import pytest

from amontons.mechanics.contact.current_mortar import MortarPair
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.meshes import Facets

STEP = 1e-7


def grid(n, size, at, *, split=False, down=False):
    """n x n facets over a square with its corner at (x, y, z): (facets, points)."""
    line = np.linspace(0, size, n + 1)
    x, y = (values.ravel() for values in np.meshgrid(line, line, indexing="ij"))
    points = np.stack([x, y, np.zeros(len(x))], axis=1) + at
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    first = i * (n + 1) + j
    quads = np.stack([first, first + n + 1, first + n + 2, first + 1], axis=1)
    quads = quads[:, ::-1] if down else quads
    if split:
        return Facets("tri", np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])), points
    return Facets("quad", quads), points


def surfaces(*, split=(False, False), apart=0.02):
    """A square over a wider one, whose edge it passes: (pair, positions)."""
    over, upper = grid(3, 1.2, (0.3, 0.2, apart), split=split[0], down=True)
    under, lower = grid(3, 1.1, (0, 0, 0), split=split[1])
    skins = [Skin.of((over,), 0), Skin.of((under,), len(upper))]
    nodes = np.arange(len(upper))
    return (MortarPair(nodes, *skins, np.ones((len(nodes), 3), dtype=bool)),
            np.concatenate([upper, lower]))  # fmt: skip


def told(meeting, earlier, force):
    """What has derivatives."""
    return [meeting.normals, meeting.distances * meeting.met[:, None],
            meeting.gap * meeting.met, meeting.averages.T @ force,
            meeting.couples.matrix @ force.ravel(), meeting.motion(earlier)]  # fmt: skip


def alike(one, other):
    """Whether the same facets face each other, and the same nodes carry force."""
    same = one.met.tolist() == other.met.tolist()
    return same and all(
        getattr(one.shared, name).tolist() == getattr(other.shared, name).tolist()
        for name in ("slave", "master", "kept")
    )


def worst_slope(pair, earlier, x, way, rng):
    """Largest relative error of all slopes along a way; None where they have a kink."""
    here, behind, ahead = (pair.at(x + k * STEP * way) for k in (0, -1, 1))
    if not all(alike(here, side) for side in (behind, ahead)):
        return None
    force = rng.standard_normal((len(here.met), 3)) * here.met[:, None]
    slopes = here.slopes
    found = [one @ way.ravel() for one in (
        slopes.normals, slopes.distances, slopes.gap, slopes.spread(force),
        here.couples.slopes(force), slopes.motion(earlier))]  # fmt: skip
    sides = (told(side, earlier, force) for side in (ahead, behind))
    worst = 0.0
    for mine, after, before in zip(found, *sides, strict=True):
        difference = (after - before).ravel() / (2 * STEP)
        worst = max(worst, np.abs(mine - difference).max() / np.abs(difference).max())
    return worst


def aside(pair, rest):
    """The meeting with the slave moved along, where some of its nodes face nobody."""
    x = rest.copy()
    x[pair.slave.all] += (-0.75, 0.1, 0.05)
    return pair.at(x)


def put_beside_edges(pair, x, rng):
    """Moves slave nodes to 1e-4 beside nodes and middles of edges of the master; how many."""
    at = x[pair.master.nodes]
    marks = np.concatenate([at, (at + np.roll(at, 1, axis=1)) / 2]).reshape(-1, 3)[:, :2]
    apart = np.linalg.norm(x[pair.slaves, None, :2] - marks, axis=2)
    near = apart.min(axis=1) < 0.12
    x[pair.slaves[near], :2] = marks[apart.argmin(axis=1)[near]]
    x[pair.slaves[near], :2] += 1e-4 * rng.standard_normal((near.sum(), 2))
    return int(near.sum())


@pytest.mark.parametrize("split", [(False, False), (True, False), (False, True), (True, True)])
def test_slopes_at_random_states(split):
    """Also of states whose nodes lie 1e-4 of a facet beside an edge of the other side.

    At the end of the last step some of them faced nobody.
    """
    pair, rest = surfaces(split=split)
    earlier, rng = aside(pair, rest), np.random.default_rng(0)
    assert (pair.at(rest).met & ~earlier.met).sum() > 2
    errors, beside = [], 0
    for k in range(60):
        x = rest + 0.03 * rng.standard_normal(rest.shape)
        if k % 2:
            beside += put_beside_edges(pair, x, rng)
        worst = worst_slope(pair, earlier, x, rng.standard_normal(rest.shape), rng)
        if worst is not None:
            errors.append(worst)
    assert len(errors) > 50
    assert beside > 60
    assert max(errors) < 1e-7


def test_slopes_where_a_node_meets_a_node():
    """As a millionth of a facet beside it, but for the kinks of warped facets.

    The shared parts have corners that coincide up to rounding; old slopes missed by half.
    """
    for seed, noise in enumerate((0.0, 1e-16, 1e-14, 1e-12) * 2):
        rng = np.random.default_rng(seed)
        pair, rest = surfaces(apart=0.0)
        rest[:, 2] += 0.03 * rng.standard_normal(len(rest))
        p, way, found = pair.slaves[5], rng.standard_normal(3), []
        q = pair.master.all[
            np.linalg.norm(rest[pair.master.all] - rest[p], axis=1).argmin()
        ]
        for beside in (noise, 1e-6):
            x = rest.copy()
            x[p] = x[q] + beside * way
            here = pair.at(x)
            force = np.ones(here.normals.shape) * here.met[:, None]
            found.append(here.slopes.spread(force).toarray())
        assert np.abs(found[0] - found[1]).max() < 1e-2 * np.abs(found[1]).max()


@pytest.mark.parametrize("split", [(False, False), (True, True)])
def test_forces_balance_and_rotations_change_nothing(split):
    pair, rest = surfaces(split=split)
    rng = np.random.default_rng(1)
    x = rest + 0.02 * rng.standard_normal(rest.shape)
    here = pair.at(x)
    assert 4 <= here.met.sum() < len(here.met)
    force = rng.standard_normal((len(here.met), 3)) * here.met[:, None]
    spread = here.averages.T @ force
    assert np.abs(spread.sum(axis=0)).max() < 1e-14
    far = here.distances * here.passed[:, None]
    moment = np.cross(x, spread).sum(axis=0) - np.cross(far, force).sum(axis=0)
    assert np.abs(moment).max() < 1e-14
    couples = (here.couples.matrix @ force.ravel()).reshape(x.shape)
    assert np.abs(couples.sum(axis=0)).max() < 1e-14
    for _ in range(5):
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        after = pair.at(x @ turn.T + [3.0, -1.0, 2.0])
        assert (after.met == here.met).all()
        np.testing.assert_allclose(after.averages.toarray(), here.averages.toarray(),
                                   atol=1e-11)  # fmt: skip
        both = here.met
        np.testing.assert_allclose(after.motion(here)[both], 0, atol=1e-11)
        np.testing.assert_allclose(after.gap[both], here.gap[both], atol=1e-12)
        np.testing.assert_allclose(after.normals, here.normals @ turn.T, atol=1e-12)


@pytest.mark.parametrize("split", [(False, False), (True, True)])
def test_motion_of_nodes_that_meet_anew_turns_with_the_master(split):
    """Whatever everything turned by in the step; in fixed axes it was off by as much."""
    pair, rest = surfaces(split=split)
    before, rng = aside(pair, rest), np.random.default_rng(3)
    x = rest + 0.02 * rng.standard_normal(rest.shape)
    here = pair.at(x)
    new = here.met & ~before.met
    own = here.motion(before)[new]
    assert np.linalg.norm(own, axis=1) == pytest.approx(0.75, rel=0.3)
    for _ in range(3):
        now, then = (turn * np.sign(np.linalg.det(turn)) for turn in
                     np.linalg.qr(rng.standard_normal((2, 3, 3)))[0])  # fmt: skip
        earlier = pair.at(before.x @ then.T - 2.0)
        moved = pair.at(x @ now.T + [3.0, -1.0, 2.0]).motion(earlier)[new]
        np.testing.assert_allclose(moved, own @ now.T, atol=1e-11)


def test_forces_have_no_moment_and_couples_vanish_as_gaps_do():
    """Of sides that touch all along there are none, of bent ones some of force times gap."""
    pair, rest = surfaces(apart=0.0)
    rng = np.random.default_rng(2)
    flat = rest.copy()
    flat[:, :2] += 0.02 * rng.standard_normal(flat[:, :2].shape)
    for bend, limit in ((0.0, 1e-14), (0.1, None)):
        x = flat.copy()
        x[:, 2] += bend * (flat[:, 0] - 0.5) ** 2
        here = pair.at(x)
        force = here.normals * here.met[:, None]
        spread = here.averages.T @ force
        couples = (here.couples.matrix @ force.ravel()).reshape(x.shape)
        assert np.abs(np.cross(x, spread + couples).sum(axis=0)).max() < 1e-14
        moment = np.abs(np.cross(x, spread).sum(axis=0)).max()
        along = np.linalg.norm(here.distances[here.met], axis=1).sum()
        assert moment < (along if limit is None else limit)
        if limit is None:
            # the part along the normal makes none
            across = here.distances - here.normals * here.gap[:, None]
            left = np.linalg.norm(across[here.met], axis=1).sum()
            assert moment <= left + 1e-14
            assert left < 0.2 * along + 1e-3


def test_slopes_of_surfaces_that_face_nothing_are_those_of_the_normals_alone():
    pair, x = surfaces()
    away = x.copy()
    away[: len(pair.slaves), 0] += 10
    here = pair.at(away)
    assert not here.met.any()
    slopes, force = here.slopes, np.ones((len(here.met), 3))
    assert slopes.distances.nnz == slopes.gap.nnz == 0
    assert slopes.pushed(force * here.met[:, None]).nnz == here.couples.matrix.nnz == 0
    way = np.random.default_rng(0).standard_normal(x.shape)
    turned = (pair.at(away + STEP * way).normals - pair.at(away - STEP * way).normals)
    np.testing.assert_allclose(slopes.normals @ way.ravel(), turned.ravel() / (2 * STEP),
                               atol=1e-6)  # fmt: skip
    assert slopes.motion(here).nnz == 0  # there is nobody to move against


@pytest.mark.parametrize("split", [(False, False), (True, True)])
@pytest.mark.parametrize("side", ["slave", "master"])
def test_facets_that_are_points_have_finite_slopes(side, split):
    """Nodes of a corner of a surface all in one place: no division by a size of nothing."""
    pair, rest = surfaces(split=split)
    earlier, x, skin = aside(pair, rest), rest.copy(), getattr(pair, side)
    shrunk = skin.nodes[(rest[skin.nodes, :2].max(axis=1) < 0.75).all(axis=1)]
    x[np.unique(shrunk)] = x[shrunk[0, 0]]
    force = np.ones((len(pair.slaves), 3))
    with np.errstate(divide="raise", invalid="raise"):
        here = pair.at(x)
        slopes = here.slopes
        values = told(here, earlier, force) + [each.toarray() for each in (
            slopes.normals, slopes.distances, slopes.gap, slopes.spread(force),
            here.couples.slopes(force), slopes.motion(earlier))]  # fmt: skip
    assert here.met.any()
    assert all(np.isfinite(each).all() for each in values)
