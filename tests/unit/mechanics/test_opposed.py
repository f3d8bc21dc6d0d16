"""Facets that do not face each other: how much they count, and where they do not at all."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from amontons.mechanics.contact.facet_integrals import FacetPairs

STEP = 1e-5
DIFFERENCE = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
OVER = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]])
UNDER = np.array([[-0.6, -0.4], [0.6, -0.4], [0.6, 0.6], [-0.6, 0.6]])


def pair_of(dim, angle, along=0.0, up=0.5, warp=0.0):
    """A facet that looks down, turned by an angle (degrees) and moved, over a master."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    over, under = (OVER, UNDER) if dim == 3 else (OVER[[0, 2], :1], UNDER[[1, 0], :1])
    slave = np.concatenate([c * over[:, :1] + along, over[:, 1:], s * over[:, :1] + up], axis=1)
    master = np.concatenate([under, np.zeros((len(under), 1))], axis=1)
    master[0, -1] += warp
    count, flat = np.array([len(slave)]), np.array([0])
    return FacetPairs(slave[None], count, master[None], count, flat, flat, (0, 0))


@pytest.mark.parametrize("dim", [2, 3])
def test_what_the_master_does_not_see_does_not_count_beyond_60_degrees(dim):
    """Where no normal of the master meets a facet, it sees that in front all the same."""
    for angle in (0, 20, 44.9):
        assert pair_of(dim, angle).opposed == 1.0
    for angle in (60.1, 75, 89):
        below = 0.5 * np.sin(np.radians(angle)) - 0.1  # its foot is below the master's plane
        beside = pair_of(dim, -angle, 1.2, below)
        assert beside._times(np.ones(1))[0].sum() > 0
        assert beside.opposed == 0.0
        assert not beside.integrals()[0].any()
    half = [pair_of(dim, angle, 0.1).opposed[0] for angle in (50, 65, 75, 85, 89)]
    assert half[:2] == pytest.approx([1, 1], abs=0.05)
    assert (np.diff(half) <= 0).all()
    assert half[-1] < 1e-3


@pytest.mark.parametrize("dim", [2, 3])
def test_slopes_are_exact_and_turns_change_nothing(dim):
    rng, fading = np.random.default_rng(0), 0
    for angle in np.linspace(40, 88, 25):
        pair = pair_of(dim, -angle, 0.5, warp=0.02 * (dim - 2))
        sides = {name: rng.standard_normal(getattr(pair, name).shape)
                 for name in ("slave", "master")}  # fmt: skip
        moved = {k: replace(pair, **{name: getattr(pair, name) + k * STEP * way
                                     for name, way in sides.items()})
                 for k in DIFFERENCE}  # fmt: skip
        way = np.concatenate([sides["slave"], sides["master"]], axis=1).ravel()
        for own, name in zip((pair.opposed_slopes(), *pair.slopes()),
                             ("opposed", "mass", "cross"), strict=True):  # fmt: skip
            values = {k: dict(zip(("mass", "cross"), side.integrals(), strict=True),
                              opposed=side.opposed)[name] for k, side in moved.items()}
            change = sum(part * values[k] for k, part in DIFFERENCE.items()) / STEP
            assert np.abs(own @ way - change).max() <= 1e-7 * max(1, np.abs(change).max())
        turn = (Rotation.random(rng=1).as_matrix() if dim == 3
                else np.array([[0.6, -0.8], [0.8, 0.6]]))  # fmt: skip
        turned = replace(pair, slave=pair.slave @ turn.T, master=pair.master @ turn.T)
        assert turned.opposed == pytest.approx(pair.opposed, abs=1e-12)
        fading += 0 < pair.opposed[0] < 1
    assert fading > 10
